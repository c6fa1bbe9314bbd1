"""Ranking of causes: how clearly each shows (pull) and how much it would change the answer (impact), one row a cause.

Pull is the score z of the omitted cause, about N(0, 1) if it is absent. Impact is the relative shift of f_EI if the
cause is put into the model. The two are unrelated, so both stand side by side, as in the rankings of particle
physics.
"""

from __future__ import annotations

from matplotlib.axes import Axes

from pipeline.report.canvas import LIGHT, NOISE, Area, finish, label_width, plot_area
from pipeline.report.ruling import Ruling
from pipeline.report.words import Words
from pipeline.result import CauseRow, DiagnosisPart

ROW_PX = 21.0


def impossible(row: CauseRow) -> bool:
    """Whether an estimate has a sign that its cause cannot have: loud, and yet p is 1."""
    return row.p_adjusted >= 1.0 and abs(row.z) > NOISE


def ranked(diagnosis: DiagnosisPart) -> list[CauseRow]:
    """Causes by p value, then by pull; those of an impossible sign last."""
    return sorted(diagnosis.table, key=lambda row: (impossible(row), row.p_adjusted, -abs(row.z)))


def ranking_height(diagnosis: DiagnosisPart) -> float:
    """Height of the figure in px."""
    return 54.0 + ROW_PX * len(diagnosis.table)


def draw_ranking(figure: Area, diagnosis: DiagnosisPart, words: Words) -> Axes:
    """Draw pull (left) and impact on f_EI in percent (right); named causes are emphasised."""
    rows, width = ranked(diagnosis), figure.bbox.width
    named = {name for cause in diagnosis.causes for name in (cause.name, *cause.class_)}
    labels = [words.cause(row.name) for row in rows]
    left = label_width(labels, most=0.45 * width)
    middle = left + 0.5 * (width - left - 12.0)
    pull = plot_area(figure, left=left, right=width - middle + 6.0, top=8.0)
    impact = plot_area(figure, left=middle + 6.0, top=8.0)
    roles = ("alarm" if row.name in named else "grid" if impossible(row) else "muted" for row in rows)
    colours = [LIGHT[role] for role in roles]
    places = range(len(rows))
    pull.axvspan(-NOISE, NOISE, color=LIGHT["unvisited"], alpha=0.16, lw=0.0)
    pull.barh(places, [row.z for row in rows], color=colours, height=0.62)
    shifts = [100.0 * (row.stiffness_shift or 0.0) for row in rows]
    impact.barh(places, shifts, color=colours, height=0.62)
    limit = max([2.0 * NOISE, *(1.1 * abs(row.z) for row in rows)])
    pull.set_xlim(-limit, limit)
    reach = max([1.0, *(1.1 * abs(shift) for shift in shifts)])
    impact.set_xlim(-reach, reach)
    for axes in (pull, impact):
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.axvline(0.0, color=LIGHT["muted"], lw=0.8)
    causes = Ruling(at=tuple(places), labels=tuple(labels), grid=False, mark=0.0)
    finish(pull, words, x=Ruling(words("axis_pull"), most=4), y=causes)
    unnamed = Ruling(at=tuple(places), grid=False, labelled=False)
    finish(impact, words, x=Ruling(words("axis_impact"), most=4), y=unnamed)
    return pull

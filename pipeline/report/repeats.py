"""Repeat specimens of one cable type on the index: a sentence and a figure a type."""

from __future__ import annotations

from itertools import groupby
from operator import itemgetter

from matplotlib.axes import Axes

from pipeline.report.canvas import LIGHT, Area, Drawing, drawing, finish, plot_area
from pipeline.report.figures import band_width
from pipeline.report.pooling import Pooled, pool
from pipeline.report.words import Words
from pipeline.settings import ReportSettings
from pipeline.units import Unit
from pipeline.visited import Visited


def repeats(
    specimens: list[tuple[str, Visited]], unit: Unit, words: Words, settings: ReportSettings
) -> list[dict[str, object]]:
    """Repeat specimens by type, most specimens first.

    Parameters
    ----------
    specimens : list of (type, characteristic)
    unit : Unit
        Of bending stiffness, for all of the index.
    words : Words
    settings : ReportSettings

    Returns
    -------
    list of dict
        ``type``, ``text`` (a sentence) and ``figure`` (None after the first types).
    """
    ordered = sorted(specimens, key=itemgetter(0))
    groups = [(name, [curve for _, curve in group]) for name, group in groupby(ordered, key=itemgetter(0))]
    entries: list[dict[str, object]] = []
    for name, curves in sorted(groups, key=lambda group: -len(group[1])):
        together = pool(curves)
        if together is None:
            continue
        figure = None
        if len(entries) < settings.pooled_types_drawn:
            figure = _pooled_figure(f"pooled-{len(entries)}", name, together, curves, unit, words, settings)
        entries.append(
            {"type": name, "text": _pooled_text(together, len(curves), unit, words, settings), "figure": figure}
        )
    return entries


def _pooled_text(pooled: Pooled, count: int, unit: Unit, words: Words, settings: ReportSettings) -> str:
    """Mean, scatter against own errors, and whether the specimens differ."""
    differ = pooled.p_value < settings.pooled_p_value
    return words(
        "index_pooled_text",
        count=count,
        low=words.curvature(pooled.kappa[0]),
        high=words.curvature(pooled.kappa[-1]),
        mean=unit.text(pooled.stiffness, pooled.stiffness_std),
        scatter=words.number(100.0 * pooled.scatter_relative, 2),
        own=words.number(100.0 * pooled.error_relative, 2),
        verdict=words("pooled_differ" if differ else "pooled_same", p=words.probability(pooled.p_value, name="p")),
    )


def _pooled_figure(
    key: str,
    name: str,
    pooled: Pooled,
    curves: list[Visited],
    unit: Unit,
    words: Words,
    settings: ReportSettings,
) -> Drawing:
    """Draw the single curves, the scatter between specimens, and the mean with its band."""

    def draw(figure: Area) -> Axes:
        axes, half = plot_area(figure), band_width(settings)
        for index, curve in enumerate(curves[:40]):  # more lines than that are a blot
            label = words("pooled_single") if index == 0 else None
            axes.plot(curve.kappa, unit.factor * curve.tangent, color=LIGHT["muted"], lw=0.7, alpha=0.6, label=label)
        for spread, alpha, label in ((pooled.scatter, 0.14, "pooled_scatter"), (pooled.std, 0.3, "pooled_mean")):
            low, high = (unit.factor * (pooled.mean + sign * half * spread) for sign in (-1.0, 1.0))
            axes.fill_between(pooled.kappa, low, high, color=LIGHT["inverse"], alpha=alpha, lw=0.0, label=words(label))
        axes.plot(pooled.kappa, unit.factor * pooled.mean, color=LIGHT["inverse"], lw=2.2)
        axes.set_ylim(bottom=0.0)
        y = words("axis_stiffness", unit=unit.symbol)
        return finish(axes, x=words("axis_kappa"), y=y, decimal=words.decimal, legend=3)

    return drawing(key, draw, title=name, description=words("pooled_alt", count=len(curves), type=name))

"""The diagnosis on the page: causes, ranking, twins, maps before and after, gain, blind spots, next experiment."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

from pipeline.messages import Message
from pipeline.report import maps, ranking
from pipeline.report.canvas import Drawing, drawing
from pipeline.report.evidence import residual_map, titled
from pipeline.report.words import Words
from pipeline.result import CauseRow, DiagnosisPart, NextExperiment, ResidualMap, Result, TwinPart

# A probability or share is worth two digits: studies of hundreds of specimens do not know it better.
SHARE_DIGITS = 2
NOTHING = "–"


@dataclass(frozen=True)
class NamedCause:
    """A cause that was found: its size and probability in a line, what it is, and what to do about it."""

    line: str
    summary: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class DiagnosisView:
    """Texts, rows and figures of the section on the diagnosis."""

    unexplained: bool = False
    named: list[NamedCause] = field(default_factory=list)
    gain: list[str] = field(default_factory=list)
    heads: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)
    blind_spots: list[str] = field(default_factory=list)
    next_what: str = ""
    next_separates: str = ""
    leftover: list[str] = field(default_factory=list)
    figures: dict[str, Drawing] = field(default_factory=dict)

    @property
    def examined(self) -> bool:
        """Whether there is more to show than the headline."""
        return bool(self.rows or self.figures or self.blind_spots or self.leftover or self.next_what)


def diagnosis_view(result: Result, words: Words, *, figures: bool = True) -> DiagnosisView | None:
    """Everything the page says about the diagnosis, its figures only if asked for; None if there is none to be used."""
    part = result.diagnosis
    if part is None or not result.answer.usable:
        return None
    following = part.next_experiment
    heads, rows = [words(f"col_{key}") for key in COLUMNS], [_row(row, words) for row in ranking.ranked(part)]
    return DiagnosisView(
        unexplained=part.verdict == "unexplained",
        named=_named(part, words),
        gain=_gain(part, words),
        heads=heads,
        rows=rows,
        blind_spots=[words.blind_spot("blind_row", spot) for spot in part.could_hide],
        next_what=words.said(following.said).sentence if following else "",
        next_separates=_separates(following, words) if following else "",
        leftover=_leftover(part, words),
        figures=_figures(result, part, words) if figures else {},
    )


def _separates(experiment: NextExperiment, words: Words) -> str:
    """What an experiment separates, or settles if it is one cause alone, and how well beside plain repetition."""
    said, names = [], ", ".join(words.cause(name) for name in experiment.separates)
    if names:
        said.append(words("next_separates" if len(experiment.separates) > 1 else "next_settled", names=names))
    if experiment.sigma is not None and experiment.repeated_sigma is not None:
        sigma, repeated = (words.number(value, 2) for value in (experiment.sigma, experiment.repeated_sigma))
        said.append(words("next_sigma", sigma=sigma, repeated=repeated))
    return " ".join(said)


def _named(part: DiagnosisPart, words: Words) -> list[NamedCause]:
    """Name, probability, estimate and twins of a cause, and what to do; not of one that does not suffice."""
    named = []
    for cause in part.causes:
        size, std, unit = cause.stated
        estimate = words.unit(unit, size).text(size, std)
        share = words("probability_of", share=_share(cause.probability, words))
        if part.verdict == "unexplained":  # a probability among causes of which none suffices says nothing
            share = words("does_not_suffice")
        line = f"{words.cause(cause.name)}: {estimate} ({share})"
        if forms := cause.in_what_form(words.language):
            line += f"; {words('form_of', forms=', '.join(forms))}"
        settled = {twin.name: twin for twin in cause.twins}
        alike = [name for name in cause.class_ if name != cause.name]
        fitting = [name for name in settled if name not in cause.class_]
        for key, names in (("same_class", alike), ("fits_too", fitting[:LIKELIEST])):
            if names:
                line += f"; {words(key, names=', '.join(_twin(name, settled.get(name), words) for name in names))}"
        about = ("", "") if part.verdict == "unexplained" else words.about(cause.name)
        named.append(NamedCause(line, *about))
    return named


LIKELIEST = 3
"""Other names that are told where no more than noise is left by them; all are in result.json."""


def _twin(name: str, twin: TwinPart | None, words: Words) -> str:
    """Another name for a cause; how likely it is and what settles it, where it was tried."""
    if twin is None:
        return words.cause(name)
    share = _share(twin.probability, words)
    return words("other_name", name=words.cause(name), share=share, settled=words.settled(name))


LEAST_SHARE, MOST_SHARE = 1e-3, 0.99
"""Probabilities below and above which the size is not told: nothing hangs on it, and none is certain."""


def _share(probability: float, words: Words) -> str:
    """A probability in per cent."""
    shown = words.number(100.0 * min(max(probability, LEAST_SHARE), MOST_SHARE), SHARE_DIGITS)
    return f"{'< ' if probability < LEAST_SHARE else '> ' if probability > MOST_SHARE else ''}{shown}"


def _gain(part: DiagnosisPart, words: Words) -> list[str]:
    """What the extension bought on held-out steps."""
    gain = part.gain
    if gain is None:
        return []

    def pair(values: tuple[float, float], symbol: str) -> str:
        unit = words.unit(symbol, *values)
        return f"{words.number(unit.factor * values[0])} → {unit.plain(values[1])}"

    percent = [words.number(100.0 * v, SHARE_DIGITS) for v in (gain.heldout_excess_removed, *gain.ci95)]
    return [
        words("gain_text", share=percent[0], low=percent[1], high=percent[2]),
        words("gain_rmse", force=pair(gain.force_rmse_N, "N"), shape=pair(gain.shape_rmse_m, "m")),
    ]


COLUMNS = ("cause", "twin", "pull", "p", "estimate", "detectable", "survives", "heldout", "shift")
"""Of the table of causes: names, twins, then numbers."""


def _row(row: CauseRow, words: Words) -> list[str]:
    """Row of the table of causes; one that these data cannot see at all (its error is 0) has no numbers."""

    def percent(value: float | None) -> str:
        return NOTHING if value is None else words.number(100.0 * value, SHARE_DIGITS)

    seen, least = row.std > 0.0, row.minimal_detectable
    chance = words("impossible_sign") if ranking.impossible(row) else words.probability(row.p_adjusted)
    return [
        words.cause(row.name),
        f"{words.cause(row.nearest_twin)} ({words.fixed(abs(row.twin_cosine), 2)})" if row.nearest_twin else NOTHING,
        words.fixed(row.z, 1) if seen else NOTHING,
        chance if seen else NOTHING,
        words.unit(row.unit, row.estimate, row.std).text(row.estimate, row.std) if seen else NOTHING,
        NOTHING if least is None else _range(least, row.detectable_in_any_form, row.unit, words),
        percent(row.surviving_fraction),
        percent(row.heldout_excess_removed),
        percent(row.stiffness_shift),
    ]


def _range(least: float, most: float | None, unit: str, words: Words) -> str:
    """Amounts from which a cause shows: in its clearest form, and whatever form it has if that is known."""
    scale = words.unit(unit, least)
    low = scale.plain(least, SHARE_DIGITS)
    if most is None:
        return words("from_on", low=low)
    high = scale.plain(max(most, least), SHARE_DIGITS)
    return high if low == high else f"{words.number(scale.factor * least, SHARE_DIGITS)} – {high}"


def _leftover(part: DiagnosisPart, words: Words) -> list[str]:
    """Sentences on what is left where anything was found: where it sits, unless noise leaves as much."""
    left = part.leftover
    if left is None or part.verdict == "adequate":
        return []
    if left.probability < LIKELY:
        return [words("leftover_noise", share=_share(left.probability, words))]
    noise = [] if left.noise_factor == 1.0 else [Message("left.noise", factor=left.noise_factor)]
    return [words.said(said).sentence for said in (left.said, *noise)]


LIKELY = 0.5
"""Probability of something else from which its place and pattern are told: below, they mean nothing."""


def _figures(result: Result, part: DiagnosisPart, words: Words) -> dict[str, Drawing]:
    """Ranking, cosines, maps before and after."""
    drawn: dict[str, Drawing] = {}
    if part.table:
        draw = partial(ranking.draw_ranking, diagnosis=part, words=words)
        drawn["ranking"] = titled("ranking", draw, words, size=(400.0, ranking.ranking_height(part)))
    if part.twins:
        cosines = partial(maps.draw_cosines, cosines=part.twins, words=words)
        drawn["cosines"] = titled("cosines", cosines, words, size=(400.0, 380.0), pair=_closest(part.twins, words))
    before, after = part.residuals_before, part.residuals_after
    # where the extended model does not answer, the map among the mechanics is the one before
    if before is not None and after is not None and result.answer.method == "extended":
        drawn.update(_before_and_after(before, after, words))
    pattern = part.leftover
    if pattern is not None and part.verdict != "adequate" and pattern.probability >= LIKELY and any(pattern.shape_m):
        left = partial(maps.draw_leftover, s_m=pattern.s_m, shape_m=pattern.shape_m, words=words)
        told = {"title": words("leftover"), "description": words("fig_leftover_alt")}
        drawn["leftover"] = drawing("leftover", left, size=(400.0, 180.0), **told)
    return drawn


def _before_and_after(before: ResidualMap, after: ResidualMap, words: Words) -> dict[str, Drawing]:
    """What was left of shapes before the extension, and of forces before and after."""
    drawn = {"before": residual_map("map-before", before, words, title="fig_map_before")}
    if any(value is not None for value in before.force_sigma):
        draw = partial(maps.draw_force_rest, before=before, after=after, words=words)
        left = (
            "; ".join(NOTHING if value is None else words.number(value, 2) for value in residuals.force_sigma)
            for residuals in (before, after)
        )
        told = " → ".join(filter(None, left))
        drawn["force_rest"] = titled("force-rest", draw, words, key="force_rest", size=(400.0, 240.0), values=told)
    return drawn


def _closest(twins: dict[str, dict[str, float]], words: Words) -> str:
    """The pair of causes that are most alike."""
    pairs = [(abs(c), a, b) for a, row in twins.items() for b, c in row.items() if a != b]
    if not pairs:
        return NOTHING
    cosine, a, b = max(pairs)
    return f"{words.cause(a)}, {words.cause(b)} ({words.number(cosine)})"

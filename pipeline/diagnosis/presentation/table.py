"""All causes of the catalogue side by side: how clearly each is seen, how large it would be, what it would do to f_EI.

A cause may be seen clearly and leave f_EI alone, or spoil it unseen (a blind spot); the table of cosines says which
causes cannot be told apart.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.diagnosis.causes.law import LAW
from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.fits.extended import stiffness_change, stiffness_change_linear
from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.detectable import detectable
from pipeline.diagnosis.posterior.explanation import Explanation
from pipeline.diagnosis.statistics.score import adjusted_p
from pipeline.diagnosis.statistics.twins import nearest
from pipeline.messages import entry
from pipeline.result import BlindSpot, CauseRow, GainPart
from pipeline.settings.diagnosis import DiagnosisSettings

TWINS_SHOWN = 8
"""Causes in the table of cosines; more cannot be read."""


def table(
    bench: Workbench, conclusion: Conclusion, settings: DiagnosisSettings, *, gain: GainPart | None
) -> list[CauseRow]:
    """One row for every cause, the loudest first; ``gain`` is that of the accepted explanation."""
    twin, closeness = nearest(bench.suspicion.closeness())
    refitted = {e.causes[0]: e for e in conclusion.singles}
    found_from = detectable(conclusion.grid, bench.observation, bench.base, bench.suspicion, power=settings.power)
    rows = []
    for index, cause in enumerate(bench.suspicion.causes):
        suspicion = bench.shown(index)
        loudest, scores = suspicion.best(index), suspicion.scores
        if loudest is None:
            rows.append(_unseen_row(cause.name, cause.unit))
            continue
        found = refitted.get(index)
        size = _as_scored(bench, suspicion, loudest) if found is None else _as_refitted(bench, found, loudest)
        least = found_from.smallest(index)
        whatever = np.inf if bench.in_law.of(index).size else found_from.in_any_form(index)
        accepted_alone = conclusion.accepted is not None and conclusion.accepted.causes == (index,)
        rows.append(
            CauseRow(
                name=cause.name,
                z=float(scores.z[loudest]),
                p_adjusted=adjusted_p(suspicion.statistic[loudest], bench.suspicion.scores.visible),
                estimate=_finite(size.estimate),
                std=size.std if size.std < UNKNOWN * cause.plausible(bench.facts) else 0.0,
                unit=cause.unit,
                minimal_detectable=least if np.isfinite(least) else None,
                detectable_in_any_form=whatever if np.isfinite(whatever) else None,
                surviving_fraction=float(scores.surviving[loudest]),
                nearest_twin=bench.suspicion.causes[twin[index]].name if twin[index] >= 0 else "",
                twin_cosine=float(closeness[index]),
                delta_chi2=size.gain,
                heldout_excess_removed=gain.heldout_excess_removed if gain and accepted_alone else None,
                stiffness_shift=_finite(size.shift),
            )
        )
    return sorted(rows, key=lambda row: -abs(row.z))


class _Size(NamedTuple):
    """What a cause would amount to: estimate and std (its unit), relative rms change of f_EI, chi-square removed."""

    estimate: float
    std: float
    shift: float
    gain: float | None


UNKNOWN = 1e3
"""Plausible sizes; a std beyond them says that the data do not determine the amount, and 0 is what the table takes for
that."""


def _as_refitted(bench: Workbench, found: Explanation, direction: int) -> _Size:
    """By the refit; where it ended at zero its form has no trace, and the std is that of the score."""
    estimate, std = found.amount(bench.suspicion.causes[found.causes[0]])
    std = float(bench.suspicion.scores.std[direction]) if estimate == 0.0 else std
    return _Size(estimate, std, stiffness_change(bench.base, found.fitted), found.gain)


def _as_scored(bench: Workbench, suspicion: Suspicion, direction: int) -> _Size:
    """By the linear model alone, for causes that were not worth a refit."""
    own = [direction]
    shift = stiffness_change_linear(bench.base, suspicion.columns[:, own], suspicion.scores.estimate[own])
    scores = suspicion.scores
    return _Size(float(scores.estimate[direction]), float(scores.std[direction]), float(shift[0]), None)


def _unseen_row(name: str, unit: str) -> CauseRow:
    return CauseRow(name=name, z=0.0, p_adjusted=1.0, estimate=0.0, std=0.0, unit=unit, surviving_fraction=0.0)


def _finite(value: float) -> float:
    """A number that JSON can hold."""
    return value if np.isfinite(value) else 0.0


def seen_at_plausible_size(bench: Workbench, rows: list[CauseRow]) -> list[CauseRow]:
    """Rows of causes that a plausible size would have shown, the clearest first; none that the law may hide."""
    told = [cause for k, cause in enumerate(bench.suspicion.causes) if not bench.in_law.of(k).size]
    plausible = {cause.name: cause.plausible(bench.facts) for cause in told}
    seen = [r for r in rows if r.minimal_detectable is not None and r.minimal_detectable <= plausible.get(r.name, 0.0)]
    return sorted(seen, key=lambda row: (row.minimal_detectable or 0.0) / plausible[row.name])


def blind_spots(bench: Workbench, seen: list[CauseRow], settings: DiagnosisSettings) -> list[BlindSpot]:
    """Causes that cannot be seen at a plausible size but would move f_EI, the most harmful first."""
    known = {row.name for row in seen} | {LAW}
    spots = []
    for index, cause in enumerate(bench.suspicion.causes):
        bias = 0.0 if cause.name in known else bench.stiffness_bias(index)
        if bias >= settings.harm:
            settled = str(entry("settled", cause.name))
            spots.append(BlindSpot(name=cause.name, stiffness_bias_at_plausible_size=bias, settled_by=settled))
    return sorted(spots, key=lambda spot: -spot.stiffness_bias_at_plausible_size)


def confusable(bench: Workbench, conclusion: Conclusion) -> dict[str, dict[str, float]]:
    """Cosines among the loudest causes and whatever is in the set of names."""
    suspicion, closeness = bench.suspicion, bench.suspicion.closeness()
    loudness = np.zeros(len(suspicion.causes))
    np.maximum.at(loudness, suspicion.owner, suspicion.statistic)
    chosen = list(dict.fromkeys(cause for names in conclusion.classes for cause in names))
    chosen += [int(k) for k in np.argsort(-loudness) if int(k) not in chosen and closeness[k, k] > 0.0]
    chosen = chosen[:TWINS_SHOWN]
    names = [suspicion.causes[k].name for k in chosen]
    return {
        name: {other: float(closeness[k, j]) for other, j in zip(names, chosen, strict=True) if j != k}
        for name, k in zip(names, chosen, strict=True)
    }

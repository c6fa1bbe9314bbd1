"""One specimen: from a measured test to what the simulation gets wrong, named as far as the data allow.

base model and scores -> faults of the data that a fitted model shows -> hypotheses refitted and weighed -> what is
believed -> gain on held-out steps -> the part of the result.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.diagnosis.explanations.candidates import candidates, hidden_pair
from pipeline.diagnosis.explanations.conclusion import Conclusion, conclusion_of
from pipeline.diagnosis.explanations.pair_fits import together
from pipeline.diagnosis.explanations.search import searched
from pipeline.diagnosis.explanations.single_cause import Refits, known_refits
from pipeline.diagnosis.fits.force_breaks import EXPLAINED, FAULT, force_break
from pipeline.diagnosis.fits.outlier import joined_with_outlier, outlier_fault, worst_item
from pipeline.diagnosis.fits.workbench import SCATTER, Workbench, prepare
from pipeline.diagnosis.posterior.weigh import weighed
from pipeline.diagnosis.presentation.findings import rig_told, too_large
from pipeline.diagnosis.presentation.part import present
from pipeline.faults import Faults, ForceCorrection
from pipeline.identify import Identification
from pipeline.identify.parts import curve as curve_of
from pipeline.messages import Message
from pipeline.records import Finding, inferred
from pipeline.result import DiagnosisPart, ForceCorrectionPart
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse import InverseOutcome
from rod.inverse.base_fit import held_to
from rod.inverse.fit import Fit
from rod.inverse.observation import CHORD_STD
from rod.measurement import MeasuredTest

REFITTED = 3
"""Causes, best linear scores first, that are refitted before a photo or a force is blamed."""


class Diagnosed(NamedTuple):
    """The part of the result, all findings, and what is wrong with the data."""

    part: DiagnosisPart
    findings: tuple[Finding, ...]
    faults: Faults


def diagnose(
    faults: Faults,
    identification: Identification | None,
    settings: DiagnosisSettings | None = None,
) -> Diagnosed:
    """Diagnose a measured test.

    Parameters
    ----------
    faults : Faults
        The test and what shows of its faults without a fit.
    identification : Identification or None
        Its curve, if its fit converged, is what the extended one is held against.
    settings : DiagnosisSettings or None
    """
    settings = settings or DiagnosisSettings()
    reason = _not_to_be_compared(faults, identification)
    bench = reason or prepare(faults, settings)
    if isinstance(bench, Message):
        told = DiagnosisPart.told(Message("diagnosis.nothing", reason=bench))
        return Diagnosed(DiagnosisPart(verdict="underpowered", **told), faults.findings, faults)
    refitted: Refits = {}
    fault = _data_at_fault(bench, refitted)
    if fault is not None:
        joined = joined_with_outlier(faults, fault)
        again = prepare(joined, settings)
        if not isinstance(again, Message) and again.largest <= again.limit:
            faults, bench, refitted = joined, again, {}
    fitted = None if identification is None else identification.inverse
    known = curve_of(fitted) if fitted is not None and fitted.converged else None
    conclusion = conclude(bench, refitted)
    off = _item_at_fault(bench, conclusion.fitted(bench)) if conclusion.unmodelled else None
    if off is not None and off[0].photos:  # what a load cell gets wrong in one hold it seldom does in that one alone
        joined = joined_with_outlier(faults, off[0])
        again = prepare(joined, settings)
        without = conclusion if isinstance(again, Message) else conclude(again)
        if not isinstance(again, Message) and not without.unmodelled:
            faults, bench, conclusion = joined, again, without
    beside = _beside(bench, conclusion)
    part = present(bench, conclusion, settings, identified=known, shown=beside.shown)
    part = part.model_copy(update={"corrected_forces": [_told(correction) for correction in faults.corrections]})
    large = too_large(bench, conclusion) if part.verdict == "unexplained" else ()
    return Diagnosed(part, (*faults.findings, *beside.findings, *large), faults)


def _not_to_be_compared(faults: Faults, identification: Identification | None) -> Message | None:
    """Why nothing measured can be compared with the simulation; None where something can."""
    if not faults.loaded_photos():
        return Message("diagnosis.no-photo")
    if not any(step.force for step in faults.test.steps):
        return Message("diagnosis.no-force")
    if _stands_still(faults.test):
        return Message("diagnosis.no-travel")
    if identification is not None and identification.inverse.outcome is InverseOutcome.OPPOSITE_FORCES:
        return Message("diagnosis.contradiction")
    return None if faults.loaded_forces() else Message("diagnosis.no-force-used")


def conclude(bench: Workbench, known: Refits | None = None) -> Conclusion:
    """Refit the causes and pairs of causes that matter, ``known`` ones apart, and weigh them all."""
    return conclusion_of(bench, searched(bench, known))


class _Beside(NamedTuple):
    """Ordinary errors of displacements and rig beside the concluded model.

    ``shown``: that model fitted with them; None where it is the same. ``findings``: what is reported of both.
    """

    shown: Fit | None
    findings: tuple[Finding, ...]


def _beside(bench: Workbench, conclusion: Conclusion) -> _Beside:
    """The concluded model with ordinary errors of displacements and rig, where these are likelier than none."""
    fitted, findings = conclusion.fitted(bench), list[Finding]()
    if conclusion.unmodelled:
        return _Beside(None, ())
    own = weighed(conclusion.grid.plain, fitted).own
    chance, std = own.moved
    if chance >= 0.5:
        findings.append(inferred("log/displacement-scatter", std_m=std))
    scatter = SCATTER if chance >= 0.5 or conclusion.accepted is None else 0.0
    (chance, off), usual = own.rig, fitted.extension.base.rig_std
    wide = tuple(off * std for std in usual) if chance >= 0.5 else usual
    if scatter and wide == usual:
        return _Beside(None, tuple(findings))
    shown = held_to(bench.observation, fitted, scatter, wide)
    return _Beside(shown, (*findings, *(rig_told(shown) if chance >= 0.5 else ())))


def _told(correction: ForceCorrection) -> ForceCorrectionPart:
    return ForceCorrectionPart(
        steps=list(correction.steps),
        factor=correction.factor,
        offset_N=correction.offset,
        errors_N=[list(row) for row in correction.errors],
    )


def _stands_still(test: MeasuredTest) -> bool:
    """Whether all displacements of the log are zero, or the same while the photographed chord changes."""
    logged = {step.displacement for step in test.steps if step.displacement is not None}
    chords = [step.chord for step in test.steps if step.chord is not None]
    std = max((step.chord_std or CHORD_STD * test.length for step in test.steps), default=0.0)
    moved = max(chords, default=0.0) - min(chords, default=0.0) > FAULT * std
    return logged == {0.0} or (len(logged) == 1 and moved)


def _data_at_fault(bench: Workbench, known: Refits) -> Faults | None:
    """A break in the forces, or one item, that explains more than causes do; None below the threshold of the score.

    Causes that are refitted on the way are put into ``known``.
    """
    if bench.largest <= bench.limit:
        return None
    for sought in (force_break, lambda bench: _item_at_fault(bench, bench.base)):
        found = sought(bench)
        if found is not None and not _causes_leave(bench, found[1] + FAULT**2, known):
            return found[0]
    return None


def _causes_leave(bench: Workbench, most: float, known: Refits) -> bool:
    """Whether a cause or a pair of causes, refitted (scores are linear), leaves at most that chi-square."""
    for cause in candidates(bench.suspicion)[:REFITTED]:
        if any(one.fitted.chi2 <= most for one in known_refits(bench, cause, known, rival=most)):
            return True
    hidden = hidden_pair(bench.suspicion)
    return bool(hidden) and any(pair.fitted.chi2 <= most for pair in together(bench, hidden))


def _item_at_fault(bench: Workbench, fitted: Fit) -> tuple[Faults, float] | None:
    """One photo or force whose absence brings a model to the noise, and the chi-square left with noise instead."""
    item = worst_item(bench.observation, fitted)
    if item is None or item.gain - item.rows < FAULT**2:
        return None
    freedom = len(fitted.residual) - fitted.extension.size - item.rows
    fits = item.rest < freedom + 4.0 * np.sqrt(2.0 * freedom) + EXPLAINED * item.gain
    return (outlier_fault(bench.test, item), item.rest + item.rows) if fits else None

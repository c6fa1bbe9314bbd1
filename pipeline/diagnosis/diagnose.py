"""One specimen: from a measured test to what the simulation gets wrong, named as far as the data allow.

faults of the data -> base model and scores -> (if anything exceeds noise) refits of all suspects -> probabilities and
the set of names -> a second cause -> what is left -> gain on held-out steps -> the part of the result that says all
that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.law import LAW
from pipeline.diagnosis.causes.profile import is_wave
from pipeline.diagnosis.explanations.candidates import candidates
from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.explanations.effort import TO_THE_END, Effort
from pipeline.diagnosis.explanations.explanation import Explanation
from pipeline.diagnosis.explanations.finer_law import cost, points_instead
from pipeline.diagnosis.explanations.friction_in_law import shared
from pipeline.diagnosis.explanations.pair_set import TwoCauses
from pipeline.diagnosis.explanations.single_cause import refit_one
from pipeline.diagnosis.explanations.two_causes import masking, second_cause
from pipeline.diagnosis.fits.bootstrap import confirmed_limit
from pipeline.diagnosis.fits.displacement_scatter import scatter_beside, with_scatter
from pipeline.diagnosis.fits.faults import Faults, ForceCorrection, faults_of_input
from pipeline.diagnosis.fits.fit import Fit
from pipeline.diagnosis.fits.force_breaks import force_break
from pipeline.diagnosis.fits.outlier import joined_with_outlier, outlier_fault, worst_item
from pipeline.diagnosis.fits.photo_scatter import with_scattered_photos
from pipeline.diagnosis.fits.workbench import Workbench, in_deeper_valley, prepare, with_finer_law, with_points
from pipeline.diagnosis.observations.work import newton_steps
from pipeline.diagnosis.presentation.findings import search_ended, too_large
from pipeline.diagnosis.presentation.part import present
from pipeline.diagnosis.statistics.leftover import Leftover, leftover_of
from pipeline.diagnosis.statistics.pairs import pair_gains
from pipeline.diagnosis.statistics.smooth_fields import smooth_fields
from pipeline.diagnosis.statistics.twins import cosines
from pipeline.diagnosis.statistics.verdict import credible_set, probabilities, with_twins
from pipeline.identify import Identification
from pipeline.identify.parts import curve as curve_of
from pipeline.records import Finding
from pipeline.result import Curve, DiagnosisPart, ForceCorrectionPart
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse import InverseOutcome
from rod.measurement import MeasuredTest


def diagnose(
    test: MeasuredTest, identification: Identification | None, settings: DiagnosisSettings | None = None
) -> tuple[DiagnosisPart, tuple[Finding, ...]]:
    """Diagnose a measured test.

    Parameters
    ----------
    test : MeasuredTest
    identification : Identification or None
        Its curve is what the extended one is held against.
    settings : DiagnosisSettings or None

    Returns
    -------
    DiagnosisPart
    tuple of Finding
        Faults of the data.
    """
    settings = settings or DiagnosisSettings()
    if not any(step.shape is not None and step.branch != "mounted" for step in test.steps):
        return _nothing_to_compare("no photo under load was measured"), ()
    if not any(step.force for step in test.steps):
        return _nothing_to_compare("all forces in the log are zero"), ()
    if _stands_still(test, settings):
        return _nothing_to_compare("the log gives one displacement for all steps"), ()
    if identification is not None and identification.inverse.outcome is InverseOutcome.OPPOSITE_FORCES:
        return _nothing_to_compare("photos and forces contradict each other"), ()
    faults = faults_of_input(test, settings)
    if not faults.loaded_forces():
        return _nothing_to_compare("no force under load can be used"), faults.findings
    bench = prepare(faults, settings, knots=settings.knots)
    if isinstance(bench, str):
        return _nothing_to_compare(bench), faults.findings
    fault = _data_at_fault(bench, settings)
    if fault is not None:
        knots = len(bench.base.extension.base.knots)
        joined = joined_with_outlier(faults, fault, test)
        again = prepare(joined, settings, knots=knots)
        if not isinstance(again, str) and again.largest <= again.limit:
            faults, bench = joined, again
    known = None if identification is None else curve_of(identification.inverse)
    begun, whole = newton_steps(), Effort.of(settings.all_newton_steps)
    bench, conclusion = settled(bench, settings, whole)
    part = present(bench, conclusion, settings, identified=known)
    left = max(settings.search_newton_steps - (newton_steps() - begun), 1)  # a second search ends with the first's time
    shorter = settings.model_copy(update={"search_newton_steps": left})
    if whole.spent:
        conclusion = replace(conclusion, curtailed=True)  # nor was it asked whether displacements scatter
    else:
        faults, bench, conclusion, part = _allowing_for_scatter(faults, bench, conclusion, part, shorter, known, whole)
        if part.verdict == "unexplained":
            fitted = bench.base if conclusion.accepted is None else conclusion.accepted.fitted
            scattered = with_scattered_photos(faults, bench, fitted, settings)
            better = None if scattered is None else _explained(*scattered, shorter, known, whole)
            faults, bench, conclusion, part = better or (faults, bench, conclusion, part)
    part = part.model_copy(update={"corrected_forces": [_told(correction) for correction in faults.corrections]})
    findings = [*faults.findings, *(too_large(bench, conclusion, settings) if part.verdict == "unexplained" else ())]
    return part, (*findings, *search_ended(conclusion))


def _allowing_for_scatter(
    faults: Faults,
    bench: Workbench,
    conclusion: Conclusion,
    part: DiagnosisPart,
    settings: DiagnosisSettings,
    known: Curve | None,
    whole: Effort,
) -> tuple[Faults, Workbench, Conclusion, DiagnosisPart]:
    """What is concluded with displacements that scatter, where they do so and that explains the data better.

    Better is what is likelier, each number fitted paid with two of chi-square; nothing else where only that explains
    the data at all.
    """
    exact, paid = (faults, bench, conclusion, part), _cost(bench, conclusion)
    fitted = bench.base if conclusion.accepted is None else conclusion.accepted.fitted
    scattered = scatter_beside(faults, bench, fitted, settings)
    if scattered is not None:
        again, concluded = settled(scattered.bench, settings, whole)
        presented = present(again, concluded, settings, identified=known)
        likelier = _cost(again, concluded) + scattered.price < paid
        if presented.verdict != "unexplained" and (likelier or part.verdict == "unexplained"):
            return scattered.faults, again, concluded, presented
    left_open = with_scatter(faults, bench, settings) if part.verdict == "unexplained" else None
    return (None if left_open is None else _explained(*left_open, settings, known, whole)) or exact


def _explained(
    faults: Faults, bench: Workbench, settings: DiagnosisSettings, known: Curve | None, whole: Effort
) -> tuple[Faults, Workbench, Conclusion, DiagnosisPart] | None:
    """What is concluded of data whose noise is known better; None where that leaves them unexplained."""
    again, concluded = settled(bench, settings, whole)
    part = present(again, concluded, settings, identified=known)
    return None if part.verdict == "unexplained" else (faults, again, concluded, part)


def _cost(bench: Workbench, conclusion: Conclusion) -> float:
    """Chi-square of what was concluded, plus two for every parameter."""
    return cost(bench.base if conclusion.accepted is None else conclusion.accepted.fitted)


def with_corrected_forces(test: MeasuredTest, corrections: Sequence[ForceCorrectionPart]) -> MeasuredTest:
    """The test with its forces as the diagnosis took them."""
    for part in corrections:
        errors = tuple(tuple(row) for row in part.errors_N)
        test = ForceCorrection(tuple(part.steps), part.factor, part.offset_N, errors).applied(test)
    return test


def _told(correction: ForceCorrection) -> ForceCorrectionPart:
    return ForceCorrectionPart(
        steps=list(correction.steps),
        factor=correction.factor,
        offset_N=correction.offset,
        errors_N=[list(row) for row in correction.errors],
    )


def _stands_still(test: MeasuredTest, settings: DiagnosisSettings) -> bool:
    """Whether all displacements of the log are zero, or the same while the photographed chord changes.

    The displacement is what drives the simulation; the chords, which both ways live on, are held against it.
    """
    logged = {step.displacement for step in test.steps if step.displacement is not None}
    chords = [step.chord for step in test.steps if step.chord is not None]
    std = max((step.chord_std or settings.chord_std * test.length for step in test.steps), default=0.0)
    moved = max(chords, default=0.0) - min(chords, default=0.0) > settings.fault_sigma * std
    return logged == {0.0} or (len(logged) == 1 and moved)


def settled(bench: Workbench, settings: DiagnosisSettings, whole: Effort = TO_THE_END) -> tuple[Workbench, Conclusion]:
    """What is concluded beside a law so fine that no cause stands for control points it lacks, and its workbench."""
    begun = newton_steps()
    concluded = conclude(bench, settings, whole)
    while not whole.spent and (points := points_instead(bench, concluded, settings)) is not None:
        left = max(settings.search_newton_steps - (newton_steps() - begun), 1)
        finer = with_points(bench, points, settings)
        if finer is None:
            break
        again = conclude(finer, settings.model_copy(update={"search_newton_steps": left}), whole)
        if _cost(finer, again) > _cost(bench, concluded) + bench.limit**2:
            break  # what stands beside the law was not found again
        bench, concluded = finer, again
    return bench, concluded


def conclude(bench: Workbench, settings: DiagnosisSettings, whole: Effort = TO_THE_END) -> Conclusion:
    """Refit suspects, weigh them, look for a second cause and for what is left; ``whole`` ends all of it."""
    effort = Effort.of(settings.search_newton_steps).within(whole)
    if bench.largest <= confirmed_limit(bench, settings):
        masked = masking(bench, settings, effort)
        return replace(_concluded(bench, [], [], 0, masked, settings), curtailed=effort.spent)
    found, cut = _refitted(bench, settings, whole)
    singles = [e for e in found if e.impossible(bench.suspicion.causes, settings.impossible) is None]
    impossible = [e for e in found if e not in singles and e.gain > max((s.gain for s in singles), default=0.0)]
    if not singles:
        nothing = _concluded(bench, [], [], 0, None, settings)
        return replace(nothing, impossible=impossible, alien=nothing.alien or bool(impossible), curtailed=cut)
    freedom = max(len(bench.base.residual) - bench.base.extension.size, 1)
    weight = probabilities(
        [e.weighed for e in singles],
        reduced_chi2=singles[0].fitted.chi2 / freedom,
        implausible=settings.implausible,
    )
    weight = shared(bench, singles, weight)
    members = _members(bench, singles, weight, settings)
    order = [*members, *(k for k in np.argsort(-weight) if k not in members)]
    singles, chance = [singles[k] for k in order], [float(weight[k]) for k in order]
    named = {explanation.causes[0] for explanation in singles[: len(members)]}
    two, instead, curtailed = None, list[int](), True
    if not whole.spent:
        two, instead, curtailed = second_cause(bench, singles, named, settings, effort)
    concluded = _concluded(bench, singles, chance, len(members), two, settings)
    return replace(concluded, instead=instead, impossible=impossible, curtailed=curtailed or cut)


def _concluded(
    bench: Workbench,
    singles: list[Explanation],
    chance: list[float],
    members: int,
    two: TwoCauses | None,
    settings: DiagnosisSettings,
) -> Conclusion:
    """The conclusion with the accepted model's law as fine as it asks for, and with what that model leaves."""
    accepted = two.pairs[0] if two else next(iter(singles), None)
    if accepted is not None:
        accepted = _with_finer_law(bench, accepted, settings)
    left = _left_over(bench, bench.base if accepted is None else accepted.fitted, settings)
    names = [bench.suspicion.causes[k].name for k in accepted.causes] if accepted and two else []
    both = len(names) == 2 and LAW not in names  # another control point of the law is no second cause
    alien = _beyond_catalogue(accepted, left, settings, both=both)
    return Conclusion(singles, chance, members, accepted, two, left, alien)


def _beyond_catalogue(accepted: Explanation | None, left: Leftover, settings: DiagnosisSettings, *, both: bool) -> bool:
    """Whether what an explanation leaves is more than noise and too much for it to be believed.

    Too much is a share of what it removed, or, for two causes and for waves along the cable, more than the noise: with
    all their forms they come close to much that they are not. Five strong pairs that left more than twice the noise had
    a wrong name in them, the right ones left the noise; stiff ends passed for a stiffness that varies by 200 % and left
    six times the noise, right profiles of any form leave the noise.
    """
    if left.p_value >= settings.alien_false_alarm:
        return False
    if accepted is None:
        return left.excess > 0.0
    pliable = both or any(is_wave(term.variant) for term in accepted.fitted.extension.terms)
    return left.excess > settings.explained_share * accepted.gain or (
        pliable and accepted.fitted.reduced_chi2 >= settings.fits
    )


def _members(
    bench: Workbench, singles: list[Explanation], weight: NDArray[np.float64], settings: DiagnosisSettings
) -> list[int]:
    """Explanations that form the set of names, most probable first."""
    members = credible_set(weight, level=settings.set_level)
    loudest = [bench.suspicion.best(e.causes[0]) for e in singles]
    unit = bench.suspicion.scores.unit
    first = loudest[members[0]]
    closeness = np.array([0.0 if k is None or first is None else abs(unit[:, k] @ unit[:, first]) for k in loudest])
    gain = np.array([e.gain for e in singles])
    return with_twins(members, weight, gain, closeness, cosine=settings.twin_cosine, margin=settings.twin_margin)


def _refitted(bench: Workbench, settings: DiagnosisSettings, whole: Effort) -> tuple[list[Explanation], bool]:
    """All suspects refitted that remove anything, the best first, and whether any was left out for want of time."""
    loading_only = "mounted" not in bench.facts.branch
    suspects = candidates(bench.suspicion, settings, any_sign=loading_only)
    found, cut = _explanations(bench, suspects, settings, whole)
    best = max(found, key=lambda e: e.gain, default=None)
    if best is None or best.gain < CONFIRMED * bench.largest**2 or (loading_only and not _foreseen(bench, best)):
        # A base model in a false valley of K0 points at the wrong causes: from other starts the right one may fit.
        others = [k for k in range(len(bench.suspicion.causes)) if k not in suspects and bench.suspicion.of(k).size]
        more, late = _explanations(bench, others, settings, whole)
        found, cut = [e for e in (*found, *more) if e.gain >= CONFIRMED * bench.limit**2], cut or late
    return sorted(found, key=lambda e: -e.gain), cut


def _foreseen(bench: Workbench, found: Explanation) -> bool:
    """Whether a score of admissible sign announced what a refit found, or it was found in another valley."""
    announced = max(float(bench.suspicion.statistic[bench.suspicion.of(k)].max()) for k in found.causes)
    return announced**2 >= CONFIRMED * min(found.gain, bench.limit**2)


CONFIRMED = 0.5
"""Share of a score's chi-square that its refit must remove: a score that no refit confirms is no finding."""


def _explanations(
    bench: Workbench, causes: list[int], settings: DiagnosisSettings, whole: Effort
) -> tuple[list[Explanation], bool]:
    """The named causes refitted, as far as they remove anything and there is time, and whether that was too short."""
    found: list[Explanation] = []
    for cause in causes:
        if found and whole.spent:
            return found, True
        rival = min((e.fitted.chi2 for e in found), default=np.inf)
        explanation = refit_one(bench.observation, bench.base, bench.suspicion, cause, settings, rival=rival)
        if explanation is not None and explanation.gain > 0.0:
            found.append(explanation)
    return found, False


def _with_finer_law(bench: Workbench, accepted: Explanation, settings: DiagnosisSettings) -> Explanation:
    """The accepted explanation with f_EI identified again: more control points, and a range that fits its shapes."""
    finer = in_deeper_valley(bench.observation, accepted.fitted, settings)
    finer = with_finer_law(bench.observation, finer, settings)
    return replace(accepted, fitted=finer, gain=bench.base.chi2 - finer.chi2)


def _left_over(bench: Workbench, fitted: Fit, settings: DiagnosisSettings) -> Leftover:
    fields = smooth_fields(bench.observation, bench.facts, rows=len(fitted.residual))
    return leftover_of(
        fitted.residual,
        fitted.jacobian,
        fields,
        bench.observation,
        axis_doubt=settings.axis_doubt,
        draws=settings.null_draws,
        rng=np.random.default_rng(settings.seed),
    )


def _data_at_fault(bench: Workbench, settings: DiagnosisSettings) -> Faults | None:
    """A break in the forces, or one item, that removes more than any cause or pair can; None below the threshold."""
    if bench.largest <= bench.limit:
        return None
    scores = bench.suspicion.scores
    pairs = pair_gains(
        scores.z,
        cosines(scores.unit),
        bench.suspicion.sign,
        bench.suspicion.owner,
        collinear=settings.pair_collinear,
    )
    by_cause = max(bench.largest**2, float(pairs.max(initial=0.0)))
    return force_break(bench, settings, by_cause=by_cause) or _item_at_fault(bench, settings, by_cause=by_cause)


def _item_at_fault(bench: Workbench, settings: DiagnosisSettings, *, by_cause: float) -> Faults | None:
    """One photo or force whose absence brings the rest to the noise, and removes more than any cause or pair can."""
    item = worst_item(bench.observation, bench.base)
    if item is None or item.gain - item.rows < settings.fault_sigma**2:
        return None
    freedom = len(bench.base.residual) - bench.base.extension.size - item.rows
    fits = item.rest < freedom + 4.0 * np.sqrt(2.0 * freedom) + settings.explained_share * item.gain
    better = item.gain - item.rows > by_cause + settings.fault_sigma**2
    return outlier_fault(bench.test, item) if fits and better else None


def _nothing_to_compare(reason: str) -> DiagnosisPart:
    return DiagnosisPart(
        verdict="underpowered", headline=f"The simulation could not be held against the data: {reason}."
    )

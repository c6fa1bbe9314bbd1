"""From a conclusion to the part of the result: table, causes, gain, blind spots, next experiment, maps, headline."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.explanations.explanation import Explanation
from pipeline.diagnosis.explanations.friction_in_law import FRICTION, hidden_in_law
from pipeline.diagnosis.fits.extended import curve, curve_change, forms, stiffness_change, stiffness_change_linear
from pipeline.diagnosis.fits.fit import Fit
from pipeline.diagnosis.fits.heldout import measured_gain
from pipeline.diagnosis.fits.identified_again import Identified, identified_again
from pipeline.diagnosis.fits.maps import residual_map, smooth_share
from pipeline.diagnosis.fits.search import detectable_amount
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.plans.next_experiment import next_experiment
from pipeline.diagnosis.statistics.score import adjusted_p, sigma_needed
from pipeline.diagnosis.statistics.twins import between_causes, cosines, nearest
from pipeline.diagnosis.statistics.verdict import decide
from pipeline.diagnosis.words import could_have_been_seen, headline, spoken
from pipeline.result import BlindSpot, CausePart, CauseRow, Curve, DiagnosisPart, GainPart, NextExperiment
from pipeline.settings.diagnosis import DiagnosisSettings

Array = NDArray[np.float64]


def present(
    bench: Workbench, conclusion: Conclusion, settings: DiagnosisSettings, *, identified: Curve | None = None
) -> DiagnosisPart:
    """Fill the part of the result; ``identified`` is f_EI before the diagnosis, which people compare with."""
    accepted = conclusion.accepted
    gain, held = measured_gain(bench, accepted.fitted, settings) if accepted else (None, None)
    rows = table(bench, conclusion, settings, heldout=held.removed if held else None)
    seen = [(row.name, row.minimal_detectable or 0.0, row.unit) for row in _seen_at_plausible_size(bench, rows)]
    in_law = hidden_in_law(bench, conclusion.names) if conclusion.two is None else []
    again = None
    if accepted is not None:
        again = identified_again(bench.observation, accepted.fitted, settings, in_law=in_law)
    extended = _extended(again, conclusion, settings)
    causes = named_causes(bench, conclusion, again, extended)
    verdict = decide(
        detected=accepted is not None,
        alien=conclusion.alien or unproven(conclusion.left.p_value, gain, settings),
        two=len(causes) == 2,
        names=len(conclusion.names),
        powerless=len(seen) < settings.powerless * len(rows),
    )
    leftover = describe_leftover(bench, conclusion)
    photos, forces = left_out(bench)
    sentence = headline(
        verdict,
        names=[cause.class_ for cause in causes],
        amounts=[(cause.estimate, cause.std, cause.unit) for cause in causes],
        explained=None if gain is None else gain.heldout_excess_removed,
        change=_change(bench, accepted, extended, identified),
        weakest=could_have_been_seen(seen, len(rows)),
        leftover=leftover["message"],
        friction_in_law=bool(in_law),
    )
    return DiagnosisPart(
        verdict=verdict,
        headline=sentence,
        causes=causes,
        table=rows,
        gain=_valid(gain),
        blind_spots=blind_spots(bench, rows, settings),
        next_experiment=_next(bench, conclusion, settings, verdict),
        extended=extended,
        extended_refuted=verdict == "unexplained" and not _removes_most(gain, settings),
        leftover=leftover,
        residuals_before=residual_map(bench.test, bench.observation, bench.base),
        residuals_after=residual_map(bench.test, bench.observation, accepted.fitted) if accepted else None,
        twins=confusable(bench, conclusion, settings),
        left_out_photos=photos,
        left_out_forces=forces,
    )


def unproven(p_value: float, gain: GainPart | None, settings: DiagnosisSettings) -> bool:
    """Whether what is left is hardly noise, and on steps held out too large a share of the misfit.

    Forms whose place and width are tuned to the steps fit away what they do not explain: a soft spot in the place of a
    peg that pushes the cable left 2 % of the misfit, and 19 % of that of steps it had not seen.
    """
    shown = gain is None or not np.isfinite(gain.ci95[1]) or gain.ci95[1] >= 1.0 - settings.explained_share
    return not shown and p_value < settings.unproven


def _removes_most(gain: GainPart | None, settings: DiagnosisSettings) -> bool:
    """Whether the extension removes so much of the misfit of steps held out that its f_EI is the better one."""
    return gain is not None and gain.heldout_excess_removed >= settings.extension_share


def left_out(bench: Workbench) -> tuple[list[int], list[int]]:
    """Steps whose photo, and steps whose force, the data at fault took out of the diagnosis."""
    used = {photo.step for photo in bench.observation.photos}
    steps = list(enumerate(bench.test.steps))
    return (
        [step.step for k, step in steps if step.shape is not None and k not in used],
        [step.step for k, step in steps if bench.observation.forces[k].size == 0],
    )


def _change(
    bench: Workbench, accepted: Explanation | None, extended: Curve | None, identified: Curve | None
) -> float | None:
    """Relative rms change of f_EI by the extension: of the curve that stands in the result, else of the base model's.

    The base model here has a smooth law and a K0 of its own; without the cause both may run far from what the
    identification found, and a change of the one would say nothing about the other.
    """
    if accepted is None or extended is None:
        return None
    change = None if identified is None else curve_change(identified, extended)
    return stiffness_change(bench.base, accepted.fitted) if change is None else change


def _extended(again: Identified | None, conclusion: Conclusion, settings: DiagnosisSettings) -> Curve | None:
    """f_EI of the extended model, with what the data cannot tell in its band: the law's smoothness, and the class."""
    if again is None:
        return None
    rivals = [*_rivals(conclusion), *again.rivals]
    return curve(again.fitted, points=settings.curve_points, covariance=again.covariance, rivals=rivals)


def _rivals(conclusion: Conclusion) -> list[tuple[Fit, float]]:
    """The other members of the class of the accepted cause, or of the set of pairs, with their probability in it."""
    if conclusion.two is not None:
        return [(e.fitted, p) for e, p in zip(conclusion.two.pairs[1:], conclusion.two.probability[1:], strict=True)]
    chance = conclusion.probability[: conclusion.members]
    others = zip(conclusion.singles[1 : conclusion.members], chance[1:], strict=True)
    return [(e.fitted, p / sum(chance)) for e, p in others]


def named_causes(
    bench: Workbench, conclusion: Conclusion, again: Identified | None, extended: Curve | None
) -> list[CausePart]:
    """One entry for each cause that was found, with its class of names, and its forms in the extended model.

    Where forms add up, the size is that of the extended model, whose std allows for other forms than were found.
    """
    parts = _named(bench, conclusion)
    if again is None or extended is None:
        return parts
    columns = len(extended.tangent_factor_Nm2[0])
    found = []
    for part in parts:
        own = forms(again.fitted, part.name, columns=columns, covariance=again.covariance)
        size, std = again.sizes.get(part.name, (part.estimate, part.std))
        found.append(part.model_copy(update={"forms": own, "estimate": size, "std": std}))
    return found


def _named(bench: Workbench, conclusion: Conclusion) -> list[CausePart]:
    catalogue, accepted, two = bench.suspicion.causes, conclusion.accepted, conclusion.two
    if accepted is None:
        return []
    names = [catalogue[k].name for k in conclusion.names]
    # a law with one more control point is no second cause, only a finer base
    found = [cause for cause in accepted.causes if catalogue[cause].name != "nonlinear_stiffness"] or [*accepted.causes]
    if two is None or len(found) == 1:
        name = catalogue[found[0]].name
        return [_part(bench, accepted, found[0], [name, *(n for n in names if n != name)], conclusion.probability[0])]
    classes = [[catalogue[k].name for k in two.names(place)] for place in (0, 1)]
    return [
        _part(bench, accepted, cause, group, two.chance(cause))
        for cause, group in zip(accepted.causes, classes, strict=True)
    ]


def _part(bench: Workbench, found: Explanation, cause: int, names: list[str], probability: float) -> CausePart:
    kind = bench.suspicion.causes[cause]
    amount, std = found.amount(kind)
    return CausePart(
        name=kind.name,
        **{"class": names},
        probability=min(max(probability, 0.0), 1.0),
        estimate=amount,
        std=std,
        unit=kind.unit,
    )


def table(
    bench: Workbench, conclusion: Conclusion, settings: DiagnosisSettings, *, heldout: float | None
) -> list[CauseRow]:
    """One row for every cause, the loudest first; ``stiffness_shift`` says what each would do to f_EI."""
    suspicion, scores = bench.suspicion, bench.suspicion.scores
    statistic = suspicion.statistic
    p_values = adjusted_p(statistic, bench.maxima) if statistic.size else statistic
    needed = sigma_needed(bench.limit, power=settings.power)
    twin, closeness = nearest(between_causes(cosines(scores.unit), suspicion.owner, len(suspicion.causes)))
    refitted = {e.causes[0]: e for e in conclusion.singles}
    accepted = conclusion.accepted
    rows = []
    for index, cause in enumerate(suspicion.causes):
        best = suspicion.best(index)
        if best is None:
            rows.append(_unseen_row(cause.name, cause.unit))
            continue
        found = refitted.get(index)
        estimate, std = found.amount(cause) if found else (float(scores.estimate[best]), float(scores.std[best]))
        if found:
            shift = stiffness_change(bench.base, found.fitted)
        else:
            column = suspicion.columns[:, best : best + 1]
            shift = float(stiffness_change_linear(bench.base, column, scores.estimate[best : best + 1])[0])
        rows.append(
            CauseRow(
                name=cause.name,
                z=float(scores.z[best]),
                p_adjusted=float(p_values[best]),
                estimate=_finite(estimate),
                std=_finite(std),
                unit=cause.unit,
                minimal_detectable=_finite_or_none(
                    detectable_amount(
                        bench.observation, bench.base, suspicion, index, needed=needed, trace=settings.trace
                    )
                ),
                surviving_fraction=float(scores.surviving[best]),
                nearest_twin=suspicion.causes[twin[index]].name if twin[index] >= 0 else "",
                twin_cosine=float(closeness[index]),
                delta_chi2=found.gain if found else None,
                heldout_excess_removed=heldout if accepted and accepted.causes == (index,) else None,
                stiffness_shift=_finite(shift),
            )
        )
    return sorted(rows, key=lambda row: -abs(row.z))


def _unseen_row(name: str, unit: str) -> CauseRow:
    return CauseRow(name=name, z=0.0, p_adjusted=1.0, estimate=0.0, std=0.0, unit=unit, surviving_fraction=0.0)


def _seen_at_plausible_size(bench: Workbench, rows: list[CauseRow]) -> list[CauseRow]:
    """Rows of causes that a plausible size would have shown, the clearest first.

    One form of friction between the wires may be seen on loading alone, but another is part of the law.
    """
    causes = [cause for cause in bench.suspicion.causes if bench.facts.returns or cause.name != FRICTION]
    plausible = {cause.name: cause.plausible(bench.facts) for cause in causes}
    seen = [r for r in rows if r.minimal_detectable is not None and r.minimal_detectable <= plausible.get(r.name, 0.0)]
    return sorted(seen, key=lambda row: (row.minimal_detectable or 0.0) / plausible[row.name])


def blind_spots(bench: Workbench, rows: list[CauseRow], settings: DiagnosisSettings) -> list[BlindSpot]:
    """Causes that cannot be seen at a plausible size but would move f_EI, the most harmful first."""
    suspicion = bench.suspicion
    seen = {row.name for row in _seen_at_plausible_size(bench, rows)}
    spots = []
    for index, cause in enumerate(suspicion.causes):
        own = suspicion.of(index)
        if cause.name in seen or own.size == 0 or cause.name == "nonlinear_stiffness":
            continue
        sizes = np.full(own.size, cause.plausible(bench.facts))
        bias = stiffness_change_linear(bench.base, suspicion.columns[:, own], sizes)
        if bias.max() >= settings.harm:
            spots.append(
                BlindSpot(
                    name=cause.name, stiffness_bias_at_plausible_size=float(bias.max()), settled_by=cause.settled_by
                )
            )
    return sorted(spots, key=lambda spot: -spot.stiffness_bias_at_plausible_size)


def _next(bench: Workbench, conclusion: Conclusion, settings: DiagnosisSettings, verdict: str) -> NextExperiment | None:
    """What separates the set of names; without one, what settles the worst blind spot."""
    confused = conclusion.two.pairs if conclusion.two else conclusion.singles[: conclusion.members]
    if len(confused) > 1:
        return next_experiment(bench, confused[0], confused[1:], settings)
    if verdict == "unexplained":
        return NextExperiment(what="repeat the test with the cable turned end for end, and unload", separates=[])
    if not bench.facts.returns:
        return NextExperiment(
            what="unload in the same steps, with photos", separates=["bearing_friction", "hysteresis", "plastic_set"]
        )
    return NextExperiment(what="hang dead weights on the load cell", separates=["force_gain"])


def confusable(bench: Workbench, conclusion: Conclusion, settings: DiagnosisSettings) -> dict[str, dict[str, float]]:
    """Cosines among the loudest causes and whatever is in the set of names."""
    suspicion = bench.suspicion
    closeness = between_causes(cosines(suspicion.scores.unit), suspicion.owner, len(suspicion.causes))
    loud = np.zeros(len(suspicion.causes))
    np.maximum.at(loud, suspicion.owner, suspicion.statistic)
    chosen = [e.causes[0] for e in conclusion.singles[: conclusion.members]]
    chosen += [int(k) for k in np.argsort(-loud) if int(k) not in chosen and closeness[k, k] > 0.0]
    chosen = chosen[: settings.twins_shown]
    names = [suspicion.causes[k].name for k in chosen]
    return {
        name: {other: float(closeness[k, j]) for other, j in zip(names, chosen, strict=True) if j != k}
        for name, k in zip(names, chosen, strict=True)
    }


def describe_leftover(bench: Workbench, conclusion: Conclusion) -> dict[str, Any]:
    """Where what is left sits, in words and numbers."""
    left = conclusion.left
    field = left.field[: len(bench.observation.rows.kind)]
    found = smooth_share(bench.observation, field)
    step = bench.test.steps[found["step_index"]]
    kind = max(found["share"], key=found["share"].get)
    place = "" if found["place"] is None else f", most at s = {1e3 * found['place']:.0f} mm"
    where = {"force": "in the forces", "chord": "in the chords", "shape": "in the shapes"}[kind]
    message = (
        f"what is left sits {where}, strongest at step {step.step} ({step.branch}){place if kind == 'shape' else ''}"
    )
    return {
        "message": message,
        "p_value": left.p_value,
        "chi2": left.chi2,
        "fields": left.size,
        "excess": left.excess,
        "noise": "as stated"
        if bench.observation.photo_noise.factor == 1.0
        else f"sections scatter {bench.observation.photo_noise.factor:.2f} times as much as stated",
        **{key: value for key, value in found.items() if key != "step_index"},
        "step": step.step,
        "spoken": spoken(kind),
    }


def _valid(gain: GainPart | None) -> GainPart | None:
    return gain if gain is not None and np.isfinite(gain.heldout_excess_removed) else None


def _finite(value: float) -> float:
    return value if np.isfinite(value) else 0.0


def _finite_or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None

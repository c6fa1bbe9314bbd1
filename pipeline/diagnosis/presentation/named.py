"""The causes that were named, each with its class, and f_EI of the model that has them in it."""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.fits.extended import curve_change, forms, stiffness_change
from pipeline.diagnosis.fits.identified_again import Identified
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.explanation import Explanation
from pipeline.diagnosis.posterior.mixture import centre_of, widening
from pipeline.messages import entry
from pipeline.result import CausePart, Curve, HypothesisPart, TwinPart, Widening
from rod.inverse.fit import FITS, Fit


def named_causes(
    bench: Workbench,
    conclusion: Conclusion,
    again: Identified | None,
    extended: Curve | None,
) -> list[CausePart]:
    """One entry for each cause that was found, with its class of names, and its forms in the extended model.

    Where forms add up, the size is that of the extended model, whose std allows for other forms than were found.
    """
    parts = _classes(bench, conclusion)
    if again is None or extended is None:
        return parts
    columns = len(extended.tangent_factor_Nm2[0])
    found = []
    for part in parts:
        own = forms(again.fitted, part.name, columns=columns, covariance=again.covariance)
        size, std = again.sizes.get(part.name, (part.estimate, part.std))
        found.append(part.model_copy(update={"forms": own, "estimate": size, "std": std}))
    return found


def _classes(bench: Workbench, conclusion: Conclusion) -> list[CausePart]:
    """The causes of the accepted explanation, each with whatever the data allow in its place."""
    accepted = conclusion.accepted
    if accepted is None:
        return []
    catalogue, twins = bench.suspicion.causes, _twins(bench, conclusion)
    parts = []
    for cause, names in zip(accepted.causes, conclusion.classes, strict=True):
        kind = catalogue[cause]
        amount, std = accepted.amount(kind)
        parts.append(
            CausePart(
                name=kind.name,
                # a name that was found itself cannot stand in the place of another
                **{"class": [catalogue[k].name for k in names if k == cause or k not in accepted.causes]},
                probability=conclusion.posterior.of(cause),
                estimate=amount,
                std=std,
                unit=kind.unit,
                size=accepted.size(kind),
                twins=[twin for twin in twins if twin.name != kind.name],
            )
        )
    return parts


def _twins(bench: Workbench, conclusion: Conclusion) -> list[TwinPart]:
    """Other single causes that leave no more than noise, the likeliest first; none where two causes were found."""
    believed, accepted = conclusion.posterior, conclusion.accepted
    if conclusion.unmodelled or accepted is None or len(accepted.causes) > 1:
        return []
    fits = [one.causes[0] for one in conclusion.singles if one.fitted.reduced_chi2 < FITS]
    found = [(believed.of(k), bench.suspicion.causes[k]) for k in dict.fromkeys(fits) if k not in accepted.causes]
    return [
        TwinPart(name=cause.name, probability=chance, settled_by=str(entry("settled", cause.name)))
        for chance, cause in sorted(found, key=lambda pair: -pair[0])
    ]


def hypotheses(bench: Workbench, conclusion: Conclusion) -> tuple[list[HypothesisPart], float]:
    """The whole posterior, most probable first, and the probability of none of these."""
    catalogue, whole = bench.suspicion.causes, dict[tuple[frozenset[int], bool], tuple[tuple[int, ...], float]]()
    for one in conclusion.posterior.believed:
        key = frozenset(one.causes), one.something_else
        causes, probability = whole.get(key, (one.causes, 0.0))
        whole[key] = causes, probability + one.probability
    _, none = whole.pop((frozenset(), True), ((), 0.0))
    told = sorted(whole.items(), key=lambda row: -row[1][1])
    return [
        HypothesisPart(causes=[catalogue[k].name for k in causes], something_else=rest, probability=probability)
        for (_, rest), (causes, probability) in told
        if probability >= TOLD
    ], none


TOLD = 1e-6
"""Probability below which a hypothesis is not told; all of these together change no digit that is shown."""


def all_believed(
    bench: Workbench, conclusion: Conclusion, curve: Curve, own: tuple[Fit, Fit] | None = None
) -> Widening:
    """What all hypotheses add to the band of a curve; ``own`` as in `widening`."""
    return widening(conclusion.grid, conclusion.posterior, bench.base, bench.suspicion, centre_of(curve), own=own)


def known_to(curve: Curve) -> float:
    """How well a curve is known: median relative standard deviation of its f_EI, the smaller the better."""
    return float(np.median(np.array(curve.tangent_std_Nm2) / np.array(curve.tangent_Nm2)))


def change_of_stiffness(
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

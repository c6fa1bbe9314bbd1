"""The causes that were named, each with its class, and f_EI of the model that has them in it."""

from __future__ import annotations

from pipeline.diagnosis.causes.law import LAW
from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.explanations.explanation import Explanation
from pipeline.diagnosis.fits.extended import curve, curve_change, forms, stiffness_change
from pipeline.diagnosis.fits.fit import Fit
from pipeline.diagnosis.fits.identified_again import Identified
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.result import CausePart, Curve
from pipeline.settings.diagnosis import DiagnosisSettings


def named_causes(
    bench: Workbench, conclusion: Conclusion, again: Identified | None, extended: Curve | None
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
    catalogue, accepted, two = bench.suspicion.causes, conclusion.accepted, conclusion.two
    if accepted is None:
        return []
    # a law with one more control point is no second cause, only a finer base
    found = [cause for cause in accepted.causes if catalogue[cause].name != LAW] or [*accepted.causes]
    if two is None or len(found) == 1:
        class_ = list(dict.fromkeys([found[0], *conclusion.names]))
        return [_part(bench, accepted, found[0], class_, conclusion.probability[0])]
    return [
        _part(bench, accepted, cause, two.names(place), two.chance(cause))
        for place, cause in enumerate(accepted.causes)
    ]


def _part(bench: Workbench, found: Explanation, cause: int, class_: list[int], probability: float) -> CausePart:
    catalogue = bench.suspicion.causes
    kind = catalogue[cause]
    amount, std = found.amount(kind)
    return CausePart(
        name=kind.name,
        **{"class": [catalogue[k].name for k in class_]},
        probability=min(max(probability, 0.0), 1.0),
        estimate=amount,
        std=std,
        unit=kind.unit,
    )


def extended_curve(again: Identified, conclusion: Conclusion, settings: DiagnosisSettings) -> Curve:
    """f_EI of the extended model, with what the data cannot tell in its band: the law's smoothness, and the class."""
    rivals = [*_rivals(conclusion), *again.rivals]
    return curve(again.fitted, points=settings.curve_points, covariance=again.covariance, rivals=rivals)


def _rivals(conclusion: Conclusion) -> list[tuple[Fit, float]]:
    """The other members of the class of the accepted cause, or of the set of pairs, with their probability in it."""
    if conclusion.two is not None:  # their probabilities are those within the set already
        members, chance, whole = conclusion.two.pairs, conclusion.two.probability, 1.0
    else:
        members, chance = conclusion.singles[: conclusion.members], conclusion.probability[: conclusion.members]
        whole = sum(chance)
    return [(e.fitted, p / whole) for e, p in zip(members[1:], chance[1:], strict=True)]


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

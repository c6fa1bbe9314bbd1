"""Whether a finer law does what a named cause does: then nothing is wrong but the number of control points.

The diagnosis looks for causes with few control points, since a law of many would eat causes. A law that falls steeply
leaves a misfit on few, which some causes imitate: friction between the wires was named in cables that had none, alone
and beside a right name, and had no size left (1.8 and 0.4 standard deviations) once f_EI was identified with the
control points it asks for. So each cause that was named is left out again, and the law takes as many control points as
f_EI gets in the end, each paid with two of chi-square. A cause that removes no more beside such a law than chance may
(the threshold of all scores) is none: the law is the base model to look for causes with, and the search begins anew. A
further control point that is likelier than all causes is taken into the base model as well: a law of another form is no
fault of the simulation.

Friction on loading alone is part of the law, exactly; where the two stand in one class that is said, and left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.law import LAW
from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.explanations.friction_in_law import FRICTION
from pipeline.diagnosis.fits.extended import law_of
from pipeline.diagnosis.fits.fit import Fit, fit_from
from pipeline.diagnosis.fits.workbench import Workbench, with_knots
from pipeline.settings.diagnosis import DiagnosisSettings

Array = NDArray[np.float64]


def cost(fitted: Fit) -> float:
    """Chi-square plus two for every number fitted."""
    return fitted.chi2 + 2.0 * fitted.extension.size


def points_instead(bench: Workbench, concluded: Conclusion, settings: DiagnosisSettings) -> Array | None:
    """Control points (k,) 1/m with which the law stands for a cause that was named; None where it does for none."""
    accepted = concluded.accepted
    if accepted is None or concluded.alien:
        return None
    cheapest, points = np.inf, None
    for without in _without_one(bench, concluded):
        # what a cause must remove to be seen at all, it must remove beside the law
        dear = accepted.fitted.chi2 + bench.limit**2 + 2.0 * len(accepted.fitted.extension.base.names)
        dear += 2.0 * (without.extension.size - len(without.extension.base.names))
        for finer in _finer(bench, without, settings, min(dear, cost(without))):
            if cost(finer) <= min(dear, cost(without), cheapest):
                cheapest, points = cost(finer), finer.extension.base.knots
    if points is None and _is_law(bench, concluded):
        named = law_of(accepted.fitted).knots
        return named if len(bench.base.extension.base.knots) < len(named) <= settings.knots_identified else None
    return points


def _without_one(bench: Workbench, concluded: Conclusion) -> list[Fit]:
    """Fits without one of the causes that were named; a further control point of the law is no cause of its own."""
    if concluded.accepted is None:
        return []
    catalogue = bench.suspicion.causes
    causes = [k for k in concluded.accepted.causes if catalogue[k].name != LAW]
    if len(causes) < 2:
        return [] if _one_class(bench, [*concluded.names, *concluded.accepted.causes]) else [bench.base]
    alone = {e.causes[0]: e.fitted for e in concluded.singles}
    classes = [[] if concluded.two is None else concluded.two.names(place) for place in (0, 1)]
    left = [causes[1 - place] for place in (0, 1) if not _one_class(bench, classes[place])]
    return [alone[k] for k in left if k in alone]


def _is_law(bench: Workbench, concluded: Conclusion) -> bool:
    """Whether a further control point itself is the likeliest explanation, and friction would not do the same."""
    if concluded.accepted is None or _one_class(bench, concluded.names):
        return False
    return all(bench.suspicion.causes[k].name == LAW for k in concluded.accepted.causes)


def _one_class(bench: Workbench, names: list[int]) -> bool:
    """Whether friction and law stand beside each other in a class, of a test without unloading."""
    return not bench.facts.returns and {LAW, FRICTION} <= {bench.suspicion.causes[k].name for k in names}


def _finer(bench: Workbench, fitted: Fit, settings: DiagnosisSettings, dear: float) -> list[Fit]:
    """A fitted model with more control points, the most first; only that where no number of them costs so little."""
    fewest = len(bench.base.extension.base.knots) + 1
    found: list[Fit] = []
    for count in range(settings.knots_identified, fewest - 1, -1):
        extension, vector = with_knots(fitted, count)
        # fewer control points leave more: what the most of them leave must be cheap enough at the price of the fewest
        most = dear - 2.0 * (extension.size - count + fewest)
        hopeless = most if not found else float("inf")
        finer = fit_from(bench.observation, extension, vector, fitted, settings, hopeless=hopeless)
        if finer.run.prediction is None:
            continue
        found.append(finer)
        if found[0].chi2 > most:
            break
    return found

"""On loading alone friction between the wires is part of the law.

Elements that slip one after the other add to the moment what any law does that falls with curvature: a cable that is
never bent back does the same with either, exactly. How well a few elements or a few control points happen to follow the
data is no evidence, so the two share their probability evenly; and f_EI without friction is known only as well as the
friction is, which the band says (of six loading steps with friction of a tenth of the moment, f_EI was 13 % off in a
band of 1 %; with friction of plausible size as an unknown the band is 7 %, 20 % near rest where it was 28 to 41 % off).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.law import LAW
from pipeline.diagnosis.explanations.explanation import Explanation
from pipeline.diagnosis.fits.workbench import Workbench

Array = NDArray[np.float64]

FRICTION = "hysteresis"

AS_WELL = 0.5
"""Share of the better one's chi-square that the other must remove: a law that rises is no friction of any form."""


def shared(bench: Workbench, singles: Sequence[Explanation], weight: Array) -> Array:
    """Probabilities (n,) of single causes, with law and friction alike where nothing was unloaded and both fit."""
    names = [bench.suspicion.causes[explanation.causes[0]].name for explanation in singles]
    if bench.facts.returns or LAW not in names or FRICTION not in names:
        return weight
    both = [names.index(LAW), names.index(FRICTION)]
    gains = [singles[k].gain for k in both]
    if min(gains) < AS_WELL * max(gains):
        return weight
    alike = weight.copy()
    alike[both] = weight[both].mean()
    return alike


def hidden_in_law(bench: Workbench, names: Sequence[int]) -> list[Cause]:
    """Friction between the wires, where a set of names (indices of causes) holds it beside the law; else nothing."""
    causes = [bench.suspicion.causes[k] for k in names]
    if bench.facts.returns or LAW not in {cause.name for cause in causes}:
        return []
    return [cause for cause in causes if cause.name == FRICTION]

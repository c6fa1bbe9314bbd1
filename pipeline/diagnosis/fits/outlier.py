"""One photo or one hold that contradicts all other data, and a photo that is of another step.

After the base fit, each photo and each hold is left out in turn, to first order: where the rest then agrees with the
model and no cause explains as much, that one item is at fault, not the model.

Codes: ``photo/outlier``, ``force/outlier``, ``photo/other-step``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.faults import Faults
from pipeline.records import doubtful
from rod.inverse.fit import Fit
from rod.inverse.observation import Observation
from rod.measurement import MeasuredTest


@dataclass(frozen=True)
class Outlier:
    """One item whose absence lets the model fit: step index, kind (``photo`` or ``force``), and what is then gained."""

    index: int
    kind: str
    gain: float
    rows: int
    rest: float


def worst_item(observation: Observation, fitted: Fit) -> Outlier | None:
    """The photo or hold whose absence lowers chi-square most, refitted to first order; None with too few steps."""
    kind, step = observation.rows.kind, observation.rows.step
    extra = np.zeros(len(fitted.residual) - len(kind), dtype=bool)
    best: Outlier | None = None
    steps = sorted(set(step.tolist()))
    if len(steps) < 3:
        return None
    for index in steps:
        for name, own in (("photo", kind > 0), ("force", kind == 0)):
            rows = np.r_[own & (step == index), extra]
            if not rows.any() or (own & (step != index)).sum() == 0:
                continue
            kept = ~rows
            moved = np.linalg.lstsq(fitted.jacobian[kept], fitted.residual[kept], rcond=1e-9)[0]
            rest = float(np.sum((fitted.residual[kept] - fitted.jacobian[kept] @ moved) ** 2))
            found = Outlier(index, name, fitted.chi2 - rest, int(rows.sum()), rest)
            if best is None or found.gain - found.rows > best.gain - best.rows:
                best = found
    return best


def outlier_fault(test: MeasuredTest, outlier: Outlier) -> Faults:
    """Finding and exclusion of an item at fault."""
    sigma = np.sqrt(max(outlier.gain - outlier.rows, 0.0))
    finding = doubtful(f"{outlier.kind}/outlier", step=test.steps[outlier.index].step, sigma=sigma)
    index, photo = frozenset({outlier.index}), outlier.kind == "photo"
    return Faults(test, (finding,), index if photo else frozenset(), frozenset() if photo else index)


def joined_with_outlier(found: Faults, outlier: Faults) -> Faults:
    """Join two faults; where photo and displacement of one step contradict each other, its photo is of another step.

    With the displacement taken from such a photo, the force would seem wrong; both are right as logged.
    """
    wrong = (outlier.photos | outlier.forces) & found.doubted.keys()
    if outlier.corrections or not wrong:
        return found.joined(outlier)
    (index,) = wrong
    step = replace(found.test.steps[index], displacement=found.doubted[index])
    return replace(
        found,
        test=replace(found.test, steps=(*found.test.steps[:index], step, *found.test.steps[index + 1 :])),
        findings=(
            *(finding for finding in found.findings if finding.code != "log/displacement"),
            doubtful("photo/other-step", step=step.step),
        ),
        photos=found.photos | {index},
        doubted={},
    )

"""Whether the load cell responds to the bending: a force that is the same at every step is not that of a cable.

A mounted cable is free of force and a bent one pushes with about its buckling load. Without a mounted step the force
still changes: by half the travel over the length where the law is straight (elastica, for small bows), more where it is
not. A cell that is saturated, unplugged or was never logged shows neither.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.errors import InputError
from pipeline.intake.holdplace import MEDIAN_OF_NORMAL
from pipeline.messages import Message
from pipeline.records import LoadStep

STILL = 4.0
"""Standard deviations; a log none of whose forces differs by more from one and the same tells of no cable: of a test
that could be used the largest force has hundreds."""

FLAT = 2e-3
"""Of the largest force; without a mounted step forces must change by more over three steps: half the travel over the
length, for a travel of 2 % at least three times this."""


def check_response(steps: Sequence[LoadStep]) -> None:
    """Refuse a log whose force stands still while the bearing moves; raises `InputError` ``log/force-stands-still``."""
    loaded = [step for step in steps if step.branch != "mounted"]
    still = steps if len(loaded) < len(steps) and _one_force(steps) else loaded
    places, forces = [step.displacement_m for step in still], np.array([step.force_N for step in still])
    if still is loaded:  # three bent steps and more of a cable differ by more
        flat = len(set(places)) > 2 and float(np.ptp(forces)) <= FLAT * float(np.max(np.abs(forces)))
        if not (flat and _one_force(loaded)):
            return
    way = {"from_mm": 1e3 * min(places), "to_mm": 1e3 * max(places)}
    raise InputError(Message("log/force-stands-still", steps=len(still), force_N=float(np.mean(forces)), **way))


def _one_force(steps: Sequence[LoadStep]) -> bool:
    """Whether one force explains several steps at several places within their noise.

    Medians, and the scatter about them: a wild sample that could not be left out is no noise that hides a cable.
    """
    if len({step.displacement_m for step in steps}) < 2:
        return False
    middles = np.array([float(np.median(step.forces_N)) for step in steps])
    repeated = [step.forces_N - middle for step, middle in zip(steps, middles, strict=True) if step.forces_N.size > 1]
    std = np.array([step.force_std_N for step in steps])
    if repeated:
        sigma = float(np.median(np.abs(np.concatenate(repeated)))) / MEDIAN_OF_NORMAL
        std = sigma / np.sqrt([step.forces_N.size for step in steps])
    return bool(np.all(np.abs(middles - np.median(middles)) <= STILL * std))

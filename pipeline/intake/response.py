"""Does the load cell answer to the bending? A force that is the same at every step is none of the cable's.

A mounted cable is free of force and a bent one pushes with about its buckling load. Without a mounted step the force
still changes: by half the travel over the length where the law is straight (elastica, for small bows), more where it is
not. A cell that is saturated, unplugged or was never logged shows neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.errors import InputError
from pipeline.records import LoadStep
from pipeline.settings.intake import IntakeSettings
from pipeline.units import quantity


def check_response(steps: Sequence[LoadStep], *, path: Path, settings: IntakeSettings) -> None:
    """Refuse a log whose force stands still while the bearing moves; a log of zeros says by itself that it has none.

    Raises
    ------
    InputError
        ``log/force-stands-still``.
    """
    places = np.array([step.displacement_m for step in steps])
    forces = np.array([step.force_N for step in steps])
    samples = np.concatenate([step.forces_N for step in steps])
    if np.ptp(places) == 0.0 or not samples.any():
        return
    to_the_digit = len(steps) > 2 and float(np.ptp(samples)) == 0.0
    if not to_the_digit and not _is_flat(steps, places, forces, settings):
        return
    way = f"{places.min() * 1e3:.4g} and {places.max() * 1e3:.4g} mm"
    raise InputError(
        f"the force stands still: all {len(steps)} steps between {way} read {quantity(float(np.mean(forces)), 'N')}",
        path=path,
        code="log/force-stands-still",
        remedy="check that the load cell is connected and within its range and that this column is its force, then "
        "repeat the test",
    )


def _is_flat(steps: Sequence[LoadStep], places: np.ndarray, forces: np.ndarray, settings: IntakeSettings) -> bool:
    """Whether one force explains all steps within their noise where a cable's would differ."""
    std = np.array([step.force_std_N for step in steps])
    apart = np.abs(forces - np.average(forces, weights=1.0 / std**2))
    if np.any(apart > settings.still_force_sigma * std):
        return False
    at_rest = [step.branch == "mounted" for step in steps]
    if any(at_rest):
        return not all(at_rest)
    changed = float(np.ptp(forces)) > settings.still_force_relative * float(np.max(np.abs(forces)))
    return len(np.unique(places)) > 2 and not changed

"""Directions that a force log may leave open: signs of displacement and force, branch of each hold.

Forces come out positive in compression, displacements positive toward the other bearing. What the user says counts;
what is inferred instead, or contradicts, is a finding with its figures.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.intake.noted import doubtful, inferred
from pipeline.intake.specimenfile import LogSpec
from pipeline.records import Array, Branch, Finding
from pipeline.settings.intake import IntakeSettings
from pipeline.units import quantity

BENT = 0.2  # of the largest displacement; beyond, a pinned cable carries most of its buckling load whatever its law


def from_mounted(
    displacements: Array, mounted: NDArray[np.bool_], name: str, *, travel: float
) -> tuple[Array, list[Finding]]:
    """Displacements counted from the mounted cable where the log counts from the end of a machine's own way.

    Parameters
    ----------
    displacements : (n,) m
    mounted : (n,) bool
        Rows of the mounted cable.
    travel : m
        Between the smallest and the largest. A zero that is off by more is no error of the zero.
    """
    if not mounted.any():
        return displacements, []
    zero = float(np.median(displacements[mounted]))
    if abs(zero) <= travel:
        return displacements, []
    message = f"{name}: the mounted cable stands at {zero * 1e3:.4g} mm; displacements count from there"
    return displacements - zero, [inferred("log/displacement-zero", message)]


def signed_displacements(displacements: Array, name: str) -> tuple[Array, list[Finding]]:
    """Displacements (n,) m positive toward the other bearing; a log that counts downward is turned round."""
    reach = float(displacements[np.argmax(np.abs(displacements))])
    if reach >= 0.0:
        return displacements, []
    message = f"{name}: displacements run to {reach * 1e3:.4g} mm; taken as positive toward the other bearing"
    return -displacements, [doubtful("log/displacement-sign", message)]


def force_sign(
    forces: Array, displacements: Array, spec: LogSpec, *, name: str, settings: IntakeSettings
) -> tuple[float, list[Finding]]:
    """Factor 1 or -1 that makes compression positive: as the user says, else as a bent cable pushes.

    Parameters
    ----------
    forces : (k,) N
        Mean force of each hold, as in the log.
    displacements : (k,) m
        Of each hold, signed.
    """
    said = {"compression": 1.0, "tension": -1.0, None: 1.0}[spec.force_sign]
    bent = displacements > BENT * np.max(displacements)
    loud = bent & (np.abs(forces) > settings.zero_force_relative * np.max(np.abs(forces)))
    if not np.any(loud):
        return said, []
    negative = forces[loud] < 0.0
    median = f"median {quantity(float(np.median(forces[loud])), 'N')}"
    if spec.force_sign is None and np.mean(negative) >= settings.sign_share:
        message = (
            f"{name}: {np.count_nonzero(negative)} of {negative.size} bent steps have a negative force ({median}); the "
            "sign was reversed, because a cable that is pushed together pushes back: confirm with "
            'force_sign = "tension" in [rig], or keep the sign with "compression"'
        )
        return -1.0, [doubtful("log/force-sign", message)]
    if np.mean(said * forces[loud] < 0.0) >= settings.sign_share:
        message = (
            f'{name}: the forces of the bent steps ({median}) contradict force_sign = "{spec.force_sign}" in [rig]'
        )
        return said, [doubtful("log/force-sign", message)]
    return said, []


def inferred_branches(
    displacements: Sequence[float], forces: Sequence[float], tolerance: float, *, name: str, settings: IntakeSettings
) -> tuple[list[Branch], list[Finding]]:
    """Branch of each hold by the order of the displacements.

    Parameters
    ----------
    displacements, forces : (k,) m, N
        Of each hold, signed.
    tolerance : float
        m, displacements that close are equal.
    """
    branches: list[Branch] = []
    largest = max(abs(force) for force in forces)
    for number, position in enumerate(displacements):
        change = position - (displacements[number - 1] if number else 0.0)
        if number == 0 and abs(position) <= tolerance:
            free = abs(forces[0]) <= settings.zero_force_relative * largest
            branches.append("mounted" if free else "loading")
        elif branches and abs(change) <= tolerance:
            branches.append("loading" if branches[-1] == "mounted" else branches[-1])
        else:
            branches.append("loading" if change > 0.0 else "unloading")
    counts = ", ".join(f"{branches.count(branch)} {branch}" for branch in dict.fromkeys(branches))
    return branches, [inferred("log/branch-inferred", f"{name}: branches by the order of the displacements: {counts}")]

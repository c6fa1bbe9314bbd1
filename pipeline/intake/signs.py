"""Directions that a force log may leave open: signs of displacement and force, branch of each hold.

Forces come out positive in compression, displacements positive toward the other bearing. What the user says counts;
what is inferred instead, or contradicts, is a finding with its figures.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.intake.specimenfile import LogSpec
from pipeline.messages import Message
from pipeline.records import Array, Branch, Finding, doubtful, inferred

BENT = 0.2  # of the largest displacement; beyond, a pinned cable carries most of its buckling load whatever its law

FREE = 0.05
"""Of the largest force; at displacement 0 a cable with more is not force-free."""

AGREED = 0.75
"""Of the loaded steps; so many of one sign decide the sign of the log."""


def from_mounted(displacements: Array, mounted: NDArray[np.bool_], travel: float) -> tuple[Array, list[Finding]]:
    """Displacements counted from the mounted cable where the log counts from the end stop of the machine.

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
    return displacements - zero, [inferred("log/displacement-zero", zero_m=zero)]


def signed_displacements(displacements: Array) -> tuple[Array, list[Finding]]:
    """Displacements (n,) m positive toward the other bearing; a log that counts downward is turned round."""
    reach = float(displacements[np.argmax(np.abs(displacements))])
    if reach >= 0.0:
        return displacements, []
    return -displacements, [doubtful("log/displacement-sign", reach_m=reach)]


def force_sign(forces: Array, displacements: Array, spec: LogSpec) -> tuple[float, list[Finding]]:
    """Factor 1 or -1 that makes compression positive: as the user says, unless a bent cable would pull by it.

    Parameters
    ----------
    forces : (k,) N
        Mean force of each hold, as in the log.
    displacements : (k,) m
        Of each hold, signed.
    """
    said = {"compression": 1.0, "tension": -1.0, None: 1.0}[spec.force_sign]
    bent = displacements > BENT * np.max(displacements)
    loud = bent & (np.abs(forces) > FREE * np.max(np.abs(forces)))
    if not np.any(loud):
        return said, []
    pulling = said * forces[loud] < 0.0
    if np.mean(pulling) < AGREED:
        return said, []
    told = {
        "pulling": np.count_nonzero(pulling),
        "bent": pulling.size,
        "median_N": float(np.median(forces[loud])),
        "given": spec.force_sign,
        "right": "tension" if said > 0.0 else "compression",
    }
    return -said, [doubtful("log/force-sign" if spec.force_sign is None else "log/force-sign.given", **told)]


def inferred_branches(
    displacements: Sequence[float], forces: Sequence[float], tolerance: float
) -> tuple[list[Branch], list[Finding]]:
    """Branch of each hold by the order of its displacements (k,) m; those closer than ``tolerance`` (m) are equal."""
    branches: list[Branch] = []
    largest = max(abs(force) for force in forces)
    for number, position in enumerate(displacements):
        change = position - (displacements[number - 1] if number else 0.0)
        if number == 0 and abs(position) <= tolerance:
            free = abs(forces[0]) <= FREE * largest
            branches.append("mounted" if free else "loading")
        elif branches and abs(change) <= tolerance:
            branches.append("loading" if branches[-1] == "mounted" else branches[-1])
        else:
            branches.append("loading" if change > 0.0 else "unloading")
    each = dict.fromkeys(branches)
    counts = [Message("log/branch-inferred.count", count=branches.count(branch), branch=branch) for branch in each]
    return branches, [inferred("log/branch-inferred", counts=counts)]

"""Sides of the bow: which one is asked for, and which one a shape has.

A cable on two bearings can bow to either side. ``natural`` is the side on which it comes from the force-free shape (a
straight cable that buckles: up), ``opposite`` the other one, ``up`` (toward +y) and ``down`` are absolute. ``jump`` is
natural too, and goes on where the equilibria from the force-free shape on end: to where the cable comes to rest.

Units: m, rad, N.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from rod.characteristic import Array
from rod.discretisation import Rod

Branch = Literal["natural", "opposite", "up", "down", "jump"]


def bow(rod: Rod, angles: Array) -> float:
    """Mean height of a shape over its chord, relative to the length: positive if it bows toward +y."""
    h = rod.edges
    y = np.cumsum(h * np.sin(angles))
    return float(h @ y / rod.length**2)


def bow_side(rod: Rod, branch: Branch) -> int:
    """Side asked for: +1 up, -1 down, 0 if only following the path from the force-free shape can tell."""
    if branch in ("up", "down"):
        return 1 if branch == "up" else -1
    K0 = rod.section.pre_curvature
    low, high = float(K0.min()), float(K0.max())
    if branch == "jump" or (branch == "natural" and (low < 0.0 < high or (low == high == 0.0 and _driven(rod)))):
        return 0
    natural = 1 if bow(rod, rod.mounted.angles) >= 0.0 else -1
    return -natural if branch == "opposite" else natural


def _driven(rod: Rod) -> bool:
    """Whether loads, end moments or turned ends bend even a straight cable."""
    return rod.load[1] != 0.0 or any(end.moment or end.angle for end in (rod.left, rod.right))

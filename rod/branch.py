"""Sides of the bow: which one is asked for, which one a shape has, and a first guess on it.

A cable on two bearings can bow to either side. ``natural`` is the side on which it comes from the force-free shape (for
a straight cable: up), ``opposite`` the other one, ``up`` (toward +y) and ``down`` are absolute.

Units: m, rad, N.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq

from rod.characteristic import Array
from rod.discretisation import Rod
from rod.reduction import System

Branch = Literal["natural", "opposite", "up", "down"]


class Start(NamedTuple):
    """A state to start from: edge angles (n + 2,) rad and right reaction (2,) N."""

    angles: Array
    reaction: Array


def buckling_slope(rod: Rod) -> Array:
    """Slope of Euler's first buckling mode for the supports, per amplitude, on the edges (n + 2,)."""
    h = rod.edges
    position = (np.cumsum(h) - 0.5 * h) / rod.length
    left, right = rod.left.kind == "clamp", rod.right.kind == "clamp"
    if left and right:
        return np.sin(2.0 * np.pi * position)
    if left or right:
        k = 4.493409457909064  # tan k = k, one end clamped and one pinned
        z = position if left else 1.0 - position
        slope = (k * np.sin(k * z) + np.cos(k * z) - 1.0) / k
        return slope if left else -slope
    return np.cos(np.pi * position)


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
    if low < 0.0 < high and branch == "natural":
        return 0
    natural = 1 if bow(rod, rod.mounted.angles) >= 0.0 else -1
    return natural if branch == "natural" else -natural


def bowed_start(system: System, side: int) -> Start:
    """Force-free shape plus as much of the buckling mode as the chord needs, with the reaction that fits best."""
    rod, hold = system.rod, system.hold
    rest, mode = rod.mounted.angles, buckling_slope(rod)
    weighted = rod.edges * mode
    straight = -float(weighted @ rest / (weighted @ mode))

    def chord(amplitude: float) -> float:
        turned = rest + amplitude * mode
        return float(np.hypot(rod.edges @ np.cos(turned), rod.edges @ np.sin(turned)))

    if (goal := hold.chord) is not None:
        far = straight + side * 2.4  # J0 has its zero at 2.405: beyond, the ends of a straight cable would meet
        if chord(straight) <= goal:
            amplitude = straight
        elif chord(far) >= goal:
            amplitude = far
        else:
            amplitude = float(brentq(lambda a: chord(a) - goal, min(straight, far), max(straight, far), rtol=1e-6))
    else:
        # Post-buckling of the straight bar, P = P_E (1 + a^2/8): enough to leave the unstable straight shape.
        euler = (np.pi / rod.length) ** 2 * rod.stiffness_scale
        amplitude = straight + side * float(np.sqrt(8.0 * max((hold.force or 0.0) / euler - 1.0, 0.01)))
    turned = rest + amplitude * mode
    turned = turned - np.arctan2(rod.edges @ np.sin(turned), rod.edges @ np.cos(turned))
    still = system.balance(turned, np.zeros(2))
    reaction = np.linalg.lstsq(still.border.T / rod.length, -still.gradient / rod.length, rcond=None)[0]
    return Start(turned, np.asarray(reaction, float))

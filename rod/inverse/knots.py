"""Control points of the characteristic on the visited range: their places, and the natural spline through them.

Quadratic forms of the spline through values z at k places are taken with ``t`` from 0 to 1 over these places, whatever
their unit: what the smoothness prior (`rod.inverse.law_prior`) is made of.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


def place_knots(low: float, high: float, count: int) -> Array:
    """`count` knots over the visited range [low, high] 1/m, denser toward `low`, first and last on its ends.

    Laws of stick and slip bend most near the rest curvature, and a natural spline is straightest at its first knot: the
    first interval gets half the width of the last.

    Raises
    ------
    ValueError
        For fewer than three knots or an empty range.
    """
    if count < 3 or not high > low:
        raise ValueError(f"{count} knots on [{low:g}, {high:g}] 1/m: at least three on a range that is not empty")
    widths = np.linspace(1.0, 2.0, count - 1)
    return low + (high - low) * np.concatenate([[0.0], np.cumsum(widths) / widths.sum()])


def roughness(places: Array) -> Array:
    """Matrix S with ``z @ S @ z = int (d^2 z / dt^2)^2 dt`` of the natural spline through z at the places, (k, k)."""
    t = _from_0_to_1(places)
    bend = CubicSpline(t, np.eye(t.size), bc_type="natural")(t, 2)
    # Second derivatives are linear between knots: Simpson integrates their products exactly.
    h = np.diff(t)[:, None, None]
    left, right = bend[:-1], bend[1:]
    middle = 0.5 * (left + right)

    def square(rows: Array) -> Array:
        return np.asarray(rows[:, :, None] * rows[:, None, :])

    return np.asarray(np.sum(h / 6.0 * (square(left) + 4.0 * square(middle) + square(right)), axis=0))


def first_slope(places: Array) -> Array:
    """Row g with ``g @ z = dz/dt`` of the natural spline through z at the first place, (k,)."""
    t = _from_0_to_1(places)
    return np.asarray(CubicSpline(t, np.eye(t.size), bc_type="natural")(0.0, 1))


def _from_0_to_1(places: Array) -> Array:
    return np.asarray((places - places[0]) / (places[-1] - places[0]))

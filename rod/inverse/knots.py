"""Control points of the characteristic on the visited range: their places, and how rough the law between them may be.

The unknowns of the inverse problem are ``z = log f_EI`` at the knots, so the stiffness is positive. A smoothness prior,
density ``exp(-int (d^2 z / dt^2)^2 dt / (2 tau^2))`` with ``t`` from 0 to 1 over the knots, leaves straight lines free;
it makes the number of knots harmless from above, and its size tau follows from the data. With the natural spline
through the control points the integral is the quadratic form of `roughness`.

A cable that was never set bends alike to both sides of its rest curvature: f_EI is even about K0 and its slope there
zero. Not every cable is such, so the slope at the first knot has a prior of its own, ``N(0, sigma^2)``, whose size
follows from the data too, from "none" to "any".

Units: knots in 1/m; z, t and tau are pure numbers.
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


def roughness(knots: Array) -> Array:
    """Matrix S with ``z @ S @ z = int (d^2 z / dt^2)^2 dt`` of the natural spline through z at the knots, (p, p)."""
    t = (knots - knots[0]) / (knots[-1] - knots[0])
    bend = CubicSpline(t, np.eye(t.size), bc_type="natural")(t, 2)
    # Second derivatives are linear between knots: Simpson integrates their products exactly.
    h = np.diff(t)[:, None, None]
    left, right = bend[:-1], bend[1:]
    middle = 0.5 * (left + right)

    def square(rows: Array) -> Array:
        return np.asarray(rows[:, :, None] * rows[:, None, :])

    return np.asarray(np.sum(h / 6.0 * (square(left) + 4.0 * square(middle) + square(right)), axis=0))


def first_slope(knots: Array) -> Array:
    """Row g with ``g @ z = dz/dt`` of the natural spline through z at the first knot, (p,)."""
    t = (knots - knots[0]) / (knots[-1] - knots[0])
    return np.asarray(CubicSpline(t, np.eye(t.size), bc_type="natural")(0.0, 1))


def log_prior_volume(S: Array) -> float:
    """Half the log determinant of S between fixed end knots: what the prior's density has for tau = 1."""
    return 0.5 * float(np.linalg.slogdet(S[1:-1, 1:-1])[1]) if S.shape[0] > 2 else 0.0


def prior_forms(knots: Array, *, tau: float, slope: float, at: Array) -> Array:
    """Forms of log f at the curvatures `at` (n,) 1/m, one standard deviation of both priors each, (n, k - 1).

    Their outer products add up to the prior covariance of log f but for its level, of which the priors say nothing.
    """
    g = first_slope(knots)
    values, vectors = np.linalg.eigh(roughness(knots) / tau**2 + np.outer(g, g) / slope**2)
    spline = CubicSpline(knots, vectors[:, 1:] / np.sqrt(values[1:]), bc_type="natural")
    return np.asarray(spline(at))

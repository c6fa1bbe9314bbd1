"""Control points of the characteristic on the visited range: their places, and the natural spline through them.

Quadratic forms of the spline through values z at k places are taken with ``t`` from 0 to 1 over these places, whatever
their unit: what the smoothness prior (`pipeline.diagnosis.fits.spline_prior`) is made of.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def place_knots(low: float, high: float, count: int) -> Array:
    """Knots (count,) 1/m over the visited range [low, high], denser toward `low`, first and last on its ends.

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
    """Matrix S with ``z @ S @ z = int (d^2 z / dt^2)^2 dt`` of the natural spline through z at the places, (k, k).

    S = Q R^-1 Q^T (Green and Silverman, Nonparametric Regression and Generalized Linear Models, 1994, Sec. 2.1.2).
    """
    differences, inner = _bending(_from_0_to_1(places))
    return np.asarray(differences.T @ np.linalg.solve(inner, differences))


def first_slope(places: Array) -> Array:
    """Row g with ``g @ z = dz/dt`` of the natural spline through z at the first place, (k,)."""
    t = _from_0_to_1(places)
    width = t[1] - t[0]
    slope = -width / 6.0 * np.linalg.solve(*_bending(t)[::-1])[0]
    slope[:2] += np.array([-1.0, 1.0]) / width
    return np.asarray(slope)


def _bending(t: Array) -> tuple[Array, Array]:
    """Q^T (k - 2, k) and R (k - 2, k - 2): ``R @ d^2 z / dt^2 = Q^T @ z`` at the inner knots of a natural spline."""
    h = np.diff(t)
    inner = np.diag((h[:-1] + h[1:]) / 3.0) + np.diag(h[1:-1] / 6.0, 1) + np.diag(h[1:-1] / 6.0, -1)
    return np.diff(np.diff(np.eye(t.size), axis=0) / h[:, None], axis=0), inner


def _from_0_to_1(places: Array) -> Array:
    return np.asarray((places - places[0]) / (places[-1] - places[0]))

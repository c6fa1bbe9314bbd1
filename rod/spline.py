"""Natural cubic splines with linear ends, kept as their primitives, which are linear in the ordinates.

From knots to piecewise polynomials on all segments, the two unbounded ones included. The spline and its primitive are
linear in the ordinates; the cardinal splines (one ordinate 1, the others 0) carry that derivative.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from rod.array import Array


@dataclass(frozen=True, eq=False)
class Cardinal:
    """Primitives of the p cardinal splines, piecewise polynomials over all segments; 0 at the first knot.

    ``knots`` (p,); segment 0 lies below the first, segment p above the last. Coefficients (5, p, p + 1) are in
    ``u - origin[segment]``, rising powers.
    """

    knots: Array
    origin: Array
    primitive: Array


@lru_cache(maxsize=128)
def cardinal(knots: tuple[float, ...]) -> Cardinal:
    """Cardinal splines of the knots; remembered, since a fit changes ordinates a thousand times and knots never."""
    at, p = np.array(knots), len(knots)
    one, f = np.eye(p), np.zeros((4, p + 1, p))
    if p == 1:
        f[0] = one
    elif p == 2:
        f[0], f[1] = one[[0, 0, 1]], (one[1] - one[0]) / (at[1] - at[0])
    else:
        spline = CubicSpline(at, one, bc_type="natural")
        f[:, 1:-1] = spline.c[::-1]
        f[0, 0], f[0, -1] = one[0], one[-1]
        f[1, 0], f[1, -1] = spline(at[0], 1), spline(at[-1], 1)
    origin = at[np.r_[0, np.arange(p)]]
    primitive = np.concatenate([np.zeros((1, p + 1, p)), f / np.arange(1, 5)[:, None, None]])
    for j in range(2, p + 1):
        primitive[0, j] = (origin[j] - origin[j - 1]) ** np.arange(5) @ primitive[:, j - 1]
    return Cardinal(at, origin, np.ascontiguousarray(primitive.transpose(0, 2, 1)))


def slope(coefficients: Array) -> Array:
    """Coefficients of the derivative of a piecewise polynomial, one power less."""
    powers = np.arange(1, len(coefficients)).reshape(-1, *[1] * (coefficients.ndim - 1))
    return np.asarray(coefficients[1:] * powers)


def evaluate(coefficients: Array, cardinal: Cardinal, u: Array) -> Array:
    """Piecewise polynomial at ``u``; coefficients (k, p + 1), or (k, p, p + 1) for a result with a first axis p."""
    segment = cardinal.knots.searchsorted(u)
    t = np.asarray(u - cardinal.origin.take(segment))
    table = coefficients.take(segment, axis=-1)
    value = table[-1]
    for row in table[-2::-1]:
        value = value * t
        value += row
    return np.asarray(value)

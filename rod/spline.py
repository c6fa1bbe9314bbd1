"""Natural cubic spline with linear ends, its primitives, and its derivative by the ordinates.

From knots and ordinates to piecewise polynomials on all segments, the two unbounded ones included. The spline and its
primitives are linear in the ordinates; the cardinal splines (one ordinate 1, the others 0) carry that derivative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pieces:
    """Piecewise polynomials of f and its first two primitives, and of the cardinal splines, over all segments.

    ``breaks`` are the q spline knots; segment 0 lies below the first, segment q above the last. Coefficients are in
    ``u - origin[segment]``, rising powers: f (4,), primitive F (5,), second primitive G (6,); with F = G = 0 at the
    first break. ``cardinal`` holds the same for the unit ordinates: shape (6, q + 1, p).
    """

    breaks: Array
    origin: Array
    f: Array
    F: Array
    G: Array
    cardinal_f: Array
    cardinal_primitive: Array


def pieces(knots: Array, ordinates: Array, even: bool) -> Pieces:
    """Coefficients of f, F, G and of the cardinal splines on every segment, the linear ends included."""
    p = knots.size
    at, pick = knots, np.eye(p)
    if even:
        inner = knots > 0.0
        at = np.concatenate([-knots[inner][::-1], knots])
        pick = np.vstack([pick[inner][::-1], pick])
    q = at.size
    f = np.zeros((4, q + 1, p))
    if q == 1:
        f[0] = pick
    elif q == 2:
        slope = (pick[1] - pick[0]) / (at[1] - at[0])
        f[0], f[1] = pick[[0, 0, 1]], slope
    else:
        spline = CubicSpline(at, pick, bc_type="natural")
        f[:, 1:-1] = spline.c[::-1]
        f[0, 0], f[0, -1] = pick[0], pick[-1]
        f[1, 0], f[1, -1] = spline(at[0], 1), spline(at[-1], 1)
    origin = at[np.r_[0, np.arange(q)]]
    F = np.zeros((5, q + 1, p))
    F[1:] = f / np.arange(1, 5)[:, None, None]
    G = np.zeros((6, q + 1, p))
    # Constants of integration: F = G = 0 at the first break, both continuous through all breaks.
    for j in range(2, q + 1):
        t = origin[j] - origin[j - 1]
        F[0, j] = _horner(F[:, j - 1], t)
    G[1:] = F / np.arange(1, 6)[:, None, None]
    for j in range(2, q + 1):
        t = origin[j] - origin[j - 1]
        G[0, j] = _horner(G[:, j - 1], t)
    return Pieces(at, origin, f @ ordinates, F @ ordinates, G @ ordinates, f, F)


def _horner(coefficients: Array, t: float) -> Array:
    value = coefficients[-1]
    for c in coefficients[-2::-1]:
        value = value * t + c
    return np.asarray(value)


def evaluate(coefficients: Array, pieces: Pieces, u: Array) -> Array:
    """Piecewise polynomial at ``u``; with cardinal coefficients (k, q + 1, p) the result has a last axis p."""
    segment = pieces.breaks.searchsorted(u)
    t = np.asarray(u - pieces.origin.take(segment))
    table = coefficients.take(segment, axis=1)
    if coefficients.ndim == 3:
        t = t[..., None]
    value = table[-1]
    for row in table[-2::-1]:
        value = value * t
        value += row
    return np.asarray(value)


def slope(pieces: Pieces, u: Array, cardinal: bool = False) -> Array:
    """Derivative f'(u), N m^3, or that of the cardinal splines (n, p)."""
    c = pieces.cardinal_f if cardinal else pieces.f
    weights = np.arange(1, 4).reshape((3,) + (1,) * (c.ndim - 1))
    return evaluate(c[1:] * weights, pieces, u)

"""Natural cubic spline with linear ends, its primitives, and its derivative by the ordinates.

From knots and ordinates to piecewise polynomials on all segments, the two unbounded ones included. The spline and its
primitives are linear in the ordinates; the cardinal splines (one ordinate 1, the others 0) carry that derivative.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Cardinal:
    """Piecewise polynomials of the p cardinal splines and of their first two primitives, over all segments.

    ``breaks`` are the q spline knots; segment 0 lies below the first, segment q above the last. Coefficients are in
    ``u - origin[segment]``, rising powers: f (4, p, q + 1), primitive F (5, p, q + 1), second primitive G
    (6, p, q + 1), with F = G = 0 at the first break.
    """

    breaks: Array
    origin: Array
    f: Array
    F: Array
    G: Array


@dataclass(frozen=True, eq=False)
class Pieces:
    """The spline with given ordinates: coefficients of f (4, q + 1), F (5, q + 1) and G (6, q + 1)."""

    cardinal: Cardinal
    f: Array
    F: Array
    G: Array


def pieces(knots: Array, ordinates: Array, even: bool) -> Pieces:
    """Spline through ``(knots, ordinates)``, (p,) each; ``even`` adds the mirrored control points."""
    c = cardinal(tuple(knots.tolist()), even)
    return Pieces(c, ordinates @ c.f, ordinates @ c.F, ordinates @ c.G)


@lru_cache(maxsize=128)
def cardinal(knots: tuple[float, ...], even: bool) -> Cardinal:
    """Cardinal splines of the knots; remembered, since a fit changes ordinates a thousand times and knots never."""
    points, p = np.array(knots), len(knots)
    at, pick = points, np.eye(p)
    if even:
        inner = points > 0.0
        at = np.concatenate([-points[inner][::-1], points])
        pick = np.vstack([pick[inner][::-1], pick])
    q = at.size
    f = np.zeros((4, q + 1, p))
    if q == 1:
        f[0] = pick
    elif q == 2:
        f[0], f[1] = pick[[0, 0, 1]], (pick[1] - pick[0]) / (at[1] - at[0])
    else:
        spline = CubicSpline(at, pick, bc_type="natural")
        f[:, 1:-1] = spline.c[::-1]
        f[0, 0], f[0, -1] = pick[0], pick[-1]
        f[1, 0], f[1, -1] = spline(at[0], 1), spline(at[-1], 1)
    origin = at[np.r_[0, np.arange(q)]]
    F = _primitive(f, origin)
    G = _primitive(F, origin)
    return Cardinal(at, origin, *(np.ascontiguousarray(c.transpose(0, 2, 1)) for c in (f, F, G)))


def _primitive(coefficients: Array, origin: Array) -> Array:
    """Primitive of piecewise polynomials (k, q + 1, p): zero at the first break, continuous through all of them."""
    k, segments, _ = coefficients.shape
    made = np.zeros((k + 1, *coefficients.shape[1:]))
    made[1:] = coefficients / np.arange(1, k + 1)[:, None, None]
    for j in range(2, segments):
        powers = (origin[j] - origin[j - 1]) ** np.arange(k + 1)
        made[0, j] = powers @ made[:, j - 1]
    return made


def evaluate(coefficients: Array, cardinal: Cardinal, u: Array) -> Array:
    """Piecewise polynomial at ``u``; coefficients (k, q + 1), or (k, p, q + 1) for a result with a first axis p."""
    segment = cardinal.breaks.searchsorted(u)
    t = np.asarray(u - cardinal.origin.take(segment))
    table = coefficients.take(segment, axis=-1)
    value = table[-1]
    for row in table[-2::-1]:
        value = value * t
        value += row
    return np.asarray(value)


def slope(coefficients: Array, cardinal: Cardinal, u: Array) -> Array:
    """Derivative of a piecewise polynomial; arguments and shape as in `evaluate`."""
    powers = np.arange(1, coefficients.shape[0]).reshape((-1,) + (1,) * (coefficients.ndim - 1))
    return evaluate(coefficients[1:] * powers, cardinal, u)

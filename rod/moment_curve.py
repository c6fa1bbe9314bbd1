"""Moment curves m(K, K0) as a protocol, and laws of the bend K - K0 alone: points with tangents, cubic between them.

`rod.compliance_law` and `rod.stiffness_law` say how the points come from coefficients.

Units: bend and curvature in 1/m, moments in N m, tangents in N m^2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from rod.array import Array


@dataclass(frozen=True, eq=False)
class CubicCurve:
    """Moment over the bend through (bend, moment) points with the tangents there, cubic between, straight beyond them.

    Attributes
    ----------
    bends : (g,) 1/m
    table : (4, g + 1)
        Rising powers of the moment on each segment. Segment 0 lies below the first point, the last one above the last.
    origin : (g + 1,) 1/m
    """

    bends: Array
    table: Array
    origin: Array

    def at(self, bend: Array) -> tuple[Array, Array]:
        """Moment and tangent at bends (n,)."""
        segment = self.bends.searchsorted(bend)
        t = bend - self.origin.take(segment)
        a, b, c, d = self.table.take(segment, axis=1)
        return ((d * t + c) * t + b) * t + a, (3.0 * d * t + 2.0 * c) * t + b


def moment_curve(K: Array, m: Array, f: Array) -> CubicCurve:
    """The curve through bends K (g,) and moments m (g,) with tangents f (g,)."""
    h = np.diff(K)
    mean = np.diff(m) / h
    table = np.zeros((4, K.size + 1))
    table[0, 1:-1], table[1, 1:-1] = m[:-1], f[:-1]
    table[2, 1:-1] = (3.0 * mean - 2.0 * f[:-1] - f[1:]) / h
    table[3, 1:-1] = (f[:-1] + f[1:] - 2.0 * mean) / h**2
    table[0, 0], table[1, 0], table[0, -1], table[1, -1] = m[0], f[0], m[-1], f[-1]
    return CubicCurve(K, table, np.concatenate([K[:1], K]))


class MomentCurve(Protocol):
    """Moment and tangent over the curvature ``K`` (n,) 1/m, for a pre-curvature ``K0``, one or (n,) 1/m."""

    @property
    def stiffness_scale(self) -> float:
        """Typical size of the stiffness, N m^2; used for scaling only."""

    def bound(self, K0: Array) -> Callable[[Array], tuple[Array, Array]]:
        """Function of K alone that returns moment and tangent, for given K0 (n,) or (1,)."""

    def moment(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Bending moment m(K, K0), N m."""
        return self.bound(np.asarray(K0, float))(np.asarray(K, float))[0]

    def tangent(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Tangent dm/dK, N m^2."""
        return self.bound(np.asarray(K0, float))(np.asarray(K, float))[1]

    def moment_by_pre_curvature(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative dm/dK0, N m^2."""


class LawOfBend(MomentCurve, Protocol):
    """A law of the bend K - K0 alone: it moves with the pre-curvature, and lacks only moment and tangent at a bend."""

    @property
    def at(self) -> Callable[[Array], tuple[Array, Array]]:
        """Function from bends (n,) to moment and tangent."""

    def bound(self, K0: Array) -> Callable[[Array], tuple[Array, Array]]:
        """Function of K alone that returns moment and tangent, for given K0 (n,) or (1,)."""
        at = self.at
        return lambda K: at(K - K0)

    def moment_by_pre_curvature(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative dm/dK0, N m^2: the law moves with K0."""
        return -self.tangent(K, K0)

"""Smooth positive compliance c(m) = dK/dm as a penalised spline, and the curvature K(m) = K0 + int_0^m c dm.

The balance equations give the moment almost without error and the curvature with error, so the curvature is regressed
on the moment: no attenuation by errors in the abscissa. ``log c`` is a cubic B-spline over the moments met, so c > 0
and m(K) is monotone whatever the coefficients, with ``mu = (m - low) / (high - low)``. How smooth it is, is told by
`rod.balance.smoothness`.

Units: moment in N m, compliance in 1/(N m^2), curvature in 1/m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline

Array = NDArray[np.float64]

DEGREE = 3
GRID = 240
"""Cells of the running integral: K(m) is then within 1e-5 of its range, a tenth of the best photo."""


@dataclass(frozen=True)
class ComplianceBasis:
    """B-splines of log c on the moments [low, high] with 0 inside or at an end.

    Attributes
    ----------
    low, high : N m
    unit : 1/(N m^2)
        Compliance of all coefficients zero.
    moments : (GRID + 1,) N m
        Grid of the running integrals; holds 0 as a node.
    table : (GRID + 1, p)
        B-splines on the grid.
    zero : int
        Index of m = 0.
    spline : BSpline
        The p splines as one vector-valued spline over mu.
    nodes, weights : (g,)
        Of a quadrature over mu that is exact for products of the splines' second derivatives.
    """

    low: float
    high: float
    unit: float
    moments: Array
    table: Array
    zero: int
    spline: BSpline
    nodes: Array
    weights: Array

    def at(self, moment: ArrayLike) -> Array:
        """The splines at `moment` (n,), N m -> (n, p); constant continuation outside."""
        mu = (np.asarray(moment, float) - self.low) / (self.high - self.low)
        return np.asarray(self.spline(np.clip(mu, 0.0, 1.0)))

    def slope(self, moment: ArrayLike) -> Array:
        """d/dm of the splines, (n, p) in 1/(N m)."""
        span = self.high - self.low
        mu = (np.asarray(moment, float) - self.low) / span
        return np.asarray(self.spline(np.clip(mu, 0.0, 1.0), 1)) / span


def compliance_basis(low: float, high: float, *, unit: float, coefficients: int = 10) -> ComplianceBasis:
    """Basis over the moments [min(low, 0), max(high, 0)].

    Parameters
    ----------
    low, high : N m
        Smallest and largest moment met.
    unit : 1/(N m^2)
        Typical compliance.
    coefficients : int
        Number of B-splines, at least 5. The prior, not their number, decides how bent the law may be.

    Raises
    ------
    ValueError
        If all moments are zero, or there are too few coefficients.
    """
    low, high = min(low, 0.0), max(high, 0.0)
    if not high > low:
        raise ValueError("all moments are zero: a compliance needs a loaded cable")
    if coefficients < DEGREE + 2:
        raise ValueError(f"at least {DEGREE + 2} coefficients")
    inner = np.linspace(0.0, 1.0, coefficients - DEGREE + 1)
    spline = BSpline(np.r_[np.zeros(DEGREE), inner, np.ones(DEGREE)], np.eye(coefficients), DEGREE)
    below = round(GRID * -low / (high - low))
    parts = [np.linspace(low, 0.0, below + 1)[:-1] if low < 0.0 else np.empty(0)]
    parts.append(np.linspace(0.0, high, GRID - below + 1) if high > 0.0 else np.zeros(1))
    moments = np.concatenate(parts)
    table = np.asarray(spline((moments - low) / (high - low)))
    # Second derivatives of cubics are linear in each interval: two Gauss points integrate their products exactly.
    half = 0.5 * np.diff(inner)[:, None]
    nodes = (0.5 * (inner[:-1] + inner[1:])[:, None] + half * np.array([-1.0, 1.0]) / np.sqrt(3.0)).ravel()
    zero = int(np.argmin(np.abs(moments)))
    return ComplianceBasis(low, high, unit, moments, table, zero, spline, nodes, np.repeat(half.ravel(), 2))


@dataclass(frozen=True)
class ComplianceCurve:
    """One compliance: coefficients of log c on a basis; curvature and derivatives by the running integral."""

    basis: ComplianceBasis
    coefficients: Array
    rise: Array
    rise_by_coefficients: Array

    def compliance(self, moment: ArrayLike) -> Array:
        """c(m), 1/(N m^2)."""
        return np.asarray(self.basis.unit * np.exp(self.basis.at(moment) @ self.coefficients))

    def log_slope(self, moment: ArrayLike) -> Array:
        """Derivative of log c with respect to the moment, 1/(N m)."""
        return np.asarray(self.basis.slope(moment) @ self.coefficients)

    def excess(self, moment: ArrayLike) -> Array:
        """int_0^m c dm = K - K0, (n,) 1/m; beyond the range of the basis with the compliance of its end.

        Moments corrected for a common error of the axes leave that range: held at its end, the curve would refuse the
        correction that a photo with the largest moments asks for.
        """
        below, above = self._beyond(moment)
        return np.asarray(np.interp(np.asarray(moment, float), self.basis.moments, self.rise) + below + above)

    def excess_by_coefficients(self, moment: ArrayLike) -> Array:
        """Derivative of `excess`, (n, p) in 1/m."""
        grid, table = self.basis.moments, self.rise_by_coefficients
        m = np.clip(np.asarray(moment, float), grid[0], grid[-1])
        cell = np.clip(np.searchsorted(grid, m) - 1, 0, grid.size - 2)
        weight = ((m - grid[cell]) / (grid[cell + 1] - grid[cell]))[:, None]
        below, above = self._beyond(moment)
        ends = below[:, None] * self.basis.table[0] + above[:, None] * self.basis.table[-1]
        return np.asarray((1.0 - weight) * table[cell] + weight * table[cell + 1] + ends)

    def moment(self, excess: ArrayLike) -> Array:
        """Inverse of `excess`: m for K - K0 (n,), N m."""
        K, (low, high), (first, last) = np.asarray(excess, float), self.rise[[0, -1]], self._at_ends
        beyond = np.minimum(K - low, 0.0) / first + np.maximum(K - high, 0.0) / last
        return np.asarray(np.interp(K, self.rise, self.basis.moments) + beyond)

    def _beyond(self, moment: ArrayLike) -> tuple[Array, Array]:
        """What of the excess lies below and above the range of the basis, 1/m."""
        m, (low, high), (first, last) = np.asarray(moment, float), self.basis.moments[[0, -1]], self._at_ends
        return np.asarray(first * np.minimum(m - low, 0.0)), np.asarray(last * np.maximum(m - high, 0.0))

    @property
    def _at_ends(self) -> Array:
        """Compliance at both ends of the basis, (2,) 1/(N m^2)."""
        return np.asarray(self.basis.unit * np.exp(self.basis.table[[0, -1]] @ self.coefficients))


def compliance_curve(basis: ComplianceBasis, coefficients: Array) -> ComplianceCurve:
    """Integrate the compliance of the given coefficients (p,) over the grid."""
    c = basis.unit * np.exp(basis.table @ coefficients)
    step = np.diff(basis.moments)
    rise = np.concatenate([[0.0], np.cumsum(0.5 * step * (c[1:] + c[:-1]))])
    weighted = c[:, None] * basis.table
    slopes = np.vstack(
        [np.zeros((1, basis.table.shape[1])), np.cumsum(0.5 * step[:, None] * (weighted[1:] + weighted[:-1]), 0)]
    )
    return ComplianceCurve(basis, coefficients, rise - rise[basis.zero], slopes - slopes[basis.zero])

"""A positive law of any form: log compliance as a spline, the moment curve that it means, and its derivatives.

The compliance c = dK/dm is positive whatever its spline's coefficients a, so the curvature grows with the moment:

    log(c / unit) = sum_i a_i B_i(xi),    K - K0 = int_0^m c dm',    f_EI = dm/dK = 1 / c    (tangent reading)

with cubic B-splines over an abscissa xi from 0 to 1 that rises with the moment. A cable whose layers slip early loses
its stiffness within a small part of the curvature but over a large part of the moment; one with a plateau of the moment
does the opposite; one whose layers slip at once changes within little of both. Over the mean of three shares,

    xi = (share of the moment + share of the bend K - K0 + w share of the change of log c) / (2 + w),    w = T / (1 + T)

with T = int |d log c|, nothing of it happens within less than a third of the interval, and a law that hardly changes is
one over moment and bend. All this is of a law known before (`refreshed`); without one xi is the share of the moment.
The law is one of the bend K - K0, so a cable that is set keeps it; beyond the moments of its basis the compliance is
that of the nearer end.

Units: moments in N m, compliance in 1/(N m^2), curvature in 1/m.

Source: integrals by Simpson's rule on `CELLS` cells, the inverse m(K) by cubic Hermite interpolation between them
(both of order four: 1e-7 of the range for a law that changes tenfold).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, CubicHermiteSpline

from rod.array import Array
from rod.moment_curve import LawOfBend, moment_curve

DEGREE = 3

COEFFICIENTS = 24
"""Of log c: the prior (`rod.law_prior`) decides how bent a law may be. With 16 a plateau of the moment that begins and
ends within a thirtieth of the range is smeared: 51 instead of 68 % of it lay in the band; 36 change nothing more."""

CELLS = 200
"""Of the integral of the compliance."""


@dataclass(frozen=True, eq=False)
class LawBasis:
    """Abscissa and B-splines of log c.

    Attributes
    ----------
    unit : 1/(N m^2)
        Compliance of all coefficients zero.
    moments : (g,) N m
        At the ends of all cells; 0 is one of them.
    at_ends : (g, p)
        B-splines there.
    middle : (g - 1, p)
        B-splines in the middle of each cell.
    pace : (2 g - 1,) N m
        dm/dxi at ends and middles in turn.
    xi : (2 g - 1,)
        Abscissa of these.
    rest : int
        Place of m = 0 among the ends.
    """

    unit: float
    moments: Array
    at_ends: Array
    middle: Array
    pace: Array
    xi: Array
    rest: int

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return int(self.at_ends.shape[1])

    @property
    def spline(self) -> BSpline:
        """All B-splines over xi as one vector-valued spline."""
        return splines(self.size)

    @property
    def span(self) -> float:
        """Range of the moment, N m."""
        return float(np.ptp(self.moments))

    def place(self, moment: ArrayLike) -> Array:
        """Abscissa xi of moments (n,), N m; that of the nearer end outside."""
        return np.clip(self.abscissa(np.clip(np.asarray(moment, float), *self.moments[[0, -1]])), 0.0, 1.0)

    @cached_property
    def abscissa(self) -> CubicHermiteSpline:
        """Spline from a moment of the basis, N m, to its abscissa xi."""
        return CubicHermiteSpline(self.moments, self.xi[::2], 1.0 / self.pace[::2])

    def at(self, moment: ArrayLike) -> Array:
        """B-splines (n, p) at moments (n,) N m; those of the nearer end outside."""
        return np.asarray(self.spline(self.place(moment)))

    def law(self, coefficients: Array) -> ComplianceLaw:
        """The law with these coefficients (p,)."""
        return ComplianceLaw(self, np.asarray(coefficients, float))

    def projected(self, law: ComplianceLaw) -> Array:
        """Coefficients (p,) on this basis that come nearest to a law on another one."""
        log_c = np.log(law.compliance(self.moments) / self.unit)
        return np.asarray(np.linalg.lstsq(self.at_ends, log_c, rcond=None)[0])


def moment_basis(low: float, high: float, *, unit: float, size: int = COEFFICIENTS) -> LawBasis:
    """Basis over the moments [min(low, 0), max(high, 0)] N m with xi the share of the moment.

    Raises `ValueError` if all moments are zero.
    """
    low, high = _with_rest(low, high)
    span = high - low
    return _basis(np.array([low, high]), np.array([0.0, 1.0]), lambda m: np.full(m.shape, span), unit=unit, size=size)


def refreshed(law: ComplianceLaw, low: float, high: float, *, size: int | None = None) -> LawBasis:
    """Basis over the moments [min(low, 0), max(high, 0)] N m on which a law found before changes evenly along xi.

    It has ``size`` coefficients, or as many as the law. All changes count, however well they are known: waves that
    noise makes cost a smooth law nothing, and a knee is followed as far as it falls.
    """
    low, high = _with_rest(low, high)
    m = np.sort(np.concatenate([np.linspace(low, high, 2 * CELLS), law.basis.moments]))
    m = m[(m >= low) & (m <= high)]
    m = m[np.append(np.diff(m) > 1e-3 * (high - low) / CELLS, True)]  # rounding puts one moment in two places
    m[0] = low
    bend = law.bend(m)
    here, between = (np.abs(law.log_slope(at)) for at in (m, 0.5 * (m[1:] + m[:-1])))
    change = np.concatenate([[0.0], np.cumsum(np.diff(m) / 6.0 * (here[1:] + 4.0 * between + here[:-1]))])
    weight = 1.0 / (1.0 + change[-1])
    ranges, total = (high - low, bend[-1] - bend[0]), 2.0 + weight * change[-1]
    share = ((m - low) / ranges[0] + (bend - bend[0]) / ranges[1] + weight * change) / total
    rises = np.append(True, np.diff(np.maximum.accumulate(share)) > 0.0)  # of what rounding leaves level, one place
    m, share = m[rises], share[rises]

    def pace(at: Array) -> Array:
        change = weight * np.abs(law.log_slope(at))
        return np.asarray(total / (1.0 / ranges[0] + law.compliance(at) / ranges[1] + change))

    return _basis(m, share, pace, unit=law.basis.unit, size=size or law.basis.size)


def _with_rest(low: float, high: float) -> tuple[float, float]:
    """The range with m = 0 in it; a side shorter than a cell of the other is none."""
    low, high = min(low, 0.0), max(high, 0.0)
    if not high > low:
        raise ValueError("all moments are zero: a law of bending needs a loaded cable")
    least = (high - low) / CELLS
    return (low if -low > least else 0.0), (high if high > least else 0.0)


@lru_cache(maxsize=16)
def splines(size: int) -> BSpline:
    """The `size` cubic B-splines on [0, 1] as one vector-valued spline."""
    inner = np.linspace(0.0, 1.0, size - DEGREE + 1)
    return BSpline(np.r_[np.zeros(DEGREE), inner, np.ones(DEGREE)], np.eye(size), DEGREE)


def _basis(m: Array, share: Array, pace_at: Callable[[Array], Array], *, unit: float, size: int) -> LawBasis:
    """Basis whose abscissa runs through the points (m, share), both increasing, share from 0 to 1, pace dm/dshare."""
    rest_at = float(np.interp(0.0, m, share))
    below = round(CELLS * rest_at)
    ends = np.concatenate([np.linspace(0.0, rest_at, below + 1)[:-1], np.linspace(rest_at, 1.0, CELLS - below + 1)])
    xi = np.empty(2 * ends.size - 1)
    xi[::2], xi[1::2] = ends, 0.5 * (ends[1:] + ends[:-1])
    pace = pace_at(CubicHermiteSpline(share, m, pace_at(m))(xi))
    moments = _cumulated(pace[:, None], xi)[:, 0]
    rest = int(np.argmin(np.abs(ends - rest_at)))
    # to the last digits of the integral
    scale = (m[-1] - m[0]) / moments[-1]
    moments, pace = (moments - moments[rest]) * scale, pace * scale
    table = np.asarray(splines(size)(xi))
    return LawBasis(unit, moments, table[::2], table[1::2], pace, xi, rest)


def _cumulated(rates: Array, xi: Array) -> Array:
    """Running integral (g, q) over the cells of rates (2 g - 1, q) at ends and middles, Simpson's rule."""
    width = (xi[2::2] - xi[:-2:2])[:, None]
    cells = width / 6.0 * (rates[:-2:2] + 4.0 * rates[1::2] + rates[2::2])
    return np.vstack([np.zeros((1, rates.shape[1])), np.cumsum(cells, axis=0)])


@dataclass(frozen=True, eq=False)
class ComplianceLaw(LawOfBend):
    """One law: coefficients (p,) of log c on a basis. A moment curve (`rod.characteristic.ParametricCurve`)."""

    basis: LawBasis
    coefficients: Array

    # Compliance over the moment -----------------------------------------------------------------------------------

    @cached_property
    def _paces(self) -> Array:
        """dK/dxi at ends and middles, (2 g - 1,) 1/m."""
        b = self.basis
        c = np.empty(b.xi.size)
        c[::2], c[1::2] = self.rates, b.unit * np.exp(b.middle @ self.coefficients)
        return np.asarray(c * b.pace)

    @cached_property
    def rates(self) -> Array:
        """Compliance at the ends of the cells, (g,) 1/(N m^2)."""
        return np.asarray(self.basis.unit * np.exp(self.basis.at_ends @ self.coefficients))

    @cached_property
    def bends(self) -> Array:
        """K - K0 at the moments of the basis, (g,) 1/m."""
        rise = _cumulated(self._paces[:, None], self.basis.xi)[:, 0]
        return np.asarray(rise - rise[self.basis.rest])

    @cached_property
    def _rise(self) -> CubicHermiteSpline:
        """K - K0 over the moments of the basis, 1/m."""
        return CubicHermiteSpline(self.basis.moments, self.bends, self.rates)

    @cached_property
    def _rise_by(self) -> CubicHermiteSpline:
        """Its derivative by the coefficients, (p,) 1/m: made once for all steps of a test."""
        b = self.basis
        rates = np.empty((b.xi.size, b.size))
        rates[::2], rates[1::2] = self._paces[::2, None] * b.at_ends, self._paces[1::2, None] * b.middle
        rise = _cumulated(rates, b.xi)
        return CubicHermiteSpline(b.moments, rise - rise[b.rest], self.rates[:, None] * b.at_ends)

    def compliance(self, moment: ArrayLike) -> Array:
        """c(m), (n,) 1/(N m^2)."""
        return np.asarray(self.basis.unit * np.exp(self.basis.at(moment) @ self.coefficients))

    def log_slope(self, moment: ArrayLike) -> Array:
        """Derivative of log c by the moment, (n,) 1/(N m); zero outside the moments of the basis."""
        m, b = np.asarray(moment, float), self.basis
        slope = np.asarray(b.spline(b.place(m), 1)) @ self.coefficients * b.abscissa(m, 1)
        # the end of a range counts as inside, rounded as it may be
        outside = np.maximum(b.moments[0] - m, m - b.moments[-1])
        return np.where(outside <= 1e-9 * b.span, slope, 0.0)

    def bend(self, moment: ArrayLike) -> Array:
        """K - K0 of moments (n,) N m, 1/m."""
        return self._beyond(self._rise, self.rates[[0, -1]], moment)

    def bend_by_coefficients(self, moment: ArrayLike) -> Array:
        """Derivative of `bend`, (n, p) 1/m."""
        return self._beyond(self._rise_by, self.rates[[0, -1], None] * self.basis.at_ends[[0, -1]], moment)

    def _beyond(self, inside: CubicHermiteSpline, slopes: Array, moment: ArrayLike) -> Array:
        """A spline over the moments of the basis, and straight with the slopes (2, ...) of its ends beyond them."""
        m, (low, high) = np.asarray(moment, float), self.basis.moments[[0, -1]]
        out = np.stack([np.minimum(m - low, 0.0), np.maximum(m - high, 0.0)], axis=-1)
        return np.asarray(inside(np.clip(m, low, high)) + out @ slopes)

    # The moment curve -------------------------------------------------------------------------------------------------

    @cached_property
    def at(self) -> Callable[[Array], tuple[Array, Array]]:
        """Function from bends (n,) to moment and tangent."""
        return moment_curve(self.bends, self.basis.moments, 1.0 / self.rates).at

    @property
    def stiffness_scale(self) -> float:
        """Largest tangent stiffness on the basis, N m^2; used for scaling only."""
        return float(1.0 / self.rates.min())

    @property
    def parameters(self) -> int:
        """Number of coefficients."""
        return self.basis.size

    def log_tangent_by_pre_curvature(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of log f by K0 at fixed curvature, (n,) m."""
        m, f = self.bound(np.asarray(K0, float))(np.asarray(K, float))
        return self.log_slope(m) * f

    def moment_by_parameters(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of the moment by the coefficients at fixed curvature, (n, p) N m."""
        m, f = self.bound(np.asarray(K0, float))(np.asarray(K, float))
        return np.asarray(-f[:, None] * self.bend_by_coefficients(m))

    def log_tangent_by_parameters(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of log f by the coefficients at fixed curvature, (n, p)."""
        m, f = self.bound(np.asarray(K0, float))(np.asarray(K, float))
        moved = -f[:, None] * self.bend_by_coefficients(m)
        return np.asarray(-self.basis.at(m) - self.log_slope(m)[:, None] * moved)

"""The bending stiffness characteristic f_EI: from control points to the moment curve m(K, K0).

A characteristic *is* its moment curve; tangent and secant are two readings of it, and every number called f_EI must say
which one it is:

    tangent  f = dm/dK            (Eqs. (5) and (14) of the paper)
    secant   f = m / (K - K0)     (fixed point of the iteration of Sec. 2.3)

They agree only for constant f or at K = K0. `Characteristic` is a natural cubic spline of f through control points
(knots), continued linearly outside, in either reading; whichever is chosen, `moment`, `tangent` and `secant` answer for
the same object:

    m(K, K0) = int_{K0}^{K} f dk            tangent reading
    m(K, K0) = f(K) (K - K0)                secant reading

Signs and units: curvature ``K`` and pre-curvature ``K0`` in 1/m, positive in the direction of the bow; moment in N m
with the sign of ``K - K0`` (for positive stiffness); f in N m^2.

The abscissa of the spline is the curvature ``K`` itself (as in the paper) or the excess ``K - K0`` (a cable that was
set to another shape keeps its law).

Source: *Identification of Nonlinear Elastic Bending Behavior for Cable Simulation*, Secs. 2.3, 4 and 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, Protocol, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from rod.array import Array
from rod.moment_curve import MomentCurve as MomentCurve
from rod.spline import Cardinal, cardinal, evaluate, slope

Reading = Literal["tangent", "secant"]
Abscissa = Literal["curvature", "excess"]


class ParametricCurve(MomentCurve, Protocol):
    """A moment curve with numbers that a fit may move: control points, or coefficients."""

    @property
    def parameters(self) -> int:
        """Number of them."""

    def moment_by_parameters(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of the moment by them at fixed curvature, (n, p)."""


def parametric(law: MomentCurve) -> TypeGuard[ParametricCurve]:
    """Whether a law has numbers that a fit may move; to ask the Protocol itself takes as long as a Newton step."""
    return hasattr(law, "moment_by_parameters")


@dataclass(frozen=True, eq=False)
class Characteristic(MomentCurve):
    """Natural cubic spline f through control points, and the moment curve that it means.

    Made by `from_ordinates` or `constant`.

    Attributes
    ----------
    knots : (p,) 1/m
        Increasing abscissae of the control points.
    ordinates : (p,) N m^2
    reading : {"tangent", "secant"}
        What f means.
    abscissa : {"curvature", "excess"}
        f depends on K, or on K - K0.
    """

    knots: Array
    ordinates: Array
    reading: Reading = "tangent"
    abscissa: Abscissa = "curvature"
    _cardinal: Cardinal = field(init=False, repr=False)
    _primitive: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        knots, ordinates = np.atleast_1d(self.knots).astype(float), np.atleast_1d(self.ordinates).astype(float)
        if knots.ndim != 1 or knots.shape != ordinates.shape:
            raise ValueError(f"knots {knots.shape} and ordinates {ordinates.shape} must be one-dimensional and equal")
        if not (np.all(np.isfinite(knots)) and np.all(np.isfinite(ordinates))):
            raise ValueError("knots and ordinates must be finite")
        if np.any(np.diff(knots) <= 0.0):
            raise ValueError("knots must increase")
        if self.reading not in ("tangent", "secant") or self.abscissa not in ("curvature", "excess"):
            raise ValueError(f"unknown reading {self.reading!r} or abscissa {self.abscissa!r}")
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "ordinates", ordinates)
        splines = cardinal(tuple(knots.tolist()))
        object.__setattr__(self, "_cardinal", splines)
        object.__setattr__(self, "_primitive", ordinates @ splines.primitive)

    # Constructors -----------------------------------------------------------------------------------------------------

    @classmethod
    def from_ordinates(
        cls, knots: ArrayLike, ordinates: ArrayLike, *, reading: Reading = "tangent", abscissa: Abscissa = "curvature"
    ) -> Characteristic:
        """Spline through the control points ``(knots, ordinates)``, 1/m and N m^2, in the given reading."""
        return cls(np.asarray(knots, float), np.asarray(ordinates, float), reading, abscissa)

    @classmethod
    def constant(cls, bending_stiffness: float) -> Characteristic:
        """Linear cable: f = ``bending_stiffness`` (EI, N m^2) everywhere, both readings."""
        return cls(np.zeros(1), np.array([bending_stiffness], float))

    # The moment curve -------------------------------------------------------------------------------------------------

    @property
    def stiffness_scale(self) -> float:
        """Largest control point in absolute value, N m^2; used for scaling only."""
        return float(np.max(np.abs(self.ordinates)))

    def f(self, u: ArrayLike) -> Array:
        """The spline itself at the abscissa ``u`` (n,) 1/m, N m^2, in its own reading."""
        return evaluate(self._value, self._cardinal, np.asarray(u, float))

    @cached_property
    def _value(self) -> Array:
        """Coefficients of f."""
        return slope(self._primitive)

    def secant(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Secant reading m/(K - K0), N m^2, with its limit f(K0) at K = K0."""
        u, u0, D = self._arguments(K, K0)
        if self.reading == "secant":
            return self.f(u)
        # Mean of f over [u0, u]. Where the interval is short the difference of primitives loses digits, and Simpson's
        # rule is exact (f is a cubic there) but for a knot inside, whose share is of the order of interval^3.
        span = max(float(np.ptp(self.knots)), float(np.max(np.abs(u - u0), initial=0.0)))
        short = np.abs(D) <= 1e-4 * span
        simpson = (self.f(u0) + 4.0 * self.f(0.5 * (u + u0)) + self.f(u)) / 6.0
        return np.where(short, simpson, self.moment(K, K0) / np.where(short, 1.0, D))

    def bound(self, K0: Array) -> Callable[[Array], tuple[Array, Array]]:
        """`moment` and `tangent` as one function of K (n,) for fixed pre-curvature (n,) or (1,): Newton's inner call.

        One look-up of the segments, 12 microseconds for 100 points.
        """
        splines, excess, secant = self._cardinal, self.abscissa == "excess", self.reading == "secant"
        table, rest = self._primitive.copy(), evaluate(self._primitive, splines, np.zeros(1) if excess else K0)
        uniform = rest.size == 1
        if uniform:
            table[0] -= rest

        def moment_and_tangent(K: Array) -> tuple[Array, Array]:
            u = K - K0 if excess else K
            segment = splines.knots.searchsorted(u)
            t = u - splines.origin.take(segment)
            a, b, c, d, e = table.take(segment, axis=1)
            f = ((4.0 * e * t + 3.0 * d) * t + 2.0 * c) * t + b
            if secant:
                D = K - K0
                return f * D, f + ((12.0 * e * t + 6.0 * d) * t + 2.0 * c) * D
            rise = (((e * t + d) * t + c) * t + b) * t + a
            return rise if uniform else rise - rest, f

        return moment_and_tangent

    @property
    def parameters(self) -> int:
        """Number of control points."""
        return int(self.knots.size)

    def moment_by_parameters(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of the moment with respect to the control points, (n, p) in 1/m; exact, m is linear in them."""
        u, u0, D = self._arguments(K, K0)
        c = self._cardinal
        if self.reading == "secant":
            return np.moveaxis(evaluate(slope(c.primitive), c, u) * D, 0, -1)
        rest = u0 if u0.size == 1 else u0 + 0.0 * D
        both = evaluate(c.primitive, c, np.concatenate((rest.ravel(), u.ravel())))
        return np.asarray((both[:, rest.size :] - both[:, : rest.size]).T.reshape(*D.shape, -1))

    def moment_by_pre_curvature(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative dm/dK0, N m^2 (negative for positive stiffness)."""
        u, u0, D = self._arguments(K, K0)
        if self.abscissa == "excess":
            return -self.tangent(K, K0)
        return np.full_like(D, -self.f(u if self.reading == "secant" else u0))

    def _arguments(self, K: ArrayLike, K0: ArrayLike) -> tuple[Array, Array, Array]:
        """Abscissae of the state, (n,), and of rest, and the excess K - K0, (n,)."""
        K_, K0_ = np.asarray(K, float), np.asarray(K0, float)
        D = np.asarray(K_ - K0_)
        if self.abscissa == "excess":
            return D, np.zeros(()), D
        return K_ if K_.shape == D.shape else K_ + 0.0 * D, K0_, D

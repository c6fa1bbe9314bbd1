"""The bending stiffness characteristic f_EI: from control points to the moment curve m(K, K0).

A characteristic *is* its moment curve; tangent and secant are two readings of it, and every number called f_EI must say
which one it is:

    tangent  f = dm/dK            (Eqs. (5) and (14) of the paper)
    secant   f = m / (K - K0)     (fixed point of the iteration of Sec. 2.3)

They agree only for constant f or at K = K0. `Characteristic` is a natural cubic spline of f through control points
(knots), continued linearly outside, in either reading; whichever is chosen, `moment`, `tangent`, `secant` and `energy`
answer for the same object:

    m(K, K0) = int_{K0}^{K} f dk            tangent reading
    m(K, K0) = f(K) (K - K0)                secant reading
    energy   = int_{K0}^{K} m dk            energy per length; Eq. (5) without its superfluous factor 1/2

Signs and units: curvature ``K`` and pre-curvature ``K0`` in 1/m, positive in the direction of the bow; moment in N m
with the sign of ``K - K0`` (for positive stiffness); f in N m^2; energy in N (J/m).

Options: the abscissa of the spline is the curvature ``K`` itself (as in the paper) or the excess ``K - K0`` (a cable
that was set to another shape keeps its law); ``even`` makes f an even function of the abscissa, for bending both ways.

Source: *Identification of Nonlinear Elastic Bending Behavior for Cable Simulation*, Secs. 2.3, 4 and 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, Protocol, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rod.spline import Pieces, evaluate, pieces, slope

Array = NDArray[np.float64]
Reading = Literal["tangent", "secant"]
Abscissa = Literal["curvature", "excess"]


class MomentCurve(Protocol):
    """Anything that answers as a moment curve; `Characteristic` is the one built here.

    All methods are vectorised: ``K`` (n,) in 1/m, ``K0`` scalar or (n,) in 1/m.
    """

    @property
    def stiffness_scale(self) -> float:
        """Typical size of the stiffness, N m^2; used for scaling only."""

    def moment(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Bending moment m(K, K0), N m."""

    def tangent(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Tangent dm/dK, N m^2."""

    def bound(self, K0: Array) -> Callable[[Array], tuple[Array, Array]]:
        """Function of K alone that returns moment and tangent, for given K0 (n,) or (1,)."""

    def moment_by_pre_curvature(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative dm/dK0, N m^2."""

    def energy(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Energy per length int_{K0}^{K} m dk, N."""


class ParametricCurve(MomentCurve, Protocol):
    """A moment curve with numbers that a fit may move: control points, or coefficients."""

    @property
    def parameters(self) -> int:
        """How many."""

    def moment_by_parameters(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of the moment by them at fixed curvature, (n, p)."""


def parametric(law: MomentCurve) -> TypeGuard[ParametricCurve]:
    """Whether a law has numbers that a fit may move; to ask the Protocol itself takes as long as a Newton step."""
    return hasattr(law, "moment_by_parameters")


@dataclass(frozen=True, eq=False)
class Characteristic:
    """Natural cubic spline f through control points, and the moment curve that it means.

    Made by `from_ordinates`, `constant` or `from_table`.

    Attributes
    ----------
    knots : (p,) 1/m
        Increasing abscissae of the control points; with ``even`` not negative.
    ordinates : (p,) N m^2
    reading : {"tangent", "secant"}
        What f means.
    even : bool
        f is an even function of the abscissa: the spline runs through the mirrored control points too.
    abscissa : {"curvature", "excess"}
        f depends on K, or on K - K0.
    """

    knots: Array
    ordinates: Array
    reading: Reading = "tangent"
    even: bool = False
    abscissa: Abscissa = "curvature"
    _pieces: Pieces = field(init=False, repr=False)

    def __post_init__(self) -> None:
        knots, ordinates = np.atleast_1d(self.knots).astype(float), np.atleast_1d(self.ordinates).astype(float)
        if knots.ndim != 1 or knots.shape != ordinates.shape:
            raise ValueError(f"knots {knots.shape} and ordinates {ordinates.shape} must be one-dimensional and equal")
        if not (np.all(np.isfinite(knots)) and np.all(np.isfinite(ordinates))):
            raise ValueError("knots and ordinates must be finite")
        if np.any(np.diff(knots) <= 0.0):
            raise ValueError("knots must increase")
        if self.even and knots[0] < 0.0:
            raise ValueError("an even characteristic takes knots >= 0")
        if self.reading not in ("tangent", "secant") or self.abscissa not in ("curvature", "excess"):
            raise ValueError(f"unknown reading {self.reading!r} or abscissa {self.abscissa!r}")
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "ordinates", ordinates)
        object.__setattr__(self, "_pieces", pieces(knots, ordinates, self.even))

    # Constructors -----------------------------------------------------------------------------------------------------

    @classmethod
    def from_ordinates(
        cls,
        knots: ArrayLike,
        ordinates: ArrayLike,
        *,
        reading: Reading = "tangent",
        even: bool = False,
        abscissa: Abscissa = "curvature",
    ) -> Characteristic:
        """Spline through the control points ``(knots, ordinates)``, 1/m and N m^2, in the given reading."""
        return cls(np.asarray(knots, float), np.asarray(ordinates, float), reading, even, abscissa)

    @classmethod
    def constant(cls, bending_stiffness: float) -> Characteristic:
        """Linear cable: f = ``bending_stiffness`` (EI, N m^2) everywhere, both readings."""
        return cls(np.zeros(1), np.array([bending_stiffness], float))

    @classmethod
    def from_table(
        cls,
        kappa: ArrayLike,
        moment: ArrayLike,
        *,
        knots: ArrayLike | int = 5,
        pre_curvature: float | None = None,
        reading: Reading = "tangent",
        even: bool = False,
        abscissa: Abscissa = "curvature",
    ) -> Characteristic:
        """Least-squares spline through a table of curvature and moment, which may hold measured noise.

        Parameters
        ----------
        kappa : (n,) 1/m
        moment : (n,) N m
        knots : (p,) 1/m, or int
            Abscissae of the control points, or their number, equally spaced over the table; at most n.
        pre_curvature : 1/m or None
            Curvature of zero moment. The tangent reading over the curvature does without (the zero of the moment is
            fitted along); the secant reading and the abscissa ``excess`` need it.

        Raises
        ------
        ValueError
            For a table that does not determine the control points, or a missing ``pre_curvature``.
        """
        K, m = np.asarray(kappa, float).ravel(), np.asarray(moment, float).ravel()
        if K.shape != m.shape:
            raise ValueError(f"kappa {K.shape} and moment {m.shape} differ in length")
        free_zero = pre_curvature is None
        if free_zero and (reading == "secant" or abscissa == "excess"):
            raise ValueError("the secant reading and the abscissa 'excess' need pre_curvature")
        K0 = float(K[np.argmin(np.abs(m))]) if pre_curvature is None else float(pre_curvature)
        u = K - K0 if abscissa == "excess" else K
        u = np.abs(u) if even else u
        at = np.linspace(u.min(), u.max(), knots) if isinstance(knots, int) else np.asarray(knots, float)
        unit = cls(at, np.ones_like(at), reading, even, abscissa)
        columns = unit.moment_by_parameters(K, K0)
        scales = np.max(np.abs(columns), axis=0, initial=0.0)
        if free_zero:
            columns = np.column_stack([columns, np.full(K.size, scales.max(initial=0.0))])
        scales = np.max(np.abs(columns), axis=0, initial=0.0)
        if np.any(scales == 0.0) or np.linalg.matrix_rank(columns / scales) < columns.shape[1]:
            raise ValueError(f"a table of {K.size} rows does not determine {at.size} control points")
        solution = np.linalg.lstsq(columns / scales, m, rcond=None)[0] / scales
        return cls(at, solution[: at.size], reading, even, abscissa)

    # The moment curve -------------------------------------------------------------------------------------------------

    @property
    def stiffness_scale(self) -> float:
        """Largest control point in absolute value, N m^2; used for scaling only."""
        return float(np.max(np.abs(self.ordinates)))

    def f(self, u: ArrayLike) -> Array:
        """The spline itself at the abscissa ``u`` (n,) 1/m, N m^2, in its own reading."""
        return evaluate(self._pieces.f, self._pieces.cardinal, np.asarray(u, float))

    def moment(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Bending moment m(K, K0), N m, shape of ``K`` broadcast with ``K0``."""
        u, u0, D = self._arguments(K, K0)
        if self.reading == "secant":
            return np.asarray(self.f(u) * D)
        p = self._pieces
        return np.asarray(evaluate(p.F, p.cardinal, u) - evaluate(p.F, p.cardinal, u0))

    def tangent(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Tangent reading dm/dK, N m^2."""
        u, _, D = self._arguments(K, K0)
        if self.reading == "tangent":
            return self.f(u) + np.zeros_like(D)
        return np.asarray(self.f(u) + slope(self._pieces.f, self._pieces.cardinal, u) * D)

    def secant(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Secant reading m/(K - K0), N m^2, with its limit f(K0) at K = K0."""
        u, u0, D = self._arguments(K, K0)
        if self.reading == "secant":
            return self.f(u) + np.zeros_like(D)
        # Mean of f over [u0, u]. Where the interval is short the difference of primitives loses digits, and Simpson's
        # rule is exact (f is a cubic there) but for a knot inside, whose share is of the order of interval^3.
        span = max(float(np.ptp(self._pieces.cardinal.breaks)), float(np.max(np.abs(u - u0), initial=0.0)))
        short = np.abs(D) <= 1e-4 * span
        simpson = (self.f(u0) + 4.0 * self.f(0.5 * (u + u0)) + self.f(u)) / 6.0
        return np.where(short, simpson, self.moment(K, K0) / np.where(short, 1.0, D))

    def energy(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Energy per length int_{K0}^{K} m dk, N: Eq. (5) with the factor 1/2 taken out."""
        u, u0, D = self._arguments(K, K0)
        p = self._pieces
        rise = evaluate(p.G, p.cardinal, u) - evaluate(p.G, p.cardinal, u0)
        if self.reading == "secant":
            return np.asarray(evaluate(p.F, p.cardinal, u) * D - rise)
        return np.asarray(rise - evaluate(p.F, p.cardinal, u0) * D)

    def bound(self, K0: Array) -> Callable[[Array], tuple[Array, Array]]:
        """`moment` and `tangent` as one function of K (n,) for fixed pre-curvature (n,) or (1,): Newton's inner call.

        One look-up of the segments, 12 microseconds for 100 points.
        """
        p, excess, secant = self._pieces, self.abscissa == "excess", self.reading == "secant"
        table = np.vstack([p.f, p.F])
        rest = evaluate(p.F, p.cardinal, np.zeros(1) if excess else K0)
        uniform = rest.size == 1
        if uniform:
            table[4] -= rest

        def moment_and_tangent(K: Array) -> tuple[Array, Array]:
            u = K - K0 if excess else K
            segment = p.cardinal.breaks.searchsorted(u)
            t = u - p.cardinal.origin.take(segment)
            f0, f1, f2, f3, F0, F1, F2, F3, F4 = table.take(segment, axis=1)
            f = ((f3 * t + f2) * t + f1) * t + f0
            if secant:
                D = K - K0
                return f * D, f + ((3.0 * f3 * t + 2.0 * f2) * t + f1) * D
            rise = (((F4 * t + F3) * t + F2) * t + F1) * t + F0
            return rise if uniform else rise - rest, f

        return moment_and_tangent

    @property
    def parameters(self) -> int:
        """Number of control points."""
        return int(self.knots.size)

    def moment_by_parameters(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of the moment with respect to the control points, (n, p) in 1/m; exact, m is linear in them."""
        u, u0, D = self._arguments(K, K0)
        c = self._pieces.cardinal
        if self.reading == "secant":
            rise = evaluate(c.f, c, u + 0.0 * D) * D
        else:
            rise = evaluate(c.F, c, u + 0.0 * D) - _last(evaluate(c.F, c, u0), D)
        return np.moveaxis(rise, 0, -1)

    def tangent_by_ordinates(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of the tangent dm/dK with respect to the control points, (n, p), dimensionless."""
        u, _, D = self._arguments(K, K0)
        c = self._pieces.cardinal
        u = u + 0.0 * D
        value = evaluate(c.f, c, u)
        return np.moveaxis(value if self.reading == "tangent" else value + slope(c.f, c, u) * D, 0, -1)

    def moment_by_pre_curvature(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative dm/dK0, N m^2 (negative for positive stiffness)."""
        u, u0, D = self._arguments(K, K0)
        if self.abscissa == "excess":
            return -self.tangent(K, K0)
        return -self.f(u if self.reading == "secant" else u0) + np.zeros_like(D)

    def _arguments(self, K: ArrayLike, K0: ArrayLike) -> tuple[Array, Array, Array]:
        """Abscissae of the state and of rest, and the excess K - K0."""
        K_, K0_ = np.asarray(K, float), np.asarray(K0, float)
        D = np.asarray(K_ - K0_)
        if self.abscissa == "excess":
            return D, np.zeros(()), D
        return K_, K0_, D


def _last(values: Array, like: Array) -> Array:
    """Values (p, ...) with as many axes after the first as ``like`` has, so that they broadcast."""
    return values.reshape(values.shape[:1] + (1,) * (like.ndim - values.ndim + 1) + values.shape[1:])

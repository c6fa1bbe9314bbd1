"""Moment curves in closed form: cables whose truth is no spline, for tests, demonstrations and designs of experiments.

A law answers as `rod.characteristic.MomentCurve`: K and K0 in 1/m to moment in N m, tangent in N m^2, energy in N.

`as_law` makes one of whatever describes a cable: a number, a function or a table. `StickSlip` is the usual picture of a
cable whose wires stick to each other while hardly bent (stiffness EI0) and slip when bent more (EI1 < EI0):
f(K) = EI1 + (EI0 - EI1) / cosh^2((K - K0) / kc), tangent reading.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from rod.characteristic import Array, Characteristic, MomentCurve

Function = Callable[[Array], ArrayLike]


@dataclass(frozen=True)
class StickSlip:
    """m = EI1 D + (EI0 - EI1) kc tanh(D / kc) with D = K - K0.

    Attributes
    ----------
    EI0, EI1 : N m^2
        Stiffness at rest and far from it.
    kc : 1/m
        Curvature change over which the wires come to slip; positive.
    """

    EI0: float
    EI1: float
    kc: float

    def __post_init__(self) -> None:
        if not self.kc > 0.0:
            raise ValueError(f"kc must be positive, got {self.kc}")

    @property
    def stiffness_scale(self) -> float:
        """Larger of the two stiffnesses, N m^2."""
        return max(abs(self.EI0), abs(self.EI1))

    def moment(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Bending moment, N m."""
        D = np.asarray(K, float) - np.asarray(K0, float)
        return np.asarray(self.EI1 * D + (self.EI0 - self.EI1) * self.kc * np.tanh(D / self.kc))

    def tangent(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Tangent dm/dK, N m^2."""
        D = np.asarray(K, float) - np.asarray(K0, float)
        return np.asarray(self.EI1 + (self.EI0 - self.EI1) * (1.0 - np.tanh(D / self.kc) ** 2))

    def secant(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Secant m / (K - K0), N m^2, with its limit EI0 at rest."""
        D = np.asarray(K, float) - np.asarray(K0, float)
        rest = np.abs(D) < 1e-8 * self.kc  # tanh(x)/x = 1 - x^2/3: the limit is exact to the last digit there
        return np.where(rest, self.EI0, self.moment(K, K0) / np.where(rest, 1.0, D))

    def bound(self, K0: Array) -> Callable[[Array], tuple[Array, Array]]:
        """Function of K alone that returns moment and tangent."""
        slip = self.EI0 - self.EI1

        def moment_and_tangent(K: Array) -> tuple[Array, Array]:
            D = K - K0
            t = np.tanh(D / self.kc)
            return self.EI1 * D + (slip * self.kc) * t, self.EI1 + slip * (1.0 - t * t)

        return moment_and_tangent

    def moment_by_pre_curvature(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative dm/dK0 = -dm/dK, N m^2."""
        return -self.tangent(K, K0)

    def energy(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Energy per length, N."""
        D = np.asarray(K, float) - np.asarray(K0, float)
        u = np.abs(D) / self.kc
        log_cosh = u + np.log1p(np.exp(-2.0 * u)) - np.log(2.0)
        return np.asarray(0.5 * self.EI1 * D**2 + (self.EI0 - self.EI1) * self.kc**2 * log_cosh)


@dataclass(frozen=True, eq=False)
class MomentFunction:
    """A law by its moment as a function of the bend D = K - K0, with derivative and energy per length.

    Attributes
    ----------
    of_bend, slope, integral : functions of (n,) 1/m
        Moment, N m; dm/dD, N m^2; int_0^D m, N.
    stiffness_scale : N m^2
    """

    of_bend: Function
    slope: Function
    integral: Function
    stiffness_scale: float

    def moment(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Bending moment, N m."""
        return np.asarray(self.of_bend(np.asarray(K, float) - np.asarray(K0, float)), float)

    def tangent(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Tangent dm/dK, N m^2."""
        return np.asarray(self.slope(np.asarray(K, float) - np.asarray(K0, float)), float)

    def bound(self, K0: Array) -> Callable[[Array], tuple[Array, Array]]:
        """Function of K alone that returns moment and tangent."""
        return lambda K: (self.moment(K, K0), self.tangent(K, K0))

    def moment_by_pre_curvature(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative dm/dK0 = -dm/dK, N m^2."""
        return -self.tangent(K, K0)

    def energy(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Energy per length, N."""
        return np.asarray(self.integral(np.asarray(K, float) - np.asarray(K0, float)), float)


def as_law(given: MomentCurve | float | Function | ArrayLike, *, length: float) -> MomentCurve:
    """Law from a moment curve (as it is), a number, a function or a table.

    Parameters
    ----------
    given : MomentCurve, EI in N m^2, function from bend (n,) 1/m to moment (n,) N m, or (n, 2) bend and moment
        A table that begins at (0, 0) holds for bending both ways; between its rows the moment rises where they do, and
        beyond them it goes on straight.
    length : m
        Of the cable: what a bend is large or small against, where a function is differentiated.

    Raises
    ------
    ValueError
        If it is none of these, or a table whose bends do not increase.
    """
    if hasattr(given, "bound"):
        return given  # type: ignore[return-value]  # a Protocol cannot be asked for at run time without its cost
    if callable(given):
        return _from_function(given, 1e-4 / length)
    values = np.asarray(given, float)
    if values.ndim == 0:
        return Characteristic.constant(float(values))
    if values.ndim != 2 or values.shape[1] != 2 or values.shape[0] < 2 or not np.all(np.diff(values[:, 0]) > 0.0):
        raise ValueError(
            f"a law is a number (EI), a function of the bend, or rows of bend and moment with increasing bend; got an "
            f"array of shape {values.shape}: sort the rows, and give two columns"
        )
    return _from_table(values)


def _from_function(moment: Function, step: float) -> MomentFunction:
    nodes, weights = np.polynomial.legendre.leggauss(24)  # exact for polynomials of degree 47

    def slope(D: Array) -> Array:  # of fourth order: error below 1e-9 for a law that bends over a tenth of 1/length
        near, far = (np.asarray(moment(D + k * step)) - np.asarray(moment(D - k * step)) for k in (1.0, 2.0))
        return np.asarray((8.0 * near - far) / (12.0 * step))

    def integral(D: Array) -> Array:
        places = 0.5 * np.asarray(D)[..., None] * (nodes + 1.0)
        return np.asarray(0.5 * np.asarray(D) * (np.asarray(moment(places)) @ weights))

    return MomentFunction(moment, slope, integral, abs(float(slope(np.zeros(1))[0])))


def _from_table(rows: Array) -> MomentFunction:
    bend, m = rows.T
    if bend[0] == 0.0 == m[0]:
        bend, m = np.r_[-bend[:0:-1], bend], np.r_[-m[:0:-1], m]
    curve = PchipInterpolator(bend, m)
    slope, integral = curve.derivative(), curve.antiderivative()
    low, high = float(bend[0]), float(bend[-1])

    def beyond(D: Array) -> tuple[Array, Array]:
        inside = np.clip(D, low, high)
        return inside, D - inside

    def moment(D: Array) -> Array:
        inside, more = beyond(D)
        return np.asarray(curve(inside) + slope(inside) * more)

    def energy(D: Array) -> Array:
        inside, more = beyond(D)
        return np.asarray(integral(inside) - integral(0.0) + (curve(inside) + 0.5 * slope(inside) * more) * more)

    scale = float(np.max(np.abs(np.diff(m) / np.diff(bend))))
    return MomentFunction(moment, lambda D: slope(np.clip(D, low, high)), energy, scale)

"""Moment curves in closed form: cables whose truth is no spline, for tests, demonstrations and designs of experiments.

A law answers as `rod.characteristic.MomentCurve`: K and K0 in 1/m to moment in N m, tangent in N m^2.

`as_law` makes one of whatever describes a cable: a number, a function or a table. `StickSlip` is the usual picture of a
cable whose wires stick to each other while hardly bent (stiffness EI0) and slip when bent more (EI1 < EI0):
f(K) = EI1 + (EI0 - EI1) / cosh^2((K - K0) / kc), tangent reading.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from rod.array import Array
from rod.characteristic import Characteristic, MomentCurve
from rod.moment_curve import LawOfBend

Function = Callable[[Array], ArrayLike]

#: Largest bend of a law made of a function or a table, in turns of the cable, and the number of its control points.
FARTHEST, POINTS = 10.0, 600


@dataclass(frozen=True)
class StickSlip(LawOfBend):
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

    def at(self, bend: Array) -> tuple[Array, Array]:
        """Moment and tangent at bends (n,)."""
        slip, t = self.EI0 - self.EI1, np.tanh(bend / self.kc)
        return self.EI1 * bend + (slip * self.kc) * t, self.EI1 + slip * (1.0 - t * t)


def as_law(given: MomentCurve | float | Function | ArrayLike, *, length: float) -> MomentCurve:
    """Law from a moment curve (as it is), a number, a function or a table.

    Functions and tables become a spline of their secant m / D over bends D up to `FARTHEST` turns of the cable.

    Parameters
    ----------
    given : MomentCurve, EI in N m^2, function from bend (n,) 1/m to moment (n,) N m, or (n, 2) bend and moment
        A table that begins at (0, 0) holds for bending both ways; between its rows the moment rises where they do, and
        beyond them it goes on straight.
    length : m
        Of the cable: what a bend is large or small against.

    Raises
    ------
    ValueError
        If it is none of these, EI not positive, bends that do not increase, or a moment that does not vanish at rest.
    """
    if hasattr(given, "bound"):
        return cast(MomentCurve, given)  # a Protocol cannot be asked for at run time without its cost
    if not callable(given):
        try:
            values = np.asarray(given, float)
        except (TypeError, ValueError):
            values = np.zeros(0)
        if values.ndim == 0 and 0.0 < values < np.inf:
            return Characteristic.constant(float(values))
        rows = values.ndim == 2 and values.shape[1] == 2 and len(values) > 1 and bool(np.all(np.isfinite(values)))
        if not rows or not np.all(np.diff(values[:, 0]) > 0.0):
            raise ValueError(
                "a law is a positive number (EI, N m^2), a function of the bend, or rows of bend (1/m) and moment "
                f"(N m), sorted by bend; got {str(given)[:60]}"
            )
        given = _table(values)
    # finest about rest, where laws bend most; an even number of points, so that none is 0
    far = np.arcsinh(FARTHEST * 2.0 * np.pi / 0.5)
    bend = 0.5 / length * np.sinh(np.linspace(-far, far, POINTS))
    needed = "a law as a function takes an array of bends, as those of numpy do, and returns as many finite moments"
    try:
        moment = np.asarray(given(bend), float)
    except (TypeError, ValueError) as error:  # a function of `math`, or with an `if`, takes one bend
        raise ValueError(needed) from error
    if moment.shape != bend.shape or not np.all(np.isfinite(moment)):
        raise ValueError(needed)
    if moment[POINTS // 2 - 1] * moment[POINTS // 2] > 0.0:
        raise ValueError("the moment of a law must vanish at bend 0: measure the bend from the shape at rest")
    return Characteristic.from_ordinates(bend, moment / bend, reading="secant", abscissa="excess")


def _table(rows: Array) -> Function:
    """Monotone cubic through the rows, straight beyond them."""
    bend, m = rows.T
    if bend[0] == 0.0 == m[0]:
        bend, m = np.r_[-bend[:0:-1], bend], np.r_[-m[:0:-1], m]
    curve = PchipInterpolator(bend, m)

    def moment(D: Array) -> Array:
        inside = np.clip(D, bend[0], bend[-1])
        return np.asarray(curve(inside) + curve(inside, 1) * (D - inside))

    return moment

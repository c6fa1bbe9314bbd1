"""Exact bending tests for the tests of both ways: no solver of the project takes part.

Strategy: the equilibrium of a uniform cable between moment-free pins is a quadrature. With m = P y and K = K0 + D(m),
``P (cos theta - cos theta_end) = int_0^m K dm``, so ``ds = dtheta / K(theta)``; Gauss-Legendre in phi with
``theta = theta_end sin(phi)`` removes the root singularity of a straight cable (K0 = 0) at the ends.
Signs as in `rod.measurement`: the bow lies at y > 0 and K > 0 toward it, hence K = -dtheta/ds on the way to the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import solve_bvp
from scipy.interpolate import CubicHermiteSpline, make_interp_spline
from scipy.optimize import brentq, root
from scipy.special import ellipe, ellipk


@dataclass(frozen=True)
class StickSlip:
    """Law f = EI1 + (EI0 - EI1)/cosh^2(D/kc) with D = K - K0: wires stick at first, then slip. Not a spline."""

    EI0: float
    EI1: float
    kc: float
    K0: float

    def tangent(self, K):
        return self.EI1 + (self.EI0 - self.EI1) / np.cosh((K - self.K0) / self.kc) ** 2

    def moment(self, K):
        D = K - self.K0
        return self.EI1 * D + (self.EI0 - self.EI1) * self.kc * np.tanh(D / self.kc)

    def energy(self, K):
        D = K - self.K0
        return 0.5 * self.EI1 * D**2 + (self.EI0 - self.EI1) * self.kc**2 * np.log(np.cosh(D / self.kc))


@dataclass(frozen=True)
class Fading:
    """Law f = EI1 + (EI0 - EI1) exp(-D/kc), D = K - K0 >= 0: steepest at rest, so not even about K0. Not a spline."""

    EI0: float
    EI1: float
    kc: float
    K0: float

    def tangent(self, K):
        return self.EI1 + (self.EI0 - self.EI1) * np.exp(-(K - self.K0) / self.kc)

    def moment(self, K):
        D = K - self.K0
        return self.EI1 * D - (self.EI0 - self.EI1) * self.kc * np.expm1(-D / self.kc)

    def energy(self, K):
        D = K - self.K0
        return 0.5 * self.EI1 * D**2 + (self.EI0 - self.EI1) * self.kc * (D + self.kc * np.expm1(-D / self.kc))


@dataclass(frozen=True)
class SplineLaw:
    """A characteristic of the project with its K0, as a law: for laws that are splines, such as Table 1."""

    characteristic: object
    K0: float

    def tangent(self, K):
        return self.characteristic.tangent(K, self.K0)

    def moment(self, K):
        return self.characteristic.moment(K, self.K0)

    @cached_property
    def energy(self):
        """Of any K up to 100 1/m beyond K0, to 1e-12."""
        K = self.K0 + np.linspace(0, 100, 20001)
        return CubicHermiteSpline(K, self.moment(K), self.tangent(K)).antiderivative()


@dataclass(frozen=True)
class TrueShape:
    """Exact equilibrium at `chord`: arc length, position, tangent angle, curvature at n nodes, and the force."""

    force: float
    chord: float
    s: np.ndarray
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    kappa: np.ndarray

    def at(self, s):
        """x, y, theta, kappa at any s; quintic interpolation, error below 1e-12 of the length."""
        rows = np.stack([self.x, self.y, self.theta, self.kappa])
        return make_interp_spline(self.s, rows, k=5, axis=1)(s)


def excess(law, H):
    """Solve int_0^m K dm = H for D = K - K0 >= 0: Newton from a table in sqrt(H), where D(H) is smooth."""

    def integral(D):
        m = law.moment(law.K0 + D)
        return law.K0 * m + m * D - law.energy(law.K0 + D)

    top = 1.0
    while integral(top) < H.max():
        top *= 2
    grid = np.linspace(0, top, 400)
    D = np.interp(np.sqrt(np.maximum(H, 0)), np.sqrt(integral(grid)), grid)
    for _ in range(6):
        slope = (law.K0 + D) * law.tangent(law.K0 + D)
        D = np.where(H > 0, np.maximum(D - (integral(D) - H) / np.where(slope > 0, slope, 1), 0), 0)
    return D


def equilibrium(law, length, chord, *, panels=160):
    """Exact shape of a uniform cable with K0 >= 0 pushed to `chord`, natural bow."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    edges = np.linspace(0, np.pi / 2, panels + 1)
    phi = edges[:-1, None] + np.diff(edges)[:, None] * (nodes + 1) / 2
    w = np.diff(edges)[:, None] * weights / 2

    def halves(P, theta_end):
        theta = theta_end * np.sin(phi)
        K = law.K0 + excess(law, P * (np.cos(theta) - np.cos(theta_end)))
        return theta, w * theta_end * np.cos(phi) / K

    def short(log_P, theta_end):
        return halves(np.exp(log_P), theta_end)[1].sum() - length / 2

    angle = brentq(lambda t: np.sin(t) / t - chord / length, 1e-3, 3.0)
    guess = np.log(np.pi**2 * law.tangent(law.K0) / length**2)
    start = brentq(short, guess - 7, guess + 0.7, args=(angle,))  # no pinned cable carries twice its buckling load

    def gap(unknown):
        theta, ds = halves(np.exp(unknown[0]), unknown[1])
        return [ds.sum() / length - 0.5, (np.cos(theta) * ds).sum() / length - 0.5 * chord / length]

    found = root(gap, [start, angle], tol=1e-13)
    assert np.abs(found.fun).max() < 1e-11, "no equilibrium"
    P, theta_end = np.exp(found.x[0]), found.x[1]
    theta, ds = halves(P, theta_end)
    ends = theta_end * np.sin(edges)
    K = law.K0 + excess(law, P * (np.cos(ends) - np.cos(theta_end)))
    s, x, y = (np.concatenate([[0], np.cumsum((g * ds).sum(axis=1))]) for g in (1, np.cos(theta), -np.sin(theta)))
    both = [np.concatenate([-v[:0:-1], v]) for v in (s, x)]
    y = np.concatenate([y[:0:-1], y]) - y[-1]
    return TrueShape(
        P,
        chord,
        both[0] + s[-1],
        both[1] + x[-1],
        y,
        -np.concatenate([-ends[:0:-1], ends]),
        np.concatenate([K[:0:-1], K]),
    )


def force_free(law, length):
    """The cable at rest: an arc of curvature K0."""
    s = np.linspace(0, length, 321)
    K0, theta = law.K0, law.K0 * (length / 2 - s)
    end = K0 * length / 2
    x = (np.sin(end) - np.sin(theta)) / K0
    return TrueShape(0.0, 2 * np.sin(end) / K0, s, x, (np.cos(theta) - np.cos(end)) / K0, theta, np.full_like(s, K0))


def bent_by_bvp(law, length, chord, *, bow):
    """Shape of a cable whose pre-curvature is K0 + bow(s), by solve_bvp; `chord` None leaves it free of force.

    Unknowns x, y, theta along s and the force: x' = cos theta, y' = sin theta, theta' = -K with m(K - bow) = P y.
    """
    s = np.linspace(0, length, 401)
    start = equilibrium(law, length, 0.97 * length if chord is None else chord)
    guess = np.stack(start.at(s)[:3])
    table = np.linspace(0, 3 * np.abs(start.kappa).max() + 20, 4000)
    D = np.concatenate([-table[:0:-1], table])
    moments = law.moment(law.K0 + D)

    def slopes(s, state, unknown):
        P = 0.0 if chord is None else unknown[0]
        K = law.K0 + bow(s) + np.interp(P * state[1], moments, D)
        return np.stack([np.cos(state[2]), np.sin(state[2]), -K])

    def ends(left, right, unknown):
        return [left[0], left[1], right[1], unknown[0] if chord is None else right[0] - chord]

    found = solve_bvp(slopes, ends, s, guess, p=[start.force], tol=1e-8, max_nodes=20000)
    assert found.success, found.message
    P = 0.0 if chord is None else float(found.p[0])
    x, y, theta = found.sol(s)
    K = law.K0 + bow(s) + np.interp(P * y, moments, D)
    return TrueShape(P, float(x[-1]), s, x, y, theta, K)


def pinned_linear(EI: float, length: float, chord: float) -> float:
    """Force of the straight pinned rod of constant stiffness after buckling, N (Euler's elastica).

    chord/L = 2 E(k)/K(k) - 1 and P = EI (2 K(k)/L)^2, complete elliptic integrals of modulus k = sin(theta_end/2).

    Parameters
    ----------
    EI : N m^2
    length : m
    chord : m
        Between -length (never reached) and length.

    Raises
    ------
    ValueError
        If the chord is not shorter than the length or not above -length.
    """
    ratio = chord / length
    if not -1.0 < ratio < 1.0:
        raise ValueError(f"chord {chord} m must lie within (-length, length), length {length} m")
    m = brentq(lambda k2: 2.0 * ellipe(k2) / ellipk(k2) - 1.0 - ratio, 0.0, 1.0 - 1e-16, xtol=1e-16, rtol=1e-15)
    return float(EI * (2.0 * ellipk(m) / length) ** 2)

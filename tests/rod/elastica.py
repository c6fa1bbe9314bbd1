"""Exact answers: a uniform rod on two moment-free bearings, from law, length and chord to shape and force.

No grid and no iteration over shapes; the reference that the discrete rod is held against, and truth for test data.

For a uniform cable with moment-free ends the equilibrium of **any** moment curve is a quadrature. From m = P y and
K = -dtheta/ds follows dm = P sin(theta) ds, and with the complementary energy W(K) = int_0^m K dm = K m - V(K),
V the energy per length of the law,

    P (cos theta - cos theta_end) = W(K),    ds = m'(K) dK / (P sin theta),    y = m / P.

Symmetric shapes only: one bow, K between K0 at the bearings and K_mid in the middle. Two unknowns, the end slope
theta_end and K_mid, follow from length and chord; P = W(K_mid) / (1 - cos theta_end). With
K = K0 + (K_mid - K0) sin(phi) every integrand is smooth; panels of Gauss points resolve the knots of a spline.

It ends where K0(s), EI(s), friction, springs or loads begin: there `rod.equilibrium` works.

Signs and units: chord frame (origin left bearing, x to the right one, y toward the bow), m, rad, 1/m, N;
theta from x toward y (positive at the left bearing), K = -dtheta/ds positive in the direction of the bow, P positive in
compression.

Source: Eqs. (13) and (14) of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq, root

from rod.array import Array
from rod.characteristic import MomentCurve


class _Rule(NamedTuple):
    """Panels of Gauss points over phi = 0..pi/2: panel edges, points and weights."""

    edges: Array
    phi: Array
    weight: Array


def _rule(panels: int, gauss: int) -> _Rule:
    nodes, weights = np.polynomial.legendre.leggauss(gauss)
    edges = np.linspace(0.0, 0.5 * np.pi, panels + 1)
    width = np.diff(edges)[:, None]
    return _Rule(edges, (edges[:-1, None] + 0.5 * (nodes + 1.0) * width).ravel(), (0.5 * weights * width).ravel())


#: For the two unknowns; and for the shape, whose Hermite splines between panel edges need short panels (error 1e-9).
_SOLVING, _SAMPLING, _GAUSS = _rule(48, 8), _rule(240, 4), 4


@dataclass(frozen=True, eq=False)
class UniformEquilibrium:
    """Shape and force of a uniform pinned cable; arrays (n,) in the chord frame.

    Attributes
    ----------
    s, x, y : (n,) m
    theta : (n,) rad
    kappa : (n,) 1/m
    moment : (n,) N m
    force : N
        P, positive in compression.
    chord : m
    """

    s: Array
    x: Array
    y: Array
    theta: Array
    kappa: Array
    moment: Array
    force: float
    chord: float


def natural_chord(length: float, pre_curvature: float) -> float:
    """Chord (2/K0) sin(K0 L/2) of the force-free cable of constant pre-curvature, m."""
    return float(length * np.sinc(0.5 * pre_curvature * length / np.pi))


def pure_bending(pre_curvature: float, *, length: float, points: int | ArrayLike = 101) -> UniformEquilibrium:
    """The force-free cable: an arc of curvature K0 in its chord frame; ``points`` as in `uniform_equilibrium`."""
    s = _arc_lengths(points, length)
    # Chord of an arc of length s turning by K0 s, from its middle direction: no division by a vanishing K0.
    half = 0.5 * pre_curvature * s
    secant, direction = s * np.sinc(half / np.pi), 0.5 * pre_curvature * length - half
    return UniformEquilibrium(
        s,
        secant * np.cos(direction),
        secant * np.sin(direction),
        0.5 * pre_curvature * length - 2.0 * half,
        np.full_like(s, pre_curvature),
        np.zeros_like(s),
        0.0,
        natural_chord(length, pre_curvature),
    )


def uniform_equilibrium(
    law: MomentCurve,
    *,
    length: float,
    chord: float,
    pre_curvature: float = 0.0,
    points: int | ArrayLike = 101,
) -> UniformEquilibrium:
    """Equilibrium of a uniform cable between moment-free bearings, bowed toward +y, by quadrature.

    Parameters
    ----------
    law : MomentCurve
        Any invertible moment curve with ``moment`` and ``tangent``.
    length, chord : m
        Chord between 0 and the length; longer than the natural chord means tension.
    pre_curvature : 1/m
        Constant K0. Negative values ask for the branch bowed against it, where it exists.
    points : int or (n,) m
        Number of points at equal arc length, or the arc lengths.

    Returns
    -------
    UniformEquilibrium
        Relative error about 1e-9 for smooth laws and for splines.

    Raises
    ------
    ValueError
        If chord and length do not admit such a shape.
    """
    if not (length > 0.0 and 0.0 <= chord < length):
        raise ValueError(f"chord {chord} m must lie within [0, length), length {length} m")
    s = _arc_lengths(points, length)
    if pre_curvature > 0.0 and abs(chord - natural_chord(length, pre_curvature)) < 1e-11 * length:
        return pure_bending(pre_curvature, length=length, points=s)  # P = 0: the quadrature would be 0/0
    end_slope, K_mid = _solve(law, length=length, chord=chord, K0=pre_curvature)
    return _sampled(law, s, end_slope=end_slope, K_mid=K_mid, K0=pre_curvature, length=length)


def _arc_lengths(points: int | ArrayLike, length: float) -> Array:
    s = np.linspace(0.0, length, points) if isinstance(points, int) else np.asarray(points, float)
    if np.any((s < 0.0) | (s > length * (1.0 + 1e-12))):
        raise ValueError("points must lie between 0 and length")
    return s


class _Half(NamedTuple):
    """Left half at the Gauss points: arc length per phi, slope, and the force."""

    rate: Array
    cos: Array
    P: float


def _half(law: MomentCurve, phi: Array, *, end_slope: float, K_mid: float, K0: float) -> _Half:
    """Integrand ds/dphi and cos(theta) at ``phi`` for given end slope and mid-span curvature."""
    rise = K_mid - K0
    K = K0 + rise * np.sin(phi)
    grid = np.linspace(0.0, 1.0, 1601)
    at = K0 + rise * grid
    energy = CubicHermiteSpline(grid, rise * law.moment(at, K0), rise**2 * law.tangent(at, K0)).antiderivative()
    W = K * law.moment(K, K0) - energy(np.sin(phi))
    W_mid = float(K_mid * law.moment(K_mid, K0) - energy(1.0))
    depth = 1.0 - np.cos(end_slope)
    versine = depth * np.maximum(1.0 - W / W_mid, 0.0)  # 1 - cos theta
    sine = np.sqrt(np.maximum(versine * (2.0 - versine), np.finfo(float).tiny))
    rate = law.tangent(K, K0) * rise * np.cos(phi) * (depth / W_mid) / sine
    return _Half(rate, 1.0 - versine, W_mid / depth)


def _solve(law: MomentCurve, *, length: float, chord: float, K0: float) -> tuple[float, float]:
    """End slope and mid-span curvature, from a circular arc; through shorter steps of the chord if that fails."""

    def misfit(unknown: Array, target: float) -> Array:
        half = _half(law, _SOLVING.phi, end_slope=unknown[0], K_mid=K0 + unknown[1] / length, K0=K0)
        ds = half.rate * _SOLVING.weight
        return np.array([2.0 * ds.sum() / length - 1.0, 2.0 * (half.cos @ ds) / length - target])

    def attempt(start: Array, target: float) -> Array | None:
        with np.errstate(all="ignore"):  # a trial step may leave the range where the shape exists
            found = root(misfit, start, args=(target,), method="hybr", tol=1e-13)
            solution = np.asarray(found.x)
            good = np.max(np.abs(misfit(solution, target))) < 1e-10
        bowed = 0.0 < solution[0] < np.pi and K0 * length + solution[1] > 0.0
        return solution if good and bowed else None

    goal = chord / length
    solution = attempt(_arc_guess(goal, K0 * length), goal)
    if solution is None:
        easy = 0.75 if K0 <= 0.0 else natural_chord(length, K0) / length - 0.02
        solution = attempt(_arc_guess(easy, K0 * length), easy)
        for target in np.linspace(easy, goal, 25)[1:]:
            solution = None if solution is None else attempt(solution, float(target))
    if solution is None:
        raise ValueError(f"no bowed equilibrium found for chord {chord} m, length {length} m, pre-curvature {K0} 1/m")
    return float(solution[0]), K0 + float(solution[1]) / length


def _arc_guess(ratio: float, turn: float) -> Array:
    """End slope of the arc with that chord/L, and (K_mid - K0) L if the excess curvature is a half sine."""
    end_slope = brentq(lambda a: np.sinc(a / np.pi) - ratio, 1e-9, 4.0) if ratio < 1.0 - 1e-15 else 1e-6
    rise = (2.0 * end_slope - turn) * 0.5 * np.pi
    return np.array([end_slope, rise if abs(rise) > 1e-9 else 1e-9])


def _sampled(
    law: MomentCurve, s: Array, *, end_slope: float, K_mid: float, K0: float, length: float
) -> UniformEquilibrium:
    """Shape at the arc lengths ``s``: panel sums give s and x at the panel edges, Hermite splines what lies between."""
    ends = _half(law, _SAMPLING.edges[:-1], end_slope=end_slope, K_mid=K_mid, K0=K0)
    inner = _half(law, _SAMPLING.phi, end_slope=end_slope, K_mid=K_mid, K0=K0)
    ds = inner.rate * _SAMPLING.weight
    s_edge = np.r_[0.0, ds.reshape(-1, _GAUSS).sum(axis=1).cumsum()]
    x_edge = np.r_[0.0, (ds * inner.cos).reshape(-1, _GAUSS).sum(axis=1).cumsum()]
    # At mid-span ds/dphi is the limit of 0/0; there cos(phi) = 0 and 1 - W/W_mid ~ K m' rise cos(phi)^2 / (2 W_mid).
    mid_rate = np.sqrt(max(float(law.tangent(K_mid, K0)) * (K_mid - K0) / (K_mid * ends.P), 0.0))
    phi_of_s = CubicHermiteSpline(s_edge, _SAMPLING.edges, 1.0 / np.r_[ends.rate, mid_rate])
    x_of_s = CubicHermiteSpline(s_edge, x_edge, np.r_[ends.cos, 1.0])
    left = s <= 0.5 * length
    mirrored = np.clip(np.where(left, s, length - s) * (2.0 * s_edge[-1] / length), 0.0, s_edge[-1])
    phi, chord = phi_of_s(mirrored), 2.0 * float(x_edge[-1])
    K = K0 + (K_mid - K0) * np.sin(phi)
    m = law.moment(K, K0)
    slope = np.arccos(np.clip(_half(law, phi, end_slope=end_slope, K_mid=K_mid, K0=K0).cos, -1.0, 1.0))
    x = np.where(left, x_of_s(mirrored), chord - x_of_s(mirrored))
    theta = np.where(left, slope, -slope)
    return UniformEquilibrium(s, x, m / ends.P, theta, K, m, float(ends.P), chord)

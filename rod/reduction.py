"""The translations eliminated exactly: from Eq. (4) in (r, alpha) to angles and two reaction components.

Under dead loads the force in every edge is known up to the reaction R = (R_x, R_y) of the right support on the cable,
f_j = R + load beyond edge j, and the strains follow: Gamma = (1, 0) + C^-1 rot(alpha)^T f. What is left of Eq. (4) is

    Lambda(alpha, R) = sum_i w_i V(K_i) - sum_j h_j [f.t + (f.t)^2/(2 EA) + (f.n)^2/(2 GA)] + R.(right axis)

with t = (cos alpha, sin alpha) and n = (-sin alpha, cos alpha); stationary in the angles (moment balance) and in R (the
chain ends at the right axis). Its Hessian is tridiagonal in alpha, bordered by R, and well conditioned for any EA:

    [ H    B ]   H_ii = sum of dm/dK / w + h (f.t + ...),  B = d(gradient)/dR,
    [ B^T -S ]   S = sum h rot C^-1 rot^T (+ slope of what the rig yields).

A state is a minimum of Eq. (4) under the imposed positions exactly if this matrix has as many negative eigenvalues as
there are imposed position components (Haynsworth; the positions r alone are always a minimum).
H alone is singular in the force-free state (the rod turns as a whole), so it is factorised with a stiff spring on its
middle edge, which a third border column takes out again.

Signs and units as in `rod.discretisation`; P = -R_x is the force along the chord, positive in compression.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import idamax
from scipy.linalg.lapack import dgesv, dgtsv, dptsv, dstebz, dsyev

from rod.array import Array
from rod.discretisation import Rod
from rod.section import Memory
from rod.support import Support


@dataclass(frozen=True)
class Hold:
    """What is imposed at the right end.

    Attributes
    ----------
    chord : m or None
        Position of the right axis on the x axis; with compliance, the position commanded.
    force : N or None
        Instead of the chord: P, compression positive; the right axis slides on the x axis.
    tip : (2,) N or None
        Instead of both: dead force on a free end (cantilever).
    compliance, stiffening : m/N, 1/N
        Of the rig: the chord reaching the cable is chord + compliance P / (1 + stiffening |P|).
    from_zero : bool
        The chord was commanded as a displacement from the zero position, so it moves when that does.
    """

    chord: float | None = None
    force: float | None = None
    tip: tuple[float, float] | None = None
    compliance: float = 0.0
    stiffening: float = 0.0
    from_zero: bool = False

    def __post_init__(self) -> None:
        given = [value for value in (self.chord, self.force, self.tip) if value is not None]
        if len(given) != 1:
            raise ValueError("exactly one of chord, force and tip must be given")
        if np.shape(given[0]) != (() if self.tip is None else (2,)) or not np.all(np.isfinite(given[0])):
            raise ValueError(f"chord and force are finite numbers, tip is two of them; got {given[0]}")
        if not (self.compliance >= 0.0 and self.stiffening >= 0.0):
            raise ValueError(
                f"compliance and stiffening must not be negative, got {self.compliance} and {self.stiffening}"
            )

    @property
    def imposed(self) -> tuple[bool, bool]:
        """Whether the x and the y position of the right axis are imposed."""
        return self.chord is not None, self.tip is None

    def yielded(self, along: float) -> tuple[float, float, float, float]:
        """What the rig yields under a reaction along the chord, m; its slope by that, compliance and stiffening."""
        softer = 1.0 + self.stiffening * abs(along)
        slope = self.compliance / softer**2
        return self.compliance * along / softer, slope, along / softer, -slope * along * abs(along)

    def reaction(self, R: Array) -> Array:
        """The reaction R (2,) N with the components that are prescribed by force put in."""
        if self.force is not None:
            return np.array([-self.force, R[1]])
        return R if self.tip is None else np.asarray(self.tip, float)


class EdgeState(NamedTuple):
    """Direction of every edge, its sine and cosine (2, n + 2), and the force along and across it (2, n + 2), N."""

    direction: Array
    force: Array


class Balance(NamedTuple):
    """Residuals and Hessian of Lambda at one state; see the module for the symbols.

    ``gradient`` (n + 2,) N m; ``diagonal`` (n + 2,) and ``off`` (n + 1,) N m/rad; ``border`` (2, n + 2) m; ``softness``
    (2, 2) m/N with the rig's; ``gap`` (2,) m: imposed minus actual position, 0 if not imposed; ``K``, ``m``,
    ``tangent`` (n + 1,); ``edge`` directions and forces of the edges.
    """

    gradient: Array
    diagonal: Array
    off: Array
    border: Array
    softness: Array
    gap: Array
    K: Array
    m: Array
    tangent: Array
    edge: EdgeState


class Eliminated(NamedTuple):
    """The bordered system with the angles eliminated: the stiffened H has solved border and right-hand sides.

    ``solved`` (n + 2, k + 1 + p); ``schur`` (k + 1, k + 1), scaled, and ``low`` (k + 1, p) for the k imposed components
    and the spring; ``definite``: whether the stiffened H is positive definite.
    """

    balance: Balance
    solved: Array
    schur: Array
    low: Array
    definite: bool


class System:
    """Residuals and Newton steps of one rod, hold and memory; built once per equilibrium, immutable afterwards."""

    def __init__(self, rod: Rod, hold: Hold, memory: Memory) -> None:
        self.rod, self.hold, self.memory = rod, hold, memory
        self.moment_scale = rod.stiffness_scale / rod.length
        self.force_scale = rod.stiffness_scale / rod.length**2
        self._response = rod.section.response(memory)
        self._inverse_weights, self._load_beyond = rod.inverse_weights, rod.load_beyond
        self._edges, self._signed_edges = rod.edges, rod.signed_edges
        self._axial, self._shear = rod.flexibility
        self._difference = self._axial - self._shear
        self._even_softness = np.array(((self._axial * rod.length, 0.0), (0.0, self._axial * rod.length)))
        self._middle, self._spring = rod.edges.size // 2, self.moment_scale
        self._imposed = slice(hold.imposed.count(False), 2)  # x and y, y, or none
        units = [self.force_scale / rod.length] * hold.imposed.count(True) + [1.0 / self.moment_scale]
        self._scale = np.sqrt(units)[:, None]
        self._scales = self._scale * self._scale.T

    def __reduce__(self) -> tuple[type[System], tuple[Rod, Hold, Memory]]:
        """Made again in another process: functions do not travel."""
        return System, (self.rod, self.hold, self.memory)

    @cached_property
    def mass(self) -> Array:
        """Weight of every angle (n + 2,) in sums of squares of turns: its share of the length.

        A bearing without a rigid piece turns with half an element: without a weight it could not be held.
        """
        share = np.array(self.rod.edges)
        share[[0, -1]] = np.maximum(share[[0, -1]], self.rod.weights[[0, -1]])
        return np.asarray(share / self.rod.length)

    def under(self, share: float) -> System:
        """The same system with a share of its dead load."""
        if self._load_beyond is None or share == 1.0:
            return self
        other = copy(self)
        other._load_beyond = share * self._load_beyond
        return other

    def misfit(self, balance: Balance) -> float:
        """Largest residual, relative to EI/L and L."""
        g, (gap_x, gap_y) = balance.gradient, balance.gap.tolist()
        moment = abs(g[idamax(g)]) / self.moment_scale
        return float(max(moment, abs(gap_x) / self.rod.length, abs(gap_y) / self.rod.length))

    def section(self, K: Array) -> tuple[Array, Array]:
        """Moment and tangent (n,) of the cross-section at curvatures (n,), with the memory at the start of the step."""
        return self._response(K)

    def edge_state(self, angles: Array, R: Array) -> EdgeState:
        """Directions and forces of the edges at ``angles`` (n + 2,) and reaction ``R`` (2,) N."""
        direction = np.empty((2, angles.size))
        sin, cos = np.sin(angles, out=direction[0]), np.cos(angles, out=direction[1])
        if self._load_beyond is None:
            fx, fy = R.tolist()
            return EdgeState(direction, np.asarray(np.array(((fy, fx), (-fx, fy))) @ direction))
        fx, fy = R[:, None] + self._load_beyond
        return EdgeState(direction, np.array((fx * cos + fy * sin, fy * cos - fx * sin)))

    def balance(self, angles: Array, R: Array) -> Balance:
        """Residuals and Hessian at ``angles`` (n + 2,) and reaction ``R`` (2,)."""
        K = (angles[:-1] - angles[1:]) * self._inverse_weights
        m, tangent = self._response(K)
        edge = self.edge_state(angles, R)
        diagonal, gradient = self._signed_edges * self.turning(edge)
        gradient[:-1] += m
        gradient[1:] -= m
        stiffness = tangent * self._inverse_weights
        diagonal[:-1] += stiffness
        diagonal[1:] += stiffness
        off, border = -stiffness, self.border(edge)
        gap = self._gap(edge, R)
        self._hold_ends(angles, gradient, diagonal, off, border)
        return Balance(gradient, diagonal, off, border, self._softness(edge, R), gap, K, m, tangent, edge)

    def _gap(self, edge: EdgeState, R: Array) -> Array:
        """Imposed minus actual position of the right axis, (2,) m; 0 where it is not imposed."""
        if self._difference != 0.0:
            x, y = (self.directions(edge) @ self.rod.edges).tolist()
        else:  # with EA = GA strains do not depend on the direction, and sums do
            force = self.rod.length * R
            if self._load_beyond is not None:
                force += self._load_beyond @ self.rod.edges
            (along, across), (rise, run) = (self._axial * force).tolist(), (edge.direction @ self._edges).tolist()
            x, y = along + run, across + rise
        hold = self.hold
        lacking = 0.0 if hold.chord is None else hold.chord - hold.yielded(float(R[0]))[0] - x
        return np.array((lacking, -y if hold.tip is None else 0.0))

    def directions(self, edge: EdgeState) -> Array:
        """Derivative of position by arc length on every edge, (2, n + 2): tangent, stretch and shear."""
        (sin, cos), (along, across) = edge
        stretch, shear = 1.0 + along * self._axial, across * self._shear
        return np.array((stretch * cos - shear * sin, stretch * sin + shear * cos))

    def turning(self, edge: EdgeState) -> Array:
        """What the edge forces do to the angles, per length: restoring stiffness and moment, (2, n + 2) N."""
        if self._difference == 0.0:
            return edge.force
        along, across = edge.force
        stiffness = along + (along**2 - across**2) * self._difference
        return np.array((stiffness, across * (1.0 + along * self._difference)))

    def border(self, edge: EdgeState) -> Array:
        """Derivative of the gradient by R, (2, n + 2) m; minus that of the extent of the edges by the angles."""
        border = self._signed_edges * edge.direction
        if self._difference != 0.0:
            along, across = edge.force
            border *= 1.0 + along * self._difference
            border -= self.rod.edges * edge.direction[::-1] * (across * self._difference)
        return np.asarray(border)

    def softened(self, edge: EdgeState, force: Array) -> Array:
        """Extent of every edge, (2, q, n + 2) m, for a small force (2, q, n + 2) or (2, q, 1) N: h rot C^-1 rot^T."""
        h, (sin, cos) = self.rod.edges, edge.direction
        if self._difference == 0.0:
            return np.asarray((self._axial * h) * force)
        along, across = self._axial * (cos * force[0] + sin * force[1]), self._shear * (cos * force[1] - sin * force[0])
        return np.array((h * (cos * along - sin * across), h * (sin * along + cos * across)))

    def _softness(self, edge: EdgeState, R: Array) -> Array:
        if self._difference == 0.0:
            cable = self._even_softness
        else:
            cable = np.asarray(self.softened(edge, np.eye(2)[:, :, None]).sum(axis=2))
        return cable + np.diag((self.hold.yielded(float(R[0]))[1], 0.0)) if self.hold.compliance else cable

    def _hold_ends(self, angles: Array, gradient: Array, diagonal: Array, off: Array, border: Array) -> None:
        """Supports: springs, friction and moments on the end angles; a clamped angle keeps its value."""
        for end, support, rest_angle, slip, sign in self._ends:
            if support.kind == "clamp":
                gradient[end] = self.moment_scale * (angles[end] - rest_angle)
                diagonal[end], off[end], border[:, end] = self.moment_scale, 0.0, 0.0
            else:
                moment, slope = support.moment_at(float(angles[end]), rest_angle, slip)
                gradient[end] += moment + sign * support.moment
                diagonal[end] += slope

    @cached_property
    def _ends(self) -> list[tuple[int, Support, float, float, float]]:
        """Ends where a clamp, a spring, friction or a moment acts: place, support, its angles, sign of its moment."""
        rod, memory, rest = self.rod, self.memory, self.rod.rest_angles
        ends = (0, rod.left, rest[0], memory.left_angle, -1.0), (-1, rod.right, rest[1], memory.right_angle, 1.0)
        return [e for e in ends if e[1].kind == "clamp" or e[1].moment or not e[1].turns_freely]

    def clamps_turning(self, here: Balance, residual: Array) -> tuple[Array, Array]:
        """Change of gradient (n + 2,) and gap (2,) while clamps turn by what they lack in ``residual`` (n + 2,) N m.

        The Hessian of ``here`` holds them at rest.
        """
        gradient, gap = np.zeros_like(residual), np.zeros(2)
        for end, support, *_ in self._ends:
            if support.kind == "clamp" and (turn := -residual[end] / self.moment_scale):
                near, joint = (1, 0) if end == 0 else (-2, -1)
                gradient[near] -= here.tangent[joint] * self._inverse_weights[joint] * turn
                gap += self.border(here.edge)[:, end] * turn
        return gradient, gap

    def solve(self, balance: Balance, rhs: Array, gap: Array) -> tuple[Array, Array]:
        """Solve the bordered system for several right-hand sides.

        Parameters
        ----------
        balance : Balance
        rhs : (n + 2, p) N m
        gap : (2, p) m
            [H B; B^T -S] [dalpha; dR] = [rhs; gap]; rows of position components that are not imposed are dropped.

        Returns
        -------
        dalpha : (n + 2, p) rad, dR : (2, p) N
            Not a number if the matrix is singular.
        """
        return self.solution(self.eliminated(balance, rhs, gap))

    def solution(self, eliminated: Eliminated) -> tuple[Array, Array]:
        """What `solve` returns, from the eliminated system."""
        _, solved, schur, low, _ = eliminated
        k = len(schur) - 1
        _, _, multipliers, info = dgesv(schur, self._scale * low)
        multipliers = self._scale * multipliers if info == 0 else np.full_like(low, np.nan)
        dR = np.zeros((2, low.shape[1]))
        dR[self._imposed] = multipliers[:k]
        return (solved.T[k + 1 :] - multipliers.T @ solved.T[: k + 1]).T, dR

    def excess_negatives(self, balance: Balance) -> int:
        """Negative eigenvalues of the Hessian of Eq. (4) under the imposed positions: 0 proves a minimum."""
        return self.negatives(self.eliminated(balance, np.empty((balance.gradient.size, 0)), np.empty((2, 0))))

    def negatives(self, eliminated: Eliminated) -> int:
        """What `excess_negatives` returns, from the eliminated system."""
        balance, schur = eliminated.balance, eliminated.schur
        if not np.isfinite(schur).all():
            return 1
        below = int(np.count_nonzero(dsyev(schur, compute_v=0)[0] < 0.0))
        above = 0 if eliminated.definite else negative_pivots(self._stiffened(balance), balance.off)
        return above + below + 1 - len(schur)

    def _stiffened(self, balance: Balance) -> Array:
        """Diagonal of H with the spring on its middle edge, (n + 2,)."""
        diagonal = balance.diagonal.copy()
        diagonal[self._middle] += self._spring
        return diagonal

    def eliminated(self, balance: Balance, rhs: Array, gap: Array) -> Eliminated:
        """The angles eliminated, for right-hand sides ``rhs`` (n + 2, p) N m and ``gap`` (2, p) m."""
        imposed = self._imposed
        k = 2 - imposed.start
        columns = np.zeros((k + 1 + rhs.shape[1], rhs.shape[0]))
        columns[:k] = balance.border[imposed]
        columns[k, self._middle] = -self._spring
        columns[k + 1 :] = rhs.T
        diagonal = self._stiffened(balance)
        _, _, solved, info = dptsv(diagonal, balance.off, columns.T)
        definite = info == 0
        if not definite:
            *_, solved, info = dgtsv(balance.off, diagonal, balance.off, columns.T)
            if info != 0:
                solved = np.full_like(solved, np.nan)
        product = -(columns[: k + 1] @ solved)
        schur, low = product[:, : k + 1], product[:, k + 1 :]
        low[:k] += gap[imposed]
        schur[:k, :k] -= balance.softness[imposed, imposed]
        schur[k, k] += self._spring
        return Eliminated(balance, solved, schur * self._scales, low, definite)


def negative_pivots(diagonal: Array, off: Array) -> int:
    """Number of negative eigenvalues of a symmetric tridiagonal matrix, by the signs of its pivots (Sturm)."""
    bound = 4.0 * float(np.abs(diagonal).max() + np.abs(off).max())  # Gershgorin: no eigenvalue lies below minus this
    return int(dstebz(diagonal, off, 1, -bound, 0.0, 1, 1, bound, "E")[0])

"""The translations eliminated exactly: from Eq. (4) in (r, alpha) to angles and two reaction components.

Under dead loads the force in every edge is known up to the reaction R = (R_x, R_y) of the right support on the cable,
f_j = R + load beyond edge j, and the strains follow: Gamma = (1, 0) + C^-1 rot(alpha)^T f. What is left of Eq. (4) is

    Lambda(alpha, R) = sum_i w_i V(K_i) - sum_j h_j [f.t + (f.t)^2/(2 EA) + (f.n)^2/(2 GA)] + R.(right axis)

with t = (cos alpha, sin alpha) and n = (-sin alpha, cos alpha); stationary in the angles (moment balance) and in R (the
chain ends at the right axis). Its Hessian is tridiagonal in alpha, bordered by R, and well conditioned for any EA:

    [ H    B ]   H_ii = sum of dm/dK / w + h (f.t + ...),  B = d(gradient)/dR,
    [ B^T -S ]   S = sum h rot C^-1 rot^T (+ rig compliance).

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
from scipy.linalg.lapack import dgesv, dgtsv, dpttrf, dstebz, dsyev

from rod.characteristic import Array
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
    compliance : m/N
        Of the rig: the chord reaching the cable is chord + compliance * P.
    from_zero : bool
        The chord was commanded as a displacement from the zero position, so it moves when that does.
    """

    chord: float | None = None
    force: float | None = None
    tip: tuple[float, float] | None = None
    compliance: float = 0.0
    from_zero: bool = False

    def __post_init__(self) -> None:
        if sum(given is not None for given in (self.chord, self.force, self.tip)) != 1:
            raise ValueError("exactly one of chord, force and tip must be given")
        if not self.compliance >= 0.0:
            raise ValueError(f"compliance must not be negative, got {self.compliance}")

    @property
    def imposed(self) -> tuple[bool, bool]:
        """Whether the x and the y position of the right axis are imposed."""
        return self.chord is not None, self.tip is None

    def reaction(self, R: Array) -> Array:
        """The reaction R (2,) N with the components that are prescribed by force put in."""
        if self.force is not None:
            return np.array([-self.force, R[1]])
        return R if self.tip is None else np.asarray(self.tip, float)


class Balance(NamedTuple):
    """Residuals and Hessian of Lambda at one state; see the module for the symbols.

    ``gradient`` (n + 2,) N m; ``diagonal`` (n + 2,) and ``off`` (n + 1,) N m/rad; ``border`` (2, n + 2) m; ``softness``
    (2, 2) m/N without compliance; ``gap`` (2,) m: imposed minus actual position, 0 if not imposed; ``K``, ``m``,
    ``tangent`` (n + 1,).
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


class EdgeState(NamedTuple):
    """Directions of the edges and the force in them along and across, (n + 2,) each; N."""

    cos: Array
    sin: Array
    along: Array
    across: Array


class System:
    """Residuals and Newton steps of one rod, hold and memory; built once per equilibrium, immutable afterwards."""

    def __init__(self, rod: Rod, hold: Hold, memory: Memory) -> None:
        self.rod, self.hold, self.memory = rod, hold, memory
        self.moment_scale = rod.stiffness_scale / rod.length
        self.force_scale = rod.stiffness_scale / rod.length**2
        self._response = rod.section.response(memory)
        self._inverse_weights, self._load_beyond = 1.0 / rod.weights, rod.load_beyond
        self._axial, self._shear = rod.flexibility
        self._difference = self._axial - self._shear
        self._even_softness = self._axial * rod.length * np.eye(2)
        self._middle, self._spring = rod.edges.size // 2, 3.0 * self.moment_scale
        self._imposed = [i for i, imposed in enumerate(hold.imposed) if imposed]
        units = [self.force_scale / rod.length] * len(self._imposed) + [1.0 / self.moment_scale]
        self._scale = np.sqrt(units)[:, None]
        self._scales = self._scale * self._scale.T

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
        """Directions and forces of the edges at ``angles`` (n + 2,) and reaction ``R`` (2,)."""
        cos, sin = np.cos(angles), np.sin(angles)
        fx, fy = R.tolist() if self._load_beyond is None else R[:, None] + self._load_beyond
        return EdgeState(cos, sin, fx * cos + fy * sin, fy * cos - fx * sin)

    def balance(self, angles: Array, R: Array) -> Balance:
        """Residuals and Hessian at ``angles`` (n + 2,) and reaction ``R`` (2,)."""
        h = self.rod.edges
        K = (angles[:-1] - angles[1:]) * self._inverse_weights
        m, tangent = self._response(K)
        edge = self.edge_state(angles, R)
        gradient = -h * self.turning(edge)
        gradient[:-1] += m
        gradient[1:] -= m
        off = -tangent * self._inverse_weights
        diagonal = h * (edge.along if self._difference == 0.0 else self._restoring(edge))
        diagonal[:-1] -= off
        diagonal[1:] -= off
        border = self.border(edge)
        gap = self._shortfall(edge, border, R)
        gap[0] = gap[0] + self.hold.chord - self.hold.compliance * R[0] if self.hold.chord is not None else 0.0
        gap[1] *= self.hold.tip is None
        self._hold_ends(angles, gradient, diagonal, off, border)
        return Balance(gradient, diagonal, off, border, self._softness(edge), gap, K, m, tangent)

    def _shortfall(self, edge: EdgeState, border: Array, R: Array) -> Array:
        """Minus the extent of the chain, (2,) m; with EA = GA strains do not depend on direction and sums do."""
        if self._difference != 0.0:
            return np.asarray(-(self.directions(edge) @ self.rod.edges))
        beyond = 0.0 if self._load_beyond is None else self._load_beyond @ self.rod.edges
        return np.array((border[1].sum(), -border[0].sum())) - self._axial * (self.rod.length * R + beyond)

    def directions(self, edge: EdgeState) -> Array:
        """Derivative of position by arc length on every edge, (2, n + 2): tangent, stretch and shear."""
        stretch, shear = 1.0 + edge.along * self._axial, edge.across * self._shear
        return np.array((stretch * edge.cos - shear * edge.sin, stretch * edge.sin + shear * edge.cos))

    def turning(self, edge: EdgeState) -> Array:
        """Moment per length that the edge forces exert on the angles, (n + 2,) N."""
        if self._difference == 0.0:
            return edge.across
        return edge.across * (1.0 + edge.along * self._difference)

    def border(self, edge: EdgeState) -> Array:
        """Derivative of the gradient by R, (2, n + 2) m; minus that of the extent of the edges by the angles."""
        h = self.rod.edges
        border = np.array((h * edge.sin, -h * edge.cos))
        if self._difference != 0.0:
            border *= 1.0 + edge.along * self._difference
            border -= h * np.array((edge.cos, edge.sin)) * (edge.across * self._difference)
        return border

    def softened(self, edge: EdgeState, force: Array) -> Array:
        """Extent of every edge, (2, q, n + 2) m, for a small force (2, q, n + 2) or (2, q, 1) N: h rot C^-1 rot^T."""
        h, cos, sin = self.rod.edges, edge.cos, edge.sin
        if self._difference == 0.0:
            return np.asarray((self._axial * h) * force)
        along, across = self._axial * (cos * force[0] + sin * force[1]), self._shear * (cos * force[1] - sin * force[0])
        return np.array((h * (cos * along - sin * across), h * (sin * along + cos * across)))

    def _softness(self, edge: EdgeState) -> Array:
        if self._difference == 0.0:
            return self._even_softness
        return np.asarray(self.softened(edge, np.eye(2)[:, :, None]).sum(axis=2))

    def _restoring(self, edge: EdgeState) -> Array:
        return edge.along + (edge.along**2 - edge.across**2) * self._difference

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
        return [e for e in ends if e[1].kind == "clamp" or e[1].stiffness or e[1].friction_moment or e[1].moment]

    def clamps_turning(self, here: Balance, angles: Array, R: Array, residual: Array) -> tuple[Array, Array]:
        """Change of gradient (n + 2,) and gap (2,) while clamps turn by what they lack in ``residual`` (n + 2,) N m.

        The Hessian of ``here`` holds them at rest.
        """
        gradient, gap = np.zeros(angles.size), np.zeros(2)
        for end, support, *_ in self._ends:
            if support.kind == "clamp" and (turn := -residual[end] / self.moment_scale):
                near, joint = (1, 0) if end == 0 else (-2, -1)
                gradient[near] -= here.tangent[joint] * self._inverse_weights[joint] * turn
                gap += self.border(self.edge_state(angles, R))[:, end] * turn
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
        columns, solved, schur = self._eliminated(balance, rhs)
        k, p = len(self._imposed), rhs.shape[1]
        low = columns[:, : k + 1].T @ -solved[:, k + 1 :]
        low[:k] += gap if k == 2 else gap[self._imposed]
        _, _, multipliers, info = dgesv(schur, self._scale * low)
        multipliers = self._scale * multipliers if info == 0 else np.full((k + 1, p), np.nan)
        dR = np.zeros((2, p))
        dR[self._imposed] = multipliers[:k]
        return (solved.T[k + 1 :] - multipliers.T @ solved.T[: k + 1]).T, dR

    def excess_negatives(self, balance: Balance) -> int:
        """Negative eigenvalues of the Hessian of Eq. (4) under the imposed positions: 0 proves a minimum."""
        _, _, schur = self._eliminated(balance, np.zeros((balance.gradient.size, 0)))
        if not np.all(np.isfinite(schur)):
            return 1
        diagonal = balance.diagonal.copy()
        diagonal[self._middle] += self._spring
        count = negative_pivots(diagonal, balance.off) + int(np.count_nonzero(dsyev(schur, compute_v=0)[0] < 0.0))
        return count - len(self._imposed)

    def _eliminated(self, balance: Balance, rhs: Array) -> tuple[Array, Array, Array]:
        """Border columns and right-hand sides, both solved by the stiffened H, and the scaled Schur complement."""
        k, p = len(self._imposed), rhs.shape[1]
        columns = np.zeros((rhs.shape[0], k + 1 + p), order="F")
        columns[:, :k] = balance.border.T if k == 2 else balance.border[self._imposed].T
        columns[self._middle, k] = -self._spring
        columns[:, k + 1 :] = rhs
        diagonal = balance.diagonal.copy()
        diagonal[self._middle] += self._spring
        *_, solved, info = dgtsv(balance.off, diagonal, balance.off, columns)
        if info != 0:
            solved = np.full_like(columns, np.nan)
        schur = columns[:, : k + 1].T @ -solved[:, : k + 1]
        softness = balance.softness if k == 2 else balance.softness[self._imposed][:, self._imposed]
        schur[:k, :k] -= softness
        if self.hold.compliance:
            schur[0, 0] -= self.hold.compliance
        schur[k, k] += self._spring
        return columns, solved, schur * self._scales


def negative_pivots(diagonal: Array, off: Array) -> int:
    """Number of negative eigenvalues of a symmetric tridiagonal matrix, by the signs of its pivots (Sturm)."""
    if dpttrf(diagonal, off)[2] == 0:  # Cholesky's factors exist: none
        return 0
    bound = 4.0 * float(np.abs(diagonal).max() + np.abs(off).max())  # Gershgorin: no eigenvalue lies below minus this
    return int(dstebz(diagonal, off, 1, -bound, 0.0, 1, 1, bound, "E")[0])

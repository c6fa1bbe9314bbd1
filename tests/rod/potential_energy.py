"""Potential energy of the discrete rod, Eq. (4) with (5) corrected: from positions and angles to V, gradient, Hessian.

The definition that equilibria are held against. Unknowns q are all vertex positions r and edge angles alpha,
interleaved along the chain, so the Hessian has half bandwidth 5:

    V(q) = sum_edges h/2 [EA (Gamma_1 - 1)^2 + GA Gamma_2^2] + sum_joints w psi(K) + ends - sum_vertices load . r,
    Gamma = rot(alpha)^T (r_right - r_left) / h,    K = -(alpha_right - alpha_left) / w.

psi is the energy per length of the section, int_{K0}^{K} m dk (the printed Eq. (5) has a factor 1/2 too many; so
printed all forces would halve), with friction or plastic set the incremental potential of the step. Equilibria are
minima of V under the imposed positions; reactions are dV/d(imposed position).
`rod.equilibrium` finds them after exact elimination of r (`rod.reduction`), because EA and GA of a real cable make this
Hessian ill-conditioned; here it serves as definition, and to check that equilibria are stationary points and minima.

Units: m, rad, N, J; load and positions in the chord frame, K positive toward +y.

Source: Eqs. (2), (4) and (5) of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rod.array import Array
from rod.discretisation import Rod
from rod.section import Memory
from rod.support import Support
from tests.rod.energies import section_potential, section_stored, support_potential, support_stored

HALF_BANDWIDTH = 5

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Potential:
    """Eq. (4) of one rod with the memory at the start of a step.

    Attributes
    ----------
    rod : Rod
    memory : Memory
    """

    rod: Rod
    memory: Memory

    @cached_property
    def _stretching(self) -> Index:
        """Edges of positive length: those that carry strains."""
        return np.flatnonzero(self.rod.edges > 0.0)

    @cached_property
    def angle_index(self) -> Index:
        """Place of every edge angle in q, (n + 2,)."""
        long = self.rod.edges > 0.0
        before = np.concatenate(([0], np.cumsum(long)[:-1]))
        return np.asarray(2 * (before + 1) + np.arange(long.size), np.intp)

    @cached_property
    def vertex_index(self) -> Index:
        """Place of the x component of every vertex in q; y follows. Bearings without rigid piece share a vertex."""
        return np.concatenate(([0], self.angle_index[self._stretching] + 1))

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.angle_index.size + 2 * self.vertex_index.size)

    def unknowns(self, angles: Array, x: Array, y: Array) -> Array:
        """Vector q from edge angles (n + 2,) and vertex positions, as `rod.equilibrium.Equilibrium` shows them."""
        q = np.empty(self.size)
        q[self.angle_index] = angles
        q[self.vertex_index], q[self.vertex_index + 1] = x, y
        return q

    def free(self, *, x_imposed: bool = True, y_imposed: bool = True) -> NDArray[np.bool_]:
        """Mask of q (size,), what may move: all but the left axis, imposed parts of the right one, and clamps."""
        free = np.ones(self.size, bool)
        free[:2] = False
        last = self.vertex_index[-1]
        free[last], free[last + 1] = not x_imposed, not y_imposed
        for end, support in ((0, self.rod.left), (-1, self.rod.right)):
            free[self.angle_index[end]] = support.kind != "clamp"
        return free

    def value(self, q: Array) -> float:
        """V, J."""
        rod, (stretch, shear, _, _) = self.rod, self._strains(q)
        h = rod.edges[self._stretching]
        axial, flexible = rod.flexibility
        angles = q[self.angle_index]
        energy = 0.5 * float(h @ (stretch**2 / axial + shear**2 / flexible))
        energy += float(rod.weights @ section_potential(rod.section, rod.curvature(angles), self.memory))
        for angle, support, rest, slip, sign in self._ends(angles):
            energy += support_potential(support, angle, rest, slip) + sign * support.moment * angle
        return energy - float(np.sum(self._loads() * q[self._positions()]))

    def gradient(self, q: Array) -> Array:
        """Derivative dV/dq (size,), N for positions and N m for angles; at imposed positions the reactions."""
        rod, (stretch, shear, t, n) = self.rod, self._strains(q)
        axial, flexible = rod.flexibility
        h = rod.edges[self._stretching]
        tension, transverse = stretch / axial, shear / flexible
        force = tension * t + transverse * n
        g = np.zeros(self.size)
        left, right = self.vertex_index[:-1], self.vertex_index[1:]
        for component in (0, 1):
            g[right + component] += force[component]
            g[left + component] -= force[component]
        g[self._positions()] -= self._loads()
        at = self.angle_index
        g[at[self._stretching]] += h * (tension * shear - transverse * (1.0 + stretch))
        m, _ = rod.section.response(self.memory)(rod.curvature(q[at]))
        g[at[:-1]] += m
        g[at[1:]] -= m
        for place, (angle, support, rest, slip, sign) in zip((at[0], at[-1]), self._ends(q[at]), strict=True):
            g[place] += support.moment_at(angle, rest, slip)[0] + sign * support.moment
        return g

    def hessian(self, q: Array) -> Array:
        """Second derivative in lower banded form, (HALF_BANDWIDTH + 1, size): row k holds the k-th subdiagonal."""
        rod, (stretch, shear, t, n) = self.rod, self._strains(q)
        EA, GA = 1.0 / rod.flexibility[0], 1.0 / rod.flexibility[1]
        h = rod.edges[self._stretching]
        band = np.zeros((HALF_BANDWIDTH + 1, self.size))

        def add(rows: Index, columns: Index, values: Array) -> None:
            low, high = np.maximum(rows, columns), np.minimum(rows, columns)
            np.add.at(band, (low - high, high), values)

        left, right, at = self.vertex_index[:-1], self.vertex_index[1:], self.angle_index
        own = at[self._stretching]
        gamma = 1.0 + stretch
        by_angle = (EA - GA) * shear * t + (EA * stretch - GA * gamma) * n
        for a in (0, 1):
            add(right + a, own, by_angle[a])
            add(left + a, own, -by_angle[a])
            for b in (0, 1):
                block = (EA * t[a] * t[b] + GA * n[a] * n[b]) / h
                add(right + a, left + b, -block)
                if b <= a:
                    add(right + a, right + b, block)
                    add(left + a, left + b, block)
        add(own, own, h * (EA * (shear**2 - gamma * stretch) + GA * (gamma**2 - shear**2)))
        bending = rod.section.response(self.memory)(rod.curvature(q[at]))[1] / rod.weights
        add(at[:-1], at[:-1], bending)
        add(at[1:], at[1:], bending)
        add(at[1:], at[:-1], -bending)
        for place, (angle, support, rest, slip, _) in zip((at[0], at[-1]), self._ends(q[at]), strict=True):
            band[0, place] += support.moment_at(angle, rest, slip)[1]
        return band

    def stored(self, q: Array) -> float:
        """Recoverable part of V at the end of the step, J: V without what friction and set dissipate."""
        return self.value(q) - self.dissipated(q)

    def dissipated(self, q: Array) -> float:
        """Energy lost in the step that ended at q, J: slip of friction elements and bearings, growth of the set."""
        rod, angles = self.rod, q[self.angle_index]
        K = rod.curvature(angles)
        lost = section_potential(rod.section, K, self.memory) - section_stored(rod.section, K, self.memory)
        energy = float(rod.weights @ lost)
        for angle, support, rest, slip, _ in self._ends(angles):
            energy += support_potential(support, angle, rest, slip) - support_stored(support, angle, rest, slip)
        return energy

    def _strains(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Gamma_1 - 1 and Gamma_2 (edges,), tangents and normals (2, edges) of the stretching edges."""
        angles = q[self.angle_index[self._stretching]]
        t = np.array((np.cos(angles), np.sin(angles)))
        n = np.array((-t[1], t[0]))
        places = np.array((self.vertex_index, self.vertex_index + 1))
        d = np.diff(q[places], axis=1) / self.rod.edges[self._stretching]
        return (t * d).sum(axis=0) - 1.0, (n * d).sum(axis=0), t, n

    def _positions(self) -> Index:
        return np.array((self.vertex_index, self.vertex_index + 1))

    def _loads(self) -> Array:
        """Dead load on each vertex, (2, vertices) N."""
        given = self.rod.vertex_load
        if given is None:
            return np.zeros((2, self.vertex_index.size))
        skip_left, skip_right = int(self.rod.edges[0] == 0.0), int(self.rod.edges[-1] == 0.0)
        return given[skip_left : given.shape[0] - skip_right].T

    def _ends(self, angles: Array) -> tuple[tuple[float, Support, float, float, float], ...]:
        """Angle, support, rest angle, slip memory and sign of an applied moment, left and right."""
        rest = self.rod.rest_angles
        return (
            (float(angles[0]), self.rod.left, rest[0], self.memory.left_angle, -1.0),
            (float(angles[-1]), self.rod.right, rest[1], self.memory.right_angle, 1.0),
        )

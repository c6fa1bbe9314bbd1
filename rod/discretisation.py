"""The discrete rod: from a cable on two supports to edges, joints and weights.

The chain from bearing to bearing has n + 2 edges and n + 1 joints:

    axis = edge 0 (rigid piece) = joint 0 = edge 1 = joint 1 = ... = edge n = joint n = edge n+1 (rigid piece) = axis

Edges carry the tangent angle alpha (rad, from x toward y) and the strains Gamma, joints carry the curvature

    K_i = -(alpha_{i+1} - alpha_i) / w_i,   w = (h_1/2, (h_1 + h_2)/2, ..., h_n/2),

positive in the direction of the bow. The rigid pieces do not bend; of length zero they are the bearing itself, and
their angle is the angle of the bearing. So free pins, springs, friction, clamps and rigid ends are one mechanism, of
second order in the grid. Dead loads are lumped to the vertices (axis, joints, axis).

Source: Eqs. (2) and (4) of the paper ("vertices carry r and K, edges carry alpha and Gamma").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rod.array import Array
from rod.section import Memory, Section
from rod.support import BEARING, Support

#: EA = GA = this times the stiffness scale over length^2 unless given. The chord that elongation takes from the bow is
#: then P/EA = 1e-8 of the length for P = 10 EI/L^2; even for a cable of K0 L = 0.2 the force changes by less than 1e-6.
RIGIDITY = 1e9

#: Of the length: a rigid piece that is shorter is a point, and its two ends are one place of the shape.
POINT = 1e-9


class Mounted(NamedTuple):
    """The force-free rod in its chord frame: angles (n + 2,) rad and chord, m."""

    angles: Array
    chord: float


@dataclass(frozen=True, eq=False)
class Rod:
    """A discrete rod, ready to be brought into equilibrium.

    Attributes
    ----------
    length : m
        From axis to axis, rigid pieces included.
    elements : (n,)
        Relative element lengths of the free cable, positive, of sum one.
    section : Section
        On the n + 1 joints.
    left, right : Support
    load : (2,) N/m
        Dead load per length along x and y.
    axial_stiffness, shear_stiffness : N or None
        EA and GA; None: see `RIGIDITY`.
    forces : (n + 1, 2) N or None
        Dead forces along x and y on the joints.
    """

    length: float
    elements: Array
    section: Section
    left: Support = BEARING
    right: Support = BEARING
    load: tuple[float, float] = (0.0, 0.0)
    axial_stiffness: float | None = None
    shear_stiffness: float | None = None
    forces: Array | None = None

    def __post_init__(self) -> None:
        if self.elements.ndim != 1 or self.elements.size < 2 or np.any(self.elements <= 0.0):
            raise ValueError("elements must be a whole number, or so many positive relative lengths; at least two")
        if not self.free_length > 0.0:
            raise ValueError(f"rigid pieces leave nothing of the length {self.length} m; it must be positive")
        if self.left.kind == "free":
            raise ValueError("only the right end can be free")
        if np.shape(self.load) != (2,) or not np.all(np.isfinite(self.load)):
            raise ValueError(f"load is two finite numbers, along x and y; got {self.load}")
        if any(value is not None and not value > 0.0 for value in (self.axial_stiffness, self.shear_stiffness)):
            raise ValueError("axial and shear stiffness must be positive")

    @property
    def free_length(self) -> float:
        """Length that bends, m."""
        return self.length - self.left.rigid_length - self.right.rigid_length

    @cached_property
    def edges(self) -> Array:
        """Edge lengths h, (n + 2,) m, the rigid pieces first and last."""
        return np.concatenate(([self.left.rigid_length], self.elements * self.free_length, [self.right.rigid_length]))

    @cached_property
    def weights(self) -> Array:
        """Length w that each joint stands for, (n + 1,) m."""
        inner = self.edges[1:-1]
        return 0.5 * (np.concatenate(([0.0], inner)) + np.concatenate((inner, [0.0])))

    @cached_property
    def inverse_weights(self) -> Array:
        """One over `weights`, (n + 1,) 1/m."""
        return 1.0 / self.weights

    @cached_property
    def signed_edges(self) -> Array:
        """Edge lengths and their negatives, (2, n + 2) m."""
        return np.array((self.edges, -self.edges))

    @cached_property
    def arc_lengths(self) -> Array:
        """Arc length at the vertices, the axes and the joints, (n + 3,) m."""
        return np.concatenate(([0.0], np.cumsum(self.edges)))

    @cached_property
    def right_share(self) -> Array:
        """Share of the edge on the right in the angle at each inner joint, (n - 1,): that of the other's length."""
        inner = self.edges[1:-1]
        return np.asarray(inner[:-1] / (inner[:-1] + inner[1:]))

    @cached_property
    def length_beyond(self) -> Array:
        """Length to the right of each edge's middle, (n + 2,) m."""
        return np.asarray(0.5 * self.edges + (self.length - np.cumsum(self.edges)))

    @cached_property
    def stiffness_scale(self) -> float:
        """Typical bending stiffness, N m^2: size of the law times the largest profile value.

        Raises `ValueError` if that is not positive: without stiffness nothing has a scale.
        """
        profile = self.section.profile
        scale = self.section.law.stiffness_scale * (1.0 if profile is None else float(np.max(np.abs(profile))))
        friction = self.section.friction
        scale += 0.0 if friction is None else friction.stiffness
        if not (np.isfinite(scale) and scale > 0.0):
            raise ValueError("the characteristic has no stiffness")
        return scale

    @cached_property
    def flexibility(self) -> tuple[float, float]:
        """1/EA and 1/GA, 1/N."""
        default = self.length**2 / (RIGIDITY * self.stiffness_scale)
        axial = default if self.axial_stiffness is None else 1.0 / self.axial_stiffness
        shear = default if self.shear_stiffness is None else 1.0 / self.shear_stiffness
        return axial, shear

    @cached_property
    def vertex_load(self) -> Array | None:
        """Dead load lumped to the n + 3 vertices, with the forces on the joints, (n + 3, 2) N; None without either."""
        if not any(self.load) and self.forces is None:
            return None
        half = 0.5 * np.concatenate(([0.0], self.edges)) + 0.5 * np.concatenate((self.edges, [0.0]))
        load = half[:, None] * np.asarray(self.load)
        if self.forces is not None:
            load[1:-1] += self.forces
        return np.asarray(load)

    @cached_property
    def load_beyond(self) -> Array | None:
        """Dead load to the right of each edge, (2, n + 2) N: the force in an edge is the right reaction plus this."""
        load = self.vertex_load
        return None if load is None else np.ascontiguousarray(np.cumsum(load[:0:-1], axis=0)[::-1].T)

    @cached_property
    def mounted(self) -> Mounted:
        """Shape without force, moment and load."""
        relative = -np.concatenate(([0.0], np.cumsum(self.weights * self.section.pre_curvature)))
        X, Y = float(self.edges @ np.cos(relative)), float(self.edges @ np.sin(relative))
        return Mounted(relative - np.arctan2(Y, X), float(np.hypot(X, Y)))

    @cached_property
    def leaning(self) -> tuple[int, bool]:
        """Side to which the force-free shape is bowed, +1 or -1, a straight one up, and whether the cable bows there.

        That is uncertain where it is bent both ways, or straight and driven by loads, end moments or turned ends.
        """
        K0 = self.section.pre_curvature
        driven = self.load[1] != 0.0 or any(end.moment or end.angle for end in (self.left, self.right))
        driven = driven or self.forces is not None
        low, high = float(K0.min()), float(K0.max())
        side = 1 if self.bow(self.mounted.angles) >= 0.0 else -1
        return side, not (low < 0.0 < high or (driven and low == high == 0.0))

    @cached_property
    def rest_angles(self) -> tuple[float, float]:
        """Rest angle of the springs, or the angle of a clamp, left and right, rad."""
        angles = self.mounted.angles
        left = float(angles[0]) if self.left.angle is None else self.left.angle
        right = float(angles[-1]) if self.right.angle is None else self.right.angle
        return left, right

    @cached_property
    def virgin(self) -> Memory:
        """Memory of the mounted cable."""
        angles = self.mounted.angles
        return Memory(*self.section.virgin(), float(angles[0]), float(angles[-1]))

    @cached_property
    def _levers(self) -> Array:
        """How much the mean height, relative to the length, grows with the sine of each edge's angle, (n + 2,)."""
        return self.edges * (self.length - self.arc_lengths[:-1]) / self.length**2

    def bow(self, angles: Array) -> float:
        """Mean height of a shape over its chord, relative to the length: positive if it bows toward +y."""
        return float(self._levers @ np.sin(angles))

    def curvature(self, angles: Array) -> Array:
        """Curvature at the joints, (n + 1,) 1/m."""
        return np.asarray((angles[:-1] - angles[1:]) / self.weights)

    @cached_property
    def shown(self) -> slice:
        """The vertices that are shown, of n + 3: the joints, and the bearing axes where rigid pieces stand between."""
        left, right = self.edges[[0, -1]] > POINT * self.length
        return slice(0 if left else 1, None if right else -1)

    def at_vertices(self, extent: Array, angles: Array, K: Array, m: Array) -> Array:
        """Position x and y, theta, kappa and moment at the vertices shown, (5, ..., vertices); or changes of them.

        From the extent of the edges (2, ..., n + 2), their angles, and curvature and moment at the joints (..., n + 1).
        """
        *_, theta, kappa, moment = values = np.zeros((5, *angles.shape[:-1], angles.shape[-1] + 1))
        np.add.accumulate(extent, axis=-1, out=values[:2, ..., 1:])
        inner = angles[..., 1:-1]
        theta[..., 2:-2] = inner[..., :-1] + self.right_share * (inner[..., 1:] - inner[..., :-1])
        theta[..., :2], theta[..., -2:] = angles[..., :1], angles[..., -1:]
        kappa[..., 1:-1], moment[..., 1:-1] = K, m
        moment[..., 0], moment[..., -1] = m[..., 0], m[..., -1]
        return values[..., self.shown]

    def advanced(self, angles: Array, K: Array, memory: Memory) -> Memory:
        """Memory after a step that ended with these angles and the curvatures of them."""
        return Memory(
            *self.section.advanced(K, memory),
            self.left.advanced(float(angles[0]), memory.left_angle),
            self.right.advanced(float(angles[-1]), memory.right_angle),
            memory.step + 1,
        )


Along = float | Array | Callable[[Array], ArrayLike]


def joint_values(values: Along, elements: Array, *, name: str) -> Array:
    """Values at the joints: a number, (n + 1,) values, or a function of the relative position 0..1 on the free cable.

    Raises `ValueError` for another shape, or values that are not finite; the message carries ``name``.
    """
    position = np.concatenate(([0.0], np.cumsum(elements)))
    given = np.asarray(values(position) if callable(values) else values, float)
    if given.shape not in ((), position.shape):
        raise ValueError(f"{name} has shape {given.shape}; a number, ({position.size},) values or a function is needed")
    if not np.all(np.isfinite(given)):
        raise ValueError(f"{name} is not finite")
    return np.broadcast_to(given, position.shape).copy()

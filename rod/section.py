"""Moment of a cross-section at its curvature: law, stiffness profile, internal friction, plastic set, and memory.

From curvature K (1/m) at the joints of the discrete rod to moment m (N m) and tangent dm/dK (N m^2):

    m = profile * m_law(K; set) + sum_e M_e q_e,   q_e = clip((K - z_e) / c_e, -1, 1)

* Internal friction (wires that rub): parallel elasto-plastic elements (Prandtl-Ishlinskii). Element e sticks over a
  curvature change c_e and slips at the moment M_e; z_e is its relaxed curvature, its memory. At the start z_e = K0.
* An element that gives way gradually (Dahl): from K', where the step before ended, q_e = w - (w - q_e') exp(-|K - K'| /
  c_e), w the sign of K - K'. With z_e = K - c_e q_e its memory is one and the same.
* Plastic set p = rate * g(max(reached, K - K0) - threshold), where ``reached`` is the largest excess K - K0 so far, the
  threshold at least, and g(x) = (1 - exp(-c x)) / c of saturation c grows ever more slowly, g(x) = x without one: the
  cable is free of moment at K0 + p. The law m_law(K, K0) moves along with its rest,
  m_law(K - p, K0), as that of a cable that has been bent to another shape; or it stays at its curvature
  (``law_stays``), m_law(K, K0) - m_law(K0 + p, K0), as that of a cable whose stiffness belongs to the shape it has. For
  a law of constant stiffness both are the same.
* A set may also be given step by step, ``grown``: where all of a sheath goes with its largest bend, say. It adds to p.

Within one displacement step the response is a function of K alone with the memory of the step's start: an increment is
a minimisation like any other. Memory is advanced once, when the step is done (`Section.advanced`).

Source: constitutive extension of Eq. (5) of the paper; Prandtl-Ishlinskii model as in plasticity text books; Dahl
(1976), Solid friction damping of mechanical vibrations, with exponent 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rod.array import Array
from rod.characteristic import MomentCurve

Response = Callable[[Array], tuple[Array, Array]]


@dataclass(frozen=True)
class InternalFriction:
    """Friction between the wires, as parallel elasto-plastic elements of equal moment.

    Attributes
    ----------
    half_width : N m
        Moment when all elements slip: half the width of the hysteresis loop. Zero is allowed (derivatives at zero).
    stick_curvature : 1/m
        Curvature change from the relaxed state after which all elements slip; positive.
    elements : int
        Elements slip one after the other at stick_curvature * ((1..elements) / elements)^spread: one is a sharp
        stick-slip, several a rounded loop. Three follow a smooth loop to a few per cent.
    gradual : bool
        Whether all give way gradually, as Dahl's, each with its stick_curvature as the decay of what still sticks.
    beside : InternalFriction or None
        Further elements acting in parallel: a loop of any form is a sum of such groups.
    spread : float
        Evenly with 1; with 0 all slip at once, above 1 most of them early.
    """

    half_width: float
    stick_curvature: float
    elements: int = 3
    gradual: bool = False
    beside: InternalFriction | None = None
    spread: float = 1.0

    def __post_init__(self) -> None:
        if not (self.half_width >= 0.0 and self.stick_curvature > 0.0 and self.elements >= 1 and self.spread >= 0.0):
            raise ValueError(f"need half_width >= 0, stick_curvature > 0, elements >= 1 and spread >= 0, got {self}")

    @cached_property
    def stick(self) -> Array:
        """Curvature change c_e to slip of each element, (count, 1) 1/m; those beside follow."""
        own = self.stick_curvature * (np.arange(1, self.elements + 1)[:, None] / self.elements) ** self.spread
        return own if self.beside is None else np.vstack([own, self.beside.stick])

    @cached_property
    def slip(self) -> Array:
        """Slip moment M_e of each element, (count, 1) N m."""
        own = np.full((self.elements, 1), self.half_width / self.elements)
        return own if self.beside is None else np.vstack([own, self.beside.slip])

    @cached_property
    def smooth(self) -> NDArray[np.int_]:
        """Positions (k,) of the elements that give way gradually."""
        own = np.arange(self.elements if self.gradual else 0)
        return own if self.beside is None else np.append(own, self.elements + self.beside.smooth)

    @property
    def stiffness(self) -> float:
        """Stiffness of all elements while they stick, N m^2."""
        return float(np.sum(self.slip / self.stick))

    def share(self, K: Array, memory: Memory) -> tuple[Array, Array]:
        """Share q_e (e, n) of its slip moment that an element carries, and its derivative by ``K`` (n,) times c_e."""
        u = (K - memory.relaxed) / self.stick
        q, by_K = np.clip(u, -1.0, 1.0), (np.abs(u) < 1.0).astype(float)
        if (k := self.smooth).size:
            way, left, before = self._moved(K, memory)
            q[k], by_K[k] = way - (way - before) * left, (1.0 - way * before) * left
        return q, by_K

    def by_memory(self, K: Array, memory: Memory) -> tuple[Array, Array, Array]:
        """Derivatives (e, n) of q_e by the relaxed curvature, the last one, and c_e, times c_e each."""
        q, by_K = self.share(K, memory)
        by_relaxed, by_last, by_stick = -by_K, np.zeros_like(q), -by_K * q
        if (k := self.smooth).size:
            _, left, before = self._moved(K, memory)
            by_relaxed[k], by_last[k] = -left, left - by_K[k]
            by_stick[k] = -before * left - by_K[k] * (K - memory.last) / self.stick[k]
        return by_relaxed, by_last, by_stick

    def _moved(self, K: Array, memory: Memory) -> tuple[Array, Array, Array]:
        """Of elements that give way gradually: sign of the way (n,), what still sticks and q before it (k, n)."""
        stick, way = self.stick[self.smooth], np.where(memory.last > K, -1.0, 1.0)
        return way, np.exp(-np.abs(K - memory.last) / stick), (memory.last - memory.relaxed[self.smooth]) / stick


@dataclass(frozen=True, eq=False)
class Memory:
    """What the cable and its bearings remember of the steps before.

    Attributes
    ----------
    relaxed : (elements, n) 1/m
        Curvature at which each friction element is free of moment; (0, n) without friction.
    last : (n,) 1/m
        Curvature at the end of the step before.
    reached : (n,) 1/m
        Largest excess curvature K - K0 so far, not below zero.
    left_angle, right_angle : rad
        Angle at which the friction of each bearing is free of moment.
    step : int
        Number of the step that begins, where something is given step by step.
    """

    relaxed: Array
    last: Array
    reached: Array
    left_angle: float
    right_angle: float
    step: int = 0


class Read(NamedTuple):
    """One place where the law is read, ``at`` (n,) 1/m; with its share, and how the place moves with K, set and K0."""

    share: float
    at: Array
    by_K: float = 0.0
    by_set: float = 0.0
    by_rest: float = 0.0


@dataclass(frozen=True, eq=False)
class Section:
    """Constitutive data at the n joints of the rod.

    Attributes
    ----------
    law : MomentCurve
    pre_curvature : (n,) 1/m
        K0(s).
    profile : (n,) or None
        Factor on the moment of the law, EI(s) relative; None for 1.
    friction : InternalFriction or None
    plastic_rate : float
        Growth of K0 with the largest curvature reached, 1/m per 1/m.
    law_stays : bool
        Whether the law stays at its curvature while K0 grows.
    set_threshold : 1/m
        Bend from rest beyond which a set begins.
    set_saturation : m
        One over the bend beyond that on which the growth of a set falls to 37 %; zero where it does not fall.
    grown : (steps, n) 1/m or None
        Set that is given step by step; the last one stays.
    """

    law: MomentCurve
    pre_curvature: Array
    profile: Array | None = None
    friction: InternalFriction | None = None
    plastic_rate: float = 0.0
    law_stays: bool = False
    set_threshold: float = 0.0
    set_saturation: float = 0.0
    grown: Array | None = None

    @property
    def sets(self) -> bool:
        """Whether the cable may take a set."""
        return bool(self.plastic_rate) or self.grown is not None

    def given(self, memory: Memory) -> Array | float:
        """Set that is given at a step, (n,) 1/m."""
        return 0.0 if self.grown is None else self.grown[min(memory.step, len(self.grown) - 1)]

    @cached_property
    def rest(self) -> Array:
        """Pre-curvature, (1,) if uniform, otherwise (n,) 1/m: a uniform one is looked up only once."""
        K0 = self.pre_curvature
        return K0[:1] if np.ptp(K0) == 0.0 else K0

    def virgin(self) -> tuple[Array, Array, Array]:
        """``relaxed`` (friction elements, n), ``last`` (n,) and ``reached`` (n,) of the mounted cable, 1/m."""
        elements = 0 if self.friction is None else self.friction.stick.size
        reached = np.full_like(self.pre_curvature, self.set_threshold)
        return np.repeat(self.pre_curvature[None], elements, axis=0), self.pre_curvature, reached

    def set_at(self, K: Array, memory: Memory) -> Array:
        """Plastic set p that goes with curvature K, (n,) 1/m."""
        return np.asarray(self.grows(np.maximum(memory.reached, K - self.pre_curvature)) + self.given(memory))

    def grows(self, reached: Array) -> Array:
        """Plastic set by the largest excess so far, the threshold at least, (n,) 1/m."""
        return self.plastic_rate * growth(reached - self.set_threshold, self.set_saturation)[0]

    def read(self, K: Array, p: Array) -> tuple[Read, ...]:
        """Where the law is read for curvature K and set p: its moment is ``sum share * law.moment(at, K0)``."""
        if self.law_stays:
            return Read(1.0, K, by_K=1.0), Read(-1.0, self.pre_curvature + p, by_set=1.0, by_rest=1.0)
        return (Read(1.0, K - p, by_K=1.0, by_set=-1.0),)

    def response(self, memory: Memory) -> Response:
        """Function from K (n,) to moment and tangent (n,), for the memory at the start of the step."""
        elastic = self._set_response(memory) if self.sets else _elastic(self)
        friction = self.friction
        if friction is None:
            return elastic

        def with_friction(K: Array) -> tuple[Array, Array]:
            m, tangent = elastic(K)
            q, by_K = friction.share(K, memory)
            return m + (friction.slip * q).sum(axis=0), tangent + (friction.slip / friction.stick * by_K).sum(axis=0)

        return with_friction

    def _set_response(self, memory: Memory) -> Response:
        elastic, K0 = _elastic(self), self.pre_curvature

        def with_set(K: Array) -> tuple[Array, Array]:
            slope = growth(np.maximum(K - K0 - self.set_threshold, 0.0), self.set_saturation)[1]
            growing = self.plastic_rate * slope * np.greater(K - K0, memory.reached)
            m, tangent = np.zeros((2, *K.shape))
            for read in self.read(K, self.set_at(K, memory)):
                moment, by_read = elastic(read.at)
                m += read.share * moment
                tangent += read.share * (read.by_K + read.by_set * growing) * by_read
            return m, tangent

        return with_set

    def advanced(self, K: Array, memory: Memory) -> tuple[Array, Array, Array]:
        """``relaxed``, ``last`` and ``reached``, as of `virgin`, after a step that ended at curvature K (n,) 1/m."""
        reached = np.maximum(memory.reached, K - self.pre_curvature)
        if self.friction is None:
            return memory.relaxed, K, reached
        return K - self.friction.stick * self.friction.share(K, memory)[0], K, reached


def growth(excess: Array, saturation: float) -> tuple[Array, Array, Array]:
    """What a set grows by a bend of ``excess`` (n,) 1/m beyond its threshold, g; its derivatives by that and by c."""
    if not saturation:
        return excess, np.ones_like(excess), -0.5 * excess**2
    g = -np.expm1(-saturation * excess) / saturation
    left = 1.0 - saturation * g
    return g, left, (excess * left - g) / saturation


@lru_cache(maxsize=16)
def _elastic(section: Section) -> Response:
    """Moment of the law alone, without set; remembered, since a fit asks for it at every step of a test."""
    bound = section.law.bound(section.rest)
    if section.profile is None:
        return bound
    profile = section.profile

    def scaled(K: Array) -> tuple[Array, Array]:
        m, tangent = bound(K)
        return profile * m, profile * tangent

    return scaled

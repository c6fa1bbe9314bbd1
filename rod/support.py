"""How the ends of the cable are held: bearings with springs, friction and rigid pieces; clamps; a free end.

Each end carries an angle of its own (rad, from x toward y). What acts on that angle is written as the bending moment at
the end of the cable, in the sign of the curvature; "against the turning direction" makes it negative at both ends
when the cable is bent further, since the left angle then grows and the right one falls:

    left end   m = moment - spring(angle - rest) - friction_moment clip((angle - slip) / stick_angle, -1, 1)
    right end  m = moment + spring(angle - rest) + friction_moment clip((angle - slip) / stick_angle, -1, 1)
    spring(u) = stiffness sinh(r u) / r,  r^2 = hardening;    where hardening < 0:  tanh(r u) / r,  r^2 = -hardening / 2

``rest`` is the angle in the mounted, force-free position unless given; ``slip`` is the memory of the friction, at the
start the mounted angle. A Coulomb moment that sticks over a small angle instead of none keeps every step a smooth
minimisation; once the bearing has turned by ``stick_angle`` the moment is exactly the Coulomb moment.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cosh, isfinite, sinh, sqrt, tanh
from typing import Literal, get_args

Kind = Literal["bearing", "clamp", "free"]
KINDS = get_args(Kind)


NEARLY_LINEAR = 1e-3
"""Of r u: below it the spring's next term, of the fourth power, is below rounding of what a simulation reaches."""


@dataclass(frozen=True)
class Support:
    """One end of the cable.

    Attributes
    ----------
    kind : {"bearing", "clamp", "free"}
        A bearing turns, a clamp keeps its angle, a free end also moves (right end only; cantilever).
    angle : rad or None
        Angle of a clamp, or rest angle of a bearing's spring. None: as mounted.
    stiffness : N m/rad
        Rotational spring of a bearing.
    hardening : 1/rad^2
        By which that spring stiffens with its turn, stiffness (u + hardening u^3 / 6 + ...); below 0 it yields, to the
        moment stiffness / sqrt(-hardening / 2).
    friction_moment : N m
        Coulomb moment of a bearing.
    stick_angle : rad
        Turn over which the friction builds up. The default is a hundredth of the turn of a usual displacement step
        (0.1 rad), small enough not to matter, large enough for a well-conditioned step.
    rigid_length : m
        Stiff piece between the bearing axis (or clamp) and the free cable.
    moment : N m
        Applied bending moment, in the sign of the curvature.
    """

    kind: Kind = "bearing"
    angle: float | None = None
    stiffness: float = 0.0
    hardening: float = 0.0
    friction_moment: float = 0.0
    stick_angle: float = 1e-3
    rigid_length: float = 0.0
    moment: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"kind of support {self.kind!r}: one of {', '.join(KINDS)}")
        if not self.stick_angle > 0.0:
            raise ValueError(f"stick_angle must be positive, got {self.stick_angle}")
        if not self.rigid_length >= 0.0:
            raise ValueError(f"rigid_length must not be negative, got {self.rigid_length}")
        if not all(
            map(isfinite, (self.angle or 0.0, self.stiffness, self.hardening, self.friction_moment, self.moment))
        ):
            raise ValueError(f"angle, spring, friction_moment and moment of a support are finite, got {self}")

    @property
    def turns_freely(self) -> bool:
        """Whether a bearing neither springs nor rubs."""
        return not (self.stiffness or self.friction_moment)

    def moment_at(self, angle: float, rest: float, slip: float) -> tuple[float, float]:
        """Moment against turning (spring and friction, N m) and its derivative by the angle (N m/rad)."""
        u = (angle - slip) / self.stick_angle
        sticking = -1.0 < u < 1.0
        moment, slope, *_ = self.spring(angle - rest)
        moment += self.friction_moment * min(1.0, max(-1.0, u))
        return moment, slope + (self.friction_moment / self.stick_angle if sticking else 0.0)

    def spring(self, turn: float) -> tuple[float, float, float, float]:
        """Moment of the spring at a turn from its rest (N m), its derivative by it, by stiffness and by hardening."""
        k, h = self.stiffness, self.hardening
        rate = sqrt(h) if h > 0.0 else sqrt(-0.5 * h)
        x = rate * turn
        if abs(x) < NEARLY_LINEAR:
            cubic = turn**3 / 6.0
            return k * (turn + h * cubic), k * (1.0 + 0.5 * h * turn**2), turn + h * cubic, k * cubic
        value, slope = (sinh(x), cosh(x)) if h > 0.0 else (tanh(x), 1.0 - tanh(x) ** 2)
        return k * value / rate, k * slope, value / rate, 0.5 * k * (slope * turn - value / rate) / h

    def advanced(self, angle: float, slip: float) -> float:
        """Memory of the friction after a step that ended at ``angle``."""
        return min(max(slip, angle - self.stick_angle), angle + self.stick_angle)


#: The ideal, moment-free bearing.
BEARING = Support()
#: A clamp along the chord, and a free end (right end only).
CLAMP, FREE = Support("clamp", angle=0.0), Support("free")

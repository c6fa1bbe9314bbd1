"""What the rig gets wrong: bearings, clamps, frame, zero of displacement, length, and a table that is not level.

bearing_friction     Coulomb moment against the turning of each bearing, N m
bearing_stiffness    rotational spring in each bearing, N m/rad
rigid_ends           stiff pieces between bearing axis and free cable, m
rig_compliance       displacement reaching the cable is less by c P, m/N
displacement_offset  added to every displacement (of the pushed steps, or of the mounted one too), m
length_error         stated length over true length, minus 1
in_plane_load        dead load along and across the chord, N/m
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rod.inverse.cause import PLAIN, Cause, Variant
from rod.inverse.prediction import Facts, Model
from rod.support import Support

UNDER_LOAD = "mounted under the load"
"""Setting of a load in the plane: displacement is counted from where the cable lies without force, but under it."""

WITH_FORCE = "that grows with the force"
"""Label of the friction of a bearing without preload: Coulomb's, by the measured force."""


BY_STEP, SCATTER = "differing from step to step", 0.3
"""Label of friction that differs, and by which share of it (standard deviation) beforehand: an assumption."""

UNEQUAL = "of another moment at each bearing"
"""Label of bearings that rub differently: how much goes to the left one is tuned, from all to nothing."""

EACH = "of each bearing"
"""Setting of what each bearing has of its own."""

SIDES = ("at the left bearing", "at the right bearing")
"""Labels of what one bearing has: a dirty one, a clamp, a cable that is led in."""


def _at_bearings(model: Model, variant: Variant, change: Callable[[Support], Support]) -> Model:
    """The model with both bearings changed, or the one that the label of the form names."""
    bending, one = model.bending, variant.label in SIDES
    left = bending.left if one and variant.label != SIDES[0] else change(bending.left)
    right = bending.right if one and variant.label != SIDES[1] else change(bending.right)
    return replace(model, bending=replace(bending, left=left, right=right))


def each_bearing(form: Variant) -> tuple[Variant, ...]:
    """A form at either bearing, which need not be alike."""
    return tuple(replace(form, label=side, setting=EACH, component=True, rare=True) for side in SIDES)


class BearingFriction(Cause):
    """``bearing_friction``: Coulomb moment in each bearing."""

    name = "bearing_friction"
    unit = "N m"
    sign = 1
    seat = "rig"

    def plausible(self, facts: Facts) -> float:
        """Three percent of the largest moment."""
        return 0.03 * facts.moment_scale

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Both bearings alike, slipping at once or only after they have been turned by some angle; or each by itself.

        The friction of a seal is one moment, that of a journal grows with the force on it.
        """
        turned = Variant(at=0.03, tuned=("at",), at_range=(0.001, 0.1), by_factors=True)
        unequal = replace(turned, label=UNEQUAL, tuned=("at", "width"), width_range=(-1.0, 1.0), rare=True)
        return (
            Variant("that slips at once"),
            Variant(WITH_FORCE),
            replace(turned, label="that yields before it slips"),
            replace(unequal, width=0.5),
            replace(unequal, width=-0.5),
        )

    def by_step(self, amount: float, facts: Facts) -> tuple[tuple[Variant, ...], ...]:
        """Both bearings alike, or each by itself."""
        alike, opposed = (
            tuple(Variant(BY_STEP, at=float(k), width=width, known=SCATTER) for k in facts.pushed)
            for width in (1.0, -1.0)
        )
        return alike, (*alike, *opposed)

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Give both bearings the Coulomb moment ``amount``, reached after a turn of ``at`` rad where that is not 0.

        Where they are `UNEQUAL` that is the mean, and the left one has the share ``width`` of it more. A moment that
        grows with the force is ``amount`` at the largest force. A form of `by_step` raises the left bearing's moment at
        the step ``at`` by the share ``amount`` over the plausible amount, the right one's by ``width`` times that.
        """
        bending = model.bending
        if variant.label in (WITH_FORCE, BY_STEP):
            steps = len(facts.branch)
            before = np.zeros((steps, 2)) if bending.friction_by_step is None else bending.friction_by_step
            if variant.label == WITH_FORCE:
                more = amount * facts.force_share[:, None]
            else:
                ends = np.array([bending.left.friction_moment, bending.right.friction_moment])
                share = amount / self.plausible(facts) * np.array([1.0, variant.width])
                more = np.eye(steps)[int(variant.at)][:, None] * share * (ends + before)
            return replace(model, bending=replace(bending, friction_by_step=before + more))
        angle, apart = variant.at or bending.left.stick_angle, variant.width if variant.label == UNEQUAL else 0.0
        left, right = (
            replace(end, friction_moment=part * amount, stick_angle=angle)
            for end, part in ((bending.left, 1.0 + apart), (bending.right, 1.0 - apart))
        )
        return replace(model, bending=replace(bending, left=left, right=right))


class BearingStiffness(Cause):
    """``bearing_stiffness``: rotational spring in each bearing, or in one."""

    name = "bearing_stiffness"
    unit = "N m/rad"
    sign = 1
    seat = "rig"

    def plausible(self, facts: Facts) -> float:
        """A twentieth of the cable's own stiffness EI/L."""
        return 0.05 * facts.moment_scale / facts.curvature_scale / facts.length

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Both bearings alike, or each a spring of its own; seals stiffen or yield with their turn (`rod.support`)."""
        stiffening = Variant("that stiffens with the turn", width=6.0, tuned=("width",), width_range=(0.0, 20.0))
        yielding = Variant("that yields with the turn", width=-20.0, tuned=("width",), width_range=(-200.0, 0.0))
        return (Variant(), stiffening, yielding, *each_bearing(Variant()))

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Give the bearings the spring ``amount``, at rest."""
        return _at_bearings(
            model, variant, lambda end: replace(end, stiffness=end.stiffness + amount, hardening=variant.width)
        )


class RigidEnds(Cause):
    """``rigid_ends``: stiff pieces between bearing axis and free cable."""

    name = "rigid_ends"
    unit = "m"
    sign = 1
    limited = True
    seat = "rig"

    def plausible(self, facts: Facts) -> float:
        """Two percent of the length."""
        return 0.02 * facts.length

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Both ends alike, or each by itself; long ones too, whose trace points elsewhere than that of short ones."""
        some = Variant(), Variant(trace=10.0)
        return (*some, *(side for form in some for side in each_bearing(form)))

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Make ``amount`` of the cable at the ends stiff; at most a fifth of its length."""
        piece = min(max(amount, 0.0), 0.2 * facts.length)
        return _at_bearings(model, variant, lambda end: replace(end, rigid_length=end.rigid_length + piece))


class RigCompliance(Cause):
    """``rig_compliance``: the frame yields."""

    name = "rig_compliance"
    unit = "m/N"
    sign = 1
    limited = True
    seat = "rig"

    def plausible(self, facts: Facts) -> float:
        """Two percent of the travel lost at the largest force."""
        return 0.02 * facts.travel / facts.force_scale

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """In proportion to the force, or softer first: joints close and pads flatten (Hertz: the force to the 2/3)."""
        stiffening = Variant("that stiffens with the force", at=1.0, tuned=("at",), at_range=(0.1, 10.0))
        return (Variant("in proportion to the force"), stiffening)

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Let the rig yield by ``amount`` per force at the largest one, and ``1 + at`` times as easily at none."""
        compliance, stiffening = amount * (1.0 + variant.at), variant.at / facts.force_scale
        return replace(model, bending=replace(model.bending, compliance=compliance, stiffening=stiffening))


class DisplacementOffset(Cause):
    """``displacement_offset``: the zero of the displacement is wrong."""

    name = "displacement_offset"
    unit = "m"
    seat = "rig"

    def plausible(self, facts: Facts) -> float:
        """Two percent of the travel."""
        return 0.02 * facts.travel

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Offset of the pushed steps; where there is a mounted step, also one that includes it.

        A mounted cable is force-free wherever the zero of the rig lies.
        """
        if "mounted" not in facts.branch:
            return PLAIN
        return (Variant("between the mounted position and the first step"), Variant("at every step", at=1.0))

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Add ``amount`` to the displacements."""
        moved = np.array([1.0 if branch != "mounted" or variant.at > 0.5 else 0.0 for branch in facts.branch])
        return replace(model, shift=model.shift + amount * moved)


class LengthError(Cause):
    """``length_error``: the stated length is not the cable's."""

    name = "length_error"
    unit = "-"
    seat = "rig"

    def plausible(self, facts: Facts) -> float:
        """One percent."""
        return 0.01

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Shorten the cable by ``1 + amount``, to no less than a tenth."""
        length = model.bending.length / max(1.0 + amount, 0.1)
        return replace(model, bending=replace(model.bending, length=length))


class InPlaneLoad(Cause):
    """``in_plane_load``: distributed load in the plane."""

    name = "in_plane_load"
    unit = "N/m"
    seat = "rig"

    def plausible(self, facts: Facts) -> float:
        """Two percent of the largest force, spread over the length."""
        return 0.02 * facts.force_scale / facts.length

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Along and across the chord, the components of a load in any direction, with either zero of the displacement.

        Displacement counts from the chord of the mounted cable, which was measured under the load or without it.
        """
        return (
            Variant("along the chord", component=True),
            Variant("across the chord", at=1.0, component=True),
            Variant("along the chord, mounted under it", setting=UNDER_LOAD, component=True),
            Variant("across the chord, mounted under it", at=1.0, setting=UNDER_LOAD, component=True),
        )

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Load the cable along (``at`` 0) or across (``at`` 1) the chord by ``amount``; a second keeps the zero."""
        bending, (along, across) = model.bending, model.bending.load
        load = (along, across + amount) if variant.at > 0.5 else (along + amount, across)
        zero = "loaded" if variant.setting == UNDER_LOAD and bending.load == (0.0, 0.0) else bending.zero
        return replace(model, bending=replace(bending, load=load, zero=zero))

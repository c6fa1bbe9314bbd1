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

from dataclasses import dataclass, replace

import numpy as np

from pipeline.diagnosis.causes.cause import FORCE_FREE_PHOTO, PLAIN, UNLOADING, Variant
from pipeline.diagnosis.observations.prediction import Facts, Model

UNDER_LOAD = "mounted under the load"
"""Setting of a load in the plane: displacement is counted from where the cable lies without force, but under it."""


@dataclass(frozen=True)
class BearingFriction:
    """``bearing_friction``: Coulomb moment in each bearing."""

    name: str = "bearing_friction"
    unit: str = "N m"
    sign: int = 1
    combines: bool = False
    additive: bool = False
    limited: bool = False
    seat: str = "rig"
    needs: str = "an unloading branch or a force-free photo"
    summary: str = "The bearings turn with a constant friction moment, against their turning direction."
    sign_means: str = "Coulomb moment of each bearing"
    apart: str = (
        "It changes sign when the bearing turns back, and bends the cable's ends, where friction between the wires has "
        "nothing to do. Loading alone cannot show it: it is then a shift of K0."
    )
    remedy: str = "Unload in the same steps; clean, oil or replace the bearings; tap the rig before each photo."
    settled_by: str = UNLOADING

    def plausible(self, facts: Facts) -> float:
        """Three percent of the largest moment."""
        return 0.03 * facts.moment_scale

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Both bearings alike, slipping at once or only after they have been turned by some angle."""
        yielding = Variant("that yields before it slips", at=0.03, tuned=("at",), at_range=(0.004, 0.1))
        return (Variant("that slips at once"), yielding)

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Give both bearings the Coulomb moment ``amount``, reached after a turn of ``at`` rad where that is not 0."""
        bending = model.bending
        angle = variant.at or bending.left.stick_angle
        left = replace(bending.left, friction_moment=amount, stick_angle=angle)
        right = replace(bending.right, friction_moment=amount, stick_angle=angle)
        return replace(model, bending=replace(bending, left=left, right=right))


@dataclass(frozen=True)
class BearingStiffness:
    """``bearing_stiffness``: rotational spring in each bearing."""

    name: str = "bearing_stiffness"
    unit: str = "N m/rad"
    sign: int = 1
    combines: bool = False
    additive: bool = False
    limited: bool = False
    seat: str = "rig"
    needs: str = "photos at several steps"
    summary: str = "The bearings spring back: a moment that grows with their turn, from the mounted position."
    sign_means: str = "spring of each bearing"
    apart: str = "It grows with the turn of the ends and is gone with it; friction keeps its size and changes sign."
    remedy: str = "Look for a cable clamped under twist, a seal, or a lead that drags at the bearing."
    settled_by: str = "turning the empty bearing by hand with a gauge"

    def plausible(self, facts: Facts) -> float:
        """A twentieth of the cable's own stiffness EI/L."""
        return 0.05 * facts.moment_scale / facts.curvature_scale / facts.length

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """One form: both bearings alike."""
        return PLAIN

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Give both bearings the spring ``amount``."""
        bending = model.bending
        left = replace(bending.left, stiffness=bending.left.stiffness + amount)
        right = replace(bending.right, stiffness=bending.right.stiffness + amount)
        return replace(model, bending=replace(bending, left=left, right=right))


@dataclass(frozen=True)
class RigidEnds:
    """``rigid_ends``: stiff pieces between bearing axis and free cable."""

    name: str = "rigid_ends"
    unit: str = "m"
    sign: int = 1
    combines: bool = False
    additive: bool = False
    limited: bool = True
    seat: str = "rig"
    needs: str = "photos that show the cable near its ends"
    summary: str = "Clamps hold the cable's ends straight: a piece between bearing axis and free cable does not bend."
    sign_means: str = "length of the stiff piece at each end"
    apart: str = "Straight pieces next to the bearings, in every photo alike; a soft middle shows no straight ends."
    remedy: str = "Measure the clamp; give the free length and mount the cable so that it bends up to the axis."
    settled_by: str = "a ruler on the clamp"

    def plausible(self, facts: Facts) -> float:
        """Two percent of the length."""
        return 0.02 * facts.length

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """One form: both ends alike. Its trace grows with more than the square of the length, so a large one counts.

        At twice the plausible size it points elsewhere than at a fifth: 4.8 mm scored 0.8 and removed 32.
        """
        return (Variant(), Variant(trace=10.0))

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Make ``amount`` of the cable at both ends stiff; at most a fifth of its length."""
        bending, piece = model.bending, min(max(amount, 0.0), 0.2 * facts.length)
        left, right = replace(bending.left, rigid_length=piece), replace(bending.right, rigid_length=piece)
        return replace(model, bending=replace(bending, left=left, right=right))


@dataclass(frozen=True)
class RigCompliance:
    """``rig_compliance``: the frame yields."""

    name: str = "rig_compliance"
    unit: str = "m/N"
    sign: int = 1
    combines: bool = False
    additive: bool = False
    limited: bool = True
    seat: str = "rig"
    needs: str = "photographed chords beside the displacement log"
    summary: str = "The frame or the drive yields under force: less of the displacement reaches the cable."
    sign_means: str = "displacement lost per force"
    apart: str = (
        "What is lost follows the force, so it comes back on unloading; an offset is the same at every step. The "
        "forces of a soft cable hardly change from step to step: then the two are twins."
    )
    remedy: str = "Use the photographed chord instead of the log; stiffen the drive."
    settled_by: str = "a stiff bar in place of the cable, pushed to the same force"

    def plausible(self, facts: Facts) -> float:
        """Two percent of the travel lost at the largest force."""
        return 0.02 * facts.travel / facts.force_scale

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """One form."""
        return PLAIN

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Let the rig yield by ``amount`` per force."""
        return replace(model, bending=replace(model.bending, compliance=model.bending.compliance + amount))


@dataclass(frozen=True)
class DisplacementOffset:
    """``displacement_offset``: the zero of the displacement is wrong."""

    name: str = "displacement_offset"
    unit: str = "m"
    sign: int = 0
    combines: bool = False
    additive: bool = False
    limited: bool = False
    seat: str = "rig"
    needs: str = "photographed chords beside the displacement log"
    summary: str = "The displacement was not zero where the log says so: play in the drive, or zeroed under force."
    sign_means: str = "positive: the cable is pushed further than the log says"
    apart: str = "The same at every step, whatever the force; a yielding rig loses in proportion to the force."
    remedy: str = "Use the photographed chord; zero the log on the force-free, mounted cable."
    settled_by: str = FORCE_FREE_PHOTO

    def plausible(self, facts: Facts) -> float:
        """Two percent of the travel."""
        return 0.02 * facts.travel

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Of the pushed steps, and where there is a mounted step, of that one too."""
        pushed = Variant("between the mounted position and the first step")
        return (pushed, Variant("at every step", at=1.0)) if "mounted" in facts.branch else PLAIN

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Add ``amount`` to the displacements."""
        moved = np.array([1.0 if branch != "mounted" or variant.at > 0.5 else 0.0 for branch in facts.branch])
        return replace(model, shift=model.shift + amount * moved)


@dataclass(frozen=True)
class LengthError:
    """``length_error``: the stated length is not the cable's."""

    name: str = "length_error"
    unit: str = "-"
    sign: int = 0
    combines: bool = False
    additive: bool = False
    limited: bool = False
    seat: str = "rig"
    needs: str = "photos with a known scale"
    summary: str = "The stated cable length is not the length between the bearing axes."
    sign_means: str = "positive: the stated length is larger than the true one"
    apart: str = (
        "The photographed length is off, the change of the chord from step to step is right; a wrong scale spoils both."
    )
    remedy: str = "Measure the length between the bearing axes on the mounted cable."
    settled_by: str = "a tape measure"

    def plausible(self, facts: Facts) -> float:
        """One percent."""
        return 0.01

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """One form."""
        return PLAIN

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Shorten the cable by ``1 + amount``; less than a tenth of a cable is never stated (a slip of the point)."""
        length = model.bending.length / max(1.0 + amount, 0.1)
        return replace(model, bending=replace(model.bending, length=length))


@dataclass(frozen=True)
class InPlaneLoad:
    """``in_plane_load``: distributed load in the plane."""

    name: str = "in_plane_load"
    unit: str = "N/m"
    sign: int = 0
    combines: bool = True
    additive: bool = False
    limited: bool = False
    seat: str = "rig"
    needs: str = "photos at several steps"
    summary: str = "A load acts along the cable in the plane of the test: its weight on a tilted table, or a draught."
    sign_means: str = "positive: toward the right bearing (along) or toward the bow (across)"
    apart: str = (
        "It matters less the larger the force; a varying pre-curvature or stiffness goes "
        "with the cable when that is turned end for end, a tilted table does not."
    )
    remedy: str = "Level the table; turn the cable end for end to check."
    settled_by: str = "a spirit level on the table"

    def plausible(self, facts: Facts) -> float:
        """Two percent of the largest force, spread over the length."""
        return 0.02 * facts.force_scale / facts.length

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Along and across the chord, both with either zero: a load at an angle is a sum of the two.

        Displacement counts from the mounted, force-free cable. Who mounts it under the load has another chord there
        than who knows it from elsewhere, where the load does not act.
        """
        return (
            Variant("along the chord"),
            Variant("across the chord", at=1.0),
            Variant("along the chord, mounted under it", setting=UNDER_LOAD),
            Variant("across the chord, mounted under it", at=1.0, setting=UNDER_LOAD),
        )

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Load the cable with ``amount`` along (``at`` 0) or across (``at`` 1) the chord.

        There is one zero of displacement: a component beside another keeps the zero that is there.
        """
        bending, (along, across) = model.bending, model.bending.load
        load = (along, across + amount) if variant.at > 0.5 else (along + amount, across)
        zero = "loaded" if variant.setting == UNDER_LOAD and bending.load == (0.0, 0.0) else bending.zero
        return replace(model, bending=replace(bending, load=load, zero=zero))

"""A cable that ends beside the axis of its bearing: photos show it, and the force bends the cable by that lever."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.diagnosis.causes.begun import BEGUN, SHARE, joints
from rod.inverse.cause import Cause, Variant
from rod.inverse.prediction import Facts, Model


class Lever(Cause):
    """The cable ends beside the axis of a bearing, on an arm across it that turns with it: the force has a lever there.

    The arm is a rigid piece before a corner of the cable. ``width`` is 1 where it ends toward the bow, -1 where away.
    """

    name = "unnamed.lever"
    unit = "m"
    seat = "rig"
    sign = 1

    def plausible(self, facts: Facts) -> float:
        """Half a percent of the length: a millimetre of 0.2 m."""
        return 5e-3 * facts.length

    def chance(self, variant: Variant, facts: Facts) -> float:
        """As likely beforehand as one thing that begins."""
        return SHARE / len(BEGUN) / len(self.variants(facts))

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """At either bearing, to either side."""
        return tuple(Variant(side, width=way) for side in ("left", "right") for way in (1.0, -1.0))

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Let the cable end ``amount`` beside an axis."""
        bending, arm, left = model.bending, max(amount, 0.0), variant.label == "left"
        end, count = bending.left if left else bending.right, len(joints(model))
        half_element = 0.5 * bending.rod.free_length / (count - 1)
        corner = variant.width * 0.5 * np.pi / half_element * (np.arange(count) == (0 if left else count - 1))
        moved = replace(bending, length=bending.length + arm, pre_curvature=bending.rod.section.pre_curvature + corner)
        longer = replace(end, rigid_length=end.rigid_length + arm)
        return replace(model, bending=replace(moved, left=longer) if left else replace(moved, right=longer))


LEVER = Lever()

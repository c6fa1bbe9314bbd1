"""What begins between two holds, and is no cause of the catalogue: a cable that rolled, a neighbour that it touched.

pre-curvature   K0 is another one from a hold on: the cable rolled about its axis, or was laid in anew
stiffness       all moments are multiplied by another factor from a hold on: a heater was switched on, a strand broke

It has no name in the catalogue, so what it explains is something else; but f_EI beside it can be told, and since when.
Each hold but the first is a form of its own; what begins then stays as it is, or grows from hold to hold.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.law import multiplied
from rod.inverse.cause import Cause, Variant
from rod.inverse.prediction import Facts, Model

Array = NDArray[np.float64]

GROWS = (("as it begins", 0.0), ("growing", 1.0))
"""Labels of what stays as it begins, and of what grows by as much in every further hold."""


class _Begun(Cause):
    """What is so from one hold on: ``at`` is the index of its step, ``width`` 1 if it grows from then on."""

    seat = "cable"

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """From each hold under load on but the first."""
        since = (Variant(at=float(k), setting=str(k)) for k in facts.pushed[1:])
        return tuple(replace(form, label=label, width=width) for form in since for label, width in GROWS)

    @staticmethod
    def course(variant: Variant, facts: Facts) -> Array:
        """Share (steps,) of what has begun."""
        passed = np.arange(len(facts.branch)) - variant.at
        return np.where(passed < 0.0, 0.0, 1.0 + variant.width * passed)


class OtherRest(_Begun):
    """Another pre-curvature from a hold on."""

    name = "begun.rest"
    unit = "1/m"

    def plausible(self, facts: Facts) -> float:
        """A twentieth of the range of curvatures."""
        return 0.05 * facts.curvature_scale

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Add ``amount`` to K0 from the step ``at`` on."""
        joints, given = len(model.bending.rod.section.pre_curvature), model.bending.grown
        more = amount * np.outer(self.course(variant, facts), np.ones(joints))
        return replace(model, bending=replace(model.bending, grown=more if given is None else given + more))


class OtherStiffness(_Begun):
    """Other moments from a hold on."""

    name = "begun.stiffness"
    unit = "-"

    def plausible(self, facts: Facts) -> float:
        """A twentieth."""
        return 0.05

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Multiply the forces by ``1 + amount`` from the step ``at`` on."""
        factor = 1.0 + amount * self.course(variant, facts)
        return model.observed(multiplied(factor, factor[:, None]))


BEGUN: tuple[Cause, ...] = (OtherRest(), OtherStiffness())

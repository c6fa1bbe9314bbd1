"""What begins between two holds and is no cause of the catalogue: the cable rolled, a strand broke, it slid.

It stays as it is or grows from hold to hold; each hold but the first is a form of its own:

pre-curvature   K0 is another one from a hold on: the cable rolled about its axis, or was laid in anew
stiffness       all moments are multiplied by another factor from a hold on: a heater was switched on, a strand broke
length          less of the cable lies between the axes from a hold on: it slid through a bearing

None has a name in the catalogue, so what it explains is something else; but f_EI beside it can be told, and when it
begins.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from pipeline.diagnosis.causes.law import multiplied
from pipeline.records import Array
from rod.inverse.cause import Cause, Variant
from rod.inverse.prediction import Facts, Model

SHARE = 0.25
"""Of the probability of something else beforehand: of what begins between two holds, and of unknown forces."""

GROWS = (("as it begins", 0.0), ("growing", 1.0))
"""Labels of what stays as it begins, and of what grows by as much in every further hold."""


class Begun(Cause):
    """What is so from one hold on: ``at`` is the index of its step, ``width`` 1 if it grows from then on."""

    seat = "cable"
    known: ClassVar[int] = 2
    """So many first holds under load begin a growth that a cause of the catalogue makes: a drift, a set."""

    def chance(self, variant: Variant, facts: Facts) -> float:
        """Probability beforehand of one of its forms, given that something else acts."""
        return SHARE / len(BEGUN) / len(self.variants(facts))

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """From each hold under load on but the first, and growing from each but the ``known`` ones and the last."""
        since = [Variant(at=float(k), setting=str(k)) for k in facts.pushed]
        begins, grows = (
            [replace(form, label=label, width=width) for form in some]
            for (label, width), some in zip(GROWS, (since[1:], since[self.known : -1]), strict=True)
        )
        return (*begins, *grows)

    @staticmethod
    def course(variant: Variant, facts: Facts) -> Array:
        """Share (steps,) of what has begun."""
        passed = np.arange(len(facts.branch)) - variant.at
        return np.where(passed < 0.0, 0.0, 1.0 + variant.width * passed)


class OtherRest(Begun):
    """Another pre-curvature from a hold on."""

    name = "begun.rest"
    unit = "1/m"

    def plausible(self, facts: Facts) -> float:
        """A twentieth of the range of curvatures."""
        return 0.05 * facts.curvature_scale

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Add ``amount`` to K0 from the step ``at`` on."""
        moved = np.outer(amount * self.course(variant, facts), np.ones_like(joints(model)))
        return with_more(model, "grown", moved)


class OtherStiffness(Begun):
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


class OtherLength(Begun):
    """Less cable between the axes from a hold on."""

    name = "begun.length"
    unit = "m"
    known = 0

    def plausible(self, facts: Facts) -> float:
        """Two thousandths of the length."""
        return 2e-3 * facts.length

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Let ``amount`` slide out from the step ``at`` on; a tenth of the cable is left."""
        slid = np.minimum(amount * self.course(variant, facts), 0.9 * facts.length).tolist()
        return replace(model, bending=replace(model.bending, slid=tuple(slid)))


def joints(model: Model) -> Array:
    """Shares of the length at the joints (n,) of a cable of equal elements."""
    return np.linspace(0.0, 1.0, int(model.bending.elements) + 1)


def with_more(model: Model, name: str, more: Array) -> Model:
    """The model with ``more`` of what its `BendingTest` is given step by step under a name, (steps, ...)."""
    given = getattr(model.bending, name)
    changes: dict[str, Any] = {name: more if given is None else given + more}
    return replace(model, bending=replace(model.bending, **changes))


OTHER_STIFFNESS = OtherStiffness()
BEGUN = (OtherRest(), OTHER_STIFFNESS, OtherLength())

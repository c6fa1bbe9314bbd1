"""What the characteristic may be beyond the base model: its form, friction between the wires, and set.

nonlinear_stiffness  the law of the base model may have any form; a cause in the paper's own two steps alone
hysteresis           wires beside the law that slip one after the other, or all at once (``width`` 0), or give way
                     gradually (see `rod.section.InternalFriction`)
plastic_set          K0 grows with the largest curvature reached, where it was reached; the law moves along or stays
                     (see `rod.section`); or all along the cable, alike or in a half sine, with the largest of all;
                     in proportion, beyond a threshold (``width``), ever more slowly or quickly (``at``, its saturation)
stiffness_drift      all moments are multiplied by 1 + a g(step), g from 0 at the first step to n - 1 at the last

Where nothing but the cable resists, moments multiplied alike multiply the force and leave the shapes as they were.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.diagnosis.causes.load_cell import SETTLING, passed
from pipeline.records import Array
from rod.inverse.cause import Cause, Variant
from rod.inverse.prediction import Facts, Model, Observer, Prediction
from rod.section import InternalFriction, growth

LAW = "nonlinear_stiffness"
"""Name of the cause that is no second one beside another: a further control point of the law is a finer base."""


class NonlinearStiffness(Cause):
    """``nonlinear_stiffness``: the bending stiffness depends on curvature in another way than the model's."""

    name = LAW
    unit = "N m^2"
    seat = "cable"

    def plausible(self, facts: Facts) -> float:
        """Five percent of the stiffness."""
        return 0.05 * facts.moment_scale / facts.curvature_scale

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """No form: the base model's law may have any shape already; see `pipeline.diagnosis.rediscovery`."""
        return ()

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """The model as it is."""
        return model


ONE_BY_ONE, GRADUAL = "one after the other", "that gives way gradually"
"""Labels of the forms of friction: of wires that stick until they slip, and Dahl's."""

WIRES = 6
"""Elements of one form: a smooth loop to one part in seventy of its height."""


class Hysteresis(Cause):
    """``hysteresis``: friction between the wires."""

    name = "hysteresis"
    unit = "N m"
    sign = 1
    combines = True
    additive = True
    limited = True
    seat = "cable"

    def plausible(self, facts: Facts) -> float:
        """A tenth of the largest moment."""
        return 0.1 * facts.moment_scale

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Friction that slips within some share of the range of curvatures, at its end all at once, or gradually.

        A refit says how wires slip one after the other: toward the end, evenly (``width`` 1), or most of them early.
        Sums of the first are loops by Masing's rule, of the second Dahl's. On loading alone both are part of the law.
        """
        # what has not slipped over the whole range is elastic, and no other than the law itself; of what gives way
        # gradually a seventh still sticks once the curvature has changed by twice as much as it decays over
        kinds, scale = ((ONE_BY_ONE, 1.0), (GRADUAL, 0.5)), facts.curvature_scale
        return tuple(
            Variant(
                label,
                at=share * part * scale,
                tuned=("at",) if label == GRADUAL else ("at", "width"),
                at_range=(0.01 * scale, 0.9 * part * scale),
                width_range=(0.0, 2.0),
                of_law=not facts.returns,
            )
            for label, part in kinds
            for share in (0.05, 0.12, 0.25, 0.5, 0.8)
        )

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Friction of half width ``amount`` that has slipped after a curvature change ``at``, beside what there is."""
        gradual, known, spread = variant.label == GRADUAL, model.bending.friction, max(variant.width, 0.0)
        elements = 1 if gradual else WIRES
        friction = InternalFriction(max(amount, 0.0), variant.at, elements, gradual, beside=known, spread=spread)
        return replace(model, bending=replace(model.bending, friction=friction))


FORMS = (
    "with a law that moves along",
    "with a law that stays",
    "alike all along the cable",
    "in a half sine along the cable",
)
"""How K0 grows: where the cable bends, the first two; or with the largest bend anywhere."""


class PlasticSet(Cause):
    """``plastic_set``: K0 grows with the largest curvature reached."""

    name = "plastic_set"
    unit = "1/m per 1/m"
    sign = 1
    limited = True
    seat = "cable"

    def plausible(self, facts: Facts) -> float:
        """A twentieth of the curvature stays."""
        return 0.05

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """A set at each point by its own bend, the law moving along or not; or of the whole cable by its largest bend.

        From the first bend on, or beyond a threshold ``width``, sought from a low and a high one: the misfit has a
        minimum between any two steps. On loading alone a set at each point is part of the law.
        """
        reach = 0.9 * facts.curvature_scale
        plain = Variant(at_range=(-MOST_QUICKENED / reach, MOST_SATURATED / reach), width_range=(0.0, reach))
        late = [replace(plain, width=share * reach, tuned=("width",)) for share in (0.2, 0.5)]
        slows = replace(plain, at=1.0 / reach, width=0.1 * reach, tuned=("at", "width"))
        quickens = replace(plain, at=-1.0 / reach, tuned=("at",))
        return tuple(
            replace(form, label=label, of_law=label in FORMS[:2] and not facts.returns)
            for label in (FORMS if len(facts.bends) else FORMS[:2])
            for form in (plain, *late, slows, quickens)
        )

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Let ``amount`` of the largest excess curvature beyond the threshold stay."""
        threshold, saturation = max(variant.width, 0.0), variant.at
        form = FORMS.index(variant.label)
        if form > 1 and len(facts.bends):
            bends = amount * growth(np.maximum(facts.bends - threshold, 0.0), saturation)[0]
            at = np.concatenate(([0.0], np.cumsum(model.bending.rod.elements)))
            along = np.ones_like(at) if form == 2 else np.sin(np.pi * at)
            return replace(model, bending=replace(model.bending, grown=np.outer(bends, along)))
        grows = replace(model.bending, plastic_rate=amount, law_stays=form == 1, set_threshold=threshold)
        return replace(model, bending=replace(grows, set_saturation=saturation))


MOST_QUICKENED, MOST_SATURATED = 3.0, 10.0
"""Saturation (see `rod.section`), negative and positive, times the reach of the bends up to which it is sought: at the
end it grows twenty times as fast as at first; growth is over in a tenth."""


class StiffnessDrift(Cause):
    """``stiffness_drift``: the stiffness changes from step to step."""

    name = "stiffness_drift"
    unit = "-"
    limited = True
    seat = "cable"

    def plausible(self, facts: Facts) -> float:
        """Five percent over the test: a plastic sheath that warms up by one or two kelvin."""
        return 0.05 / max(len(facts.branch) - 1, 1)

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """A steady, settling (``width`` above 0) or accelerating change, from step to step or in holds (``at`` 1)."""
        form = replace(SETTLING, label="from step to step")
        if len(facts.branch) < 3:
            return ()
        return (form, replace(form, label="steadily, also in the holds", at=1.0)) if facts.timed else (form,)

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Multiply the forces of step k by ``1 + amount g(k)``."""
        count = len(facts.branch)
        begin, pace = np.linspace(0.0, 1.0, count), 0.0  # shares of the test, and of it per second
        if variant.at > 0.5:
            begin, pace = facts.clock / facts.clock[-1], 1.0 / facts.clock[-1]
        change = amount * (count - 1)
        photo = 1.0 + change * passed(begin + pace * facts.photo_time, variant.width)
        held = [
            1.0 + change * passed(first + pace * times, variant.width)
            for first, times in zip(begin, facts.hold_times, strict=True)
        ]
        return model.observed(multiplied(photo, held))


def multiplied(photo: Array, held: Sequence[Array] | Array) -> Observer:
    """Observer of moments that are multiplied alike everywhere: forces at the photos (n,), and samples by hold."""

    def observer(prediction: Prediction, facts: Facts) -> Prediction:
        samples = tuple(factor * force for factor, force in zip(held, prediction.samples, strict=True))
        return replace(prediction, force=photo * prediction.force, samples=samples)

    return observer

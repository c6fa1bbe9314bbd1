"""What acts on the cable and is no cause of the catalogue: it rolled, a strand broke, something touches it.

Three things may begin between two holds, and stay as they are or grow from hold to hold; each hold but the first is a
form of its own:

pre-curvature   K0 is another one from a hold on: the cable rolled about its axis, or was laid in anew
stiffness       all moments are multiplied by another factor from a hold on: a heater was switched on, a strand broke
length          less of the cable lies between the axes from a hold on: it slid through a bearing

And forces may act that no model has, with moments that come and go over the steps, from the first or a later one
on, as cosines of order o, normal about nothing, of a standard deviation that falls with 1 / (1 + o):

moments         at one bearing or both (a stop, a cable that is led in), falling to nothing at the other; or along the
                cable (a pad, a magnet, a tether): loads of one to four half waves, as likely each, have moments
                M'' = q that fall with the square of their number

A moment M at a place bends the cable there as a rest that is moved by M / f_EI does: force and shape are the same. So
they are told as that curvature, 1/m.

None has a name in the catalogue, so what it explains is something else; but f_EI beside it can be told, and where
and when it acts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.law import multiplied
from rod.inverse.cause import Cause, Variant
from rod.inverse.extension import Term
from rod.inverse.prediction import Facts, Model

Array = NDArray[np.float64]

GROWS = (("as it begins", 0.0), ("growing", 1.0))
"""Labels of what stays as it begins, and of what grows by as much in every further hold."""


class _Begun(Cause):
    """What is so from one hold on: ``at`` is the index of its step, ``width`` 1 if it grows from then on."""

    seat = "cable"

    def chance(self, variant: Variant, facts: Facts) -> float:
        """Probability beforehand of one of its forms, given that something else acts."""
        return SHARE / len(BEGUN) / len(self.variants(facts))

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """From each hold under load on but the first; what grows from there is a drift, at the last it only begins."""
        since = [Variant(at=float(k), setting=str(k)) for k in facts.pushed[1:]]
        begins, grows = (
            [replace(form, label=label, width=width) for form in some]
            for (label, width), some in zip(GROWS, (since, since[1:-1]), strict=True)
        )
        return (*begins, *grows)

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
        return _with_rest(model, amount * self.course(variant, facts), np.ones_like)


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


class OtherLength(_Begun):
    """Less cable between the axes from a hold on."""

    name = "begun.length"
    unit = "m"

    def plausible(self, facts: Facts) -> float:
        """Two thousandths of the length."""
        return 2e-3 * facts.length

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Let ``amount`` slide out from the step ``at`` on; a tenth of the cable is left."""
        slid = np.minimum(amount * self.course(variant, facts), 0.9 * facts.length).tolist()
        return replace(model, bending=replace(model.bending, slid=tuple(slid)))


class OtherMoments(Cause):
    """Moments over the steps: the label says along what of the cable.

    ``at`` is the order of their course, ``width`` the index of the step from which on they act.
    """

    name = "unnamed.moments"
    unit = "1/m"
    seat = "rig"

    def plausible(self, facts: Facts) -> float:
        """The range of curvatures, of which shares are tried."""
        return facts.curvature_scale

    def chance(self, variant: Variant, facts: Facts) -> float:
        """Probability beforehand of one place, size and begin, given that something else acts."""
        begins = max(len(facts.pushed) - 1, 1) if variant.width else 1
        return 0.5 * SHARE / len(PLACES) / len(SIZES) / begins

    def ways(self, facts: Facts) -> Iterator[tuple[Term, ...]]:
        """The terms of each place where such moments may act, in each size."""
        for forms in PLACES.values():
            for size in SIZES:
                orders = range(len(facts.branch))
                known = {(form, o): size * MOST[form] / (1 + o) for o in orders for form in forms}
                every = (Variant(form, at=float(o), known=std) for (form, o), std in known.items())
                yield tuple(Term(self, variant) for variant in every)

    def since(self, terms: Sequence[Term], facts: Facts) -> Iterator[tuple[Term, ...]]:
        """The same moments, from each step under load but the first on."""
        for first in facts.pushed[1:]:
            later = (term._replace(variant=replace(term.variant, width=float(first))) for term in terms)
            yield tuple(term for term in later if term.variant.at < len(facts.branch) - first)

    @staticmethod
    def course(variant: Variant, facts: Facts) -> Array:
        """Share (steps,) of the amount."""
        first, course = int(variant.width), np.zeros(len(facts.branch))
        count = len(course) - first
        course[first:] = np.cos(np.pi * variant.at * (np.arange(count) + 0.5) / count)
        return course

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Move the rest by ``amount`` along a form, as its course says."""
        return _with_rest(model, amount * self.course(variant, facts), FORMS[variant.label])

    def together(self, forms: Sequence[Variant], facts: Facts) -> tuple[str, Array]:
        """Curvature at every step, for one form along the cable after the other."""
        labels = dict.fromkeys(form.label for form in forms)
        rows = [[self.course(form, facts) * (form.label == label) for form in forms] for label in labels]
        return self.unit, np.concatenate(np.array(rows).swapaxes(1, 2))


def _half_waves(k: int, u: Array) -> Array:
    return np.asarray(np.sin(k * np.pi * u))


WAVES = {f"{k} half waves": partial(_half_waves, k) for k in (1, 2, 3, 4)}
FORMS: dict[str, Callable[[Array], Array]] = {"left": lambda u: 1.0 - u, "right": lambda u: u, **WAVES}
MOST = {"left": 1.0, "right": 1.0} | {label: wave.args[0] ** -2.0 for label, wave in WAVES.items()}
"""Forms of unknown moments along the cable, and how large each is beside the others."""

PLACES = {
    "unnamed.left": ("left",),
    "unnamed.right": ("right",),
    "unnamed.both": ("left", "right"),
    "unnamed.along": (*WAVES,),
}
"""Where unknown moments act, as it is told, and in which forms."""

SIZES = (0.003, 0.01, 0.03)
"""Of the range of curvatures, their standard deviation: steps of a factor 3.3, over which a normal density hardly
changes, from what is just seen to what is another experiment."""

SHARE = 0.25
"""Of the probability of something else beforehand: of what begins between two holds, and of unknown moments."""


def _with_rest(model: Model, by_step: Array, form: Callable[[Array], Array]) -> Model:
    """The model whose rest is moved at each step (steps,), 1/m, along a form over shares of the length."""
    joints, given = len(model.bending.rod.section.pre_curvature), model.bending.grown
    more = np.outer(by_step, form(np.linspace(0.0, 1.0, joints)))
    return replace(model, bending=replace(model.bending, grown=more if given is None else given + more))


BEGUN = (OtherRest(), OtherStiffness(), OtherLength())
MOMENTS = OtherMoments()
UNNAMED: tuple[_Begun | OtherMoments, ...] = (*BEGUN, MOMENTS)

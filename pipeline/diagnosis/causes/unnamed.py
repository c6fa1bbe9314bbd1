"""What pushes or bends the cable and is no cause of the catalogue: something touches it, holds it, leads it in.

Forces may act that no model has, as they come and go over the steps, from the first or a later one on, as cosines
of order o, normal about nothing, of a standard deviation that falls with 1 / (1 + o):

moments         at one bearing or both: a stop, a cable that is led in
forces          at a place, across the chord, and along it as well where that is likelier: a support without friction
                pushes along the normal of the cable, a tether wherever it is tied to
bends           all along the cable, by moments in half waves: loads of one to four half waves, as likely each (a pad, a
                magnet, a table that rubs), have moments M'' = q that fall with the square of their number. A moment M
                bends the cable as a rest that is moved by M / f_EI does, and is told as that curvature
readings        on the load cell alone: a spring, a bellows or a stop beside the cable, which bears or adds a force

Or the cable ends beside the axis of its bearing (`lever`), as photos show, and the force bends it by that.

None has a name in the catalogue, so what it explains is something else; but f_EI beside it can be told, and where
and when it acts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from pipeline.diagnosis.causes.begun import BEGUN, SHARE, Begun, joints, with_more
from pipeline.diagnosis.causes.lever import LEVER, Lever
from pipeline.records import Array
from rod.inverse.cause import Cause, Variant
from rod.inverse.extension import Term
from rod.inverse.fit import Fit
from rod.inverse.prediction import Facts, Model, Prediction

SIZES = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Of the largest force, moment or bend, their standard deviation: steps of a factor 3.3, over which a normal density
hardly changes, from what is just seen to what is another experiment."""

WAVES = {f"{k} half waves": float(k) for k in (1, 2, 3, 4)}
"""Forms of moments along the cable, and the number of their half waves."""

POINTS = {f"{u:.1f}": u for u in (0.1, 0.3, 0.5, 0.7, 0.9)}
"""Shares of the length near which one may act."""

ALONG = "along the chord"
"""Setting of forces that act so."""


class _Unknown(Cause):
    """Forces or moments over the steps: the label says where on the cable.

    ``at`` is the order of their course, ``width`` the index of the step from which on they act.
    """

    seat = "rig"
    adds = True
    places: ClassVar[dict[str, tuple[str, ...]]]

    def chance(self, variant: Variant, facts: Facts) -> float:
        """Probability beforehand of one place, size and begin, given that something else acts."""
        begins = max(len(facts.pushed) - 1, 1) if variant.width else 1
        return 0.5 * SHARE / len(UNKNOWN) / len(self.places) / len(SIZES) / begins

    def ways(self, facts: Facts, labels: Sequence[str], size: float) -> tuple[Term, ...]:
        """The terms of forces or moments at all of these places together, of one of `SIZES`."""
        orders = range(len(facts.branch))
        return of_size([Term(self, Variant(label, at=float(o))) for o in orders for label in labels], size)

    def freer(self, terms: Sequence[Term]) -> Iterator[tuple[Term, ...]]:
        """The same ones with more beside them; none where there is no more."""
        return iter(())

    def since(self, terms: Sequence[Term], facts: Facts) -> Iterator[tuple[Term, ...]]:
        """The same ones, from each step under load but the first on."""
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

    def together(self, forms: Sequence[Variant], facts: Facts) -> tuple[str, Array]:
        """Force or moment at every step, for one form along the cable after the other."""
        labels = dict.fromkeys(form.label for form in forms)
        own = [[form.label == label and form.setting != ALONG for form in forms] for label in labels]
        rows = [[self.course(form, facts) * one for form, one in zip(forms, some, strict=True)] for some in own]
        return self.unit, np.concatenate(np.array(rows).swapaxes(1, 2))


class UnknownMoments(_Unknown):
    """Moments at one bearing or both."""

    name = "unnamed.moments"
    unit = "N m"
    places: ClassVar = {"unnamed.left": ("left",), "unnamed.right": ("right",), "unnamed.both": ("left", "right")}

    def plausible(self, facts: Facts) -> float:
        """The largest moment, of which shares are tried."""
        return facts.moment_scale

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Bend an end of the cable by ``amount``, as its course says."""
        more = amount * np.outer(self.course(variant, facts), np.array(["left", "right"]) == variant.label)
        return _acting(model, variant, "moments_by_step", more)


class UnknownBends(_Unknown):
    """Moments all along the cable."""

    name = "unnamed.bends"
    unit = "1/m"
    places: ClassVar = {"unnamed.along": (*WAVES,)}

    def plausible(self, facts: Facts) -> float:
        """The range of curvatures, of which shares are tried."""
        return facts.curvature_scale

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Move the rest by ``amount`` along a half wave, as its course says."""
        wave = np.sin(WAVES[variant.label] * np.pi * joints(model))
        return _acting(model, variant, "grown", np.outer(amount * self.course(variant, facts), wave))


class UnknownForces(_Unknown):
    """Forces across the chord at a place."""

    name = "unnamed.forces"
    unit = "N"
    places: ClassVar = {f"unnamed.at {label}": (label,) for label in POINTS}

    def plausible(self, facts: Facts) -> float:
        """The largest force, of which shares are tried."""
        return facts.force_scale

    def ways(self, facts: Facts, labels: Sequence[str], size: float) -> tuple[Term, ...]:
        """The terms of forces near a place, and where they act."""
        return *super().ways(facts, labels, size), Term(PLACE, Variant(labels[0], known=1.0))

    def freer(self, terms: Sequence[Term]) -> Iterator[tuple[Term, ...]]:
        """The same ones, and as many along the chord; what says where they act stays the last one."""
        *across, place = terms
        along = (term._replace(variant=replace(term.variant, setting=ALONG)) for term in across)
        yield *across, *along, place

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Push the cable by ``amount``, as its course says."""
        force = np.outer(amount * self.course(variant, facts), _at(POINTS[variant.label], joints(model)))
        way = np.array([1.0, 0.0] if variant.setting == ALONG else [0.0, 1.0])
        return _acting(model, variant, "forces_by_step", force[:, :, None] * way)


class UnknownReadings(_Unknown):
    """Forces that the load cell shows and the cable does not have."""

    name = "unnamed.readings"
    unit = "N"
    seat = "load cell"
    places: ClassVar = {"unnamed.cell": ("cell",)}

    def plausible(self, facts: Facts) -> float:
        """The largest force, of which shares are tried."""
        return facts.force_scale

    @staticmethod
    def course(variant: Variant, facts: Facts) -> Array:
        """Share (steps,) of the amount, by the displacement: what stands beside the cable knows no steps."""
        first = facts.displacement[int(variant.width)] if variant.width else facts.displacement.min()
        passed = facts.displacement - first
        share = np.clip(passed / max(passed.max(), 1e-12), 0.0, 1.0)
        return np.where(passed >= 0.0, np.cos(np.pi * variant.at * share), 0.0)

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Add ``amount`` to the readings, as its course says."""
        more = amount * self.course(variant, facts)

        def observer(prediction: Prediction, facts: Facts) -> Prediction:
            samples = tuple(one + force for one, force in zip(more, prediction.samples, strict=True))
            return replace(prediction, force=prediction.force + more, samples=samples)

        return model.observed(observer)


class PlaceOfForce(Cause):
    """Where near the place of its label the force acts that is in the model: so far beside it."""

    name = "unnamed.place"
    unit = "-"
    seat = "rig"

    def plausible(self, facts: Facts) -> float:
        """Half of the distance of two places."""
        return 0.5 / len(POINTS)

    def chance(self, variant: Variant, facts: Facts) -> float:
        """That of the force is all there is."""
        return 1.0

    @staticmethod
    def course(variant: Variant, facts: Facts) -> Array:
        """The same at all steps."""
        return np.ones(len(facts.branch))

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Let the forces act at ``amount`` (of the length) beyond their place."""
        forces, places = model.bending.forces_by_step, joints(model)
        whole = np.zeros((1, 2)) if forces is None else forces.sum(axis=1)
        moved = whole[:, None, :] * _at(POINTS[variant.label] + amount, places)[:, None]
        return replace(model, bending=replace(model.bending, forces_by_step=moved))


def carried_over(terms: Sequence[Term], known: Sequence[Term], amounts: Array, facts: Facts) -> Array:
    """Amounts (k,) of terms that make what others of given ``amounts`` make at each step; none of what these lack."""

    def course_of(term: Term) -> Array:
        assert isinstance(term.cause, _Unknown | PlaceOfForce)
        return term.cause.course(term.variant, facts)

    start = np.zeros(len(terms))
    of = [[(term.cause, term.variant.label, term.variant.setting) for term in some] for some in (terms, known)]
    for one in dict.fromkeys(of[0]):
        own, old = ([k for k, other in enumerate(some) if other == one] for some in of)
        made = sum((amounts[k] * course_of(known[k]) for k in old), np.zeros(len(facts.branch)))
        start[own] = np.linalg.lstsq(np.column_stack([course_of(terms[k]) for k in own]), made, rcond=None)[0]
    return start


def _acting(model: Model, variant: Variant, name: str, more: Array) -> Model:
    """`with_more`; what acts from the first step on was there at the mounting: zero is the chord under it."""
    known = model if variant.width else replace(model, bending=replace(model.bending, zero="loaded"))
    return with_more(known, name, more)


def _weight(term: Term) -> float:
    """Standard deviation of an amount for one of the size, by its order and its half waves."""
    waves = WAVES.get(term.variant.label, 1.0)
    return 1.0 / (waves * waves * (1.0 + term.variant.at))


def of_size(terms: Sequence[Term], size: float) -> tuple[Term, ...]:
    """Forces or moments with amounts known to be of a size; where they act stays as it is known."""
    return tuple(
        term if term.cause is PLACE else term._replace(variant=replace(term.variant, known=size * _weight(term)))
        for term in terms
    )


def size_told(fitted: Fit) -> float:
    """Which of `SIZES` the amounts that were fitted have, in the mean of their squares."""
    at = [k for k, term in enumerate(fitted.extension.terms) if term.cause is not PLACE]
    terms, amounts = [fitted.extension.terms[k] for k in at], np.array([fitted.amount(k) for k in at])
    unit = np.array([_weight(term) * term.cause.plausible(fitted.extension.facts) for term in terms])
    told = float(np.sqrt(np.mean(np.sum(amounts**2, axis=1) / unit**2)))
    return min(SIZES, key=lambda size: abs(math.log(size / told)))


def _at(u: float, joints: Array) -> Array:
    """A force at a share of the length, divided between the two joints (n,) beside it."""
    inside = min(max(u, joints[1]), joints[-2])
    return np.asarray(np.maximum(1.0 - np.abs(joints - inside) / joints[1], 0.0))


PLACE = PlaceOfForce()
Unknown = UnknownMoments | UnknownForces | UnknownBends | UnknownReadings
UNKNOWN: tuple[Unknown, ...] = (UnknownMoments(), UnknownForces(), UnknownBends(), UnknownReadings())
UNNAMED: tuple[Begun | _Unknown | PlaceOfForce | Lever, ...] = (*BEGUN, LEVER, *UNKNOWN, PLACE)

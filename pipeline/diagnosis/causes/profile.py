"""What changes along the cable: pre-curvature K0(s) and bending stiffness EI(s).

Both are deviations ``amount * phi(s)`` from a uniform cable, ``phi`` of largest absolute value one. It has mean zero,
so the amount is the largest deviation from the mean; only a soft spot counts from the cable beside it, whose stiffness
is the one that is wanted. Forms: growing along the cable, more (or less) in the middle than at the
ends, S-shaped, and a spot at a place that is found by scanning. Several forms may add up.

What is none of these (a kink, several bumps) is a sum of waves, or a piece of another kind, or a step between two:
`wave` k has k half periods over the cable, and any profile of mean zero is a sum of them. They are no forms to be
suspected, their number would drown a true cause in chance; they take the place of the forms once the cause is known
(`explanations.free_profile`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from pipeline.records import Array
from rod.inverse.cause import Cause, Profile, Variant
from rod.inverse.prediction import Facts, Model

PLACES = (0.15, 0.325, 0.5, 0.675, 0.85)
"""Of spots, shares of the length."""

STEEPEST = 10.0
"""Usual amounts: standard deviation of the longest wave; that of the k-th is a k-th of it, as of a sharp step. Without
a photo of the force-free cable short waves and the law else run away together: 24 waves grew to 1 to 4 1/m."""

SEAM, PIECE = "in a step", "in a piece"

LEAST = 0.05
"""Relative stiffness that no form goes below: a cable without any has no equilibrium."""


def forms() -> tuple[Variant, ...]:
    """Forms of a profile; spots may move and widen in a refit."""
    spots = tuple(
        Variant(
            "in a spot",
            at=place,
            width=0.07,  # a splice or kink of some diameters
            tuned=("at", "width"),
            at_range=(0.03, 0.97),
            width_range=(0.015, 0.2),
        )
        for place in PLACES
    )
    return (
        Variant("growing along the cable"),
        Variant("other in the middle than at the ends", at=2.0),
        Variant("other in one half than in the other", at=3.0),
        *spots,
    )


def step() -> Variant:
    """Two pieces of different kind with a seam between: a splice, or half a cable that was wound otherwise.

    Tried once the cause is known, like a wave. A seam narrower than an element (1/120) looks like one as wide.
    """
    return Variant(
        SEAM,
        at=0.5,
        width=0.02,
        tuned=("at", "width"),
        at_range=(0.05, 0.95),
        width_range=(0.008, 0.15),
    )


def piece() -> Variant:
    """A piece of another kind with two borders: a splice, a sleeve, a repair; half as much at ``width`` off ``at``."""
    return replace(step(), label=PIECE, width=0.1, width_range=(0.02, 0.3))


def wave(half_periods: int) -> Variant:
    """Cosine wave of a profile, one of many that add up; ``at`` is minus its number of half periods.

    Plausible amounts fall with that number as they do for a step; see `STEEPEST`.
    """
    return Variant("in waves", at=-float(half_periods), known=STEEPEST / half_periods)


def profile(variant: Variant, position: Array, *, from_beside: bool = False) -> Array:
    """``phi`` at relative positions 0..1 that sample the cable evenly; a spot ``from_beside`` keeps its mean."""
    if variant.at < 0.0:
        values = np.cos(variant.at * np.pi * position)
    elif variant.label == SEAM:
        values = np.tanh((position - variant.at) / variant.width)
    elif variant.label == PIECE:
        values = np.exp2(-(((position - variant.at) / variant.width) ** 6))
    elif variant.width > 0.0:
        values = np.exp(-0.5 * ((position - variant.at) / variant.width) ** 2)
    elif variant.at == 2.0:
        values = -np.cos(2.0 * np.pi * position)
    elif variant.at == 3.0:
        values = np.sin(2.0 * np.pi * position)
    else:
        values = 2.0 * position - 1.0
    spot = variant.width > 0.0 and variant.label != SEAM
    deviation = values if from_beside and spot else values - np.mean(values)
    return np.asarray(deviation / np.max(np.abs(deviation)))


def forms_between(uniform: Model, varying: Model) -> list[tuple[Variant, float, float]]:
    """The spot, the piece and the step that look most like what varies along the cable.

    Parameters
    ----------
    uniform, varying : Model
        The same cable without and with forms of one of the causes of this module.

    Returns
    -------
    list of (Variant, float, float)
        Form, amount, and by how much (relative) the cable beside it is stiffer. Empty if nothing varies.
    """
    before, after = uniform.bending.rod.section, varying.bending.rod.section
    relative = after.profile is not None
    change = np.asarray(after.pre_curvature - before.pre_curvature if after.profile is None else after.profile - 1.0)
    if before.profile is not None or change.ndim == 0 or not np.ptp(change) > 0.0:
        return []
    position = position_of(varying)
    weight = np.sin(np.pi * position)  # where no moment is, no stiffness shows
    closest = []
    for kind in (forms()[-1], piece(), step()):
        best: tuple[float, Variant, Array] | None = None
        for form in _places(kind):
            columns = np.column_stack([np.ones_like(position), profile(form, position, from_beside=relative)])
            found = np.linalg.lstsq(weight[:, None] * columns, weight * change, rcond=None)[0]
            left = float(np.sum((weight * (change - columns @ found)) ** 2))
            if best is None or left < best[0]:
                best = left, form, np.asarray(found)
        if best is not None and best[2][0] > -1.0:
            beside, amount = (float(value) for value in best[2])
            closest.append((best[1], amount / (1.0 + beside), beside) if relative else (best[1], amount, 0.0))
    return closest


def _places(kind: Variant) -> Iterator[Variant]:
    """A form over the whole cable and of every width."""
    for at in np.linspace(*kind.at_range, 48):
        for width in np.geomspace(*kind.width_range, 12):
            yield replace(kind, at=float(at), width=float(width))


def deviation(uniform: Model, varying: Model, cause: Cause) -> Array:
    """Change (n joints,) of K0 (1/m) or of EI (relative) by a cause of this module."""
    before, after = uniform.bending.rod.section, varying.bending.rod.section
    if isinstance(cause, PreCurvatureVarying):
        return np.asarray(after.pre_curvature - before.pre_curvature)
    return np.asarray(_factor(varying) - _factor(uniform))


def _factor(model: Model) -> Array:
    """Stiffness (n,) at the joints relative to the law."""
    section = model.bending.rod.section
    return np.ones_like(section.pre_curvature) if section.profile is None else section.profile


def largest_of(forms: Sequence[Variant], amounts: Array, covariance: Array, cause: Cause) -> Array:
    """The forms (k,) of a cause where their sum deviates most: the size of the cause is this times their amounts."""
    position, beside = np.linspace(0.0, 1.0, 401), isinstance(cause, StiffnessVarying)
    return largest(
        np.column_stack([profile(form, position, from_beside=beside) for form in forms]), amounts, covariance
    )


def largest(rows: Array, amounts: Array, covariance: Array) -> Array:
    """Row (k,) of ``rows`` (m, k) whose product with amounts of that covariance (k, k) is largest.

    Largest is what lies furthest beyond two standard deviations: where no photo shows the cable, under a cover, waves
    may run far and mean nothing.
    """
    size = np.abs(rows @ amounts)
    std = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", rows, covariance, rows), 0.0))
    return np.asarray(rows[int(np.argmax(size - 2.0 * std))])


def position_of(model: Model) -> Array:
    """Relative position 0..1 of the joints on the free cable."""
    return np.concatenate(([0.0], np.cumsum(model.bending.rod.elements)))


class PreCurvatureVarying(Profile):
    """``pre_curvature_varying``: the cable is bent at rest, but not uniformly."""

    name = "pre_curvature_varying"
    unit = "1/m"
    limited = True
    seat = "cable"

    def plausible(self, facts: Facts) -> float:
        """A change of direction of a tenth of a radian over the cable."""
        return 0.1 / facts.length

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Profiles along the cable."""
        return forms()

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Add ``amount * phi`` to the pre-curvature."""
        rest = model.bending.rod.section.pre_curvature + amount * profile(variant, position_of(model))
        return replace(model, bending=replace(model.bending, pre_curvature=rest))

    def along_cable(self, variant: Variant, model: Model) -> tuple[str, Array]:
        """The pre-curvature."""
        return "pre_curvature", profile(variant, position_of(model))


class StiffnessVarying(Profile):
    """``stiffness_varying``: the cable is not equally stiff everywhere."""

    name = "stiffness_varying"
    unit = "-"
    seat = "cable"

    def plausible(self, facts: Facts) -> float:
        """A tenth."""
        return 0.1

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Profiles along the cable."""
        return forms()

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Multiply the moments by ``1 + amount * phi``; never below a twentieth."""
        given = model.bending.rod.section.profile
        factor = (
            1.0
            + amount * profile(variant, position_of(model), from_beside=True)
            + (0.0 if given is None else given - 1.0)
        )
        return replace(model, bending=replace(model.bending, stiffness_profile=np.maximum(factor, LEAST)))

    def along_cable(self, variant: Variant, model: Model) -> tuple[str, Array]:
        """Change of the relative stiffness per unit of amount; 0 where that is held at its lower limit."""
        moves = profile(variant, position_of(model), from_beside=True)
        return "stiffness_profile", np.where(_factor(model) > LEAST, moves, 0.0)

"""The base model fitted to a test: the start of every inverse problem, with and without causes that extend it.

Strategy: a rough start by what photos show over the moment P y, or a constant; where no force-free photo holds K0,
a start on the other side of straight; in each valley the abscissa of the law laid along the law found, as often as that
brings something (`settled`); the photos' noise by what is faster along the cable than any misfit; and all once more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rod.array import Array
from rod.compliance_law import COEFFICIENTS, ComplianceLaw, refreshed
from rod.inverse.base import ELEMENTS, Base, bent_at_rest, start
from rod.inverse.extension import Extension
from rod.inverse.fit import ITERATIONS, Fit, fit
from rod.inverse.laws import Abscissa, AnyLaw, FreeLaw, over_moments
from rod.inverse.noise import calibrate_photo_noise
from rod.inverse.observation import DISPLACEMENT_STD, SHAPE_FUNCTIONS, Observation, normal_distance, observe
from rod.inverse.prediction import Facts
from rod.measurement import MeasuredTest
from rod.stiffness_law import StiffnessLaw


class BaseFit(NamedTuple):
    """The data with their weights, and the base model fitted to them; ``fitted`` has no prediction where none fits."""

    observation: Observation
    fitted: Fit


def base_fit(
    test: MeasuredTest,
    facts: Facts,
    *,
    begin: tuple[float, float] | None = None,
    elements: int = ELEMENTS,
    functions: int = SHAPE_FUNCTIONS,
    beside: Callable[[Observation, Fit], Fit] = lambda _, fitted: fitted,
    calibrated: bool = True,
    without_photos: frozenset[int] = frozenset(),
    without_forces: frozenset[int] = frozenset(),
) -> BaseFit:
    """Fit the base model.

    Parameters
    ----------
    test : MeasuredTest
    facts : Facts
        Its circumstances.
    begin : (N m^2, 1/m) or None
        Constant EI and K0 to start from instead of what photos show.
    elements : int
        Of the simulated cable.
    functions : int
        Of the shapes that a photo is compared by.
    beside : callable
        A fit with errors besides that data have: valleys of K0 are compared with these. Displacements that are taken
        for exact, and scatter by 50 um, choose one by chance.
    calibrated : bool
        Whether photos are as noisy as they show, or as they say.
    without_photos, without_forces : sets of int
        Indices of steps whose photo or force is not to be trusted.

    Raises
    ------
    ValueError
        If no step has both a photo and a force.
    """
    observation = observe(test, functions=functions, without_photos=without_photos, without_forces=without_forces)

    def begun(side: float | None = None) -> Base:
        base = start(test, facts, exact=DISPLACEMENT_STD, begin=begin, side=side)
        return replace(base, elements=elements)

    valleys = [settled(observation, _first(observation, begun(), facts))]
    if facts.rest_side == "natural" and valleys[0].run.prediction is not None:
        # a cable bent to the other side at rest that has snapped over shows nearly the same shapes under load
        bent = bent_at_rest(test) or abs(valleys[0].pre_curvature)
        for side in (bent, -bent):
            one = settled(observation, _first(observation, begun(side), facts))
            valleys += [one] if one.run.prediction is not None and all(_apart(one, two) for two in valleys) else []
    fitted = valleys[0] if len(valleys) == 1 else min(valleys, key=lambda one: _cost(beside(observation, one)))
    if fitted.run.prediction is None or not observation.photos:
        return BaseFit(observation, fitted)
    if calibrated:
        noise = calibrate_photo_noise(
            [normal_distance(photo.sections, fitted.run.prediction, photo.step) for photo in observation.photos],
            [photo.sections for photo in observation.photos],
            [photo.basis for photo in observation.photos],
        )
        observation = observe(
            test, photo_noise=noise, functions=functions, without_photos=without_photos, without_forces=without_forces
        )
    here = fitted.extension, fitted.vector
    # laid along itself the law moves a little, and a cable that was about to snap over may do so
    again = (fit(observation, *model, near=fitted.run) for model in (laid_along(fitted), here))
    fitted = next((found for found in again if found.run.prediction is not None), fitted)
    return BaseFit(observation, settled(observation, fitted))


def _first(observation: Observation, base: Base, facts: Facts) -> Fit:
    """The best fit from the law and K0 that photos show, or from a constant law where that does not converge."""
    found: list[Fit] = []
    for vector in (base.as_seen(), base.neutral()):
        found.append(fit(observation, Extension(base, facts), vector, iterations=2 * ITERATIONS))
        if found[-1].converged:
            break
    return min(found, key=_cost)


def _apart(one: Fit, other: Fit) -> bool:
    """Whether a fit lies in another minimum: its K0 more than a standard deviation away, or its chi-square lower."""
    at = other.extension.base.pre_curvature_index
    assert at is not None  # only a photo at rest holds it
    apart = (one.pre_curvature - other.pre_curvature) ** 2 > other.covariance[at, at]
    return bool(apart or one.chi2 < other.chi2 - 1.0)


def _cost(fitted: Fit) -> float:
    return fitted.chi2 if fitted.run.prediction is not None else np.inf


PAYS, ATTEMPTS = 1.0, 3
"""Chi-square that a law laid along itself must bring to be laid once more, and how often at most: models are compared
by less than what another abscissa brings."""


def settled(observation: Observation, fitted: Fit, *, hopeless: float = np.inf) -> Fit:
    """Continue a fit that ran out of steps, and lay the abscissa along the law found as long as that brings something.

    It lies along the law that a fit began with, and the law found may have a knee where that one had none. For
    ``hopeless`` see `rod.inverse.fit.fit`.
    """
    for _ in range(ATTEMPTS):
        if fitted.run.prediction is None:
            break
        start = laid_along(fitted) if fitted.converged else (fitted.extension, fitted.vector)
        further = fit(observation, *start, near=fitted.run, hopeless=hopeless)
        gained = fitted.chi2 - _cost(further)
        if gained > 0.0:
            fitted = further
        if gained < PAYS * max(fitted.reduced_chi2, 1.0):
            break
    return fitted


def laid_along(fitted: Fit, over: Abscissa = "bend") -> tuple[Extension, Array]:
    """The model with the abscissa of its law spread along the law found, on the visited range, and its vector there."""
    base, count = fitted.extension.base, fitted.extension.base.law.size
    assert isinstance(base.law, AnyLaw)
    law, visited = law_of(fitted), np.append(fitted.excess, 0.0)
    rise, size = base.law.basis.law(fitted.vector[:count]), count
    if base.law.over != over:
        size = COEFFICIENTS
        assert isinstance(law, StiffnessLaw)
        rise = over_moments(law, visited)
    if over == "moment":
        visited = law.moment(visited, np.zeros(1))
    basis = refreshed(rise, float(visited.min()), float(visited.max()), size=size)
    extension = replace(fitted.extension, base=replace(base, law=AnyLaw(basis, over)))
    return extension, np.r_[basis.projected(rise), fitted.vector[count:]]


def held_to(observation: Observation, fitted: Fit, scatter: float, rig: tuple[float, ...] = ()) -> Fit:
    """A model with displacements under load held to ``scatter`` (m) beyond what the log tells of them.

    What a ``rig`` is off by (`rod.inverse.base.RIG`) is unknown and of that size from now on, where it is given.
    """
    extension, facts = fitted.extension, fitted.extension.facts
    base, pushed, std = extension.base, list(facts.pushed), facts.displacement_std.copy()
    std[pushed] = np.hypot(std[pushed], scatter)
    moved, at, errors = np.flatnonzero(std > DISPLACEMENT_STD), base.moved_at, np.zeros(len(std))
    errors[list(base.moved)] = fitted.vector[at]
    known = rig or base.rig_std
    other = replace(base, moved=tuple(moved.tolist()), moved_std=std[moved], moved_first=errors[moved], rig_std=known)
    fresh = np.zeros(len(known) - len(base.rig_std))
    start = np.r_[fitted.vector[: at.start], errors[moved], fresh, fitted.vector[at.stop :]]
    found = fit(observation, replace(extension, base=other), start, near=fitted.run)
    return fitted if found.run.prediction is None else found


def law_of(fitted: Fit) -> FreeLaw:
    """f_EI of a fitted model whose law may have any form."""
    law = fitted.extension.base.characteristic(fitted.vector)
    assert isinstance(law, StiffnessLaw | ComplianceLaw)
    return law

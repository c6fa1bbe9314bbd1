"""The base model fitted to a test: the start of every inverse problem, with and without causes that extend it.

Strategy: a rough start by what photos show over the moment P y, or a constant; where no force-free photo holds K0,
starts on both sides of it; the photos' noise by what is faster along the cable than any misfit; and once more, with the
abscissa of the law laid along the law found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rod.compliance_law import COEFFICIENTS, ComplianceLaw, refreshed
from rod.inverse.base import ELEMENTS, Base, start
from rod.inverse.extension import Extension
from rod.inverse.fit import ITERATIONS, Fit, fit, fit_from
from rod.inverse.laws import Abscissa, AnyLaw, FreeLaw, over_moments
from rod.inverse.noise import calibrate_photo_noise
from rod.inverse.observation import DISPLACEMENT_STD, SHAPE_FUNCTIONS, Observation, normal_distance, observe
from rod.inverse.prediction import Facts
from rod.measured_law import MeasuredLaw
from rod.measurement import MeasuredTest
from rod.stiffness_law import StiffnessLaw

Array = NDArray[np.float64]

SIDE = 0.15
"""Of the range of curvature: how far to both sides of K0 a second valley is looked for."""


class BaseFit(NamedTuple):
    """The data with their weights, and the base model fitted to them; ``fitted`` has no prediction where none fits."""

    observation: Observation
    fitted: Fit


def base_fit(
    test: MeasuredTest,
    facts: Facts,
    *,
    near: MeasuredLaw | None = None,
    begin: tuple[float, float] | None = None,
    elements: int = ELEMENTS,
    functions: int = SHAPE_FUNCTIONS,
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
    near : MeasuredLaw or None
        A law to start from where photos and forces show none by themselves.
    begin : (N m^2, 1/m) or None
        Constant EI and K0 to start from instead of what photos show.
    elements : int
        Of the simulated cable.
    functions : int
        Of the shapes that a photo is compared by.
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
    base = replace(start(test, facts, exact=DISPLACEMENT_STD, near=near, begin=begin), elements=elements)
    fitted = _first_fit(observation, base, facts)
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
    again = (fit_from(observation, *model, fitted) for model in (laid_along(fitted), here))
    return BaseFit(observation, next((found for found in again if found.run.prediction is not None), fitted))


def _first_fit(observation: Observation, base: Base, facts: Facts) -> Fit:
    """The best fit from the law and K0 that photos show, or from a constant law, and from both sides of its K0."""
    best: Fit | None = None

    def better(vector: Array) -> Fit:
        found = fit(observation, Extension(base, facts), vector, iterations=2 * ITERATIONS)
        fits = found.run.prediction is not None and (best is None or found.chi2 < best.chi2)
        return found if fits or best is None else best

    for vector in (base.as_seen(), base.neutral()):
        best = better(vector)
        if best.converged:
            break
    assert best is not None
    if best.run.prediction is not None and "mounted" not in facts.branch:
        for vector in _beside(base, best.vector, SIDE * facts.curvature_scale):
            best = better(vector)
    return best


def _beside(base: Base, vector: Array, apart: float) -> Iterator[Array]:
    """The vector with its K0 moved to both sides, 1/m."""
    at = base.pre_curvature_index
    for shift in () if at is None else (-apart, apart):
        moved = vector.copy()
        moved[at] += shift
        yield moved


def laid_along(fitted: Fit, over: Abscissa = "bend") -> tuple[Extension, Array]:
    """The model with the abscissa of its law laid along the law found, over what was visited, and its vector there."""
    base, count = fitted.extension.base, fitted.extension.base.law.size
    assert isinstance(base.law, AnyLaw)
    law, visited = law_of(fitted), np.append(fitted.excess, 0.0)
    rise, known, size = base.law.basis.law(fitted.vector[:count]), fitted.covariance[:count, :count], count
    if base.law.over != over:
        size = COEFFICIENTS
        assert isinstance(law, StiffnessLaw)
        rise = over_moments(law, visited)
        known = np.zeros((rise.basis.size, rise.basis.size))
    if over == "moment":
        visited = law.moment(visited, np.zeros(1))
    basis = refreshed(rise, known, float(visited.min()), float(visited.max()), size=size)
    extension = replace(fitted.extension, base=replace(base, law=AnyLaw(basis, over)))
    return extension, np.r_[basis.projected(rise), fitted.vector[count:]]


def law_of(fitted: Fit) -> FreeLaw:
    """f_EI of a fitted model whose law may have any form."""
    law = fitted.extension.base.characteristic(fitted.vector)
    assert isinstance(law, StiffnessLaw | ComplianceLaw)
    return law

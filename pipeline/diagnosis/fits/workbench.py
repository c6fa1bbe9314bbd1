"""From a measured test to a fitted base model with all suspects scored: what every later step works on.

Strategy: fit the base model to the data as stated; calibrate the noise of the photos by what is faster along the cable
than any misfit; fit again; then score all suspects and simulate the family of scores. The law has so many control
points that one of any form is followed: a law of another form is no cause.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes import SUSPECTS, Cause
from pipeline.diagnosis.fits.base import Base, start
from pipeline.diagnosis.fits.extended import stiffness_change_linear
from pipeline.diagnosis.fits.extension import Extension
from pipeline.diagnosis.fits.fit import ITERATIONS, Fit, fit, fit_from
from pipeline.diagnosis.fits.laws import AnyLaw
from pipeline.diagnosis.fits.search import Suspicion, suspect
from pipeline.diagnosis.observations.noise import calibrate_photo_noise
from pipeline.diagnosis.observations.observation import Observation, normal_distance, observe
from pipeline.diagnosis.observations.prediction import Facts, facts_of
from pipeline.diagnosis.statistics.score import null_maxima, threshold
from pipeline.faults import Faults
from pipeline.messages import Message, ended
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.balance import BalanceGraph
from rod.compliance_law import refreshed
from rod.measurement import MeasuredTest
from rod.stiffness_law import StiffnessLaw

Array = NDArray[np.float64]

NULL_DRAWS = 20_000
"""Draws of N(0, U^T U); the 1 % point is then known to 0.02 sigma."""


@dataclass(frozen=True, eq=False)
class Workbench:
    """Base model fitted and all causes scored.

    Attributes
    ----------
    test : MeasuredTest
    facts : Facts
    observation : Observation
    base : Fit
    suspicion : Suspicion
    in_law : Suspicion
        Forms of causes that the law takes over.
    maxima : (draws,)
        Sorted null distribution of the largest statistic.
    limit : float
        Family-wise threshold.
    """

    test: MeasuredTest
    facts: Facts
    observation: Observation
    base: Fit
    suspicion: Suspicion
    in_law: Suspicion
    maxima: Array
    limit: float

    @property
    def largest(self) -> float:
        """Largest admissible statistic."""
        return float(self.suspicion.statistic.max(initial=0.0))

    def shown(self, cause: int) -> Suspicion:
        """Scores of a cause in forms that can be told from the law; in others where it has no such form."""
        return self.suspicion if self.suspicion.of(cause).size else self.in_law

    def stiffness_bias(self, cause: int) -> float:
        """Relative change of f_EI by a cause of plausible size, in the form that changes it most; 0 without forms."""
        columns = np.hstack([one.columns[:, one.of(cause)] for one in (self.suspicion, self.in_law)])
        size = self.suspicion.causes[cause].plausible(self.facts)
        return float(stiffness_change_linear(self.base, columns, np.array(size)).max(initial=0.0))


def prepare(
    faults: Faults,
    settings: DiagnosisSettings,
    *,
    causes: Sequence[Cause] = SUSPECTS,
    graph: BalanceGraph | None = None,
) -> Workbench | Message:
    """Fit the base model and score all causes.

    Parameters
    ----------
    faults : Faults
        The test and what of it is not to be used.
    settings : DiagnosisSettings
    causes : sequence of Cause
    graph : BalanceGraph or None
        What the balance equations say of the test, which the fit starts from; found here if not given.

    Returns
    -------
    Workbench or Message
        The advice of the equilibrium that failed, where no base model can be simulated.
    """
    test = faults.test
    facts = facts_of(test)
    observation = observe(test, settings, without_photos=faults.photos, without_forces=faults.forces)
    base = start(test, facts, elements=settings.grid, exact=settings.displacement_std, graph=graph)
    fitted = _first_fit(observation, base, facts)
    if fitted.run.prediction is None:
        assert fitted.run.failed is not None
        return ended(fitted.run.failed)
    if observation.photos:
        noise = calibrate_photo_noise(
            [normal_distance(photo.sections, fitted.run.prediction, photo.step) for photo in observation.photos],
            [photo.sections for photo in observation.photos],
            [photo.basis for photo in observation.photos],
        )
        observation = observe(
            test, settings, photo_noise=noise, without_photos=faults.photos, without_forces=faults.forces
        )
        here = fitted.extension, fitted.vector
        # laid along itself the law moves a little, and a cable that was about to snap over may do so
        again = (fit_from(observation, *model, fitted) for model in (laid_along(fitted), here))
        fitted = next((found for found in again if found.run.prediction is not None), fitted)
    return scored(test, observation, fitted, causes, settings)


def scored(
    test: MeasuredTest,
    observation: Observation,
    fitted: Fit,
    causes: Sequence[Cause],
    settings: DiagnosisSettings,
) -> Workbench:
    """The workbench of a fitted model: all causes scored, null distribution and threshold of these scores."""
    fitted = replace(fitted, extension=replace(fitted.extension, facts=_with_bends(fitted)))
    suspicion, in_law = (suspect(observation, fitted, causes, of_law=of_law) for of_law in (False, True))
    maxima = null_maxima(
        suspicion.scores.unit,
        suspicion.sign,
        draws=NULL_DRAWS,
        rng=np.random.default_rng(settings.seed),
        estimated=observation.estimated(len(fitted.residual)),
    )
    limit = threshold(maxima, settings.false_alarm)
    return Workbench(test, fitted.extension.facts, observation, fitted, suspicion, in_law, maxima, limit)


def _with_bends(fitted: Fit) -> Facts:
    """The facts with the largest bend that the cable had reached at each step by the fitted model."""
    rest = fitted.extension.base.pre_curvature(fitted.vector)
    bends = [float(step.kappa.max()) - rest for step in fitted.run.steps]
    return replace(fitted.extension.facts, bends=np.maximum.accumulate([0.0, *bends])[1:])


def _first_fit(observation: Observation, base: Base, facts: Facts) -> Fit:
    """The model fitted from the law and K0 that photos show; from a constant one where that does not settle."""
    best: Fit | None = None
    for vector in (base.as_seen(), base.neutral()):
        found = fit(observation, Extension(base, facts), vector, iterations=2 * ITERATIONS)
        if found.run.prediction is not None and (best is None or found.chi2 < best.chi2):
            best = found
        if best is not None and best.converged:
            break
    return best or found


def laid_along(fitted: Fit) -> tuple[Extension, Array]:
    """The model with the abscissa of its law laid along the law found, over the bends visited, and its vector there."""
    base, count = fitted.extension.base, fitted.extension.base.law.size
    law, bends = base.characteristic(fitted.vector), fitted.excess
    assert isinstance(law, StiffnessLaw)
    basis = refreshed(law.rise, fitted.covariance[:count, :count], float(bends.min()), float(bends.max()))
    extension = replace(fitted.extension, base=replace(base, law=AnyLaw(basis)))
    return extension, np.r_[basis.projected(law.rise), fitted.vector[count:]]

"""From a measured test to a fitted base model with all suspects scored: what every later step works on.

Fit the base model (`rod.inverse.base_fit`), score all causes, simulate the family of scores.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.diagnosis.causes import SUSPECTS, Cause
from pipeline.diagnosis.fits.extended import stiffness_change_linear
from pipeline.diagnosis.fits.search import Suspicion, suspect
from pipeline.diagnosis.statistics.score import threshold
from pipeline.faults import Faults
from pipeline.messages import Message, ended
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.base_fit import base_fit, held_to, settled
from rod.inverse.camera import tilt_of
from rod.inverse.fit import Fit
from rod.inverse.observation import ZERO_STD, Observation
from rod.inverse.prediction import Facts, facts_of
from rod.measurement import MeasuredTest

SCATTER = 1e-5
"""Of a displacement under load, m: a dial gauge or a spindle is read to so much, where photos tell the travel of a step
to a micrometre. Fits hold displacements to that, so that a scatter is no misfit; whether they do scatter is weighed
(`pipeline.diagnosis.posterior.error_grid`), and scores are those of displacements as the log tells them."""


TARED = 1.5e-3
"""Of the largest force: what is left of a zero that was set before the test, by the digits that are shown, creep and a
kelvin of temperature: some hundredths of a per cent each of a capacity that is used by a tenth to a half."""

CUT = 1e-3
"""Of the length: a cable is cut and measured with a steel rule, 0.3 mm of 300."""

LEAN = 0.1
"""Of the usual tilt of a camera: a fifth of a degree, what a good spirit level leaves."""


def beside_errors(observation: Observation, fitted: Fit) -> Fit:
    """A base model with the errors of displacements and of the rig that are usual as unknowns of that size."""
    facts = fitted.extension.facts
    lean = LEAN * tilt_of(facts.length)
    beside = held_to(observation, fitted, SCATTER, (ZERO_STD, TARED * facts.force_scale, CUT, lean, lean))
    return settled(observation, beside)


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
    limit : float
        Family-wise threshold.
    """

    test: MeasuredTest
    facts: Facts
    observation: Observation
    base: Fit
    suspicion: Suspicion
    in_law: Suspicion
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
) -> Workbench | Message:
    """Fit the base model and score all causes.

    Parameters
    ----------
    faults : Faults
        The test and what of it is not to be used.
    settings : DiagnosisSettings
    causes : sequence of Cause

    Returns
    -------
    Workbench or Message
        The advice of the equilibrium that failed, where no base model can be simulated.
    """
    test = faults.test
    observation, fitted = base_fit(
        test,
        facts_of(test),
        beside=beside_errors,
        without_photos=faults.photos,
        without_forces=faults.forces,
    )
    if fitted.run.prediction is None:
        assert fitted.run.failed is not None
        return ended(fitted.run.failed)
    return scored(test, observation, beside_errors(observation, fitted), causes, settings)


def scored(
    test: MeasuredTest,
    observation: Observation,
    fitted: Fit,
    causes: Sequence[Cause],
    settings: DiagnosisSettings,
) -> Workbench:
    """Score all causes about a fitted model, with the threshold of these scores."""
    fitted = replace(fitted, extension=replace(fitted.extension, facts=_with_bends(fitted)))
    suspicion, in_law = (suspect(observation, fitted, causes, of_law=of_law) for of_law in (False, True))
    limit = threshold(settings.false_alarm, suspicion.scores.visible)
    return Workbench(test, fitted.extension.facts, observation, fitted, suspicion, in_law, limit)


def _with_bends(fitted: Fit) -> Facts:
    """The test geometry with the largest bend that the cable had reached at each step, by the fitted model."""
    bends = [float(step.kappa.max()) - fitted.pre_curvature for step in fitted.run.steps]
    return replace(fitted.extension.facts, bends=np.maximum.accumulate([0.0, *bends])[1:])

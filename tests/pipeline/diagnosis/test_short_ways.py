"""What is not fitted to the end, or not at all, since the linear model promises too little."""

import numpy as np
import pytest

from fixtures.effects import HIDE, LARGEST, PROTOCOLS, Form
from fixtures.hidden import hidden_test
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.explanations.refit import fit_term
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.fit import PROMISED, fit

CAUSES = "camera_tilt scale_error rig_compliance relaxation"


@pytest.fixture(scope="module")
def bench():
    """A camera that is tilted, among four causes."""
    cable, reading = HIDE["camera_tilt"](0.06, Form())
    test = hidden_test(cable, PROTOCOLS["six"], largest=LARGEST, seed=31, reading=reading)
    causes = [cause for cause in CATALOGUE if cause.name in CAUSES.split()]
    return prepare(faults_of_input(test), DiagnosisSettings(), causes=causes)


def test_a_fit_goes_on_only_where_the_linear_model_promises_a_quarter_of_what_is_asked(bench):
    base = bench.base
    start = base.vector.copy()
    start[0] += 0.01  # f_EI one per cent higher in one place
    begun = fit(bench.observation, base.extension, start, near=base.run, iterations=0)
    promised = begun.chi2 - base.chi2
    assert 0.0 < promised < 0.1 * base.chi2
    hopeful = fit(bench.observation, base.extension, start, near=base.run, hopeless=begun.chi2 - 0.9 * promised)
    assert hopeful.chi2 == pytest.approx(base.chi2, rel=1e-4)
    asked = begun.chi2 - 1.2 * PROMISED * promised
    hopeless = fit(bench.observation, base.extension, start, near=base.run, hopeless=asked)
    assert hopeless.converged and np.array_equal(hopeless.vector, start)


def test_a_form_is_fitted_only_where_its_score_promises_a_quarter_of_what_is_asked(bench):
    gain = bench.suspicion.scores.z**2
    least = int(np.argmin(np.where(gain > 0.0, gain, np.inf)))
    asked = bench.base.chi2 - 1.1 * PROMISED * gain[least]
    assert fit_term(bench.observation, bench.base, bench.suspicion, least, hopeless=asked) is None
    assert fit_term(bench.observation, bench.base, bench.suspicion, least) is not None

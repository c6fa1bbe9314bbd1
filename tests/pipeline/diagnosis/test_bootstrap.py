from dataclasses import replace

import numpy as np
import pytest

from fixtures.continuum import Cable
from fixtures.hidden import THREE, Reading, hidden_test
from pipeline.diagnosis.fits.bootstrap import confirmed_limit
from pipeline.diagnosis.fits.faults import faults_of_input
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.settings.diagnosis import DiagnosisSettings


@pytest.fixture(scope="module")
def bench():
    settings = DiagnosisSettings()
    return prepare(faults_of_input(hidden_test(Cable(), THREE, largest=0.0138, seed=3), settings), settings, knots=5)


def test_far_from_the_threshold_nothing_is_drawn(bench):
    assert confirmed_limit(bench, DiagnosisSettings(bootstrap_margin=0.0)) == bench.limit


def test_a_nearly_linear_model_keeps_its_threshold(bench):
    """The largest of 40 refits is, in the mean, that of the linear theory for the same draws, but for its curvature."""
    near = DiagnosisSettings(bootstrap_margin=10.0, bootstrap=40)
    assert confirmed_limit(bench, near) < 1.02 * bench.limit


def test_prior_knowledge_that_is_contradicted_is_no_curvature():
    """It stays contradicted in every draw: taken for curvature it raised a threshold of 3.5 to 5.1."""
    settings = DiagnosisSettings(bootstrap_margin=100.0, bootstrap=10)
    longer = hidden_test(Cable(), THREE, largest=0.0138, seed=3, reading=Reading(length_error=2e-3))
    bench = prepare(faults_of_input(longer, settings), settings, knots=5)
    prior = bench.base.residual[len(bench.observation.rows.kind) :]
    assert np.max(np.abs(prior)) > 3.0
    assert confirmed_limit(bench, settings) < 1.1 * bench.limit


def test_wider_scores_than_the_linear_ones_raise_the_threshold(bench):
    near = DiagnosisSettings(bootstrap_margin=10.0, bootstrap=20)
    scores = replace(bench.suspicion.scores, unit=0.5 * bench.suspicion.scores.unit)
    narrow = replace(bench, suspicion=replace(bench.suspicion, scores=scores))  # half the spread there is
    assert confirmed_limit(narrow, near) == pytest.approx(2.0 * bench.limit, rel=0.2)

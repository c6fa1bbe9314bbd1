from dataclasses import replace

import numpy as np
import pytest

from fixtures.continuum import Cable
from fixtures.hidden import THREE, hidden_test
from pipeline.diagnosis.bootstrap import confirmed_limit
from pipeline.diagnosis.faults import faults_of_input
from pipeline.diagnosis.workbench import prepare
from pipeline.settings.diagnosis import DiagnosisSettings


@pytest.fixture(scope="module")
def bench():
    settings = DiagnosisSettings()
    return prepare(faults_of_input(hidden_test(Cable(), THREE, largest=0.0138, seed=3), settings), settings, knots=5)


def test_far_from_the_threshold_nothing_is_drawn(bench):
    assert confirmed_limit(bench, DiagnosisSettings(bootstrap_margin=0.0)) == bench.limit


def test_a_nearly_linear_model_keeps_its_threshold(bench):
    """The largest of 40 refits is, in the mean, that of the linear theory: within three standard errors."""
    near = DiagnosisSettings(bootstrap_margin=10.0, bootstrap=40)
    assert confirmed_limit(bench, near) < bench.limit * (1.0 + 3.0 * 0.25 / np.sqrt(40))


def test_wider_scores_than_the_linear_ones_raise_the_threshold(bench):
    near = DiagnosisSettings(bootstrap_margin=10.0, bootstrap=20)
    narrow = replace(bench, maxima=0.5 * bench.maxima)  # a linear theory that claims half the spread there is
    assert confirmed_limit(narrow, near) == pytest.approx(2.0 * bench.limit, rel=0.2)

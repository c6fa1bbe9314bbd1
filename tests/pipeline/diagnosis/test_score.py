import numpy as np
import pytest
from scipy import stats

from pipeline.diagnosis.statistics.score import (
    adjusted_p,
    admissible,
    descending,
    score,
    threshold,
)


@pytest.fixture
def problem():
    rng = np.random.default_rng(3)
    jacobian, columns = rng.standard_normal((80, 6)), rng.standard_normal((80, 5))
    columns[:, 4] = columns[:, 3] + 0.1 * rng.standard_normal(80)
    return jacobian, columns


def test_score_is_that_of_a_least_squares_fit_with_one_more_column(problem):
    jacobian, columns = problem
    data = np.random.default_rng(4).standard_normal(80) + 2.0 * columns[:, 1]
    found = score(data, jacobian, columns)
    for k in range(5):
        design = np.column_stack([jacobian, columns[:, k]])
        amount = np.linalg.lstsq(design, data, rcond=None)[0][-1]
        std = np.sqrt(np.linalg.inv(design.T @ design)[-1, -1])
        assert found.estimate[k] == pytest.approx(amount, rel=1e-9)
        assert found.std[k] == pytest.approx(std, rel=1e-9)
        assert found.z[k] == pytest.approx(amount / std, rel=1e-9)


def test_direction_within_the_fitted_ones_is_invisible(problem):
    jacobian, _ = problem
    hidden = jacobian @ np.arange(1.0, 7.0)
    found = score(np.ones(80), jacobian, hidden[:, None])
    assert found.surviving[0] == 0.0 and found.z[0] == 0.0 and np.isinf(found.std[0])


def test_units_of_parameters_do_not_matter(problem):
    jacobian, columns = problem
    data = np.random.default_rng(5).standard_normal(80)
    scale = 10.0 ** np.array([-9, 6, 0, 3, -4, 8])
    assert np.allclose(score(data, jacobian * scale, columns).z, score(data, jacobian, columns).z, atol=1e-9)


def test_threshold_is_exceeded_at_most_as_often_as_stated(problem):
    """With five scores, two of them nearly one and two of one sign, between a quarter as often and as often."""
    jacobian, columns = problem
    sign = np.array([0.0, 1.0, 0.0, -1.0, 0.0])
    found = score(np.zeros(80), jacobian, columns)
    noise = np.random.default_rng(7).standard_normal((20000, 80))
    rate = np.mean(admissible(noise @ found.unit, sign).max(axis=1) > threshold(0.05, found.visible))
    assert 0.0125 < rate < 0.05


def test_threshold_is_exact_for_independent_scores():
    noise = np.random.default_rng(8).standard_normal((20000, 6))
    rate = np.mean(np.abs(noise).max(axis=1) > threshold(0.05, 6))
    assert abs(rate - 0.05) < 4.0 * np.sqrt(0.05 * 0.95 / 20000)  # 4 sigma


def test_effect_of_the_detectable_size_is_detected_with_the_stated_power(problem):
    jacobian, columns = problem
    found = score(np.zeros(80), jacobian, columns)
    limit = threshold(0.01, found.visible)
    shift = (limit + stats.norm.ppf(0.9)) * found.unit[:, 0]
    z = (np.random.default_rng(11).standard_normal((20000, 80)) + shift) @ found.unit[:, :1]
    assert np.mean(np.abs(z) > limit) == pytest.approx(0.9, abs=0.01)


def test_adjusted_p_is_the_level_at_the_threshold_and_keeps_its_digits_in_the_tail():
    for tests in (1, 5, 113):
        assert adjusted_p(threshold(0.01, tests), tests) == pytest.approx(0.01, rel=1e-9)
        assert adjusted_p(9.0, tests) == pytest.approx(tests * 2.0 * stats.norm.sf(9.0), rel=1e-9)
        assert adjusted_p(0.0, tests) == pytest.approx(1.0, abs=1e-9)


def test_of_directions_that_sound_alike_the_first_comes_first():
    values = np.array([1.0, 5.0, 3.0, 5.0 * (1.0 + 1e-12), 3.0 + 1e-3, 0.0])
    assert descending(values).tolist() == [1, 3, 4, 2, 0, 5]
    assert descending(np.zeros(0)).size == 0

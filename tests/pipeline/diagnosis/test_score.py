import numpy as np
import pytest
from scipy import stats

from pipeline.diagnosis.statistics.score import (
    adjusted_p,
    admissible,
    descending,
    null_maxima,
    score,
    scores_of_noise,
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


def test_threshold_is_exceeded_as_often_as_stated(problem):
    jacobian, columns = problem
    sign = np.array([0.0, 1.0, 0.0, -1.0, 0.0])
    unit = score(np.zeros(80), jacobian, columns).unit
    limit = threshold(null_maxima(unit, sign, draws=20000, rng=np.random.default_rng(6)), 0.05)
    noise = np.random.default_rng(7).standard_normal((20000, 80))
    rate = np.mean(admissible(noise @ unit, sign).max(axis=1) > limit)
    assert abs(rate - 0.05) < 4.0 * np.sqrt(2.0 * 0.05 * 0.95 / 20000)  # both sides are simulated: 4 sigma


def test_few_samples_behind_the_noise_widen_the_tails(problem):
    jacobian, columns = problem
    unit, sign = score(np.zeros(80), jacobian, columns).unit, np.zeros(5)
    known = null_maxima(unit, sign, draws=20000, rng=np.random.default_rng(8))
    rows = np.ones(80, dtype=bool)
    guessed = null_maxima(unit, sign, draws=20000, rng=np.random.default_rng(8), estimated=[(rows, 10)])
    noise = np.random.default_rng(9)
    z = noise.standard_normal((20000, 80)) @ unit / np.sqrt(noise.chisquare(10, 20000) / 10)[:, None]
    rate = np.mean(np.abs(z).max(axis=1) > threshold(guessed, 0.05))
    assert threshold(guessed, 0.05) > threshold(known, 0.05) + 0.2
    assert abs(rate - 0.05) < 4.0 * np.sqrt(2.0 * 0.05 * 0.95 / 20000)


def test_effect_of_the_detectable_size_is_detected_with_the_stated_power(problem):
    jacobian, columns = problem
    unit = score(np.zeros(80), jacobian, columns).unit
    limit = threshold(null_maxima(unit, np.zeros(5), draws=20000, rng=np.random.default_rng(10)), 0.01)
    shift = (limit + stats.norm.ppf(0.9)) * unit[:, 0]
    z = (np.random.default_rng(11).standard_normal((20000, 80)) + shift) @ unit[:, :1]
    assert np.mean(np.abs(z) > limit) == pytest.approx(0.9, abs=0.01)


def test_adjusted_p_goes_over_smoothly_into_the_tail(problem):
    jacobian, columns = problem
    unit = score(np.zeros(80), jacobian, columns).unit
    maxima = null_maxima(unit, np.zeros(5), draws=20000, rng=np.random.default_rng(12))
    at = np.linspace(0.0, 9.0, 200)
    p = adjusted_p(at, maxima)
    assert np.all(np.diff(p) <= 1e-4) and p[0] == pytest.approx(1.0, abs=1e-3)
    # five tests, two of them nearly one: the tail lies between that of three and of five independent ones
    tail = 2.0 * stats.norm.sf(9.0)
    assert 3.0 * tail < p[-1] < 5.5 * tail


@pytest.mark.parametrize("rows", [80, 4])
def test_scores_of_noise_spread_as_the_columns_say(problem, rows):
    columns = problem[1][:rows]
    drawn = scores_of_noise(columns, draws=40000, rng=np.random.default_rng(13))
    wanted = columns.T @ columns
    # 4 sigma of a covariance of 40,000 draws
    error = 4.0 * np.sqrt((np.outer(np.diag(wanted), np.diag(wanted)) + wanted**2) / 40000)
    assert np.all(np.abs(np.cov(drawn.T) - wanted) < error)


def test_threshold_stays_where_directions_that_are_the_same_differ_by_rounding(problem):
    """Forms of one cause may have one trace; a triangular root of their product then turns freely."""
    jacobian, columns = problem
    columns = np.column_stack([columns[:, 0], columns])
    moved = columns * (1.0 + 1e-13 * np.random.default_rng(14).standard_normal(columns.shape))
    limits = []
    for given in (columns, moved):
        unit = score(np.zeros(80), jacobian, given).unit
        limits.append(threshold(null_maxima(unit, np.zeros(6), draws=2000, rng=np.random.default_rng(15)), 0.01))
    assert limits[1] == pytest.approx(limits[0], rel=1e-6)


def test_of_directions_that_sound_alike_the_first_comes_first():
    values = np.array([1.0, 5.0, 3.0, 5.0 * (1.0 + 1e-12), 3.0 + 1e-3, 0.0])
    assert descending(values).tolist() == [1, 3, 4, 2, 0, 5]
    assert descending(np.zeros(0)).size == 0

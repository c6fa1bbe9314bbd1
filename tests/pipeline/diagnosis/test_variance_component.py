"""The scatter of numbers beside a fitted model, on normal data whose scatter is known."""

import numpy as np
import pytest

from pipeline.diagnosis.statistics.variance_component import component

STEPS = 7
LINES = np.column_stack([np.ones(STEPS), np.arange(STEPS)])


def problem(rng, tau, line=0.0):
    """Residual of data with 5 fitted parameters, the numbers of 7 steps of 1 sigma per unit, and their line."""
    jacobian, columns = rng.standard_normal((100, 5)), rng.standard_normal((100, STEPS)) / 10.0
    numbers = tau * rng.standard_normal(STEPS) + line * (LINES @ np.array([1.0, -0.4]))
    basis = np.linalg.qr(jacobian)[0]
    data = columns @ numbers + rng.standard_normal(100)
    return data - basis @ (basis.T @ data), jacobian, columns


def found(tau, draws, line=0.0):
    rng = np.random.default_rng(2)
    return [component(*problem(rng, tau, line), lines=LINES, most=50.0) for _ in range(draws)]


@pytest.mark.parametrize("line", [0.0, 100.0])
def test_noise_and_lines_are_no_scatter(line):
    rare = np.mean([one.p_value < 0.01 for one in found(0.0, 400, line)])
    assert rare < 0.01 + 3.0 * np.sqrt(0.01 / 400)  # at most as often as stated, three standard errors


def test_scatter_is_found_as_large_as_it_is():
    ones = found(10.0, 300, 100.0)
    squares = np.mean([one.std**2 for one in ones])
    # five free numbers each: the mean of 300 variances is known to 3.7 %; the noise adds 1 %
    assert squares == pytest.approx(100.0, rel=0.12)
    assert np.mean([one.p_value < 1e-3 for one in ones]) > 0.98
    assert np.median([one.share for one in ones]) > 0.8


def test_what_is_fitted_already_has_no_scatter():
    residual, jacobian, columns = problem(np.random.default_rng(3), 1.0)
    assert component(residual, np.hstack([jacobian, columns]), columns, lines=LINES, most=50.0) is None


def test_interval_of_the_scatter_holds_it_as_often_as_stated():
    ones = found(10.0, 400, 100.0)
    held = np.mean([one.between[0] <= 10.0 <= one.between[1] for one in ones])
    # 95 %, of which five free numbers cost 1 %, and three standard errors of 400 draws
    assert held == pytest.approx(0.945, abs=0.034)
    assert all(one.between[0] <= one.std <= one.between[1] for one in ones)
    assert np.median([one.between[1] / one.between[0] for one in ones]) < 5.0  # that of chi-square itself: 4.3

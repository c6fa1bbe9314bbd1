"""Speed of identification, as ratios within one run: run with ``--benchmark-enable``.

The unit is all steps simulated from nothing; the goals in seconds are those of a machine on which that takes some 12 ms
for six photos: Table 1 in 100 ms, six photos with bands in 0.5 s, the balance way in 0.1 s. Processor time, so that a
busy machine does not disturb the ratios.
"""

import time

import numpy as np
import pytest

from rod.balance import BalanceOutcome, balance
from rod.bending_test import TABLE_1_KNOTS, simulate, table_1
from rod.inverse import estimate
from rod.inverse.fit import evaluated, shown
from rod.inverse.simulation import run
from rod.paper_fit import Virtual, paper_fit
from tests.rod.virtual_cable import StickSlip, force_free
from tests.rod.virtual_photo import bending_test

LAW, LENGTH = StickSlip(5e-3, 1.5e-3, 4.0, 2.0), 0.2

pytestmark = pytest.mark.benchmark(timer=time.process_time)


@pytest.fixture(scope="module")
def six_photos():
    chords = force_free(LAW, LENGTH).chord - 2.5e-3 * np.arange(1, 7)
    return bending_test(LAW, LENGTH, chords, np.random.default_rng(0), mounted=False)[0]


@pytest.fixture(scope="module")
def truth(six_photos):
    """The fit that ended, from which one evaluation starts warm."""
    found = estimate(six_photos)
    return found.observation, found.fitted


def evaluation(truth):
    """One evaluation: all steps simulated beside a converged run, with exact derivatives by all unknowns."""
    observation, fitted = truth
    beside = fitted.vector.copy()
    beside[0] += 1e-3
    return evaluated(observation, fitted.extension, shown(observation, fitted.extension, beside, fitted.run))


def seconds(function, repeats=5):
    """Fastest of a few calls: what the machine can do when nobody else is on it."""
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return best


def cold(truth):
    """All steps simulated from nothing."""
    _, fitted = truth
    return run(fitted.run.model, fitted.extension.facts)


def test_six_photos_with_bands_cost_a_hundred_simulations(benchmark, six_photos, truth):
    result = benchmark(estimate, six_photos)
    assert result.converged
    if benchmark.enabled:
        unit = seconds(lambda: cold(truth))
        benchmark.extra_info["simulations"] = benchmark.stats["min"] / unit
        assert benchmark.stats["min"] < 150 * unit


def test_balance_costs_a_few_dozen_simulations(benchmark, six_photos, truth):
    assert benchmark(balance, six_photos).outcome is BalanceOutcome.MEASURED
    if benchmark.enabled:
        unit = seconds(lambda: cold(truth))
        benchmark.extra_info["simulations"] = benchmark.stats["min"] / unit
        assert benchmark.stats["min"] < 60 * unit


def test_exact_derivatives_by_all_unknowns_cost_less_than_three_simulations(benchmark, truth):
    """By 30 unknowns and more; differences would take as many simulations."""
    found = benchmark(evaluation, truth)
    assert found.run.prediction is not None and found.jacobian.shape[1] > 20
    if benchmark.enabled:
        unit = seconds(lambda: cold(truth))
        benchmark.extra_info["simulations"] = benchmark.stats["min"] / unit
        assert benchmark.stats["min"] < 3 * unit


def test_table_1_costs_some_thirty_simulations(benchmark):
    test, moves = table_1("tangent"), 5e-3 * np.arange(1, 4)
    steps = simulate(test, moves)
    data = Virtual(0.2, moves, np.array([s.force for s in steps]), np.array([s.kappa for s in steps]))
    fitted = benchmark(paper_fit, data, TABLE_1_KNOTS, reading="tangent")
    assert fitted.converged
    if benchmark.enabled:
        unit = seconds(lambda: simulate(test, moves))
        benchmark.extra_info["simulations of three steps"] = benchmark.stats["min"] / unit
        assert benchmark.stats["min"] < 40 * unit

"""Speed of identification, as ratios within one run: run with ``--benchmark-enable``.

The unit is one evaluation of the model (all steps simulated, with exact derivatives); the goals in seconds are those of
a machine on which a six-photo evaluation takes some 12 ms: Table 1 in 100 ms, six photos with bands in 0.5 s, the
balance way in 50 ms. Processor time, so that a busy machine does not disturb the ratios.
"""

import time

import numpy as np
import pytest
from rod.inverse.evaluation import evaluate
from rod.inverse.fit_model import fit_model, step_data

from rod.balance import balance
from rod.bending_test import TABLE_1_KNOTS, simulate, table_1
from rod.compliance_law import ComplianceLaw, moment_basis
from rod.inverse import estimate
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
def model(six_photos):
    top = float(LAW.moment(9.2))
    return fit_model(six_photos, step_data(six_photos), moment_basis(0.0, top, unit=1.0 / LAW.EI0), elements=100)


@pytest.fixture(scope="module")
def truth(model):
    """Unknowns of the true law."""
    kappa = np.linspace(2.0, 9.3, 400)
    compliance = np.interp(model.basis.moments, LAW.moment(kappa), 1.0 / LAW.tangent(kappa))
    coefficients = np.linalg.lstsq(model.basis.at_ends, np.log(compliance / model.basis.unit), rcond=None)[0]
    return model.start(ComplianceLaw(model.basis, coefficients), LAW.K0)


def seconds(function, repeats=5):
    """Fastest of a few calls: what the machine can do when nobody else is on it."""
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return best


def test_six_photos_with_bands_cost_a_few_dozen_evaluations(benchmark, six_photos, model, truth):
    warm = evaluate(model, truth).equilibria
    result = benchmark(estimate, six_photos)
    assert result.converged
    if benchmark.enabled:
        unit = seconds(lambda: evaluate(model, truth, starts=warm))
        benchmark.extra_info["evaluations"] = benchmark.stats["min"] / unit
        assert benchmark.stats["min"] < 60 * unit


def test_balance_costs_a_few_evaluations(benchmark, six_photos, model, truth):
    warm = evaluate(model, truth).equilibria
    assert benchmark(balance, six_photos).measured
    if benchmark.enabled:
        unit = seconds(lambda: evaluate(model, truth, starts=warm))
        benchmark.extra_info["evaluations"] = benchmark.stats["min"] / unit
        assert benchmark.stats["min"] < 6 * unit


def test_exact_derivatives_by_all_unknowns_cost_less_than_four_simulations(benchmark, model, truth):
    """By 62 unknowns; differences would take as many simulations."""
    here = evaluate(model, truth)
    test, chords = model.bending_test(truth), [step.chord for step in here.steps]
    found = benchmark(evaluate, model, truth, starts=here.equilibria)
    assert found.failure is None and found.jacobian.shape[1] > 50
    if benchmark.enabled:
        alone = seconds(lambda: simulate(test, chords=chords, branch="up", starts=here.equilibria))
        benchmark.extra_info["simulations"] = benchmark.stats["min"] / alone
        assert benchmark.stats["min"] < 4 * alone


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

"""Speed of the rod, as ratios to one banded solve of the full system of Eq. (4), measured in the same run.

Run with ``pytest tests/benchmarks --benchmark-enable``; without it everything runs once, as a plain test of the calls.
The unit is one ``scipy.linalg.solveh_banded`` with 300 unknowns and half bandwidth 5: the size of one Newton step on
Eq. (4) with 100 elements, about 0.05 ms. A second limit is the Newton step that is really taken, a bordered tridiagonal
solve with its residuals; nothing that proves a minimum can be faster than two of them.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from time import process_time
from timeit import timeit

import numpy as np
import pytest
from scipy.linalg import solveh_banded

from rod.bending_test import TABLE_1, BendingTest, simulate, table_1
from rod.equilibrium import Equilibrium, solve
from rod.iteration import iterate
from rod.parameters import Parameter, Toward
from rod.reduction import System
from rod.sensitivity import derivatives
from rod.support import Support

STEPS = TABLE_1["step"] * np.arange(1, 4)
SHORT = 1e-6  # of causes that are told by a test that has a little of them


def ten(test: BendingTest) -> list[Parameter]:
    """Three control points, K0, chord, length, and four causes: springs and friction of the bearings, two loads."""
    sprung, rubbing = Support(stiffness=SHORT), Support(friction_moment=SHORT)
    changes = [{"left": end, "right": end} for end in (sprung, rubbing)] + [
        {"load": (SHORT, 0.0)},
        {"load": (0.0, SHORT)},
    ]
    causes = [Toward(test, replace(test, **change), SHORT) for change in changes]
    return ["ordinates", "pre_curvature", "chord", "length", *causes]


def ratio(call: Callable[[], object], unit: Callable[[], object], number: int = 3, runs: int = 60) -> float:
    """Processor time of a call over that of a unit: best of short runs by turns, so that both meet the same machine."""
    taken = [[timeit(run, timer=process_time, number=number) for run in (call, unit)] for _ in range(runs)]
    one, other = np.min(taken, axis=0)
    return float(one / other)


def banded_solve() -> Callable[[], object]:
    """One solve of the size of a Newton step on Eq. (4) with 100 elements."""
    size, half_bandwidth = 300, 5
    band = -np.ones((half_bandwidth + 1, size))
    band[-1] = 4.0 * half_bandwidth
    rhs = np.ones(size)
    return lambda: solveh_banded(band, rhs)


BANDED = banded_solve()


def enabled(benchmark) -> bool:
    return not benchmark.disabled


def test_banded_solve(benchmark) -> None:
    assert np.all(np.isfinite(benchmark(BANDED)))


def test_warm_equilibrium(benchmark) -> None:
    test = table_1("tangent")
    near = simulate(test, [STEPS[0]])[0]
    hold = test.hold("displacements", 1.04 * STEPS[0])
    call = partial(solve, test.rod, hold, start=near)
    assert benchmark(call).good
    if enabled(benchmark):
        system = System(test.rod, hold, test.rod.virgin)
        balance = system.balance(near.angles, near.right_reaction)

        def newton_step() -> object:
            system.balance(near.angles, near.right_reaction)
            return system.solve(balance, -balance.gradient[:, None], -balance.gap[:, None])

        solves, newton_step_ratio = ratio(call, BANDED), ratio(newton_step, BANDED)
        benchmark.extra_info.update(ratio=solves, newton_step_ratio=newton_step_ratio)
        assert solves <= 10.0


def test_path_of_three_steps_from_the_force_free_shape(benchmark) -> None:
    def call() -> tuple[Equilibrium, ...]:
        return simulate(table_1("tangent"), STEPS)

    assert all(step.good for step in benchmark(call))
    if enabled(benchmark):
        benchmark.extra_info["ratio"] = solves = ratio(call, BANDED)
        assert solves <= 150.0


def test_cost_grows_linearly_with_the_elements(benchmark) -> None:
    calls = []
    for elements in (3200, 100):
        test = table_1("tangent", elements=elements)
        near = simulate(test, [STEPS[0]])[0]
        assert near.good
        calls.append(partial(solve, test.rod, test.hold("displacements", 1.04 * STEPS[0]), start=near))
    assert benchmark(calls[0]).good
    if enabled(benchmark):
        benchmark.extra_info["factor"] = factor = ratio(*calls)
        assert factor <= 40.0


@pytest.mark.parametrize("displacement", STEPS)
@pytest.mark.parametrize("reading", ["tangent", "secant"])
def test_direct_newton_against_the_papers_iteration(benchmark, reading: str, displacement: float) -> None:
    test = table_1(reading)
    hold = test.hold("displacements", displacement)
    direct = solve(test.rod, hold)
    indirect = benchmark(lambda: iterate(test.rod, hold, update="consistent"))
    assert indirect.equilibrium.force == pytest.approx(direct.force, rel=1e-8)
    # The paper calls the direct way expensive. Both take Newton steps of the same size: fewer steps are cheaper.
    assert direct.iterations < indirect.newton_steps
    if enabled(benchmark):
        over = ratio(partial(iterate, test.rod, hold, update="consistent"), partial(solve, test.rod, hold), 1, 5)
        benchmark.extra_info.update(
            iteration_over_newton=over,
            newton_steps=direct.iterations,
            iteration_newton_steps=indirect.newton_steps,
            minimisations=indirect.iterations,
        )
        assert over > 1.0


def test_ten_derivatives_cost_at_most_one_equilibrium(benchmark) -> None:
    test = table_1("tangent")
    steps = simulate(test, STEPS)
    parameters = ten(test)
    call = partial(derivatives, test, steps[:1], parameters)
    assert benchmark(call)[0].force.shape == (10,)
    if enabled(benchmark):
        hold = test.hold("displacements", 1.04 * STEPS[0])
        warm, cold = partial(solve, test.rod, hold, start=steps[0]), partial(simulate, replace(test), STEPS[:1])
        path = ratio(partial(derivatives, test, steps, parameters), warm) / 3.0
        over = ratio(call, warm)
        benchmark.extra_info.update(over_warm=over, over_cold=ratio(call, cold), on_a_path_over_warm=path)
        assert over <= 1.0

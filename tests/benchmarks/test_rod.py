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
from timeit import repeat

import numpy as np
import pytest
from scipy.linalg import solveh_banded

from rod.bending_test import TABLE_1, simulate, table_1
from rod.equilibrium import Equilibrium, solve
from rod.iteration import iterate
from rod.reduction import System
from rod.sensitivity import derivatives

STEPS = TABLE_1["step"] * np.arange(1, 4)
TEN = ["ordinates", "pre_curvature", "chord", "length", "bearing_stiffness", "bearing_friction", "load_x", "load_y"]


def seconds(call: Callable[[], object], number: int = 3) -> float:
    """Processor time, best of sixty short runs: what other programs on the machine do counts as little as possible."""
    return min(repeat(call, timer=process_time, number=number, repeat=60)) / number


def banded_solve() -> Callable[[], object]:
    """One solve of the size of a Newton step on Eq. (4) with 100 elements."""
    size, half_bandwidth = 300, 5
    band = -np.ones((half_bandwidth + 1, size))
    band[-1] = 4.0 * half_bandwidth
    rhs = np.ones(size)
    return lambda: solveh_banded(band, rhs)


@pytest.fixture(scope="module")
def unit() -> float:
    return seconds(banded_solve(), 20)


def enabled(benchmark) -> bool:
    return not benchmark.disabled


def test_banded_solve(benchmark) -> None:
    assert np.all(np.isfinite(benchmark(banded_solve())))


def test_warm_equilibrium(benchmark, unit: float) -> None:
    test = table_1("tangent")
    near = simulate(test, [STEPS[0]])[0]
    hold = test.hold("displacements", 1.04 * STEPS[0])
    call = partial(solve, test.rod, hold, start=near)
    assert benchmark(call).good
    if enabled(benchmark):
        system = System(test.rod, hold, test.rod.virgin)
        balance = system.balance(near.angles, near.right_reaction)
        newton_step = seconds(
            lambda: system.solve(
                system.balance(near.angles, near.right_reaction), -balance.gradient[:, None], -balance.gap[:, None]
            )
        )
        ratio = seconds(call) / unit
        benchmark.extra_info.update(ratio=ratio, newton_step_ratio=newton_step / unit)
        assert ratio <= 30.0


def test_path_of_three_steps_from_the_force_free_shape(benchmark, unit: float) -> None:
    def call() -> tuple[Equilibrium, ...]:
        return simulate(table_1("tangent"), STEPS)

    assert all(step.good for step in benchmark(call))
    if enabled(benchmark):
        benchmark.extra_info["ratio"] = ratio = seconds(call) / unit
        assert ratio <= 150.0


def test_cost_grows_linearly_with_the_elements(benchmark) -> None:
    times = {}
    for elements in (100, 3200):
        test = table_1("tangent", elements=elements)
        near = simulate(test, [STEPS[0]])[0]
        hold = test.hold("displacements", 1.04 * STEPS[0])
        assert near.good
        call = partial(solve, test.rod, hold, start=near)
        times[elements] = seconds(call) if enabled(benchmark) else 0.0
    assert benchmark(call).good
    if enabled(benchmark):
        benchmark.extra_info["factor"] = factor = times[3200] / times[100]
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
        newton = seconds(partial(solve, test.rod, hold))
        iteration = min(repeat(partial(iterate, test.rod, hold, update="consistent"), timer=process_time, number=1))
        benchmark.extra_info.update(
            iteration_over_newton=iteration / newton,
            newton_steps=direct.iterations,
            iteration_newton_steps=indirect.newton_steps,
            minimisations=indirect.iterations,
        )
        assert iteration > newton


def test_ten_derivatives_cost_at_most_one_equilibrium(benchmark) -> None:
    test = table_1("tangent")
    steps = simulate(test, STEPS)
    call = partial(derivatives, test, steps[:1], TEN)
    assert len(benchmark(call)[0].names) == 10
    if enabled(benchmark):
        hold = test.hold("displacements", 1.04 * STEPS[0])
        warm = seconds(lambda: solve(test.rod, hold, start=steps[0]))
        cold = seconds(lambda: simulate(replace(test), [STEPS[0]]))
        path = seconds(lambda: derivatives(test, steps, TEN)) / 3.0
        one = seconds(call)
        benchmark.extra_info.update(over_warm=one / warm, over_cold=one / cold, on_a_path_over_warm=path / warm)
        assert one <= warm

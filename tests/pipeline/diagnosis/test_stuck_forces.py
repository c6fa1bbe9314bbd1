"""Holds that do not scatter: cut off at the end of the range, or frozen; live ones are never taken for such."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.faults import faults_of_input
from pipeline.faults.stuck_forces import stuck_forces
from rod.inverse.force_noise import common_rounding, resolution
from rod.measurement import MeasuredStep, MeasuredTest

LEVELS = (0.0, 2.4, 2.9, 3.1, 3.2, 3.25)
NOISE = 8e-3


def log(seed=0, *, samples=8, digits=6, noise=NOISE, loss=0.0):
    rng = np.random.default_rng(seed)
    decay = 1.0 - loss * (1.0 - np.exp(-np.linspace(0.0, 3.0, samples)))
    steps = []
    for number, level in enumerate(LEVELS):
        forces = np.round(level * decay + noise * rng.standard_normal(samples), digits)
        branch = "loading" if number else "mounted"
        steps.append(MeasuredStep(number, branch, 3e-3 * number, forces.mean(), noise, hold_forces=forces))
    return tuple(steps)


def changed(steps, change):
    return tuple(replace(s, force=change(s).mean(), hold_forces=change(s)) for s in steps)


def clipped(steps, limit, *, noise=0.0):
    rng = np.random.default_rng(9)

    def cut(step):
        held = np.minimum(step.hold_forces, limit)
        return np.where(held < limit, held, limit + noise * rng.standard_normal(held.size))

    return changed(steps, cut)


@pytest.mark.parametrize("noise", [0.0, 3e-4])
@pytest.mark.parametrize("digits", [6, 3])
def test_steps_at_the_end_of_the_range(noise, digits):
    assert stuck_forces(clipped(log(digits=digits), 3.0, noise=noise)) == [3, 4, 5]


@pytest.mark.parametrize("level", [0.0031, 2.95])
def test_a_channel_that_freezes(level):
    frozen = changed(log(), lambda s: np.full(8, level) if s.step > 1 else s.hold_forces)
    assert stuck_forces(frozen) == [2, 3, 4, 5]


def test_a_hold_at_the_top_that_shows_one_step_of_a_coarse_cell_is_live():
    """11 bits over 45 N, logged with four decimals: the last hold lies in the middle of a step, the others change."""
    step, rng = 45.7 / 2048, np.random.default_rng(3)
    counts = np.array([0.0, 272.4, 318.6, 346.5, 367.4, 385.5, 400.0])
    read = [np.round(np.round(level + 0.15 * rng.standard_normal(11)) * step, 4) for level in counts]
    steps = tuple(
        MeasuredStep(k, "loading" if k else "mounted", 0.01 * k, hold.mean(), 0.004, hold_forces=hold)
        for k, hold in enumerate(read)
    )
    assert np.ptp(read[-1]) == 0.0 and sum(np.ptp(hold) > 0.0 for hold in read) >= 4
    assert stuck_forces(steps) == []
    assert resolution(read) == pytest.approx(step, abs=2e-4)
    off = np.full(len(steps), step / np.sqrt(12.0))
    assert common_rounding(steps, off)[-1] == pytest.approx(step / np.sqrt(12.0), rel=0.05)


def test_single_samples_that_repeat_the_largest_force():
    steps = tuple(replace(s, hold_forces=None) for s in log())
    assert stuck_forces(steps) == []
    assert stuck_forces(tuple(replace(s, force=min(s.force, 3.0)) for s in steps)) == [3, 4, 5]


@pytest.mark.parametrize(
    "kind",
    [{}, {"digits": 2}, {"samples": 4}, {"samples": 40}, {"loss": 0.05}, {"noise": 1e-5, "digits": 3}],
)
def test_live_holds_are_not_stuck(kind):
    """A coarse log whose noise is below its last digit repeats everywhere, so it says nothing of any hold."""
    assert [stuck_forces(log(seed, **kind)) for seed in range(200)] == [[]] * 200


def test_the_finding_names_the_steps_and_what_to_do():
    test = MeasuredTest(0.18, 1e-4, 1e-3, clipped(log(), 3.0))
    found = faults_of_input(test)
    assert [finding.code for finding in found.findings] == ["force/stuck"]
    assert "3, 4, 5" in found.findings[0].message
    assert "larger range" in found.findings[0].message
    assert found.forces == {3, 4, 5}

"""The path of equilibria itself: states and rates, the softest stiffness, and the way down from an unstable state."""

from dataclasses import replace

import numpy as np
import pytest

from rod.bending_test import BendingTest, simulate
from rod.equilibrium import Outcome, bow_side, solve
from rod.laws import StickSlip
from rod.newton import Start, descended, newton, softest
from rod.path import Ramp, followed
from rod.reduction import Hold, System
from rod.support import Support
from tests.rod.potential_energy import Potential
from tests.rod.test_literature import CANTILEVER, CASES, EULER, LENGTH, STRAIGHT, arch

DRIVEN = {
    "force and spring": (replace(arch(1.0), left=Support(stiffness=0.01, angle=0.3)), Hold(force=0.4)),
    "chord and moment": (replace(arch(2.0), right=Support(moment=1e-3), compliance=1e-3), Hold(chord=0.19)),
    "clamps that turn": (replace(arch(2.0), left=Support("clamp", angle=0.5, rigid_length=0.01)), Hold(chord=0.18)),
    "tip of a soft rod": (replace(CANTILEVER, axial_stiffness=3.0, shear_stiffness=2.0), Hold(tip=(-0.2, 0.3))),
}


@pytest.mark.parametrize("case", DRIVEN)
def test_states_along_the_path_are_equilibria_and_their_rate_is_that_of_neighbours(case):
    test, hold = DRIVEN[case]
    ramp = Ramp(System(test.rod, hold, test.rod.virgin), None)
    assert ramp.system.misfit(ramp.begin.balance) < 1e-12
    point, way = ramp.begin, None
    for _ in range(3):
        way = ramp.tangent(point, way)
        assert ramp.product(way, way, point.state) == pytest.approx(1.0)
        point = ramp.corrected(point.state + 0.05 * way, way)
        assert point is not None
    assert point.share > 0.0
    way = ramp.tangent(point, way)
    near = ramp.corrected(point.state + 1e-5 * way, way)
    by = near.share - point.share
    quotient, rate = (near.state - point.state) / by, ramp.solve(point)[1]
    for part in (slice(-3), slice(-3, -1)):
        assert np.allclose(quotient[part], rate[part], rtol=1e-3, atol=1e-3 * np.abs(rate[part]).max())
    end = followed(ramp.system)
    assert end.outcome is Outcome.CONVERGED
    # the whole share is what was asked for: the same as without a path, from the end itself
    cold = solve(test.rod, hold)
    again = solve(test.rod, hold, start=replace(cold, angles=end.angles, right_reaction=end.R))
    assert np.allclose(again.angles, end.angles, atol=1e-9)
    assert again.iterations <= 2


@pytest.mark.parametrize("case", CASES)
def test_softest_stiffness_vanishes_at_the_critical_load(case):
    test, factor = CASES[case]
    ramp = Ramp(System(test.rod, Hold(force=factor * EULER), test.rod.virgin), None)
    values = []
    for share in (0.5, 0.9, 1.1):
        R = np.array([-share * factor * EULER, 0.0])
        stiffness, mode = softest(ramp.system, ramp.at(np.r_[np.zeros(test.rod.edges.size), R, share]).balance)
        values.append(stiffness)
        assert ramp.system.mass @ mode**2 == pytest.approx(1.0, abs=0.03)  # bearings count half an element
    # linear in the load, zero at the critical one: pi^2 (1 - share) for pinned ends (Rayleigh)
    assert values[2] < 0.0 < values[1] < values[0]
    assert values[1] == pytest.approx(-values[2], rel=0.02)
    if case == "pinned":
        assert values == pytest.approx(np.pi**2 * np.array([0.5, 0.1, -0.1]), rel=0.03)  # as above


def test_descent_ends_at_a_minimum_and_goes_downhill():
    test = STRAIGHT
    system = System(test.rod, Hold(force=1.5 * EULER), test.rod.virgin)
    slope = 1e-3 * np.cos(np.pi * np.cumsum(test.rod.edges) / LENGTH)
    rest = descended(system, Start(slope, np.array([-1.5 * EULER, 0.0])))
    truth = simulate(test, forces=[1.5 * EULER])[0]
    assert rest.found
    assert np.allclose(rest.angles, truth.angles, atol=1e-7)


def test_natural_side_of_a_straight_cable_is_up():
    assert bow_side(STRAIGHT.rod, "natural") == 1
    assert bow_side(arch(0.0).rod, "natural") == 1
    assert bow_side(replace(STRAIGHT, pre_curvature=-1.0).rod, "natural") == -1
    assert bow_side(replace(STRAIGHT, pre_curvature=-1.0).rod, "opposite") == 1
    assert bow_side(replace(STRAIGHT, load=(0.0, -1.0)).rod, "natural") == 0


@pytest.mark.parametrize(("K0", "chord"), [(0.5, 0.19), (2.0, 0.195), (2.0, 0.12), (5.0, 0.15)])
def test_a_bowed_cable_is_brought_to_its_chord_at_once(K0, chord):
    """A tangent, then Newton's method from as far along its turns as the chord needs: no path in small steps."""
    step = simulate(replace(STRAIGHT, pre_curvature=K0), chords=[chord])[0]
    assert step.good
    assert step.iterations <= 9  # one for the tangent, at most eight of Newton's method


def test_a_leap_to_an_unstable_shape_is_not_taken():
    """An arch under a load across, its ends pressed together: the chord asked for has a shape, but none that stays."""
    test = BendingTest(LENGTH, StickSlip(1e-2, 2.5e-3, 3.0), 5.0, load=(0.0, -5.0), elements=20)
    step = simulate(test, chords=[0.05 * test.zero_chord])[0]
    assert step.outcome is Outcome.BIFURCATION
    # the last stable one, in equilibrium: chord and load have grown by one share
    share = (test.zero_chord - step.chord) / (0.95 * test.zero_chord)
    assert 0.8 < share < 1.0
    V = Potential(replace(test, load=(0.0, -5.0 * share)).rod, step.before)
    q = V.unknowns(step.angles, step.x, step.y)
    assert np.abs(V.gradient(q)[V.free()]).max() < 1e-6 * step.force


def test_a_step_of_newtons_method_turns_no_edge_by_more_than_its_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rod.newton.ITERATIONS", 1)
    test = replace(STRAIGHT, pre_curvature=2.0)
    mounted = test.rod.mounted.angles
    for chord, most in ((0.1 * LENGTH, 0.8), (0.998 * test.zero_chord, None)):  # a short step is taken as a whole
        system = System(test.rod, test.hold("chords", chord), test.rod.virgin)
        balance = system.balance(mounted, np.zeros(2))
        whole = system.solve(balance, -balance.gradient[:, None], -balance.gap[:, None])[0]
        taken = newton(system, Start(mounted, np.zeros(2))).angles - mounted
        assert np.abs(taken).max() == pytest.approx(most or np.abs(whole).max(), rel=1e-9)

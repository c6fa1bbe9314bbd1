"""Where a cable bows to, and what is said when it cannot: never a silent wrong branch."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from rod.bending_test import BendingTest, simulate, table_1
from rod.characteristic import Characteristic
from rod.equilibrium import Outcome, solve
from rod.laws import StickSlip
from rod.newton import Start, descended, newton
from rod.reduction import Hold, System
from rod.support import CLAMP, FREE, Support
from tests.rod.elastica import natural_chord, uniform_equilibrium
from tests.rod.minimum import is_minimum
from tests.rod.potential_energy import Potential
from tests.rod.test_literature import energy

LINEAR = Characteristic.constant(5e-3)
LAW = StickSlip(6e-3, 2.5e-3, 4.0)


def test_natural_and_opposite_branch_of_the_printed_case() -> None:
    test = BendingTest(0.2, LINEAR, 2.0, elements=400)
    natural = simulate(test, chords=[0.195])[0]
    opposite = simulate(test, chords=[0.195], branch="opposite")[0]
    assert natural.good
    assert opposite.good
    # order 2: 1e-4 with 100 elements, a sixteenth of it with 400; the other branch is printed to three decimals
    assert natural.force == pytest.approx(0.610252789, rel=1e-5)
    assert opposite.force == pytest.approx(1.889, abs=1e-3)
    assert natural.y.max() > 0.0 > opposite.y.min()
    for step in (natural, opposite):
        V = Potential(test.rod, step.before)
        assert is_minimum(V, V.unknowns(step.angles, step.x, step.y), V.free())


@pytest.mark.parametrize("K0", [2.0, -2.0])
def test_absolute_sides_do_not_depend_on_the_sign_of_pre_curvature(K0: float) -> None:
    test = BendingTest(0.2, LAW, K0)
    up, down = (simulate(test, chords=[0.17], branch=side)[0] for side in ("up", "down"))
    assert up.good
    assert down.good
    assert up.y[50] > 0.0 > down.y[50]
    natural = simulate(test, chords=[0.17])[0]
    assert natural.force == pytest.approx((up if K0 > 0.0 else down).force, rel=1e-9)


@pytest.mark.parametrize("K0", [0.0, 1e-6, 1e-3, 0.1])
def test_vanishing_pre_curvature_goes_through_the_bifurcation(K0: float) -> None:
    previous = np.inf
    for chord in (0.1999, 0.19, 0.1):
        step = simulate(BendingTest(0.2, LAW, K0), chords=[chord])[0]
        assert step.good
        assert step.y[50] > 0.0
        exact = uniform_equilibrium(LAW, length=0.2, chord=chord, pre_curvature=K0)
        assert step.force == pytest.approx(exact.force, rel=3e-4)  # grid of 100 elements: 1e-4, this law bends more
        assert step.y[50] > 0.2 / previous
        previous = 0.2 / step.y[50]


@pytest.mark.parametrize("chord", [0.1999, 0.19, 0.15, 0.1, 0.05, 0.01, 1e-4])
@pytest.mark.parametrize("K0", [0.0, 0.5, 2.0, 5.0])
def test_from_tension_to_touching_ends(K0: float, chord: float) -> None:
    step = simulate(BendingTest(0.2, LAW, K0, elements=200), chords=[chord])[0]
    exact = uniform_equilibrium(LAW, length=0.2, chord=chord, pre_curvature=K0)
    assert step.outcome is Outcome.CONVERGED
    # grid of 200 elements: 3e-4 where the ends touch and the curvature is five times that of the other tests
    assert step.force == pytest.approx(exact.force, rel=5e-4)
    assert np.abs(step.theta).max() == pytest.approx(exact.theta[0], rel=1e-3)


def test_random_cables_never_end_on_another_shape_silently() -> None:
    rng = np.random.default_rng(20)
    for _ in range(150):
        EI0 = 10.0 ** rng.uniform(-5.0, 0.0)
        law = StickSlip(EI0, EI0 / rng.uniform(1.0, 6.0), rng.uniform(1.0, 8.0))
        K0 = float(rng.choice([0.0, 0.05, 0.5, 2.0, 5.0]))
        # Below 0.999 of the natural chord: nearer to straight, elongation decides and the quadrature has none.
        chord = natural_chord(0.2, K0) * rng.uniform(0.02, 0.999)
        step = simulate(BendingTest(0.2, law, K0), chords=[chord])[0]
        exact = uniform_equilibrium(law, length=0.2, chord=chord, pre_curvature=K0)
        assert step.good
        assert np.abs(step.kappa - exact.kappa).max() < 3e-3 * np.abs(exact.kappa).max()


def test_a_far_warm_start_ends_on_no_loop() -> None:
    """Newton's method alone would wind the cable up into a loop that holds 120 N of tension."""
    test = BendingTest(0.2, StickSlip(1e-2, 2.5e-3, 3.0), 5.0, left=CLAMP, elements=60)
    start = simulate(test, chords=[0.1 * test.zero_chord], branch="down")[0]
    hold = test.hold("chords", 0.95 * test.zero_chord)
    cold, warm = (solve(test.rod, hold, start=given, branch="down") for given in (None, start))
    assert start.good and cold.good and warm.good
    assert warm.force == pytest.approx(cold.force, rel=1e-9)
    assert cold.force == pytest.approx(2.59, abs=0.01)


def test_a_warm_start_on_another_stable_shape_is_not_kept_where_the_force_free_one_leads_to_less_energy() -> None:
    """Bowed down and pressed to a third of its chord a cable holds 1.7 N at twice the energy of its path's end."""
    test = BendingTest(0.2, StickSlip(1e-2, 2.5e-3, 3.0), 10.0, left=CLAMP, elements=60)
    chords = test.zero_chord * np.array([0.1, 0.3, 0.5, 0.95])
    cold = [simulate(test, chords=[chord], branch="down")[0] for chord in chords]
    assert all(step.good for step in cold)
    for start, (chord, least) in itertools.product(cold, zip(chords, cold, strict=True)):
        warm = solve(test.rod, test.hold("chords", chord), start=start, branch="down")
        assert warm.good
        assert warm.force == pytest.approx(least.force, rel=1e-9)
    # and forged: the stable shape itself, which a start alone would keep
    hold = test.hold("chords", chords[1])
    stays = newton(System(test.rod, hold, test.rod.virgin), Start(cold[2].angles, cold[2].right_reaction))
    assert stays.found
    assert System(test.rod, hold, test.rod.virgin).excess_negatives(stays.balance) == 0
    held = replace(cold[1], angles=stays.angles, right_reaction=stays.R)
    assert -stays.R[0] == pytest.approx(1.747, abs=1e-3)
    assert solve(test.rod, hold, start=held, branch="down").force == pytest.approx(cold[1].force, rel=1e-9)


def test_a_start_wound_up_in_a_loop_is_dropped() -> None:
    """A loop between free bearings is a stable equilibrium too: of a cable pressed together, it pulls with 0.5 kN."""
    test = BendingTest(0.2, LINEAR, -2.0, elements=60)
    hold = test.hold("chords", 0.95 * test.zero_chord)
    cold, system = solve(test.rod, hold), System(test.rod, hold, test.rod.virgin)
    share = (np.arange(62) + 0.5) / 62
    loop = newton(system, Start(2.0 * np.cos(np.pi * share) - 2.0 * np.pi * share, np.zeros(2)))
    assert loop.found
    assert system.excess_negatives(loop.balance) == 0
    assert -loop.R[0] < -500.0
    warm = solve(test.rod, hold, start=replace(cold, angles=loop.angles, right_reaction=loop.R))
    exact = uniform_equilibrium(LINEAR, length=0.2, chord=hold.chord, pre_curvature=2.0)  # of the mirrored cable
    assert warm.good
    assert warm.force == pytest.approx(exact.force, rel=1e-3)  # 60 elements


@pytest.mark.parametrize("control", ["chord", "force", "tip"])
def test_no_start_leads_to_more_energy_than_none(control: str) -> None:
    """Stable shapes found downhill from random ones, as starts: what converges has the energy of the cold solution."""
    rng, stable = np.random.default_rng(26), 0
    ends = {"tip": [{"left": CLAMP, "right": FREE}]}
    others = [{}, {"left": CLAMP}, {"right": CLAMP}, {"left": CLAMP, "right": CLAMP}, {"left": Support(stiffness=0.02)}]
    for case in range(10):
        held = ends.get(control, others)
        K0, load = (
            float(rng.choice([0.0, 0.5, 2.0, 5.0, -3.0, 25.0])),
            tuple(rng.choice([0.0, 1.0]) * rng.normal(size=2)),
        )
        test = BendingTest(0.2, LAW, K0, load=load, elements=30, **held[case % len(held)])
        chord, force, tip = test.zero_chord * rng.uniform(0.1, 0.99), rng.uniform(-0.5, 2.0), rng.normal(size=2)
        hold = {"chord": Hold(chord=chord), "force": Hold(force=force), "tip": Hold(tip=tuple(tip))}[control]
        cold, system = solve(test.rod, hold), System(test.rod, hold, test.rod.virgin)
        for _ in range(4):
            s = np.linspace(0.0, 1.0, test.rod.edges.size)
            waves = sum(rng.normal() * 3.0 / k * np.cos(k * np.pi * s) for k in (1, 2, 3))
            rest = descended(system, Start(waves + rng.integers(-1, 2) * 2.0 * np.pi * s, rng.normal(size=2)))
            if not rest.found:
                continue
            stable += 1
            warm = solve(test.rod, hold, start=replace(cold, angles=rest.angles, right_reaction=rest.R))
            assert warm.outcome is cold.outcome
            if warm.good:
                assert energy(warm) == pytest.approx(energy(cold), abs=1e-6 * LAW.EI0 / 0.2)
    assert stable > 20


def test_a_start_on_the_other_side_is_not_natural_where_a_cable_is_bent_both_ways() -> None:
    test = BendingTest(0.2, LINEAR, lambda t: 0.5 + 5.0 * np.sin(2.0 * np.pi * t), elements=40)
    hold = test.hold("chords", 0.12)
    down = solve(test.rod, hold, branch="down")
    assert down.y[20] < 0.0
    natural = solve(test.rod, hold, start=down)
    assert natural.good
    assert natural.y[20] > 0.0
    assert energy(natural) < 0.95 * energy(down)


def arch(load: float) -> BendingTest:
    """A shallow two-hinged arch between fixed bearings, pressed down by a distributed load, N/m."""
    return BendingTest(0.2, LINEAR, 2.0, load=(0.0, -load))


def test_loaded_arch_buckles_sideways_at_the_textbook_thrust() -> None:
    # A shallow arch goes over into the second mode of the straight bar, at four times its Euler load.
    steps = [simulate(arch(q), chords=[arch(q).zero_chord])[0] for q in (5.0, 9.0, 9.8, 10.3, 20.0)]
    assert [step.good for step in steps] == [True, True, True, False, False]
    assert steps[2].force < 4.0 * np.pi**2 * 5e-3 / 0.2**2 * 1.01
    for lost in steps[3:]:
        assert lost.outcome is Outcome.BIFURCATION
        assert lost.force == pytest.approx(4.0 * np.pi**2 * 5e-3 / 0.2**2, rel=0.03)  # how far the path got
        assert lost.y[50] > 0.009


def test_shape_after_the_snap_is_found_when_asked_for() -> None:
    down = simulate(arch(20.0), chords=[arch(20.0).zero_chord], branch="down")[0]
    assert down.good
    assert down.y[50] < 0.0
    # no start makes it the natural one: the equilibria from the force-free shape on end before
    test = replace(arch(20.0), pre_curvature=lambda t: 2.0 * np.sin(np.pi * t) - 1e-3)
    snapped = simulate(test, chords=[test.zero_chord], branch="down")[0]
    assert snapped.good
    assert simulate(test, chords=[test.zero_chord], starts=[snapped])[0].outcome is Outcome.BIFURCATION


@pytest.mark.parametrize("branch", ["up", "down", "jump"])
def test_a_trial_without_patience_ends_where_the_path_from_the_force_free_shape_does(branch: str) -> None:
    test = arch(20.0)
    asked = test.hold("displacements", 0.0)
    trial, patient = (solve(test.rod, asked, branch=branch, patient=given) for given in (False, True))
    assert trial.outcome is Outcome.BIFURCATION
    assert trial.iterations < patient.iterations


HELD = {"left": {"left": CLAMP}, "right": {"right": CLAMP}, "spring": {"left": Support(stiffness=0.125)}}


@pytest.mark.parametrize("K0", [1e-6, 1e-4, 1e-3, 3e-3, 1e-2])
@pytest.mark.parametrize("held", HELD)
def test_a_nearly_straight_bar_follows_the_straight_one_round_the_corner_where_that_buckles(held, K0) -> None:
    """Beside its path lies another one, bowed to the other side, that begins at nothing and loses its stability."""
    straight, bent = (BendingTest(0.2, LINEAR, bend, elements=60, **HELD[held]) for bend in (0.0, K0))
    near, step = (simulate(test, chords=[0.02])[0] for test in (straight, bent))
    assert step.good and step.iterations < 300  # once round the corner, steps grow by and by: half of it
    assert step.force * 0.2**2 / 5e-3 == pytest.approx(near.force * 0.2**2 / 5e-3, abs=10.0 * K0 * 0.2)  # order of K0 L
    load = 1.005 * simulate(straight, chords=[0.9999 * 0.2])[0].force
    near, step = (simulate(test, forces=[load])[0] for test in (straight, bent))
    assert step.good
    assert step.chord / 0.2 == pytest.approx(near.chord / 0.2, abs=5.0 * K0 * 0.2)


@pytest.mark.parametrize("K0", [-1e-2, -1e-4, -1e-6, 1e-6, 1e-4, 1e-2])
def test_the_least_pre_curvature_tells_the_side_to_which_a_column_buckles(K0: float) -> None:
    column = BendingTest(0.2, LINEAR, K0, elements=60, left=CLAMP, right=FREE)
    step = solve(column.rod, Hold(tip=(-0.5 * np.pi**2 * 5e-3 / 0.2**2, 0.0)))
    assert step.good and step.y[-1] * K0 < 0.0  # curvature K0 = -dtheta/ds turns the free end down


@pytest.mark.parametrize("K0", [0.0, 1e-3, 0.1])
def test_a_symmetric_bow_that_jumps_does_not_stay_on_a_saddle(K0: float) -> None:
    """Softening, it bows ever farther under its load, its ends pass each other, and it turns round one bearing."""
    test = BendingTest(0.2, StickSlip(5e-3, 3e-3, 7.0), K0, elements=60)
    step = simulate(test, forces=[6.0 * np.pi**2 * 5e-3 / 0.2**2], branch="jump")[0]
    assert step.good
    assert step.chord == pytest.approx(-0.2, rel=1e-4)
    V = Potential(test.rod, step.before)
    assert is_minimum(V, V.unknowns(step.angles, step.x, step.y), V.free(x_imposed=False))


@pytest.mark.parametrize("K0", [5.0, 8.0])
def test_other_side_of_a_taut_cable_does_not_exist(K0: float) -> None:
    step = simulate(BendingTest(0.2, LINEAR, K0), chords=[0.1999], branch="down")[0]
    assert step.outcome is Outcome.WRONG_BRANCH
    assert step.force < 0.0


@pytest.mark.parametrize("displacement", [0.03, 0.06])
def test_limit_point_of_the_secant_reading_is_named(displacement: float) -> None:
    test = table_1("secant")
    beyond = simulate(test, np.array([0.005, 0.010, displacement]))
    assert [step.outcome for step in beyond] == [Outcome.CONVERGED, Outcome.CONVERGED, Outcome.LIMIT_POINT]
    assert "m" in Outcome.LIMIT_POINT.advice


def test_limit_point_lies_where_the_tangent_vanishes() -> None:
    # K0 = 2: 12.67 1/m. Just below it is still an equilibrium, beyond it is none.
    test = table_1("secant")
    steps = simulate(test, np.r_[0.005, 0.015, np.arange(0.0196, 0.0206, 0.0001)])
    good = [step.kappa.max() for step in steps if step.good]
    assert 12.3 < max(good) < 12.67
    assert steps[-1].outcome is Outcome.LIMIT_POINT
    assert all(step.outcome in (Outcome.CONVERGED, Outcome.LIMIT_POINT) for step in steps)


def test_negative_stiffness_inside_the_range_is_a_limit_point_too() -> None:
    law = Characteristic.from_ordinates([0.0, 4.0, 6.0, 8.0, 12.0], [5e-3, 2e-3, -1e-3, 2e-3, 5e-3])
    step = simulate(BendingTest(0.2, law, 2.0), [0.02])[0]
    assert step.outcome is Outcome.LIMIT_POINT


def test_a_law_in_waves_is_followed_warm_and_cold_as_far_as_there_is_an_equilibrium() -> None:
    """From one step to the next Newton's method ends where the moment falls; from the force-free shape it does not."""
    knots = [2.18, 2.61, 3.08, 3.59, 4.15, 4.75, 5.39, 6.08, 6.8, 7.58, 8.39, 9.25]
    f = [10.06e-3, 8.04e-3, 5.33e-3, 2.9e-3, 5.92e-3, 5.36e-3, 1.24e-3, 2.79e-3, 4.54e-3, 0.82e-3, 3.32e-3, 1.2e-3]
    law = Characteristic.from_ordinates(knots, f)
    test, chords = BendingTest(0.2, law, 2.18), [0.1934, 0.1884, 0.1834, 0.1859, 0.1909]
    warm = simulate(test, chords=chords, branch="up")
    for chord, step in zip(chords, warm, strict=True):
        cold = simulate(test, chords=[chord], branch="up")[0]
        assert step.outcome is cold.outcome
        if chord == 0.1834:  # the quadrature finds none either
            assert step.outcome is Outcome.LIMIT_POINT
            assert step.kappa.max() < 9.3
            with pytest.raises(ValueError, match="no bowed equilibrium"):
                uniform_equilibrium(law, length=0.2, chord=chord, pre_curvature=2.18)
            continue
        exact = uniform_equilibrium(law, length=0.2, chord=chord, pre_curvature=2.18)
        assert step.force == pytest.approx(exact.force, rel=1e-4)  # 100 elements
        assert cold.force == pytest.approx(step.force, rel=1e-8)


def test_impossible_chords_are_unreachable() -> None:
    test = table_1("tangent")
    for chord in (0.2, 0.25, 0.0, -0.01):
        step = simulate(test, chords=[chord])[0]
        assert step.outcome is Outcome.UNREACHABLE
        assert not step.good
        assert step.outcome.advice


def test_each_outcome_gives_advice() -> None:
    for outcome in Outcome:
        assert len(outcome.advice) > 20


def test_clamped_ends_hide_a_constant_pre_curvature() -> None:
    # Physics notes: with clamped ends a constant K0 does not change the shape, hence pinned ends in the test.
    def clamped(K0: float) -> BendingTest:
        return BendingTest(0.2, LINEAR, K0, left=Support("clamp", angle=0.0), right=Support("clamp", angle=0.0))

    straight = simulate(clamped(0.0), chords=[0.19], branch="up")[0]
    for K0 in (1.0, 2.0):
        bent = simulate(clamped(K0), chords=[0.19], branch="up")[0]
        assert np.allclose(bent.y, straight.y, atol=1e-9)
        assert bent.force == pytest.approx(straight.force, rel=1e-7)
    pinned = {K0: simulate(BendingTest(0.2, LINEAR, K0), chords=[0.19])[0].force for K0 in (0.0, 2.0)}
    assert 1.0 - pinned[2.0] / pinned[0.0] == pytest.approx(0.36, abs=5.1e-3)


def test_clamped_rod_buckles_at_four_times_the_pinned_load() -> None:
    clamp = Support("clamp", angle=0.0)
    for left, right, factor in [
        (Support(), Support(), 1.0),
        (clamp, Support(), 2.0457),
        (Support(), clamp, 2.0457),
        (clamp, clamp, 4.0),
    ]:
        test = BendingTest(0.2, LINEAR, 0.0, left=left, right=right, elements=200)
        step = simulate(test, chords=[0.2 * (1.0 - 1e-4)])[0]
        assert step.good
        # the force rises with the shortening of 1e-4, by half of it for pinned ends; 2.0457 has five digits
        assert step.force == pytest.approx(factor * np.pi**2 * 5e-3 / 0.2**2, rel=3e-4)


def test_warm_start_on_the_other_side_is_not_kept() -> None:
    test = BendingTest(0.2, LAW, 2.0)
    other = simulate(test, chords=[0.17], branch="down")[0]
    step = simulate(test, chords=[0.17], starts=[other])[0]
    assert step.good
    assert step.y[50] > 0.0


def test_unloaded_between_good_steps_continues_after_a_bad_one() -> None:
    test = table_1("secant")
    steps = simulate(test, [0.005, 0.06, 0.005])
    assert not steps[1].good
    assert steps[2].good
    assert steps[2].force == pytest.approx(steps[0].force, rel=1e-9)
    assert replace(test, zero="length").zero_chord == 0.2


def test_a_state_beyond_all_numbers_is_left_at_once() -> None:
    """A step on from moments of 1e175 N m, which a trial law made, overflowed."""
    test = BendingTest(0.2, 0.01)
    angles = 1e130 * np.cos(np.arange(len(test.rod.edges)))
    trial = newton(System(test.rod, Hold(chord=0.18), test.rod.virgin), Start(angles, np.zeros(2)))
    assert (trial.outcome, trial.steps) == (Outcome.STALLED, 1)

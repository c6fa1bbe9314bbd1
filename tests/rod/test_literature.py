"""Truth from books and closed forms for every support, load and control, cold and warm, limits and jumps included.

    Mattiasson, Int. J. Num. Meth. Eng. 17 (1981), pp. 145-153, Table 1: cantilever, force across its tip
    Bisshopp and Drucker, Quart. Appl. Math. 3 (1945), pp. 272-275: the same by elliptic integrals
    Greenhill, Proc. Camb. Phil. Soc. 4 (1881), pp. 65-73: column under its own weight, 7.837
    Timoshenko and Gere, Theory of Elastic Stability, 2nd ed. (1961), Art. 2.7 (the elastica), p. 78, Table 2-4
    Castigliano's theorem

Pages are as others cite them: of articles those of the whole article, of the book the page that the verification manual
of ANSYS, problem VM136, names for the loads from 1.015 to 1.884 and, from 60 degrees on, the places of the tip, which
are those here. Each row of the table is held against the elliptic integral that it was computed from. Critical loads of
other ends (chapter 2 of the book) are roots of their own equations, given beside them. Where no table exists, scipy's
collocation solver, which knows neither edges nor joints.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from rod.bending_test import BendingTest, simulate
from rod.characteristic import Characteristic
from rod.equilibrium import Equilibrium, Outcome, solve
from rod.newton import Start, newton
from rod.reduction import Hold, System
from rod.support import Support
from tests.rod.elastica import uniform_equilibrium
from tests.rod.minimum import is_minimum
from tests.rod.potential_energy import Potential

EI, LENGTH = 5e-3, 0.2
UNIT = EI / LENGTH**2
EULER = np.pi**2 * UNIT
LINEAR = Characteristic.constant(EI)
CLAMP = Support("clamp", angle=0.0)
STRAIGHT = BendingTest(LENGTH, LINEAR)
CANTILEVER = BendingTest(LENGTH, LINEAR, left=CLAMP, right=Support("free"), elements=200)
NO_FORCE = Hold(tip=(0.0, 0.0))

#: Timoshenko and Gere, chapter 2: critical load over Euler's for the ends of a bar.
CASES = {
    "pinned": (STRAIGHT, 1.0),
    "clamped-pinned": (replace(STRAIGHT, left=CLAMP), 20.190728556 / np.pi**2),  # tan u = u
    "pinned-clamped": (replace(STRAIGHT, right=CLAMP), 20.190728556 / np.pi**2),
    "clamped": (replace(STRAIGHT, left=CLAMP, right=CLAMP), 4.0),
}


def tip_load(test: BendingTest, x: float, y: float, branch="natural") -> Equilibrium:
    return solve(test.rod, Hold(tip=(x, y)), branch=branch)


def proven(step: Equilibrium) -> bool:
    """Minimum of Eq. (4) by Cholesky's factors of its Hessian in positions and angles, not the reduced one."""
    V = Potential(step.rod, step.before)
    x_free, y_free = (not imposed for imposed in step.hold.imposed)
    free = V.free(x_imposed=not x_free, y_imposed=not y_free)
    return is_minimum(V, V.unknowns(step.angles, step.x, step.y), free)


def energy(step: Equilibrium) -> float:
    """Potential energy, J: that of Eq. (4), less imposed forces at the right end times its place."""
    V = Potential(step.rod, step.before)
    ends = zip(step.hold.imposed, step.right_reaction, (step.x, step.y), strict=True)
    return V.value(V.unknowns(step.angles, step.x, step.y)) - sum(R * at[-1] for imposed, R, at in ends if not imposed)


# Cantilevers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("load", "down", "short", "slope"),
    [
        (1.0, 0.30172, 0.05643, 0.46135),
        (2.0, 0.49346, 0.16064, 0.78175),
        (5.0, 0.71379, 0.38763, 1.21537),
        (10.0, 0.81061, 0.55500, 1.43029),
    ],
)
def test_mattiasson_table_1_cantilever_under_a_tip_load(load, down, short, slope):
    coarse, fine = (tip_load(replace(CANTILEVER, elements=n), 0.0, -load * UNIT) for n in (100, 200))
    assert fine.good
    for name, printed, scale in (("y", -down, LENGTH), ("x", 1.0 - short, LENGTH), ("theta", -slope, 1.0)):
        rough, better = (getattr(step, name)[-1] / scale for step in (coarse, fine))
        # five printed digits, once the error of second order is taken out; the tangent angle ends half an element early
        assert (4.0 * better - rough) / 3.0 == pytest.approx(printed, abs=1.2e-5)


@pytest.mark.parametrize("load", [0.25, 1.0, 4.0, 9.0])
def test_bisshopp_and_drucker_elliptic_integrals(load):
    def amplitude(p):  # modulus squared p = (1 + sin of the tip's slope) / 2
        return np.arcsin(1.0 / np.sqrt(2.0 * p))

    root = np.sqrt(load)
    p = brentq(lambda p: ellipk(p) - ellipkinc(amplitude(p), p) - root, 0.5 + 1e-12, 1.0 - 1e-12, xtol=1e-15)
    down = 1.0 - 2.0 / root * (ellipe(p) - ellipeinc(amplitude(p), p))
    across = np.sqrt(2.0 * (2.0 * p - 1.0)) / root
    step = tip_load(CANTILEVER, 0.0, -load * UNIT)
    assert step.y[-1] / LENGTH == pytest.approx(-down, abs=2e-5)  # order 2, 200 elements
    assert step.x[-1] / LENGTH == pytest.approx(across, abs=2e-5)


#: Timoshenko and Gere, p. 78, Table 2-4: slope of the tip in degrees, P / P_cr, x_a / l, y_a / l.
TABLE_2_4 = [
    (20, 1.015, 0.970, 0.220),
    (40, 1.063, 0.881, 0.422),
    (60, 1.152, 0.741, 0.593),
    (80, 1.293, 0.560, 0.719),
    (100, 1.518, 0.349, 0.792),
    (120, 1.884, 0.123, 0.803),
    (140, 2.541, -0.107, 0.750),
    (160, 4.029, -0.340, 0.625),
    (176, 9.116, -0.577, 0.421),
]


@pytest.mark.parametrize(("degrees", "ratio", "x", "y"), TABLE_2_4)
def test_timoshenko_and_gere_table_2_4_buckled_cantilever(degrees, ratio, x, y):
    exact = (2.0 / np.pi * ellipk(np.sin(0.5 * np.radians(degrees)) ** 2)) ** 2
    assert exact == pytest.approx(ratio, abs=1.3e-3)  # printed with up to one unit of the last digit too little
    for branch, side in (("natural", 1.0), ("down", -1.0)):
        step = tip_load(CANTILEVER, -0.25 * exact * EULER, 0.0, branch)
        assert step.good
        assert step.x[-1] / LENGTH == pytest.approx(x, abs=1e-3)  # printed digits and 200 elements
        assert side * step.y[-1] / LENGTH == pytest.approx(y, abs=1e-3)
        assert proven(step)


def test_cantilever_below_its_critical_load_stays_straight():
    for ratio in (0.5, 0.9, 0.99):
        step = tip_load(CANTILEVER, -0.25 * ratio * EULER, 0.0)
        assert step.good
        assert np.abs(step.y).max() < 1e-12


GREENHILL = 7.837347  # q L^3 / EI, the first zero of the Bessel function of order -1/3: 9/4 * 1.866351^2


def weight(q: float, **changes) -> BendingTest:
    return replace(CANTILEVER, load=(-q * EI / LENGTH**3, 0.0), **changes)


def test_greenhill_column_under_its_own_weight():
    below, above = (solve(weight(f * GREENHILL).rod, NO_FORCE) for f in (0.999, 1.001))
    assert below.good
    assert above.good
    assert np.abs(below.y).max() < 1e-12
    assert above.y[-1] > 0.02 * LENGTH
    warm = solve(above.rod, NO_FORCE, start=below)
    assert warm.y[-1] == pytest.approx(above.y[-1], rel=1e-6)


@pytest.mark.parametrize("q", [9.0, 20.0, 60.0])
def test_column_buckled_by_its_own_weight_against_collocation_with_order_2(q):
    steps = [solve(weight(q, elements=n).rod, NO_FORCE) for n in (50, 100, 200)]
    assert all(step.good for step in steps)
    assert proven(steps[-1])

    def slopes(s, state):  # lengths over L, moment over EI/L; m' = f . n with f = -q (1 - s) along x
        _, _, theta, m = state
        return np.array([np.cos(theta), np.sin(theta), -m, q * (1.0 - s) * np.sin(theta)])

    def ends(first, last):
        return np.array([first[0], first[1], first[2], last[3]])

    guess = steps[-1]
    state = np.array([guess.x / LENGTH, guess.y / LENGTH, guess.theta, guess.kappa * LENGTH])
    found = solve_bvp(slopes, ends, guess.s / LENGTH, state, tol=1e-9, max_nodes=20000)
    assert found.success
    errors = [abs(step.y[-1] / LENGTH - found.sol(1.0)[1]) for step in steps]
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.15)
    assert errors[1] / errors[2] == pytest.approx(4.0, abs=0.05)
    assert errors[2] < 1e-4


# Force control --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", CASES)
def test_euler_cases_are_straight_below_and_buckled_above_cold_and_warm(case):
    test, factor = CASES[case]
    shares = np.array([0.3, 0.8, 0.999, 1.002, 1.05, 1.1, 1.05, 0.999, 0.5])
    loads = shares * factor * EULER
    warm = simulate(test, forces=loads)
    cold = [simulate(test, forces=[load])[0] for load in loads]
    down = [simulate(test, forces=[load], branch="down")[0] for load in loads]
    for share, load, *steps in zip(shares, loads, warm, cold, down, strict=True):
        for step in steps:
            assert step.good
            assert step.force == pytest.approx(load, rel=1e-12)
            assert (np.abs(step.y).max() > 1e-3) == (share > 1.0)
            assert proven(step)
        assert steps[0].chord == pytest.approx(steps[1].chord, rel=1e-9)
        assert np.allclose(steps[2].y, -steps[1].y, atol=1e-9)
    # load over critical load = 1 + a^2/8 for pinned and clamped ends (Timoshenko and Gere, Art. 2.7)
    if case in ("pinned", "clamped"):
        slope = np.abs(cold[4].theta).max()
        assert shares[4] == pytest.approx(1.0 + slope**2 / 8.0, abs=2e-3)


@pytest.mark.parametrize(("degrees", "ratio", "x", "y"), TABLE_2_4[:6])
def test_timoshenko_and_gere_table_2_4_pinned_bar_under_its_load(degrees, ratio, x, y):
    # A pinned bar of length 2 l is two cantilevers of length l.
    exact = (2.0 / np.pi * ellipk(np.sin(0.5 * np.radians(degrees)) ** 2)) ** 2
    step = simulate(STRAIGHT, forces=[exact * EULER])[0]
    assert step.good
    # 100 elements: 8e-5 of the critical load, which is 0.05 degrees where the load is 1.5 % above it
    assert np.degrees(step.theta[0]) == pytest.approx(degrees, abs=0.06)
    assert step.chord / LENGTH == pytest.approx(x, abs=1e-3)
    assert step.y.max() / (0.5 * LENGTH) == pytest.approx(y, abs=1e-3)


def test_bar_on_springs_buckles_where_the_transcendental_equation_says():
    # Timoshenko and Gere, chapter 2: equal springs c, symmetric mode: tan u = -2 EI u / (c L), u = kL/2.
    for spring in (0.5, 2.0, 10.0):  # c L / EI
        u = brentq(lambda u, c=spring: c * np.sin(u) + 2.0 * u * np.cos(u), 0.5 * np.pi, np.pi)
        held = Support(stiffness=spring * EI / LENGTH)
        test = replace(STRAIGHT, left=held, right=held)
        below, above = simulate(test, forces=np.array([0.998, 1.002]) * (2.0 * u) ** 2 * UNIT)
        assert below.good
        assert above.good
        assert np.abs(below.y).max() < 1e-12
        assert above.y.max() > 1e-3


def test_force_of_a_clamped_and_pinned_bar_has_a_largest_value_where_it_jumps():
    """Its force rises to 1.14 times the critical load and falls: a limit point, by collocation at given chords."""

    def force(chord: float) -> float:
        near = simulate(CASES["clamped-pinned"][0], chords=[chord], branch="up")[0]

        def slopes(s, state, R):
            _, _, theta, m = state
            return np.array([np.cos(theta), np.sin(theta), -m, R[1] * np.cos(theta) - R[0] * np.sin(theta)])

        def ends(first, last, R):
            return np.array([first[0], first[1], first[2], last[0] - chord / LENGTH, last[1], last[3]])

        state = np.array([near.x / LENGTH, near.y / LENGTH, near.theta, near.kappa * LENGTH])
        found = solve_bvp(slopes, ends, near.s / LENGTH, state, p=near.right_reaction / UNIT, tol=1e-8)
        assert found.success
        return -found.p[0] * UNIT

    chords = np.array([0.105, 0.109, 0.113])
    curve = np.polyfit(chords, [force(c) for c in chords], 2)
    top, largest = -0.5 * curve[1] / curve[0], np.polyval(curve, -0.5 * curve[1] / curve[0])
    assert largest == pytest.approx(1.139 * CASES["clamped-pinned"][1] * EULER, rel=1e-3)
    for load in (1.2 * largest, 2.0 * largest):
        lost = simulate(CASES["clamped-pinned"][0], forces=[load])[0]
        assert lost.outcome is Outcome.TURNING_POINT
        assert lost.force == pytest.approx(largest, rel=5e-4)  # 100 elements
        assert lost.chord == pytest.approx(top, abs=1e-3)
        assert "jump" in lost.outcome.advice
    rest = simulate(CASES["clamped-pinned"][0], forces=[1.2 * largest], branch="jump")[0]
    assert rest.good
    assert rest.chord < 0.0  # pulled straight, to the other side of the clamp
    assert proven(rest)


def test_pinned_bar_turns_away_when_its_ends_meet():
    # 2 E(k) = K(k): slope 130.7 degrees; from there on the bar is free to turn about both bearings at once.
    k2 = brentq(lambda k2: 2.0 * ellipe(k2) - ellipk(k2), 0.1, 0.99)
    lost = simulate(STRAIGHT, forces=[3.0 * EULER])[0]
    assert lost.outcome is Outcome.BIFURCATION
    assert lost.force == pytest.approx(4.0 * ellipk(k2) ** 2 * UNIT, rel=1e-3)
    assert abs(lost.chord) < 1e-4
    assert np.degrees(lost.theta[0]) == pytest.approx(130.7, abs=0.1)
    rest = simulate(STRAIGHT, forces=[3.0 * EULER], branch="jump")[0]
    assert rest.good
    assert rest.chord == pytest.approx(-LENGTH, rel=1e-6)


@pytest.mark.parametrize("beyond", [1e-6, 1e-4, 2e-3])
def test_a_bar_bows_by_the_root_of_what_its_load_is_beyond_the_critical_one(beyond):
    """Timoshenko and Gere, Art. 2.7: 1 + a^2 / 8 times the critical load, here that of n elements in closed form."""
    n = STRAIGHT.rod.elements.size
    critical = EULER * (np.sin(0.5 * np.pi / n) / (0.5 * np.pi / n)) ** 2
    step = simulate(STRAIGHT, forces=[(1.0 + beyond) * critical])[0]
    assert step.good
    assert step.force == pytest.approx((1.0 + beyond) * critical, rel=1e-12)
    assert step.theta.max() == pytest.approx(np.sqrt(8.0 * beyond), rel=2e-3)


@pytest.mark.parametrize(("K0", "elements"), [(0.0, 100), (1.0, 60), (2.0, 60), (2.0, 100)])
def test_a_bow_whose_ends_meet_bears_no_larger_force(K0, elements):
    """Where the ends meet another branch leaves the path; it must not be taken for one that bears the force asked."""
    largest = uniform_equilibrium(LINEAR, length=LENGTH, chord=1e-9, pre_curvature=K0).force  # quadrature
    test = replace(STRAIGHT, pre_curvature=K0, elements=elements)
    for load in (1.05 * largest, 3.0):
        lost = simulate(test, forces=[load])[0]
        assert lost.outcome is Outcome.BIFURCATION
        assert lost.force == pytest.approx(largest, rel=2e-3)  # 60 elements


# Displacement control, coils, jumps -----------------------------------------------------------------------------------


def test_straight_cable_at_displacement_zero_is_itself():
    for test, _ in CASES.values():
        for step in (simulate(test, [0.0])[0], simulate(test, [0.01, 0.0])[1]):
            assert step.good
            assert np.abs(step.y).max() < 1e-12 * LENGTH + 1e-9
            assert abs(step.force) < 1e-6 * EULER
    assert simulate(STRAIGHT, [-1e-6])[0].outcome is Outcome.UNREACHABLE


@pytest.mark.parametrize("turn", [6.4, 6.6, 7.0, 8.0, 9.0, 11.0])
def test_coils_are_as_soft_as_castigliano_says(turn):
    """Ends of an arc pushed together by d: P = EI d / int y^2 ds, y over the chord of the force-free arc."""
    K0 = turn / LENGTH
    s = np.linspace(0.0, LENGTH, 20001)
    x, y = np.sin(K0 * s) / K0, (np.cos(K0 * s) - 1.0) / K0
    chord = np.hypot(x[-1], y[-1])
    height = (x[-1] * y - y[-1] * x) / chord
    d = 1e-3 * chord
    expected = EI * d / np.trapezoid(height**2, s)
    coil = BendingTest(LENGTH, LINEAR, K0, elements=200)
    for step in (simulate(coil, [d])[0], simulate(coil, [0.5 * d, d])[1]):
        assert step.good
        assert step.force == pytest.approx(expected, rel=3e-3)  # d is finite: terms of order d / chord
        assert proven(step)


def test_a_coil_is_not_left_on_a_start_of_far_more_energy():
    coil = BendingTest(LENGTH, LINEAR, 7.0 / LENGTH)
    hold = coil.hold("displacements", 1e-3)
    truth = solve(coil.rod, hold)
    system = System(coil.rod, hold, coil.rod.virgin)
    bowed = 2.3 * np.cos(np.pi * (np.cumsum(coil.rod.edges) - 0.5 * coil.rod.edges) / LENGTH)
    wrong = newton(system, Start(bowed, np.array([-5.0, 0.0])))
    assert wrong.found
    assert system.excess_negatives(wrong.balance) == 0
    assert abs(wrong.R[0]) > 20.0 * truth.force
    step = solve(coil.rod, hold, start=replace(truth, angles=wrong.angles, right_reaction=wrong.R))
    assert step.good
    assert step.force == pytest.approx(truth.force, rel=1e-6)
    assert energy(step) == pytest.approx(energy(truth), rel=1e-9)
    assert energy(truth) < 0.1 * EI * (7.0 / LENGTH) ** 2 * LENGTH


@pytest.mark.parametrize("force", [0.2, 0.3, 1.0])
def test_the_ends_of_a_coil_do_not_pass_each_other(force):
    """Where the ends meet a pinned cable turns freely; from 0.22 N on the shape behind is stable again, by itself."""
    coil = BendingTest(LENGTH, LINEAR, 6.0 / LENGTH)
    meeting = simulate(coil, chords=[1e-6])[0].force
    assert simulate(coil, forces=[0.99 * meeting])[0].good
    for steps in ([force], [0.5 * meeting, force]):
        stopped = simulate(coil, forces=steps)[-1]
        assert stopped.outcome is Outcome.BIFURCATION
        assert abs(stopped.chord) < 1e-6 and abs(stopped.force - meeting) < 1e-3 * meeting
    assert simulate(coil, forces=[force], branch="jump")[0].good
    assert simulate(replace(coil, load=(0.0, -0.05)), forces=[force])[0].outcome is Outcome.BIFURCATION
    spring = Support(stiffness=1e-3)
    held = simulate(replace(coil, left=spring, right=spring), forces=[force])[0]
    assert held.good and held.chord < 0.0  # stable all the way, in steps of any length


def test_energy_of_a_dead_force_is_that_of_castigliano():
    # d(energy)/d(force) = the place where it acts: chord for P in compression, minus the tip's place for its force
    low, mid, high = (simulate(arch(0.0), forces=[f])[0] for f in (0.2999, 0.3, 0.3001))
    assert (energy(high) - energy(low)) / 2e-4 == pytest.approx(mid.chord, rel=1e-6)
    low, mid, high = (tip_load(CANTILEVER, 0.0, f * UNIT) for f in (1.999, 2.0, 2.001))
    assert (energy(high) - energy(low)) / (2e-3 * UNIT) == pytest.approx(-mid.y[-1], rel=1e-5)


def arch(load: float) -> BendingTest:
    return BendingTest(LENGTH, LINEAR, 2.0, load=(0.0, -load))


def test_arch_past_its_limit_jumps_to_the_shape_below():
    test = arch(20.0)
    stays = simulate(test, chords=[test.zero_chord])[0]
    jumped = simulate(test, chords=[test.zero_chord], branch="jump")[0]
    asked = simulate(test, chords=[test.zero_chord], branch="down")[0]
    assert stays.outcome is Outcome.BIFURCATION
    assert jumped.good
    assert proven(jumped)
    assert jumped.y[50] < 0.0
    assert np.allclose(jumped.y, asked.y, atol=1e-8)
    held = simulate(arch(5.0), chords=[test.zero_chord], branch="jump")[0]
    assert held.y[50] > 0.0  # nothing jumps below the limit
    assert simulate(test, chords=[test.zero_chord], branch="up")[0].outcome is Outcome.WRONG_BRANCH

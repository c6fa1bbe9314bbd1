"""Eq. (4) itself: gradient and Hessian, equilibria as its minima, and the bookkeeping of work and energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from rod.bending_test import BendingTest, simulate
from rod.equilibrium import Equilibrium
from rod.laws import StickSlip
from rod.reduction import System, negative_pivots
from rod.section import InternalFriction
from rod.support import Support
from tests.rod.minimum import is_minimum
from tests.rod.potential_energy import HALF_BANDWIDTH, Potential

LAW = StickSlip(6e-3, 2.5e-3, 4.0)
SOFT = {"axial_stiffness": 400.0, "shear_stiffness": 250.0}  # strains that matter: nothing hides behind rigidity
PLAIN = BendingTest(0.2, LAW, 2.0, elements=30, **SOFT)
EVERYTHING = replace(
    PLAIN,
    pre_curvature=lambda xi: 2.0 + 0.5 * xi,
    stiffness_profile=lambda xi: 1.0 + 0.1 * np.sin(3.0 * xi),
    load=(0.05, 0.1),
    left=Support(stiffness=2e-3, friction_moment=3e-4, rigid_length=4e-3, moment=1e-4),
    right=Support(stiffness=1e-3, friction_moment=2e-4),
    friction=InternalFriction(1e-3, 1.5, beside=InternalFriction(5e-4, 2.0, elements=2, gradual=True)),
    plastic_rate=0.05,
    grown=np.full((2, 31), 0.2),
)


def test_the_border_is_how_forces_at_the_end_move_the_balance_of_a_soft_rod():
    """And how the end moves with the angles: one energy, so one matrix; both by differences."""
    step = simulate(PLAIN, [0.01])[0]
    angles, R, n = step.angles, step.right_reaction, step.angles.size
    told = step.system.border(step.balance.edge)
    for k, unit in enumerate(np.eye(2) * 1e-3):
        ahead, behind = (step.system.balance(angles, R + sign * unit).gradient for sign in (1.0, -1.0))
        assert told[k] == pytest.approx((ahead - behind) / 2e-3, abs=1e-9)
    for j, unit in enumerate(np.eye(n) * 1e-5):
        ahead, behind = (step.system.balance(angles + sign * unit, R).gap for sign in (1.0, -1.0))
        assert told[:, j] == pytest.approx((ahead - behind) / 2e-5, abs=1e-9)


def state(step: Equilibrium) -> tuple[Potential, np.ndarray]:
    V = Potential(step.rod, step.before)
    return V, V.unknowns(step.angles, step.x, step.y)


def dense(band: np.ndarray) -> np.ndarray:
    H = np.zeros((band.shape[1],) * 2)
    for k in range(HALF_BANDWIDTH + 1):
        for j in range(band.shape[1] - k):
            H[j + k, j] = H[j, j + k] = band[k, j]
    return H


@pytest.mark.parametrize("test", [PLAIN, EVERYTHING], ids=["plain", "everything"])
def test_gradient_and_hessian_against_central_differences(test: BendingTest) -> None:
    V, q = state(simulate(test, [0.004, 0.009])[-1])
    rng = np.random.default_rng(2)
    q = q + rng.normal(0.0, 1e-3, q.size) * np.where(np.isin(np.arange(q.size), V.angle_index), 1.0, 0.01)
    h = 1e-6
    steps = h * np.eye(q.size)
    gradient = np.array([(V.value(q + d) - V.value(q - d)) / (2.0 * h) for d in steps])
    assert np.abs(gradient - V.gradient(q)).max() < 1e-7 * np.abs(gradient).max()
    hessian = np.array([(V.gradient(q + d) - V.gradient(q - d)) / (2.0 * h) for d in steps])
    assert np.abs(hessian - dense(V.hessian(q))).max() < 1e-7 * np.abs(hessian).max()


@pytest.mark.parametrize("test", [PLAIN, EVERYTHING], ids=["plain", "everything"])
def test_equilibria_are_stationary_minima_and_reactions_are_derivatives(test: BendingTest) -> None:
    for step in simulate(test, [0.003, 0.008, 0.012, 0.006]):
        assert step.good
        V, q = state(step)
        gradient, free = V.gradient(q), V.free()
        assert np.abs(gradient[free]).max() < 1e-9 * abs(step.force)
        last = V.vertex_index[-1]
        assert gradient[last : last + 2] == pytest.approx(step.right_reaction, rel=1e-8, abs=1e-10)
        assert gradient[:2] == pytest.approx(step.left_reaction, rel=1e-8, abs=1e-10)
        assert is_minimum(V, q, free)


def test_inertia_of_the_reduced_system_is_that_of_equation_4() -> None:
    # States that are no minima: the buckled rod pushed back to straight, and higher modes.
    straight = BendingTest(0.2, LAW, 0.0, elements=30, **SOFT)
    rod = straight.rod
    for loads in (5.0, 15.0, 60.0, 120.0, 250.0):  # in EI/L^2; Euler's loads are pi^2 j^2
        P = loads * LAW.EI0 / 0.2**2
        chord = 0.2 * (1.0 - P / SOFT["axial_stiffness"])
        system = System(rod, straight.hold("chords", chord), rod.virgin)
        angles = np.zeros(rod.edges.size)
        balance = system.balance(angles, np.array([-P, 0.0]))
        assert np.abs(balance.gradient).max() < 1e-12
        V = Potential(rod, rod.virgin)
        x = np.linspace(0.0, chord, rod.elements.size + 1)
        q = V.unknowns(angles, x, np.zeros_like(x))
        free = V.free()
        negative = int(np.sum(eigh(dense(V.hessian(q))[np.ix_(free, free)], eigvals_only=True) < 0.0))
        assert system.excess_negatives(balance) == negative
        assert is_minimum(V, q, free) is (negative == 0)
    assert negative >= 3


@pytest.mark.parametrize("unit", [1e-5, 1.0, 1e8])
def test_inertia_where_a_pivot_vanishes(unit: float) -> None:
    diagonal, off = unit * np.array([2.0, 0.5, 1.0, -3.0]), unit * np.array([1.0, 1.0, 2.0])  # second pivot 0.5 - 1/2
    matrix = np.diag(diagonal) + np.diag(off, 1) + np.diag(off, -1)
    assert negative_pivots(diagonal, off) == np.count_nonzero(np.linalg.eigvalsh(matrix) < 0.0)


def test_a_matrix_without_inverse_has_no_solution_and_proves_no_minimum() -> None:
    step = simulate(PLAIN, [0.009])[0]
    none = step.balance._replace(diagonal=np.zeros(32), off=np.zeros(31))
    assert np.isnan(step.system.solve(none, np.ones((32, 1)), np.zeros((2, 1)))[0]).all()
    assert step.system.excess_negatives(none) == 1


@pytest.mark.parametrize("turn", [0.3, 2.0, -1.1])
def test_turning_and_shifting_the_world_changes_nothing(turn: float) -> None:
    V, q = state(simulate(PLAIN, [0.009])[-1])
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    places = np.array([V.vertex_index, V.vertex_index + 1])
    moved = q.copy()
    moved[places] = rotation @ q[places] + np.array([[0.7], [-0.4]])
    moved[V.angle_index] += turn
    assert V.value(moved) == pytest.approx(V.value(q), rel=1e-11)
    g, g_moved = V.gradient(q), V.gradient(moved)
    assert np.allclose(g_moved[places], rotation @ g[places], atol=1e-9 * np.abs(g).max())
    assert np.allclose(g_moved[V.angle_index], g[V.angle_index], atol=1e-9 * np.abs(g).max())
    assert is_minimum(V, moved, V.free())


def test_mirroring_the_world_mirrors_the_energy() -> None:
    V, q = state(simulate(PLAIN, [0.009])[-1])
    mirrored = Potential(replace(PLAIN, pre_curvature=-2.0).rod, replace(PLAIN, pre_curvature=-2.0).rod.virgin)
    other = q.copy()
    other[V.vertex_index + 1] *= -1.0
    other[V.angle_index] *= -1.0
    assert mirrored.value(other) == pytest.approx(V.value(q), rel=1e-12)
    assert np.allclose(np.abs(mirrored.gradient(other)), np.abs(V.gradient(q)), atol=1e-12)


def work(test: BendingTest, displacements: np.ndarray) -> tuple[list[Equilibrium], float]:
    """Equilibria of a path and the work that P does along it, by Simpson's rule on chords."""
    steps = simulate(test, displacements)
    P, d = np.array([s.force for s in steps]), -np.array([s.chord for s in steps])
    assert P.size % 2
    panels = (d[2::2] - d[:-2:2]) / 6.0
    return list(steps), float(np.sum(panels * (P[:-2:2] + 4.0 * P[1:-1:2] + P[2::2])))


def test_work_done_becomes_energy_along_a_loading_path() -> None:
    test = replace(
        EVERYTHING,
        friction=None,
        plastic_rate=0.0,
        left=replace(EVERYTHING.left, friction_moment=0.0),
        right=replace(EVERYTHING.right, friction_moment=0.0),
    )
    steps, done = work(test, np.linspace(0.001, 0.015, 41))
    (V0, q0), (V1, q1) = state(steps[0]), state(steps[-1])
    assert V1.value(q1) - V0.value(q0) == pytest.approx(done, rel=1e-6)
    assert V1.dissipated(q1) == pytest.approx(0.0, abs=1e-15)
    back, undone = work(test, np.linspace(0.015, 0.001, 41))
    assert undone == pytest.approx(-done, rel=1e-9)
    assert back[-1].force == pytest.approx(steps[0].force, rel=1e-8)


FRICTIONAL = {
    "internal friction": {"friction": InternalFriction(1e-3, 1.5)},
    "internal friction that gives way gradually": {"friction": InternalFriction(1e-3, 1.5, gradual=True)},
    "bearing friction": {"left": Support(friction_moment=6e-4), "right": Support(friction_moment=3e-4)},
    "plastic set": {"plastic_rate": 0.1},
    "plastic set beyond a threshold": {"plastic_rate": 0.1, "set_threshold": 1.5},
    "plastic set that slows down": {"plastic_rate": 0.1, "set_threshold": 0.5, "set_saturation": 0.4},
    "plastic set beside a law that stays": {"plastic_rate": 0.1, "law_stays": True},
}


@pytest.mark.parametrize("kind", FRICTIONAL)
def test_loop_of_loading_and_unloading_dissipates_what_the_work_lost(kind: str) -> None:
    test = replace(PLAIN, **FRICTIONAL[kind])
    forth, back = np.linspace(0.0, 0.012, 241), np.linspace(0.012, 0.004, 161)[1:]
    steps = simulate(test, np.r_[forth, back])
    P, chord = np.array([s.force for s in steps]), np.array([s.chord for s in steps])
    done = float(-np.sum(0.5 * (P[1:] + P[:-1]) * np.diff(chord)))  # kinks: the trapezoidal rule
    states = [state(s) for s in steps]
    lost = sum(V.dissipated(q) for V, q in states)
    stored = states[-1][0].stored(states[-1][1]) - states[0][0].stored(states[0][1])
    assert all(V.dissipated(q) > -1e-15 for V, q in states)
    assert lost > 0.01 * done
    # One increment replaces the path inside it by its end: first order in the step, 0.05 mm here.
    assert stored + lost == pytest.approx(done, rel=2e-3)


def test_closed_loop_of_bearing_friction_dissipates_moment_times_turn() -> None:
    M = 4e-4
    test = replace(PLAIN, left=Support(friction_moment=M), right=Support(friction_moment=M))
    loop = np.r_[np.linspace(0.004, 0.012, 81), np.linspace(0.012, 0.004, 81)[1:], np.linspace(0.004, 0.012, 81)[1:]]
    steps = simulate(test, loop)[80:]  # from the first turning point back and forth: a closed loop
    P, chord = np.array([s.force for s in steps]), np.array([s.chord for s in steps])
    done = float(-np.sum(0.5 * (P[1:] + P[:-1]) * np.diff(chord)))
    turn = abs(steps[0].angles[0] - steps[80].angles[0]) + abs(steps[0].angles[-1] - steps[80].angles[-1])
    # Coulomb's loop: twice the moment times the turn, there and back, less what sticks at each reversal.
    stuck = 2.0 * test.left.stick_angle
    assert done == pytest.approx(2.0 * M * (turn - 2.0 * stuck), rel=0.01)
    # The trapezoidal rule runs over the corner of each reversal in one increment of 80.
    assert done == pytest.approx(sum(V.dissipated(q) for V, q in map(state, steps[1:])), rel=5e-3)

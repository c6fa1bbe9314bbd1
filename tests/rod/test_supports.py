"""Every support, load and profile against scipy's collocation solver, which knows nothing of edges and joints.

The boundary value problem is written in arc length on the flexible cable: x' = cos(theta), y' = sin(theta),
theta' = -K(m, s), m' = f . n with the internal force f = R + q (L - s) and R the unknown reaction on the right.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from rod.bending_test import BendingTest, simulate
from rod.equilibrium import Outcome, solve
from rod.laws import StickSlip
from rod.reduction import Hold
from rod.sensitivity import derivatives
from rod.support import Support

LENGTH = 0.2
LAW = StickSlip(6e-3, 2.5e-3, 4.0)


def curvature_excess(m: np.ndarray) -> np.ndarray:
    """Inverse of LAW by Newton's method from the stiff side, where it cannot overshoot for this softening law."""
    D = m / LAW.EI0
    for _ in range(60):
        D = D - (LAW.moment(D, 0.0) - m) / LAW.tangent(D, 0.0)
    return D


@dataclass
class Reference:
    """Solution of the boundary value problem as functions of arc length from the left bearing axis."""

    shape: Callable[[np.ndarray], np.ndarray]
    force: float
    chord: float


def reference(test: BendingTest, guess, *, chord=None, force=None, tip=None, turned=(1.0, -1.0)) -> Reference:
    """Solve by collocation; ``turned``: the way the bearings have turned, for the Coulomb moments."""
    left, right, q = test.left, test.right, np.asarray(test.load)
    a, b = left.rigid_length, LENGTH - right.rigid_length
    K0 = test.pre_curvature if callable(test.pre_curvature) else lambda xi: test.pre_curvature + 0.0 * xi
    profile = test.stiffness_profile or (lambda xi: 1.0 + 0.0 * xi)
    rest = test.rod.rest_angles

    def slopes(s, state, R):
        _, _, theta, m = state
        xi = (s - a) / (b - a)
        K = K0(xi) + curvature_excess(m / profile(xi))
        fx, fy = R[0] + q[0] * (LENGTH - s), R[1] + q[1] * (LENGTH - s)
        return np.array([np.cos(theta), np.sin(theta), -K, fy * np.cos(theta) - fx * np.sin(theta)])

    def turning(support, angle, at_rest, direction):
        turn = angle - at_rest
        rate = np.sqrt(support.hardening if support.hardening > 0.0 else -0.5 * support.hardening)
        course = np.sinh if support.hardening > 0.0 else np.tanh
        spring = support.stiffness * (course(rate * turn) / rate if rate else turn)
        return spring + support.friction_moment * direction

    def ends(first, last, R):
        # The rigid pieces are straight: their lever arms and loads are closed forms.
        n0, n1 = np.array([-np.sin(first[2]), np.cos(first[2])]), np.array([-np.sin(last[2]), np.cos(last[2])])
        force_left = R + q * (LENGTH - 0.5 * a)
        force_right = R + q * 0.5 * (LENGTH - b)
        m_left = first[3] - a * force_left @ n0
        m_right = last[3] + (LENGTH - b) * force_right @ n1
        at_left = m_left - left.moment + turning(left, first[2], rest[0], turned[0])
        at_right = m_right - right.moment - turning(right, last[2], rest[1], turned[1])
        end = last[:2] + (LENGTH - b) * np.array([np.cos(last[2]), np.sin(last[2])])
        conditions = [first[0] - a * np.cos(first[2]), first[1] - a * np.sin(first[2])]
        conditions.append(first[2] - rest[0] if left.kind == "clamp" else at_left / LAW.EI0)
        conditions.append(last[2] - rest[1] if right.kind == "clamp" else at_right / LAW.EI0)
        if tip is not None:
            return np.array([*conditions, *((R - np.asarray(tip)) / LAW.EI0)])
        yielded = test.compliance * R[0] / (1.0 + test.stiffening * abs(R[0]))
        along = (R[0] + force) / LAW.EI0 if force is not None else end[0] - chord + yielded
        return np.array([*conditions, along, end[1]])

    s = np.linspace(a, b, 101)
    start = np.array([np.interp(s, guess.s, values) for values in (guess.x, guess.y, guess.theta, guess.moment)])
    found = solve_bvp(slopes, ends, s, start, p=guess.right_reaction * 1.02, tol=1e-9, bc_tol=1e-11, max_nodes=20000)
    assert found.success, found.message
    last = found.sol(b)
    return Reference(found.sol, -found.p[0], float(last[0] + (LENGTH - b) * np.cos(last[2])))


def held_against(test: BendingTest, run: Callable[[BendingTest], object], **imposed) -> None:
    """100 elements within 5e-4, and within 1e-6 once the error of second order is taken out with 200 elements.

    The leading error is about (h dK/ds / K)^2 / 12; 5e-4 leaves room for the clamps, where K changes sign twice.
    """
    coarse, fine = run(replace(test, elements=100)), run(replace(test, elements=200))
    assert coarse.outcome is Outcome.CONVERGED
    assert fine.outcome is Outcome.CONVERGED
    truth = reference(test, fine, **imposed)
    a, b = test.left.rigid_length, LENGTH - test.right.rigid_length
    joints = np.linspace(a, b, 101)
    x, y, theta, _ = truth.shape(joints)
    size = abs(truth.force) if imposed.get("tip") is None else LAW.EI0 / LENGTH**2
    for name, true, scale in (("x", x, LENGTH), ("y", y, LENGTH), ("theta", theta, 1.0)):
        rough = np.interp(joints, coarse.s, getattr(coarse, name))
        better = np.interp(joints, fine.s, getattr(fine, name))
        assert np.abs(rough - true).max() < 5e-4 * scale
        assert np.abs((4.0 * better - rough) / 3.0 - true).max() < 1e-6 * scale
    assert coarse.force == pytest.approx(truth.force, abs=1e-3 * size)
    assert (4.0 * fine.force - coarse.force) / 3.0 == pytest.approx(truth.force, abs=3e-6 * size)
    assert (4.0 * fine.chord - coarse.chord) / 3.0 == pytest.approx(truth.chord, abs=1e-6 * LENGTH)


BASE = BendingTest(LENGTH, LAW, 2.0)
STEP = 0.185

BEARINGS = {
    "plain": BASE,
    "pre-curvature along s": replace(BASE, pre_curvature=lambda xi: 2.0 + 1.5 * xi + np.cos(2 * np.pi * xi)),
    "soft spot": replace(BASE, stiffness_profile=lambda xi: 1.0 - 0.4 * np.exp(-(((xi - 0.4) / 0.1) ** 2))),
    "springs": replace(BASE, left=Support(stiffness=0.02), right=Support(stiffness=0.05)),
    "springs that stiffen and yield": replace(
        BASE, left=Support(stiffness=0.02, hardening=8.0), right=Support(stiffness=0.05, hardening=-6.0)
    ),
    "spring with rest angle": replace(BASE, left=Support(stiffness=0.02, angle=0.6)),
    "Coulomb moments": replace(BASE, left=Support(friction_moment=1e-3), right=Support(friction_moment=2e-3)),
    "rigid ends": replace(BASE, left=Support(rigid_length=0.01), right=Support(rigid_length=0.016)),
    "rigid ends on springs under load": replace(
        BASE, left=Support(rigid_length=0.01, stiffness=0.02), right=Support(rigid_length=0.016), load=(0.2, -0.3)
    ),
    "load across": replace(BASE, load=(0.0, 0.4)),
    "load along": replace(BASE, load=(0.5, 0.0)),
    "end moments": replace(BASE, left=Support(moment=2e-3), right=Support(moment=-1e-3)),
    "clamps": replace(BASE, left=Support("clamp", angle=0.2), right=Support("clamp", angle=-0.1)),
    "clamp and bearing": replace(BASE, left=Support("clamp", angle=0.1)),
    "bearing and clamp as mounted": replace(BASE, right=Support("clamp")),
}


@pytest.mark.parametrize("name", BEARINGS)
def test_imposed_chord_against_collocation(name: str) -> None:
    held_against(BEARINGS[name], lambda test: simulate(test, chords=[STEP])[0], chord=STEP)


@pytest.mark.parametrize("name", ["plain", "springs", "load across"])
def test_tension_against_collocation(name: str) -> None:
    chord = 0.1992  # natural chord 0.19867
    held_against(BEARINGS[name], lambda test: simulate(test, chords=[chord])[0], chord=chord, turned=(-1.0, 1.0))


def test_a_rigid_piece_of_no_length_is_no_piece_of_the_shape() -> None:
    """A fit may end at 3e-16 m: between two vertices so near to each other no shape can be interpolated."""
    short = Support(rigid_length=3e-16)
    test = replace(BASE, left=short, right=short)
    here, plain = (simulate(one, [0.01])[0] for one in (test, BASE))
    assert here.s.size == plain.s.size and here.force == pytest.approx(plain.force, rel=1e-9)
    found, expected = (derivatives(one, [step], ["length"])[0] for one, step in ((test, here), (BASE, plain)))
    assert found.y == pytest.approx(expected.y, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("stiffening", [0.0, 1.5])
def test_compliance_of_the_rig_against_collocation(stiffening: float) -> None:
    test = replace(BASE, compliance=4e-3, stiffening=stiffening)
    commanded = test.zero_chord - 0.012
    held_against(test, lambda t: simulate(replace(t, zero=test.zero_chord), [0.012])[0], chord=commanded)


def test_imposed_force_against_collocation() -> None:
    held_against(BASE, lambda test: simulate(test, forces=[0.5])[0], force=0.5)


@pytest.mark.parametrize("tip", [(0.0, 0.3), (0.4, -0.2), (-0.2, -0.1)])
def test_cantilever_against_collocation(tip: tuple[float, float]) -> None:
    test = replace(BASE, left=Support("clamp", angle=0.0), right=Support("free"))
    held_against(test, lambda t: solve(t.rod, Hold(tip=tip)), tip=tip)


def test_imposed_force_gives_back_the_imposed_chord() -> None:
    step = simulate(BASE, chords=[STEP])[0]
    back = simulate(BASE, forces=[step.force])[0]
    assert back.chord == pytest.approx(STEP, rel=1e-9)


def test_end_moments_bend_a_rod_to_an_arc() -> None:
    M = float(LAW.moment(7.0, 2.0))
    test = replace(BASE, left=Support(moment=M), right=Support(moment=M))
    arc = simulate(test, forces=[0.0])[0]
    assert np.allclose(arc.kappa, 7.0, rtol=1e-9)


def test_coulomb_moment_turns_its_sign_on_the_way_back() -> None:
    test = replace(BASE, left=Support(friction_moment=1e-3), right=Support(friction_moment=1e-3))
    forth, back = simulate(test, chords=[0.19, 0.185, 0.19])[::2]
    free = simulate(BASE, chords=[0.19])[0]
    assert np.allclose(forth.moment[[0, -1]], -1e-3, rtol=1e-9)
    assert np.allclose(back.moment[[0, -1]], 1e-3, rtol=1e-9)
    assert forth.force > free.force > back.force


def test_reactions_balance_the_load() -> None:
    step = simulate(BEARINGS["load along"], chords=[STEP])[0]
    assert np.allclose(step.left_reaction + step.right_reaction, [-0.5 * LENGTH, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [{"kind": "welded"}, {"stick_angle": 0.0}, {"rigid_length": -1e-3}],
)
def test_supports_refuse_nonsense(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError):
        Support(**wrong)

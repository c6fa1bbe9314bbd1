"""Closed forms against printed numbers, and the quadrature against collocation."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from rod.characteristic import Characteristic
from rod.laws import StickSlip
from tests.rod.elastica import natural_chord, pure_bending, uniform_equilibrium
from tests.rod.virtual_cable import pinned_linear

TABLE_1 = ([0.0, 5.0, 10.0], [5e-3, 3e-3, 2e-3])


def test_printed_force_of_the_straight_rod() -> None:
    assert pinned_linear(5e-3, 0.2, 0.19) == pytest.approx(1.2654365813, abs=5.1e-11)


def test_quadrature_meets_the_elliptic_integrals_to_touching_ends() -> None:
    law = Characteristic.constant(5e-3)
    for chord in (0.1999, 0.19, 0.15, 0.1, 0.03, 0.001):
        found = uniform_equilibrium(law, length=0.2, chord=chord)
        assert found.force == pytest.approx(pinned_linear(5e-3, 0.2, chord), rel=1e-9)
        assert found.chord == pytest.approx(chord, rel=1e-9)


@pytest.mark.parametrize(("shortening", "force"), [(5e-3, 0.610252789), (10e-3, 0.810307454), (15e-3, 0.907461983)])
def test_printed_forces_of_the_pre_curved_rod(shortening: float, force: float) -> None:
    found = uniform_equilibrium(Characteristic.constant(5e-3), length=0.2, chord=0.2 - shortening, pre_curvature=2.0)
    assert found.force == pytest.approx(force, abs=5.1e-10)


def test_printed_second_branch_against_the_natural_bend() -> None:
    # Bowed against K0 = 2 is bowed toward K0 = -2. The notes print 1.889 N at 5 mm, from a grid; its limit is 1.8883 N.
    found = uniform_equilibrium(Characteristic.constant(5e-3), length=0.2, chord=0.195, pre_curvature=-2.0)
    assert found.force == pytest.approx(1.889, abs=1e-3)


def collocation(law, curvature_of, *, length: float, chord: float, K0: float, guess) -> tuple[float, np.ndarray]:
    """P and curvature at 101 points from the boundary value problem in (x, y, theta)."""

    def slopes(s, state, p):
        return np.array([np.cos(state[2]), np.sin(state[2]), -curvature_of(p[0] * state[1])])

    def ends(first, last, p):
        return np.array([first[0], first[1], last[0] - chord, last[1]])

    found = solve_bvp(
        slopes,
        ends,
        guess.s,
        np.array([guess.x, guess.y, guess.theta]),
        p=[1.05 * guess.force],
        tol=1e-9,
        max_nodes=20000,
    )
    assert found.success
    return float(found.p[0]), curvature_of(found.p[0] * found.sol(np.linspace(0.0, length, 101))[1])


@pytest.mark.parametrize(
    ("chord", "K0"),
    [(0.19, 2.0), (0.17, 0.5), (0.10, 2.0), (0.05, 0.0), (0.1995, 2.0), (0.19, -0.5)],
    ids=["Table 1", "bent", "beyond 90 degrees", "nearly touching", "tension", "against K0"],
)
def test_nonlinear_law_against_collocation(chord: float, K0: float) -> None:
    law = StickSlip(6e-3, 2.5e-3, 4.0)

    def curvature_of(m: np.ndarray) -> np.ndarray:
        D = m / law.EI0
        for _ in range(60):
            D = D - (law.moment(D, 0.0) - m) / law.tangent(D, 0.0)
        return K0 + D

    found = uniform_equilibrium(law, length=0.2, chord=chord, pre_curvature=K0)
    P, kappa = collocation(law, curvature_of, length=0.2, chord=chord, K0=K0, guess=found)
    assert found.force == pytest.approx(P, rel=1e-7)
    assert np.allclose(found.kappa, kappa, atol=1e-6 * np.abs(kappa).max())


@pytest.mark.parametrize("reading", ["tangent", "secant"])
def test_shape_obeys_statics_and_kinematics(reading: str) -> None:
    law = Characteristic.from_ordinates(*TABLE_1, reading=reading)
    shape = uniform_equilibrium(law, length=0.2, chord=0.185, pre_curvature=2.0, points=2001)
    h = shape.s[1]
    assert np.allclose(shape.moment, shape.force * shape.y, rtol=1e-12)  # Eq. (13)
    assert np.allclose(shape.moment, law.moment(shape.kappa, 2.0), rtol=1e-12)
    centre = slice(1, -1)
    assert np.allclose(-(shape.theta[2:] - shape.theta[:-2]) / (2 * h), shape.kappa[centre], atol=1e-3)
    assert np.allclose((shape.x[2:] - shape.x[:-2]) / (2 * h), np.cos(shape.theta[centre]), atol=1e-5)
    assert np.allclose((shape.y[2:] - shape.y[:-2]) / (2 * h), np.sin(shape.theta[centre]), atol=1e-5)
    assert shape.x[-1] == pytest.approx(0.185, rel=1e-9)
    assert abs(shape.y[-1]) < 1e-10


def test_points_may_be_given() -> None:
    law, s = Characteristic.constant(5e-3), np.array([0.0, 0.013, 0.1, 0.2])
    some = uniform_equilibrium(law, length=0.2, chord=0.18, pre_curvature=1.0, points=s)
    dense = uniform_equilibrium(law, length=0.2, chord=0.18, pre_curvature=1.0, points=2001)
    assert np.allclose(some.y, np.interp(s, dense.s, dense.y), atol=1e-8)


def test_force_free_cable_is_an_arc() -> None:
    assert natural_chord(0.2, 2.0) == pytest.approx(0.198669, abs=5e-7)
    assert natural_chord(0.2, 0.0) == 0.2
    arc = pure_bending(2.0, length=0.2)
    assert arc.x[-1] == pytest.approx(natural_chord(0.2, 2.0), rel=1e-14)
    radius = np.hypot(arc.x - 0.5 * arc.chord, arc.y - arc.y.max() + 0.5)
    assert np.allclose(radius, 0.5, rtol=1e-12)
    at_rest = uniform_equilibrium(Characteristic.constant(1.0), length=0.2, chord=arc.chord, pre_curvature=2.0)
    assert at_rest.force == 0.0
    near = uniform_equilibrium(Characteristic.constant(1.0), length=0.2, chord=arc.chord - 1e-7, pre_curvature=2.0)
    far = uniform_equilibrium(Characteristic.constant(1.0), length=0.2, chord=arc.chord - 1e-6, pre_curvature=2.0)
    assert far.force == pytest.approx(10.0 * near.force, rel=0.01)  # linear through zero


def test_what_does_not_exist_is_refused() -> None:
    law = Characteristic.constant(5e-3)
    with pytest.raises(ValueError, match="chord"):
        uniform_equilibrium(law, length=0.2, chord=0.2)
    with pytest.raises(ValueError, match="no bowed equilibrium"):
        uniform_equilibrium(law, length=0.2, chord=0.1995, pre_curvature=-5.0)  # snaps to the other side before
    with pytest.raises(ValueError, match="chord"):
        pinned_linear(5e-3, 0.2, 0.21)
    with pytest.raises(ValueError, match="points"):
        uniform_equilibrium(law, length=0.2, chord=0.19, points=[0.0, 0.3])
    with pytest.raises(ValueError, match="kc"):
        StickSlip(1.0, 1.0, 0.0)

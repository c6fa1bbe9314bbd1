"""Memory of the cross-section and of the cable: friction between the wires, plastic set, and what a test sees of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rod.bending_test import BendingTest, simulate
from rod.characteristic import Characteristic
from rod.laws import StickSlip
from rod.section import InternalFriction, Memory, Section
from rod.support import Support
from tests.rod.energies import section_potential

LAW = StickSlip(6e-3, 2.5e-3, 4.0)
TEST = BendingTest(0.2, LAW, 2.0)


def history(section: Section, path: np.ndarray) -> np.ndarray:
    """Moment along a path of curvature at one joint."""
    memory, moments = Memory(*section.virgin(), 0.0, 0.0), []
    for K in path:
        here = np.array([K])
        moments.append(float(section.response(memory)(here)[0][0]))
        memory = Memory(*section.advanced(here, memory), 0.0, 0.0)
    return np.array(moments)


FALLING = Characteristic.from_ordinates([0.0, 5.0, 10.0], [5e-3, 3e-3, 2e-3])


def section(friction: InternalFriction | None = None, plastic_rate: float = 0.0) -> Section:
    return Section(Characteristic.constant(1e-3), np.array([2.0]), None, friction, plastic_rate)


def test_loop_of_one_element_is_the_textbook_parallelogram() -> None:
    loop = section(InternalFriction(5e-4, 1.0, elements=1))
    path = np.array([2.0, 2.5, 3.0, 6.0, 5.5, 5.0, 4.0, 3.0, 2.0, 2.5, 4.0])
    slip = np.array([0.0, 0.5, 1.0, 1.0, 0.5, 0.0, -1.0, -1.0, -1.0, -0.5, 1.0])
    assert np.allclose(history(loop, path), 1e-3 * (path - 2.0) + 5e-4 * slip, atol=1e-15)


def test_elements_slip_one_after_the_other() -> None:
    friction = InternalFriction(6e-4, 3.0, elements=3)
    m = history(section(friction), 2.0 + np.array([1.0, 2.0, 3.0, 9.0])) - 1e-3 * np.array([1.0, 2.0, 3.0, 9.0])
    share = 2e-4
    expected = share * np.array([1.0 + 1 / 2 + 1 / 3, 2.0 + 2 / 3, 3.0, 3.0])
    assert np.allclose(m, expected, rtol=1e-12)


def test_masing_unloading_is_the_doubled_first_loading() -> None:
    friction = InternalFriction(6e-4, 2.0, elements=5)
    rise = np.linspace(0.0, 4.0, 41)
    first = history(section(friction), 2.0 + rise) - 1e-3 * rise
    back = 6.0 - rise
    unloading = history(section(friction), np.r_[6.0, back])[1:] - 1e-3 * (back - 2.0)
    doubled = np.interp(0.5 * rise, rise, first)
    assert np.allclose(first[-1] - unloading, 2.0 * doubled, atol=1e-15)


def test_small_loop_inside_a_large_one_closes() -> None:
    friction = InternalFriction(6e-4, 2.0, elements=4)
    out = history(section(friction), np.array([7.0, 5.0, 6.0, 5.0]))
    assert out[1] == pytest.approx(out[3], rel=1e-14)


def test_plastic_set_moves_the_rest_curvature_by_rate_times_excess() -> None:
    rate = 0.1
    forth, back = np.array([3.0, 6.0]), np.array([5.0, 2.4])
    m = history(section(plastic_rate=rate), np.r_[forth, back])
    assert m[:2] == pytest.approx(1e-3 * (1.0 - rate) * (forth - 2.0), rel=1e-12)
    assert m[2:] == pytest.approx(1e-3 * (back - (2.0 + rate * 4.0)), rel=1e-12, abs=1e-15)  # zero at the new rest
    late = history(replace(section(plastic_rate=rate), set_threshold=1.5), np.r_[forth, back])
    assert late[0] == pytest.approx(1e-3, rel=1e-12)  # below the threshold nothing stays
    assert late[1:] == pytest.approx(1e-3 * (np.r_[6.0, back] - (2.0 + rate * 2.5)), rel=1e-12, abs=1e-15)


def test_a_set_that_slows_down_is_one_at_any_trial_curvature() -> None:
    slows = replace(section(plastic_rate=0.1), set_saturation=0.3)
    m, tangent = slows.response(Memory(*slows.virgin(), 0.0, 0.0))(np.array([-4000.0]))  # iterations may stray as far
    assert np.isfinite(m).all() and np.isfinite(tangent).all()


@pytest.mark.parametrize("abscissa", ["curvature", "excess"])
def test_set_either_takes_the_law_along_or_leaves_it(abscissa: str) -> None:
    law, K0, p = replace(FALLING, abscissa=abscissa), 2.0, 0.1 * 4.0
    K = np.array([6.0, 5.0, 2.4])
    along = history(Section(law, np.array([K0]), plastic_rate=0.1), K)
    assert along == pytest.approx(law.moment(K - p, K0), rel=1e-12, abs=1e-15)
    stays = history(Section(law, np.array([K0]), plastic_rate=0.1, law_stays=True), K)
    assert stays == pytest.approx(law.moment(K, K0) - law.moment(K0 + p, K0), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("gradual", [False, True])
@pytest.mark.parametrize("law_stays", [False, True])
def test_potential_of_the_increment_has_the_moment_as_derivative(law_stays: bool, gradual: bool) -> None:
    friction = InternalFriction(1e-3, 1.5, gradual=gradual)
    full = Section(LAW, np.full(60, 2.0), np.full(60, 0.9), friction, 0.08, law_stays)
    memory = Memory(np.repeat(np.linspace(1.0, 4.0, 60)[None], 3, 0), np.full(60, 2.0), np.full(60, 1.3), 0.0, 0.0)
    K, step = np.linspace(0.03, 8.07, 60), 1e-6
    m, tangent = full.response(memory)(K)
    slope = (section_potential(full, K + step, memory) - section_potential(full, K - step, memory)) / (2.0 * step)
    assert np.allclose(slope, m, atol=1e-8 * np.abs(m).max())
    rate = (full.response(memory)(K + step)[0] - full.response(memory)(K - step)[0]) / (2.0 * step)
    assert np.allclose(rate, tangent, atol=1e-6 * tangent.max())


def test_friction_widens_the_loop_of_the_whole_cable() -> None:
    test = replace(TEST, friction=InternalFriction(2e-3, 1.5))
    out = np.array([0.0, 0.005, 0.010, 0.015, 0.010, 0.005])
    plain, rough = simulate(TEST, out), simulate(test, out)
    assert all(step.good for step in rough)
    for forth, back in [(1, 5), (2, 4)]:
        assert plain[forth].force == pytest.approx(plain[back].force, rel=1e-9)
        assert rough[forth].force > plain[forth].force > rough[back].force
    assert rough[0].force == pytest.approx(0.0, abs=1e-12)


def test_saturated_friction_in_loading_is_a_shift_of_the_moment() -> None:
    # Where all elements slip, m = m_law + half width: checked against statics of the simulated shape, Eq. (13).
    step = simulate(replace(TEST, friction=InternalFriction(2e-3, 0.5)), [0.005, 0.010, 0.015])[-1]
    slipping = step.kappa - 2.0 > 0.5
    m = step.force * step.y
    assert np.allclose(m[slipping] - LAW.moment(step.kappa[slipping], 2.0), 2e-3, rtol=1e-6)


def test_steps_of_one_way_do_not_depend_on_their_number() -> None:
    # Elements only load: the increments of any fineness end at the same state.
    test = replace(TEST, friction=InternalFriction(2e-3, 1.5), plastic_rate=0.05)
    direct = simulate(test, [0.012])[-1]
    fine = simulate(test, np.linspace(0.0, 0.012, 25))[-1]
    assert fine.force == pytest.approx(direct.force, rel=1e-6)


def test_plastic_set_leaves_the_unloaded_cable_more_bent() -> None:
    test = replace(TEST, plastic_rate=0.1)
    loaded, unloaded = simulate(test, [0.015, 0.0])
    assert loaded.kappa.max() > 5.0
    assert unloaded.force < 0.0  # the mounted chord now stretches the cable
    free = simulate(test, [0.015])[0]
    rest = 2.0 + test.rod.section.set_at(np.full(101, 2.0), free.after)
    assert rest.max() == pytest.approx(2.0 + 0.1 * (loaded.kappa.max() - 2.0), rel=1e-9)
    assert rest[0] == pytest.approx(2.0, abs=1e-9)


@pytest.mark.parametrize("wrong", [(-1.0, 1.0, 1), (1.0, 0.0, 1), (1.0, 1.0, 0)])
def test_friction_refuses_nonsense(wrong: tuple[float, float, int]) -> None:
    with pytest.raises(ValueError, match="half_width"):
        InternalFriction(*wrong)


def test_an_element_that_gives_way_gradually_is_dahls() -> None:
    """Its rate (1 - q sign dK) / c integrated along the path by an ODE solver, beside a sharp element."""
    gradual = InternalFriction(5e-4, 1.5, elements=1, gradual=True)
    path = np.array([2.5, 4.0, 9.0, 8.0, 5.0, 5.0, 6.0, 2.0, 3.5])
    q, K, expected = np.zeros(1), 2.0, []
    for there in path:
        way = np.sign(there - K)
        turn = solve_ivp(lambda _, q, w=way: w * (1.0 - w * q) / 1.5, (0.0, abs(there - K)), q, rtol=1e-10, atol=1e-12)
        q, K = turn.y[:, -1], there
        expected.append(float(q[0]))
    found = history(section(gradual), path) - 1e-3 * (path - 2.0)
    assert np.allclose(found, 5e-4 * np.array(expected), atol=1e-12)
    sharp = InternalFriction(3e-4, 4.0, elements=2)
    both = history(section(replace(sharp, beside=gradual)), path)
    assert np.allclose(both, history(section(sharp), path) + found, atol=1e-15)


def test_groups_of_elements_add_up() -> None:
    early, late = InternalFriction(2e-4, 1.0, elements=1), InternalFriction(3e-4, 4.0, elements=2)
    path = np.array([2.5, 3.5, 6.5, 4.0, 2.0, 5.0])
    both = history(section(replace(early, beside=late)), path)
    plain = 1e-3 * (path - 2.0)
    assert np.allclose(both, history(section(early), path) + history(section(late), path) - plain, atol=1e-15)


def test_friction_that_differs_from_step_to_step_is_the_moment_at_the_bearings() -> None:
    """Coulomb: a bearing that turns on resists by its whole friction; the last amounts stay, none is negative."""
    rubbing = Support(friction_moment=2e-4)
    more = 1e-4 * np.array([[3.0, 0.0], [-1.0, 1.0], [-5.0, 4.0]])
    test = BendingTest(0.2, 5e-3, 2.0, left=rubbing, right=rubbing, friction_by_step=more)
    steps = simulate(test, [4e-3, 8e-3, 12e-3, 16e-3])
    for step, held in zip(steps, ((5e-4, 2e-4), (1e-4, 3e-4), (0.0, 6e-4), (0.0, 6e-4)), strict=True):
        assert step.good
        assert np.abs(step.moment[[0, -1]]) == pytest.approx(held, rel=1e-6, abs=1e-9)

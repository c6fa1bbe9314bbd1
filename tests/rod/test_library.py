"""The library as somebody new uses it: the examples of `rod` run, and whatever describes a cable is a law."""

import doctest
import math

import numpy as np
import pytest

import rod
from rod import CLAMP, FREE, BendingTest, Characteristic, StickSlip, as_law, bend
from rod.newton import Outcome
from tests.rod.potential_energy import Potential

LAW = StickSlip(5e-3, 2e-3, 4.0)
SOFT = {"axial_stiffness": 400.0, "shear_stiffness": 250.0}  # strains that matter: no rounding of stiff ones
BENDS = np.linspace(0.0, 30.0, 601)


def test_examples_of_the_package_run():
    found = doctest.testmod(rod)
    assert found.attempted > 12
    assert found.failed == 0


def test_exported_names_are_there():
    assert {"bend", "simulate", "solve", "as_law", "fit_characteristic"} <= set(rod.__all__)
    for name in rod.__all__:
        assert getattr(rod, name) is not None


def moment(D):
    return LAW.moment(D, 0.0)


@pytest.mark.parametrize("given", [moment, np.column_stack([BENDS, moment(BENDS)])], ids=["function", "table"])
def test_functions_and_tables_are_the_law_they_describe(given):
    law = as_law(given, length=0.2)
    K = np.linspace(-20.0, 24.0, 45)
    # a table of steps of 0.05 1/m: cubic pieces are of third order in it, their slopes of second
    assert law.moment(K, 2.0) == pytest.approx(LAW.moment(K, 2.0), rel=1e-6, abs=1e-8)
    assert law.tangent(K, 2.0) == pytest.approx(LAW.tangent(K, 2.0), rel=2e-4)
    assert law.moment_by_pre_curvature(K, 2.0) == pytest.approx(-LAW.tangent(K, 2.0), rel=2e-4)
    step, exact = (bend(0.2, one, chord=0.18, pre_curvature=2.0, **SOFT) for one in (law, LAW))
    assert step.good
    assert step.force == pytest.approx(exact.force, rel=1e-6)
    V = Potential(step.rod, step.before)
    q = V.unknowns(step.angles, step.x, step.y)
    assert np.abs(V.gradient(q)[V.free()]).max() < 1e-9
    assert V.value(q) == pytest.approx(Potential(exact.rod, exact.before).value(q), rel=1e-5)


def test_a_table_goes_on_straight_beyond_its_rows_and_need_not_be_odd():
    law = as_law([(-1.0, -1.0), (0.0, 0.0), (2.0, 4.0), (3.0, 5.0)], length=0.2)
    out = law.tangent([3.0, 5.0, -1.0, -4.0], 0.0)
    # a spline of 600 points follows the corner at a row within 1 % of the slope, and the moment to 1e-4
    assert out[0] == pytest.approx(out[1], rel=1e-2)
    assert out[2] == pytest.approx(out[3], rel=1e-2)
    assert law.tangent([20.0, 100.0], 0.0) == pytest.approx(2.0 / 3.0, rel=1e-3)
    assert law.moment(5.0, 0.0) == pytest.approx(5.0 + 2.0 * out[1], rel=1e-4)
    assert law.moment([0.0, 2.0, -1.0], 0.0) == pytest.approx([0.0, 4.0, -1.0], rel=1e-4, abs=1e-12)


def test_a_number_is_a_stiffness_and_a_curve_stays_itself():
    assert isinstance(as_law(5e-3, length=0.2), Characteristic)
    assert as_law(LAW, length=0.2) is LAW
    assert BendingTest(0.2, 5e-3).characteristic.stiffness_scale == 5e-3
    euler = np.pi**2 * 5e-3 / 0.2**2
    for control in ({"force": 1.1 * euler}, {"displacement": 0.01}, {"chord": 0.19}):
        assert bend(0.2, 5e-3, **control).outcome is Outcome.CONVERGED
    # small deflection: w L^4 / (8 EI) under the weight, F L^3 / (3 EI) under a force at the tip
    held = {"left": CLAMP, "right": FREE}
    assert bend(1.0, 1.0, load=(0.0, -1e-3), tip=(0.0, 0.0), **held).y[-1] == pytest.approx(-1e-3 / 8.0, rel=1e-3)
    assert bend(1.0, 1.0, tip=(0.0, 1e-3), **held).y[-1] == pytest.approx(1e-3 / 3.0, rel=1e-3)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        ({"law": [[0.0, 1.0, 2.0]], "chord": 0.1}, "rows of bend .* and moment"),
        ({"law": [(1.0, 1.0), (0.0, 0.0)], "chord": 0.1}, "sorted by bend"),
        ({"law": -5e-3, "chord": 0.1}, "positive number .* got -0.005"),
        ({"law": "steel", "chord": 0.1}, "got steel"),
        ({"law": 1.0, "chord": 0.1, "branch": "left"}, "one of natural, opposite, up, down, jump"),
        ({"law": np.cosh, "chord": 0.1}, "vanish at bend 0"),
        ({"law": 1.0}, "exactly one of displacement"),
        ({"law": 1.0, "chord": 0.1, "force": 1.0}, "exactly one of displacement"),
        ({"law": 1.0, "tip": (0.0, 1.0)}, "right=FREE"),
        ({"law": 1.0, "chord": 0.1, "right": FREE}, "right=FREE"),
        ({"law": 1.0, "tip": 1.0, "right": FREE}, "tip is two"),
        ({"law": 1.0, "chord": 0.1, "left": "clamp"}, "left='clamp' is no support: give BEARING, CLAMP, FREE"),
        ({"law": 1.0, "chord": 0.1, "right": None}, "right=None is no support"),
        ({"law": 1.0, "displacement": np.nan}, "finite numbers"),
        ({"law": 1.0, "force": np.inf}, "finite numbers"),
        ({"law": 1.0, "chord": 0.1, "load": 3.0}, "load is two"),
        ({"law": 1.0, "chord": 0.1, "load": (0.0, np.nan)}, "load is two"),
        ({"law": 1.0, "chord": 0.1, "elements": 0}, "at least two"),
        ({"law": 1.0, "chord": 0.1, "elements": -3}, "at least two"),
        ({"law": 1.0, "chord": 0.1, "elements": 10.5}, "whole number"),
        ({"law": 1.0, "displacement": [0.1, 0.2]}, "`simulate` those of all steps"),
        ({"law": 1.0, "chord": 0.1, "friction": 1e-3}, "give InternalFriction"),
        ({"law": 1.0, "displacement": 0.1, "zero": "unloaded"}, "one of natural, loaded, length, or a distance"),
        ({"law": [(0.0, 0.0), (1.0, np.nan), (2.0, 1.0)], "chord": 0.1}, "rows of bend .* and moment"),
        ({"law": lambda bend: bend if bend < 1.0 else 1.0, "chord": 0.1}, "as those of numpy do"),
        ({"law": lambda bend: math.tanh(bend), "chord": 0.1}, "as those of numpy do"),
        ({"law": lambda bend: bend[:3], "chord": 0.1}, "as many .* moments"),
        ({"law": lambda bend: bend * np.nan, "chord": 0.1}, "finite moments"),
        ({"law": 1.0, "chord": 0.1, "start": bend(0.2, 1.0, chord=0.1, elements=50)}, "50 elements and the rod 100"),
    ],
)
def test_mistakes_are_told_with_what_to_do(call, says):
    with pytest.raises(ValueError, match=says):
        bend(0.2, **call)


def test_supports_without_finite_numbers_are_refused():
    with pytest.raises(ValueError, match="of a support are finite"):
        rod.Support(stiffness=np.nan)


def test_a_load_may_be_an_array():
    load = np.array([0.0, -1.0])
    assert bend(0.2, 5e-3, chord=0.19, load=load).force == bend(0.2, 5e-3, chord=0.19, load=(0.0, -1.0)).force


def test_names_are_completed_before_they_are_loaded():
    assert set(dir(rod)) == set(rod.__all__)


def test_a_fit_shows_its_result_and_not_its_history():
    steps = np.array([5e-3, 10e-3, 15e-3])
    forces = np.array([step.force for step in rod.simulate(BendingTest(0.2, 5e-3), steps)])
    assert len(repr(rod.fit_characteristic(rod.Virtual(0.2, steps, forces, None), [0.0, 8.0]))) < 400


def test_a_warm_start_is_taken():
    cold = bend(0.2, LAW, chord=0.18, pre_curvature=2.0, elements=np.int64(100))  # a number, whoever counted
    assert bend(0.2, LAW, chord=0.18, pre_curvature=2.0, start=cold).iterations <= 2


def test_an_equilibrium_shows_how_it_ended_and_not_all_its_numbers() -> None:
    made = rod.bend(0.2, 0.01, displacement=0.01, pre_curvature=1.0)
    assert repr(made) == f"<Equilibrium CONVERGED: force {made.force:.6g} N, chord {made.chord:.6g} m>"

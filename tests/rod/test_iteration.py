"""The iterative method of Sec. 2.3: what its fixed points are, how fast it gets there, where it fails."""

from dataclasses import replace

import numpy as np
import pytest

from rod.bending_test import TABLE_1, BendingTest, simulate, table_1
from rod.characteristic import Characteristic
from rod.equilibrium import Outcome
from rod.iteration import iterate
from rod.section import InternalFriction

STEPS = TABLE_1["step"] * np.arange(1, 4)
STIFFENING = Characteristic.from_ordinates([0.0, 5.0, 10.0], [2e-3, 3e-3, 20e-3])


@pytest.mark.parametrize("displacement", STEPS)
def test_printed_method_reads_the_characteristic_as_a_secant(displacement: float) -> None:
    secant = simulate(table_1("secant"), [displacement])[0]
    for reading in ("secant", "tangent"):  # whatever it was meant to be
        test = table_1(reading)
        found = iterate(test.rod, test.hold("displacements", displacement), update="printed")
        assert found.outcome is Outcome.CONVERGED
        assert found.equilibrium.force == pytest.approx(secant.force, rel=1e-8)
        assert np.allclose(found.equilibrium.kappa, secant.kappa, atol=1e-8 * secant.kappa.max())


@pytest.mark.parametrize("displacement", STEPS)
@pytest.mark.parametrize("reading", ["secant", "tangent"])
def test_consistent_method_finds_the_minimiser_of_corrected_equation_5(reading: str, displacement: float) -> None:
    test = table_1(reading)
    minimiser = simulate(test, [displacement])[0]
    found = iterate(test.rod, test.hold("displacements", displacement), update="consistent")
    assert found.outcome is Outcome.CONVERGED
    assert found.equilibrium.force == pytest.approx(minimiser.force, rel=1e-8)
    assert np.allclose(found.equilibrium.kappa, minimiser.kappa, atol=1e-8 * minimiser.kappa.max())


def test_printed_error_factors_of_the_secant_reading() -> None:
    test = table_1("secant")
    for displacement, factor in zip(STEPS, (0.31, 0.43, 0.54), strict=True):  # physics notes, item 3
        found = iterate(test.rod, test.hold("displacements", displacement), update="printed")
        assert found.error_factor == pytest.approx(factor, abs=6e-3)


def test_error_factor_is_bounded_by_the_ratio_of_tangent_to_secant() -> None:
    test = table_1("tangent")
    found = iterate(test.rod, test.hold("displacements", 0.01), update="consistent")
    K = found.equilibrium.kappa
    law = test.characteristic
    worst = float(np.max(1.0 - law.tangent(K, 2.0) / law.secant(K, 2.0)))
    assert 0.0 < found.error_factor < worst


def test_stiffening_cable_needs_damping() -> None:
    test = BendingTest(0.2, STIFFENING, 2.0)
    hold = test.hold("displacements", 0.015)
    plain = iterate(test.rod, hold, update="consistent", damping=1.0, most=100)
    assert plain.outcome is Outcome.STALLED
    assert plain.changes[-1] > 0.1  # it does not creep, it oscillates
    damped = iterate(test.rod, hold, update="consistent")
    assert damped.outcome is Outcome.CONVERGED
    assert damped.damping < 1.0
    minimiser = simulate(test, [0.015])[0]
    assert np.allclose(damped.equilibrium.kappa, minimiser.kappa, atol=1e-8 * minimiser.kappa.max())


def test_softening_cable_is_not_damped() -> None:
    test = table_1("tangent")
    assert iterate(test.rod, test.hold("displacements", 0.005), update="consistent").damping == 1.0


def test_beyond_the_limit_point_the_iteration_says_so() -> None:
    test = table_1("secant")
    found = iterate(test.rod, test.hold("displacements", 0.025))  # K would pass 12.67 1/m
    assert found.outcome is Outcome.LIMIT_POINT


def test_profile_and_pre_curvature_along_s_take_part() -> None:
    test = replace(table_1("tangent"), pre_curvature=lambda xi: 2.0 + xi, stiffness_profile=lambda xi: 1.0 - 0.3 * xi)
    minimiser = simulate(test, [0.01])[0]
    found = iterate(test.rod, test.hold("displacements", 0.01), update="consistent")
    assert np.allclose(found.equilibrium.kappa, minimiser.kappa, atol=1e-8 * minimiser.kappa.max())


def test_what_the_method_cannot_do_is_refused() -> None:
    test = table_1("tangent")
    hold = test.hold("displacements", 0.01)
    with pytest.raises(ValueError, match="friction"):
        iterate(replace(test, friction=InternalFriction(1e-3, 1.0)).rod, hold)
    with pytest.raises(ValueError, match="damping"):
        iterate(test.rod, hold, damping=1.5)
    with pytest.raises(ValueError, match="most"):
        iterate(test.rod, hold, most=1)

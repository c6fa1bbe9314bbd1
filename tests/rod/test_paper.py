"""The paper's virtual experiments: Table 1 against the reference numbers, Figs. 4 to 7 against what the paper says."""

import numpy as np
import pytest

from rod.paper import disagreement, forced_straight, iteration_costs, table_one, virtual_inverse

# Table 1, K0 = 2 1/m, steps of 5 mm, converged discrete solutions: forces in N, largest curvatures in 1/m
REFERENCE = {
    ("secant", False): ((0.4267, 0.4463, 0.4384), (5.22, 7.50, 9.50)),
    ("tangent", False): ((0.4927, 0.5586, 0.5799), (5.10, 7.17, 8.88)),
    ("secant", True): ((0.4030, 0.4459, 0.4415), (4.51, 6.94, 8.97)),
    ("tangent", True): ((0.4515, 0.5482, 0.5760), (4.44, 6.67, 8.45)),
}


@pytest.mark.parametrize(("reading", "from_length"), REFERENCE)
def test_table_1(reading, from_length):
    forces, curvatures = REFERENCE[reading, from_length]
    experiment = table_one(reading, from_length=from_length)
    # the last printed digit, rounded or cut
    np.testing.assert_allclose(experiment.forces, forces, atol=1e-4)
    np.testing.assert_allclose(experiment.largest_curvatures, curvatures, atol=1e-2)
    assert all(step.kappa.min() == pytest.approx(2.0, abs=2e-2) for step in experiment.steps)


def test_forcing_k0_to_zero_makes_stiffness_negative_at_low_curvature():
    # 101 nodes, by two other solvers
    np.testing.assert_allclose(1e3 * forced_straight().characteristic.ordinates, (-0.61, 1.71, 1.62), atol=6e-3)


def test_figures_have_the_states_of_every_iteration_the_initial_rod_and_one_graph_a_photo():
    fit = virtual_inverse()
    assert all(step.kappa.shape == (101,) for state in fit.history for step in state.steps)
    begin, end = (np.array([step.force for step in state.steps]) for state in (fit.history[0], fit.history[-1]))
    assert begin.min() > 3.0 * end.max()  # the start is far too stiff
    np.testing.assert_allclose(end, (0.4267, 0.4463, 0.4384), atol=1e-4)
    initial = table_one("secant").initial
    assert initial.x[-1] == pytest.approx(0.198669, abs=5e-7)
    assert initial.y.max() == pytest.approx((1.0 - np.cos(0.2)) / 2.0, rel=1e-9)  # height of the arc of K0 = 2 1/m


def test_forces_alone_are_met_with_wrong_values_by_a_straight_cable():
    fit = forced_straight(curvatures=False)
    assert fit.converged
    assert fit.objective < 1e-16
    assert np.abs(fit.characteristic.ordinates / (5e-3, 3e-3, 2e-3) - 1.0).max() > 0.2


def test_the_readings_make_most_of_the_disagreement_of_fig_7():
    *causes, together = disagreement()
    assert all(len(cause.graphs) == 3 for cause in causes)
    assert sum(cause.share for cause in causes) == pytest.approx(1.0)
    assert max(causes, key=lambda cause: cause.share).cause == "secant against tangent"
    assert together.rms > 0.1
    for cause in (*causes, together):
        assert cause.rms == pytest.approx(np.linalg.norm(cause.balance / cause.inverse - 1.0) / np.sqrt(12))  # 12 bins


def test_newton_on_the_nonlinear_energy_is_cheaper_than_the_iteration():
    costs = iteration_costs()
    # error factors 0.31, 0.43, 0.54 of the secant reading: 1 - tangent / secant
    np.testing.assert_allclose([cost.error_factor for cost in costs], (0.31, 0.43, 0.54), atol=0.02)
    assert all(cost.direct_newton_steps < cost.newton_steps for cost in costs)

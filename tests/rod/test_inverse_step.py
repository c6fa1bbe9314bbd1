"""Steps of a fit within bounds, and fits whose minimum lies on one."""

from types import SimpleNamespace

import numpy as np
import pytest

from fixtures.effects import HIDE, LARGEST, Form
from fixtures.hidden import THREE, hidden_test, nudged
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.fit import TOLERANCE
from rod.inverse.step import Bounds, Linearised, lasting, least_distance, reach

SETTINGS = DiagnosisSettings()
NOTHING = Bounds(np.zeros((0, 2)), np.zeros(0))


def test_shortest_way_behind_bounds_is_perpendicular_to_those_it_ends_on():
    one = least_distance(np.array([[3.0, 4.0]]), np.array([10.0]))
    assert one == pytest.approx([1.2, 1.6])  # 10 / 5 along (3, 4) / 5
    corner = least_distance(np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]), np.array([2.0, 3.0, 1.0]))
    assert corner == pytest.approx([2.0, 3.0])
    assert least_distance(np.eye(2), np.array([-1.0, -2.0])) == pytest.approx([0.0, 0.0])


def test_a_number_at_its_bound_does_not_hold_the_others_back():
    """min (a + b - 3)^2 + (b - 2)^2: a = 1, b = 2; with b at most 1, a = 2; a share of the step has 1 / 2."""
    jacobian, residual = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([3.0, 2.0])
    free = Linearised(jacobian, residual, 1e-7, NOTHING, NOTHING)
    assert free.step(0.0) == pytest.approx([1.0, 2.0]) and free.expected_fall == pytest.approx(13.0)
    bound = Bounds(np.array([[0.0, -1.0]]), np.array([-1.0]))
    held = Linearised(jacobian, residual, 1e-7, bound, NOTHING)
    assert held.step(0.0) == pytest.approx([2.0, 1.0]) and held.expected_fall == pytest.approx(12.0)
    # how far one step goes is no bound of what is to be gained
    short = Linearised(jacobian, residual, 1e-7, NOTHING, bound)
    assert short.step(0.0) == pytest.approx([2.0, 1.0]) and short.expected_fall == pytest.approx(13.0)


def test_amounts_keep_their_sign_and_places_their_range_whatever_these_are():
    variant = SimpleNamespace(tuned=["place"], range=lambda _: (0.2, 0.9))
    term = SimpleNamespace(sign=-1.0, cause=SimpleNamespace(plausible=lambda _: 2.0), variant=variant)
    bounds = lasting(SimpleNamespace(size=3, amounts_at=[1], terms=[term], facts=None), np.array([7.0, -1.5, 0.3]))
    for farthest in ([0.0, 1.5, 0.0], [0.0, 0.0, -0.1], [0.0, 0.0, 0.6], [5.0, 1.5, 0.6]):
        assert np.min(bounds.rows @ np.array(farthest) - bounds.least) == pytest.approx(0.0, abs=1e-12)


def at_the_border():
    """Friction of the bearings on loading alone: the law takes it, rises steeply from rest and swings towards zero."""
    cable, reading = HIDE["bearing_friction"](0.018577, Form())
    return hidden_test(cable, THREE, largest=LARGEST, seed=31, reading=reading)


def test_a_law_at_the_border_of_what_has_an_equilibrium_is_a_minimum_like_any_other():
    test = at_the_border()
    bench, moved = (prepare(faults_of_input(t), SETTINGS) for t in (test, nudged(test)))
    fitted = bench.base
    # creeping along the border, a fit ended at a chi-square of 142 with one processor, and of 223 with another
    assert fitted.converged
    assert moved.base.chi2 == pytest.approx(fitted.chi2, abs=TOLERANCE)
    assert moved.largest == pytest.approx(bench.largest, abs=TOLERANCE)
    # no step from there goes lower or farther than it may
    bounds, within = lasting(fitted.extension, fitted.vector), reach(fitted.extension)
    linear = Linearised(fitted.jacobian, fitted.residual - fitted.jacobian[:, 0], 1e-7, bounds, within)
    for damping in (0.0, 1e-3, 0.1):
        step = linear.step(damping)
        assert np.all(bounds.rows @ step >= bounds.least - 1e-6) and np.all(within.rows @ step >= within.least - 1e-6)

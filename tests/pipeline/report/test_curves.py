"""Equivalent stiffness, smallest radius and pooling against closed forms and repeated draws."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.report.curves import equivalent, smallest_radius
from pipeline.report.pooling import pool, random_effects
from pipeline.result import Visited, curves, visited
from tests.pipeline.report.virtual_result import K0, curve_of, moment_of


def straight(low, slope, std, factor=None):
    """Tangent that is a straight line over 0 to 10 1/m."""
    kappa = np.linspace(0.0, 10.0, 11)
    tangent = low + slope * kappa
    zeros = np.zeros(11)
    factor = np.zeros((11, 0)) if factor is None else factor
    return Visited("inverse", kappa, zeros, zeros, tangent, np.full(11, std), tangent, zeros, factor, 0.0, 0.0)


def test_equivalent_stiffness_is_the_rise_of_the_moment(full_result):
    # curve sampled at 61 points; the trapezoidal rule is off by h^2 / 12 f' / f, below 1e-4 here
    got = equivalent(full_result.answer.curve, (3.0, 7.0))
    expected = (moment_of(np.array([7.0])) - moment_of(np.array([3.0])))[0] / 4.0
    assert got.stiffness == pytest.approx(expected, rel=1e-4)
    assert (got.low, got.high) == (3.0, 7.0)


def test_error_of_equivalent_stiffness_follows_the_covariance():
    # errors +e and -e in two halves: fully anticorrelated, the mean over both is certain; independent of the bound
    halves = np.where(np.arange(11) < 5, 1.0, np.where(np.arange(11) > 5, -1.0, 0.0))[:, None]
    assert equivalent(straight(5.0, 0.0, 1.0, halves)).std == pytest.approx(0.0, abs=1e-12)
    bound = equivalent(straight(5.0, 0.0, 1.0))
    assert bound.bound
    assert bound.std == pytest.approx(1.0)


def test_error_of_equivalent_stiffness_by_repetition():
    rng, factor = np.random.default_rng(3), np.column_stack([np.full(11, 0.3), np.linspace(0.0, 0.5, 11)])
    curve = straight(5.0, -0.2, 0.0, factor)
    draws = [equivalent(replace(curve, tangent=curve.tangent + factor @ rng.normal(size=2))) for _ in range(2000)]
    # standard error of a standard deviation from 2000 draws is 1.6 %; four of them
    assert np.std([d.stiffness for d in draws]) == pytest.approx(equivalent(curve).std, rel=0.064)


def test_range_is_cut_to_what_was_visited():
    got = equivalent(straight(5.0, 0.0, 1.0), (-5.0, 100.0))
    assert (got.low, got.high) == (0.0, 10.0)
    assert equivalent(straight(5.0, 0.0, 1.0), (11.0, 12.0)) is None


def test_departure_tells_what_a_constant_hides():
    assert equivalent(straight(5.0, 0.5, 0.1)).departure == pytest.approx(2.5 / 7.5)


def test_unsupported_points_do_not_count():
    curve = curve_of(0.01).model_copy(update={"supported": [False] * 60 + [True]})
    assert visited("inverse", curve) is None


def test_extended_model_answers_first(diagnosed, full_result):
    assert diagnosed("named").answer.curve.method == "extended"
    assert full_result.answer.curve.method == "inverse"
    assert full_result.model_copy(update={"inverse": None}).answer.curve.method == "balance"
    stuck = full_result.inverse.model_copy(update={"converged": False})
    assert full_result.model_copy(update={"inverse": stuck}).answer.curve.method == "balance"
    assert full_result.model_copy(update={"inverse": None, "balance": None}).answer.curve is None
    assert set(curves(diagnosed("named"))) == {"inverse", "balance", "extended"}


def test_an_extended_model_that_the_data_refute_answers_last(diagnosed):
    named = diagnosed("named")
    refuted = named.diagnosis.model_copy(update={"verdict": "unexplained", "extended_refuted": True})
    unexplained = named.model_copy(update={"diagnosis": refuted})
    assert unexplained.answer.curve.method == "inverse"
    assert unexplained.model_copy(update={"inverse": None, "balance": None}).answer.curve.method == "extended"


def test_smallest_radius_is_that_of_the_visible_cable(full_result):
    radius, std, step = smallest_radius(full_result)
    photo = full_result.photos[3]
    largest = max(k for k, seen in zip(photo.kappa_per_m, photo.seen, strict=True) if seen)
    assert step == 3
    assert radius == pytest.approx(1.0 / largest)
    assert std == pytest.approx(0.02 / largest**2)


def test_random_effects_of_equal_errors_is_the_plain_mean_and_scatter():
    # equal errors: mean = average, tau^2 = sample variance - sigma^2 (DerSimonian and Laird 1986, eq. 8)
    values = np.array([[1.0], [2.0], [4.0], [5.0]])
    mean, std, tau, q = random_effects(values, np.full((4, 1), 0.5))
    variance = np.var(values, ddof=1)
    assert mean[0] == pytest.approx(3.0)
    assert tau[0] ** 2 == pytest.approx(variance - 0.25)
    assert std[0] == pytest.approx(np.sqrt(variance / 4))
    assert q[0] == pytest.approx(3 * variance / 0.25)


def test_pooling_tells_scatter_from_errors():
    rng = np.random.default_rng(5)
    unit = np.ones((11, 1))

    def specimens(scatter):
        shifts = scatter * rng.normal(size=40) + 0.1 * rng.normal(size=40)
        return [straight(5.0 + shift, -0.1, 0.1, 0.1 * unit) for shift in shifts]

    same, different = pool(specimens(0.0)), pool(specimens(0.4))
    assert same.stiffness.p_value > 1e-3
    assert different.stiffness.p_value < 1e-6
    # 40 specimens know a scatter to 1 / sqrt(80), 11 %; three of those
    seen = different.stiffness
    assert np.sqrt(seen.seen**2 - seen.own**2) == pytest.approx(0.4, rel=0.34)
    assert seen.mean == pytest.approx(4.5, abs=4 * seen.mean_std)
    assert seen.seen_std == pytest.approx(seen.seen / np.sqrt(78))


def test_pooling_false_alarms_by_repetition():
    rng, alarms = np.random.default_rng(11), 0
    for _ in range(400):
        shifts = 0.1 * rng.normal(size=6)
        alarms += pool([straight(5.0 + s, 0.0, 0.1, np.full((11, 1), 0.1)) for s in shifts]).stiffness.p_value < 0.05
    # binomial with p = 0.05, n = 400: 20 with standard deviation 4.4; four of them
    assert 20 - 18 <= alarms <= 20 + 18


def test_pooling_needs_two_specimens_and_a_common_range():
    one, other = straight(5.0, 0.0, 0.1), straight(5.0, 0.0, 0.1)
    shifted = replace(other, kappa=other.kappa + 20.0)
    assert pool([one]) is None
    assert pool([one, shifted]) is None


def test_curves_start_at_the_pre_curvature(full_result):
    assert curves(full_result)["inverse"].kappa[0] == K0

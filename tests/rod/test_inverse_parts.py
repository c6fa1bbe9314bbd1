"""Block means of a photo's midline, and the data of the inverse problem at the truth."""

from dataclasses import replace

import numpy as np
import pytest

from rod.bending_test import BendingTest
from rod.compliance_law import moment_basis
from rod.inverse import estimate
from rod.inverse.base import start
from rod.inverse.base_fit import base_fit
from rod.inverse.laws import BINS, SOFTER, AnyLaw, as_photographed
from rod.inverse.prediction import Model, facts_of
from rod.inverse.simulation import freedom, run
from rod.midline import block_covariance, midline
from tests.rod.virtual_cable import StickSlip, force_free
from tests.rod.virtual_photo import Camera, bending_test

LENGTH = 0.2
LAW = StickSlip(5e-3, 1.5e-3, 4.0, 2.0)
CHORDS = force_free(LAW, LENGTH).chord - np.array([5e-3, 10e-3, 15e-3])


def measured(**kind):
    return bending_test(LAW, LENGTH, CHORDS, np.random.default_rng(2), **kind)[0]


@pytest.mark.parametrize(("low", "high", "farther"), [(0.0, 0.05, 1.0), (-0.02, 0.04, 1.0), (-0.04, 0.02, 0.0)])
@pytest.mark.parametrize(("over", "sign"), [("bend", 1.0), ("moment", -1.0)])
def test_a_law_softens_by_what_its_logarithm_falls_from_rest_to_the_farther_end(low, high, farther, over, sign):
    basis = moment_basis(low, high, unit=60.0)
    knots = basis.spline.t
    greville = (knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3.0  # coefficients of the abscissa itself
    told, by = AnyLaw(basis, over).softening(greville)
    rest = -low / (high - low)
    assert told * SOFTER[1] + SOFTER[0] == pytest.approx(sign * (rest - farther), abs=1e-9)
    assert told == pytest.approx(by @ greville - SOFTER[0] / SOFTER[1])


@pytest.mark.parametrize("free", [0, 40, BINS * 5])
def test_a_law_is_photographed_beside_sections_without_a_moment(free):
    """Covers hide the ends of a thick cable: between a force-free photo and the loaded ones lie no small moments."""
    moment = np.r_[np.zeros(free), np.linspace(0.03, 0.2, BINS * 15)]
    law, coefficients, rest = as_photographed(moment, 2.0 + moment / 5e-3, unit=5e-3)
    assert rest == pytest.approx(2.0, abs=1e-6)
    assert law.basis.law(coefficients).at(moment[free:])[1] == pytest.approx(1.0 / 5e-3, rel=0.02)


def test_moments_that_are_all_alike_show_no_law():
    assert as_photographed(np.zeros(100), np.linspace(1.0, 2.0, 100), unit=5e-3) is None


def test_the_chord_of_a_photo_is_the_distance_of_its_ends():
    test = measured()
    step = replace(test.steps[1], chord=None)
    aside = replace(step, shape=replace(step.shape, x=step.shape.x + 1e-3))
    one, two = (estimate(replace(test, steps=(given,))).test.steps[0].chord for given in (step, aside))
    assert one == pytest.approx(two, rel=1e-12)


def test_residuals_are_white_at_the_truth():
    test = measured(camera=Camera(axis_px=1e-6, scale=1e-9, length=1e-9))
    chi2, count = estimate(test).chi2("shape")
    # Five standard deviations of chi2.
    assert abs(chi2 - count) < 5 * np.sqrt(2 * count)


def test_no_prediction_where_no_equilibrium_exists():
    test = measured()
    pulled = tuple(replace(step, displacement=-0.1 * LENGTH) for step in test.steps)  # beyond the cable's length
    longer = replace(test, steps=pulled)
    assert base_fit(longer, facts_of(longer)).fitted.run.prediction is None


@pytest.mark.parametrize(("error", "K0", "free"), [(-5e-4, 0.0, True), (-1e-3, 2.0, False)])
def test_a_mounted_cable_is_free_where_log_and_error_of_its_zero_cancel(error, K0, free):
    """There a straight one has no force, though no chord of it can be imposed; a bent one beyond is pulled."""
    facts = replace(facts_of(measured()), branch=("mounted",), displacement=np.array([5e-4]), hold_times=(np.zeros(1),))
    model = Model(BendingTest(LENGTH, 5e-3, K0), shift=np.array([error]))
    assert freedom(model, facts) == [([0], free)]
    (force,) = run(model, facts).prediction.force
    assert force == 0.0 if free else force < 0.0


def test_a_step_that_no_log_states_begins_where_its_photo_shows_it():
    test = measured()
    steps = tuple(replace(step, displacement=None) for step in test.steps[1:])
    unlogged = replace(test, steps=steps)
    facts = facts_of(unlogged)
    base = start(unlogged, facts, begin=(LAW.EI0, LAW.K0))
    first = run(base.model(base.neutral(), steps=len(steps)), facts).prediction
    assert first.chord == pytest.approx([step.chord for step in steps], abs=1e-6)


def test_an_error_of_the_stated_length_is_told_in_metres():
    test = measured()
    found, std, before = estimate(replace(test, length=LENGTH - 1e-3, length_std=1e-3)).nuisances["length"]
    assert before == pytest.approx(1e-3)
    assert std < 0.1 * before
    assert found == pytest.approx(1e-3, abs=3.0 * std)


def test_block_covariance_is_that_of_the_means():
    rng = np.random.default_rng(4)
    s, std = np.sort(rng.uniform(0, 10, 60)), rng.uniform(0.5, 2, 60)
    full = np.outer(std, std) * np.exp(-np.abs(s[:, None] - s[None, :]) / 1.7)
    first = np.array([0, 7, 20, 21, 45])
    sections = np.diff(np.r_[first, 60])
    average = np.zeros((5, 60))
    for k, (i, n) in enumerate(zip(first, sections, strict=True)):
        average[k, i : i + n] = 1 / n
    assert np.allclose(block_covariance(s, std, first, sections, 1.7), average @ full @ average.T, rtol=1e-12)


def test_blocks_lose_next_to_nothing():
    """A constant push of all sections is known as well from the blocks as from every section."""
    shape = measured().steps[1].shape
    blocks = midline(shape)
    known = np.sum(np.linalg.solve(blocks.factor, np.ones(blocks.s.size)) ** 2)
    gap = np.diff(shape.section_s)
    rho = np.exp(-gap / shape.correlation_length)
    # Information on a constant in a Markov process, section by section.
    exact = 1 / shape.section_std[0] ** 2 + np.sum((1 - rho) ** 2 / (1 - rho**2)) / shape.section_std[0] ** 2
    assert known == pytest.approx(exact, rel=0.02)


def test_block_means_lie_on_the_curve_not_inside_it():
    shape = measured(camera=Camera(section_px=1e-6, axis_px=1e-9, scale=1e-9)).steps[3].shape
    blocks = midline(shape, blocks=20)
    x, y = np.interp(blocks.s, shape.s, shape.x), np.interp(blocks.s, shape.s, shape.y)
    # Linear interpolation of the curve itself is the limit here: h^2 K / 8 = 1e-6 m.
    assert np.abs(-np.sin(blocks.theta) * (blocks.x - x) + np.cos(blocks.theta) * (blocks.y - y)).max() < 2e-6


def test_a_midline_needs_sections():
    shape = measured().steps[1].shape
    few = replace(shape, section_s=shape.section_s[:4], section_x=shape.section_x[:4], section_y=shape.section_y[:4])
    with pytest.raises(ValueError, match="do not make a shape"):
        midline(replace(few, section_std=shape.section_std[:4]))


def test_offsets_of_sections_are_those_along_the_normal():
    """Sections beside an arc, between its points, on a line that turns by a right angle."""
    K, first, s, at = 8.0, 1.2, np.linspace(0.0, 0.2, 41), np.linspace(0.003, 0.196, 60)
    off = 1e-4 * np.sin(90.0 * at)

    def arc(s):
        theta = first - K * s
        return (np.sin(first) - np.sin(theta)) / K, (np.cos(theta) - np.cos(first)) / K, theta

    shape = bending_test(LAW, LENGTH, CHORDS[:1], np.random.default_rng(1))[0].steps[-1].shape
    (x, y, theta), (u, v, turned) = arc(s), arc(at)
    beside = {"section_s": at, "section_x": u - off * np.sin(turned), "section_y": v + off * np.cos(turned)}
    bent = replace(shape, s=s, x=x, y=y, theta=theta, **beside)
    assert bent.section_offsets() == pytest.approx(off, abs=1e-8)

"""Parts of the inverse problem: jacobian, distances, whitening."""

from dataclasses import replace

import numpy as np
import pytest

from rod.compliance_law import ComplianceLaw, moment_basis
from rod.inverse.evaluation import evaluate, free_cable
from rod.inverse.fit import fit
from rod.inverse.fit_model import fit_model, step_data, zero_of_displacement
from rod.inverse.problem import straight_line
from rod.midline import block_covariance, midline
from tests.rod.virtual_cable import StickSlip, force_free
from tests.rod.virtual_photo import Camera, bending_test, moved_axes, parted_axes

LENGTH = 0.2
LAW = StickSlip(5e-3, 1.5e-3, 4.0, 2.0)
CHORDS = force_free(LAW, LENGTH).chord - np.array([5e-3, 10e-3, 15e-3])


def measured(**kind):
    return bending_test(LAW, LENGTH, CHORDS, np.random.default_rng(2), **kind)[0]


def model_of(test):
    basis = moment_basis(0.0, 1.05 * float(LAW.moment(9.2)), unit=1.0 / LAW.EI0)
    return fit_model(test, step_data(test, blocks=60), basis, elements=80)


def start_of(model, law=LAW):
    """Unknowns at a law's own compliance."""
    kappa = np.linspace(law.K0, law.K0 + 8.0, 400)
    compliance = np.interp(model.basis.moments, law.moment(kappa), 1.0 / law.tangent(kappa))
    coefficients = np.linalg.lstsq(model.basis.at_ends, np.log(compliance / model.basis.unit), rcond=None)[0]
    return model.start(ComplianceLaw(model.basis, coefficients), law.K0)


@pytest.mark.parametrize(("blind", "scatter"), [(False, None), (True, None), (True, 1e-4)])
def test_jacobian_against_central_differences(blind, scatter):
    test = measured()
    if blind:
        last = replace(test.steps[3], shape=None, chord=None, chord_std=None, displacement_std=scatter)
        test = replace(test, steps=(*test.steps[:3], last))
    model = model_of(test)
    assert ("moved/3" in model.nuisances) == (scatter is not None)
    rng = np.random.default_rng(0)
    u = (
        start_of(model)
        + rng.normal(0, 1, model.size) * np.r_[np.full(model.laws, 0.01), np.ones(model.size - model.laws)]
    )
    here = evaluate(model, u)
    assert here.failure is None
    for place in range(model.size):
        # Steps of the size at which truncation and the rod's own tolerance (1e-9) are equally small.
        h = np.eye(model.size)[place] * (1e-4 if place < model.laws else 1e-2)
        ahead, behind = (evaluate(model, u + sign * h, starts=here.equilibria).value for sign in (1, -1))
        slope = (ahead - behind) / (2 * h[place])
        # what moves no residual by a hundredth of its standard deviation is a place of the law that no shape visits
        largest = max(np.abs(slope).max(), 1e-2)
        assert np.allclose(here.jacobian[:, place], slope, atol=5e-4 * largest), place


def test_the_free_cable_moves_with_its_unknowns_as_told():
    model = model_of(measured())
    u = start_of(model)
    arc = free_cable(model, u)
    for place in (model.basis.size, model.index("length")):
        h = np.eye(model.size)[place] * 1e-4
        ahead, behind = (free_cable(model, u + sign * h) for sign in (1.0, -1.0))
        # by K0 and by the length, which the unknowns hold in units of their own
        column, unit = (-3, 1.0 / model.length) if place == model.basis.size else (-2, model.nuisances["length"])
        for name in ("x", "y", "theta"):
            slope = (getattr(ahead, name) - getattr(behind, name)) / 2e-4
            told = unit * getattr(arc, f"{name}_by")[:, column]
            assert np.allclose(told, slope, atol=1e-6 * np.abs(slope).max()), name


def test_the_chord_of_a_photo_is_the_distance_of_its_ends():
    test = measured()
    step = replace(test.steps[1], chord=None)
    aside = replace(step, shape=replace(step.shape, x=step.shape.x + 1e-3))
    one, two = (step_data(replace(test, steps=(given,)))[0].chord for given in (step, aside))
    assert one == pytest.approx(two, rel=1e-12)


def test_residuals_are_white_at_the_truth():
    test = measured(camera=Camera(axis_px=1e-6, scale=1e-9, length=1e-9))
    model = model_of(test)
    found = fit(model, start_of(model))
    chi2, count = found.evaluation.chi2("shape")
    # Five standard deviations of chi2.
    assert abs(chi2 - count) < 5 * np.sqrt(2 * count)


def test_infinite_residuals_where_no_equilibrium_exists():
    model = model_of(measured())
    longer = 0.2 / model.nuisances["scale"]  # chords a fifth longer than measured: beyond the cable's length
    there = evaluate(model, start_of(model) + np.eye(model.size)[model.index("scale")] * longer)
    assert there.failure is not None
    assert np.all(np.isinf(there.value))


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
    known = np.sum((blocks.whitener @ np.ones(blocks.s.size)) ** 2)
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


def test_a_start_is_the_straight_line_of_curvature_over_moment():
    m = np.linspace(0.0, 0.02, 9)
    assert straight_line(m, 2.0 + m / 5e-3) == pytest.approx((5e-3, 2.0))
    level = np.r_[1.0, -2.0, 1.0, 0.0, 0.0, 0.0, -1.0, 2.0, -1.0]  # no slope at all: a fiftieth of the range
    assert straight_line(m, level)[0] == pytest.approx(0.02 / (0.02 * 4.0))


def test_whitener_needs_sections():
    shape = measured().steps[1].shape
    few = replace(shape, section_s=shape.section_s[:4], section_x=shape.section_x[:4], section_y=shape.section_y[:4])
    with pytest.raises(ValueError, match="do not make a shape"):
        midline(replace(few, section_std=shape.section_std[:4]))


def test_errors_of_the_axes_are_taken_back_whatever_their_source():
    """Axes found beside the pins and too far from the camera's foot: told so, every distance is what it was."""
    test = replace(measured(), axis_std=1e-4, axis_parallax_std=1e-3, camera_foot_std=0.05)
    test = replace(test, steps=tuple(replace(step, picture_centre=(0.08, 0.01)) for step in test.steps))
    model, here = model_of(test), start_of(model_of(test))

    def distances(moved, told):
        u = here.copy()
        for name, value in told.items():
            u[model.index(name)] = value / model.nuisances[name]
        found = evaluate(model_of(moved), u)
        return np.concatenate([found.value[block] for name, block in found.blocks.items() if name.startswith("shape")])

    same = distances(test, {})
    lifted, parted = moved_axes(test, 2e-5, -3e-5), parted_axes(test, 1e-4, (0.08, 0.01))
    # a turn and a stretch by 2e-4 are exact to their squares; the noise of a midline is 5e-6 m
    for moved, told in (
        (lifted, {"left_across": 2e-5, "right_across": -3e-5}),
        (lifted, {f"{part}/{k}": e for part, e in (("left_across", 2e-5), ("right_across", -3e-5)) for k in range(4)}),
        (moved_axes(test, 2e-5, 2e-5), {"foot_across": 2e-5}),
        (parted, {"parallax": 1e-4}),
    ):
        assert np.abs(distances(moved, {}) - same).max() > 1.0
        assert distances(moved, told) == pytest.approx(same, abs=0.02)


def test_zero_of_displacement_is_that_of_the_photos():
    test = measured()
    alone = zero_of_displacement(step_data(replace(test, steps=test.steps[1:2])))
    assert alone == pytest.approx((test.steps[1].chord + test.steps[1].displacement, test.steps[1].chord_std))
    value, std = zero_of_displacement(step_data(test))
    assert value == pytest.approx(force_free(LAW, LENGTH).chord, abs=4 * std)
    assert zero_of_displacement(()) is None


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

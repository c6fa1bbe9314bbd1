"""Sub-pixel edges: the profile's derivatives, bias and scatter on drawn edges, and what must not mislead the search."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.stats import norm

from pipeline.vision.centerline.curvature import PlaneCurve, make_frame, normals
from pipeline.vision.centerline.edge_profile import Pixels, fit_edges, fit_profiles, profile
from pipeline.vision.centerline.edges import in_picture, search_edges
from pipeline.vision.centerline.midline import _cable_width, free_of_covers, measure_sections
from pipeline.vision.photo import Closeup, straightened

BLUR, DARK, STEP = 0.9, 0.2, 0.6
ACROSS = np.arange(-8.0, 7.0)


def pixels_of(place, rng, *, noise, sections=240, rows=4, inside=0.0, outside=0.0, letters=0.0) -> Pixels:
    """Pixels about two edges at ``place`` ``(2, n)``; ramps in grey per px; white letters on a share of some rows."""
    offset = np.tile(ACROSS, (2, sections, rows, 1)) + rng.uniform(-0.5, 0.5, (2, sections, rows, 1))
    u = offset - np.broadcast_to(place, (2, sections))[..., None, None]
    z = u / BLUR
    bent = BLUR * (z * norm.cdf(z) + norm.pdf(z))
    value = DARK + STEP * norm.cdf(z) + outside * bent + inside * (u - bent)
    if letters:
        written = (np.arange(sections) % 40 < 10)[:, None] & (rng.random((sections, rows)) < letters)
        value = np.where(written[None, ..., None] & (u < -4.0), 0.9, value)
    value = value + noise * rng.standard_normal(value.shape)
    shape = (2, sections, -1)
    return Pixels(offset.reshape(shape).astype(np.float32), value.reshape(shape).astype(np.float32), len(ACROSS))


def fitted(pixels):
    s = np.arange(pixels.value.shape[1]) * 8.0
    profiles = fit_profiles(pixels, s, blur=0.8)
    return profiles, fit_edges(pixels, s, profiles)


@pytest.mark.parametrize("u", [-2.3, -0.4, 0.0, 1.1])
def test_ramps_are_blurred_straight_lines(u):
    """R_out is max(t, 0) and R_in is min(t, 0), convolved with the Gaussian blur."""
    _, inside, outside, density = profile(np.array([u]), np.array([0.0]), np.array([BLUR]))
    for found, ramp in ((outside, lambda t: max(t, 0.0)), (inside, lambda t: min(t, 0.0))):
        exact = quad(lambda t, ramp=ramp: ramp(t) * norm.pdf(u - t, scale=BLUR), -12.0, 12.0, points=[0.0])[0]
        assert_allclose(found[0], exact, atol=1e-9)  # the quadrature's own error
    assert_allclose(density[0], norm.pdf(u, scale=BLUR))


def test_edges_of_a_plain_step_reach_the_theoretical_limit():
    """Unbiased, and scattered by no more than (n/A) sqrt(2 sqrt(pi) w) per row, the limit with level and step free."""
    rng = np.random.default_rng(0)
    place = rng.uniform(-0.1, 0.1, (2, 240))  # as far as the path may be off
    noise, rows = 0.012, 4
    _, edges = fitted(pixels_of(place, rng, noise=noise, rows=rows))
    error = edges.place - place
    limit = noise / STEP * np.sqrt(2.0 * np.sqrt(np.pi) * BLUR) / np.sqrt(rows)
    assert abs(error.mean()) < 4.0 * limit / np.sqrt(error.size)
    # Place alone would reach the limit; level and step cost a third, robust weights a twentieth more.
    assert limit < error.std() < 1.45 * limit
    assert_allclose(np.median(edges.std), error.std(), rtol=0.1)  # 480 edges tell it to 3 %: three of those


def test_shadow_and_shading_do_not_move_the_edge_with_ramps():
    """A soft shadow outside and shading inside: with ramps the place is right, the plain error function is off."""
    rng = np.random.default_rng(1)
    pixels = pixels_of(np.zeros((2, 240)), rng, noise=0.005, inside=0.012, outside=0.02)
    profiles, edges = fitted(pixels)
    # The plain one is off by 0.04 px; a tenth of that is asked for, which is ten standard errors of the median.
    assert abs(np.median(edges.place)) < 0.004
    # The difference of the two models is what the systematic error is judged by.
    assert_allclose(np.abs(np.median(profiles.shift)), 0.04, atol=0.01)
    # Noise in 29,000 pixels leaves a tenth of a percent; weights that pixels far off the profile lose, some more.
    assert_allclose(np.median(profiles.outside), 0.02 / STEP, rtol=0.02)
    assert_allclose(np.median(profiles.inside), 0.012 / STEP, rtol=0.02)
    assert_allclose(np.median(profiles.blur), BLUR, rtol=0.01)


def test_letters_on_the_sheath_do_not_move_the_edge():
    rng = np.random.default_rng(2)
    _, edges = fitted(pixels_of(np.zeros((2, 240)), rng, noise=0.005, letters=0.4))
    written = np.arange(240) % 40 < 10
    limit = 0.005 / STEP * np.sqrt(2.0 * np.sqrt(np.pi) * BLUR) / np.sqrt(4)  # of a section, as above
    # four standard errors of a median, and five standard deviations: one in two million numbers
    assert abs(np.nanmedian(edges.place[:, written])) < 4.0 * 1.25 * limit / np.sqrt(2 * written.sum())
    assert np.nanmax(np.abs(edges.place)) < 5.0 * limit


def test_section_without_an_edge_is_reported_as_lost():
    rng = np.random.default_rng(3)
    pixels = pixels_of(np.zeros((2, 240)), rng, noise=0.01)
    pixels.value[0, 100:104] = DARK  # a dark object beside the cable: no ground there
    _, edges = fitted(pixels)
    # lost at once, or so far off or so faint that nobody takes it for the edge
    gone = ~np.isfinite(edges.place[0]) | (np.abs(edges.place[0]) > 1.0) | (edges.step[0] < 0.1 * STEP)
    assert np.all(gone[100:104])
    assert np.all(np.isfinite(edges.place[1]))


def test_noise_has_no_edge():
    """Blank paper over a stretch: half of its sections have a step upward where an edge is sought."""
    rng = np.random.default_rng(4)
    pixels = pixels_of(np.zeros((2, 240)), rng, noise=0.01)
    pixels.value[:, 80:160] = 0.95 + 0.01 * rng.standard_normal(pixels.value[:, 80:160].shape)
    _, edges = fitted(pixels)
    found = np.isfinite(edges.place)
    # one in a thousand passes three standard deviations at a given place, a few more at the best of some
    assert found[:, 82:158].mean() < 0.05
    # profiles are told in windows of fifteen sections, and taken linearly between them
    assert found[:, :65].all() and found[:, 175:].all()


def straight(length=400.0, v=60.0) -> PlaneCurve:
    frame = make_frame(length, intervals=16)
    return PlaneCurve(frame, np.zeros(frame.size - 2), np.array([frame.grid[frame.anchor] + 20.0, v]), 0.0)


def strip_picture(*, half=24.0, middle=60.0, highlight=True) -> Closeup:
    """A dark cable along u with a highlight wider than either dark strip beside it, and lines on the ground."""
    v = np.arange(120.0)[:, None] * np.ones((1, 440))
    grey = np.where(np.abs(v - middle) < half, 0.2, 0.8)
    if highlight:
        grey = np.where(np.abs(v - middle + 4.0) < 10.0, 0.7, grey)
    grey = np.where((v == 18.0) | (v == 110.0), 0.1, grey)
    return Closeup(grey.astype(np.float32), (0, 0))


@pytest.mark.parametrize("lead", [-6.0, 0.0, 6.0])
def test_search_finds_the_sheath_and_not_the_highlight(lead):
    found = search_edges(strip_picture(), straight(v=60.0 + lead), span=(10.0, 390.0), half_width=24.0, tolerance=0.15)
    assert np.all(found.usable)
    # a step between two pixels, sought pixel by pixel
    assert_allclose(found.edges + lead, np.tile([-24.0, 24.0], (len(found.edges), 1)), atol=1.0)


def test_straightened_strip_is_the_picture_along_the_path():
    u, v = np.meshgrid(np.arange(440.0), np.arange(120.0))
    ground = Closeup((0.001 * u + 0.005 * v).astype(np.float32), (0, 0))
    s, t = np.linspace(50.0, 300.0, 7), np.array([-10.0, 0.0, 10.0])
    exact = 0.001 * (s[:, None] + 20.0) + 0.005 * (60.0 + t)
    where, angle = straight().at(s)
    found = straightened(ground.grey, where, normals(angle), t)[..., 0]
    assert_allclose(found, exact, atol=1e-4)  # remap rounds to 1/32 px, at 0.006 a px


@pytest.mark.parametrize("above", [False, True])
def test_a_jaw_that_goes_on_beside_one_edge_is_no_cable(above):
    """As dark as the cable and twice as wide: its own edge lies where the cable's would, its other one far away."""
    ground = strip_picture(highlight=False)
    jaw = slice(10, 82) if above else slice(38, 110)
    ground.grey[jaw, :160] = 0.2
    ground = Closeup(cv2.GaussianBlur(ground.grey, (0, 0), 1.0), (0, 0))
    s = np.linspace(20.0, 390.0, 240)
    found = measure_sections(ground, straight(), s, half_width=24.0, diameter=48.0, blur=1.0)
    assert found.s[0] > 140.0 - 4.0  # the jaw ends 140 px along the path, blurred by 1 px


@pytest.mark.parametrize("end", ["first", "last"])
def test_edges_at_the_very_end_are_judged_by_those_beside_them(end):
    """The shade of a cover's rim moves one edge of the outermost sections by a pixel, the midline by half of that."""
    ground = strip_picture(highlight=False)
    ground.grey[37, slice(None, 45) if end == "first" else slice(405, None)] = 0.8
    noise = 0.01 * np.random.default_rng(0).standard_normal(ground.grey.shape)
    ground = Closeup((cv2.GaussianBlur(ground.grey, (0, 0), 1.0) + noise).astype(np.float32), (0, 0))
    s = np.linspace(20.0, 390.0, 240)
    found = measure_sections(ground, straight(), s, half_width=24.0, diameter=48.0, blur=1.0)
    middle = 0.5 * (found.first + found.second)[:, 1]
    assert np.abs(middle - np.median(middle)).max() < 0.15  # scatter of a section is 0.03 px


def test_a_few_sections_with_other_edges_do_not_tell_the_width():
    """The border of light and shade seems surer than a flank as dark as the ground; weighed by that alone: 26.3 px."""
    width = np.full(240, 30.0)
    width[100:130] = 25.4
    doubt = np.array([np.full(240, 0.04), np.where(width < 30.0, 0.04, 2.2)])
    likely, std = _cable_width(width, doubt, 29.9)
    assert likely == pytest.approx(30.0, abs=0.5) and std < 1.2
    assert _cable_width(width, doubt, None)[0] > 28.5
    # what all sections tell alike and surely, a diameter that is stated to some percent hardly moves
    assert _cable_width(np.full(240, 30.0), np.full((2, 240), 0.02), 31.0)[0] == pytest.approx(30.0, abs=0.05)


def test_sections_beside_the_picture_or_under_a_cover_are_left_out():
    s = np.linspace(0.0, 400.0, 401)
    inside = in_picture(strip_picture(), straight(v=20.0), s, 25.0)
    assert not inside.any()
    assert in_picture(strip_picture(), straight(), s, 25.0)[10:390].all()
    free = free_of_covers(straight(), s, 15.0, np.array([[20.0, 60.0, 40.0]]))
    hidden = np.hypot(s, 15.0) <= 40.0
    assert np.array_equal(free, ~hidden)

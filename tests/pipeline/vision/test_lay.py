"""A wiggle painted on the cable: taken off where all photos show it, left where only one does or a bend could."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.settings.vision.centerline import CurveSettings
from pipeline.vision.centerline.lay import relieved
from tests.rod.virtual_cable import StickSlip
from tests.rod.virtual_photo import bending_test

DIAMETER = 4.6e-3
SETTINGS = CurveSettings()
WAVE = 2e-5
"""m; about six times the noise of a section averaged over a diameter."""


@pytest.fixture(scope="module")
def shapes():
    law = StickSlip(0.02, 0.008, 5.0, 2.0)
    test, _ = bending_test(law, 0.181, [0.176, 0.172, 0.168, 0.164, 0.16], np.random.default_rng(7))
    return [step.shape for step in test.steps if step.shape is not None]


def pushed(shape, push):
    """The shape with its sections moved by `push` (function of arc length, m) along the normal."""
    theta = np.interp(shape.section_s, shape.s, shape.theta)
    off = push(shape.section_s)
    return replace(
        shape, section_x=shape.section_x - np.sin(theta) * off, section_y=shape.section_y + np.cos(theta) * off
    )


def amplitude(shape, reference, wave):
    """Part of `wave` (m per section) in what separates the sections of two shapes."""
    theta = np.interp(shape.section_s, shape.s, shape.theta)
    dx, dy = shape.section_x - reference.section_x, shape.section_y - reference.section_y
    off = -np.sin(theta) * dx + np.cos(theta) * dy
    pattern = wave(shape.section_s)
    return float(off @ pattern / (pattern @ pattern))


def lay(s):
    """Twisted strands: a period of three diameters, as black and white pairs have it."""
    return WAVE * np.sin(2.0 * np.pi * s / (3.0 * DIAMETER))


def test_what_all_photos_show_at_the_same_place_is_taken_off(shapes):
    seen = relieved([pushed(shape, lay) for shape in shapes], DIAMETER)
    clean = relieved(shapes, DIAMETER)
    for one, other in zip(seen, clean, strict=True):
        # the running mean of 1.5 widths keeps a hundredth of it; cells of the mean and noise in it some more
        assert abs(amplitude(one, other, lay)) < 0.1
    # what is left scatters less, by the wave, and is told so; an rms of some hundred sections a photo
    told = np.mean([one.section_std.mean() / shape.section_std.mean() for one, shape in zip(seen, shapes, strict=True)])
    noise = np.mean([shape.section_std.mean() for shape in shapes])
    assert told == pytest.approx(noise / np.hypot(noise, WAVE / np.sqrt(2.0)), rel=0.1)


def test_what_one_photo_shows_stays(shapes):
    seen = relieved([pushed(shapes[0], lay), *shapes[1:]], DIAMETER)
    assert amplitude(seen[0], shapes[0], lay) > 0.8  # a fifth is what one of five photos has in their mean


def test_what_a_bend_could_do_stays(shapes):
    """A soft spot four diameters wide: its deflection is slower still, here even that of its curvature's own width."""

    def spot(s):
        return WAVE * np.exp(-0.5 * ((s - 0.09) / (4.0 * DIAMETER)) ** 2)

    seen = relieved([pushed(shape, spot) for shape in shapes], DIAMETER)
    clean = relieved(shapes, DIAMETER)
    for one, other in zip(seen, clean, strict=True):
        assert amplitude(one, other, spot) > 0.96  # 1 - 4 / sqrt(16 + 1.5^2 / 2) is what a mean of 1.5 widths takes


def test_noise_alone_is_hardly_touched(shapes):
    for one, shape in zip(relieved(shapes, DIAMETER), shapes, strict=True):
        moved = np.hypot(one.section_x - shape.section_x, one.section_y - shape.section_y)
        # the mean of five photos has 0.45 of the noise of one; that it is chance must take half of it and more
        assert np.sqrt(np.mean(moved**2)) < 0.22 * shape.section_std.mean()
        assert one.section_std.mean() == pytest.approx(shape.section_std.mean(), rel=0.05)  # some hundred sections


def test_a_single_photo_is_returned_as_it_is(shapes):
    assert relieved(shapes[:1], DIAMETER) == shapes[:1]

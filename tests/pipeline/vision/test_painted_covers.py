"""Covers that no renderer of the program paints: a dome, a target of quadrants, an arm of the cable's look."""

import numpy as np
import pytest
from scipy.special import erfc

from pipeline.vision.bearings.covers import find_cover
from pipeline.vision.bearings.rim import Radius
from pipeline.vision.photo import Photo
from pipeline.vision.render import Camera, Ground, render
from tests.pipeline.vision.test_bearings import GREY, SCALE, photo_of, rough_end, scene


def test_dome_brighter_than_the_ground_on_one_side_and_darker_on_the_other_is_not_taken_for_its_shadow() -> None:
    """Painted here, not by the renderer: a step of both signs round the rim, and a soft shadow of the same size."""
    picture = render(scene(covers=(None, None), ground=Ground(colour=GREY)))
    radius = 0.006 * SCALE
    grey = photo_of(picture).pixels.astype(float)
    v, u = np.mgrid[: grey.shape[0], : grey.shape[1]]
    ground = float(np.median(grey))
    for center in (picture.left_px, picture.right_px):
        du, dv = u - center[0], v - center[1]
        lit = ground * (0.94 + 0.3 * (0.6 * du + 0.8 * dv) / radius)
        shade = 0.5 * erfc((np.hypot(du + 0.3 * radius, dv - 0.25 * radius) - radius) / (np.sqrt(2.0) * 4.0))
        disc = 0.5 * erfc((np.hypot(du, dv) - radius) / np.sqrt(2.0))
        grey = disc * lit + (1.0 - disc) * grey * (1.0 - 0.3 * shade)
    grey += np.random.default_rng(1).normal(0.0, 1.5, grey.shape)
    photo = Photo("dome", grey.clip(0, 255).astype(np.uint8), 8)
    for side, true in enumerate((picture.left_px, picture.right_px)):
        circle = find_cover(photo, rough_end(picture, side, radius), Radius(radius, 0.01), 0.0046 * SCALE)
        assert circle is not None
        # the shadow's centre lies 0.39 radii away; 3.5 standard deviations and 0.1 px as for every other look
        assert np.all(np.abs(np.subtract(circle.center, true)) < 3.5 * circle.std)
        assert circle.std < 0.1


@pytest.mark.parametrize("scale", [SCALE, 2700.0])
def test_quadrants_of_a_target_tell_its_axis(scale: float) -> None:
    """Painted here: black quadrants in a white rim, steeper than it all along two quarters, and no ring that is round.

    The smaller one has a rim of less than two pixels, which its blur joins to the quadrants.
    """
    camera = Camera(round(0.06 * scale), round(0.034 * scale), scale, look_at_m=(0.017, 0.0))
    picture = render(scene(covers=(None, None), camera=camera))
    radius, grey = 0.006 * scale, photo_of(picture).pixels.astype(float)
    v, u = np.mgrid[: grey.shape[0], : grey.shape[1]]
    for center in (picture.left_px, picture.right_px):
        du, dv = u - center[0], v - center[1]
        inner, disc = (0.5 * erfc((np.hypot(du, dv) - share * radius) / 1.1) for share in (0.88, 1.0))
        along, across = (0.5 * erfc(way / 1.1) for way in (0.9 * du + 0.44 * dv, 0.9 * dv - 0.44 * du))
        black = inner * (along * across + (1.0 - along) * (1.0 - across))
        grey = disc * (240.0 - 225.0 * black) + (1.0 - disc) * grey
    grey += np.random.default_rng(1).normal(0.0, 1.5, grey.shape)
    photo = Photo("target", grey.clip(0, 255).astype(np.uint8), 8)
    for side, true in enumerate((picture.left_px, picture.right_px)):
        circle = find_cover(photo, rough_end(picture, side, radius), Radius(radius, 0.01), 0.0046 * scale)
        assert circle is not None
        assert np.hypot(*np.subtract(circle.center, true)) < 3.0 * circle.std < 0.4


def test_cover_is_found_where_an_arm_of_the_cables_look_lies_beyond_it() -> None:
    """The mask runs on over the arm, whose end is no cover."""
    picture, radius, width = render(scene()), 0.006 * SCALE, 0.0046 * SCALE
    pixels = photo_of(picture).pixels.astype(float)
    v, u = np.mgrid[: pixels.shape[0], : pixels.shape[1]]
    for side, true in enumerate((picture.left_px, picture.right_px)):
        end = rough_end(picture, side, radius, off=2.9)
        du, dv = u - true[0], v - true[1]
        ahead, aside = du * end.outward[0] + dv * end.outward[1], dv * end.outward[0] - du * end.outward[1]
        arm = (np.abs(aside) < 0.5 * width) & (ahead > 0.0) & (ahead < 4.2 * radius) & (np.hypot(du, dv) > radius)
        photo = Photo("arm", np.where(arm, np.quantile(pixels, 0.02), pixels).astype(np.uint8), 8)
        circle = find_cover(photo, end, Radius(radius, 0.01), width)
        assert circle is not None
        assert np.hypot(*np.subtract(circle.center, true)) < 0.1  # px, as for any look

"""Pins hardly wider than the cable, which runs on beyond them."""

import cv2
import numpy as np
import pytest

from pipeline.vision.bearings.covers import find_cover
from pipeline.vision.bearings.cut import cover_by_cut
from pipeline.vision.bearings.rim import Radius
from pipeline.vision.photo import Photo
from pipeline.vision.search.ends import CableEnd


@pytest.mark.parametrize("slope", [0.0, 0.3, 0.6])
def test_end_of_a_cable_is_not_taken_for_the_middle_of_a_cover_hardly_wider(slope: float) -> None:
    """A pin of 8 mm on a cable of 5 mm that runs on beyond it: what is round at its end is the cable itself."""
    v, u = (np.mgrid[0:320, 0:640] / 4.0) - 0.375
    outward, end = np.array([np.cos(slope), np.sin(slope)]), np.array([110.2, 50.3])
    along = (u - end[0]) * outward[0] + (v - end[1]) * outward[1]
    aside = (v - end[1]) * outward[0] - (u - end[0]) * outward[1]
    drawn = cv2.GaussianBlur(np.where((along < 0.0) & (np.abs(aside) < 4.4), 60.0, 190.0), (0, 0), 4.0)
    grey = drawn.reshape(80, 4, 160, 4).mean(axis=(1, 3)) + np.random.default_rng(5).normal(0.0, 3.0, (80, 160))
    photo = Photo("a", np.rint(grey).clip(0, 255).astype(np.uint8), 8)
    for off in (-0.4, 0.0, 0.4):
        assert find_cover(photo, CableEnd(end + off * outward, outward), Radius(7.1, 0.01), 8.9) is None


@pytest.mark.parametrize("stub", [0.0, 16.0])
@pytest.mark.parametrize("step", [0.0, 2.0])
def test_pin_of_the_grounds_own_grey_is_found_by_the_hollow_in_which_it_cuts_the_cable_off(
    step: float, stub: float
) -> None:
    """Its rim does not show; the cable may come out of it beyond, and a stub's own end is no rim."""
    v, u = (np.mgrid[0:320, 0:640] / 4.0) - 0.375
    outward, pin, radius, half = np.array([np.cos(0.3), np.sin(0.3)]), np.array([100.2, 52.3]), 15.0, 11.0
    along = (u - pin[0]) * outward[0] + (v - pin[1]) * outward[1]
    aside = (v - pin[1]) * outward[0] - (u - pin[0]) * outward[1]
    seen = (along < (radius + stub if stub else 0.0)) & (np.abs(aside) < half)
    drawn = np.where(seen, 60.0, 190.0)
    drawn[np.hypot(along, aside) < radius] = 190.0 + step
    grey = cv2.GaussianBlur(drawn, (0, 0), 4.0).reshape(80, 4, 160, 4).mean(axis=(1, 3))
    grey += np.random.default_rng(5).normal(0.0, 3.0, grey.shape)
    photo = Photo("a", np.rint(grey).clip(0, 255).astype(np.uint8), 8)
    end = pin + (radius + stub if stub else -radius) * outward
    found = find_cover(photo, CableEnd(end, outward), Radius(radius, 0.01), 2.0 * half)
    assert found is not None
    assert np.hypot(*np.subtract(found.center, pin)) < 2.0 * found.std < 1.5


@pytest.mark.parametrize("jagged", [0.0, 3.0])
def test_border_that_lies_on_no_arc_is_no_cover(jagged: float) -> None:
    """The border of a white band aslant was taken for a cover's rim, whose middle it told to 3 px; a rim is an arc."""
    v, u = np.mgrid[:300, :900].astype(float)
    aside, radius = v - 150.0, 88.0
    border = 500.0 - np.sqrt(radius**2 - np.clip(aside, -80.0, 80.0) ** 2) + jagged * np.sign(np.sin(aside / 4.0))
    grey = np.where((np.abs(aside) < 30.0) & ((u < border) | (u > border + 2.0 * radius)), 40.0, 150.0)
    grey += np.random.default_rng(0).normal(0.0, 2.0, grey.shape)
    photo = Photo("a", np.rint(grey).clip(0, 255).astype(np.uint8), 8)
    end = CableEnd(np.array([412.0, 150.0]), np.array([1.0, 0.0]))
    assert (cover_by_cut(photo, end, Radius(radius, 0.01), 60.0) is None) == (jagged > 0.0)

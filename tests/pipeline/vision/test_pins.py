"""Pins hardly wider than the cable, which runs on beyond them."""

import cv2
import numpy as np
import pytest

from pipeline.vision.bearings.covers import find_cover
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

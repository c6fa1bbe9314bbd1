"""Visible ends of a cable: where a cut ends it, and how surely."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from pipeline.vision.centerline.measurement import Followed, follow_cable
from pipeline.vision.photo import Photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.plane import PlaneMap
from pipeline.vision.search.ends import led_on, without_specks
from pipeline.vision.segmentation import find_cable


@pytest.mark.parametrize("slant", [0.0, 0.25])
def test_a_cut_end_is_as_sure_as_its_edge(slant: float) -> None:
    """A straight cut tells the end of a cable of 30 px to a fraction of a pixel, square or not; 1.2 px was stated."""
    v, u = (np.mgrid[0:800, 0:2800] + 0.5) / 4.0 - 0.5
    off, first, last = v - 100.3, 90.4, 610.7
    drawn = (np.abs(off) < 15.0) & (u > first + slant * off) & (u < last - slant * off)
    grey = cv2.GaussianBlur(np.where(drawn, 60.0, 190.0), (0, 0), 4.0).reshape(200, 4, 700, 4).mean(axis=(1, 3))
    grey += np.random.default_rng(2).normal(0.0, 3.0, grey.shape)
    found = find_cable(Photo("bar", np.rint(grey).clip(0, 255).astype(np.uint8), 8))
    assert isinstance(found, RoughCable)
    followed = follow_cable(found, plane=PlaneMap.from_scale(1.0), diameter_m=None)
    assert isinstance(followed, Followed)
    for axis, place in ((followed.rough.left, first), (followed.rough.right, last)):
        assert axis.std_px < 0.5
        assert np.hypot(*np.subtract(axis.center_px, (place, 100.3))) < 2.0 * axis.std_px


@pytest.mark.parametrize("base", [4.0, 10.0])
def test_a_path_is_led_on_as_it_turns(base: float) -> None:
    """Along a circle of 7.5 widths: a parabola through the last ten is off by two widths six widths on."""
    width, turn = 10.0, np.linspace(0.0, 2.4, 181)
    path = 75.0 * np.column_stack([np.cos(turn), np.sin(turn)]) + np.random.default_rng(1).normal(0.0, 0.02, (181, 2))
    led = led_on(path, 6.0 * width, width, base=base)
    assert np.hypot(*led[-1]) == pytest.approx(75.0, abs=0.2 * width)
    assert np.hypot(*(led[-1] - led[180])) == pytest.approx(150.0 * np.sin(0.4), abs=0.1 * width)


def test_what_is_no_longer_than_the_gap_that_parts_it_from_a_strip_is_none_of_it() -> None:
    """A screw on a cover looks like the cable that ends before it; beyond a letter it is the cable that goes on."""
    seen = np.zeros(120, bool)
    seen[10:60] = seen[64:90] = seen[100:103] = True
    assert without_specks(seen) == slice(10, 90)
    assert without_specks(seen[::-1]) == slice(30, 110)

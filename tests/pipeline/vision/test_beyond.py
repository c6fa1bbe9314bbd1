"""A strip that ends where something lies across the cable is no cable: followed beyond, or refused; never a piece."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from pipeline.records import Rejected
from pipeline.settings.vision import VisionSettings
from pipeline.vision.photo import Photo, load_photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.segmentation import find_cable

WIDTH, SIZE = 16, (560, 1000)


def _bow():
    u = np.linspace(120.0, 880.0, 400)
    return np.column_stack([u, 400.0 - 220.0 * np.sin(np.pi * (u - 120.0) / 760.0)])


def _photo(across):
    """A dark cable with free ends, seen whole, and what ``across`` makes of the picture."""
    rng = np.random.default_rng(3)
    picture = np.full(SIZE, 215.0, np.float32)
    line = np.round(_bow() * 16).astype(np.int32)
    cv2.polylines(picture, [line], False, 40.0, WIDTH, cv2.LINE_AA, 4)
    picture = across(cv2.GaussianBlur(picture, (0, 0), 1.0)) + 2.0 * rng.standard_normal(SIZE)
    return Photo("bow.png", np.clip(picture, 0, 255).astype(np.uint8), 8)


def _as_it_is(picture):
    return picture


def _ruled(picture):
    rows, columns = np.ogrid[: SIZE[0], : SIZE[1]]
    return picture * np.where((rows % 60 < 4) | (columns % 60 < 4), 0.45, 1.0)


def _shaded(picture):
    return picture * cv2.GaussianBlur(np.where(np.arange(SIZE[1]) > 560, 0.4, 1.0)[None].repeat(SIZE[0], 0), (0, 0), 3)


def _pooled(picture):
    pool = np.zeros(SIZE, np.float32)
    cv2.ellipse(pool, (640, 230), (60, 140), 20, 0, 360, 1.0, -1)
    return picture * (1.0 - 0.45 * cv2.GaussianBlur(pool, (0, 0), 3))


def _taped(picture):
    picture[:, 600:640] = 90.0
    return picture


def _length():
    return float(np.hypot(*np.diff(_bow(), axis=0).T).sum()) + WIDTH  # drawn with round ends


@pytest.mark.parametrize("across", [_as_it_is, _ruled, _shaded, _pooled, _taped])
def test_no_piece_of_the_cable_passes_for_it(across):
    found = find_cable(_photo(across), VisionSettings())
    assert isinstance(found, RoughCable)
    # the rounded ends are half a width long and end at half their level
    assert found.length_px == pytest.approx(_length(), rel=0.005)


@pytest.mark.parametrize("pitch", [30, 40])
def test_dense_rules_are_followed_across_or_refused(pitch):
    def across(picture):
        rows, columns = np.ogrid[: SIZE[0], : SIZE[1]]
        return picture * np.where((rows % pitch < 4) | (columns % pitch < 4), 0.3, 1.0)

    found = find_cable(_photo(across), VisionSettings())
    if isinstance(found, Rejected):
        assert found.code in ("photo/hidden-end", "photo/contrast")
    else:
        assert found.length_px == pytest.approx(_length(), rel=0.005)


def test_a_stroke_of_print_is_no_end():
    def across(picture):
        for at in (128, 134, 868):
            picture[:, at : at + 3] = np.maximum(picture[:, at : at + 3], 190.0)
        return picture

    found = find_cable(_photo(across), VisionSettings())
    assert isinstance(found, RoughCable)
    assert found.length_px == pytest.approx(_length(), rel=0.005)


@pytest.mark.shared
@pytest.mark.parametrize("place", [(0.75, 0.87), (0.3, 0.8)])
def test_a_real_cable_is_followed_through_a_shadow(place, shared_data):
    """The shadow of a thing beside the table hides the cable from every mask; a piece of it would look like a cable."""
    whole = load_photo(shared_data / "real" / "loop" / "black0.jpg", VisionSettings().photo)
    picture = cv2.resize(whole.pixels, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    rows, columns = picture.shape[:2]
    u, v = (np.arange(columns) / columns - place[0]) / 0.1, (np.arange(rows)[:, None] / rows - place[1]) / 0.08
    light = 1.0 - 0.55 * cv2.GaussianBlur((u**2 + v**2 < 1.0).astype(np.float32), (0, 0), 8)
    found = find_cable(Photo("shadow.png", (picture * light[..., None]).astype(np.uint8), 8), VisionSettings())
    assert isinstance(found, RoughCable)
    # that of the photo without the shadow; the last piece at a clamp is a matter of a few widths
    assert found.length_px == pytest.approx(3798.0, rel=0.01)

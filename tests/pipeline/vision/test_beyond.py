"""A strip that ends where something lies across the cable is no cable: followed beyond, or told; never a piece."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from pipeline.records import Rejected
from pipeline.settings.vision import VisionSettings
from pipeline.vision import judgement
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo, load_photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.segmentation import find_cable
from pipeline.vision.single import trace_photo

WIDTH, SIZE = 16, (560, 1000)
WHOLE = 0.002
"""Of the length: the rounded ends are half a width long and end at half their level, told to a pixel each."""


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


def _is_told(found):
    """Refused, or what was traced is said to be short of the cable."""
    if isinstance(found, Rejected):
        return found.code in ("photo/hidden-end", "photo/contrast", "photo/crossing", "photo/two-candidates")
    return any(finding.code == "photo/hidden-end" and finding.level == "warning" for finding in found.findings)


@pytest.mark.parametrize("across", [_as_it_is, _ruled, _shaded, _pooled, _taped])
def test_no_piece_of_the_cable_passes_for_it(across):
    found = find_cable(_photo(across))
    assert isinstance(found, RoughCable)
    assert found.length_px == pytest.approx(_length(), rel=WHOLE)


def test_a_strong_bend_is_followed_beyond_a_bolt():
    """A C of 10 px with a dark bolt on it: what is led on keeps turning as the cable does."""
    turn = np.linspace(-2.2, 2.2, 400)
    middle = np.column_stack([200.0 - 75.0 * np.cos(turn), 150.0 + 75.0 * np.sin(turn)])
    picture = np.full((300, 400), 215.0, np.float32)
    cv2.polylines(picture, [np.round(middle * 16).astype(np.int32)], False, 40.0, 10, cv2.LINE_AA, 4)
    u, v = middle[320] * 16
    cv2.circle(picture, (round(u), round(v)), 13 * 16, 40.0, cv2.FILLED, cv2.LINE_AA, 4)
    picture = cv2.GaussianBlur(picture, (0, 0), 1.0) + 2.0 * np.random.default_rng(3).standard_normal(picture.shape)
    found = find_cable(Photo("c.png", np.clip(picture, 0, 255).astype(np.uint8), 8))
    assert isinstance(found, RoughCable)
    assert found.length_px == pytest.approx(75.0 * 4.4 + 10.0, rel=0.02)


@pytest.mark.parametrize("pitch", [30, 40])
def test_dense_rules_are_followed_across_or_refused(pitch):
    def across(picture):
        rows, columns = np.ogrid[: SIZE[0], : SIZE[1]]
        return picture * np.where((rows % pitch < 4) | (columns % pitch < 4), 0.3, 1.0)

    found = find_cable(_photo(across))
    assert _is_told(found) or found.length_px == pytest.approx(_length(), rel=WHOLE)


def _papered(picture):
    picture[:, 590:770] = 215.0
    return picture


@pytest.mark.parametrize("long", [None, 900.0, 700.0])
def test_a_sheet_of_the_ground_s_colour_makes_no_end(long):
    """It hides thirteen widths, and what is left beyond is a quarter of the strip before it: no rival of that."""
    found = find_cable(_photo(_papered), cable=Cable(length_px=long))
    assert _is_told(found) and isinstance(found, Rejected) == (long is not None)  # a length refuses the piece


@pytest.mark.parametrize("grey", [90.0, 130.0])
@pytest.mark.parametrize("width", [40, 60])
def test_a_band_across_the_cable_does_not_pass_for_it(grey, width):
    """Twice as wide as the cable and more: the larger area would speak for the photo, which shows the cable cut."""

    def across(picture):
        cv2.line(picture, (560, 40), (640, 520), grey, width, cv2.LINE_AA)
        return picture

    found = find_cable(_photo(across))
    assert _is_told(found) or found.length_px == pytest.approx(_length(), rel=WHOLE)


@pytest.mark.shared
@pytest.mark.parametrize("slender", [10.0, 0.1])
def test_a_fold_of_the_cloth_is_no_cable(slender, shared_data, monkeypatch):
    """Eight times as long as wide, five times the noise; its end, put where its grey falls, is the picture's border."""
    whole = load_photo(shared_data / "real" / "loop" / "white0.jpg", VisionSettings().photo)
    monkeypatch.setattr(judgement, "_LEAST_SLENDERNESS", slender)
    mirrored = Photo("mirrored.png", np.ascontiguousarray(whole.pixels[:, ::-1]), 8)
    found = find_cable(mirrored)
    assert isinstance(found, Rejected) and found.code in ("photo/contrast", "photo/leaves-frame")


def test_a_thing_eight_times_as_long_as_wide_is_no_cable():
    picture = np.full(SIZE, 215, np.uint8)
    cv2.line(picture, (300, 260), (492, 300), 40, 24, cv2.LINE_AA)
    found = find_cable(Photo("thing.png", picture, 8))
    assert isinstance(found, Rejected)
    # drawn 25.4 px wide with round ends; its width is told to a pixel
    assert found.said.values["slenderness"] == pytest.approx((np.hypot(192.0, 40.0) + 25.4) / 25.4, rel=0.04)


@pytest.mark.parametrize("first", [40.0, 225.0])
def test_half_a_cable_of_two_colours_does_not_pass_for_it(first):
    """One half stands out by its brightness, the other by its blue: what tells the first sees nothing of the second."""
    rng, bow = np.random.default_rng(4), np.round(_bow() * 16).astype(np.int32)
    picture = np.full((*SIZE, 3), 215.0, np.float32)
    colours = ((40.0, 40.0, 40.0), (60.0, 215.0, 225.0))
    for part, colour in zip((bow[:250], bow[249:]), colours if first == 40.0 else colours[::-1], strict=True):
        cv2.polylines(picture, [part], False, colour, WIDTH, cv2.LINE_AA, 4)
    picture = cv2.GaussianBlur(picture, (0, 0), 1.0) + 2.0 * rng.standard_normal(picture.shape)
    found = find_cable(Photo("halves.png", np.clip(picture, 0, 255).astype(np.uint8), 8))
    assert _is_told(found) or found.length_px == pytest.approx(_length(), rel=WHOLE)


def test_another_piece_of_cable_in_line_is_none_of_one_that_is_whole():
    assert isinstance(find_cable(_photo(_papered), cable=Cable(length_px=555.0)), RoughCable)


@pytest.mark.parametrize("diameter_px", [None, float(WIDTH)])
@pytest.mark.parametrize("grey", [215.0, 130.0, 90.0])
@pytest.mark.parametrize("hidden", [1.0, 2.0])
@pytest.mark.parametrize("rest", [1.5, 2.5])
def test_a_short_rest_beyond_a_band_is_traced_or_told(rest, hidden, grey, diameter_px, tmp_path):
    """A band across the last of a cable, in the ground's colour or another one: it may pass for the cable's end."""
    end, ahead = _bow()[-1], np.diff(_bow()[[-5, -1]], axis=0)[0]
    ahead *= WIDTH / np.hypot(*ahead)
    along, aside = 0.5 * hidden * ahead, 60.0 / WIDTH * ahead[::-1] * (-1.0, 1.0)
    middle = end + (0.5 - rest) * ahead - along
    corners = np.array([middle + u * along + v * aside for u, v in ((-1, -1), (-1, 1), (1, 1), (1, -1))])

    def across(picture):
        cv2.fillPoly(picture, [np.round(corners * 16).astype(np.int32)], grey, cv2.LINE_AA, 4)
        return picture

    assert cv2.imwrite(str(tmp_path / "bow.png"), _photo(across).pixels)
    line = trace_photo(tmp_path / "bow.png", diameter_px=diameter_px)
    told = isinstance(line, Rejected) or any(finding.level == "warning" for finding in line.findings)
    assert told or line.traced_length_m == pytest.approx(_length(), rel=WHOLE)


def test_a_stroke_of_print_is_no_end():
    def across(picture):
        for at in (128, 134, 868):
            picture[:, at : at + 3] = np.maximum(picture[:, at : at + 3], 190.0)
        return picture

    found = find_cable(_photo(across))
    assert isinstance(found, RoughCable)
    assert found.length_px == pytest.approx(_length(), rel=WHOLE)


@pytest.mark.shared
@pytest.mark.parametrize("place", [(0.75, 0.87), (0.3, 0.8)])
def test_a_real_cable_is_followed_through_a_shadow(place, shared_data):
    """The shadow of a thing beside the table hides the cable from every mask; a piece of it would look like a cable."""
    whole = load_photo(shared_data / "real" / "loop" / "black0.jpg", VisionSettings().photo)
    picture = cv2.resize(whole.pixels, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    rows, columns = picture.shape[:2]
    u, v = (np.arange(columns) / columns - place[0]) / 0.1, (np.arange(rows)[:, None] / rows - place[1]) / 0.08
    light = 1.0 - 0.55 * cv2.GaussianBlur((u**2 + v**2 < 1.0).astype(np.float32), (0, 0), 8)
    found = find_cable(Photo("shadow.png", (picture * light[..., None]).astype(np.uint8), 8))
    assert isinstance(found, RoughCable)
    # that of the photo without the shadow; the last piece at a clamp is a matter of a few widths
    assert found.length_px == pytest.approx(3798.0, rel=0.01)


@pytest.mark.shared
def test_a_band_across_a_real_cable_does_not_pass_for_it(shared_data):
    """One reading shows the cable cut by it, all others the band alone, a fifth as long and twice as large."""
    whole = load_photo(shared_data / "real" / "loop" / "black0.jpg", VisionSettings().photo)
    picture = cv2.resize(whole.pixels, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    cv2.line(picture, (430, 460), (254, 1187), (37, 100, 188), 51, cv2.LINE_AA)
    noise = 7.0 * np.random.default_rng(9).standard_normal(picture.shape)
    found = find_cable(Photo("band.png", np.clip(picture + noise, 0, 255).astype(np.uint8), 8))
    assert _is_told(found)

"""Where the cable ends to be seen: at the mouth of a jaw hardly wider than it, and where most readings end it."""

import cv2
import numpy as np
import pytest

from pipeline.messages import Message
from pipeline.records import Rejected
from pipeline.vision import segmentation
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.segmentation import find_cable


def _bow_with(draw, width=26):
    """A cable so many px wide on a level ground, with what ``draw`` draws over its ends; and its ends."""
    u = np.linspace(150.0, 1450.0, 500)
    course = np.column_stack([u, 300.0 + 220.0 * np.sin(np.pi * (u - 150.0) / 1300.0)])
    picture = np.full((760, 1600, 3), 150, np.uint8)
    cv2.polylines(picture, [np.round(16.0 * course).astype(np.int32)], False, (40, 40, 40), width, cv2.LINE_AA, 4)
    draw(picture, course)
    noisy = cv2.GaussianBlur(picture, (0, 0), 1.0) + np.random.default_rng(0).normal(0.0, 2.0, picture.shape)
    return Photo("a.png", np.clip(noisy, 0, 255).astype(np.uint8), 8), course


def test_a_jaw_less_than_twice_as_wide_as_the_cable_is_no_part_of_it():
    """Jaws of the cable's own grey, axes in their middle: what is seen of the cable ends at their mouths."""

    def jaws(picture, course):
        for end, inner in ((course[0], course[40]), (course[-1], course[-41])):
            along = np.round(16.0 * np.array([2.0 * end - inner, inner])).astype(np.int32)
            cv2.polylines(picture, [along], False, (45, 45, 45), 48, cv2.LINE_AA, 4)

    photo, course = _bow_with(jaws)
    given = (tuple(course[0]), tuple(course[-1]))
    found = find_cable(photo, cable=Cable(diameter_px=26.0, bearings=BearingHints(given_px=given)))
    assert isinstance(found, RoughCable)
    seen = found.path_px[slice(*found.visible)]
    # a jaw's mouth is rounded by half its width, and edges are pooled over the cable's
    assert np.hypot(*(seen[0] - course[40])) < 2.0 * 26.0
    assert np.hypot(*(seen[-1] - course[-41])) < 2.0 * 26.0


@pytest.mark.parametrize(("more", "code"), [(1.6, None), (5.0, "photo/hidden-end")])
def test_a_longer_reading_forbids_a_strip_only_where_it_goes_on_beyond_it(more, code):
    """A reading in which one end seems to go on, longer by so many widths, a half of one where it is seen."""
    photo, course = _bow_with(lambda picture, course: None)
    found = find_cable(photo, cable=Cable(diameter_px=26.0))
    assert isinstance(found, RoughCable)
    longer = np.vstack([course, course[-1] + np.linspace(1.0, more * 26.0, 50)[:, None] * (1.0, 0.0)])
    cut = Rejected(photo.name, Message("photo/hidden-end.goes-on", u_px=1450.0, v_px=300.0))
    judged = [segmentation._Judged(found, found.path_px, 1.0), segmentation._Judged(cut, longer, 1.0)]
    chosen = segmentation._chosen(photo, judged)
    assert getattr(chosen, "code", None) == code


def test_a_cable_is_followed_across_a_band_to_the_cover_close_behind_it():
    """A bright band across the cable, two widths before its cover: the piece between is too short for a strip."""

    def band_and_covers(picture, course):
        for u, v in (course[0], course[-1]):
            cv2.circle(picture, (round(u), round(v)), 66, (210, 210, 210), cv2.FILLED, cv2.LINE_AA)
            cv2.circle(picture, (round(u), round(v)), 6, (20, 20, 20), cv2.FILLED, cv2.LINE_AA)
        along = course[80] - course[56]
        aside = 0.55 * 44.0 * np.array([-along[1], along[0]]) / np.hypot(*along)
        band = np.array([course[56] - aside, course[80] - aside, course[80] + aside, course[56] + aside])
        cv2.fillPoly(picture, [np.round(16.0 * band).astype(np.int32)], (152, 152, 152), cv2.LINE_AA, 4)

    photo, course = _bow_with(band_and_covers, width=44)
    found = find_cable(photo, cable=Cable(diameter_px=44.0, length_px=1430.0, bearings=BearingHints(cover_px=132.0)))
    assert isinstance(found, RoughCable)
    assert np.hypot(*np.subtract(found.left.center_px, course[0])) < 1.0

"""A person's hand on the search: where to look, what is none of the cable, where it runs; and pictures of any size."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from pipeline.records import Centerline, PhotoHints, Rejected
from pipeline.vision.single import trace_photo

SIZE, WIDTH = (420, 800), 14


def _bow(low=300.0):
    u = np.linspace(80.0, 720.0, 400)
    return np.column_stack([u, low - 120.0 * np.sin(np.pi * (u - 80.0) / 640.0)])


def _written(folder, *things):
    """A photo with dark bows, and what else is drawn on it."""
    picture = np.full((*SIZE, 3), 205.0, np.float32)
    for thing in things:
        if isinstance(thing, np.ndarray):
            line = np.round((thing + 0.0) * 16).astype(np.int32)
            cv2.polylines(picture, [line], False, (50.0, 50.0, 50.0), WIDTH, cv2.LINE_AA, 4)
        else:
            thing(picture)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.9) + 2.0 * np.random.default_rng(1).standard_normal(picture.shape)
    path = folder / "photo.png"
    cv2.imwrite(str(path), np.clip(picture, 0, 255).astype(np.uint8))
    return path


def _off(line, bow):
    """Largest distance (px) of a trace from a bow, but for its ends."""
    inner = slice(len(line.u_px) // 10, -(len(line.u_px) // 10))
    return float(np.abs(line.v_px - np.interp(line.u_px, *bow.T))[inner].max())


def test_a_region_chooses_one_of_two_cables(tmp_path):
    path = _written(tmp_path, _bow(170.0), _bow(390.0))
    found = trace_photo(path)
    assert isinstance(found, Rejected) and found.code == "photo/two-candidates"
    found = trace_photo(path, hints=PhotoHints(region_px=(0.0, 0.0, 799.0, 215.0)))
    assert isinstance(found, Centerline), found.reason
    assert _off(found, _bow(170.0)) < 0.3


def test_another_cable_that_leaves_the_picture_is_told(tmp_path):
    for others in ((), (_bow(390.0) + np.array([300.0, 0.0]),)):
        found = trace_photo(_written(tmp_path, _bow(170.0), *others))
        assert isinstance(found, Centerline), found.reason
        assert ("photo/two-candidates" in {finding.code for finding in found.findings}) == bool(others)


def test_clicks_tell_which_cable_and_where_it_ends(tmp_path):
    path = _written(tmp_path, _bow(170.0), _bow(390.0))
    clicks = tuple((float(u), float(v) + 3.0) for u, v in _bow(390.0)[5:-5:40])
    found = trace_photo(path, hints=PhotoHints(path_px=clicks))
    assert isinstance(found, Centerline), found.reason
    assert _off(found, _bow(390.0)) < 0.3
    assert np.hypot(found.u_px[0] - clicks[0][0], found.v_px[0] - clicks[0][1]) < WIDTH


def test_clicks_lead_over_a_crossing(tmp_path):
    """Another cable crosses it: which arm goes on nobody but a person can say."""
    bow = _bow()
    path = _written(tmp_path, bow, np.array([[300.0, 40.0], [480.0, 400.0]]))
    found = trace_photo(path)
    assert isinstance(found, Rejected) and found.code == "photo/crossing"
    found = trace_photo(path, hints=PhotoHints(path_px=tuple(map(tuple, bow[5:-5:48].tolist()))))
    assert isinstance(found, Centerline), found.reason
    assert _off(found, bow) < 0.3


def test_a_curve_that_does_not_reach_the_axes_is_refused(tmp_path):
    """Clicks go on over bare ground and turn there: nothing measured leads to the last one."""
    bow = _bow()
    clicks = (*map(tuple, bow[200:-5:30].tolist()), (760.0, 390.0), (640.0, 410.0))
    found = trace_photo(_written(tmp_path, bow), hints=PhotoHints(path_px=clicks))
    assert isinstance(found, Rejected) and found.code == "photo/bearing"


def test_what_is_excluded_moves_nothing_and_is_hidden(tmp_path):
    """A bright bolt below the cable's edge: without its edges the cable is where it is, and not seen there."""
    at = _bow()[200] + np.array([0.0, 5.0])

    def bolt(picture):
        cv2.circle(picture, np.rint(at).astype(int).tolist(), 13, (235.0, 235.0, 235.0), -1, cv2.LINE_AA)

    box = tuple((float(at[0] + du), float(at[1] + dv)) for du, dv in ((-16, -30), (16, -30), (16, 30), (-16, 30)))
    found = trace_photo(_written(tmp_path, _bow(), bolt), hints=PhotoHints(exclude_px=(box,)))
    assert isinstance(found, Centerline), found.reason
    assert _off(found, _bow()) < 0.4
    assert not found.shape.seen[np.abs(found.u_px - at[0]) < 6.0].any()


@pytest.mark.parametrize("side", [34, 64, 93, 101, 110, 123, 150])
def test_no_size_of_a_picture_raises(side, tmp_path):
    rng = np.random.default_rng(side)
    picture = np.full((side, side), 200.0)
    cv2.line(picture, (6, side // 2), (side - 7, side // 2 + 3), 40.0, max(2, side // 30))
    path = tmp_path / "small.png"
    cv2.imwrite(str(path), np.clip(picture + rng.normal(0.0, 3.0, picture.shape), 0, 255).astype(np.uint8))
    found = trace_photo(path)
    assert isinstance(found, Centerline) or found.code != "photo/program-error"

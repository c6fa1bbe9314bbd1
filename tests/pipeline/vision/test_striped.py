"""A striped wire is one cable, and two wires side by side or across each other are not."""

import cv2
import numpy as np
import pytest

from pipeline.records import Centerline, Rejected
from pipeline.settings.vision import PhotoSettings
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import load_photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.search.backdrop import in_one_colour, stand_out
from pipeline.vision.segmentation import find_cable
from pipeline.vision.single import trace_photo

TABLE, WHITE, BLUE = (150, 165, 175), (225, 225, 225), (160, 80, 40)
PAPER, GREEN, YELLOW = (235, 238, 238), (60, 120, 50), (90, 215, 225)
WIDTH, FINER, SIZE = 14.0, 4, (810, 405)


ENDS, COVER = (93.0, 716.0), 17.0


def drawn(folder, middles, covers=None):
    """Wires ``middles`` px beside a bow; beyond a sixth of the width from the first one's middle they are blue.

    Covers of a colour lie on the ends of the bow.
    """
    u, v = ((np.arange(n * FINER) + 0.5) / FINER - 0.5 for n in SIZE)
    t = (v[:, None] - bow(u)) / np.hypot(1.0, np.gradient(bow(u), u))
    inside = np.any([np.abs(t - middle) < 0.5 * WIDTH for middle in middles], axis=0) & (u > 93.0) & (u < 716.0)
    sheath = np.where((t > middles[0] + WIDTH / 6.0)[..., None], BLUE, WHITE)
    picture = np.where(inside[..., None], sheath, TABLE)
    for end in () if covers is None else ENDS:
        picture[np.hypot(v[:, None] - bow(end), u - end) < COVER] = covers
    return taken(folder, picture)


def taken(folder, picture):
    """A file of a picture with ``FINER`` cells a px."""
    picture = picture.astype(np.float32)
    pixels = cv2.GaussianBlur(cv2.resize(picture, SIZE, interpolation=cv2.INTER_AREA), (0, 0), 0.8)
    noise = np.random.default_rng(3).normal(0.0, 2.0, pixels.shape)
    path = folder / "wire.jpg"
    cv2.imwrite(str(path), np.clip(pixels + noise, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 85])
    return path


def bow(u):
    return 200.0 + 93.0 * np.sin(np.pi * (u - 93.0) / 623.0)


def beside(line):
    u, v = np.asarray(line.u_px), np.asarray(line.v_px)
    inner = (u > 120.0) & (u < 690.0)
    return ((v - bow(u)) / np.hypot(1.0, np.gradient(bow(u), u)))[inner]


def test_a_wire_of_two_colours_is_one_cable(tmp_path):
    line = trace_photo(drawn(tmp_path, [0.0]), diameter_px=WIDTH)
    assert isinstance(line, Centerline)
    # the wider colour alone is a strip whose middle lies 2.3 px beside the wire's
    assert np.sqrt(np.mean(beside(line) ** 2)) < 0.5
    assert line.width_m == pytest.approx(WIDTH, rel=0.1)


def test_covers_unseen_in_the_colour_of_a_wire_are_found(tmp_path):
    """Along the direction of colour in which both stripes are alike these covers are as bright as the table."""
    photo = load_photo(drawn(tmp_path, [0.0]), PhotoSettings())
    one = in_one_colour(photo, stand_out(photo, 1))
    assert one is not None
    table = np.column_stack([photo.pixels.reshape(-1, 3), np.ones(photo.pixels.size // 3)]).astype(float)
    weights = np.linalg.lstsq(table, one.pixels.ravel().astype(float), rcond=None)[0][:3]
    across = np.cross(weights, np.cross(weights, (1.0, 0.0, -1.0)))
    colour = np.array(TABLE) + 90.0 * across / np.abs(across).max()
    known = Cable(WIDTH, 660.0, BearingHints(cover_px=2.0 * COVER))
    found = find_cable(load_photo(drawn(tmp_path, [0.0], colour), PhotoSettings()), cable=known)
    assert isinstance(found, RoughCable)
    for axis, u in ((found.left, ENDS[0]), (found.right, ENDS[1])):
        assert axis.sure
        assert np.hypot(axis.center_px[0] - u, axis.center_px[1] - bow(u)) < 3.5 * axis.std_px < 0.7


def test_bundles_whose_outline_waves_are_traced(tmp_path):
    """Strands that wind about each other move both edges of what is seen to and fro, by a tenth of its width.

    The waves of one bundle leave a tenth of a pixel by chance, and cut ends lie on any part of a wave: six are judged.
    """
    u, v = ((np.arange(n * FINER) + 0.5) / FINER - 0.5 for n in SIZE)
    t, width, off = (v[:, None] - bow(u)) / np.hypot(1.0, np.gradient(bow(u), u)), 26.0, []
    for phase in np.arange(6) * np.pi / 3.0:
        upper, lower = (0.1 * width * np.sin(2.0 * np.pi * u / (turns * width) + phase) for turns in (1.3, 0.9))
        inside = (t > lower - 0.5 * width) & (t < upper + 0.5 * width) & (u > 93.0) & (u < 716.0)
        line = trace_photo(taken(tmp_path, np.where(inside[..., None], GREEN, TABLE)), diameter_px=width)
        assert isinstance(line, Centerline)
        off.append(beside(line))
        assert np.abs(np.median(off[-1])) < 2.0 * np.median(line.position_std)
    assert np.abs(np.mean([np.median(one) for one in off])) < 0.1
    assert np.sqrt(np.mean(np.square(off))) < 0.5


def test_two_wires_are_not_one(tmp_path):
    line = trace_photo(drawn(tmp_path, [0.0, 1.3 * WIDTH]), diameter_px=WIDTH)
    if isinstance(line, Centerline):  # one of them, and not what lies between
        off = np.abs(np.median(beside(line)) - np.array([0.0, 1.3 * WIDTH]))
        assert off.min() < 0.1 * WIDTH


def test_a_stripe_that_winds_about_a_wire_of_unknown_width_is_part_of_it(tmp_path):
    u, v = ((np.arange(n * FINER) + 0.5) / FINER - 0.5 for n in SIZE)
    t = (v[:, None] - bow(u)) / np.hypot(1.0, np.gradient(bow(u), u))
    ends = (u > 93.0) & (u < 716.0)
    shadow = 1.0 - 0.3 * np.exp(-0.5 * ((t - 0.6 * WIDTH) / (0.3 * WIDTH)) ** 2) * ends
    sheath = np.where((t > 0.3 * WIDTH * np.sin(2.0 * np.pi * u / 500.0))[..., None], GREEN, YELLOW)
    inside = (np.abs(t) < 0.5 * WIDTH) & ends
    line = trace_photo(taken(tmp_path, np.where(inside[..., None], sheath, PAPER * shadow[..., None])))
    assert isinstance(line, Centerline)
    assert np.sqrt(np.mean(beside(line) ** 2)) < 0.05 * WIDTH  # half of it by the green alone
    assert line.width_m == pytest.approx(WIDTH, rel=0.1)


def test_wires_of_two_colours_that_cross_are_not_one(tmp_path):
    u, v = ((np.arange(n * FINER) + 0.5) / FINER - 0.5 for n in SIZE)
    first, second = (np.abs(v[:, None] - middle) < 0.5 * WIDTH for middle in (0.35 * u + 50.0, 330.0 - 0.3 * u))
    ends = (u > 93.0) & (u < 716.0)
    picture = np.where((first & ends)[..., None], GREEN, np.where((second & ends)[..., None], YELLOW, PAPER))
    assert isinstance(trace_photo(taken(tmp_path, picture)), Rejected)

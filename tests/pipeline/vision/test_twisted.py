"""Wires twisted about each other are one cable: its outline swells and narrows, its middle stays."""

from functools import cache

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from pipeline.records import Centerline, Rejected
from pipeline.vision.search.crosscut import find_flanks
from pipeline.vision.single import trace_photo

RED, BLACK, YELLOW, GREY = (30, 30, 190), (25, 25, 25), (40, 200, 230), (125, 125, 125)
WIDTH, FINER, SIZE = 20.0, 3, (800, 300)
FIRST, LAST = 60.0, 740.0


def bow(u):
    return 90.0 + 110.0 * np.sin(np.pi * (u - FIRST) / (LAST - FIRST))


@cache
def along_and_aside():
    """Of each cell of the picture, the arc length of its foot on the bow and the distance from it, px."""
    u = np.linspace(FIRST, LAST, 4000)
    path = np.column_stack([u, bow(u)])
    tangent = np.gradient(path, axis=0)
    tangent /= np.hypot(*tangent.T)[:, None]
    arc = np.append(0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T)))
    away = (np.moveaxis(np.indices((SIZE[1] * FINER, SIZE[0] * FINER))[::-1], 0, -1) + 0.5) / FINER - 0.5
    foot = cKDTree(path).query(away)[1]
    away -= path[foot]
    along = arc[foot] + (away * tangent[foot]).sum(axis=2)
    return along, tangent[foot, 0] * away[..., 1] - tangent[foot, 1] * away[..., 0], arc[-1]


def twisted(folder, colours, lay):
    """Two round wires that touch each other, half as wide as the cable, turn once in ``lay`` widths."""
    rng = np.random.default_rng(3)
    along, aside, length = along_and_aside()
    inside = (along > 0.0) & (along < length)
    mottled = 155.0 + 400.0 * gaussian_filter(rng.standard_normal(aside.shape), 20.0)
    picture, highest = np.repeat(mottled[..., None], 3, axis=2), np.full(aside.shape, -np.inf)
    for colour, turn in zip(colours, (0.0, np.pi), strict=True):
        angle = 2.0 * np.pi * along / (lay * WIDTH) + turn
        out = (aside - 0.25 * WIDTH * np.cos(angle)) / (0.25 * WIDTH)
        round_top = np.sqrt(np.clip(1.0 - out**2, 0.0, None))
        front = (np.abs(out) < 1.0) & (np.sin(angle) + round_top > highest) & inside
        picture[front] = (0.85 + 0.15 * round_top[front])[:, None] * colour
        highest[front] = (np.sin(angle) + round_top)[front]
    picture = cv2.resize(picture.astype(np.float32), SIZE, interpolation=cv2.INTER_AREA)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.9) + rng.normal(0.0, 2.0, picture.shape)
    path = folder / "twisted.png"
    cv2.imwrite(str(path), np.clip(picture, 0, 255).astype(np.uint8))
    return path


def off(line):
    u, v = np.asarray(line.u_px), np.asarray(line.v_px)
    true = np.linspace(FIRST, LAST, 40000)
    distance = cKDTree(np.column_stack([true, bow(true)])).query(np.column_stack([u, v]))[0]
    return (np.sign(v - bow(u)) * distance)[line.shape.seen]


@pytest.mark.parametrize(
    ("colours", "lay"),
    [
        ((RED, YELLOW), 4.0),
        ((BLACK, BLACK), 2.5),
        ((RED, YELLOW), 8.0),
        ((BLACK, GREY), 4.0),
    ],
    ids=["two colours", "one colour", "long lay", "one that hardly stands out"],
)
def test_a_twisted_pair_is_traced_and_its_error_stated(colours, lay, tmp_path):
    # measured with a caliper a little thick, as soft sheaths are: its usual width is 0.85 of the widest
    line = trace_photo(twisted(tmp_path, colours, lay), diameter_px=1.08 * WIDTH)
    assert isinstance(line, Centerline), line.reason
    error, stated = off(line), line.position_std[line.shape.seen]
    assert np.sqrt(np.mean(error**2)) < 0.1
    assert (np.abs(error) < 1.96 * stated).mean() > 0.9
    assert line.quality["systematic_px"] < 0.2
    assert 1.96 * np.median(line.kappa_std) < 0.05 * np.abs(line.shape.kappa).max()


@pytest.mark.parametrize("colours", [(RED, YELLOW), (BLACK, GREY)])
def test_the_width_of_a_twisted_pair_need_not_be_known(colours, tmp_path):
    line = trace_photo(twisted(tmp_path, colours, 4.0))
    assert isinstance(line, Centerline), line.reason
    assert np.sqrt(np.mean(off(line) ** 2)) < 0.1  # one wire of it weaves by 5 px
    assert 0.7 * WIDTH < line.width_m < WIDTH


@pytest.mark.parametrize("lay", [20.0, 60.0])
def test_wires_that_cross_now_and_then_are_no_cable(lay, tmp_path):
    assert isinstance(trace_photo(twisted(tmp_path, (RED, BLACK), lay), diameter_px=WIDTH), Rejected)


def test_the_brighter_wire_that_weaves_is_not_the_cable():
    """Its own edges are steeper than those of the whole, but no course as straight as a cable's keeps between them."""
    offsets, along = np.arange(-44.0, 44.5), np.arange(800.0)[:, None]
    swing = 0.25 * WIDTH * np.cos(2.0 * np.pi * along / (4.0 * WIDTH))
    wires = [value * (np.abs(offsets - way * swing) < 0.25 * WIDTH) for value, way in ((1.0, 1.0), (0.15, -1.0))]
    flanks = find_flanks(np.max(wires, axis=0).astype(np.float32), offsets, 0.8 * WIDTH, known=False)
    assert flanks.width > 0.7 * WIDTH

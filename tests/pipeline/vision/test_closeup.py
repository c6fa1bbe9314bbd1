"""Blur by the edges of a drawn cable, and what a photo out of focus or taken in motion is refused for."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipeline.records import Rejected
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo
from pipeline.vision.render import Camera, Scene, Sensor, Strand, render
from pipeline.vision.search.closeup import edge_spreads, take_closeup
from pipeline.vision.segmentation import find_cable
from tests.pipeline.vision.curves import of_curvature

WIDTH, BEND = 36.0, 700.0  # px: of the cable, and radius of its axis


def arc(
    *,
    motion: float = 0.0,
    direction: float = 0.0,
    blur: float = 0.8,
    shadow: float = 0.0,
    letters: bool = False,
) -> np.ndarray:
    """Spreads of both edges of a dark arc of 80 degrees, moved by so many px.

    ``shadow`` px of blur are at its outer edge alone. With ``letters`` the sheath is bright, and bright strokes across
    it are a third of both ends of the arc.
    """
    v, u = np.mgrid[0:420, 0:1100].astype(np.float32)
    away = np.hypot(u - 550.0, v - 760.0) - BEND
    outer = 0.5 * WIDTH - away
    grey = 0.8 - 0.6 * np.clip(np.minimum(outer, 0.5 * WIDTH + away) + 0.5, 0.0, 1.0)
    if letters:
        along = BEND * np.arctan2(u - 550.0, 760.0 - v)
        inked = (np.abs(away) < 0.35 * WIDTH) & (np.abs(along) > 150.0) & (along % 23.0 < 9.0)
        grey = np.where(inked, 0.9, 0.5 - 0.5 * grey)
    if shadow:
        soft = cv2.GaussianBlur(grey, (0, 0), shadow)
        grey = np.where(away > 0.0, soft, grey)
    # A motion is the mean of pictures one after the other; four a pixel leave no steps.
    count = max(1, round(4.0 * motion))
    way = (np.arange(count) + 0.5) / count * motion - 0.5 * motion
    moves = [np.array([[1.0, 0.0, w * np.cos(direction)], [0.0, 1.0, w * np.sin(direction)]]) for w in way]
    size = grey.shape[::-1]
    grey = np.mean([cv2.warpAffine(grey, m, size, borderMode=cv2.BORDER_REPLICATE) for m in moves], axis=0)
    grey = cv2.GaussianBlur(grey, (0, 0), blur)
    noise = 0.01 * np.random.default_rng(0).standard_normal(grey.shape)
    turn = np.linspace(-0.7, 0.7, 300)
    path = np.column_stack([550.0 + BEND * np.sin(turn), 760.0 - BEND * np.cos(turn)])
    pixels = np.clip(np.rint(255.0 * (grey + noise)), 0, 255).astype(np.uint8)
    closeup = take_closeup(Photo("a.png", pixels, 8), path, WIDTH, np.ones(1))
    across = np.column_stack([np.sin(turn), -np.cos(turn)])  # outward
    return edge_spreads(closeup.picture[..., 0], closeup.to_cells(path), across, WIDTH)


def softest(spreads: np.ndarray) -> float:
    """Where the sharper edge is softest."""
    return float(spreads.min(axis=0).max())


@pytest.mark.parametrize("blur", [0.8, 2.0, 4.0])
def test_blur_is_that_of_the_edges(blur):
    # The pixel's box adds a variance of 1/12 px^2, the linear interpolation between pixels 1/6; from a seventh of the
    # width on, sheath and ground are not reached within the 0.4 widths looked at, and the spread reads a tenth low.
    assert_allclose(np.median(arc(blur=blur)), np.sqrt(blur**2 + 1.0 / 12.0 + 1.0 / 6.0), rtol=0.1)


def test_motion_softens_the_edges_it_runs_across_most():
    """A box of length L is as steep as a blur of L / sqrt(2 pi); noise is steeper from column to column, by a sixth."""
    assert_allclose(softest(arc(motion=15.0, direction=0.5 * np.pi)), 15.0 / np.sqrt(2.0 * np.pi), rtol=0.2)


def test_a_shadow_at_one_edge_is_no_blur():
    assert_allclose(softest(arc(shadow=5.0)), softest(arc()), rtol=0.1)


def test_letters_on_the_sheath_are_no_blur():
    """Ink is brighter than the sheath."""
    assert_allclose(np.median(arc(letters=True)), np.median(arc()), rtol=0.1)


@pytest.mark.parametrize("sensor", [Sensor(motion_px=25.0, motion_rad=0.6), Sensor(blur_px=8.0)], ids=["moved", "blur"])
def test_covers_lost_in_blur_are_no_reason_of_their_own(sensor):
    length, scale = 0.181, 8_000.0
    curve = of_curvature(lambda s: 3.0 + 5.0 * np.sin(np.pi * s / length), length)
    camera = Camera(1640, 640, scale, look_at_m=(0.5 * curve.chord, 0.5 * curve.y.max()))
    pixels = render(Scene(Strand(curve, 0.0046), camera, sensor=sensor)).pixels
    known = Cable(0.0046 * scale, length * scale, BearingHints(cover_px=0.012 * scale))
    found = find_cable(Photo("a.png", pixels, 8), cable=known)
    assert isinstance(found, Rejected)
    assert found.code == "photo/blur"

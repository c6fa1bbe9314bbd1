"""Axes given by a person, under blocks whose border crosses the cable aslant."""

import cv2
import numpy as np
import pytest

from pipeline.settings.vision import VisionSettings
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo
from pipeline.vision.render import render
from pipeline.vision.scale.plane import PlaneMap
from pipeline.vision.segmentation import find_cable
from tests.pipeline.vision.bow_scene import DIAMETER, bow_scene, errors, measure_centerline


@pytest.mark.parametrize("seed", [8, 9])
def test_line_ends_before_the_block_that_hides_a_given_axis(seed):
    """A block's border crosses the cable aslant, so the last half width is seen on one side only; its pin is no cable.

    There the block's border was taken for an edge: 0.07 px off, or refused for a bend that no cable has.
    """
    rng, aslant = np.random.default_rng(seed), -0.7
    scene = bow_scene(rng, px_per_mm=8.0, noise=0.01)
    picture = render(scene)
    pixels, size = picture.pixels.copy(), 96.0
    for end in (picture.left_px, picture.right_px):
        away = np.sign(end[0] - 0.5 * pixels.shape[1])
        border = np.array([-np.sin(aslant), np.cos(aslant)]) * size
        outward = np.array([np.cos(aslant), np.sin(aslant)]) * away
        corner = np.array(end) - 64.0 * outward
        block = [corner - border, corner + border, corner + border + size * outward, corner - border + size * outward]
        cv2.fillPoly(pixels, [np.rint(block).astype(np.int32)], (60, 90, 120), cv2.LINE_AA)
        cv2.circle(pixels, tuple(round(x) for x in end), 14, (30, 30, 30), cv2.FILLED, cv2.LINE_AA)
    bearings = BearingHints(given_px=(picture.left_px, picture.right_px))
    cable = Cable(diameter_px=DIAMETER * 8e3, bearings=bearings)
    rough = find_cable(Photo("photo", pixels, 8), cable=cable)
    found = measure_centerline(rough, plane=PlaneMap.from_scale(8e3), diameter_m=DIAMETER, settings=VisionSettings())
    off = errors(picture, found, 8e3)
    assert np.abs(off.normal[off.seen]).max() < 0.04

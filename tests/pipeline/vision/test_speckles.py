"""Speckles may differ as much as cable and ground do: they average over a cable's width, the cable does not."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from pipeline.records import Rejected
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo
from pipeline.vision.render import Cover, Ground
from pipeline.vision.render.ground import noise, paint, unit
from pipeline.vision.rough import RoughCable
from pipeline.vision.segmentation import find_cable
from tests.pipeline.vision.test_segmentation import (
    CAMERA,
    COLOUR,
    COVER,
    KNOWN,
    SCALE,
    UNKNOWN,
    find,
    offset_widths,
    scene,
    strand,
)

both = pytest.mark.parametrize("cable", [KNOWN, UNKNOWN], ids=["diameter known", "nothing known"])


def speckles(ground: Ground, width: int, height: int, rng: np.random.Generator) -> np.ndarray:
    """Grains of a polished stone."""
    return unit(noise(width, height, ground.grain_px, ground.grain_px, rng))


GRANITE = Ground(speckles, (0.5,) * 3, 0.17, 2.0)
GREEN = Cover(COVER, (0.1, 0.5, 0.2))


@both
@pytest.mark.parametrize("seed", range(3))
def test_a_cable_is_found_on_speckles_that_are_finer_than_it(seed: int, cable: Cable) -> None:
    # covers of a colour that the grey ground lacks stand out so much more that the cable lies below the usual levels
    look = scene(cable=strand((0.9,) * 3), ground=GRANITE, covers=(GREEN, GREEN), sensor=COLOUR, ground_seed=seed)
    rough, picture = find(look, cable)
    assert isinstance(rough, RoughCable), rough.reason
    assert offset_widths(rough, picture) < 0.25  # within the reach in which edges are sought


@both
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("grain", [1.0, 2.0, 4.0, 8.0])
def test_speckles_without_a_cable_are_refused(grain: float, seed: int, cable: Cable) -> None:
    ground = replace(GRANITE, grain_px=grain)
    table = paint(ground, CAMERA.width, CAMERA.height, 3, np.random.default_rng(seed))
    pixels = np.rint(255.0 * np.clip(table, 0.0, 1.0)).astype(np.uint8)
    for u in (110, 1040):
        cv2.circle(pixels, (u, 360), round(0.5 * COVER * SCALE), (50, 130, 25), cv2.FILLED, cv2.LINE_AA)
    outcome = find_cable(Photo("a.png", pixels, 8), cable=cable)
    assert isinstance(outcome, Rejected)
    assert outcome.code == "photo/contrast"

"""Time of the search for cable and bearings, as a ratio to decoding the same photo in the same run; memory a pixel."""

from __future__ import annotations

import tracemalloc
from time import process_time
from timeit import repeat

import cv2
import numpy as np
import pytest

from pipeline.settings.vision import VisionSettings
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo, decode_photo
from pipeline.vision.render import Camera, Ground, Scene, Sensor, Strand, render
from pipeline.vision.rough import RoughCable
from pipeline.vision.segmentation import find_cable
from tests.pipeline.vision.curves import of_curvature

SETTINGS = VisionSettings()
LENGTH, DIAMETER, COVER = 0.181, 0.0046, 0.012


def photo_file(px_per_mm, size, enlarged):
    """A rendered photo, or one enlarged twice to colour with new noise, which is quicker than rendering that."""
    curve = of_curvature(lambda s: 4.0 + 3.0 * np.sin(np.pi * s / LENGTH), LENGTH)
    camera = Camera(*size, px_per_mm * 1e3, look_at_m=(0.5 * curve.chord, 0.02))
    ground = Ground("brushed", (0.75,) * 3, 0.03)
    pixels = render(Scene(Strand(curve, DIAMETER), camera, ground=ground, sensor=Sensor(noise=0.01))).pixels
    scale = px_per_mm * 1e3
    if enlarged:
        large = cv2.cvtColor(cv2.resize(pixels, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC), cv2.COLOR_GRAY2BGR)
        noise = np.random.default_rng(0).integers(-4, 5, large.shape, np.int8)
        pixels, scale = cv2.add(large, noise, dtype=cv2.CV_8U), 2 * scale
    known = Cable(DIAMETER * scale, LENGTH * scale, BearingHints(cover_px=COVER * scale))
    return cv2.imencode(".png", pixels)[1].tobytes(), known


CASES = [(12.0, (2448, 980), False), (9.5, (2000, 1500), True)]


@pytest.mark.parametrize("told", [True, False], ids=["diameter known", "nothing known"])
@pytest.mark.parametrize("case", CASES, ids=["2.4 Mpx grey", "12 Mpx colour"])
def test_search_takes_less_than_three_times_the_decoding(benchmark, case, told):
    """With loading a little over half of the stage's allowance of five decodings."""
    data, known = photo_file(*case)
    known = known if told else Cable()
    photo = decode_photo(data, SETTINGS.photo, name="a.png")
    assert isinstance(photo, Photo)
    assert isinstance(benchmark(lambda: find_cable(photo, cable=known)), RoughCable)
    if benchmark.enabled:
        encoded = np.frombuffer(data, np.uint8)
        decoding = min(repeat(lambda: cv2.imdecode(encoded, cv2.IMREAD_UNCHANGED), timer=process_time, number=1))
        search = min(repeat(lambda: find_cable(photo, cable=known), timer=process_time, number=1))
        assert search < 3.0 * decoding


def test_search_needs_a_few_bytes_a_pixel():
    """Twelve bytes a pixel for everything; the photo itself takes three, and as much again while it is turned."""
    data, known = photo_file(*CASES[1])
    photo = decode_photo(data, SETTINGS.photo, name="a.png")
    assert isinstance(photo, Photo)
    tracemalloc.start()
    find_cable(photo, cable=known)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak / (photo.size[0] * photo.size[1]) < 6.0

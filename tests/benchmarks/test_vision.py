"""Time of the sub-pixel measurement, as a ratio to decoding the same photo in the same run."""

from __future__ import annotations

from time import process_time
from timeit import repeat

import cv2
import numpy as np
import pytest

from pipeline.records import Centerline
from pipeline.settings.vision import VisionSettings
from pipeline.vision.render import render
from pipeline.vision.scale.plane import PlaneMap
from tests.pipeline.vision.bow_scene import DIAMETER, bow_scene, measure_centerline, rough_cable


@pytest.mark.parametrize(
    ("px_per_mm", "height", "decodings"), [(12.0, 980, 4.0), (24.0, 2450, 2.5)], ids=["2.4 Mpx", "12 Mpx"]
)
def test_measuring_takes_a_few_times_the_decoding(benchmark, px_per_mm, height, decodings):
    """The fit's time does not grow with the photo: half of five decodings at 12 Mpx, more on a small photo.

    Decoding 2.4 Mpx takes 16 ms here, so that four decodings are under half of the 0.15 s a photo may take.
    """
    rng = np.random.default_rng(0)
    scene = bow_scene(rng, px_per_mm=px_per_mm, camera={"height": height}, noise=0.02)
    picture = render(scene)
    rough, plane = rough_cable(scene, picture, rng), PlaneMap.from_scale(scene.camera.px_per_m)
    data = cv2.imencode(".png", picture.pixels)[1]

    def measure():
        return measure_centerline(rough, plane=plane, diameter_m=DIAMETER, settings=VisionSettings())

    assert isinstance(benchmark(measure), Centerline)
    if benchmark.enabled:
        decoding = min(repeat(lambda: cv2.imdecode(data, cv2.IMREAD_UNCHANGED), timer=process_time, number=1))
        assert min(repeat(measure, timer=process_time, number=1)) < decodings * decoding

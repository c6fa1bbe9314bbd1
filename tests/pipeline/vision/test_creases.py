"""Cables as bright as their ground, seen by shade on the sheath and by contact shade beside it. Truth: the render."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from pipeline.records import CameraSpec, Centerline, LoadStep, RigSpec, Specimen
from pipeline.settings.vision import VisionSettings
from pipeline.vision.photo import Photo
from pipeline.vision.render import Ground, Light, Sensor
from pipeline.vision.search.creases import creased
from pipeline.vision.series import trace_series
from tests.pipeline.vision.drawn import drawn
from tests.pipeline.vision.test_segmentation import COVER, DIAMETER, LENGTH, SCALE, scene, strand


@pytest.mark.parametrize(("grey", "azimuth"), [(0.5, -1.6), (0.5, 0.3), (0.5, 1.6), (0.75, -1.6), (0.75, 0.3)])
def test_cable_as_bright_as_its_ground_is_traced_by_its_rims(tmp_path: Path, grey: float, azimuth: float) -> None:
    light = Light(azimuth_rad=azimuth, elevation_rad=1.3, ambient=0.35, shadow=0.8, softness=0.6)
    sheath = strand((grey,) * 3, gloss=0.3, shininess=10.0)
    ground, sensor = Ground(colour=(0.9 * grey,) * 3), Sensor(noise=0.01)
    picture = drawn(scene(cable=sheath, ground=ground, light=light, sensor=sensor))
    file = tmp_path / "a.png"
    cv2.imwrite(str(file), picture.pixels)
    step = LoadStep(0, "loading", 0.0, 1.0, 0.01, None, np.empty(0), np.empty(0), file.name)
    rig, images = RigSpec("left", COVER), {file.name: file}
    traces = trace_series(
        Specimen("a", tmp_path, LENGTH, DIAMETER, CameraSpec(SCALE), rig, (step,), images), VisionSettings()
    )
    (line,) = traces.photos
    assert "photo/rims" in {finding.code for finding in traces.findings}
    assert isinstance(line, Centerline), line.reason
    dense = np.linspace(0, 1, 8001)
    true = np.column_stack([np.interp(dense, np.linspace(0, 1, len(w)), w) for w in (picture.u_px, picture.v_px)])
    seen = np.column_stack([line.u_px, line.v_px])[line.shape.seen]
    off = cKDTree(true).query(seen)[0]
    assert np.sqrt(np.mean(off**2)) < 0.25  # px, of 25 across; a hundredth of the width
    # the lines are the rims' and that of the shade beside them: a few hundredths of the width farther out
    assert line.width_m == pytest.approx(DIAMETER, rel=0.08)


def test_one_dark_line_or_a_soft_shadow_is_no_strip() -> None:
    grey = np.full((200, 300), 180.0, np.float32)
    grey -= 80.0 * np.exp(-0.5 * ((np.arange(200.0, dtype=np.float32) - 60.0) / 30.0) ** 2)[:, None]
    grey[150:153] = 60.0
    strip = creased(Photo("a.png", grey.astype(np.uint8), 8), 30.0).pixels
    assert strip[20:140, 20:-20].max() < 20
    assert np.count_nonzero(strip[:, 150] > 60) == 3

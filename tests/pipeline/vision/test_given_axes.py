"""Axes that a person gave, on photos after the first."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.records import RigSpec
from pipeline.vision.render import Camera
from pipeline.vision.series import trace_series
from tests.pipeline.vision.test_series import CURVES, SCALE, SETTINGS, codes, lines, series


def test_axes_given_for_the_first_photo_move_by_the_log_without_a_scale(tmp_path: Path) -> None:
    """Covers of a size nobody gave hide the ends: those that are seen passed for the axes on all photos but the first.

    Where the axes are is then known to the scale, which is the cable's length on the first photo.
    """
    camera = Camera(1150, 520, SCALE, look_at_m=(0.085, 0.022))
    (u0, u1), (v0, v1) = camera.project(np.array([0.0, CURVES[0].chord]), np.zeros(2))
    given = RigSpec("left", None, ((float(u0), float(v0)), (float(u1), float(v1))))
    traces = trace_series(series(tmp_path, scale_error=None, given=given), SETTINGS)
    assert traces.scale.source.key == "scale.length"
    assert traces.scale.px_per_m == pytest.approx(SCALE, rel=0.003)
    for line, curve in zip(lines(traces), CURVES, strict=True):
        assert line.chord_m == pytest.approx(curve.chord, rel=0.003)
    assert not codes(traces)

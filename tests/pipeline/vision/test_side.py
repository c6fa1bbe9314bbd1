"""The side that counts positive is that of the most bent photo, whatever the force-free cable shows."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from pipeline.settings.vision import VisionSettings
from pipeline.vision.centerline.side import on_one_side, reflected
from pipeline.vision.render import Camera
from pipeline.vision.series import trace_series
from tests.pipeline.vision.curves import of_curvature
from tests.pipeline.vision.test_series import DIAMETER, LENGTH, SCALE, series

SETTINGS = VisionSettings()


def bent(amplitude, rest):
    return of_curvature(lambda s: amplitude * np.sin(pi * s / LENGTH) + rest, LENGTH)


@pytest.fixture
def traced(tmp_path, monkeypatch):
    """A cable of natural bow 1 1/m to one side, pushed to the other: on the photos of the test -1, 4 and 7 1/m."""
    curves = [bent(0.0, -1.0), bent(5.0, -1.0), bent(8.0, -1.0)]
    monkeypatch.setattr("tests.pipeline.vision.test_series.CURVES", curves)
    travel = [curves[0].chord - curve.chord for curve in curves]
    monkeypatch.setattr("tests.pipeline.vision.test_series.TRAVEL", travel)
    return trace_series(series(tmp_path, camera=Camera(1150, 620, SCALE, look_at_m=(0.085, 0.018))), SETTINGS)


def test_a_cable_pushed_against_its_natural_bow_has_a_negative_pre_curvature(traced):
    rest, *loaded = traced.photos
    # 0.3 % of the largest curvature, what 5 px/mm leave inside
    assert np.median(rest.shape.kappa) == pytest.approx(-1.0, abs=0.02)
    assert np.max(loaded[-1].shape.kappa) == pytest.approx(7.0, abs=0.02)
    assert len({line.side for line in traced.photos}) == 1
    told = [finding for finding in traced.findings if finding.code == "photo/other-side"]
    assert len(told) == 1
    assert rest.image in told[0].message


def test_reflected_twice_is_the_same(traced):
    shape = traced.photos[0].shape
    twice = reflected(reflected(shape))
    for name in ("y", "theta", "kappa", "basis_normal", "section_y"):
        assert np.array_equal(getattr(twice, name), getattr(shape, name))
    # the normal turns with the curve: what moves it along the one moves it against the other
    moved = shape.basis_normal[:, 3]
    there = shape.y + np.cos(shape.theta) * moved
    back = reflected(shape)
    assert np.allclose(back.y + np.cos(back.theta) * back.basis_normal[:, 3], -there)


def test_photos_that_bow_alike_stay_as_they_are(traced):
    lines, findings = on_one_side(traced.photos[1:], DIAMETER)
    assert lines == traced.photos[1:]
    assert not findings
    straight = replace(traced.photos[0], shape=reflected(traced.photos[0].shape))
    assert straight.side != traced.photos[1].side

"""Bright cables under a strong lamp, whose dark flank is nearly as dark as the ground; by the second renderer."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from fixtures.photographed.specimen import Order, make, write
from pipeline.intake.folder import read_specimen
from pipeline.records import Rejected
from pipeline.settings import Settings
from pipeline.vision.centerline.measurement import follow_cable
from pipeline.vision.render import Ground, Light, Sensor
from pipeline.vision.scale.plane import PlaneMap
from pipeline.vision.series import trace_series
from tests.pipeline.vision.test_segmentation import DIAMETER, SCALE, find, scene, strand


def traced(specimen, folder, photos):
    """The first centerlines of a specimen, and the distances (px) of each from the cable that was photographed."""
    write(specimen, folder, photos)
    settings, given = Settings(), read_specimen(folder, Settings().intake)
    traces = trace_series(replace(given, steps=given.steps[:photos]), settings.vision)
    camera, off = specimen.bench.camera, []
    for line, bow in zip(traces.photos, specimen.steps, strict=False):
        axis = np.column_stack([bow.x - bow.chord, bow.y, np.zeros_like(bow.x)])
        curve = CubicSpline(bow.s / bow.s[-1], camera.project(axis))
        place = np.linspace(0.0, 1.0, 4001)
        where, tangent = curve(place), curve(place, 1)
        points = np.column_stack([line.u_px, line.v_px])[line.shape.seen]
        nearest = np.array([np.argmin(np.sum((where - point) ** 2, axis=1)) for point in points])
        gap, along = points - where[nearest], tangent[nearest] / np.hypot(*tangent[nearest].T)[:, None]
        off.append(gap[:, 1] * along[:, 0] - gap[:, 0] * along[:, 1])
    return traces.photos, off


def test_faint_edge_of_a_dark_flank_is_found(tmp_path):
    specimen = make(Order("pair", "six", 79069, ("bearing_friction", "displacement_offset")))
    lines, off = traced(specimen, tmp_path, 2)
    for line, distances in zip(lines, off, strict=True):
        # where windows on a cover's shadow decided, the border of light and shade was taken for the edge: 0.89, 0.35 px
        assert line.width_m == pytest.approx(specimen.diameter, rel=0.03)
        assert np.sqrt(np.mean(distances**2)) < 0.2


def test_a_flank_without_an_edge_is_stated(tmp_path):
    specimen = make(Order("null", "six", 91006))
    lamp = np.array([-0.2495, -0.5157, 0.8196])
    dim = {"sheath": np.full(3, 0.56), "ground": np.full(3, 0.09), "ambient": 0.16, "lamp": lamp / np.linalg.norm(lamp)}
    look = replace(specimen.bench.look, **dim)
    (line,), (distances,) = traced(replace(specimen, bench=replace(specimen.bench, look=look)), tmp_path, 1)
    off, stated = np.sqrt(np.mean(distances**2)), line.shape.systematic_std * specimen.bench.camera.px_per_m
    # half of the eighth of the width that is missing; 0.3 px were stated for it
    assert line.width_m < 0.92 * specimen.diameter
    assert 0.5 < off / stated < 2.0


COLOURS = {
    "steel on wood": ((0.45, 0.47, 0.52), (0.62, 0.45, 0.28)),
    "white on pale wood": ((0.85, 0.85, 0.82), (0.78, 0.66, 0.48)),
    "rose on a green mat": ((0.80, 0.68, 0.68), (0.36, 0.45, 0.47)),
}


@pytest.mark.parametrize("name", COLOURS)
@pytest.mark.parametrize("azimuth", [-2.0, -0.4, 1.2, 2.8])
def test_a_flank_as_dark_as_the_ground_has_an_edge_in_another_tint(name, azimuth):
    """Shade makes the sheath as dark as the ground on one side; what it cannot change is the colour."""
    sheath, ground = COLOURS[name]
    light = Light(azimuth_rad=azimuth, elevation_rad=0.7, ambient=0.35, shadow=0.3, softness=0.5)
    sensor = Sensor(mode="colour", noise=0.01)
    rough, picture = find(scene(cable=strand(sheath), ground=Ground(colour=ground), light=light, sensor=sensor))
    assert not isinstance(rough, Rejected)
    followed = follow_cable(rough, plane=PlaneMap.from_scale(SCALE), diameter_m=DIAMETER)
    assert not isinstance(followed, Rejected)
    true = CubicSpline(np.linspace(0.0, 1.0, picture.u_px.size), np.column_stack([picture.u_px, picture.v_px]))
    dense = true(np.linspace(0.0, 1.0, 20001))
    middle = 0.5 * (followed.sections.first + followed.sections.second)
    off = np.array([np.min(np.hypot(*(dense - point).T)) for point in middle])
    assert np.sqrt(np.mean(off**2)) < 0.15  # in brightness three of the twelve were refused, four 0.16 to 0.82 px off
    assert followed.sections.caliper == pytest.approx(DIAMETER * SCALE, abs=0.8)

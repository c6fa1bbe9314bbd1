"""Shadows and highlights, whose rims are other edges than the cable's: ramps that last along a side are light."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.records import Centerline
from pipeline.settings.vision import VisionSettings
from pipeline.vision.polyline import arc_lengths
from pipeline.vision.render import Light, render
from pipeline.vision.render.sheath import Sheath
from pipeline.vision.scale.plane import PlaneMap
from pipeline.vision.search.crosscut import path_normals
from pipeline.vision.segmentation import _is_better
from tests.pipeline.vision.bow_scene import (
    DIAMETER,
    bow_scene,
    directional,
    errors,
    measure_centerline,
    rms,
    rough_cable,
    traced_errors,
)
from tests.pipeline.vision.test_segmentation import KNOWN, SCALE, find, scene

WIDTH = DIAMETER * SCALE


@pytest.mark.parametrize(("softness", "most"), [(0.1, 0.085), (0.3, 0.035), (0.6, 0.03)])
def test_a_shadow_on_one_side_hardly_moves_a_thin_cable(softness: float, most: float) -> None:
    def shadowed(rng: np.random.Generator):
        light = Light(
            azimuth_rad=rng.uniform(0.0, 2.0 * np.pi),
            elevation_rad=rng.uniform(0.9, 1.25),
            ambient=0.6,
            shadow=rng.uniform(0.25, 0.45),
            softness=softness,
        )
        return bow_scene(rng, px_per_mm=3.0, light=light)

    found = traced_errors(12, shadowed, seed=4243, quality=85)
    assert rms([one.position() for one in found]) < most  # 0.11, 0.04 and 0.02 px with ramps held to none
    pulls = [rms(list(one.normal[one.seen] / one.normal_std[one.seen])) for one in found]
    assert rms(pulls) < 1.3


@pytest.mark.parametrize("seed", range(4))
def test_a_path_half_a_width_astray_comes_back_to_the_cable(seed: int) -> None:
    """There it leads along a highlight and the flank of a shadow, which are nearly as far apart as the edges."""
    rng, px_per_mm = np.random.default_rng([77, seed]), 8.0
    glossy = Sheath((0.17,) * 3, gloss=0.8, shininess=60.0)
    drawn = bow_scene(rng, px_per_mm=px_per_mm, light=directional(rng), sheath=glossy)
    picture = render(drawn)
    rough, width = rough_cable(drawn, picture, rng), 1e3 * DIAMETER * px_per_mm
    s, across = arc_lengths(rough.path_px), path_normals(rough.path_px)
    aside = 0.45 * width * np.exp(-0.5 * ((s - 0.5 * s[-1]) / (2.0 * width)) ** 2)
    astray = replace(rough, path_px=rough.path_px + aside[:, None] * across)
    plane = PlaneMap.from_scale(1e3 * px_per_mm)
    found = measure_centerline(astray, plane=plane, diameter_m=DIAMETER, settings=VisionSettings())
    assert isinstance(found, Centerline)
    assert np.abs(errors(picture, found, 1e3 * px_per_mm).normal).max() < 0.15  # px; 6.8 by a single search


def test_the_colours_that_show_a_known_width_are_taken() -> None:
    """In one colour a shadow of it may widen the strip; where no width is known, a wider strip holds the other."""
    rough, _ = find(scene(), KNOWN)
    narrow, wide = (replace(rough, half_width_px=0.5 * share * WIDTH) for share in (0.97, 1.13))
    assert _is_better(wide, narrow, None)
    assert not _is_better(wide, narrow, WIDTH)
    assert _is_better(narrow, wide, WIDTH)


def test_of_two_colours_that_show_it_alike_the_one_of_the_photo_before_is_taken() -> None:
    """Else one photo of a series lies half a pixel beside the others, which bends the cable that they show."""
    rough, _ = find(scene(), KNOWN)
    firmer = replace(rough, evidence=replace(rough.evidence, edges=2.0 * rough.evidence.edges))
    in_all = replace(rough, weights=(0.4, 0.2, -0.4))
    assert rough.weights == (1.0,) and firmer.evidence.firmness > rough.evidence.firmness
    assert _is_better(firmer, rough, WIDTH) and not _is_better(firmer, rough, WIDTH, in_all)
    assert _is_better(rough, firmer, WIDTH, rough) and not _is_better(rough, firmer, WIDTH)

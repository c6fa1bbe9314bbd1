"""A path that runs along the shadow of the cable, or its flank, is led back to the cable."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.records import Centerline
from pipeline.settings.vision import VisionSettings
from pipeline.vision.render import Ground, Light, render
from pipeline.vision.render.sheath import Sheath
from pipeline.vision.scale.plane import PlaneMap
from tests.pipeline.vision.bow_scene import DIAMETER, bow_scene, errors, measure_centerline, rough_cable

FROM_ABOVE = Light(azimuth_rad=-np.pi / 2, elevation_rad=0.8, ambient=0.4, shadow=0.6, softness=0.2)


def astray(share, widths, *, seed):
    """A cable about as bright as its ground, and the path to it moved down into its shadow along a share of it."""
    rng = np.random.default_rng(seed)
    scene = bow_scene(
        rng,
        light=FROM_ABOVE,
        px_per_mm=8.0,
        ground=Ground(colour=(0.55,) * 3),
        sheath=Sheath(colour=(0.35,) * 3, gloss=0.3),
    )
    picture = render(scene)
    rough = rough_cable(scene, picture, rng)
    along = np.linspace(0.0, 1.0, len(rough.path_px))
    down = widths * DIAMETER * scene.camera.px_per_m / (1.0 + np.exp((along - share) / 0.02))
    return scene, picture, replace(rough, path_px=rough.path_px + np.column_stack([np.zeros_like(down), down]))


PART = [(1, 0.35, 0.6), (2, 0.25, 0.9), (3, 0.4, 0.5), (4, 0.3, -0.7)]
WHOLE = [(seed, 2.0, 0.55) for seed in (5, 6, 7)]


@pytest.mark.parametrize(("seed", "share", "widths"), PART + WHOLE)
def test_a_path_along_a_shadow_is_led_back_to_the_cable(seed, share, widths):
    """By what is seen along most of it; all of it by the axes, which a shadow passes both on one side."""
    scene, picture, rough = astray(share, widths, seed=seed)
    plane = PlaneMap.from_scale(scene.camera.px_per_m)
    found = measure_centerline(rough, plane=plane, diameter_m=DIAMETER, settings=VisionSettings())
    assert isinstance(found, Centerline), found.reason
    assert errors(picture, found, scene.camera.px_per_m).position() < 0.15

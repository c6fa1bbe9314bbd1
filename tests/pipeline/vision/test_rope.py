"""A rope whose strands swell its edges, drawn with its truth: the curve goes along the rope, not its strands."""

import cv2
import numpy as np
from scipy.spatial import cKDTree

from pipeline.settings.vision import VisionSettings
from pipeline.vision.centerline.measurement import centerline_of, follow_cable, waves_of
from pipeline.vision.render import render
from pipeline.vision.scale.plane import PlaneMap
from tests.pipeline.vision.bow_scene import DIAMETER, bow_scene, errors, rough_cable

SETTINGS = VisionSettings()


def roped(seed):
    """A photo of a rope whose strands swell one edge where they hollow the other: the cable followed, and its truth."""
    rng = np.random.default_rng(seed)
    scene = bow_scene(rng, px_per_mm=7.0, camera={"mirrored": False})
    picture = render(scene)
    radius, path = 0.5 * DIAMETER * scene.camera.px_per_m, np.column_stack([picture.u_px, picture.v_px])
    v, u = np.indices(picture.pixels.shape[:2])
    away, at = cKDTree(path).query(np.column_stack([u.ravel(), v.ravel()]))
    tangent, to = np.gradient(path, axis=0)[at], np.column_stack([u.ravel(), v.ravel()]) - path[at]
    aside = np.sign(tangent[:, 0] * to[:, 1] - tangent[:, 1] * to[:, 0]) * away / radius
    swell = 0.03 * np.sin(2.0 * np.pi * picture.curve.s[at] / DIAMETER) * np.sign(aside)
    covered = np.clip(radius * (1.0 + swell - np.abs(aside)) + 0.5, 0.0, 1.0)  # of a pixel
    shown = (200.0 - 130.0 * covered).reshape(v.shape)
    shown = cv2.GaussianBlur(shown, (0, 0), 1.0) + 2.0 * rng.standard_normal(v.shape)
    rough = rough_cable(scene, picture, rng, pixels=shown.clip(0, 255).astype(np.uint8))
    plane = PlaneMap.from_scale(scene.camera.px_per_m)
    return follow_cable(rough, plane=plane, diameter_m=DIAMETER), picture, scene


def test_curves_follow_a_rope():
    photos = [roped(seed) for seed in (3, 4, 5, 6)]
    cables = [cable for cable, *_ in photos]
    waves = waves_of(cables)
    lines = [centerline_of(cable, SETTINGS, waves=waves) for cable in cables]
    pairs = zip(lines, photos, strict=True)
    off = [errors(shown, line, scene.camera.px_per_m) for line, (_, shown, scene) in pairs]
    # 0.4 % of the largest curvature off over fifteen seeds
    assert np.mean([one.covered().mean() for one in off]) > 0.9
    assert np.sqrt(np.mean([one.interior() ** 2 for one in off])) < 0.6

"""A wiggle painted on the cable: taken off where all photos show it, left where only one does or a bend could."""

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from pipeline.settings.vision import VisionSettings
from pipeline.vision.centerline.lay import common_wiggle, without_lay
from pipeline.vision.centerline.measurement import centerline_of, follow_cable, waves_of
from pipeline.vision.render import render
from pipeline.vision.scale.plane import PlaneMap
from tests.pipeline.vision.bow_scene import DIAMETER, bow_scene, errors, rough_cable

LENGTH, PHOTOS, SETTINGS = 0.181, 5, VisionSettings()
NOISE, WAVE = 3e-6, 2e-5
"""m; of a section, and the amplitude of a wiggle: a tenth of a pixel of 0.2 mm."""


def lay(s, periods=3.0):
    """Twisted strands: a period of three diameters, as black and white pairs have it."""
    return WAVE * np.sin(2.0 * np.pi * s / (periods * DIAMETER))


@pytest.fixture(scope="module")
def photos():
    """Sections of five photos, each with its own noise; the covers hide 5 mm."""
    rng = np.random.default_rng(7)
    places = [np.arange(5e-3 + 1e-4 * rng.random(), LENGTH - 5e-3, 2.5e-4) for _ in range(PHOTOS)]
    return places, [NOISE * rng.standard_normal(s.size) for s in places]


def taken(photos, pushes):
    """What is taken off each photo because its sections were pushed by a function of arc length, per photo."""
    places, noise = photos
    across = [off + push(s) for s, off, push in zip(places, noise, pushes, strict=True)]
    return [one - other for one, other in zip(found(places, across), found(places, noise), strict=True)]


def found(places, across):
    return common_wiggle(places, across, DIAMETER).across


def share(s, part, wave):
    """Of a wave (m per section), how much a part holds."""
    pattern = wave(s)
    return float(part @ pattern / (pattern @ pattern))


def test_what_all_photos_show_at_the_same_place_is_taken_off(photos):
    for s, part in zip(photos[0], taken(photos, [lay] * PHOTOS), strict=True):
        assert 0.95 < share(s, part, lay) < 1.02  # 1 / (1 + (3 / 5.6)^8) = 0.993, and the cells of the mean


def test_it_is_taken_off_beside_the_covers_too(photos):
    """A running mean is one-sided there: of a parabola it took a wiggle of its own, a third of a pixel."""

    def bent(s):
        return lay(s, 1.0) + 5e-5 * (2.0 * s / LENGTH - 1.0) ** 2

    for s, part in zip(photos[0], taken(photos, [bent] * PHOTOS), strict=True):
        off = part - lay(s, 1.0)
        assert np.sqrt(np.mean(off[:40] ** 2)) < 0.2 * WAVE and np.abs(off[:40].mean()) < 0.03 * WAVE


@pytest.mark.parametrize("shift", [-6e-3, 0.0])
def test_photos_that_show_little_together_and_ends_before_their_axis_are_no_trouble(photos, shift):
    """Two photos, the halves they show overlapping by a fifth; a visible end has sections before its axis."""
    (one, other), (first, second) = ([part[k] for k in (0, 1)] for part in photos)
    left, right = one < 0.6 * LENGTH, other > 0.4 * LENGTH
    places = [one[left] + shift, other[right] + shift]
    across = [(first + lay(one))[left], (second + lay(other))[right]]
    (taken_left, taken_right), std, spare = common_wiggle(places, across, DIAMETER)
    alone = one[left] < 0.38 * LENGTH
    assert np.abs(taken_left[alone]).max() < 0.2 * WAVE  # what one photo alone shows is nothing common
    assert np.isfinite(std) and 1.0 <= spare <= 2.0 and np.abs(taken_right).max() < 2.0 * WAVE


def test_what_one_photo_shows_stays(photos):
    alone = taken(photos, [lay, *[np.zeros_like] * (PHOTOS - 1)])
    assert share(photos[0][0], alone[0], lay) < 1.0 / PHOTOS + 0.02


def test_what_a_bend_could_do_stays(photos):
    """A soft spot four diameters wide: its deflection is slower still, here even that of its curvature's own width."""

    def spot(s):
        return WAVE * np.exp(-0.5 * ((s - 0.09) / (4.0 * DIAMETER)) ** 2)

    for s, part in zip(photos[0], taken(photos, [spot] * PHOTOS), strict=True):
        assert abs(share(s, part, spot)) < 0.03


def test_of_noise_alone_little_is_taken_and_what_is_left_scatters_as_told(photos):
    places, noise = photos
    parts, _, spare = common_wiggle(places, noise, DIAMETER)
    # the mean of five photos has 0.45 of the noise of one; that it is chance must take half of it and more
    assert np.sqrt(np.mean(np.concatenate(parts) ** 2)) < 0.22 * NOISE
    across = [off + lay(s) for s, off in zip(places, noise, strict=True)]
    parts, _, spare = common_wiggle(places, across, DIAMETER)
    left = np.concatenate([off - part for off, part in zip(across, parts, strict=True)])
    # a section is as wide as a cell of the mean here; 3,400 sections tell a standard deviation to 1.2 %
    assert np.sqrt(spare) * left.std() == pytest.approx(NOISE, rel=0.05) and spare > 1.1


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


def test_curves_follow_a_rope_once_its_lay_is_off():
    """The lay taken for noise, the band of the curvature was three times as wide."""
    photos = [roped(seed) for seed in (3, 4, 5, 6)]
    before, off, band = [cable for cable, *_ in photos], [], []
    for cables in (before, without_lay(before, DIAMETER)):
        waves = waves_of(cables)
        lines = [centerline_of(cable, SETTINGS, waves=waves) for cable in cables]
        pairs = zip(lines, photos, strict=True)
        off.append([errors(shown, line, scene.camera.px_per_m) for line, (_, shown, scene) in pairs])
        band.append(np.mean([line.kappa_std.mean() for line in lines]))
    assert band[1] < 0.5 * band[0]
    # and holds the truth: 0.4 % of the largest curvature off before and after, over fifteen seeds
    assert np.mean([one.covered().mean() for one in off[1]]) > 0.9
    assert np.sqrt(np.mean([one.interior() ** 2 for one in off[1]])) < 0.6

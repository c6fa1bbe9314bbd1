"""Waves that the ground makes in a midline: told from the widths, and true of rendered photos on a wooden table."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from fixtures.photographed.specimen import Order, make, write
from pipeline.intake.folder import read_specimen
from pipeline.settings import Settings
from pipeline.vision.centerline.ground_waves import HalfWidths, Waves, edge_waves, seen_waves
from pipeline.vision.series import trace_series
from rod.measurement import slow_covariance
from rod.midline import block_covariance

SCATTER, BRIEF = 5e-6, 5e-4


def photo(rng, std, length, n=300):
    s = np.linspace(0.01, 0.19, n)
    apart = np.abs(np.subtract.outer(s, s))
    covariance = SCATTER**2 * np.exp(-apart / BRIEF) + std**2 * np.exp(-0.5 * (apart / length) ** 2)
    return HalfWidths(s, np.linalg.cholesky(covariance) @ rng.standard_normal(n), np.full(n, SCATTER), BRIEF)


def test_scatter_alone_makes_no_waves():
    rng = np.random.default_rng(1)
    found = [seen_waves([photo(rng, 0.0, 1.0) for _ in range(4)]) != Waves() for _ in range(60)]
    # once in twenty at most as said: of 60 more than seven by chance once in a hundred
    assert sum(found) <= 7


@pytest.mark.parametrize(("std", "length", "factor"), [(2e-6, 4e-3, 3.0), (4e-6, 8e-3, 2.0)])
def test_size_and_length_of_waves(std, length, factor):
    rng = np.random.default_rng(2)
    seen = [seen_waves([photo(rng, std, length) for _ in range(7)]) for _ in range(20)]
    found = np.array([(waves.own, waves.length) for waves in seen])
    assert np.median([waves.common for waves in seen]) < 0.3 * std
    # seven photos of some twelve waves each tell a variance to a sixth; the length of waves that hardly rise above the
    # scatter (the first: three times its variance in the coarsest components) is told to a factor
    assert np.median(found[:, 0]) == pytest.approx(std, rel=0.1)
    assert np.all(np.abs(np.log(found[:, 1] / length)) < np.log(factor))


def test_few_sections_tell_nothing():
    short = photo(np.random.default_rng(3), 2e-5, 8e-3, n=80)
    assert seen_waves([short] * 7) == Waves()
    assert seen_waves([]) == Waves()


def test_a_photo_whose_sections_live_on_one_edge_tells_nothing():
    nothing = np.empty(0)
    photos = [HalfWidths(nothing, nothing, nothing, 0.0)]
    assert edge_waves(photos, metres_per_px=1e-4) == Waves()


def test_waves_that_all_photos_have_alike():
    rng = np.random.default_rng(6)
    found = []
    s = photo(rng, 0.0, 1.0).s
    root = np.linalg.cholesky(slow_covariance(s, ((1.0, 8e-3),)) + 1e-9 * np.eye(len(s)))
    for _ in range(12):
        alike = 4e-6 * root @ rng.standard_normal(len(s))
        photos = [photo(rng, 0.0, 1.0) for _ in range(7)]
        found.append(seen_waves([replace(one, half=one.half + alike) for one in photos]))
    # one draw of a dozen waves tells their variance to 40 %, their standard deviation to a fifth
    assert np.median([waves.common for waves in found]) == pytest.approx(4e-6, rel=0.2)
    assert np.median([waves.own for waves in found]) < 1e-6


def test_every_photo_has_waves_of_its_own():
    rng = np.random.default_rng(5)
    photos = [photo(rng, 0.0, 1.0) for _ in range(4)]
    assert seen_waves(photos) == Waves()
    found = edge_waves(photos, metres_per_px=1e-4)
    assert (found.own, found.common, found.length) == pytest.approx((1e-6, 0.5e-6, 0.04 * 0.18))
    assert edge_waves([], metres_per_px=1e-4) == Waves()


def test_a_speck_on_one_edge_is_no_wave():
    rng = np.random.default_rng(4)
    photos = [photo(rng, 0.0, 1.0) for _ in range(7)]
    specks = [replace(one, half=one.half + 1e-3 * (np.abs(one.s - 0.1) < 1e-3)) for one in photos]
    assert seen_waves(specks).own < 0.5 * SCATTER


def off_the_truth(shape, bow, mirrored):
    """Distances of the sections from the cable as it was bent, along its normal, both in their chord frames."""
    x, y, s = (bow.x, bow.y, bow.s) if not mirrored else (bow.chord - bow.x[::-1], bow.y[::-1], bow.s[-1] - bow.s[::-1])
    stretch = shape.s[-1] / s[-1]
    curve = CubicSpline(s * stretch, np.column_stack([x, y]) * stretch)
    at = shape.section_s
    for _ in range(3):
        tangent = curve(at, 1)
        gap = np.column_stack([shape.section_x, shape.section_y]) - curve(at)
        at = at + (tangent * gap).sum(axis=1)
    return gap[:, 1] * tangent[:, 0] - gap[:, 0] * tangent[:, 1]


def test_wooden_ground(tmp_path):
    specimen = make(Order("null", "loop", 78005))
    assert specimen.bench.ground == "wooden"
    write(specimen, tmp_path)
    settings = Settings()
    traces = trace_series(read_specimen(tmp_path, settings.intake), settings.vision)
    told, plain = [], []
    for line, bow in zip(traces.photos, specimen.steps, strict=True):
        shape = line.shape
        assert shape.wave_std > 0.0
        order = np.argsort(shape.section_s)
        offsets = [off_the_truth(shape, bow, mirrored)[order] for mirrored in (False, True)]
        off = min(offsets, key=lambda one: float(np.std(one)))
        s, std, ones = shape.section_s[order], shape.section_std[order], np.ones(len(order), dtype=np.intp)
        # degrees that no error of axes or scale reaches, and that last longer than the scatter of the sections
        t = 2.0 * (s - s[0]) / np.ptp(s) - 1.0
        waves = np.linalg.qr(np.polynomial.legendre.legvander(t, 18))[0][:, 6:]
        scatter = block_covariance(s, std, np.arange(len(s)), ones, shape.correlation_length)
        square = (waves.T @ off) ** 2
        plain += list(square / np.sum(waves * (scatter @ waves), axis=0))
        scatter += slow_covariance(s, shape.slow[1:])
        told += list(square / np.sum(waves * (scatter @ waves), axis=0))
    # 91 nearly independent components: their mean scatters by 0.15 about 1
    assert np.mean(plain) > 1.6
    assert 0.6 < np.mean(told) < 1.4

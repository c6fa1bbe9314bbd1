"""Curvature spline: integration and derivatives against closed forms, errors and bands against known noise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline
from scipy.special import fresnel

from pipeline.vision.centerline.curvature import PlaneCurve, make_frame
from pipeline.vision.centerline.curve_fit import CurveFit, fit_curve, follow_points, initial_curve

LENGTH = 0.2


def curve_of(kappa, *, intervals=24, angle=0.3, length=LENGTH):
    """Curve whose spline is the least-squares fit of kappa(s) on the grid."""
    frame = make_frame(length, intervals=intervals)
    coefficients = np.linalg.lstsq(frame.values, kappa(frame.grid), rcond=None)[0]
    return PlaneCurve(frame, coefficients, np.array([0.01, 0.02]), angle)


def noisy(kappa, rng, *, std, correlation, count=240, hidden=0.006, length=LENGTH):
    """Points along the curve of kappa(s) with correlated errors along the normal; hidden ends."""
    fine = np.linspace(0.0, length, 4001)
    theta = CubicSpline(fine, kappa(fine)).antiderivative()
    x, y = (
        CubicSpline(fine, np.cos(theta(fine))).antiderivative(),
        CubicSpline(fine, np.sin(theta(fine))).antiderivative(),
    )
    s = np.linspace(hidden, length - hidden, count)
    rho = np.exp(-(s[1] - s[0]) / correlation) if correlation else 0.0
    e = rng.standard_normal(count)
    for i in range(1, count):
        e[i] = rho * e[i - 1] + np.sqrt(1.0 - rho**2) * e[i]
    points = np.column_stack([x(s), y(s)])
    return s, points + std * e[:, None] * np.column_stack([-np.sin(theta(s)), np.cos(theta(s))])


def fit(s, points, *, intervals=26, length=LENGTH, std=1e-5) -> CurveFit:
    frame = make_frame(length, intervals=intervals)
    start, stds = initial_curve(points, s, frame), np.full(len(s), std)
    return fit_curve(points, stds, start=start, s=s, longest=0.01)


def bow(s):
    """A pre-curved cable under load: kappa = K0 at both ends, with a slope."""
    return 2.0 + 7.0 * np.sin(np.pi * s / LENGTH)


def test_constant_curvature_integrates_to_a_circle():
    curve = curve_of(lambda s: 12.0 + 0.0 * s)
    s = np.linspace(0.0, LENGTH, 57)
    points, angle = curve.at(s)
    anchor = curve.frame.grid[curve.frame.anchor]
    assert_allclose(angle, 0.3 + 12.0 * (s - anchor), atol=1e-12)
    exact = curve.point + np.column_stack([np.sin(angle) - np.sin(0.3), np.cos(0.3) - np.cos(angle)]) / 12.0
    assert_allclose(points, exact, atol=1e-11 * LENGTH)


def test_linear_curvature_integrates_to_a_clothoid():
    rate = 400.0
    curve = curve_of(lambda s: rate * s, angle=0.0)
    anchor = curve.frame.grid[curve.frame.anchor]
    s = np.linspace(0.0, LENGTH, 33)
    sine, cosine = np.sqrt(np.pi / rate) * np.array(
        fresnel(np.array([s, np.full_like(s, anchor)]) * np.sqrt(rate / np.pi))
    )
    # Turned so that the angle is zero at the anchor, where the clothoid's is rate * anchor^2 / 2.
    turn = -0.5 * rate * anchor**2
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    exact = curve.point + np.column_stack([cosine[0] - cosine[1], sine[0] - sine[1]]) @ rotation.T
    assert_allclose(curve.at(s)[0], exact, atol=1e-8 * LENGTH)  # 2e-5 px on a photo, at a turn of 8 rad


def test_bases_are_the_derivatives():
    curve = curve_of(bow)
    s = np.linspace(0.0, LENGTH, 41)
    angle = curve.at(s)[1]
    normal, turn, bend = curve.bases(s)
    across = np.column_stack([-np.sin(angle), np.cos(angle)])
    for j in (0, 1, 2, 9, curve.frame.size - 1):
        step = np.zeros(curve.frame.size)
        step[j] = 1e-5 if j else 1e-8
        moved, back = curve.moved(step), curve.moved(-step)
        size = 2.0 * step[j]
        change = ((moved.at(s)[0] - back.at(s)[0]) * across).sum(axis=1) / size
        # Between the ends of a cell the basis is linear; it gives the steps and the bands, not the curve. Curvature is
        # linear in the coefficients: roundings over the step are left.
        assert_allclose(normal[:, j], change, atol=2e-3 * np.abs(change).max())
        assert_allclose(
            turn[:, j], (moved.at(s)[1] - back.at(s)[1]) / size, atol=2e-3 * np.abs(turn[:, j]).max() + 1e-9
        )
        assert_allclose(bend[:, j], (moved.curvature(s) - back.curvature(s)) / size, atol=1e-9)


def test_feet_are_the_nearest_points():
    curve = curve_of(bow)
    s = np.linspace(0.02, 0.18, 20)
    where, angle = curve.at(s)
    across = np.column_stack([-np.sin(angle), np.cos(angle)])
    assert_allclose(curve.foot(where + 5e-4 * across, s + 1e-3, steps=12), s, atol=1e-9)


def test_exact_points_give_back_the_curvature():
    s, points = noisy(bow, np.random.default_rng(0), std=0.0, correlation=0.0)
    found = fit(s, points)
    at = np.linspace(0.0, LENGTH, 101)
    error = np.abs(found.curve.curvature(at) - bow(at)) / 9.0
    # where points are, by far less than the 0.15 % that noise may make
    assert error[5:-5].max() < 1e-5
    # in the 6 mm nobody saw, a tenth of the target for the last 10 mm: without noise rounding alone says how smooth
    assert error.max() < 1.5e-3


def test_ends_keep_pre_curvature_and_slope():
    """kappa(0) = K0 with the slope of a loaded cable: neither value nor slope may be drawn to zero."""
    rng = np.random.default_rng(1)
    ends = np.array(
        [fit(*noisy(bow, rng, std=1e-6, correlation=0.001)).curve.curvature(np.array([0.0, 1e-3])) for _ in range(20)]
    )
    assert abs(np.mean(ends[:, 0]) - 2.0) < 0.015 * 9.0  # the target for the last 10 mm, 6 mm beyond the last point
    # twenty slopes tell theirs to 1 %; what the penalty makes of 6 mm that nobody saw may be off by ten times that
    assert_allclose(np.mean(np.diff(ends)) / 1e-3, 7.0 * np.pi / LENGTH, rtol=0.1)


def test_correlated_noise_is_estimated_and_bands_are_true():
    """40 curves: the 95 % band of kappa covers 90 to 99 % inside and at the unseen ends, sigma and length come back."""
    rng = np.random.default_rng(2)
    at = np.linspace(0.0, LENGTH, 81)
    inner = (at > 0.01) & (at < LENGTH - 0.01)
    covered, sigma, length = [], [], []
    for _ in range(40):
        peak, sharp = rng.uniform(2.0, 8.0), rng.uniform(0.0, 0.2)

        def kappa(s, peak=peak, sharp=sharp):
            return 2.0 + peak * (np.sin(np.pi * s / LENGTH) - sharp * np.sin(3.0 * np.pi * s / LENGTH))

        found = fit(*noisy(kappa, rng, std=3e-6, correlation=0.0015))
        std = np.linalg.norm(found.curve.bases(at)[2] @ found.smooth.root, axis=1)
        covered.append(np.abs(found.curve.curvature(at) - kappa(at)) < 1.96 * std)
        sigma.append(found.smooth.sigma * 1e-5)
        length.append(found.smooth.correlation_length)
    covered = np.array(covered)
    assert 0.90 <= covered[:, inner].mean() <= 0.99
    assert 0.90 <= covered[:, ~inner].mean() <= 1.0
    # 75 independent sections tell sigma to 8 %, the median of forty curves to 1.6 %: three of those
    assert_allclose(np.median(sigma), 3e-6, rtol=0.05)
    # the length of one curve scatters by a fifth, the median by 4 %: three of those
    assert_allclose(np.median(length), 0.0015, rtol=0.12)


def test_white_noise_bands_are_too_narrow_for_correlated_errors():
    """Why the correlation is estimated: taken as white, the same errors give bands that cover far less than 95 %."""
    rng = np.random.default_rng(3)
    at = np.linspace(0.02, 0.18, 50)
    covered = {"white": [], "estimated": []}
    for _ in range(15):
        s, points = noisy(bow, rng, std=3e-6, correlation=0.004)
        frame = make_frame(LENGTH, intervals=26)
        start = initial_curve(points, s, frame)
        for name, longest in (("white", 0.0), ("estimated", 0.01)):
            found = fit_curve(points, np.full(len(s), 1e-5), start=start, s=s, longest=longest)
            std = np.linalg.norm(found.curve.bases(at)[2] @ found.smooth.root, axis=1)
            covered[name].append(np.mean(np.abs(found.curve.curvature(at) - bow(at)) < 1.96 * std))
    assert np.mean(covered["estimated"]) > 0.9  # the target
    assert np.mean(covered["white"]) < 0.8  # far from it: of 95 % a variance too small by two leaves 83 %


def test_outliers_do_not_bend_the_curve():
    s, points = noisy(bow, np.random.default_rng(5), std=2e-6, correlation=0.0)
    at = np.linspace(0.01, 0.19, 91)
    spoiled = points.copy()
    spoiled[100:108, 1] += 5e-4  # eight neighbours off by 250 standard deviations
    plain, robust = fit(s, points), fit(s, spoiled)
    assert np.all(robust.weight[100:108] == 0.0)
    # noise leaves 2e-4 of the curvature; without eight points of 240 it may change by about as much
    assert np.max(np.abs(robust.curve.curvature(at) - plain.curve.curvature(at))) < 5e-4 * 9.0


def test_a_gap_among_the_points_does_not_throw_away_what_lies_beyond():
    """The chord of a gap is shorter than the arc, so all beyond it starts far off the curve."""
    s, points = noisy(lambda s: 25.0 * np.sin(40.0 * s), np.random.default_rng(6), std=2e-7, correlation=0.0)
    points = points[np.r_[0:60, 100:240]]
    walked = s[0] + np.r_[0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    found = fit(walked, points, length=LENGTH - (s[-1] - walked[-1]))
    assert np.all(found.weight > 0.0)
    assert np.sqrt(np.mean(found.residual**2)) < 2e-7  # the noise


def test_fewer_points_than_parameters_are_followed():
    """A short piece of cable between covers: the penalty tells what its points leave open."""
    turn = np.linspace(0.1, 0.9, 14)
    points = 0.2 * np.column_stack([np.sin(turn), 1.0 - np.cos(turn)])
    frame = make_frame(LENGTH, intervals=16)
    assert frame.size > len(points)
    s = 0.2 * turn
    path = initial_curve(points, s, frame)
    for _ in range(3):
        path = follow_points(points, start=path, s=s)
    # three steps from a start that is the circle but for its chords, 1e-3 of the curvature: each squares what is off
    assert_allclose(path.at(path.foot(points, s))[0], points, atol=1e-8 * LENGTH)
    assert_allclose(path.curvature(s), 5.0, rtol=1e-4)


def test_frames_refuse_nonsense():
    with pytest.raises(ValueError, match="at least 4 intervals"):
        make_frame(1.0, intervals=3)

"""Photos with known errors for the tests of both ways, and whole bending tests of random cables.

The photo is the noise model of real photos: raw midline sections with errors correlated along s, bearing axes with
errors of their own and errors common to all photos, a common scale error, covers over the ends. The smooth curve is the
generalised least squares fit of a cubic curvature spline to those sections, linearised about the truth, with its exact
covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve, toeplitz

from rod.measurement import MeasuredShape, MeasuredStep, MeasuredTest
from tests.rod.virtual_cable import StickSlip, TrueShape, equilibrium, force_free

MM = 1e-3
SECTION_PLACES = ("section_s", "section_x", "section_y")


@dataclass(frozen=True)
class Camera:
    """How the photos err: standard deviations of sections, axes (own, and common to all photos), scale and length."""

    px: float = MM / 11
    spacing_px: float = 3.0  # between sections: a third of the correlation length tells all there is to tell
    section_px: float = 0.05
    correlation_px: float = 10.0
    axis_px: float = 0.05
    common_axis: float = 0.0
    scale: float = 3e-4
    length: float = 5e-5
    systematic_px: float = 0.0
    systematic_length: float = 20 * MM
    cover: float = 6 * MM
    coefficients: int = 16


@dataclass(frozen=True)
class Truth:
    """What the test must find again."""

    law: StickSlip
    length: float
    shapes: tuple[TrueShape, ...] = field(repr=False)

    @property
    def kappa_max(self):
        return max(shape.kappa.max() for shape in self.shapes)


def columns(shape, s, coefficients):
    """Normal displacement, turn and curvature by start offset, start angle and curvature spline.

    A turn dtheta(s') of the tangent moves every later point by -dtheta sin(theta), dtheta cos(theta). Integrals by the
    trapezium rule on 1,500 points: relative error below 1e-5, the same for the errors made and the basis handed over.
    """
    length = shape.s[-1]
    knots = np.concatenate([[0] * 3, np.linspace(0, length, coefficients - 2), [length] * 3])
    bend = BSpline(knots, np.eye(coefficients), 3)
    fine = np.linspace(0, length, 1501)
    theta = shape.at(fine)[2]
    zero, one = np.zeros((len(fine), 1)), np.ones((len(fine), 1))
    turn = np.hstack([zero, one, -bend.antiderivative()(fine)])

    def running(g):
        return np.vstack([np.zeros((1, g.shape[1])), np.cumsum((g[1:] + g[:-1]) / 2, axis=0) * fine[1]])

    dx, dy = running(-turn * np.sin(theta)[:, None]), running(turn * np.cos(theta)[:, None])
    dx[:, 0] -= np.sin(theta[0])
    dy[:, 0] += np.cos(theta[0])
    normal = -np.sin(theta)[:, None] * dx + np.cos(theta)[:, None] * dy
    normal, turn = (np.stack([np.interp(s, fine, c) for c in table.T], axis=1) for table in (normal, turn))
    return normal, turn, np.hstack([np.zeros((len(s), 2)), bend(s)])


def axes_covariance(shape, std):
    """Axes at fault shift and turn the chord frame: covariance of start offset and start angle of the curve in it."""
    lift, turn = -np.cos(shape.theta[0]) * np.array([1.0, 0.0]), np.array([1.0, -1.0]) / shape.chord
    by_axes = np.stack([lift, turn])
    return std**2 * by_axes @ by_axes.T


def photograph(shape, camera, rng, *, scale=0.0, common=0.0, points=181):
    """MeasuredShape, chord and its std of a true shape on a photo; `scale`, `common` (axes): errors of all photos."""
    length = shape.s[-1]
    axes = rng.normal(0, camera.axis_px * camera.px, (2, 2)) + common  # left, right; along, across
    grid = np.linspace(0, length, points)
    s = np.linspace(
        camera.cover, length - camera.cover, int((length - 2 * camera.cover) / (camera.spacing_px * camera.px))
    )
    std, rho = camera.section_px * camera.px, camera.correlation_px * camera.px
    noise = std**2 * toeplitz(np.exp(-(s - s[0]) / rho))
    if camera.systematic_px:
        slow = np.exp(-0.5 * ((s - s[0]) / camera.systematic_length) ** 2)
        noise += (camera.systematic_px * camera.px) ** 2 * toeplitz(slow)
    factor = np.linalg.cholesky(noise)
    error = factor @ rng.standard_normal(len(s))
    at_sections = columns(shape, s, camera.coefficients)[0]
    weighted = cho_solve((factor, True), at_sections)
    covariance = np.linalg.inv(at_sections.T @ weighted)
    dq = covariance @ (weighted.T @ error)
    covariance[:2, :2] += axes_covariance(shape, camera.axis_px * camera.px)
    normal, turn, bend = columns(shape, grid, camera.coefficients)

    left, right = axes[0], np.array([shape.chord, 0.0]) + axes[1]
    roll = np.arctan2(*(right - left)[::-1])
    shrink = 1 / (1 + scale)

    def on_photo(s, push):
        x, y, theta, _ = shape.at(s)
        x, y = x - push * np.sin(theta) - left[0], y + push * np.cos(theta) - left[1]
        return shrink * (np.cos(roll) * x + np.sin(roll) * y), shrink * (np.cos(roll) * y - np.sin(roll) * x)

    _, _, theta, kappa = shape.at(grid)
    measured = MeasuredShape(
        grid * shrink,
        *on_photo(grid, normal @ dq),
        theta + turn @ dq - roll,
        (kappa + bend @ dq) / shrink,
        (grid >= camera.cover) & (grid <= length - camera.cover),
        normal,
        turn,
        bend,
        covariance,
        s * shrink,
        *on_photo(s, error),
        np.full(len(s), std),
        rho,
        camera.systematic_px * camera.px,
        camera.systematic_length,
    )
    return measured, shrink * np.hypot(*(right - left)), np.sqrt(2) * camera.axis_px * camera.px


def scaled(test, longer, stiffer):
    """The test of a cable longer and stiffer by factors, seen from as much farther away: lengths and forces alone."""
    force = stiffer / longer**2
    lengths = ("s", "x", "y", *SECTION_PLACES, "section_std", "correlation_length", "systematic_std")
    lengths += ("systematic_length", "wave_std", "wave_length", "common_std")
    steps = []
    for step in test.steps:
        shape = {name: longer * getattr(step.shape, name) for name in lengths}
        seen = {name: longer * getattr(step, name) for name in ("displacement", "chord", "chord_std")}
        felt = {name: force * getattr(step, name) for name in ("force", "force_std")}
        shape = replace(step.shape, kappa=step.shape.kappa / longer, **shape)
        steps.append(replace(step, shape=shape, **seen, **felt))
    told = {name: longer * getattr(test, name) for name in ("length", "length_std", "axis_std", "camera_foot_std")}
    return replace(test, steps=tuple(steps), **told)


def stretched(test, factor):
    """The test with every length on every photo multiplied by `factor`, as a wrong scale does."""
    steps = []
    for step in test.steps:
        shape = step.shape
        lengths = {name: getattr(shape, name) * factor for name in ("s", "x", "y", *SECTION_PLACES)}
        steps.append(
            replace(step, chord=step.chord * factor, shape=replace(shape, kappa=shape.kappa / factor, **lengths))
        )
    return replace(test, steps=tuple(steps))


def moved_axes(test, left, right):
    """The test with both bearing axes found too far toward the bow, by `left` and `right` (m), on every photo."""
    steps = []
    for step in test.steps:
        shape, roll = step.shape, (right - left) / step.chord
        seen = {}
        for part in ("", "section_"):
            x, y = (getattr(shape, part + name) for name in "xy")
            seen |= {part + "x": x + roll * y, part + "y": y - left - roll * x}
        steps.append(replace(step, shape=replace(shape, theta=shape.theta - roll, **seen)))
    return replace(test, steps=tuple(steps))


def parted_axes(test, parallax, foot):
    """The test with both bearing axes found farther from `foot` ((x, y) m, chord frame) by that part of the way."""
    steps = []
    for step in test.steps:
        shape, (dx, dy) = step.shape, parallax * np.asarray(foot)
        seen = {
            "x": shape.x + dx,
            "section_x": shape.section_x + dx,
            "y": shape.y + dy,
            "section_y": shape.section_y + dy,
        }
        steps.append(replace(step, chord=step.chord * (1.0 + parallax), shape=replace(shape, **seen)))
    return replace(test, steps=tuple(steps))


def random_cable(rng, *, law=StickSlip):
    """Law, length and chords of a random test: EI from 1e-5 to 1 N m^2, EI0/EI1 from 1 to 6, three to eight steps."""
    length = rng.uniform(0.15, 0.25)
    EI0 = 10 ** rng.uniform(-5, 0)
    law = law(EI0, EI0 / rng.uniform(1, 6), rng.uniform(0.5, 1.2) * 1.0 / length, rng.uniform(0.05, 0.6) / length)
    steps, reach = rng.integers(3, 9), rng.uniform(0.04, 0.12) * length
    natural = 2 / law.K0 * np.sin(law.K0 * length / 2)
    return law, length, natural - reach * np.arange(1, steps + 1) / steps


def bending_test(law, length, chords, rng, *, mounted=True, unloading=0, **kind):
    """MeasuredTest with its Truth. `chords` descend; the last `unloading` of them are visited again on the way back."""
    bows = [equilibrium(law, length, chord) for chord in chords]
    rest = force_free(law, length)
    back = bows[-2 : -2 - unloading : -1]
    test, shapes = record([rest] * mounted + bows + back, rest.chord, rng, unloading=len(back), **kind)
    return test, Truth(law, length, shapes)


def record(shapes, natural, rng, *, camera=Camera(), force_noise=3e-3, unloading=0):
    """MeasuredTest of true shapes: photos, forces with relative noise, displacement from the chord `natural`."""
    length = shapes[0].s[-1]
    scale = rng.normal(0, camera.scale)
    common = rng.normal(0, camera.common_axis, (2, 2)) if camera.common_axis else 0.0
    strongest = max(shape.force for shape in shapes)
    steps = []
    for k, shape in enumerate(shapes):
        loaded = "unloading" if k >= len(shapes) - unloading else "loading"
        branch = loaded if shape.force else "mounted"
        std = force_noise * (shape.force or strongest)
        photo, chord, chord_std = photograph(shape, camera, rng, scale=scale, common=common)
        force = shape.force + rng.normal(0, std)
        steps.append(MeasuredStep(k, branch, natural - shape.chord, force, std, chord, chord_std, photo, 60.0 * k))
    told = length + rng.normal(0, camera.length)
    return MeasuredTest(told, camera.length, camera.scale, tuple(steps), axis_std=camera.common_axis), tuple(shapes)

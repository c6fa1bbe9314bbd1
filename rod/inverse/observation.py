"""From forces, displacements and photos to one whitened residual vector, and back to where its entries came from.

Rows, block by block: force samples of every hold; for every photo the photographed chord and the shape, compared by
position along the measured normal; one row for every nuisance parameter with prior knowledge. Each block is divided by
the root of its measured covariance, so every entry has unit variance where nothing is wrong.

The shape of one photo enters as its components along a smooth basis (generalised least squares, Legendre polynomials of
``s / L``): faster variation is no bent cable's and only serves to measure the noise (`noise.calibrate_photo_noise`).
The errors of the two bearing axes, which turn and shift the chord frame, are common to chord and shape of a photo and
part of the joint covariance.

Sign: residual = (data - model) / sigma.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from rod.array import Array
from rod.inverse.common_errors import CommonErrors, common_errors
from rod.inverse.force_noise import common_rounding, force_noise
from rod.inverse.noise import PhotoNoise, by_axes, section_covariance, smooth_basis
from rod.inverse.prediction import Prediction
from rod.measurement import MeasuredTest
from rod.midline import BLOCKS, LEAST_SECTIONS, NOWHERE, Midline, midline

HOLD_NOISE_LEVEL = 1e-3
"""Probability; holds have noise levels of their own only if equality is refuted at this level."""

COARSE_BLOCKS = 96
"""Block means of a photo for that few functions, four for each and more: noise and misfit are measured apart."""

SHAPE_FUNCTIONS = 20
"""Legendre polynomials a photo, which resolve a kink to L / 20, and seven photos stay a problem of 150 rows."""


@dataclass(frozen=True, eq=False)
class Row:
    """Where the entries of the residual vector come from; all arrays (N,).

    ``kind``: 0 force, 1 chord, 2 shape, 3 prior. ``step``: index of the step, -1 for priors.
    """

    kind: NDArray[np.int_]
    step: NDArray[np.int_]

    @property
    def count(self) -> int:
        """N."""
        return len(self.kind)

    @property
    def force(self) -> NDArray[np.bool_]:
        """Which rows (N,) are forces; the others are chords and shapes."""
        return np.asarray(self.kind == KINDS.index("force"))

    def of_photo(self, step: int) -> NDArray[np.int_]:
        """Positions of the rows of a step's photo: chord, then shape."""
        return np.flatnonzero(~self.force & (self.step == step))


FORCE_FLOOR = 5e-4
"""Of the largest force: repeatability of a load cell of class 0.05; below it digits repeat."""

CHORD_STD = 3e-5
"""Relative, of a photographed chord where the photo states none: 0.05 px of 1700."""

DISPLACEMENT_STD = 2e-6
"""Of one displacement of the log against the chord, m: spindle and last digit of a log in 0.001 mm."""

ZERO_STD = 2e-5
"""Of the zero of the displacement, m: who sets a dial or a spindle by eye or by the first force does so to a few
hundredths of a millimetre."""

KINDS = ("force", "chord", "shape", "prior")


@dataclass(frozen=True, eq=False)
class PhotoData:
    """One photo, ready to be compared.

    Attributes
    ----------
    step : int
        Index of the step.
    sections : Midline
    chord, chord_std : m
    stated_chord_std : m
        By the bearing axes alone, without the displacement's error.
    basis : (k, q)
        Smooth functions of the shape misfit.
    whiten : (1 + q, 1 + k)
        Acts on (chord residual, normal residuals).
    """

    step: int
    sections: Midline
    chord: float
    chord_std: float
    stated_chord_std: float
    basis: Array
    whiten: Array


@dataclass(frozen=True, eq=False)
class Observation:
    """All data of a test with their weights.

    Attributes
    ----------
    forces : tuple of (h,) N
        Samples by step.
    force_std : (n,) N
        Of one sample.
    force_freedom : int
        Samples behind ``force_std``; 0 if stated.
    force_own : tuple of float
        Freedom of each step's ``force_std``, where each has a level of its own; else empty.
    force_common : tuple of float
        Error (N) of each step that all its samples have alike (rounding, see `force_noise`).
    common : CommonErrors or None
        What all photos err alike.
    photos : tuple of PhotoData
    photo_noise : PhotoNoise
    rows : Row
        Without priors.
    added : (N,) or 0
        Whitened values added to the data: how simulated data are made of measured ones.
    """

    forces: tuple[Array, ...]
    force_std: Array
    force_freedom: int
    force_own: tuple[float, ...]
    force_common: tuple[float, ...]
    common: CommonErrors | None
    photos: tuple[PhotoData, ...]
    photo_noise: PhotoNoise
    rows: Row
    added: Array | float = 0.0

    def joined(self, values: Array) -> Array:
        """Rows (N, ...) whitened photo by photo -> whitened with the errors that photos share."""
        return values if self.common is None else self._with_photos(values, self.common.whitened)

    def separated(self, values: Array) -> Array:
        """The inverse of `joined`: rows (N, ...) whitened photo by photo."""
        return values if self.common is None else self._with_photos(values, self.common.undone)

    def _with_photos(self, values: Array, change: Callable[[Array], Array]) -> Array:
        own, out = np.concatenate([self.rows.of_photo(photo.step) for photo in self.photos]), np.array(values, float)
        out[own] = change(out[own])
        return out

    @cached_property
    def all_sections(self) -> Places:
        """Sections of all photos, one after the other."""
        parts = [photo.sections for photo in self.photos]
        ends = np.cumsum([0, *(len(part.s) for part in parts)])
        none = np.zeros(0)  # without photos
        return Places(
            step=np.repeat([photo.step for photo in self.photos], np.diff(ends)).astype(int),
            s=np.concatenate([none, *(part.s for part in parts)]),
            x=np.concatenate([none, *(part.x for part in parts)]),
            y=np.concatenate([none, *(part.y for part in parts)]),
            of_photo=tuple(slice(low, high) for low, high in pairwise(ends.tolist())),
        )


def observe(
    test: MeasuredTest,
    *,
    photo_noise: PhotoNoise | None = None,
    functions: int = SHAPE_FUNCTIONS,
    without_photos: frozenset[int] = frozenset(),
    without_forces: frozenset[int] = frozenset(),
) -> Observation:
    """Collect and weigh the data of a test.

    Parameters
    ----------
    test : MeasuredTest
    photo_noise : PhotoNoise or None
        Calibrated noise of the sections; as stated by the photos if None.
    functions : int
        Of the shapes that a photo is compared by.
    without_photos, without_forces : sets of int
        Indices of steps whose photo or force is not to be trusted.
    """
    noise = photo_noise or PhotoNoise()
    scale = max(abs(step.force) for step in test.steps)
    level = force_noise(test.steps, floor=FORCE_FLOOR * scale, distinct=HOLD_NOISE_LEVEL)
    forces, photos = [], []
    kind: list[Array] = []
    where: list[Array] = []
    for i, step in enumerate(test.steps):
        forces.append(step.samples[:0] if i in without_forces else step.samples)
        kind.append(np.zeros(len(forces[-1]), dtype=int))
        where.append(np.full(len(forces[-1]), i))
    for i, step in enumerate(test.steps):
        if step.chord is None or i in without_photos:
            continue
        photo = _photo_data(i, test, noise, functions)
        photos.append(photo)
        kind.append(np.r_[1, np.full(len(photo.whiten) - 1, 2)])
        where.append(np.full(len(photo.whiten), i))
    rows = Row(np.concatenate(kind).astype(int), np.concatenate(where).astype(int))
    alike = common_errors([photo.sections for photo in photos], [photo.whiten for photo in photos])
    rounding = tuple(common_rounding(test.steps, level.std).tolist())
    of_forces = level.std, level.freedom, level.own, rounding
    return Observation(tuple(forces), *of_forces, alike, tuple(photos), noise, rows)


def _photo_data(index: int, test: MeasuredTest, noise: PhotoNoise, functions: int) -> PhotoData:
    step = test.steps[index]
    assert step.chord is not None
    seen = step.shape is not None and step.shape.section_s.size >= LEAST_SECTIONS
    blocks = COARSE_BLOCKS if functions == SHAPE_FUNCTIONS else BLOCKS
    sections = midline(step.shape, blocks=blocks) if seen and step.shape is not None else NOWHERE
    basis = smooth_basis(sections.s, test.length, functions=min(functions, len(sections.s) // 2))
    stated = step.chord_std if step.chord_std is not None else CHORD_STD * step.chord
    unseen = test.length if step.chord_by_log else 0.0
    whiten = _whitening(step.chord, stated, unseen, sections, basis, noise)
    whole = float(np.hypot(stated, DISPLACEMENT_STD))
    return PhotoData(index, sections, step.chord, whole, stated, basis, whiten)


def _whitening(
    chord: float,
    chord_std: float,
    unseen: float,
    sections: Midline,
    basis: Array,
    noise: PhotoNoise,
) -> Array:
    """Root of the information of (chord, shape components): rows have unit variance and compress the sections.

    With joint covariance C = L L^T of (chord, sections) and design B = diag(1, basis): L^-1 B = Q R, and ``Q^T L^-1``
    takes residuals to components of unit variance. ``unseen`` (m): standard deviation of a chord that no photo shows.
    """
    axis = chord_std / np.sqrt(2.0)
    by_axis = by_axes(sections, chord)
    joint = np.zeros((1 + len(sections.s), 1 + len(sections.s)))
    joint[1:, 1:] = section_covariance(sections, factor=noise.factor, stretch=noise.stretch)
    joint[0, 0] = DISPLACEMENT_STD**2 + unseen**2
    joint += axis**2 * by_axis @ by_axis.T
    design = linalg.block_diag(np.ones((1, 1)), basis)
    # by orthogonal factors: the polynomials of a cable seen in part are nearly dependent, and squaring them loses that
    root = linalg.cholesky(joint, lower=True)
    orthogonal, _ = linalg.qr(linalg.solve_triangular(root, design, lower=True), mode="economic")
    return np.asarray(linalg.solve_triangular(root, orthogonal, lower=True, trans="T").T)


def residual(observation: Observation, prediction: Prediction) -> Array:
    """Whitened residual (N,) without priors, rows as in ``observation.rows``."""
    holds = zip(observation.forces, prediction.samples, observation.force_std, observation.force_common, strict=True)
    parts = [of_hold((data - model[: len(data)]) / std, alike / std) for data, model, std, alike in holds]
    sections = observation.all_sections
    across = _distance(sections, prediction)
    for photo, own in zip(observation.photos, sections.of_photo, strict=True):
        parts.append(photo.whiten @ np.concatenate(([photo.chord - prediction.chord[photo.step]], across[own])))
    return np.asarray(observation.joined(np.concatenate(parts)) + observation.added)


def of_hold(off: Array, common: float) -> Array:
    """Whitened residuals (h, ...) of a hold whose samples, of unit scatter each, share an error of ``common``.

    The covariance is 1 + common^2 11^T, and the inverse of its root takes something off their mean.
    """
    if not common > 0.0 or not off.size:
        return off
    return np.asarray(off - (1.0 - 1.0 / np.sqrt(1.0 + len(off) * common**2)) * off.mean(axis=0))


def normal_distance(sections: Midline, prediction: Prediction, step: int) -> Array:
    """Distance (k,) m of the sections from the predicted curve, positive along its normal."""
    steps = np.full(len(sections.s), step)
    return _distance(Places(steps, sections.s, sections.x, sections.y, ()), prediction)


@dataclass(frozen=True, eq=False)
class Places:
    """Where sections of several photos lie, one after the other; all arrays (k,); ``of_photo``: which are whose."""

    step: NDArray[np.int_]
    s: Array
    x: Array
    y: Array
    of_photo: tuple[slice, ...]


def _distance(places: Places, prediction: Prediction) -> Array:
    """Distance (k,) m from the predicted curves, of all photos at once."""
    foot = foot_points(places, prediction)
    return np.asarray(np.cos(foot.direction) * foot.gap_y - np.sin(foot.direction) * foot.gap_x)


class Foot(NamedTuple):
    """Foot points (k,) of sections on the predicted curves.

    Node to the ``left``, ``width`` (m) from there to the next, share ``t`` of that; ``direction`` (rad) of the curve,
    and the way (m) from it to the section, whose part along the curve is zero but for rounding.
    """

    left: NDArray[np.int_]
    width: Array
    t: Array
    direction: Array
    gap_x: Array
    gap_y: Array


@lru_cache(maxsize=2)
def foot_points(places: Places, prediction: Prediction) -> Foot:
    """Foot points on curves that are cubic (Hermite, from positions and directions) between their nodes.

    Remembered, since the columns of a model follow its residual.

    They are found by two Newton steps from the section's own arc length; what is left along the curve enters the
    distance by its square only.
    """
    at, step, s = places.s, places.step, prediction.s
    for _ in range(3):
        left = np.minimum(np.maximum(np.searchsorted(s, at, side="right") - 1, 0), len(s) - 2)
        start, node = s[left], (step, left)
        width = s[left + 1] - start
        t = (at - start) / width
        rest = 1.0 - t
        a, b, x0, y0 = prediction.theta[node], prediction.theta[step, left + 1], prediction.x[node], prediction.y[node]
        h1, h2, h3 = t * t * (3.0 - 2.0 * t), t * rest * rest * width, -t * t * rest * width
        gap_x = places.x - (x0 + (prediction.x[step, left + 1] - x0) * h1 + np.cos(a) * h2 + np.cos(b) * h3)
        gap_y = places.y - (y0 + (prediction.y[step, left + 1] - y0) * h1 + np.sin(a) * h2 + np.sin(b) * h3)
        direction = a + (b - a) * t
        at = at + np.cos(direction) * gap_x + np.sin(direction) * gap_y
    return Foot(left, width, t, direction, gap_x, gap_y)

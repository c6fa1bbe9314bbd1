"""Midlines that scatter from photo to photo more than their sections tell: a noise, and no misfit of a cable.

What is fast along the cable tells how large the noise of a photo is, and badly how slow it is: errors of light, texture
or compression that last over a tenth of the cable are in no fast part, and in the width only if the edges do not share
them. Whatever is wrong with cable, rig or camera has a pattern along the cable, or a few, which grow or come and go
from photo to photo. So where nothing explains the shapes, the table of their whitened residuals, photo by function, is
cleared of its patterns. If what is left then is more than noise it is waves, as those that the ground makes
(`rod.measurement.MeasuredShape`), of the size and length that are likeliest, and the diagnosis is made again with them.

Code: ``photo/scatter``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from pipeline.diagnosis.fits.faults import Faults
from pipeline.diagnosis.fits.fit import Fit
from pipeline.diagnosis.fits.workbench import Workbench, prepare
from pipeline.records import Finding
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.measurement import MeasuredShape, slow_covariance

Array = NDArray[np.float64]

LEAST_PHOTOS = 5
"""Three more than the most patterns there may be."""

BENDS = 4
"""Functions along the cable, the slowest first, that law and K0 take most of: nothing is told by what they leave."""

MOST_PATTERNS = 2
"""What has more is no noise: two causes at once, or one that turns into another."""

DOUBTFUL, SURE = 0.2, 0.01
"""Probability of a strongest pattern as strong in noise: where it is asked whether there is more than noise beside the
patterns, so that no misfit is taken for noise; and where it is asked how much, since waves look like patterns, too."""

RARE = 0.02
"""Probability of as much beside the patterns by noise as told; this is asked only of what is unexplained else."""

LARGEST = 3.0
"""Variance over the stated one: more is no noise that was misjudged."""

LENGTHS = np.geomspace(0.01, 0.06, 7)
"""Of the cable's length: correlation lengths tried, from what the fastest function resolves to the slowest one."""


def with_scattered_photos(
    faults: Faults, bench: Workbench, fitted: Fit, settings: DiagnosisSettings
) -> tuple[Faults, Workbench] | None:
    """The test with photos as noisy as they scatter about a fitted model, and its base model.

    Parameters
    ----------
    faults : Faults
    bench : Workbench
    fitted : Fit
        What was concluded, or the base model.
    settings : DiagnosisSettings

    Returns
    -------
    (Faults, Workbench) or None
        With the finding ``photo/scatter``; None where they scatter as they tell, or along patterns.
    """
    found = waves_of_midlines(_shapes(bench, fitted), settings)
    if found is None:
        return None
    std, length = found
    message = (
        f"the midlines of the photos scatter in waves by {1e6 * std:.1f} um, more than their sections tell, from photo "
        "to photo and without a pattern that a cable, a rig or a camera could make; the diagnosis allowed for that"
    )
    steps = tuple(
        step if step.shape is None else replace(step, shape=_with_waves(step.shape, std, length))
        for step in faults.test.steps
    )
    told = replace(
        faults,
        test=replace(faults.test, steps=steps),
        findings=(*faults.findings, Finding("photo/scatter", "warning", message)),
    )
    again = prepare(told, settings, knots=len(bench.base.extension.base.knots))
    return None if isinstance(again, str) else (told, again)


def _with_waves(shape: MeasuredShape, std: float, length: float) -> MeasuredShape:
    """The shape with these waves, or with its own where they are larger."""
    return shape if shape.wave_std >= std else replace(shape, wave_std=std, wave_length=length)


@dataclass(frozen=True, eq=False)
class Shapes:
    """Whitened residuals of the shapes, without the slowest functions.

    Attributes
    ----------
    table : (n, q)
        Photos, functions.
    waves : (lengths, n, q) 1/m^2
        Variance that waves of unit variance would add to each.
    lengths : (lengths,) m
    """

    table: Array
    waves: Array
    lengths: Array


def waves_of_midlines(shapes: Shapes, settings: DiagnosisSettings) -> tuple[float, float] | None:
    """Standard deviation and length (m) of waves that the table shows; None where it is a pattern, or noise as told.

    Parameters
    ----------
    shapes : Shapes
    settings : DiagnosisSettings
    """
    table = shapes.table
    if len(table) < LEAST_PHOTOS or table.shape[1] <= len(table):
        return None
    nulls = _nulls(table.shape, settings.gain_draws, settings.seed)
    clear = next((k for k, null in enumerate(nulls) if not _stands_out(table, k, null, level=DOUBTFUL)), None)
    if clear is None or chdtrc(_freedom(table, clear), float(np.sum(_beside(table, clear) ** 2))) > RARE:
        return None
    for count, null in enumerate(nulls):
        rest = _beside(table, count)
        std, reach = _likeliest(replace(shapes, table=rest * np.sqrt(rest.size / _freedom(table, count))))
        white = table / np.sqrt(1.0 + std**2 * shapes.waves[reach])
        if not _stands_out(white, count, null, level=SURE):
            moderate = float(np.sum(rest**2)) <= LARGEST * _freedom(table, count)
            return (std, float(shapes.lengths[reach])) if moderate else None
    return None


def _likeliest(shapes: Shapes) -> tuple[float, int]:
    """Standard deviation (m) of the waves that a table of nothing else shows, and which of the lengths they have."""
    typical = shapes.waves.mean(axis=(1, 2))[None, :, None, None]
    variances = np.geomspace(0.01, 100.0, 60)[:, None, None, None] / typical
    total = 1.0 + variances * shapes.waves
    price = np.sum(np.log(total) + shapes.table**2 / total, axis=(2, 3))
    size, reach = np.unravel_index(int(np.argmin(price)), price.shape)
    return float(np.sqrt(variances[size, reach, 0, 0])), int(reach)


def _beside(table: Array, count: int) -> Array:
    """A table (n, q) without its ``count`` strongest patterns."""
    left, values, right = np.linalg.svd(table, full_matrices=False)
    return np.asarray((left[:, count:] * values[count:]) @ right[count:])


def _freedom(table: Array, count: int) -> int:
    """Free numbers of a table without so many patterns."""
    return int((table.shape[0] - count) * (table.shape[1] - count))


def _stands_out(table: Array, count: int, null: Array, *, level: float) -> bool:
    """Whether the next patterns of a table are stronger than those of noise, of any level, are seldom: one, or two."""
    found = _shares(np.asarray(np.linalg.svd(table, compute_uv=False))[None, count:])[0]
    return bool(np.any(np.mean(null >= found, axis=0) <= level))


@lru_cache(maxsize=8)
def _nulls(shape: tuple[int, ...], draws: int, seed: int) -> tuple[Array, ...]:
    """What `_patterns_of_noise` gives for each number of patterns: the same for all tables of a size."""
    rng = np.random.default_rng(seed)
    return tuple(_patterns_of_noise(shape, count, draws, rng) for count in range(MOST_PATTERNS + 1))


def _patterns_of_noise(shape: tuple[int, ...], count: int, draws: int, rng: np.random.Generator) -> Array:
    """What `_shares` are of noise (draws, 2), as large as a table without ``count`` patterns."""
    noise = rng.standard_normal((draws, shape[0] - count, shape[1] - count))
    return _shares(np.asarray(np.linalg.svd(noise, compute_uv=False)))


def _shares(values: Array) -> Array:
    """Share (n, 2) that the strongest, and the strongest two, of singular values (n, k) have of all."""
    square = values**2
    return np.asarray(np.cumsum(square, axis=1)[:, :2] / square.sum(axis=1)[:, None])


def _shapes(bench: Workbench, fitted: Fit) -> Shapes:
    """Residuals of a fitted model at the photos."""
    observation, length = bench.observation, bench.facts.length
    lengths, first = LENGTHS * length, 1 + BENDS
    own = [fitted.residual[observation.rows.of_photo(photo.step)[first:]] for photo in observation.photos]
    count = min((len(values) for values in own), default=0)
    waves = np.zeros((len(lengths), len(own), count))
    for i, photo in enumerate(observation.photos):
        white = photo.whiten[first : first + count, 1:]
        for k, reach in enumerate(lengths):
            waves[k, i] = np.sum(white * (white @ slow_covariance(photo.sections.s, ((1.0, reach),))), axis=1)
    return Shapes(np.array([values[:count] for values in own]).reshape(len(own), count), waves, lengths)

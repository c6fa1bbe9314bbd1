"""Waves in the midline that the ground makes: how large and how long, from the widths of all photos of a series.

Edges on the grain of a wooden table, on lines or print move along the cable in waves far longer than the scatter of
neighbouring sections lasts, and far shorter than the light's error. The curve follows them like a bend, so no residual
shows them; but they are in the width as well, which no bend of the cable changes: the errors ``a`` and ``b`` of two
edges move the midline by ``(a + b) / 2`` and half the width by ``(a - b) / 2``.

Half the width of every photo is split into Legendre polynomials of s, orthonormal over its sections. What its scatter
puts on each is known; the waves add ``std^2 exp(-ds^2 / (2 length^2))``, whose std and length are the likeliest over
all photos together: one photo has some 25 such components, which alone tell a variance to a third. Where the likelihood
gains no more than chance does there are none (`pipeline.settings.vision.centerline.CurveSettings.least_wave_gain`).

Some waves every photo has: grid of the pixels, demosaicing, tone curve. They are no larger than a hundredth of a pixel
(`least_wave_px`), and on sharp photos no scatter hides them: midlines traced to 0.01 px, with 0.015 px of scatter in a
section, were told to misfit a true simulation in two of 23 specimens.

On a wooden table (grain of 3 % of white, 5 to 7 px/mm) both midline and half width have two to three times the variance
of their scatter in waves of a twentieth to a fifth of the length. Without them, simulations of cables that nothing was
wrong with were told to misfit.

``half widths of the sections on every photo -> std and length of the waves``
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.records import Array
from pipeline.settings.vision.centerline import CurveSettings
from pipeline.vision.median import median

_HIGHEST = 30
"""Degree of the finest polynomial: waves of a fifteenth of the length, which a curve through the points can follow."""

_LENGTHS = np.geomspace(0.01, 0.06, 7)
"""Of the seen length, correlation lengths tried: from what the finest polynomial resolves to what the coarsest does."""

_USUAL = 0.04
"""Of the seen length, correlation length of a photo's own waves: in the middle of those tried."""

_PLACES = 240
"""Of an even grid on which the waves' share in each polynomial is computed."""


@dataclass(frozen=True)
class HalfWidths:
    """Half the width of the cable along one photo, without its median.

    Attributes
    ----------
    s, half, std : (n,) m
        Arc length, the share of half the width's error that is the midline's, and the scatter of a section.
    correlation_length : m
        Of that scatter.
    """

    s: Array
    half: Array
    std: Array
    correlation_length: float


def edge_waves(photos: Sequence[HalfWidths], settings: CurveSettings, *, metres_per_px: float) -> tuple[float, float]:
    """Standard deviation and correlation length (m) of the waves, not smaller than a photo's own.

    Parameters
    ----------
    photos, settings
        As in `ground_waves`.
    metres_per_px : m
    """
    if not photos:
        return 0.0, 0.0
    std, length = ground_waves(photos, settings)
    reach = median(np.array([np.ptp(photo.s) for photo in photos]))
    return float(np.hypot(std, settings.least_wave_px * metres_per_px)), length or _USUAL * reach


def ground_waves(photos: Sequence[HalfWidths], settings: CurveSettings) -> tuple[float, float]:
    """Standard deviation and correlation length (m) of what the ground adds; zeros where the widths show none.

    Parameters
    ----------
    photos : sequence of HalfWidths
        Of one cable on one ground; those with too few sections tell nothing.
    settings : CurveSettings
    """
    told = [photo for photo in photos if len(photo.s) >= 3 * _HIGHEST]
    if not told:
        return 0.0, 0.0
    coarsest = settings.slow_width_order + 1
    found = np.array([_components(photo)[:, coarsest:] for photo in told])  # (photos, 2, k)
    square, scatter = found[:, 0] ** 2, found[:, 1]
    shares = _shares()[:, coarsest:]
    counts = np.array([len(photo.s) for photo in told])
    # of the waves' variance: nothing, then all up to what would be the whole of the widths' own
    largest = float(np.mean(square.sum(axis=1) / counts))
    variances = np.r_[0.0, largest * np.geomspace(1e-3, 10.0, 60)]
    added = variances[:, None, None, None] * counts[None, None, :, None] * shares[None, :, None, :]
    total = scatter + added  # (variances, lengths, photos, k)
    value = np.sum(np.log(total) + square / total, axis=(2, 3))
    best = np.unravel_index(int(np.argmin(value)), value.shape)
    if value[0, 0] - value[best] < settings.least_wave_gain:
        return 0.0, 0.0
    reach = median(np.array([np.ptp(photo.s) for photo in told]))
    return float(np.sqrt(variances[best[0]])), float(_LENGTHS[best[1]] * reach)


def _components(photo: HalfWidths) -> Array:
    """Components of half the width along the polynomials, and what the scatter alone puts there (variance): (2, k)."""
    basis = _polynomials(2.0 * (photo.s - photo.s[0]) / np.ptp(photo.s) - 1.0)
    spread = 1.4826 * median(np.abs(photo.half))
    half = np.clip(photo.half, -4.0 * spread, 4.0 * spread)  # a speck on one edge is no wave
    return np.array([basis.T @ half, _scatter(basis * photo.std[:, None], photo.s, photo.correlation_length)])


def _scatter(rows: Array, s: Array, length: float) -> Array:
    """Diagonal (k,) of ``rows' C rows``, rows (n, k), C exponential along s (n,): a Markov sum, no (n, n) matrix."""
    decay = np.exp(-np.diff(s) / length) if length > 0.0 else np.zeros(len(s) - 1)
    before, total = np.zeros(rows.shape[1]), np.sum(rows**2, axis=0)
    for row, following, kept in zip(rows[:-1], rows[1:], decay, strict=True):
        before = kept * (before + row)
        total += 2.0 * following * before
    return np.asarray(total)


def _shares() -> Array:
    """What waves of unit variance put on each polynomial, per section: (lengths, k)."""
    t = np.linspace(-1.0, 1.0, _PLACES)
    basis = _polynomials(t)
    apart = 0.5 * np.subtract.outer(t, t)
    waves = [np.exp(-0.5 * (apart / length) ** 2) for length in _LENGTHS]
    return np.array([np.sum(basis * (wave @ basis), axis=0) for wave in waves]) / _PLACES


def _polynomials(t: Array) -> Array:
    """Legendre polynomials (n, k) of places in [-1, 1], orthonormal over them."""
    return np.asarray(np.linalg.qr(np.polynomial.legendre.legvander(t, _HIGHEST))[0])

"""Waves in the midline that ground and sheath make: how large and how long, from the widths of all photos of a series.

Edges on the grain of a wooden table, on lines or print move along the cable in waves far longer than the scatter of
neighbouring sections lasts, and far shorter than the light's error. The curve follows them like a bend, so no residual
shows them; but they are in the width as well, which no bend of the cable changes: the errors ``a`` and ``b`` of two
edges move the midline by ``(a + b) / 2`` and half the width by ``(a - b) / 2``.

What is printed on the sheath or mottles it is in the same place of the cable on all photos, as is the ground below the
end that stands still: their waves are *common*, and eight photos average nothing of them. Those of the ground farther
in change from photo to photo: they are each photo's *own*.

Half the width of every photo is split into Legendre polynomials of s, orthonormal over its sections. What its scatter
puts on each is known; the waves add ``std^2 exp(-ds^2 / (2 length^2))``, own and common, whose sizes and length are the
likeliest over all photos together: one photo has some 25 such components, which alone tell a variance to a third. Where
the likelihood gains no more than chance does there are none (`_LEAST_WAVE_GAIN`).

Some waves every photo has: grid of the pixels, demosaicing, tone curve. They are no larger than a hundredth of a pixel
(`_LEAST_WAVE_PX`), and on sharp photos no scatter hides them: midlines traced to 0.01 px, with 0.015 px of scatter in a
section, were told to misfit a true simulation in two of 23 specimens. Half as much is common.

``half widths of the sections on every photo -> std of own and common waves, and their length``
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.records import Array
from pipeline.vision.median import median, scatter

_SLOW_WIDTH_ORDER = 5  # of the polynomial of s that the width may follow by light, lens and distance of the camera
_HIGHEST = 30
"""Degree of the finest polynomial: waves of a fifteenth of the length, which a curve through the points can follow."""

_LENGTHS = np.geomspace(0.01, 0.06, 7)
"""Of the seen length, correlation lengths tried: from what the finest polynomial resolves to what the coarsest does."""

_LEAST_WAVE_PX = 0.01
"""Px; waves in a midline that no width need show: grid of pixels, demosaicing, tone curve; of this size they are on
photos of even light and little noise.
"""
_LEAST_WAVE_GAIN = 7.8
"""-2 log likelihood that waves in the widths must gain: three parameters gain as much by chance once in twenty series
at most.
"""


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


@dataclass(frozen=True)
class Waves:
    """Standard deviations (m) of a photo's own waves and of those common to all, and their correlation length (m)."""

    own: float = 0.0
    common: float = 0.0
    length: float = 0.0


def edge_waves(photos: Sequence[HalfWidths], *, metres_per_px: float) -> Waves:
    """The waves, not smaller than those that every photo has.

    Parameters
    ----------
    photos
        As in `seen_waves`.
    metres_per_px : m
    """
    photos = [photo for photo in photos if photo.s.size]  # one on which each section lives on one edge tells nothing
    if not photos:
        return Waves()
    seen, least = seen_waves(photos), _LEAST_WAVE_PX * metres_per_px
    reach = median(np.array([np.ptp(photo.s) for photo in photos]))
    own, common = np.hypot(seen.own, least), np.hypot(seen.common, 0.5 * least)
    return Waves(float(own), float(common), seen.length or 0.04 * reach)  # in the middle of those tried


def seen_waves(photos: Sequence[HalfWidths]) -> Waves:
    """What the widths show of waves; none where they show none.

    Parameters
    ----------
    photos : sequence of HalfWidths
        Of one cable on one ground; those with too few sections tell nothing.
    """
    told = [photo for photo in photos if len(photo.s) >= 3 * _HIGHEST]
    if not told:
        return Waves()
    coarsest = _SLOW_WIDTH_ORDER + 1
    found = np.array([_components(photo)[:, coarsest:] for photo in told])  # (photos, 2, k)
    counts = np.array([len(photo.s) for photo in told], float)
    # of the waves' variances: nothing, then all up to what would be the whole of the widths' own, by factors of 1.27
    largest = float(np.mean(np.sum(found[:, 0] ** 2, axis=1) / counts))
    variances = np.r_[0.0, largest * np.geomspace(1e-3, 10.0, 40)]
    value = np.array([_surprise(found, counts, share, variances) for share in _shares()[:, coarsest:]])
    length, own, common = np.unravel_index(int(np.argmin(value)), value.shape)
    if value[0, 0, 0] - value[length, own, common] < _LEAST_WAVE_GAIN:
        return Waves()
    reach = median(np.array([np.ptp(photo.s) for photo in told]))
    std = np.sqrt(variances)
    return Waves(float(std[own]), float(std[common]), float(_LENGTHS[length] * reach))


def _surprise(found: Array, counts: Array, share: Array, variances: Array) -> Array:
    """-2 log likelihood (v, v) of own and common waves of these variances; the polynomials count as independent.

    Parameters
    ----------
    found : (photos, 2, k)
        Components of half the width, and what scatter alone puts there.
    counts : (photos,)
        Sections; a component of common waves grows with their root.
    share : (k,)
        What waves of unit variance put on each polynomial, per section.
    """
    scatter = found[:, 1] + variances[:, None, None] * counts[:, None] * share  # (v, photos, k)
    component, root = found[:, 0], np.sqrt(counts)[:, None]
    alone = np.sum(np.log(scatter) + component**2 / scatter, axis=(1, 2))
    weight, alike = np.sum(root**2 / scatter, axis=1), np.sum(root * component / scatter, axis=1)  # (v, k)
    added = variances[:, None] * share  # (v, k)
    grown = 1.0 + added * weight[:, None]  # (v, v, k)
    return np.asarray(alone[:, None] + np.sum(np.log(grown) - added * alike[:, None] ** 2 / grown, axis=2))


def _components(photo: HalfWidths) -> Array:
    """Components of half the width along the polynomials, and what the scatter alone puts there (variance): (2, k)."""
    basis = _polynomials(2.0 * (photo.s - photo.s[0]) / np.ptp(photo.s) - 1.0)
    spread = scatter(photo.half, 0.0)
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
    t = np.linspace(-1.0, 1.0, 240)
    basis = _polynomials(t)
    apart = 0.5 * np.subtract.outer(t, t)
    waves = [np.exp(-0.5 * (apart / length) ** 2) for length in _LENGTHS]
    return np.array([np.sum(basis * (wave @ basis), axis=0) for wave in waves]) / len(t)


def _polynomials(t: Array) -> Array:
    """Legendre polynomials (n, k) of places in [-1, 1], orthonormal over them."""
    return np.asarray(np.linalg.qr(np.polynomial.legendre.legvander(t, _HIGHEST))[0])

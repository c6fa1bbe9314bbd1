"""The profile of an edge across the sheath's border: blur, shading inside, soft shadow outside, sub-pixel place.

    I(t) = a + A Phi(z) + b_in R_in(t) + b_out R_out(t),   z = (t - t0) / w,   t outward, the sheath dark
    R_out = w (z Phi(z) + phi(z)) = (t - t0)+ blurred,     R_in = -w (phi(z) - z Phi(-z)) = -(t0 - t)+ blurred

`fit_profiles` finds all six numbers in windows with hundreds of pixels, `fit_edges` only ``t0, a, A`` for each section,
with blur and relative slopes of its window: six free numbers a section would cost three times the scatter.

The place depends on what is taken for shading and what for blur. The difference between the place with and without
ramps is kept: it is the scale of the error that no averaging removes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import ndtr

from pipeline.records import Array
from pipeline.vision.median import MAD_TO_STD, SURE_SIGMAS, median, medians, quantile

Float32 = NDArray[np.float32]
Real = TypeVar("Real", Array, Float32)

_BIN = 0.25  # px; pixels are pooled at this width of offset: widens the blur by 0.4 % at 0.8 px
_MIN_BLUR = 0.30  # px; the pixel's own box is 0.29
_PIXEL_OUTLIER = 4.0
"""Standard deviations from the profile of the neighbourhood: letters, dirt; Gaussian noise passes it once in 16,000; at
1.5 times it a pixel of a section has no weight.
"""
_PLAIN_STEP = 0.1  # of the edge's step; differences up to it are texture or slow light, not letters
_LEAST_PIXEL_SHARE = 0.5  # weight left on a section's pixels; with less there is something else than an edge
_USUAL_RAMP = 0.07
"""Of the step in one blur; a ramp so steep must explain as much of the pixels as their scatter is, else it is taken for
halo, grid and texture: of thin cables, whose few pixels do not tell them apart, free ramps moved the midline by a third
more.
"""


@dataclass(frozen=True)
class Pixels:
    """Pixels about both edges.

    Attributes
    ----------
    offset : (2, n, m) px
        From the expected edge, positive outward; side, section, pixel.
    value : (2, n, m) grey
    across : int
        Pixels of one row; m is a multiple of it, rows follow each other.
    """

    offset: Float32
    value: Float32
    across: int


@dataclass(frozen=True)
class Profiles:
    """Edge profiles of both sides in ``k`` windows along s.

    Attributes
    ----------
    s : (k,)
        Centre of the window.
    place, blur, level, step, inside, outside : (2, k)
        t0 and w in px; a and A in grey; b_in / A and b_out / A in 1/px.
    shift : (2, k) px
        Place with ramps as they fit best, less the place by the plain error function.
    noise : (2, k) grey
        Scatter of pixels about the profile.
    held : float
        Share of the shift that is not in ``place``, for ramps were held.
    """

    s: Array
    place: Array
    blur: Array
    level: Array
    step: Array
    inside: Array
    outside: Array
    shift: Array
    noise: Array
    held: float

    def at(self, s: Array, name: str) -> Array:
        """A quantity by name at ``s``, linear between windows: ``(2, n)``."""
        return np.stack([np.interp(s, self.s, side) for side in getattr(self, name)])


def profile(offset: Real, place: Real, blur: Real) -> tuple[Real, Real, Real, Real]:
    """Blurred step, inside ramp, outside ramp and density ``phi(z) / w`` at offsets; broadcasts."""
    z = (offset - place) / blur
    cumulative = ndtr(z)
    density = np.exp(-0.5 * z * z) * z.dtype.type(1.0 / np.sqrt(2.0 * np.pi))
    outside = blur * (z * cumulative + density)
    inside = outside - blur * z  # minus the blurred (t0 - t)+ is -(out - w z)
    return cumulative, -inside, outside, density / blur


def _shaded(offset: Real, place: Real, blur: Real, step: Real, ramps: tuple[Real, Real]) -> tuple[Real, Real]:
    """``A Phi + b_in R_in + b_out R_out`` and its slope in t; ``ramps`` are ``b_in`` and ``b_out``."""
    shape, inside, outside, density = profile(offset, place, blur)
    value = step * shape + ramps[0] * inside + ramps[1] * outside
    return value, step * density + ramps[0] + (ramps[1] - ramps[0]) * shape


def in_one_light(pixels: Pixels) -> tuple[Pixels, Array, Array]:
    """Pixels with level and step of all sections alike: strands of several colours have one profile.

    Their values are ``zero + gain * value``, with zero and gain ``(2, n)``.
    """
    each, shape = max(1, pixels.across // 4), pixels.value.shape
    rows = pixels.value.reshape(*shape[:2], -1, pixels.across)
    inner, outer = (medians(part.reshape(*shape[:2], -1), axis=2) for part in (rows[..., :each], rows[..., -each:]))
    usual = median(outer - inner)
    gain = usual / np.maximum(outer - inner, 0.1 * usual)  # a section of less is mostly noise
    zero = median(outer) - gain * outer
    alike = np.asarray(zero[..., None] + gain[..., None] * pixels.value, np.float32)
    return replace(pixels, value=alike), zero, gain


def fit_profiles(pixels: Pixels, s: Array, *, blur: float) -> Profiles:
    """Profiles in windows of neighbouring sections, their ramps held to what lasts along a side.

    Medians over the rows come first: letters cover less than half of any line along the cable, and a mean would take
    them for the sheath.
    """
    count = min(16, max(1, len(s) // 4))  # light turns slowly
    each = len(s) // count
    # Windows of one size make one array of all; at most one section of each window is passed over for it.
    chosen = ((np.arange(count * each) + 0.5) * (len(s) / (count * each))).astype(np.int64)
    offset, value = (a[:, chosen].reshape(2 * count, -1) for a in (pixels.offset, pixels.value))
    low = np.floor(offset.min() / _BIN)
    bins = int(offset.max() / _BIN - low) + 1
    cell = np.floor(offset / _BIN - low).astype(np.int64) + bins * np.arange(2 * count)[:, None]
    rows = (2 * count, -1, pixels.across)
    middle = medians(value.reshape(rows), axis=1).astype(np.float64)
    pooled = _Pooled(offset.reshape(rows).mean(axis=1, dtype=np.float64), middle, np.ones_like(middle))
    start = np.column_stack([np.zeros(2 * count), np.full(2 * count, blur)])
    for _ in range(2):
        start, linear = _variable_projection(pooled, start, ramps=True)
        # Pixels are judged by the profile of the neighbourhood: light turns slowly, and letters fill some windows only.
        usual = _running_median(np.column_stack([start[:, 1], linear]))
        residual = _misfit(offset, value, np.column_stack([start[:, 0], usual]))
        # every fourth pixel tells the usual scatter to a percent
        noise = median(_scatter(residual[:, ::4]))
        cost = (noise / np.maximum(_USUAL_RAMP * np.abs(usual[:, 2]), 1e-9)) ** 2
        limit = np.maximum(_PIXEL_OUTLIER * noise, _PLAIN_STEP * usual[:, 2:3])
        keep = residual < limit
        # A window that contradicts its neighbourhood as a whole is judged by itself: nothing of it would be left.
        keep |= (keep.mean(axis=1) < _LEAST_PIXEL_SHARE)[:, None]
        pooled = _pool(offset, value, cell, keep, (2 * count, bins))
    full, full_linear = _variable_projection(pooled, start, ramps=True)
    plain, _ = _variable_projection(pooled, full, ramps=False)
    shift = full[:, 0] - plain[:, 0]

    used, linear = _variable_projection(pooled, full, ramps=True, cost=cost, about=_lasting(full_linear))
    step = np.where(linear[:, 1] == 0.0, np.nan, linear[:, 1])[:, None]
    shape = _running_median(np.column_stack([used[:, 1], linear[:, :2], linear[:, 2:] / step]))
    by_side = shape.T.reshape(5, 2, count)
    left = _scatter(_misfit(offset, value, np.column_stack([used, linear])))
    return Profiles(
        s=s[chosen].reshape(count, each).mean(axis=1),
        place=used[:, 0].reshape(2, count),
        blur=by_side[0],
        level=by_side[1],
        step=by_side[2],
        inside=by_side[3],
        outside=by_side[4],
        shift=shift.reshape(2, count),
        noise=left.reshape(2, count),
        held=min(1.0, float(np.linalg.norm(full[:, 0] - used[:, 0]) / (np.linalg.norm(shift) + 1e-12))),
    )


def _misfit(offset: Float32, value: Float32, profiles: Array) -> Float32:
    """Absolute residuals of pixels ``(k, m)`` for profiles ``(k, 6)``: place, blur, level, step and ramps."""
    place, blur, level, step, inside, outside = (a[:, None].astype(np.float32) for a in profiles.T)
    shape, _ = _shaded(offset, place, blur, step, (inside, outside))
    return np.asarray(np.abs(shape + level - value), np.float32)


def _scatter(residual: Float32) -> Array:
    """Robust standard deviation of each row of absolute residuals."""
    return MAD_TO_STD * medians(residual, axis=1).astype(np.float64)


@dataclass(frozen=True)
class _Pooled:
    """Mean offset and value of the pixels in bins of the offset, and their number; ``(windows, bins)``."""

    offset: Array
    value: Array
    count: Array


def _running_median(values: Array) -> Array:
    """Median over five neighbouring windows of one side, of each column; rows are the windows of both sides."""
    sides = values.reshape(2, -1, values.shape[1])
    size = (1, min(5, sides.shape[1]), 1)
    return np.asarray(median_filter(sides, size=size, mode="nearest")).reshape(values.shape)


def _lasting(linear: Array) -> Array:
    """Ramps of windows ``(k, 4)``, their levels and steps aside, as far as all windows of a side have them.

    Halo, grid and texture make ramps that differ from window to window, shade and the rim of a shadow last along a
    side: its mean, less the part by which its own scatter would make one (James and Stein).
    """
    sides = linear.reshape(2, -1, 4)
    mean = medians(sides, axis=1)
    chance = MAD_TO_STD * medians(np.abs(sides - mean[:, None]), axis=1) / np.sqrt(sides.shape[1])
    lasting = mean * np.maximum(1.0 - (chance / np.where(mean == 0.0, np.inf, mean)) ** 2, 0.0)
    return np.repeat(lasting, sides.shape[1], axis=0)


def _pool(
    offset: Float32, value: Float32, cell: NDArray[np.int64], keep: NDArray[np.bool_], shape: tuple[int, int]
) -> _Pooled:
    size = shape[0] * shape[1]
    count, by_offset, by_value = (
        np.bincount(cell.ravel(), (keep * weight).ravel(), size).reshape(shape).astype(np.float64)
        for weight in (1.0, offset, value)
    )
    filled = np.maximum(count, 1.0)
    return _Pooled(by_offset / filled, by_value / filled, count)


def _variable_projection(
    pooled: _Pooled, start: Array, *, ramps: bool, cost: Array | float = 0.0, about: Array | float = 0.0
) -> tuple[Array, Array]:
    """Place and blur ``(k, 2)``, and level, step and ramps ``(k, 4)``, of pooled profiles, all windows at once.

    Gauss-Newton on place and blur alone: the other four are solved for exactly at each step (Golub and Pereyra, in
    Kaufman's form). Steps are bounded to a part of the blur. ``cost`` is the mean square misfit of the pixels that a
    ramp of 1 in a blur beyond ``about`` (k, 4), of which only ramps count, counts for.
    """
    place, blur = start[:, 0].copy(), start[:, 1].copy()
    offset, root = pooled.offset, np.sqrt(pooled.count)[:, None, :]
    value = pooled.value[:, None, :] * root
    total = np.maximum(pooled.count.sum(axis=1), 1.0)
    low, high = offset.min(axis=1), offset.max(axis=1)
    span = np.maximum(high - low, 1.0)
    linear = np.zeros((len(place), 4))
    # A weak prior on the ramps, a thousandth of the data's weight: it decides only where blur and ramp look the same.
    prior = np.zeros((len(place), 4))
    prior[:, 2:] = (total * (1e-3 / 12.0 * (span / 2.0) ** 2 + cost * start[:, 1] ** 2))[:, None]
    expected = prior * about
    prior += 1e-9 * total[:, None]
    size = 4 if ramps else 2
    for _ in range(25):
        cumulative, inside, outside, density = profile(offset, place[:, None], blur[:, None])
        basis = np.stack([np.ones_like(offset), cumulative, inside, outside][:size], axis=1) * root
        turned = basis.transpose(0, 2, 1)
        inverse = np.linalg.inv(basis @ turned + prior[:, :size, None] * np.eye(size))
        linear[:, :size] = (inverse @ (basis @ value.transpose(0, 2, 1) + expected[:, :size, None]))[..., 0]
        residual = value - linear[:, None, :size] @ basis
        step, ramp_in, ramp_out = linear[:, 1:2], linear[:, 2:3], linear[:, 3:]
        by_place = -step * density - ramp_in - (ramp_out - ramp_in) * cumulative
        by_blur = (-step * (offset - place[:, None]) / blur[:, None] + (ramp_out - ramp_in) * blur[:, None]) * density
        tangent = np.stack([by_place, by_blur], axis=1) * root
        tangent -= ((tangent @ turned) @ inverse) @ basis
        normal = tangent @ tangent.transpose(0, 2, 1)
        normal += np.eye(2) * (1e-3 * np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-30)
        move = np.linalg.solve(normal, tangent @ residual.transpose(0, 2, 1))[..., 0]
        place = np.clip(place + np.clip(move[:, 0], -0.7 * blur, 0.7 * blur), low, high)
        blur = np.clip(blur + np.clip(move[:, 1], -0.3 * blur, 0.3 * blur), _MIN_BLUR, 0.5 * span)
        if np.max(np.abs(move)) < 3e-3:  # px; the next step would be far smaller
            break
    return np.column_stack([place, blur]), linear


@dataclass(frozen=True)
class Edges:
    """Sub-pixel edges ``(2, n)`` by side and section.

    Attributes
    ----------
    place, std : (2, n) px
        Offset from the expected edge, positive outward, NaN where there is no edge; its standard deviation.
    step : (2, n) grey
    """

    place: Array
    std: Array
    step: Array


def fit_edges(
    pixels: Pixels, s: Array, profiles: Profiles, *, zero: Array | float = 0.0, gain: Array | float = 1.0
) -> Edges:
    """Place, level and step of the edges on every section; blur and relative slopes come from the profiles.

    The profiles are those of values ``zero + gain * value``; see `in_one_light`.
    """
    shape, count = pixels.value.shape[:2], pixels.value.shape[2]
    offset, value = pixels.offset.reshape(-1, count), pixels.value.reshape(-1, count)
    place, level, step = (profiles.at(s, name) for name in ("place", "level", "step"))
    place, level, step = place.ravel(), ((level - zero) / gain).ravel(), (step / gain).ravel()
    blur, inside, outside = (
        profiles.at(s, name).reshape(-1, 1).astype(np.float32) for name in ("blur", "inside", "outside")
    )
    noise = np.repeat(medians(profiles.noise, axis=1), shape[1])
    softness = (1.0 / (1.5 * _PIXEL_OUTLIER * noise + 1e-12)).astype(np.float32)[:, None]
    basis, one = np.empty((len(value), 3, count), np.float32), np.ones((1, 1), np.float32)
    basis[:, 0] = 1.0
    gram, weight = np.zeros((len(value), 3, 3)), np.ones_like(value)
    for _ in range(5):
        place32, level32, step32 = (a.astype(np.float32)[:, None] for a in (place, level, step))
        basis[:, 1], slope = _shaded(offset, place32, blur, one, (inside, outside))
        basis[:, 2] = -step32 * slope
        residual = value - level32 - step32 * basis[:, 1]
        # Biweight with the scatter of the whole side: a section full of text must not raise its own limit.
        weight = np.maximum(1.0 - (residual * softness) ** 2, np.float32(0.0)) ** 2
        # The rim of a letter is neither sheath nor ink: a pixel counts no more than its neighbours across the edge.
        rows = weight.reshape(len(value), -1, pixels.across)
        rows[..., 1:-1] = np.minimum(rows[..., 1:-1], np.minimum(rows[..., 2:], rows[..., :-2]))
        weighted = basis * weight[:, None, :]
        gram = (weighted @ basis.transpose(0, 2, 1)).astype(np.float64)
        # Above the rounding of sums in single precision, so that no section of any picture is singular.
        gram += np.eye(3) * (1e-12 + 1e-6 * gram)
        move = np.linalg.solve(gram, (weighted @ residual[..., None]).astype(np.float64))[..., 0]
        level, step = level + move[:, 0], step + move[:, 1]
        shift = np.clip(move[:, 2], -blur[:, 0], blur[:, 0])
        place = place + shift
        # Newton squares what is left: 1e-4 px. The other two per cent are sections that will be outliers anyway.
        if quantile(np.abs(shift), 0.98) < 1e-2:
            break
    covariance = (noise**2)[:, None, None] * np.linalg.inv(gram)
    # What hides the cable has no edge, but noise has a step wherever it is sought, half of them upward: on paper that
    # hid 12 diameters, edges of noise along the search's straight bridge moved the midline by 30 px.
    faint = step < SURE_SIGMAS * np.sqrt(covariance[:, 1, 1])
    found = np.where((weight.sum(axis=1) < _LEAST_PIXEL_SHARE * count) | faint, np.nan, place)
    return Edges(found.reshape(shape), np.sqrt(covariance[:, 2, 2]).reshape(shape), step.reshape(shape))

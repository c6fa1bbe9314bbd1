"""The profile of an edge across the sheath's border: blur, shading inside, soft shadow outside, sub-pixel place.

    I(t) = a + A Phi(z) + b_in R_in(t) + b_out R_out(t),   z = (t - t0) / w,   t outward, the sheath dark
    R_out = w (z Phi(z) + phi(z)) = (t - t0)+ blurred,     R_in = -w (phi(z) - z Phi(-z)) = -(t0 - t)+ blurred

`fit_profiles` finds all six numbers in windows with hundreds of pixels, `fit_edges` only ``t0, a, A`` for each section,
with blur and relative slopes of its window: six free numbers a section would cost three times the scatter.

The place depends on what is taken for shading and what for blur. The difference between the place with and without
ramps is kept: it is the scale of the error that no averaging removes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from pipeline.records import Array

_BIN = 0.25  # px; pixels are pooled at this width of offset: widens the blur by 0.4 % at 0.8 px
_MIN_BLUR = 0.30  # px; the pixel's own box is 0.29


@dataclass(frozen=True)
class Pixels:
    """Pixels about one edge: sections ``(n, m)``, offsets from the expected edge, positive outward, and grey values."""

    offset: Array
    value: Array


@dataclass(frozen=True)
class Profiles:
    """Edge profiles in ``k`` windows along s.

    Attributes
    ----------
    s, place, blur, level, step, inside, outside : (k,)
        Centre of the window; t0 and w in px; a and A in grey; b_in / A and b_out / A in 1/px.
    plain : (k,) px
        Place by the plain error function, without ramps.
    noise : (k,) grey
        Scatter of pixels about the profile.
    """

    s: Array
    place: Array
    blur: Array
    level: Array
    step: Array
    inside: Array
    outside: Array
    plain: Array
    noise: Array

    def at(self, s: Array, name: str) -> Array:
        """A quantity by name at ``s``, linear between windows."""
        return np.asarray(np.interp(s, self.s, getattr(self, name)))


def profile(offset: Array, place: Array, blur: Array) -> tuple[Array, Array, Array, Array]:
    """Blurred step, inside ramp, outside ramp and density ``phi(z) / w`` at offsets; broadcasts."""
    z = (offset - place) / blur
    cumulative = ndtr(z)
    density = np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi)
    outside = blur * (z * cumulative + density)
    inside = outside - blur * z  # minus the blurred (t0 - t)+ is -(out - w z)
    return cumulative, -inside, outside, density / blur


def fit_profiles(pixels: Pixels, s: Array, *, windows: int, ramps: bool, blur: float) -> Profiles:
    """Profiles in windows of neighbouring sections."""
    count = min(windows, max(1, len(s) // 4))
    window = np.minimum((np.arange(len(s)) * count) // len(s), count - 1)
    centre = np.array([s[window == k].mean() for k in range(count)])
    low = np.floor(np.nanmin(pixels.offset) / _BIN)
    bins = int(np.ceil(np.nanmax(pixels.offset) / _BIN - low)) + 1
    cell = np.clip(np.floor(pixels.offset / _BIN - low).astype(np.int64), 0, bins - 1) + bins * window[:, None]
    keep = np.isfinite(pixels.value)
    start = np.tile([0.0, blur, 0.0, 0.0], (count, 1))
    full = start
    for _ in range(2):  # the second time without the pixels that contradict the profile (text, dirt)
        weight = np.bincount(cell[keep], minlength=count * bins).reshape(count, bins).astype(np.float64)
        filled = np.maximum(weight, 1.0)
        offset = np.bincount(cell[keep], pixels.offset[keep], count * bins).reshape(count, bins) / filled
        value = np.bincount(cell[keep], pixels.value[keep], count * bins).reshape(count, bins) / filled
        full, linear = _variable_projection(offset, value, weight, start, ramps=ramps)
        shape = np.stack(profile(pixels.offset, full[window, :1], full[window, 1:2])[:3], axis=-1)
        model = linear[window, :1] + np.einsum("nmk,nk->nm", shape, linear[window, 1:])
        residual = np.where(np.isfinite(pixels.value), pixels.value - model, np.nan)
        noise = np.array([1.4826 * np.nanmedian(np.abs(residual[window == k])) for k in range(count)])
        keep = np.isfinite(residual) & (np.abs(residual) < 4.0 * noise[window, None] + 1e-9)
        start = full
    plain = full[:, 0]
    if ramps:
        plain = _variable_projection(offset, value, weight, full * [1, 1, 0, 0], ramps=False)[0][:, 0]
    step = np.where(linear[:, 1] == 0.0, np.nan, linear[:, 1])
    return Profiles(
        centre,
        full[:, 0],
        full[:, 1],
        linear[:, 0],
        linear[:, 1],
        linear[:, 2] / step,
        linear[:, 3] / step,
        plain,
        noise,
    )


def _variable_projection(
    offset: Array, value: Array, weight: Array, start: Array, *, ramps: bool
) -> tuple[Array, Array]:
    """Place and blur ``(k, 2)`` and linear parts ``(k, 4)`` of binned profiles ``(k, b)``, all windows at once.

    Levenberg-Marquardt on (t0, log w, a, A, b_in, b_out); steps of place and blur are bounded.
    """
    place, blur = start[:, 0].copy(), start[:, 1].copy()
    root = np.sqrt(weight)
    span = np.maximum(np.ptp(np.where(weight > 0, offset, 0.0), axis=1), 1.0)
    linear = np.zeros((len(place), 4))
    # A ramp as steep as a tenth of the step over the window is ordinary, one of the whole step is not an edge: a weak
    # prior that only rules where blur and ramp cannot be told apart.
    for _ in range(25):
        cumulative, inside, outside, density = profile(offset, place[:, None], blur[:, None])
        columns = [np.ones_like(offset), cumulative]
        if ramps:
            columns += [inside, outside]
        basis = np.stack(columns, axis=-1) * root[..., None]
        gram = np.einsum("kbi,kbj->kij", basis, basis)
        total = weight.sum(axis=1)
        if ramps:
            strength = total / 12.0 * (span / 2.0) ** 2 * 1e-3
            gram[:, 2, 2] += strength
            gram[:, 3, 3] += strength
        gram += np.eye(gram.shape[1]) * (1e-9 * total[:, None, None])
        coefficients = np.linalg.solve(gram, np.einsum("kbi,kb->ki", basis, value * root)[..., None])[..., 0]
        linear[:, : coefficients.shape[1]] = coefficients
        residual = value * root - np.einsum("kbi,ki->kb", basis, coefficients)
        step = linear[:, 1:2]
        z = (offset - place[:, None]) / blur[:, None]
        slope_place = -step * density - linear[:, 2:3] * (1.0 - cumulative) - linear[:, 3:4] * cumulative
        slope_blur = (-step * z + (linear[:, 3:4] - linear[:, 2:3]) * blur[:, None]) * density
        tangent = np.stack([slope_place, slope_blur], axis=-1) * root[..., None]
        # Kaufman's form: the tangent without its part in the span of the linear columns.
        inner = np.linalg.solve(gram, np.einsum("kbi,kbj->kij", basis, tangent))
        tangent = tangent - np.einsum("kbi,kij->kbj", basis, inner)
        normal = np.einsum("kbi,kbj->kij", tangent, tangent)
        normal += np.eye(2) * (1e-3 * np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-30)
        move = np.linalg.solve(normal, np.einsum("kbi,kb->ki", tangent, residual)[..., None])[..., 0]
        place += np.clip(move[:, 0], -0.7 * blur, 0.7 * blur)
        place = np.clip(place, offset.min(axis=1), offset.max(axis=1))
        blur = np.clip(blur + np.clip(move[:, 1], -0.3 * blur, 0.3 * blur), _MIN_BLUR, 0.5 * span)
        if np.max(np.abs(move)) < 1e-5:
            break
    return np.column_stack([place, blur, linear[:, 2], linear[:, 3]]), linear


@dataclass(frozen=True)
class Edges:
    """Sub-pixel edges of one side: offset from the expected edge and its standard deviation, px; step and scatter."""

    place: Array
    std: Array
    step: Array
    scatter: Array


def fit_edges(pixels: Pixels, s: Array, profiles: Profiles, *, iterations: int = 6) -> Edges:
    """Place, level and step of the edge on every section; blur and relative slopes come from the profiles."""
    place = profiles.at(s, "place")
    blur = profiles.at(s, "blur")[:, None]
    inside, outside = profiles.at(s, "inside")[:, None], profiles.at(s, "outside")[:, None]
    noise = float(np.median(profiles.noise))
    finite = np.isfinite(pixels.value)
    value = np.where(finite, pixels.value, 0.0)
    weight = finite.astype(np.float64)
    level, step = profiles.at(s, "level"), profiles.at(s, "step")
    scatter = np.full(len(s), noise)
    gram = np.zeros((len(s), 3, 3))
    for _ in range(iterations):
        cumulative, ramp_in, ramp_out, density = profile(pixels.offset, place[:, None], blur)
        shape = cumulative + inside * ramp_in + outside * ramp_out
        slope = -step[:, None] * (density + inside * (1.0 - cumulative) + outside * cumulative)
        residual = value - level[:, None] - step[:, None] * shape
        scatter = np.sqrt((weight * residual**2).sum(axis=1) / np.maximum(weight.sum(axis=1) - 3.0, 1.0))
        # Biweight with the scatter of the whole side: a section full of text must not raise its own limit.
        weight = finite * (1.0 - np.minimum(np.abs(residual) / (6.0 * noise + 1e-12), 1.0) ** 2) ** 2
        basis = np.stack([np.ones_like(shape), shape, slope], axis=-1)
        weighted = basis * weight[..., None]
        gram = np.einsum("nmi,nmj->nij", weighted, basis)
        gram += np.eye(3) * 1e-12 + 1e-9 * np.einsum("nii->n", gram)[:, None, None] * np.eye(3)
        move = np.linalg.solve(gram, np.einsum("nmi,nm->ni", weighted, residual)[..., None])[..., 0]
        level, step = level + move[:, 0], step + move[:, 1]
        shift = np.clip(move[:, 2], -blur[:, 0], blur[:, 0])
        place = place + shift
        if np.max(np.abs(shift)) < 1e-4:
            break
    std = noise * np.sqrt(np.linalg.inv(gram)[:, 2, 2])
    lost = (weight.sum(axis=1) < 0.5 * weight.shape[1]) | (step <= 0.0)
    return Edges(np.where(lost, np.nan, place), std, step, scatter)

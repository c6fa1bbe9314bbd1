"""Cross-sections of a strip at reduced resolution: its colour against the ground, its middle and width along the path.

Rows of a cross-cut are sections along the path (one cell apart), columns are offsets along the normal, positive to the
right of the walking direction on the photo (the normal of the tangent ``(du, dv)`` is ``(-dv, du)``).
All lengths in cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, median_filter

from pipeline.records import Array
from pipeline.settings.vision_stages import SegmentationSettings
from pipeline.vision.backdrop import Standout

_MAD_TO_STD = 1.4826


@dataclass(frozen=True)
class CrossCut:
    """The strip measured across.

    Attributes
    ----------
    path : (k, 2) cells
        Refined middle.
    width : (k,) cells
        Between the outermost level crossings; NaN where one is missing.
    step : (k,) fraction of full range
        Core minus ground along ``weights``, positive where the section looks like the cable.
    contrast : float
        Median of ``step``.
    texture : float
        Standard deviation of the ground beside the cable along ``weights``.
    weights : (c,)
        Colour projection in which the cable stands out best, sum of absolute values 1.
    dark : bool
        Cable darker than the ground along ``weights``.
    """

    path: Array
    width: Array
    step: Array
    contrast: float
    texture: float
    weights: Array
    dark: bool


def smooth_path(path: Array, sigma: float) -> Array:
    """Resample a path to points one cell apart and smooth it; the ends stay in place."""
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    grid = np.linspace(0.0, s[-1], max(3, round(s[-1]) + 1))
    even = np.column_stack([np.interp(grid, s, path[:, 0]), np.interp(grid, s, path[:, 1])])
    pad = min(len(even) - 1, int(4 * sigma) + 1)
    # Odd reflection about the ends keeps position and direction there.
    before = 2.0 * even[0] - even[pad:0:-1]
    after = 2.0 * even[-1] - even[-2 : -pad - 2 : -1]
    return np.asarray(gaussian_filter1d(np.vstack([before, even, after]), sigma, axis=0)[pad : pad + len(even)])


def path_normals(path: Array) -> tuple[Array, Array]:
    """Unit tangents and normals ``(k, 2)`` of a path."""
    tangent = np.gradient(path, axis=0)
    tangent /= np.hypot(*tangent.T)[:, None] + 1e-12
    return tangent, np.column_stack([-tangent[:, 1], tangent[:, 0]])


def cut_across(standout: Standout, path: Array, width: float, settings: SegmentationSettings) -> CrossCut:
    """Measure the strip along a path, given its approximate width.

    Strategy: straighten the residual picture along the path; colours of core and flanks give the projection; a box of
    the cable's width slides across each section to centre it (blind to highlights and writing); level crossings
    from outside give the width.
    """
    path = smooth_path(path, settings.smoothing_widths * width)
    _, normal = path_normals(path)
    offsets = np.arange(-2.2, 2.2001, 1.0 / max(width, 4.0)) * width
    u = (path[:, 0, None] + normal[:, 0, None] * offsets).astype(np.float32)
    v = (path[:, 1, None] + normal[:, 1, None] * offsets).astype(np.float32)
    straight = cv2.remap(standout.residual, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    straight = straight.reshape(*u.shape, -1)
    weights = _projection(straight, offsets / width, standout.covariance)
    grey = straight @ weights.astype(np.float32)
    core, flank = np.abs(offsets) < 0.35 * width, (np.abs(offsets) > 0.9 * width) & (np.abs(offsets) < 1.7 * width)
    ground = np.median(grey[:, flank], axis=1)
    sign = -1.0 if np.median(np.median(grey[:, core], axis=1) - ground) < 0 else 1.0
    relief = sign * (grey - ground[:, None])
    shift = _centre(relief, offsets, width)
    step = np.nanmedian(np.where(np.abs(offsets - shift[:, None]) < 0.35 * width, relief, np.nan), axis=1)
    contrast = float(np.median(step))
    level = settings.crossing_level_dark if sign < 0 else settings.crossing_level_bright
    left, right = _outer_crossings(relief, offsets, shift, level * contrast, width)
    middle = np.where(np.isfinite(left + right), 0.5 * (left + right), shift)
    texture = _MAD_TO_STD * float(np.median(np.abs(grey[:, flank] - ground[:, None])))
    middle = gaussian_filter1d(median_filter(middle, 9, mode="nearest"), 0.5 * width, mode="nearest")
    return CrossCut(
        path=path + normal * middle[:, None],
        width=right - left,
        step=step,
        contrast=contrast,
        texture=texture,
        weights=weights,
        dark=sign < 0,
    )


def _projection(straight: NDArray[np.float32], offset_widths: Array, covariance: Array) -> Array:
    """Fisher's discriminant of core against flanks, kept from chasing channels that hardly differ."""
    core = np.median(straight[:, np.abs(offset_widths) < 0.35].reshape(-1, straight.shape[2]), axis=0)
    beside = (np.abs(offset_widths) > 0.9) & (np.abs(offset_widths) < 1.7)
    ground = np.median(straight[:, beside].reshape(-1, straight.shape[2]), axis=0)
    difference = (core - ground).astype(np.float64)
    if len(difference) == 1:
        return np.ones(1)
    ridge = 0.1 * float(difference @ difference) + 1e-9
    weights = np.linalg.solve(covariance + ridge * np.eye(len(difference)), difference)
    # One sign convention: brightness counts positive, so "dark" means dark to a person wherever that makes sense.
    weights *= 1.0 if weights.sum() >= 0 else -1.0
    return np.asarray(weights / (np.abs(weights).sum() + 1e-300))


def _centre(relief: NDArray[np.float32], offsets: Array, width: float) -> Array:
    """Offset at which a box of the cable's width fits each section best, pooled over a few sections."""
    pooled = gaussian_filter1d(relief, 0.5 * width, axis=0, mode="nearest")
    spacing = offsets[1] - offsets[0]
    size = max(3, round(width / spacing))
    capped = np.clip(pooled, -np.inf, np.median(pooled[:, np.abs(offsets) < 0.35 * width]))
    box = cv2.blur(capped.astype(np.float32), (size, 1), borderType=cv2.BORDER_REPLICATE)
    near = np.abs(offsets) <= 0.6 * width
    return np.asarray(offsets[near][np.argmax(box[:, near], axis=1)])


def _outer_crossings(
    relief: NDArray[np.float32], offsets: Array, shift: Array, level: float, width: float
) -> tuple[Array, Array]:
    """Level crossings farthest from the middle but within 0.9 widths of it; NaN where there is none."""
    distance = offsets[None, :] - shift[:, None]
    above = (relief > level) & (np.abs(distance) <= 0.9 * width)
    rows = np.arange(len(relief))
    first = np.argmax(above, axis=1)
    last = relief.shape[1] - 1 - np.argmax(above[:, ::-1], axis=1)
    spacing = offsets[1] - offsets[0]

    def crossing(inside: NDArray[np.intp], direction: int) -> Array:
        outside = np.clip(inside + direction, 0, relief.shape[1] - 1)
        a, b = relief[rows, inside], relief[rows, outside]
        share = np.clip((a - level) / np.where(a > b, a - b, np.inf), 0.0, 1.0)
        found = above.any(axis=1) & (np.abs(distance[rows, inside]) < 0.9 * width - spacing)
        return np.where(found, offsets[inside] + direction * share * spacing, np.nan)

    return crossing(first, -1), crossing(last, 1)

"""The full-resolution grey window along a cable: projection, edge blur.

Only the columns that the corridor along the path has in a band of rows are projected; elsewhere the window is zero.
That keeps a 12 Mpx colour photo at a few bytes a pixel: memory that is never written is never used.
Units: px and fractions of full range.
"""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.records import Array
from pipeline.vision.median import medians
from pipeline.vision.photo import Photo, straightened
from pipeline.vision.search.backdrop import ROWS, Image, Standout

_CORRIDOR_WIDTHS = 2.25  # widths; half corridor kept at full resolution: noise is read up to 1.6 widths away


def take_closeup(photo: Photo, path_px: Array, width_px: float, weights: Array) -> Standout:
    """The window along ``path_px`` (k, 2) at full resolution, its corridor projected to grey."""
    margin = _CORRIDOR_WIDTHS * width_px + 8.0
    low = np.maximum(np.floor(path_px.min(axis=0) - margin).astype(int), 0)
    high = np.minimum(np.ceil(path_px.max(axis=0) + margin).astype(int) + 1, photo.size)
    grey = np.zeros((high[1] - low[1], high[0] - low[0]), np.float32)
    scaled = (np.asarray(weights) / photo.full_scale).astype(np.float32)
    window = photo.pixels[low[1] : high[1], low[0] : high[0]]
    for top in range(0, len(grey), ROWS):
        near = path_px[np.abs(path_px[:, 1] - low[1] - top - 0.5 * ROWS) <= 0.5 * ROWS + margin, 0] - low[0]
        if not len(near):
            continue
        rows = slice(top, top + ROWS)
        columns = slice(max(0, int(near.min() - margin)), int(near.max() + margin) + 1)
        part = window[rows, columns]
        if part.ndim == 2:
            np.multiply(part, scaled[0], out=grey[rows, columns])
        else:
            cv2.transform(part.astype(np.float32), scaled[None, :], grey[rows, columns])
    return Standout.of(grey[..., None], (int(low[0]), int(low[1])))


def edge_spreads(grey: Image, middle: Array, across: Array, width: float) -> Array:
    """Standard deviation ``(2, k)`` px of the spread of both edges on groups of neighbouring sections, 0 without one.

    A blurred step of height A has the slope ``A / (sqrt(2 pi) sigma)`` in its middle. The median of a group passes over
    letters, whose rims are no edges of the cable.

    Parameters
    ----------
    grey : (h, w)
    middle, across : (n, 2) px, -
        Places on ``grey`` along the middle of the cable, and unit vectors across it.
    width : px
        Of the cable.
    """
    step = 0.25
    offsets = np.arange(-0.4 * width, 0.4 * width + step, step)
    plateau = max(2, len(offsets) // 6)
    spreads = np.zeros((2, 8))
    for side, edge in enumerate((-0.5 * width, 0.5 * width)):
        profiles = straightened(grey, middle, across, edge + offsets)[..., 0]
        for k, group in enumerate(np.array_split(profiles, spreads.shape[1])):
            profile = medians(group, axis=0)
            height = abs(float(profile[-plateau:].mean() - profile[:plateau].mean()))
            slope = float(np.abs(profile[2:] - profile[:-2])[plateau - 1 : 1 - plateau].max(initial=0.0)) / (2.0 * step)
            spreads[side, k] = height / (np.sqrt(2.0 * np.pi) * slope) if slope > 0.0 else 0.0
    return spreads

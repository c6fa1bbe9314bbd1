"""The full-resolution grey window along a cable: projection, edge blur.

Only the corridor along the path is projected; elsewhere the window is zero. That keeps a 12 Mpx colour photo at a few
bytes a pixel: memory that is never written is never used.
Units: px and fractions of full range.
"""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.records import Array
from pipeline.vision.median import medians
from pipeline.vision.photo import Photo, sampled
from pipeline.vision.search.backdrop import Image, Standout

_GROUPS = 8  # of neighbouring sections, on which the edge's spread is measured
_TILE = 128  # px; pieces of the window that are projected or left out
_CORRIDOR_WIDTHS = 2.25  # widths; half corridor kept at full resolution: noise is read up to 1.6 widths away


def take_closeup(photo: Photo, path_px: Array, width_px: float, weights: Array) -> Standout:
    """The window along ``path_px`` (k, 2) at full resolution, its corridor projected to grey."""
    margin = _CORRIDOR_WIDTHS * width_px + 8.0
    low = np.maximum(np.floor(path_px.min(axis=0) - margin).astype(int), 0)
    high = np.minimum(np.ceil(path_px.max(axis=0) + margin).astype(int) + 1, photo.size)
    grey = np.zeros((high[1] - low[1], high[0] - low[0]), np.float32)
    scaled = (np.asarray(weights) / photo.full_scale).astype(np.float32)
    window = photo.pixels[low[1] : high[1], low[0] : high[0]]
    for rows, columns in _stretches(path_px - low, margin, (grey.shape[1], grey.shape[0])):
        part = window[rows, columns]
        if part.ndim == 2:
            np.multiply(part, scaled[0], out=grey[rows, columns])
        else:
            cv2.transform(part.astype(np.float32), scaled[None, :], grey[rows, columns])
    return Standout.of_grey(grey, (int(low[0]), int(low[1])))


def _stretches(path: Array, margin: float, size: tuple[int, int]) -> list[tuple[slice, slice]]:
    """Rows and columns of the tiles that the corridor of half width ``margin`` touches, side by side ones together."""
    reach = np.arange(-np.ceil(margin / _TILE), np.ceil(margin / _TILE) + 1) * min(margin, _TILE)
    u, v = (np.add.outer(path[:, axis], reach).clip(0, size[axis] - 1) // _TILE for axis in (0, 1))
    touched = np.zeros((size[1] // _TILE + 1, size[0] // _TILE + 1), np.int8)
    touched[v.astype(int)[:, None, :], u.astype(int)[:, :, None]] = 1
    edges = np.diff(np.pad(touched, ((0, 0), (1, 1))), axis=1)
    return [
        (slice(row * _TILE, (row + 1) * _TILE), slice(first * _TILE, last * _TILE))
        for (row, first), (_, last) in zip(
            np.argwhere(edges == 1).tolist(), np.argwhere(edges == -1).tolist(), strict=True
        )
    ]


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
    spreads = np.zeros((2, _GROUPS))
    for side, edge in enumerate((-0.5 * width, 0.5 * width)):
        profiles = sampled(grey, middle[:, None] + (edge + offsets)[:, None] * across[:, None])
        for k, group in enumerate(np.array_split(profiles, _GROUPS)):
            profile = medians(group, axis=0)
            height = abs(float(profile[-plateau:].mean() - profile[:plateau].mean()))
            slope = float(np.abs(profile[2:] - profile[:-2])[plateau - 1 : 1 - plateau].max(initial=0.0)) / (2.0 * step)
            spreads[side, k] = height / (np.sqrt(2.0 * np.pi) * slope) if slope > 0.0 else 0.0
    return spreads

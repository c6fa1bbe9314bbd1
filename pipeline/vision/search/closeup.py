"""The full-resolution grey window along a cable: projection, edge blur.

Only the corridor along the path is projected; elsewhere the window is zero. That keeps a 12 Mpx colour photo at a few
bytes a pixel: memory that is never written is never used.
Units: px and fractions of full range.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array
from pipeline.vision.median import median
from pipeline.vision.photo import Photo, sampled
from pipeline.vision.search.crosscut import path_normals

_GROUPS = 8  # of neighbouring sections, on which the edge's spread is measured
_TILE = 128  # px; pieces of the window that are projected or left out
_CORRIDOR_WIDTHS = 2.25  # widths; half corridor kept at full resolution: noise is read up to 1.6 widths away


@dataclass(frozen=True)
class Closeup:
    """Grey window along the cable and what its pixels are worth.

    Attributes
    ----------
    grey : (h, w) float32
        Zero outside the corridor.
    origin_px : (u, v)
        Photo pixel of ``grey[0, 0]``.
    blur_px, softest_px : px
        Standard deviation of the edge spread: the median, and where it is most, of the sharper edge there.
    """

    grey: NDArray[np.float32]
    origin_px: tuple[int, int]
    blur_px: float
    softest_px: float


def take_closeup(photo: Photo, path_px: Array, width_px: float, weights: Array) -> Closeup:
    """Project the corridor along ``path_px`` (k, 2) to grey and measure its blur."""
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
    spreads = _edge_spreads(grey, path_px - low, width_px)
    return Closeup(grey, (int(low[0]), int(low[1])), median(spreads), float(spreads.min(axis=0).max()))


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


def _edge_spreads(grey: NDArray[np.float32], path: Array, width: float) -> Array:
    """Edge spread ``(2, k)`` of both sides on groups of neighbouring sections, 0 without an edge.

    A blurred step of height A has the slope ``A / (sqrt(2 pi) sigma)`` in its middle.
    """
    _, normal = path_normals(path)
    sections = np.linspace(0.1, 0.9, 8 * _GROUPS) * (len(path) - 1)
    centre = np.column_stack([np.interp(sections, np.arange(len(path)), column) for column in path.T])
    across = normal[np.rint(sections).astype(int)]
    offsets = np.arange(-0.4 * width, 0.4 * width + 0.25, 0.25)
    spreads = []
    for side in (-0.5, 0.5):
        profile = sampled(grey, centre[:, None] + across[:, None] * (side * width + offsets)[:, None])
        spreads.append(_spread_of_groups(profile, offsets, outward=side > 0.0))
    return np.array(spreads)


def _spread_of_groups(profile: NDArray[np.float32], offsets: Array, *, outward: bool) -> Array:
    """Spread of one edge on each group of sections; 0 where the profile is flat. ``outward``: sheath first."""
    spacing = float(offsets[1] - offsets[0])
    plateau = max(2, len(offsets) // 6)
    ends = np.stack([profile[:, :plateau].mean(axis=1), profile[:, -plateau:].mean(axis=1)])
    step, level = ends[1] - ends[0], 0.5 * (ends[0] + ends[1])
    above = (profile - level[:, None]) * np.sign(step)[:, None] > 0
    crossing = np.argmax(above, axis=1)
    # Lined up at their own crossings, so a path half a pixel off does not count as blur: each is moved by whole columns
    # and all by the same fraction of one.
    columns = np.arange(len(offsets)) + crossing[:, None] + float(offsets[0]) / spacing
    low = np.floor(columns).astype(int)
    share = (columns - low).astype(np.float32)
    last = len(offsets) - 1
    first, second = (np.take_along_axis(profile, np.clip(low + k, 0, last), axis=1) for k in (0, 1))
    kept = _without_print(ends[::-1] if outward else ends)
    lined = np.average(
        (first + share * (second - first)).reshape(_GROUPS, -1, len(offsets)),
        axis=1,
        weights=np.broadcast_to(kept[..., None], (*kept.shape, len(offsets))),
    )
    rise = np.abs(lined[:, 2:] - lined[:, :-2])[:, plateau - 1 : 1 - plateau]
    slope = rise.max(axis=1, initial=0.0) / (2.0 * spacing)
    height = np.abs(np.average(step.reshape(_GROUPS, -1), axis=1, weights=kept))
    return np.asarray(np.where(slope > 0.0, height / (np.sqrt(2.0 * np.pi) * np.maximum(slope, 1e-12)), 0.0))


def _without_print(ends: NDArray[np.float32]) -> Array:
    """Weights ``(groups, sections)``: 0 where the sheath differs from that of the group; ground and sheath ``(2, n)``.

    Letters cover less than half of the sections. Their rims are no edges of the cable, and where the ink is brighter
    than a bright sheath, half of its height is reached at the rim and not at the cable's edge.
    """
    grouped = ends.reshape(2, _GROUPS, -1)
    usual = np.median(grouped, axis=2, keepdims=True)
    # A quarter of the step: texture and light vary by less, fainter ink does not reach half of the height.
    plain = np.abs(grouped[1] - usual[1]) < 0.25 * np.abs(usual[1] - usual[0])
    return np.where(plain.any(axis=1, keepdims=True), plain, True).astype(float)

"""Two sub-pixel edges of the sheath on sections across the cable.

Strategy. A smooth path within a few pixels of the midline gives each pixel near the cable coordinates ``(s, t)``: along
the path, and across it, positive to the right of the direction of travel as seen on the photo. Pixels are used as they
are, at their true ``(s, t)``: nothing is interpolated, so errors stay independent and edges keep their blur.

0. `where_alike`: where the path has left the cable for its shadow, the look of the cable is found beside it.
1. `search_edges`: on block means of the straightened strip, the pair of gradients that a cable of about the known width
   would show. Searched from the expected edges, so highlights and text on the sheath do not compete.
2. `fit_profiles`: per side, in windows along s with hundreds of pixels each: the whole edge profile
   ``a + A Phi((t - t0)/w) + b_in ramp_in + b_out ramp_out`` with blur w and the ramps of shading (inside) and soft
   shadow (outside), both blurred alike.
3. `fit_edges`: per section with blur and ramps held, only place, level and step; all sections at once, Gauss-Newton
   with robust weights.

Grey values are turned so that the cable is dark. Lengths in px. Limits: one section across an edge of blur w with
noise n and contrast A has a standard deviation of ``(n/A) sqrt(2 sqrt(pi) w)`` px.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, median_filter

from pipeline.records import Array
from pipeline.vision.centerline.curvature import PlaneCurve, normals
from pipeline.vision.centerline.edge_profile import Pixels
from pipeline.vision.median import median, medians, scatter
from pipeline.vision.photo import Closeup, straightened
from pipeline.vision.search.crosscut import steepest

SEARCH_RADII = 0.35
"""Of the radius; how far from its expected place an edge is sought: a path misled by a shadow is off by less, the next
false edge (highlight, text) is mostly farther.
"""

_LOOK_RADII, _LOOK_BLOCKS, _LOOK_SURE = 1.6, 9, 0.5**0.5
"""Radii on both sides of a path: the cable with the ground beside it, and as far aside; blocks of half a radius, of
which most must be seen aside: letters and stripes are shorter than two widths; correlation from which on the look of
the cable explains more than half of what is seen.
"""

_TOGETHER = 2.0  # scatter of half the width over that of the middle; edges that err each by itself have 1


def in_picture(closeup: Closeup, curve: PlaneCurve, s: Array, reach: float) -> NDArray[np.bool_]:
    """Mask (n,) of the sections whose pixels up to ``reach`` px on both sides are in the picture."""
    where, angle = curve.at(s)
    height, width = closeup.grey.shape
    inside = np.ones(len(s), dtype=bool)
    for side in (-reach, reach):
        u, v = (where + side * normals(angle) - np.asarray(closeup.origin_px)).T
        inside &= (u >= 1.0) & (u <= width - 2.0) & (v >= 1.0) & (v <= height - 2.0)
    return inside


@dataclass(frozen=True)
class Found:
    """Edges found by search: sections ``s``, offsets of both edges ``(n, 2)`` in px, usable sections."""

    s: Array
    edges: Array
    usable: NDArray[np.bool_]

    @property
    def swing(self) -> float:
        """By how much both edges go out and in together, px (robust standard deviation); 0 if each errs by itself."""
        half, middle = (scatter(0.5 * self.edges[self.usable] @ way) for way in ((-1.0, 1.0), (1.0, 1.0)))
        return half if half > _TOGETHER * middle else 0.0

    def outline(self, s: Array) -> Array:
        """Distances ``(2, n)`` px of both edges from the path at sections ``s``, positive outward."""
        calm = median_filter(self.edges[self.usable] * (-1.0, 1.0), size=(3, 1), mode="nearest")
        return np.stack([np.interp(s, self.s[self.usable], side) for side in calm.T])


def search_edges(
    closeup: Closeup, curve: PlaneCurve, *, span: tuple[float, float], half_width: float, tolerance: float
) -> Found:
    """Both edges on blocks along ``span``, to a few tenths of a pixel.

    Parameters
    ----------
    half_width : px
        Expected, from diameter and scale, or of the mask.
    tolerance : relative
        Of the expected width.
    """
    s, t, strip, ok = _strip(closeup, curve, span, half_width / 4.0, half_width * (1.0 + 2.0 * SEARCH_RADII) + 4.0)
    rise = gaussian_filter1d(strip, max(1.0, 0.04 * half_width), axis=1, order=1)
    middle = _offset(medians(rise[ok], axis=0), t, half_width, tolerance)
    # The path wanders about the cable: look for the pair again along s, near the pair of the whole cable.
    sigma = SEARCH_RADII * half_width / 2.0 + 1.0
    edges = np.empty((len(s), 2))
    for side, sign in ((0, -1.0), (1, 1.0)):
        near = np.exp(-0.5 * ((t - middle[side]) / sigma) ** 2)
        score = np.where(ok[:, None], np.maximum(sign * rise, 0.0), 0.0) * near
        edges[:, side] = steepest(score, t, np.zeros(len(s)), np.inf, -np.inf)
        ok &= score.max(axis=1) > 0.0
    return Found(s, edges, ok)


def where_alike(closeup: Closeup, curve: PlaneCurve, *, span: tuple[float, float], half_width: float) -> Array | None:
    """Points (n, 2) px where the picture looks across as it does along most of a path; None where it is nowhere astray.

    A cable looks alike all along, and so does its shadow: a path that changes over to a shadow or a flank, which are as
    wide, sees the cable again beside itself. What looks like nothing else (letters, a tie) is left where it is.
    """
    s, t, strip, ok = _strip(closeup, curve, span, half_width / 2.0, 2.0 * _LOOK_RADII * half_width)
    if not ok.any():
        return None
    count = int(np.count_nonzero(np.abs(t) <= _LOOK_RADII * half_width))
    own, aside = (len(t) - count) // 2, np.arange(len(t) - count + 1)
    seen = np.lib.stride_tricks.sliding_window_view(strip, count, axis=1)
    seen = seen - seen.mean(axis=2, keepdims=True)
    seen /= np.maximum(np.linalg.norm(seen, axis=2, keepdims=True), 1e-12)
    look = np.median(seen[ok, own], axis=0)
    alike = seen @ (look / max(float(np.linalg.norm(look)), 1e-12))
    moved = (aside - own)[np.argmax(alike, axis=1)]
    told = ok & (np.max(alike, axis=1) > _LOOK_SURE) & (np.abs(moved) > SEARCH_RADII * half_width)
    moved = median_filter(np.where(told, moved, 0), size=_LOOK_BLOCKS, mode="nearest")
    where, angle = curve.at(s)
    return where + moved[:, None] * normals(angle) if moved.any() else None


def _strip(
    closeup: Closeup, curve: PlaneCurve, span: tuple[float, float], block: float, reach: float
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Grey values (n, m) across a path, means over blocks at ``s`` (n,), at offsets (m,); blocks in the picture."""
    size = max(2, round(block))
    count = max(8, int((span[1] - span[0]) / size))
    s = span[0] + (np.arange(count * size) + 0.5) * (span[1] - span[0]) / (count * size)
    t = np.arange(-np.ceil(reach), np.ceil(reach) + 1.0)
    where, angle = curve.at(s)
    straight = straightened(closeup.grey, where - closeup.origin_px, normals(angle), t)
    ok = np.asarray(in_picture(closeup, curve, s, t[-1]).reshape(count, size).all(axis=1))
    return s.reshape(count, size).mean(axis=1), t, straight.reshape(count, size, len(t)).mean(axis=1), ok


def _offset(rise: Array, t: Array, half_width: float, tolerance: float) -> tuple[float, float]:
    """The pair of a falling and a rising edge of about the right distance and place that stand out most."""
    width = t[None, :] - t[:, None]
    off = 0.5 * (t[None, :] + t[:, None])
    prior = ((width / (2.0 * half_width) - 1.0) / tolerance) ** 2 + (off / (SEARCH_RADII * half_width)) ** 2
    pair = np.sqrt(np.maximum(-rise[:, None], 0.0) * np.maximum(rise[None, :], 0.0)) * np.exp(-0.5 * prior)
    first, second = np.unravel_index(int(np.argmax(pair)), pair.shape)
    return float(t[first]), float(t[second])


def edge_pixels(
    closeup: Closeup,
    curve: PlaneCurve,
    s: Array,
    *,
    rows: int,
    outline: Callable[[Array], Array],
    window: tuple[float, float],
) -> Pixels:
    """Pixels nearest to a grid about both edges: ``rows`` a section along s, one a px across; see `in_picture`.

    Parameters
    ----------
    outline : arc lengths (n,) to (2, n) px
        Distances of the expected edges from the path.
    window : (inside, outside) px
    """
    spacing = median(np.diff(s)) / rows
    all_s = (s[:, None] + (np.arange(rows) - 0.5 * (rows - 1)) * spacing).ravel()
    where, angle = curve.at(all_s)
    across = normals(angle)
    out, expected = np.arange(-np.ceil(window[0]), np.ceil(window[1]) + 1.0), outline(all_s)[..., None]
    side = np.array([-1.0, 1.0])[:, None, None]
    t = side * (expected + out)  # side, row, pixel
    u = np.rint(where[:, :1] + across[:, :1] * t)
    v = np.rint(where[:, 1:] + across[:, 1:] * t)
    offset = side * ((u - where[:, :1]) * across[:, :1] + (v - where[:, 1:]) * across[:, 1:]) - expected
    height, width = closeup.grey.shape
    column = np.clip(u.astype(np.int64) - closeup.origin_px[0], 0, width - 1)
    row = np.clip(v.astype(np.int64) - closeup.origin_px[1], 0, height - 1)
    shape = (2, len(s), rows * len(out))
    return Pixels(offset.astype(np.float32).reshape(shape), closeup.grey[row, column].reshape(shape), len(out))

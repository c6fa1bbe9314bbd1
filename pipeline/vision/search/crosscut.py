"""Cross-sections of a strip at reduced resolution: its colour against the ground, its middle and width along the path.

Rows of a cross-cut are sections along the path, columns are offsets along the normal, positive to the
right of the walking direction on the photo (the normal of the tangent ``(du, dv)`` is ``(-dv, du)``).
All lengths in cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, median_filter

from pipeline.records import Array
from pipeline.vision.median import median, medians
from pipeline.vision.photo import sampled
from pipeline.vision.polyline import arc_lengths
from pipeline.vision.search.backdrop import Image, Standout
from pipeline.vision.search.flanks import Flanks, find_flanks

SMOOTHING_WIDTHS = 0.8  # widths; smooths the skeleton's steps and shifts a bend of radius ten widths by 0.03
_CORE = ((-0.35, 0.35),)  # widths from the middle
_CLOSE_BY = ((-0.85, -0.65), (0.65, 0.85))  # widths; beyond the blur of the edges, within a jaw not twice as wide
SEEN_SHARE = 0.4  # of the median contrast; from it on a section counts as seen


@dataclass(frozen=True)
class CrossCut:
    """The strip measured across.

    Attributes
    ----------
    path : (k, 2) cells
        Refined middle.
    width : (k,) cells
        Between the two edges; NaN where one is not seen.
    step : (k,) fraction of full range
        Core minus ground along ``weights``, positive where the section looks like the cable.
    beside : (k,) fraction of full range
        What is just beside it, measured in the same way, where it looks like the cable most: on a jaw, or a cover, that
        is wider than the cable about the step.
    contrast : float
        Median of ``step``.
    weights : (c,)
        Colour projection in which the cable stands out best, sum of absolute values 1.
    dark : bool
        Cable darker than the ground along ``weights``.
    """

    path: Array
    width: Array
    step: Array
    beside: Array
    contrast: float
    weights: Array
    dark: bool

    @cached_property
    def seen_widths(self) -> Array:
        """Widths (k,) of the sections on which both edges are seen, cells."""
        return self.width[np.isfinite(self.width)]

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """Sections (k,) that look like the cable, and are not beside what looks so: that is wider than the cable."""
        wide = self.beside - median(self.beside) > (1.0 - SEEN_SHARE) * self.contrast
        # edges are pooled over a width: they reach so far into a jaw
        lost = maximum_filter1d(~np.isfinite(self.width), 2 * round(self.usual_width) + 1)
        return np.asarray((self.step > SEEN_SHARE * self.contrast) & ~(wide & lost))

    @cached_property
    def usual_width(self) -> float:
        """Median of the widths; NaN where no section shows both edges."""
        return median(self.seen_widths) if len(self.seen_widths) else np.nan


def smooth_path(path: Array, sigma: float) -> Array:
    """Resample a path (n, 2) to points one cell apart, (m, 2), and smooth it; the ends stay in place."""
    s = arc_lengths(path)
    grid = np.linspace(0.0, s[-1], max(3, round(s[-1]) + 1))
    even = np.column_stack([np.interp(grid, s, path[:, 0]), np.interp(grid, s, path[:, 1])])
    pad = min(len(even) - 1, int(4 * sigma) + 1)
    # Odd reflection about the ends keeps position and direction there.
    before = 2.0 * even[0] - even[pad:0:-1]
    after = 2.0 * even[-1] - even[-2 : -pad - 2 : -1]
    return np.asarray(gaussian_filter1d(np.vstack([before, even, after]), sigma, axis=0)[pad : pad + len(even)])


def path_normals(path: Array) -> tuple[Array, Array]:
    """Unit tangents and normals ``(k, 2)`` of a path."""
    tangent = np.empty_like(path)
    tangent[1:-1] = 0.5 * (path[2:] - path[:-2])
    tangent[[0, -1]] = path[[1, -1]] - path[[0, -2]]
    tangent /= np.hypot(*tangent.T)[:, None] + 1e-12
    return tangent, np.column_stack([-tangent[:, 1], tangent[:, 0]])


def cut_across(
    standout: Standout,
    path: Array,
    width: float,
    *,
    known: bool = False,
    weights: Array | None = None,
) -> CrossCut:
    """Measure the strip along a path, given its approximate width (``known``: from the diameter, else of the mask).

    ``weights`` is the colour projection if it is not to be sought.

    Strategy: straighten the residual picture along the path; colours of core and flanks give the projection; the pair
    of edges one width apart gives middle and width of each section (`pipeline.vision.search.flanks`).
    """
    path = smooth_path(path, SMOOTHING_WIDTHS * width)
    _, normal = path_normals(path)
    straight, offsets = straighten(standout.residual, path, normal, width)
    weights = _projection(straight, offsets / width, standout.covariance) if weights is None else weights
    grey = straight @ weights.astype(np.float32)
    relief = grey - medians(grey[:, _beside(offsets / width)], axis=1)[:, None]
    core = np.abs(offsets) < 0.35 * width
    sign = -1.0 if median(medians(relief[:, core], axis=1)) < 0 else 1.0
    relief *= sign
    flanks = find_flanks(relief, offsets, width, known=known)
    step, beside = (_level(relief, offsets, flanks, *part) for part in (_CORE, _CLOSE_BY))
    both = np.isfinite(flanks.left + flanks.right)
    middle = np.where(both, 0.5 * (flanks.left + flanks.right), flanks.middle)
    middle = gaussian_filter1d(median_filter(middle, 9, mode="nearest"), 0.5 * width, mode="nearest")
    return CrossCut(
        path=path + normal * middle[:, None],
        width=flanks.right - flanks.left,
        step=step,
        beside=beside,
        contrast=median(step),
        weights=weights,
        dark=sign < 0,
    )


def _beside(offset_widths: Array) -> NDArray[np.bool_]:
    """Columns of the ground beside the cable."""
    return np.asarray((np.abs(offset_widths) > 0.9) & (np.abs(offset_widths) < 1.7))


def _level(relief: NDArray[np.floating], offsets: Array, flanks: Flanks, *parts: tuple[float, float]) -> Array:
    """Median of each section ``(n,)`` over a part of it, in widths from its middle; the highest of several."""
    column = np.rint((flanks.middle - offsets[0]) / (offsets[1] - offsets[0])).astype(int)[:, None]
    reach = np.divide(parts, offsets[1] - offsets[0]) * flanks.width
    places = [(column + np.arange(int(first), int(last) + 1)).clip(0, len(offsets) - 1) for first, last in reach]
    return np.asarray(np.max([medians(np.take_along_axis(relief, place, axis=1), axis=1) for place in places], axis=0))


def straighten(picture: Image, path: Array, normal: Array, width: float) -> tuple[Image, Array]:
    """Picture ``(n, m, c)`` along a path (n, 2), and the offsets (m,) of its columns."""
    offsets = np.arange(-2.2, 2.2001, 1.0 / max(width, 4.0)) * width
    straight = sampled(picture, path[:, None] + normal[:, None] * offsets[:, None])
    return straight.reshape(len(path), len(offsets), -1), offsets


def _projection(straight: NDArray[np.float32], offset_widths: Array, covariance: Array) -> Array:
    """Fisher's discriminant of core against flanks, kept from chasing channels that hardly differ."""
    channels = straight.shape[2]
    if channels == 1:
        return np.ones(1)
    ground, core = (
        medians(straight[:, where].reshape(-1, channels), axis=0).astype(np.float64)
        for where in (_beside(offset_widths), np.abs(offset_widths) < 0.35)
    )
    core -= ground
    weights = np.linalg.solve(covariance + (0.1 * float(core @ core) + 1e-9) * np.eye(channels), core)
    # One sign convention: brightness counts positive, so "dark" means dark to a person wherever that makes sense.
    weights *= 1.0 if weights.sum() >= 0 else -1.0
    return np.asarray(weights / (np.abs(weights).sum() + 1e-300))

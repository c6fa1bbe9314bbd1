"""Cross-sections of a strip at reduced resolution: its colour against the ground, its middle and width along the path.

``straightened picture -> slope -> width and course of the best pair of edges -> both edges of each section``

A shadow beside the cable, a highlight on it and writing all make edges, and a mask takes in what is dark enough; but
only the cable has two edges of opposite sign at one distance all along. The pair is sought by its slopes: a soft shadow
has little slope whatever its depth.

Rows of a cross-cut are sections along the path, columns are offsets along the normal, positive to the
right of the walking direction on the photo (the normal of the tangent ``(du, dv)`` is ``(-dv, du)``).
All lengths in cells; relief is positive where a section looks like the cable.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, median_filter

from pipeline.records import Array
from pipeline.vision.median import median, medians
from pipeline.vision.photo import straightened
from pipeline.vision.polyline import arc_lengths
from pipeline.vision.search.backdrop import Standout

_SMOOTHING_WIDTHS = 0.8  # widths; smooths the skeleton's steps and shifts a bend of radius ten widths by 0.03
_CORE = ((-0.35, 0.35),)  # widths from the middle
_CLOSE_BY = ((-0.85, -0.65), (0.65, 0.85))  # widths; beyond the blur of the edges, within a jaw not twice as wide
SEEN_SHARE = 0.4  # of the median contrast; from it on a section counts as seen
_ARM_WIDTHS = 2.9  # widths from the middle to which what leaves a strip is followed: no bolt beside it reaches so far
_ALIKE = 0.25  # of the step between strip and ground; grey levels nearer than that are those of one thing

_TINT = 0.003  # of the square of the step; what channels scatter by as a cell averages: JPEG keeps tints coarse

_PAIR_SEARCH_WIDTHS = 0.6  # widths; a shadow as wide as the cable draws the mask's middle half a width aside
_PAIR_POOLING_WIDTHS = 1.0  # widths; sections pooled for the pair of edges: letters are shorter, bends longer
_PAIR_WANDER_COST = 0.5  # usual edges for each column moved; a mask wanders slowly, a jump to a shadow's edge must pay
_PAIR_WIDTH_RANGE = (0.45, 1.6)  # ratios to the width that are tried: half a cable along a highlight, and a shadow's
_PAIR_WIDTH_STD = 0.25  # logarithm; how far a given diameter may be off: scales and sheaths are
_PAIR_WIDTH_SHARE = 0.9  # ratio to the best pair's score from which a wider pair is preferred
_EDGE_REACH_WIDTHS = 0.1  # widths; an edge is sought so near to the pair's place; glare is farther
_LEAST_EDGE_SHARE = 0.15  # ratio to the usual steepest slope; a flatter place is no edge: half is shade


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
    padded = np.pad(even, ((pad, pad), (0, 0)), mode="reflect", reflect_type="odd")
    return np.asarray(gaussian_filter1d(padded, sigma, axis=0)[pad : pad + len(even)])


def path_normals(path: Array) -> Array:
    """Unit normals ``(k, 2)`` of a path."""
    tangent = np.empty_like(path)
    tangent[1:-1] = 0.5 * (path[2:] - path[:-2])
    tangent[[0, -1]] = path[[1, -1]] - path[[0, -2]]
    tangent /= np.hypot(*tangent.T)[:, None] + 1e-12
    return np.column_stack([-tangent[:, 1], tangent[:, 0]])


def cut_across(
    standout: Standout,
    path: Array,
    width: float,
    *,
    known: bool = False,
    weights: Array | None = None,
    search: float = _PAIR_SEARCH_WIDTHS,
) -> CrossCut:
    """Measure the strip along a path, given its approximate width (``known``: from the diameter, else of the mask).

    ``weights`` is the colour projection if it is not to be sought, ``search`` as in `find_flanks`.

    Strategy: straighten the residual picture along the path; colours of core and flanks give the projection; the pair
    of edges one width apart gives middle and width of each section (`find_flanks`).
    """
    path = smooth_path(path, _SMOOTHING_WIDTHS * width)
    normal = path_normals(path)
    offsets = np.arange(-2.2, 2.2001, 1.0 / max(width, 4.0)) * width
    straight = straightened(standout.residual, path, normal, offsets)
    weights = _projection(straight, offsets / width, standout.covariance) if weights is None else weights
    grey = straight @ weights.astype(np.float32)
    relief = grey - medians(grey[:, _beside(offsets / width)], axis=1)[:, None]
    core = np.abs(offsets) < 0.35 * width
    sign = -1.0 if median(medians(relief[:, core], axis=1)) < 0 else 1.0
    relief *= sign
    flanks = find_flanks(relief, offsets, width, known=known, search=search)
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


def crossed_at(standout: Standout, cut: CrossCut) -> tuple[float, float] | None:
    """Photo pixel where a piece that looks like a strip leads away from it farther than bolts reach, if any does.

    Not on its first and last three widths: there covers and clamps are.
    """
    width, each = cut.usual_width, max(1, round(0.25 * cut.usual_width))
    offsets = np.linspace(-_ARM_WIDTHS, _ARM_WIDTHS, 59)
    straight = straightened(standout.residual, cut.path, path_normals(cut.path), width * offsets)
    grey = straight @ cut.weights.astype(np.float32)
    count = len(grey) // each
    if count <= 24:
        return None
    rays = grey[: count * each].reshape(count, each, -1).mean(axis=1)
    # a path that takes a corner at a crossing misses the cable there
    core = median_filter(medians(rays[:, np.abs(offsets) < 0.3], axis=1), 25, mode="nearest")
    step = _ALIKE * abs(cut.contrast)
    # where the strip itself is not seen, its ground looks like it
    like = (np.abs(rays - core[:, None]) < step) & (np.abs(core - median(core)) < step)[:, None]
    like[:12] = like[-12:] = False
    for side in (like[:, offsets < -0.6][:, ::-1], like[:, offsets > 0.6]):
        _, pieces = cv2.connectedComponents(side.astype(np.uint8))
        arms = np.intersect1d(pieces[:, 0], pieces[:, -1])
        if arms[-1] > 0:
            u, v = standout.to_pixels(cut.path[int(np.median(np.flatnonzero(pieces[:, 0] == arms[-1]))) * each])
            return float(u), float(v)
    return None


def _beside(offset_widths: Array) -> NDArray[np.bool_]:
    """Columns of the ground beside the cable."""
    return np.asarray((np.abs(offset_widths) > 0.9) & (np.abs(offset_widths) < 1.7))


def _level(relief: NDArray[np.floating], offsets: Array, flanks: Flanks, *parts: tuple[float, float]) -> Array:
    """Median of each section ``(n,)`` over a part of it, in widths from its middle; the highest of several."""
    column = np.rint((flanks.middle - offsets[0]) / (offsets[1] - offsets[0])).astype(int)[:, None]
    reach = np.divide(parts, offsets[1] - offsets[0]) * flanks.width
    places = [(column + np.arange(int(first), int(last) + 1)).clip(0, len(offsets) - 1) for first, last in reach]
    return np.asarray(np.max([medians(np.take_along_axis(relief, place, axis=1), axis=1) for place in places], axis=0))


def _projection(straight: NDArray[np.float32], offset_widths: Array, covariance: Array) -> Array:
    """Fisher's discriminant of core against flanks, in which shades of the sheath and shadows beside it count least.

    A lamp at one side darkens one edge until it is as dark as the ground, but hardly changes its colour.
    """
    channels = straight.shape[2]
    if channels == 1:
        return np.ones(1)
    ground, sheath = _beside(offset_widths), np.abs(offset_widths) < _CORE[0][1]
    core = medians(straight[:, sheath].reshape(-1, channels), axis=0).astype(np.float64)
    core -= medians(straight[:, ground].reshape(-1, channels), axis=0)
    across = medians(straight, axis=0)
    shades = np.cov(across[sheath].T) + np.cov(across[ground].T)
    weights = np.linalg.solve(covariance + shades + (_TINT * float(core @ core) + 1e-9) * np.eye(channels), core)
    # One sign convention: brightness counts positive, so "dark" means dark to a person wherever that makes sense.
    weights *= 1.0 if weights.sum() >= 0 else -1.0
    return np.asarray(weights / (np.abs(weights).sum() + 1e-300))


@dataclass(frozen=True)
class Flanks:
    """Both edges of the strip on each section: ``left``, ``right`` (n,) offsets, NaN where an edge is not seen."""

    left: Array
    right: Array
    middle: Array
    width: float


def find_flanks(
    relief: NDArray[np.float32],
    offsets: Array,
    width: float,
    *,
    known: bool,
    search: float = _PAIR_SEARCH_WIDTHS,
) -> Flanks:
    """Edges of the cable.

    Parameters
    ----------
    relief : (n, m)
        Straightened picture, its rows a cell apart; positive in the cable.
    offsets : (m,)
        Evenly spaced.
    width : cells
        The cable's if ``known``, else that of the mask, which a shadow may have widened.
    search : widths
        How far beside the middle of the picture the pair's middle may lie.

    Returns
    -------
    Flanks
        ``middle`` is the pair's middle on each section, also where an edge is not seen; ``width`` that of the pair.
    """
    spacing = float(offsets[1] - offsets[0])
    soft = cv2.GaussianBlur(relief, (0, 0), max(0.8, 0.08 * width / spacing), borderType=cv2.BORDER_REPLICATE)
    slope = np.gradient(soft, spacing, axis=1)
    # Most sections tell how strong an edge is; letters count no more, and a highlight's edge, which may be three times
    # as strong as a flank, less than twice (the root).
    usual = median(np.abs(slope).max(axis=1)) + 1e-12
    pooling = _PAIR_POOLING_WIDTHS * width
    rise, fall = (np.sqrt(_pooled(np.clip(edge / usual, 0.0, 1.0), pooling)) for edge in (slope, -slope))
    near = np.flatnonzero(np.abs(offsets) <= search * width)
    # Pooled sections repeat each other: every half width of them is enough for width and course.
    every = np.arange(0, len(relief), max(1, int(0.5 * pooling)))
    rise, fall = rise[every], fall[every]
    best = spacing * _pair_width(rise, fall, near, width / spacing, known)
    score = _pair_score(rise, fall, near, np.array([best / spacing]))[:, 0]
    course = offsets[near][best_course(score, _PAIR_WANDER_COST)]
    middle = np.interp(np.arange(len(relief)), every, course)
    least = _LEAST_EDGE_SHARE * usual
    slope = _pooled(slope, pooling)
    left = steepest(slope, offsets, middle - 0.5 * best, _EDGE_REACH_WIDTHS * best, least)
    right = steepest(-slope, offsets, middle + 0.5 * best, _EDGE_REACH_WIDTHS * best, least)
    return Flanks(left, right, middle, best)


def _pooled(values: Array, std: float) -> Array:
    """Gaussian mean over neighbouring sections."""
    kernel = (1, 2 * round(4.0 * std) + 1)
    return np.asarray(cv2.GaussianBlur(values, kernel, 1.0, sigmaY=std, borderType=cv2.BORDER_REPLICATE), values.dtype)


def _pair_score(rise: Array, fall: Array, columns: NDArray[np.intp], widths: Array) -> Array:
    """Strength ``(n, w, k)`` of pairs of edges about ``columns`` ``(k,)``, for each of ``widths`` ``(w,)`` in columns.

    The weaker edge counts twice.
    """
    half = 0.5 * widths[:, None]
    first, second = _at(rise, columns - half), _at(fall, columns + half)
    return np.asarray(first + second + np.minimum(first, second))


def _at(values: Array, columns: Array) -> Array:
    """Values ``(n, ...)`` at fractions of columns ``(...)``, linear between columns, 0 outside."""
    low = np.floor(columns).astype(int)
    share = (columns - low).astype(values.dtype)
    padded = np.zeros((len(values), values.shape[1] + 3), values.dtype)
    padded[:, 1:-2] = values
    at = np.clip(low + 1, 0, values.shape[1] + 1)
    return np.asarray((1 - share) * padded[:, at] + share * padded[:, at + 1])


def best_course(score: Array, cost: float) -> NDArray[np.intp]:
    """Column on each row so that the sum of scores, less ``cost`` for each column moved, is largest."""
    reached = _reached(score, cost)
    at = int(np.argmax(reached[-1]))
    course = [at - 1]
    for before in reached[-2::-1].tolist():  # single numbers: an array's would take ten times as long
        aside = at - 1 if before[at - 1] >= before[at + 1] else at + 1
        at = aside if before[aside] - cost > before[at] else at
        course.append(at - 1)
    return np.array(course[::-1])


def _reached(score: Array, cost: float) -> Array:
    """Largest sums ``(n, ..., k + 2)`` of scores ``(n, ..., k)`` up to each place of a course, one more on each side.

    From row to row the course moves by one column at most (dynamic programming).
    """
    reached = np.full((*score.shape[:-1], score.shape[-1] + 2), -np.inf, score.dtype)
    reached[0, ..., 1:-1] = score[0]
    for before, here, row in zip(reached[:-1], reached[1:], score[1:], strict=True):
        moved = np.maximum(before[..., :-2], before[..., 2:]) - cost
        here[..., 1:-1] = np.maximum(before[..., 1:-1], moved) + row
    return reached


def _pair_width(rise: Array, fall: Array, near: NDArray[np.intp], width: float, known: bool) -> float:
    """Distance in columns of the edges that fits best along the whole strip; ``near`` are the columns of its middle.

    Of an unknown width it is the largest of nearly the best: a highlight splits a cable, nothing doubles
    it.
    """
    tried = width * np.geomspace(*_PAIR_WIDTH_RANGE, 26)  # 5 % apart; the edges are then sought in 15 %
    rise, fall = (edge[:: max(1, len(edge) // 300)] for edge in (rise, fall))  # 300 sections tell a width
    totals = _reached(_pair_score(rise, fall, near, tried), _PAIR_WANDER_COST)[-1].max(axis=1) / len(rise)
    if known:
        trust = np.exp(-0.5 * (np.log(tried / width) / _PAIR_WIDTH_STD) ** 2)
        return float(tried[np.argmax(totals * trust)])
    return float(tried[np.flatnonzero(totals >= _PAIR_WIDTH_SHARE * totals.max())[-1]])


def steepest(slope: Array, offsets: Array, about: Array, reach: float, least: float) -> Array:
    """Offsets ``(n,)`` of the steepest places within ``reach`` of ``about``, by a parabola; NaN where it is flat."""
    inside = np.abs(offsets - about[:, None]) <= reach
    place = np.argmax(np.where(inside, slope, -1.0), axis=1)
    rows, spacing = np.arange(len(slope)), float(offsets[1] - offsets[0])
    inner = np.clip(place, 1, slope.shape[1] - 2)
    before, here, after = (slope[rows, inner + k] for k in (-1, 0, 1))
    bend = before - 2.0 * here + after
    shift = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, 1.0), 0.0)
    found = (slope[rows, place] >= least) & inside.any(axis=1)
    return np.where(found, offsets[inner] + np.clip(shift, -0.5, 0.5) * spacing, np.nan)

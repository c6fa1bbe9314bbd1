"""The two flanks of a cable on its straightened picture: pairs of opposite edges, one cable's width apart.

``relief (sections x offsets) -> slope -> width and course of the best pair of edges -> both edges of each section``

A shadow beside the cable, a highlight on it and writing all make edges, and a mask takes in what is dark enough; but
only the cable has two edges of opposite sign at one distance all along. The pair is sought by its slopes: a soft shadow
has little slope whatever its depth.
All lengths in cells; relief is positive where a section looks like the cable.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array
from pipeline.vision.median import median

PAIR_SEARCH_WIDTHS = 0.6  # widths; a shadow as wide as the cable draws the mask's middle half a width aside
_PAIR_POOLING_WIDTHS = 1.0  # widths; sections pooled for the pair of edges: letters are shorter, bends longer
_PAIR_WANDER_COST = 0.5  # usual edges for each column moved; a mask wanders slowly, a jump to a shadow's edge must pay
_PAIR_WIDTH_RANGE = (0.45, 1.6)  # ratios to the width that are tried: half a cable along a highlight, and a shadow's
_PAIR_WIDTHS = 26  # widths tried, 5 % apart; the edges are then sought in 15 %
_PAIR_WIDTH_STD = 0.25  # logarithm; how far a given diameter may be off: scales and sheaths are
_PAIR_WIDTH_SHARE = 0.9  # ratio to the best pair's score from which a wider pair is preferred
_EDGE_REACH_WIDTHS = 0.1  # widths; an edge is sought so near to the pair's place; glare is farther
_LEAST_EDGE_SHARE = 0.15  # ratio to the usual steepest slope; a flatter place is no edge: half is shade


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
    search: float = PAIR_SEARCH_WIDTHS,
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
    known : bool
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
    course = offsets[near][_best_course(score, _PAIR_WANDER_COST)]
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


def _best_course(score: Array, cost: float) -> NDArray[np.intp]:
    """Column on each row so that the sum of scores, less ``cost`` for each column moved, is largest.

    From row to row the course moves by one column at most (dynamic programming).
    """
    rows, columns = score.shape
    reached = np.full((rows, columns + 2), -np.inf, score.dtype)  # of each column as the course's last, one more beside
    reached[0, 1:-1] = score[0]
    moved = np.empty(columns, score.dtype)
    for row in range(1, rows):
        before, here = reached[row - 1], reached[row, 1:-1]
        np.maximum(before[:-2], before[2:], out=moved)
        moved -= cost
        np.maximum(before[1:-1], moved, out=here)
        here += score[row]
    at = int(np.argmax(reached[-1]))
    course = [at - 1]
    for before in reached[-2::-1].tolist():  # single numbers: an array's would take ten times as long
        aside = at - 1 if before[at - 1] >= before[at + 1] else at + 1
        at = aside if before[aside] - cost > before[at] else at
        course.append(at - 1)
    return np.array(course[::-1])


def _pair_width(rise: Array, fall: Array, near: NDArray[np.intp], width: float, known: bool) -> float:
    """Distance in columns of the edges that fits best along the whole strip; ``near`` are the columns of its middle.

    Of an unknown width it is the largest of nearly the best: a highlight splits a cable, nothing doubles
    it.
    """
    tried = width * np.geomspace(*_PAIR_WIDTH_RANGE, _PAIR_WIDTHS)
    rise, fall = (edge[:: max(1, len(edge) // 300)] for edge in (rise, fall))  # 300 sections tell a width
    totals = _pair_score(rise, fall, near, tried).max(axis=2).mean(axis=0)
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

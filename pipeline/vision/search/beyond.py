"""Whether the cable goes on beyond the end of what was found.

A ruled line, a thing or the border of a shadow that lies across a cable ends its strip, and what lies beyond looks like
another thing. Straight on from the end a strip of the same width whose step is the same share of its ground's
brightness is the same cable: a shadow dims both alike.
All lengths in cells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.records import Array
from pipeline.vision.median import median
from pipeline.vision.photo import straightened
from pipeline.vision.polyline import step_lengths
from pipeline.vision.rough import WIDTH_OFF, Bearing
from pipeline.vision.search.backdrop import Standout
from pipeline.vision.search.candidates import MIN_PARTNER_WIDTHS, Reading
from pipeline.vision.search.crosscut import SEEN_SHARE, CrossCut, cut_across, path_normals
from pipeline.vision.search.ends import led_on, runs_of, straight_body
from pipeline.vision.search.strips import MIN_PIECE_WIDTHS, THICK_WIDTHS, Strip, arc_joins, drawn_path, thick_part

_BEYOND_WIDTHS = 10.0  # widths; so far beyond a visible end more of the cable is looked for
_BEYOND_LEADS_WIDTHS = ((1.5, 4.0), (1.5, 10.0), (6.0, 10.0))
"""Widths; pieces by which a path is led on, how far before its end they end and how long they are: a short one follows
a bend; the end of a mask runs some widths along the border of a shadow.
"""
_BEYOND_MOST_SHARE = 3.0  # of the strip's length; followed no farther: a strip found is at least a quarter of the cable
_BEYOND_OBJECT_CONTRAST = 0.8
"""Of the strip's step; thick things that stand out so much are clamps at the end of what was followed, those that stand
out less may be shadows.
"""
_BEYOND_DARKEST = 0.02  # of full range; a ground darker than that is counted as so bright: it tells no share
_SHEET_WIDTHS = 60.0  # widths; a sheet of paper across a cable hides no more of it: 300 mm of 5 mm
_SHEET_TURN_DEG = 60.0  # degrees against the chord; a cable turns by twice that at most under a sheet
_BEYOND_CONTRAST = (0.6, 1.6)
"""Of the strip's step by its ground's brightness; a shadow leaves it as it is, but stray light and the camera's curve
do not; covers and clamps differ by more.
"""
_CLAMP_TAIL_SHARE = 0.1  # of the strip's length; a cable's tail beyond a clamp is shorter, its rest longer
_WHOLE_SHARE = 0.97  # of the known length; a strip so long with free ends is the whole cable

Axes = tuple[Bearing, Bearing]
Place = tuple[float, float]


def follow(standout: Standout, cut: CrossCut, width: float, *, least: float = MIN_PIECE_WIDTHS) -> Array | None:
    """The path of a strip, led on beyond both ends for as long as there is more of the same, ``least`` widths long.

    None where it cannot be led on.
    """
    path = cut.path
    most = (1.0 + _BEYOND_MOST_SHARE) * len(path)
    for _ in range(2):
        path = path[::-1]
        longer = _ahead(standout, cut, path, width, least)
        while longer is not None and len(path) < len(longer) < most:  # led from farther back it may be no longer
            path = longer
            longer = _ahead(standout, cut, path, width, least)
    return path if len(path) > len(cut.path) else None


def followed_in(standout: Standout, cut: CrossCut, reading: Reading, whole: Strip) -> Reading:
    """A reading with the ``whole`` in place of the piece of it whose cross-cuts are ``cut``, and of other pieces.

    What hid the rest, such as a shadow, is no part of its masks: only what stands out like the cable itself, a clamp at
    its end.
    """
    width = reading.width
    tree = cKDTree(whole.path)
    others = [strip for strip in reading.strips if median(tree.query(strip.path)[0]) > 0.5 * width]
    relief = (standout.residual @ cut.weights.astype(np.float32)) * (-1.0 if cut.dark else 1.0)
    strong = (relief > _BEYOND_OBJECT_CONTRAST * cut.contrast).astype(np.uint8)
    thick = reading.thick & thick_part(strong, THICK_WIDTHS * width)
    mask = drawn_path(whole.path, width, reading.mask.shape) | thick
    return replace(reading, strips=(whole, *others), mask=mask, thick=thick)


def _ahead(standout: Standout, cut: CrossCut, path: Array, width: float, least: float) -> Array | None:
    """The path and the more of the same beyond its last point, None if there is none.

    A path's end may be bent by what lies across, so it is led on by pieces of it that differ in length and place.
    """
    usual = median(_weber(standout, cut, width))
    best = None
    for lead in _BEYOND_LEADS_WIDTHS:
        led, ahead = _led_into_picture(standout, path, width, lead)
        if len(ahead) < least * width:
            continue
        more = cut_across(standout, ahead, width, known=True, weights=cut.weights)
        if more.dark != cut.dark:
            continue
        alike = _alike(standout, more, width, usual)
        # the cut's points are a cell apart, a bent lead's more: what it bends to at last is not followed
        stop = min(_end_of_more(more, alike, width, least, cut.contrast), len(ahead))
        if stop and (best is None or len(led) + stop > len(best)):
            best = np.vstack([led, more.path[:stop]])
            if stop > 0.8 * len(ahead):
                break  # no other lead is much better
    return best


def _end_of_more(more: CrossCut, alike: NDArray[np.bool_], width: float, least: float, contrast: float) -> int:
    """How many sections there are to the end of the last long run of those alike; 0 without a long one."""
    long = [stop for start, stop in runs_of(alike) if stop - start > least * width]
    if not long:
        return 0
    stop = long[-1]
    # edges are lost at the rounded corners of an end, a width of it at most
    faint = np.flatnonzero(more.step[stop : stop + round(width)] < SEEN_SHARE * contrast)
    return min(stop + (int(faint[0]) if len(faint) else round(width)), len(alike))


def _led_into_picture(standout: Standout, path: Array, width: float, lead: tuple[float, float]) -> tuple[Array, Array]:
    """The path, and what it is led on by beyond its last point as far as the picture goes."""
    body, _ = straight_body(path, width, lead[0] * width)
    reach = float(np.hypot(*(path[-1] - body[-1])))
    led = led_on(body, reach + _BEYOND_WIDTHS * width, width, base=lead[1])
    led, ahead = np.split(led, [len(body) + int(reach)])
    rows, columns = standout.residual.shape[:2]
    inside = np.all((ahead >= 0) & (ahead <= (columns - 1, rows - 1)), axis=1)
    return led, ahead if inside.all() else ahead[: int(np.argmin(inside))]


def _alike(standout: Standout, cut: CrossCut, width: float, usual: float) -> NDArray[np.bool_]:
    low, high = _BEYOND_CONTRAST
    share = _weber(standout, cut, width) / usual
    return (np.abs(cut.width / width - 1.0) < WIDTH_OFF) & (share > low) & (share < high)


def _weber(standout: Standout, cut: CrossCut, width: float) -> Array:
    """Step of each section by the brightness of its ground."""
    aside = np.array([-1.2, 1.2]) * width
    ground = straightened(standout.picture, cut.path, path_normals(cut.path), aside).mean(axis=(1, 2))
    return np.asarray(cut.step / np.maximum(ground, _BEYOND_DARKEST))


def more_beyond(
    standout: Standout, cut: CrossCut, axes: Axes, others: list[Strip], *, length_px: float | None, least: float
) -> Place | None:
    """The visible end of a strip beyond which the cable goes on: straight on, or nearest to it beyond what hides it.

    A sheet of paper hides more than is looked across, and is no larger thing where it has the ground's colour.

    Parameters
    ----------
    cut : CrossCut
        The strip's cross-cuts.
    axes : pair of Bearing
        At its first and its last point.
    others : list of Strip
        Other strips of the reading.
    length_px : px or None
        Of the cable; a strip so long has no rest beyond a sheet.
    least : widths
        Of what straight on counts as more of it.
    """
    paths = zip(axes, (cut.path[::-1], cut.path), strict=True)
    ends = [(axis, path) for axis, path in paths if axis.kind in ("end", "clamp")]
    for axis, path in ends:
        if _ahead(standout, cut, path, cut.usual_width, least) is not None:
            return axis.center_px
    length, gaps = float(step_lengths(cut.path).sum()), []
    if length_px is not None and length * standout.reduction > _WHOLE_SHARE * length_px:
        return None
    for axis, path in ends:
        # beyond a clamp the tail of the cable comes out again
        tail = _CLAMP_TAIL_SHARE * length if axis.kind == "clamp" else 0.0
        gap = _gap_to_rest(standout, cut, path, [other for other in others if other.length > tail])
        gaps += [] if gap is None else [(gap, axis.center_px)]
    return min(gaps)[1] if gaps else None


def _gap_to_rest(standout: Standout, cut: CrossCut, path: Array, others: list[Strip]) -> float | None:
    """Gap in cells to another strip of the same look where an arc that leaves the path's end would go on, if any."""
    width, usual = cut.usual_width, median(_weber(standout, cut, cut.usual_width))
    facing = [
        (float(np.hypot(*(rest[0] - path[-1]))), rest)
        for other in others
        for rest in (other.path, other.path[::-1])
        if other.length > MIN_PARTNER_WIDTHS * width and arc_joins(path, rest, width, _SHEET_TURN_DEG)
    ]
    near = [found for found in facing if found[0] <= _SHEET_WIDTHS * width]
    for gap, rest in sorted(near, key=lambda found: found[0]):
        more = cut_across(standout, rest, width, known=True, weights=cut.weights)
        if more.dark == cut.dark and np.mean(_alike(standout, more, width, usual)) > 0.5:
            return gap
    return None

"""Whether a strip is the whole cable between its axes, or a piece of it: what lies beyond its ends tells.

Each function gives the place ``(u, v)`` in px up to which the cable was followed, or None where nothing shows more.
"""

from __future__ import annotations

import numpy as np

from pipeline.records import Array
from pipeline.vision.polyline import step_lengths
from pipeline.vision.rough import Bearing
from pipeline.vision.search.backdrop import Standout
from pipeline.vision.search.beyond import LEAST_MORE_WIDTHS, fades, goes_on, rest_ahead
from pipeline.vision.search.crosscut import CrossCut
from pipeline.vision.search.strips import Strip

Axes = tuple[Bearing, Bearing]
Place = tuple[float, float]

_HIDDEN_WIDTHS = 15.0  # widths; what hides an end before an axis that was given is no longer: a clamp of 30 mm on 2 mm
_UNLIKE_WIDTHS = 6.0  # widths; a longer rest of a strip that looks unlike it is no cover: those are 2 to 6 wide
_CLAMP_TAIL_SHARE = 0.1  # of the strip's length; a cable's tail beyond a clamp is shorter, its rest longer
_WHOLE_SHARE = 0.97  # of the known length; a strip so long with free ends is the whole cable


def goes_on_at(standout: Standout, cut: CrossCut, axes: Axes) -> Place | None:
    """A visible end beyond which there is more of the same close by, or at which the cable only fades."""
    width = cut.usual_width
    for axis, at_start in zip(axes, (True, False), strict=True):
        if axis.kind in ("end", "clamp") and goes_on(standout, cut, width, at_start=at_start):
            return axis.center_px
        if axis.kind == "end" and fades(standout, cut, width, at_start=at_start):
            return axis.center_px
    return None


def rest_faced_at(
    standout: Standout, cut: CrossCut, axes: Axes, others: list[Strip], *, length_px: float | None
) -> Place | None:
    """The visible end that faces another strip like this one nearest: the rest of the cable beyond what hides it.

    ``others`` are the other strips of the reading; a strip as long as the cable is known to be, ``length_px``, has no
    rest.
    """
    length = float(step_lengths(cut.path).sum())
    if length_px is not None and length * standout.reduction > _WHOLE_SHARE * length_px:
        return None
    gaps: list[tuple[float, Place]] = []
    for axis, at_start in zip(axes, (True, False), strict=True):
        # beyond a clamp the tail of the cable comes out again
        tail = _CLAMP_TAIL_SHARE * length if axis.kind == "clamp" else 0.0
        rest = [other for other in others if other.length > tail]
        gap = rest_ahead(standout, cut, rest, at_start=at_start) if axis.kind in ("end", "clamp") else None
        gaps += [] if gap is None else [(gap, axis.center_px)]
    return min(gaps)[1] if gaps else None


def short_of_axis(standout: Standout, cut: CrossCut, axes: Axes) -> Place | None:
    """The end of a strip that lies before an axis that the user gave: far from it, or while the cable goes on."""
    width = cut.usual_width
    path = standout.to_pixels(cut.path)
    near, far = LEAST_MORE_WIDTHS * width * standout.reduction, _HIDDEN_WIDTHS * width * standout.reduction
    for axis, at_start in zip(axes, (True, False), strict=True):
        distance = np.hypot(*(path - axis.center_px).T)
        end = 0 if at_start else len(path) - 1
        # a strip that passes the axis is nearest to it before its end
        ahead = abs(int(np.argmin(distance)) - end) * standout.reduction < 0.5 * distance[end]
        if axis.kind != "given" or not ahead or distance[end] < near:
            continue
        if distance[end] > far or goes_on(standout, cut, width, at_start=at_start):
            return float(path[end, 0]), float(path[end, 1])
    return None


def unlike_from(path: Array, kept: slice, axes: Axes, width: float) -> Place | None:
    """Where a strip (n, 2) in px, points a cell apart, begins to look unlike the part of it that is ``kept``, long.

    A cable whose sheath changes its colour is a strip of one width, but what one colour tells ends with that; under a
    visible end such a rest is no end of it.
    """
    rests = ((axes[0], kept.start, kept.start), (axes[1], len(path) - kept.stop, kept.stop - 1))
    for axis, rest, last in rests:
        if axis.kind in ("end", "clamp") and rest > _UNLIKE_WIDTHS * width:
            return float(path[last, 0]), float(path[last, 1])
    return None

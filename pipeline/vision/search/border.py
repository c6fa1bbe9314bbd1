"""Whether a strip is as wide as the thing it lies on: from border to border of what runs along it.

``photo along the strip -> slopes across it -> the steepest course of an edge beside it, against the strip's own``

A highlight along a cable and its lit or shaded half are strips of one width from end to end, with two edges, and where
no width is known nothing else tells them from a cable. But the border of a cable is as sharp as the lens draws it, and
so is the border that lies beside its highlight; shade on a round sheath, and the rim of a shadow, are softer.

Lengths in px, and in *widths* of the strip.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from pipeline.records import Array
from pipeline.vision.median import medians
from pipeline.vision.photo import Photo, values_at
from pipeline.vision.rough import RoughCable
from pipeline.vision.search.crosscut import best_course, path_normals

_GROUPS = 24  # of neighbouring sections; in each letters and speckles average and the course hardly turns
_OWN, _BESIDE, _GROUND = (0.25, 0.75), (0.75, 2.75), (3.0, 5.0)  # widths from the middle; the middle is off by a tenth
_AS_SHARP = 0.5  # of the slope of the strip's weaker edge: shadows of 72 lamps reach 0.3, a cable's borders 0.5 to 2
_ABOVE_GROUND = 2.0  # times the steepest course on the ground farther out: speckles and weave have edges too
_MOVED = 2.0  # of a usual slope, for each px that a course moves from group to group


def border_width(photo: Photo, found: RoughCable) -> float | None:
    """Width (px) from border to border of what the strip found is a part of; None if it is the whole of it."""
    first, last = found.visible
    middle = found.path_px[first : last + 1]
    width = 2.0 * found.half_width_px
    offsets = np.arange(-_GROUND[1] * width, _GROUND[1] * width + 1.0)
    across = path_normals(middle)[1]
    grey = values_at(photo, middle[:, None] + offsets[:, None] * across[:, None]) @ np.array(found.weights, np.float32)
    groups = np.array([medians(group, axis=0) for group in np.array_split(grey, _GROUPS)], np.float64)
    slope = gaussian_filter1d(groups, 1.0, axis=1, order=1)
    sides = [_edges(slope, side * offsets / width) for side in (-1.0, 1.0)]
    own = min(edges[0][0] for edges in sides)
    ground = min(edges[2][0] for edges in sides)
    beside = [edges[1] for edges in sides]
    borders = [place if sharp > max(_AS_SHARP * own, _ABOVE_GROUND * ground) else 0.5 for sharp, place in beside]
    return None if borders == [0.5, 0.5] else sum(borders) * width


def _edges(slope: Array, offsets: Array) -> list[tuple[float, float]]:
    """Mean slope along the steepest course at the strip's edge, beside it and on the ground, and its place."""
    found = []
    for low, high in (_OWN, _BESIDE, _GROUND):
        there = (offsets > low) & (offsets < high)
        ways = []
        for sign in (-1.0, 1.0):
            edge = sign * slope[:, there]
            columns = best_course(edge, _MOVED * float(np.abs(edge).max(axis=1).mean()))
            ways.append((float(edge[np.arange(len(edge)), columns].mean()), float(np.median(offsets[there][columns]))))
        found.append(max(ways))
    return found

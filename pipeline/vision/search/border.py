"""Whether the edges of a strip are the borders of the thing it lies on.

``photo along the strip -> slopes across it -> the steepest course of an edge beside it, against the strip's own``

A highlight along a cable and its lit or shaded half are strips of one width from end to end, with two edges, and where
no width is known nothing else tells them from a cable. But the border of a cable is as sharp as the lens draws it, and
so is the border that lies beside its highlight; shade on a round sheath, and the rim of a shadow, are softer. From the
rim of a shadow to a shade on a pale sheath there is a strip too, which may be as wide as the cable.

Lengths in px, and in *widths* of the strip.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from pipeline.records import Array
from pipeline.vision.median import median, medians
from pipeline.vision.photo import Closeup, Photo, straightened, values_at
from pipeline.vision.rough import RoughCable
from pipeline.vision.search.crosscut import best_course, path_normals

_GROUPS = 24  # of neighbouring sections; in each letters and speckles average and the course hardly turns
_OWN, _BESIDE, _GROUND = (0.25, 0.75), (0.75, 2.75), (3.0, 5.0)  # widths from the middle; the middle is off by a tenth
_AS_SHARP = 0.5  # of the slope of the strip's weaker edge: shadows of 72 lamps reach 0.3, a cable's borders 0.5 to 2
_ABOVE_GROUND = 2.0  # times the steepest course on the ground farther out: speckles and weave have edges too
_FARTHEST = 1.2  # widths from the middle to which a sharper edge than the strip's is sought
_SCALES = 0.05, 0.15  # widths; of a step, slopes on them differ threefold, of a rim as broad as the second hardly
_SHARPER = 2.0  # of that ratio: rims of shadows beside borders 2.5 and more, borders beside stripes and print below 1.9
_LEAST_SPACING = 0.05  # widths; a strip 2 px wide has edges to be told apart too
_MOVED = 2.0  # of a usual slope, for each column that a course moves from group to group


def border_width(photo: Photo, found: RoughCable) -> float | None:
    """Width (px) from border to border of what the strip found is a part of; None if it is the whole of it."""
    middle, width = found.seen_px, 2.0 * found.half_width_px
    offsets, spacing = _offsets(_GROUND[1], width)
    across = path_normals(middle)
    grey = values_at(photo, middle[:, None] + offsets[:, None] * across[:, None]) @ np.array(found.weights, np.float32)
    slope, places = _slopes(grey, 1.0 / spacing), (_OWN, _BESIDE, _GROUND)
    sides = [[_steepest(slope, side * offsets / width, place)[:2] for place in places] for side in (-1.0, 1.0)]
    own = min(edges[0][0] for edges in sides)
    ground = min(edges[2][0] for edges in sides)
    beside = [edges[1] for edges in sides]
    borders = [place if sharp > max(_AS_SHARP * own, _ABOVE_GROUND * ground) else 0.5 for sharp, place in beside]
    return None if borders == [0.5, 0.5] else sum(borders) * width


def soft_beside_sharp(closeup: Closeup, middle: Array, across: Array, width: float) -> bool:
    """Whether an edge of the strip is the rim of a shadow or shade: a sharper one runs along it, in it or beside it.

    Parameters
    ----------
    middle, across : (n, 2) px, -
        Along the midline as measured, and unit vectors across it.
    width : px
    """
    offsets, spacing = _offsets(_FARTHEST, width)
    grey = straightened(closeup.grey, middle - closeup.origin_px, across, offsets)[..., 0]
    fine, broad = (_slopes(grey, scale * width / spacing) for scale in _SCALES)
    places = [(-0.6, -0.4), (0.4, 0.6), (-_FARTHEST, -0.65), (-0.35, 0.35), (0.65, _FARTHEST)]
    first, second, *others = (_sharpness(fine, broad, offsets / width, place) for place in places)
    own = min(first, second, key=lambda edge: edge[1])
    return any(slope > own[0] and sharp > _SHARPER * own[1] for slope, sharp in others)


def _offsets(reach: float, width: float) -> tuple[Array, float]:
    """Offsets (m,) px up to ``reach`` widths on both sides, and their spacing: of pixels, on thin strips closer."""
    spacing = min(1.0, _LEAST_SPACING * width)
    return np.arange(-reach * width, reach * width + spacing, spacing), spacing


def _sharpness(fine: Array, broad: Array, offsets: Array, place: tuple[float, float]) -> tuple[float, float]:
    """Slope along the steepest course within ``place``, and its ratio to that of the same on the broader scale."""
    slope, _, sign, columns = _steepest(fine, offsets, place)
    there = (offsets > place[0]) & (offsets < place[1])
    smoothed = sign * float(np.median(broad[:, there][np.arange(len(broad)), columns]))
    return slope, min(slope / max(smoothed, 1e-9), _SCALES[1] / _SCALES[0])


def _slopes(grey: NDArray[np.float32], scale: float) -> Array:
    groups = np.array([medians(group, axis=0) for group in np.array_split(grey, _GROUPS)], np.float64)
    return np.asarray(gaussian_filter1d(groups, scale, axis=1, order=1))


def _steepest(slope: Array, offsets: Array, place: tuple[float, float]) -> tuple[float, float, float, NDArray[np.intp]]:
    """Median slope along the steepest course within ``place``, where that lies, its sign, and its columns."""
    there = (offsets > place[0]) & (offsets < place[1])
    ways = []
    for sign in (-1.0, 1.0):
        edge = sign * slope[:, there]
        columns = best_course(edge, _MOVED * float(np.abs(edge).max(axis=1).mean()))
        along = median(edge[np.arange(len(edge)), columns])
        ways.append((along, median(offsets[there][columns]), sign, columns))
    return max(ways, key=lambda way: way[0])

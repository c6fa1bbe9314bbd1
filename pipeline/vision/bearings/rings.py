"""Circles turned on the axis of a bearing cover: dot, groove and bevel tell its centre as well as the rim does.

``photo, circle of the rim -> place about which the cover is most round -> rings there -> one centre of all``

A shadow, an arm or the cable beside the rim leads a fit of the rim astray; what lies on the cover they do not touch.
About the true centre the mean grey value on circles falls and rises in sharp steps; about any other place the steps
are smeared. The sum of the squared slopes of that mean is the measure of roundness. What is not round, the quadrants of
a target or a slotted screw, tells the axis by looking the same turned by half a turn.
Units: px of the photo as displayed.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from pipeline.records import Array
from pipeline.vision.bearings.rim import (
    CENTER_STD_FLOOR_PX,
    NEAR_RADII,
    RIM_OVER_TEXTURE,
    SURE_RIM,
    Circle,
    Radius,
    fit_circle,
)
from pipeline.vision.median import median
from pipeline.vision.photo import Photo, reduce_area, values_at

MARK_CELLS = 12.0  # cells; a mark's largest radius in the picture it is searched on: a line stays a cell wide
SAME_AXIS_RADII = 0.03  # radii; a ring farther off was not turned on the axis: a sticker, a hole beside it
_ASTRAY_RADII = 0.16  # radii; how far a rim that is not sure may lie off the centre: half a bevel
_RING_RANGE = (0.1, 0.96)  # radii; where dots, grooves and bevels lie: below is a punch mark, above the rim
_TURNED_RADII = 0.8  # radii; of what lies on a cover: its rim and the shade beside it are not compared
_ALIKE_TURNED = 0.8  # correlation of a cover with itself turned by half a turn from which that is no chance


def with_rings(photo: Photo, rim: Circle, expected: Radius) -> Circle:
    """The circle of a cover, its centre by rim and rings together.

    Parameters
    ----------
    rim : Circle
        Fitted to the rim.

    Returns
    -------
    Circle
        As it was where no ring is seen. A rim that is not seen all round, or lies
        elsewhere, yields to the rings; else all are averaged by their variances, which are widened to what they differ.
    """
    whole = rim.rim >= SURE_RIM
    rings = _rings(photo, _roundest(photo, np.array(rim.center), expected.px), expected.px)
    rings = rings or _turned_half(photo, rim, expected.px)
    if not rings:
        return rim
    apart = max(np.hypot(*np.subtract(ring.center, rim.center)) for ring in rings)
    agree = apart < SAME_AXIS_RADII * expected.px
    sure = whole and agree
    circles = [rim, *rings] if sure else rings
    weight = np.array([circle.std**-2.0 for circle in circles])
    centers = np.array([circle.center for circle in circles])
    middle = weight @ centers / weight.sum()
    # Their own variances count as much as two differences: an inverse gamma prior of two degrees of freedom.
    misfit = float((weight @ (centers - middle) ** 2).sum())
    std = float(np.sqrt((2.0 + misfit) / (2 * len(circles)) / weight.sum()))
    std = max(std, CENTER_STD_FLOOR_PX)  # common to all circles of a cover
    if sure:
        return replace(rim, center=(float(middle[0]), float(middle[1])), std=std)
    # What was taken for the rim is none, or part of one: the radius is the expected one.
    doubt = float(np.hypot(rim.radius_std, abs(rim.radius - expected.px)))
    return Circle((float(middle[0]), float(middle[1])), expected.px, std, doubt, rim.rim, agree)


def _turned_half(photo: Photo, rim: Circle, radius: float) -> list[Circle]:
    """The point about which what lies on a cover looks the same turned by half a turn; empty without such a point.

    Quadrants, a cross or a slotted screw are not round: on circles about their centre there is no ring. The picture is
    held against itself turned: where it fits best, both centres lie twice as far apart as the true one is off.
    """
    reach, half = max(2, round(_ASTRAY_RADII * radius)), int(_TURNED_RADII * radius)
    low, (u, v) = np.rint(rim.center).astype(int) - half - 2 * reach, np.mgrid[-half : half + 1, -half : half + 1]
    high = low + 2 * (half + 2 * reach) + 1
    if half < 4 or (low < 0).any() or (high > photo.size).any():
        return []
    part = photo.pixels[low[1] : high[1], low[0] : high[0]].astype(np.float32) / np.float32(photo.full_scale)
    inner = slice(2 * reach, -2 * reach)
    turned, disc = part[inner, inner][::-1, ::-1].copy(), (u**2 + v**2 <= half**2).astype(np.float32)
    fit = cv2.matchTemplate(part, turned, cv2.TM_CCOEFF_NORMED, mask=disc)
    row, column = np.unravel_index(int(np.argmax(fit)), fit.shape)
    if not (fit[row, column] > _ALIKE_TURNED and 0 < row < len(fit) - 1 and 0 < column < len(fit) - 1):
        return []
    shift, curved = [], []
    for before, at, after in (fit[row, column - 1 : column + 2], fit[row - 1 : row + 2, column]):
        curved.append(float(2.0 * at - before - after))
        shift.append(0.5 * float(after - before) / curved[-1])
    off = np.array([column, row]) + shift - 2.0 * reach
    # what does not fit is light from one side rather than noise: it tells as little as one line of values does
    misfit = (1.0 - float(fit[row, column])) / half
    std = float(np.hypot(0.5 * np.sqrt(misfit / min(curved)), CENTER_STD_FLOOR_PX))
    center = low + half + 2 * reach + 0.5 * off
    return [Circle((float(center[0]), float(center[1])), float(half), std, 0.1 * radius, 1.0)]


def find_marks(photo: Photo, places: Array, reach: float) -> list[Circle]:
    """Rings turned about some places, the surest first: dots, screws and grooves seen all round.

    Parameters
    ----------
    places : (k, 2) px
        Where its centre may be, closer together than a cell of the search (``MARK_CELLS`` to the reach).
    reach : px
        Largest radius of the ring.
    """
    reduction = max(1, int(reach / MARK_CELLS))
    low = np.maximum(np.floor(places.min(axis=0) - 1.2 * reach).astype(int), 0)
    high = np.minimum(np.ceil(places.max(axis=0) + 1.2 * reach).astype(int) + 1, photo.size)
    size = (high - low) // reduction
    if (size < 4).any():
        return []
    part = photo.pixels[low[1] : low[1] + size[1] * reduction, low[0] : low[0] + size[0] * reduction]
    small = Photo(photo.name, reduce_area(part, (int(size[0]), int(size[1]))), photo.bit_depth)
    cells = (places - low - 0.5 * (reduction - 1)) / reduction
    # OpenCV draws pictures of 32767 rows at most
    groups = np.array_split(cells, len(cells) // 400 + 1)
    roundness = np.concatenate(
        [(_slopes(small, group, reach / reduction, 0.7) ** 2).sum(axis=(1, 2)) for group in groups]
    )
    found: list[Circle] = []
    for _ in range(4):  # edges of cover and shadow pass for round places
        place = places[int(np.argmax(roundness))]
        found += _rings(photo, _roundest(photo, place, reach), reach)
        roundness[np.hypot(*(places - place).T) < 0.3 * reach] = -1.0
    return sorted(found, key=lambda ring: ring.std)


def _roundest(photo: Photo, center: Array, radius: float) -> Array:
    """Place within reach of ``center`` about which the cover is most round, to a hundredth of its radius."""
    reach = _ASTRAY_RADII * radius
    for finer in range(3):
        step = reach / 4.0 / 4.0**finer
        grid = np.arange(-4 if finer == 0 else -3, 5 if finer == 0 else 4) * step
        places = center + np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
        slopes = _slopes(photo, places, radius, radius / 40.0)
        center = places[int(np.argmax((slopes**2).sum(axis=(1, 2))))]
    return np.asarray(center)


def _slopes(photo: Photo, centers: Array, radius: float, step: float) -> Array:
    """Slope ``(k, m, c)`` of the mean grey value on circles about each of ``centers``, on radii ``step`` px apart."""
    angle = np.arange(64) * (np.pi / 32.0)
    distance = np.arange(0.06 * radius, 1.06 * radius, step)
    rays = distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])[:, None]
    # all centres in one picture: a row for each ray of each
    values = values_at(photo, (rays + centers[:, None, None]).reshape(-1, len(distance), 2))
    mean = values.reshape(len(centers), len(angle), len(distance), -1).mean(axis=1)
    return np.asarray(np.diff(mean, axis=1) / step)


def _rings(photo: Photo, center: Array, radius: float) -> list[Circle]:
    """Circles seen nearly all round about ``center``, the rim itself not among them."""
    slope = np.hypot.reduce(_slopes(photo, center[None], radius, 1.0)[0], axis=1)
    distance = 0.06 * radius + 0.5 + np.arange(len(slope))
    slope[(distance < _RING_RANGE[0] * radius) | (distance > _RING_RANGE[1] * radius)] = 0.0
    least = RIM_OVER_TEXTURE * median(slope[slope > 0.0]) if slope.any() else np.inf
    found: list[Circle] = []
    for _ in range(2):  # the strongest rings tell the most
        at = int(np.argmax(slope))
        if slope[at] <= least:
            break
        expected = Radius(float(distance[at]), 1.0 / float(distance[at]))  # to a pixel, by the mean of all rays
        ring = fit_circle(photo, center, expected, on_cover=True)
        slope[np.abs(distance - distance[at]) < max(4.0, 2.0 * NEAR_RADII * radius)] = 0.0
        within = ring is not None and _RING_RANGE[0] <= ring.radius / radius <= _RING_RANGE[1]
        if ring is None or not within or ring.rim < SURE_RIM:
            continue
        if np.hypot(*(np.array(ring.center) - center)) < SAME_AXIS_RADII * radius:
            found.append(ring)
    return found

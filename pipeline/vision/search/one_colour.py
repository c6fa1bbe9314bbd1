"""A photo in the colour in which a cable of several colours is one thing.

A striped wire is two strips, and the one that stands out more passes for a cable. Fisher's discriminant between ground
and cable, with the scatter of the cable's own colours in it, is the direction of colour along which its stripes are
alike; a shadow beside it, which is the ground's colour but darker, mostly fades in it.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array
from pipeline.vision.photo import Photo, sampled
from pipeline.vision.rough import RoughCable
from pipeline.vision.search.backdrop import Standout
from pipeline.vision.search.crosscut import path_normals

_UNEVEN = 0.3  # of the step to the ground; cables of one colour with gloss, print and shade scatter by less
_STIFF = 0.01  # of the squared step, added to every colour's variance: colours that hardly differ are not chased
_CORE = 0.45  # of the depth around; cells of a mask nearer to its rim than that are mixed with the ground
_AROUND = np.ones((9, 9), np.uint8)  # cells
_SHADE_COSINE, _DARKEST_SHADE = 0.97, 0.5  # of the ground's colour; a lamp leaves half of the light in a shadow
_INSIDE, _BESIDE = np.linspace(-0.3, 0.3, 7), np.linspace(0.9, 1.3, 4)  # widths from a cable's middle
_ROWS = 256  # px; worked on at a time: large photos shall not be held as single precision
_LEAST_CABLE = 0.25  # of what stands out; with less, its colours are those of shadow or of other things
_COLOUR_GRID_PX = 2.0  # px; of a Bayer filter, and of JPEG with 4:2:0


def in_one_colour(photo: Photo, standout: Standout) -> Photo | None:
    """The photo as grey values along that direction; None where what stands out is of one brightness as it is."""
    cable, shadow = (standout.residual[part].astype(np.float64) for part in _cable_and_shadow(standout))
    channels, count = cable.shape[1], len(cable) + len(shadow)
    if channels == 1 or len(cable) < max(4 * channels, _LEAST_CABLE * count):
        return None
    core = np.concatenate([cable, shadow])
    seen = core @ np.linalg.solve(standout.covariance, np.median(core, axis=0))
    if np.std(seen) < _UNEVEN * np.median(seen):
        return None
    return _along(photo, cable, standout.covariance + shadow.T @ shadow / (len(shadow) + 1.0))


def _cable_and_shadow(standout: Standout) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Cells ``(h, w)`` in the middle of what stands out, and those of them whose colour is the ground's, dimmed."""
    mask = (standout.distance > standout.levels[0]).astype(np.uint8)
    depth = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    middle = (depth >= _CORE * cv2.dilate(depth, _AROUND)) & (mask > 0)
    ground = standout.picture - standout.residual
    less, light = -(standout.residual * ground).sum(axis=2), np.linalg.norm(ground, axis=2)
    sizes = np.linalg.norm(standout.residual, axis=2)
    shadow = (less > _SHADE_COSINE * sizes * light) & (sizes < _DARKEST_SHADE * light)
    return middle & ~shadow, middle & shadow


def in_colour_of(photo: Photo, standout: Standout, cable: RoughCable) -> Photo | None:
    """The same by a cable that was found: its colours, and those of the ground and shadow beside it.

    None where nearly all of what stands out lies elsewhere: then its colours were not those of this cable.
    """
    first, last = cable.visible
    path = standout.to_cells(cable.path_px[first : last + 1])
    width = 2.0 * cable.half_width_px / standout.reduction
    stands_out, drawn = _cable_and_shadow(standout)[0], np.zeros(standout.residual.shape[:2], np.uint8)
    cv2.polylines(drawn, [np.rint(path).astype(np.int32)], False, 1, max(1, round(width)))
    if np.count_nonzero(stands_out & (drawn > 0)) < _LEAST_CABLE * np.count_nonzero(stands_out):
        return None
    across = width * path_normals(path)[1][:, None]

    def colours(widths: Array) -> Array:
        found = sampled(standout.residual, path[:, None] + widths[:, None] * across)
        return found.reshape(-1, found.shape[-1]).astype(np.float64)

    beside = colours(np.concatenate([-_BESIDE, _BESIDE]))
    ground = standout.covariance + np.cov(beside.T)
    return _along(photo, colours(_INSIDE) - np.median(beside, axis=0), ground)


def _along(photo: Photo, core: Array, ground: Array) -> Photo:
    """Grey values by the discriminant of colours ``(n, c)`` less the ground's, of a covariance ``(c, c)``."""
    step = np.median(core, axis=0)
    scatter = ground + np.cov(core.T) + _STIFF * (step @ step) * np.eye(len(step))
    weights = np.linalg.solve(scatter, step)
    weights *= np.sign(weights.sum()) / np.abs(weights).sum()
    darkest = float(np.minimum(weights, 0.0).sum())
    scaled = (65535.0 / photo.full_scale * weights).astype(np.float32)[None]
    grey = np.empty(photo.pixels.shape[:2], np.uint16)
    for rows in (slice(first, first + _ROWS) for first in range(0, len(grey), _ROWS)):
        grey[rows] = np.rint(cv2.transform(photo.pixels[rows].astype(np.float32), scaled) - 65535.0 * darkest)
    return Photo(photo.name, grey, 16, _COLOUR_GRID_PX)

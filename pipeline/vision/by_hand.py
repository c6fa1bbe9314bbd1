"""A person's hand on the search: look only here, this is no cable, its axes are there, it runs along these clicks.

``photo, PhotoHints -> photo without what was excluded, what is known of the cable with the rest``

What is excluded is painted in the colour of the ground around it: the cable then vanishes there as below a sheet of
paper, and no edge is measured on it.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.records import Array, PhotoHints
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo
from pipeline.vision.polyline import arc_lengths
from pipeline.vision.search.backdrop import Standout
from pipeline.vision.search.candidates import Reading
from pipeline.vision.search.strips import Strip, drawn_path


def with_hints(photo: Photo, cable: Cable, hints: PhotoHints) -> tuple[Photo, Cable]:
    """The photo and what is known of its cable, by what a person says."""
    for polygon in hints.exclude_px:
        photo = _painted(photo, np.array(polygon))
    ends = hints.ends_px
    if hints.path_px:
        ends = ends or (hints.path_px[0], hints.path_px[-1])
    bearings = cable.bearings if ends is None else BearingHints(given_px=ends)
    return photo, replace(cable, bearings=bearings, region=_window(hints, photo), path_px=hints.path_px)


def _window(hints: PhotoHints, photo: Photo) -> tuple[int, int, int, int] | None:
    if hints.region_px is None:
        return None
    low, high = np.floor(hints.region_px[:2]).astype(int), np.ceil(hints.region_px[2:]).astype(int) + 1
    (u0, v0), (u1, v1) = np.clip(low, 0, np.array(photo.size) - 1), np.clip(high, 1, photo.size)
    return int(u0), int(v0), int(u1), int(v1)


def _painted(photo: Photo, polygon: Array) -> Photo:
    """The photo with a polygon (n, 2) px in the median colour of a band around it."""
    inside = np.zeros(photo.pixels.shape[:2], np.uint8)
    cv2.fillPoly(inside, [np.rint(polygon).astype(np.int32)], 1)
    reach = 2 * max(3, round(0.1 * float(np.ptp(polygon, axis=0).max()))) + 1
    around = (cv2.dilate(inside, np.ones((reach, reach), np.uint8)) > 0) & (inside == 0)
    if not inside.any() or not around.any():
        return photo
    pixels = photo.pixels.copy()
    pixels[inside > 0] = np.median(pixels[around], axis=0).astype(pixels.dtype)
    return replace(photo, pixels=pixels)


def reading_along(standout: Standout, path_px: tuple[tuple[float, float], ...], width_px: float) -> Reading:
    """A reading with one strip, of a width (px), along clicks."""
    clicks = standout.to_cells(np.array(path_px))
    s = arc_lengths(clicks)
    keep = np.r_[True, np.diff(s) > 0.0]
    path = CubicSpline(s[keep], clicks[keep])(np.linspace(0.0, s[-1], max(3, round(s[-1]) + 1)))
    width = width_px / standout.reduction
    mask = drawn_path(path, width, standout.residual.shape)
    return Reading((Strip(path, width),), mask, np.zeros_like(mask), width, 0.0)

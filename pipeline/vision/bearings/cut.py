"""A round cover by the arc in which it cuts the cable off: seen wherever it differs from the cable, on any ground.

``photo, end of the cable, radius -> where sheath turns into something else along the cable -> arc -> circle``

A pin of the ground's own grey shows no rim, but the sheath ends on it in a hollow, and comes out of it beyond in
another one. A cut by pliers is straight, and round ends bulge: only a cover makes a hollow of its radius.
Units: px of the photo as displayed.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from pipeline.records import Array
from pipeline.vision.bearings.rim import CENTER_STD_FLOOR_PX, Circle, Radius
from pipeline.vision.median import medians, scatter
from pipeline.vision.photo import Photo, values_at
from pipeline.vision.search.ends import CableEnd, runs_of

_ROWS, _HALF_WIDTHS = 21, 0.4  # rows along the cable, within so many widths of its middle: beyond is its shaded flank
_STEP_PX = 0.5
_BACK_RADII = 4.0  # radii; a stub beyond a pin is no longer, and more of it is the cable that comes again
_LEAST_RUN_RADII = 1.0  # radii; a cover hides the sheath for two, bands and print for less
_HOLLOW = 2.0  # ratio of the variances about the straight line and about the arc from which it is an arc
_LOOSE_PX = 0.3  # px; usual error of an edge along one row
_MOST_SPREAD_PX = 1.0  # px; rows that miss an arc by more lie on none: on the border of a band aslant by 3 px


def cover_by_cut(photo: Photo, end: CableEnd, radius: Radius, width_px: float) -> Circle | None:
    """The cover of an expected radius whose rim cuts the cable off near its end; None where none does.

    Parameters
    ----------
    end : CableEnd
        Where the cable's mask ends: on the rim, or where a stub of it beyond the cover does.
    width_px : px
        Of the cable.
    """
    along = np.arange(-_BACK_RADII * radius.px - 2.0 * width_px, 1.5 * radius.px, _STEP_PX)
    rows = np.linspace(-_HALF_WIDTHS, _HALF_WIDTHS, _ROWS) * width_px
    normal = np.array([-end.outward[1], end.outward[0]])
    points = end.place + along[:, None] * end.outward + rows[:, None, None] * normal
    values = values_at(photo, points)
    sheath = medians(values[:, along < along[0] + 2.0 * width_px], axis=1)[:, None]
    off = values - sheath
    usual = np.linalg.norm(medians(off, axis=0), axis=1)
    for start, stop in runs_of(usual > 0.5 * usual.max()):
        if (stop - start) * _STEP_PX < _LEAST_RUN_RADII * radius.px:
            continue
        # each row in units of its own change: blur takes part of it from the outer ones
        each = off[:, start:stop].mean(axis=1)
        change = each.mean(axis=0)
        relief = off @ change / np.maximum(each @ change, 0.3 * (change @ change) + 1e-12)[:, None]
        found = _arc(relief, along, rows, float(along[start]), radius)
        if found is not None:
            (ahead, aside), std = found
            center = end.place + ahead * end.outward + aside * normal
            share = width_px / (2.0 * np.pi * radius.px)
            return Circle((float(center[0]), float(center[1])), radius.px, std, radius.std * radius.px, share)
    return None


def _arc(relief: Array, along: Array, rows: Array, about: float, radius: Radius) -> tuple[Array, float] | None:
    """Centre (2,) of the cover along and aside, and its std, by where each row leaves the sheath near ``about``."""
    near = np.flatnonzero(np.abs(along[:-1] - about) < 0.3 * radius.px)
    rising = (relief[:, near] < 0.5) & (relief[:, near + 1] >= 0.5)
    there = rising.any(axis=1)
    if np.count_nonzero(there) < 0.7 * _ROWS:
        return None
    first = near[np.argmax(rising[there], axis=1)]
    before, after = relief[there, first], relief[there, first + 1]
    place, row = along[first] + _STEP_PX * (0.5 - before) / (after - before), rows[there]
    start = np.array([float(np.median(place + np.sqrt(radius.px**2 - row**2))), 0.0])

    def misses(center: Array) -> Array:
        return np.asarray((np.hypot(place - center[0], row - center[1]) - radius.px) / _LOOSE_PX)

    fit = least_squares(misses, start, loss="soft_l1")
    straight = place - np.polynomial.polynomial.polyval(row, np.polynomial.polynomial.polyfit(row, place, 1))
    spread = _LOOSE_PX * scatter(fit.fun, 0.0)
    hollow = fit.x[0] > np.median(place) and scatter(straight, 0.0) ** 2 > _HOLLOW * spread**2
    if not hollow or spread > _MOST_SPREAD_PX:
        return None
    # neighbouring rows share pixels: those of one pixel count once
    shared = max(1.0, _ROWS / float(np.ptp(rows)))
    away = np.column_stack([place, row]) - fit.x
    slopes = away / np.hypot(*away.T)[:, None]
    variance = np.linalg.inv(slopes.T @ slopes) * shared * spread**2
    std = float(np.sqrt(0.5 * np.trace(variance) + (radius.std * radius.px) ** 2 + CENTER_STD_FLOOR_PX**2))
    return np.asarray(fit.x), std

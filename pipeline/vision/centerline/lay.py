"""The lay of the strands and the print on the sheath: what all photos show at the same place of the cable.

Strands, letters and the shade between them move an edge by some hundredths of a pixel, those of a rope by half a pixel.
They go along with the cable, so the same wiggle of the midline stands at the same arc length on every photo: averaged
over the photos it is no noise, and a joint test would take it for a misfit of the simulation; taken for noise, it
makes the curve too stiff to follow the cable. Its part faster than any bend of a cable is taken off all photos.

``cables followed on a series -> the same without the common wiggle, and fitted anew``

What is slower than `_LONGEST_WIDTHS` is left alone, for a bend may do that: a kink or a soft spot is not touched.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, CubicSpline
from scipy.linalg import cholesky, solve_triangular, toeplitz

from pipeline.records import Array, Rejected
from pipeline.vision.centerline.measurement import Followed
from pipeline.vision.median import median

_LONGEST_WIDTHS, _ORDER = 5.6, 4
"""Widths; waves this long are halved: of one four widths long, the lay of a twisted pair, a sixteenth is left alone, of
one eight widths long all but a sixteenth. The order of the differences that tell slow from fast: no cubic is fast, also
where the seen part of a cable ends. A running mean, one-sided there, moved the last two diameters by 0.3 px."""


def without_lay(cables: Sequence[Followed | Rejected], diameter_m: float) -> tuple[Followed | Rejected, ...]:
    """Cables of a series without the fast wiggle that all photos have in common; a single one as it is."""
    first = [cable for cable in cables if isinstance(cable, Followed)]
    if len(first) < 2:
        return tuple(cables)
    used = [cable.fit.weight > 0.0 for cable in first]
    at = [cable.from_axis[own] for cable, own in zip(first, used, strict=True)]
    across = [cable.fit.residual[own] for cable, own in zip(first, used, strict=True)]
    seen = common_wiggle(at, across, diameter_m)
    off = [np.interp(cable.from_axis, s, own) for cable, s, own in zip(first, at, seen.across, strict=True)]
    now = [cable.without(own, spare=seen.spare, lay_std=seen.std) for cable, own in zip(first, off, strict=True)]
    rest = iter(now)
    return tuple(next(rest) if isinstance(cable, Followed) else cable for cable in cables)


class Wiggle(NamedTuple):
    """What all photos show at the same place.

    Attributes
    ----------
    across : list of (n,)
        At the sections of each photo: the mean over the photos, less the share of its variance that is their own noise.
    std : float
        By how much it may be off for what is slow in it: an error that all photos share.
    spare : float
        Variance of a photo's noise over that of its scatter without the wiggle, which holds a part of the noise.
    """

    across: list[Array]
    std: float
    spare: float


def common_wiggle(places: Sequence[Array], across: Sequence[Array], width: float) -> Wiggle:
    """The wiggle that photos have in common, in the unit of ``across``.

    Parameters
    ----------
    places, across : sequences of (n,)
        Arc lengths of the sections of every photo, ascending or nearly so, and their distances from its curve.
    width : float
        Of the cable, in the unit of the places.
    """
    # as many places as a photo has sections: twice as many would be all that two photos show
    pitch = float(median(np.concatenate([np.diff(s) for s in places])))
    first = min(float(s.min()) for s in places)  # a visible end may lie beside the first section
    size = int((max(float(s.max()) for s in places) - first) / pitch) + 2
    nearest = [np.rint((s - first) / pitch).astype(int) for s in places]
    several = np.sum([np.bincount(one, minlength=size) > 0 for one in nearest], axis=0) > 1
    at, kept = np.flatnonzero(several), several[np.concatenate(nearest)]
    if at.size <= _ORDER:
        return Wiggle([np.zeros_like(s) for s in places], 0.0, 1.0)
    every, off = np.concatenate(places)[kept] - first, np.concatenate(across)[kept]
    grid: Array = pitch * np.arange(size, dtype=np.float64)
    # cubic: by straight lines between places, a wave of strands left a beat of a thirtieth of it on all photos
    mean, part = _nearest(every, off, grid), at.size / every.size  # half at most: each place has two sections or more
    noise = float(np.mean((off - mean(every)) ** 2)) / (1.0 - part)
    wiggle = np.zeros(size)
    slow, std = _slow(mean(grid[at]), at, _LONGEST_WIDTHS * width / pitch)
    wiggle[at] = mean(grid[at]) - slow
    power = float(np.mean(wiggle[at] ** 2))
    share = max(0.0, 1.0 - noise * part / power) if power > 0.0 else 0.0
    told = CubicSpline(grid, share * wiggle)
    spare = 1.0 / (1.0 - share * (2.0 - share) * part)
    return Wiggle([told(s - first) for s in places], share * std, spare)


def _nearest(s: Array, across: Array, grid: Array) -> BSpline[np.float64]:
    """Cubic spline on a grid (g,) nearest to distances (n,) at places (n,); 0 where there are none."""
    pitch = grid[1]
    knots = pitch * np.arange(-3, grid.size + 3)
    basis = BSpline.design_matrix(s, knots, 3)
    normal = np.asarray((basis.T @ basis).toarray(), dtype=np.float64)
    normal += _LEAST * np.max(np.diag(normal)) * np.eye(len(normal))
    return BSpline(knots, np.linalg.solve(normal, np.asarray(basis.T @ across, dtype=np.float64)), 3)


def _slow(mean: Array, at: NDArray[np.int_], longest: float) -> tuple[Array, float]:
    """What of ``mean`` (m,), given at places ``at`` of a grid, is no wiggle, and its standard deviation.

    ``longest``: wave length in places, as of `_LONGEST_WIDTHS`.

    First as if the wiggle were white: the spline of least ``sum (slow - mean)^2 + sum (difference of coefficients)^2``,
    the second weighed so that of waves of length l the share 1 / (1 + (longest / l)^(2 order)) is slow. Then with the
    covariance that the rest shows: a wave of strands is one to the very end, where anything smooth could follow half of
    its last period. Sources: Eilers and Marx (1996), Flexible smoothing with B-splines and penalties; Wiener (1949),
    Extrapolation, interpolation and smoothing of stationary time series.
    """
    apart = longest / _KNOTS
    knots = at[0] + apart * np.arange(-3, np.ceil((at[-1] - at[0] + 1.0) / apart) + 4)
    spline = BSpline.design_matrix(at.astype(float), knots, 3).toarray()
    rough = np.diff(np.eye(spline.shape[1]), _ORDER, axis=0) * (np.sqrt(apart) / (2.0 * np.pi / _KNOTS) ** _ORDER)
    alike, power = np.eye(at.size), 0.0
    for _ in range(2):
        root = cholesky(alike, lower=True)
        white, data = (solve_triangular(root, rows, lower=True) for rows in (spline, mean))
        normal = white.T @ white + rough.T @ rough
        slow = spline @ np.linalg.solve(normal, white.T @ data)
        line = np.zeros(int(at[-1]) + 1)
        line[at] = mean - slow
        covariance = np.correlate(line, line, "full")[line.size - 1 :]
        power = float(covariance[0])
        if not power > 0.0:
            break
        alike = toeplitz(covariance / power)[np.ix_(at, at)] + _LEAST * np.eye(at.size)
    spread = np.mean(np.sum(spline * np.linalg.solve(normal, spline.T).T, axis=1))
    return np.asarray(slow), float(np.sqrt(power / at.size * spread))


_KNOTS = 4.0
"""Of the spline to the longest wave: a cubic one then follows waves half as long."""

_LEAST = 1e-3
"""Of the wiggle's variance, or of a place's sections: noise, or a wiggle of zero, that is there in any case."""

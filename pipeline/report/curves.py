"""What the report computes from a characteristic and the photos: equivalent stiffness, smallest radius.

Equivalent constant stiffness over a range [a, b]: EI = (m(b) - m(a)) / (b - a), the mean of the tangent dm/dkappa. It
is the stiffness of the linear rod that changes its moment by as much over that range.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from pipeline.result import PhotoPart, Result, Visited
    from pipeline.result.row import RowCurve


@dataclass(frozen=True)
class Equivalent:
    """A constant stiffness standing for a characteristic over a range of curvature.

    Attributes
    ----------
    low, high : 1/m
    stiffness, std : N m^2
    bound : bool
        True if ``std`` is an upper bound, because the covariance along the curve is not known.
    departure : relative
        Largest departure of the tangent from the constant on the range: what the constant hides.
    """

    low: float
    high: float
    stiffness: float
    std: float
    bound: bool
    departure: float


def equivalent(curve: Visited | RowCurve, bounds: tuple[float, float] | None = None) -> Equivalent | None:
    """Equivalent constant stiffness over a range of curvature; None if it was not visited.

    ``bounds`` (low, high) in 1/m are cut to the visited range; the whole of it by default.
    """
    low, high = bounds or (curve.kappa[0], curve.kappa[-1])
    low, high = max(low, float(curve.kappa[0])), min(high, float(curve.kappa[-1]))
    if not low < high:
        return None
    inside = (curve.kappa > low) & (curve.kappa < high)
    grid = np.concatenate([[low], curve.kappa[inside], [high]])
    half = np.diff(grid) / 2.0
    weight = (np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])) / (high - low)  # trapezoidal rule
    tangent = np.interp(grid, curve.kappa, curve.tangent)
    stiffness = float(weight @ tangent)
    if curve.factor.shape[1]:
        left = np.clip(np.searchsorted(curve.kappa, grid) - 1, 0, len(curve.kappa) - 2)
        share = (weight * (grid - curve.kappa[left]) / np.diff(curve.kappa)[left])[:, None]  # of the node to the right
        mean = (weight[:, None] - share) * curve.factor[left] + share * curve.factor[left + 1]
        std, bound = float(np.linalg.norm(mean.sum(axis=0))), False
    else:
        # errors that all have one sign: no correlation along the curve makes the mean less certain than that
        std, bound = float(weight @ np.interp(grid, curve.kappa, curve.tangent_std)), True
    departure = float(np.max(np.abs(tangent - stiffness)) / abs(stiffness)) if stiffness else float("inf")
    return Equivalent(low, high, stiffness, std, bound, departure)


def seen_range(photo: PhotoPart) -> tuple[float, float] | None:
    """Smallest and largest curvature of the visible cable on a photo, in 1/m."""
    kappa = np.asarray(photo.kappa_per_m)[np.flatnonzero(photo.seen)]
    return (float(kappa.min()), float(kappa.max())) if kappa.size else None


def smallest_radius(result: Result) -> tuple[float, float, int] | None:
    """Smallest bend radius seen on any photo and its standard deviation in m, and the step."""
    seen = [
        (abs(kappa), std, photo.step)
        for photo in result.photos
        for kappa, std, shown in zip(photo.kappa_per_m, photo.kappa_std_per_m, photo.seen, strict=True)
        if shown
    ]
    kappa, std, step = max(seen, key=lambda bend: bend[0], default=(0.0, 0.0, 0))
    return (1.0 / kappa, std / kappa**2, step) if kappa > 0.0 else None

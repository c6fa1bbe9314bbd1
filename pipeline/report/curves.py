"""What the report reads out of a characteristic: the visited part, the best one, equivalent stiffness, photos.

Only the visited range is ever shown: below the pre-curvature and above the largest curvature no cable was looked at.

Equivalent constant stiffness over a range [a, b]: EI = (m(b) - m(a)) / (b - a), the mean of the tangent dm/dkappa. It
is the stiffness of the linear rod that changes its moment by as much over that range.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.result import Curve, PhotoPart, Result

Array = NDArray[np.float64]
METHODS = ("inverse", "balance", "extended")


@dataclass(frozen=True)
class Visited:
    """The visited part of a characteristic.

    Attributes
    ----------
    method : str
        ``inverse``, ``balance`` or ``extended``.
    kappa : (n,) 1/m
        Increasing.
    moment, moment_std : (n,) N m
    tangent, tangent_std, secant, secant_std : (n,) N m^2
    factor : (n, r) N m^2
        Factor F with F F^T the covariance of the tangent; r = 0 where it is not known.
    """

    method: str
    kappa: Array
    moment: Array
    moment_std: Array
    tangent: Array
    tangent_std: Array
    secant: Array
    secant_std: Array
    factor: Array

    def at(self, kappa: float) -> tuple[float, float]:
        """Tangent and its standard deviation at a curvature, in N m^2, interpolated linearly."""
        return (
            float(np.interp(kappa, self.kappa, self.tangent)),
            float(np.interp(kappa, self.kappa, self.tangent_std)),
        )


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


def visited(method: str, curve: Curve | None) -> Visited | None:
    """The visited part of a curve; None if there is none of at least two points."""
    if curve is None:
        return None
    keep = np.flatnonzero(curve.supported)
    if keep.size < 2:
        return None
    rows = curve.tangent_factor_Nm2
    factor = np.asarray(rows, dtype=np.float64)[keep] if rows else np.zeros((keep.size, 0))
    fields = (
        np.asarray(values, dtype=np.float64)[keep]
        for values in (
            curve.kappa_per_m,
            curve.moment_Nm,
            curve.moment_std_Nm,
            curve.tangent_Nm2,
            curve.tangent_std_Nm2,
            curve.secant_Nm2,
            curve.secant_std_Nm2,
        )
    )
    return Visited(method, *fields, factor)


def curves(result: Result) -> dict[str, Visited]:
    """Visited parts of all characteristics of a result, by method."""
    whole = {
        "inverse": result.inverse.curve if result.inverse else None,
        "balance": result.balance.curve if result.balance else None,
        "extended": result.diagnosis.extended if result.diagnosis else None,
    }
    parts = {method: visited(method, whole[method]) for method in METHODS}
    return {method: part for method, part in parts.items() if part is not None}


def best(result: Result) -> Visited | None:
    """The characteristic the report answers with: extended, else inverse if its fit converged, else balance."""
    parts = curves(result)
    fitted = result.inverse is not None and result.inverse.converged
    order = ("extended", "inverse", "balance") if fitted else ("extended", "balance", "inverse")
    return next((parts[method] for method in order if method in parts), None)


def equivalent(curve: Visited, bounds: tuple[float, float] | None = None) -> Equivalent | None:
    """Equivalent constant stiffness over a range of curvature.

    Parameters
    ----------
    curve : Visited
    bounds : (low, high) in 1/m, optional
        Cut to the visited range; the whole of it by default.

    Returns
    -------
    Equivalent or None
        None if the range was not visited.
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
        columns = [np.interp(grid, curve.kappa, column) for column in curve.factor.T]
        std, bound = float(np.linalg.norm([weight @ column for column in columns])), False
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
    sharpest: tuple[float, float, int] | None = None
    for photo in result.photos:
        seen = np.flatnonzero(photo.seen)
        if not seen.size:
            continue
        index = int(seen[np.argmax(np.abs(np.asarray(photo.kappa_per_m)[seen]))])
        kappa, std = abs(photo.kappa_per_m[index]), photo.kappa_std_per_m[index]
        if kappa > 0.0 and (sharpest is None or 1.0 / kappa < sharpest[0]):
            sharpest = (1.0 / kappa, std / kappa**2, photo.step)
    return sharpest

"""Medians that are NaN, and no warning, where there are no values; robust standard deviation and fit by them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

SURE_SIGMAS = 3.0
"""Standard deviations that chance passes once in 400; what is less may be noise."""

MAD_TO_STD = 1.4826
"""Standard deviation of a normal distribution by its median absolute deviation."""


def median(values: ArrayLike) -> float:
    """Median of all values; NaN if one is NaN, or there are none."""
    return float(np.median(np.asarray(values))) if np.size(values) else float("nan")


def medians(values: NDArray[Any], axis: int) -> NDArray[Any]:
    """Medians along an axis; NaN where one value is NaN, or there are none."""
    if values.shape[axis]:
        return np.asarray(np.median(values, axis=axis))
    return np.full(np.delete(values.shape, axis), np.nan)


def quantile(values: NDArray[Any], share: float) -> float:
    """Quantile of all values, none of them NaN, linear between neighbours of the order."""
    return float(np.quantile(values, share))


def scatter(values: NDArray[Any], about: float | None = None) -> float:
    """Robust standard deviation of all values about their median, or ``about`` a number."""
    return MAD_TO_STD * median(np.abs(values - (median(values) if about is None else about)))


def robust_fit(terms: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (k,) of the columns of ``terms`` (n, k), ones and others, that most of ``values`` (n,) follow.

    Least squares with Tukey's biweight, which is zero beyond 4.685 sigmas: the rest are outliers.
    """
    found: NDArray[np.float64] = np.zeros(terms.shape[1])
    found[0] = median(values)
    for _ in range(8):
        off = values - terms @ found
        weight = np.clip(1.0 - (off / (4.685 * scatter(off, 0.0) + 1e-12)) ** 2, 0.0, None) ** 2
        weighted = terms * weight[:, None]
        found = np.asarray(np.linalg.solve(weighted.T @ terms + 1e-9 * np.eye(len(found)), weighted.T @ values))
    return found

"""Medians that are NaN, and no warning, where there are no values; robust standard deviations and fits by them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
    """Coefficients ``(k,)`` of the combination of ``terms`` (n, k) that most of ``values`` (n,) follow.

    Least squares with Tukey's biweight, zero beyond 4.685 standard deviations: a twentieth less sure than without.
    """
    off = values - median(values)
    coefficients: NDArray[np.float64] = np.zeros(terms.shape[1])
    for _ in range(8):
        weight = np.clip(1.0 - (off / (4.685 * scatter(off, 0.0) + 1e-12)) ** 2, 0.0, None) ** 2
        weighted = terms * weight[:, None]
        normal = weighted.T @ terms + 1e-9 * np.eye(terms.shape[1])
        coefficients = np.asarray(np.linalg.solve(normal, weighted.T @ values), np.float64)
        off = values - terms @ coefficients
    return coefficients

"""Repeat specimens of one cable type: their mean characteristic, and whether they differ by more than their errors.

Random effects by DerSimonian and Laird (1986): each specimen has its own error sigma_i and a true value that scatters
by tau around the mean. Q = sum (f_i - f)^2 / sigma_i^2 follows chi-square with n - 1 degrees of freedom if tau = 0.
The tests are made on two numbers of each specimen: the mean stiffness over the range all of them visited, and K0; the
curves are pooled point by point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from pipeline.records import Array
from pipeline.report.curves import Equivalent, equivalent
from pipeline.result.row import RowCurve

POINTS = 41


@dataclass(frozen=True)
class Scatter:
    """How a number scatters over repeat specimens, against what their own errors allow.

    Attributes
    ----------
    mean, mean_std : float
    seen, seen_std : float
        Standard deviation between the specimens, and how well so many of them tell it if they are normally distributed.
    own : float
        Root mean square of their own standard deviations.
    p_value : float
        Of a scatter this large from their own errors alone.
    farthest : int
        Which specimen is most of its own standard deviations from the mean.
    """

    mean: float
    mean_std: float
    seen: float
    seen_std: float
    own: float
    p_value: float
    farthest: int


@dataclass(frozen=True)
class Pooled:
    """Pooled characteristic of repeat specimens.

    Attributes
    ----------
    kappa : (m,) 1/m
        The range all specimens visited.
    mean, std, scatter : (m,) N m^2
        Mean tangent, its standard deviation, and the standard deviation between specimens (tau).
    stiffness : Scatter
        Of the mean stiffness over the range, N m^2.
    """

    kappa: Array
    mean: Array
    std: Array
    scatter: Array
    stiffness: Scatter


def pool(specimens: Sequence[RowCurve]) -> Pooled | None:
    """Pool the characteristics of repeat specimens.

    None for fewer than two specimens, no common range, or errors that are not positive.
    """
    if len(specimens) < 2:
        return None
    low, high = max(c.kappa[0] for c in specimens), min(c.kappa[-1] for c in specimens)
    constants = [equivalent(curve, (low, high)) for curve in specimens] if low < high else []
    known: list[Equivalent] = [c for c in constants if c is not None and c.std > 0.0]
    kappa = np.linspace(low, high, POINTS)
    errors = np.array([np.interp(kappa, c.kappa, c.tangent_std) for c in specimens])
    if len(known) < len(specimens) or not np.all(errors > 0.0):
        return None
    tangents = np.array([np.interp(kappa, c.kappa, c.tangent) for c in specimens])
    curve, curve_std, scatter, _ = random_effects(tangents, errors)
    return Pooled(kappa, curve, curve_std, scatter, scattered([(c.stiffness, c.std) for c in known]))


def scattered(numbers: Sequence[tuple[float, float]]) -> Scatter:
    """Scatter of two or more numbers, each given with its standard deviation, which is positive."""
    values, stds = np.array(numbers).T
    (mean,), (std,), _, (q,) = random_effects(values[:, None], stds[:, None])
    freedom = len(values) - 1
    seen = float(np.std(values, ddof=1))
    return Scatter(
        mean=float(mean),
        mean_std=float(std),
        seen=seen,
        seen_std=seen / float(np.sqrt(2.0 * freedom)),
        own=float(np.sqrt(np.mean(stds**2))),
        p_value=float(chdtrc(freedom, q)),
        farthest=int(np.argmax(np.abs(values - mean) / stds)),
    )


def random_effects(values: Array, stds: Array) -> tuple[Array, Array, Array, Array]:
    """Mean of scattered quantities with known errors, column by column.

    Parameters
    ----------
    values, stds : (n, m)
        n specimens, m quantities; standard deviations positive.

    Returns
    -------
    mean, std, tau, q : (m,)
        Mean, its standard deviation, scatter between specimens, and the statistic Q.
    """
    weight = 1.0 / stds**2
    total = weight.sum(axis=0)
    fixed = (weight * values).sum(axis=0) / total
    q = (weight * (values - fixed) ** 2).sum(axis=0)
    excess = q - (len(values) - 1)
    tau2 = np.maximum(0.0, excess / (total - (weight**2).sum(axis=0) / total))
    both = 1.0 / (stds**2 + tau2)
    mean = (both * values).sum(axis=0) / both.sum(axis=0)
    return mean, 1.0 / np.sqrt(both.sum(axis=0)), np.sqrt(tau2), q


THIRTYFOLD = 30.0
"""Repeat specimens differ by less, and wrong units of force by more: a prefix is a thousandfold."""


def outlying(stiffness: Array) -> NDArray[np.bool_]:
    """Which of repeat specimens (n,) are a factor of thirty or more away in stiffness from most of the others.

    A specimen is believed if more than half of all, itself included, lie within that factor: of two that are further
    apart neither is.
    """
    logs = np.log(np.maximum(stiffness, np.finfo(float).tiny))
    ordered = np.sort(logs)
    low, high = (logs + sign * np.log(THIRTYFOLD) for sign in (-1.0, 1.0))
    near = np.searchsorted(ordered, high, side="right") - np.searchsorted(ordered, low, side="left")
    return np.asarray(2 * near <= stiffness.size)

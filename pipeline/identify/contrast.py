"""The difference of two measured characteristics: same quantity, same range, judged by the covariance of both.

Two curves of log f over the curvature, each on its own grid -> their difference on the range that both visited. The
test looks at the mean of the log ratio over each third of that range: three numbers that a stretched, bent or tilted
curve moves, with a covariance that is far from singular. What the covariance of the difference is, the caller knows:
the sum of both for independent measurements, less what two evaluations of the same data share.

Nothing is compared outside the range that both visited. Curvature in 1/m, f in N m^2; the log ratio is relative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from pipeline.records import Array
from rod.measured_law import POINTS

PARTS = 3


@dataclass(frozen=True)
class LogCurve:
    """A measured characteristic: f on a grid, and the covariance of log f along it.

    Attributes
    ----------
    kappa : (n,) 1/m
        Increasing.
    tangent : (n,) N m^2
        Positive.
    log_covariance : (n, n)
    """

    kappa: Array
    tangent: Array
    log_covariance: Array

    def common_grid(self, other: LogCurve) -> Array | None:
        """Curvatures (n,) 1/m over what both visited; None if there is none."""
        low, high = max(self.kappa[0], other.kappa[0]), min(self.kappa[-1], other.kappa[-1])
        return np.linspace(low, high, POINTS) if high > low else None

    def onto(self, grid: Array) -> Array:
        """Matrix of linear interpolation from the own grid to another, (n, own)."""
        return np.stack([np.interp(grid, self.kappa, column) for column in np.eye(self.kappa.size)], axis=1)

    def contraction(self, grid: Array) -> Array:
        """Matrix of the means over each part of the grid, (parts, own)."""
        return np.stack([part.mean(axis=0) for part in np.array_split(self.onto(grid), PARTS)])

    def log_on(self, grid: Array) -> Array:
        """Log f on another grid, (n,)."""
        return np.asarray(self.onto(grid) @ np.log(self.tangent))

    def parts_covariance(self, grid: Array) -> Array:
        """Covariance of the means of log f over each part of the grid, (parts, parts)."""
        contraction = self.contraction(grid)
        return np.asarray(contraction @ self.log_covariance @ contraction.T)


def parts_difference(one: LogCurve, two: LogCurve, grid: Array) -> Array:
    """Mean of log(one / two) over each part of the grid, (parts,)."""
    return np.asarray(one.contraction(grid) @ np.log(one.tangent) - two.contraction(grid) @ np.log(two.tangent))


def chi_square(difference: Array, covariance: Array) -> float:
    """Sum of squares of a difference in units of its standard deviations, direction by direction.

    Directions in which both curves answer alike have no variance to judge by: a thousandth of the largest at least.
    """
    values, vectors = np.linalg.eigh(covariance)
    values = np.maximum(values, 1e-3 * values[-1])
    return float(np.sum((vectors.T @ difference) ** 2 / values))


def p_value(difference: Array, covariance: Array) -> float:
    """Probability of a difference as large as this where both curves are of one characteristic."""
    return float(chdtrc(difference.size, chi_square(difference, covariance)))

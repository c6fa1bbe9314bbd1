"""One step of a fit: the least squares of the linear model within what a cable can be.

Bounds are rows G d >= h of the step d: amounts of one sign, places within their range, how far one step may reach. A
step that is cut at such a bound leaves all other numbers where they would be without it: the fit creeps along the
bound, and where its patience ends is chance. The least squares with the bounds in them have one solution, and so has a
fit whose minimum lies on a bound.

Source: Lawson and Hanson, *Solving Least Squares Problems*, ch. 23 (least distance programming by NNLS).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from rod.array import Array
from rod.inverse.extension import Extension

INSIDE = 1e-9
"""Of a bound's own scale; what exceeds it by less is rounding."""


class Bounds(NamedTuple):
    """Rows G (m, p) and h (m,) of G d >= h; no h is positive, so staying is always allowed."""

    rows: Array
    least: Array

    def joined(self, other: Bounds) -> Bounds:
        """The rows of both."""
        return Bounds(np.vstack([self.rows, other.rows]), np.r_[self.least, other.least])


def lasting(extension: Extension, vector: Array) -> Bounds:
    """What no cable goes beyond (m, p): the signs of amounts, the ranges of places."""
    rows, least = [], []
    for at, term in zip(extension.amounts_at, extension.terms, strict=True):
        if term.sign:
            size = term.sign * term.cause.plausible(extension.facts)
            rows.append(np.eye(1, extension.size, at)[0] / size)
            least.append(-vector[at] / size)
        for j, name in enumerate(term.variant.tuned, start=at + 1):
            low, high = term.variant.range(name)
            unit = np.eye(1, extension.size, j)[0] / (high - low)
            rows.extend([unit, -unit])
            least.extend([(low - vector[j]) / (high - low), (vector[j] - high) / (high - low)])
    return Bounds(np.array(rows).reshape(-1, extension.size), np.minimum(least, 0.0))


def reach(extension: Extension) -> Bounds:
    """How far one step may go (m, p): a factor two in the law, a fifth of the curvature scale in K0, a tenth of ranges.

    Where a place, a threshold or a time moves farther, the linear model tells nothing: ten fits took 5 to 18 % more
    steps without that bound, and a set that slows down was given up while damping crept along its valley.
    """
    far = dict.fromkeys(range(extension.base.law.size), 0.7)  # of logarithms
    if (bend := extension.base.pre_curvature_index) is not None:
        far[bend] = 0.2 * extension.facts.curvature_scale
    for at, term in zip(extension.amounts_at, extension.terms, strict=True):
        for j, name in enumerate(term.variant.tuned, start=at + 1):
            low, high = term.variant.range(name)
            far[j] = 0.1 * (high - low)
    unit = np.eye(extension.size)[list(far)] / np.array(list(far.values()))[:, None]
    return Bounds(np.vstack([unit, -unit]), np.full(2 * len(far), -1.0))


class Linearised:
    """The linear problem at a state: columns of unit length, so that damping is a pure number.

    Parameters
    ----------
    jacobian : (n, p)
    residual : (n,)
    cutoff : float
        Combinations of parameters that show less than this share of the clearest one stay where they are.
    bounds, within : Bounds
        What lasts, and how far one step may go.
    """

    def __init__(self, jacobian: Array, residual: Array, cutoff: float, bounds: Bounds, within: Bounds) -> None:
        size = np.linalg.norm(jacobian, axis=0)
        self.size = np.where(size > 0.0, size, 1.0)
        left, weight, right = np.linalg.svd(jacobian / self.size, full_matrices=False)
        kept = weight > cutoff * weight[0]
        self.weight, self.right, self.along = weight[kept], right[kept], left.T[kept] @ residual
        self.bounds, self.within = bounds, bounds.joined(within)
        away = self._nearest(0.0, self.bounds)
        self.expected_fall = float(np.sum(self.along**2 - (self.along - self.weight * away) ** 2))
        """Fall of chi-square the linear model promises for the whole step."""

    def step(self, damping: float) -> Array:
        """Step (p,), held back where the data hardly tell the direction (relative weight below ``damping``)."""
        return np.asarray(self.right.T @ self._nearest(damping, self.within) / self.size)

    def _nearest(self, damping: float, bounds: Bounds) -> Array:
        """Best step along the combinations of parameters, within the bounds."""
        strong = np.hypot(self.weight, damping * self.weight[0])
        best = self.weight * self.along / strong**2
        rows = (bounds.rows / self.size) @ self.right.T
        short = bounds.least - rows @ best
        if np.any(short > INSIDE):
            best = best + least_distance(rows / strong, short) / strong
        return np.asarray(best)


def least_distance(rows: Array, least: Array) -> Array:
    """The shortest z (p,) with ``rows z >= least`` (m, p), (m,), of which there is one."""
    scale = np.linalg.norm(rows, axis=1)
    seen = scale > 0.0
    table = np.vstack([(rows[seen] / scale[seen, None]).T, least[seen] / scale[seen]])
    table[-1] /= (length := max(float(np.max(table[-1])), 1e-300))
    target = np.eye(1, len(table), len(table) - 1)[0]
    away = table @ nnls(table, target, maxiter=30 * table.shape[1])[0] - target
    return np.asarray(-away[:-1] / away[-1] * length)

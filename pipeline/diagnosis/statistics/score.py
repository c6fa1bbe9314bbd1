"""Score tests: which direction of misfit points at which cause, before anything is refitted.

In: the whitened residual ``r`` (n,) of the fitted base model, its whitened sensitivities ``J`` (n, p), and one whitened
column ``S_k`` (n,) for every candidate at amount zero. Out: for every candidate the score ``z_k = u_k . r ~ N(lambda_k,
1)`` with ``u_k = P S_k / |P S_k|`` and ``P = I - Q Q^T`` projecting the span of J out, the estimate ``z_k / |P S_k|``
of its amount, and what does not depend on the data: surviving fraction ``|P S_k| / |S_k|`` and minimal detectable
amount.

Sign: r = data - model, so a positive score asks for a positive amount. Prior knowledge on nuisance parameters enters as
rows of J and r, so nothing here knows about priors.

Source: Lagrange multiplier (score) test of omitted parameters; w-test and minimal detectable bias of geodesy (Baarda).
The family of scores is judged by its largest: where nothing is wrong, k normal scores of any correlation stay below a
bound at least as often as k independent ones (Sidak 1967, J. Am. Stat. Assoc. 62, 626).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, special

from pipeline.records import Array


@dataclass(frozen=True)
class Scores:
    """Scores of ``k`` directions on ``n`` whitened data.

    Attributes
    ----------
    z : (k,)
        Standard normal where nothing is wrong.
    estimate, std : (k,)
        Amount by the linear model, in the unit of the direction; infinite ``std`` where nothing survives.
    surviving : (k,)
        Share of the direction's signature that the fitted parameters cannot imitate.
    unit : (n, k)
        ``u_k``; a zero column where nothing survives.
    norm : (k,)
        ``|P S_k|``: score per unit of amount.
    """

    z: Array
    estimate: Array
    std: Array
    surviving: Array
    unit: Array
    norm: Array

    @property
    def visible(self) -> int:
        """Number of directions of which something survives."""
        return int(np.count_nonzero(self.norm))


def span(jacobian: Array) -> Array:
    """Orthonormal basis (n, rank) of the columns of ``jacobian``; columns are scaled first, so units do not matter."""
    size = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian[:, size > 0.0] / size[size > 0.0]
    if scaled.shape[1] == 0:
        return np.zeros((jacobian.shape[0], 0))
    left, weight, _ = linalg.svd(scaled, full_matrices=False)
    return np.asarray(left[:, weight > 1e-10 * weight[0]])


def score(residual: Array, jacobian: Array, columns: Array, *, visible: float = 1e-6) -> Scores:
    """Score every column against the residual after projecting the Jacobian out.

    Parameters
    ----------
    residual : (n,)
        Whitened.
    jacobian : (n, p)
        Whitened sensitivities of everything that is fitted already.
    columns : (n, k)
        Whitened sensitivities to the candidates.
    visible : float
        Surviving fraction below which a direction counts as invisible: its score is 0 and its std infinite.
    """
    basis = span(jacobian)
    kept = columns - basis @ (basis.T @ columns)
    kept -= basis @ (basis.T @ kept)  # once more: what survives may be 1e-6 of what went in
    full = np.linalg.norm(columns, axis=0)
    norm = np.linalg.norm(kept, axis=0)
    surviving = np.divide(norm, full, out=np.zeros_like(norm), where=full > 0.0)
    seen = surviving > visible
    norm = np.where(seen, norm, 0.0)
    unit = np.where(seen, kept / np.where(seen, norm, 1.0), 0.0)
    z = unit.T @ residual
    std = np.divide(1.0, norm, out=np.full_like(norm, np.inf), where=seen)
    return Scores(z, np.where(seen, z, 0.0) * np.where(seen, std, 0.0), std, np.where(seen, surviving, 0.0), unit, norm)


def admissible(z: Array, sign: Array) -> Array:
    """Test statistic of each direction: ``|z|``, or ``max(0, sign z)`` where the amount can have one sign only."""
    return np.where(sign == 0, np.abs(z), np.maximum(0.0, sign * z))


ALIKE = 1e-6
"""Of the largest value: what differs by less differs by rounding. Forms of a cause may have the very same trace."""


def descending(values: Array) -> NDArray[np.int_]:
    """Order (n,) of values, the largest first; such as are alike stay in their own order, the simpler form first."""
    order = np.argsort(-values, kind="stable")
    falls = -np.diff(values[order], prepend=values[order[:1]])
    place = np.cumsum(falls > ALIKE * np.max(np.abs(values), initial=0.0))
    return np.asarray(order[np.lexsort((order, place))])


def threshold(level: float, tests: int) -> float:
    """Value that the largest of so many statistics exceeds with probability ``level`` at most when nothing is wrong."""
    return float(-special.ndtri(-0.5 * np.expm1(np.log1p(-level) / max(tests, 1))))


def adjusted_p(statistic: float, tests: int) -> float:
    """Probability, at most, that the largest of so many statistics is as large as this one when nothing is wrong."""
    single = min(2.0 * special.ndtr(-abs(statistic)), 1.0 - 1e-16)
    return float(-np.expm1(tests * np.log1p(-single)))

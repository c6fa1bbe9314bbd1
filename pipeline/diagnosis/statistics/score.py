"""Score tests: which direction of misfit points at which cause, before anything is refitted.

In: the whitened residual ``r`` (n,) of the fitted base model, its whitened sensitivities ``J`` (n, p), and one whitened
column ``S_k`` (n,) for every candidate at amount zero. Out: for every candidate the score ``z_k = u_k . r ~ N(lambda_k,
1)`` with ``u_k = P S_k / |P S_k|`` and ``P = I - Q Q^T`` projecting the span of J out, the estimate ``z_k / |P S_k|``
of its amount, and what does not depend on the data: surviving fraction ``|P S_k| / |S_k|`` and minimal detectable
amount.

Sign: r = data - model, so a positive score asks for a positive amount. Prior knowledge on nuisance parameters enters as
rows of J and r, so nothing here knows about priors.

Source: Lagrange multiplier (score) test of omitted parameters; w-test and minimal detectable bias of geodesy (Baarda).
The family of correlated scores is judged by the maximum, whose distribution under "nothing is wrong" is simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, special

Array = NDArray[np.float64]


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


def span(jacobian: Array, *, tolerance: float = 1e-10) -> Array:
    """Orthonormal basis (n, rank) of the columns of ``jacobian``; columns are scaled first, so units do not matter."""
    size = np.linalg.norm(jacobian, axis=0)
    scaled = jacobian[:, size > 0.0] / size[size > 0.0]
    if scaled.shape[1] == 0:
        return np.zeros((jacobian.shape[0], 0))
    left, weight, _ = linalg.svd(scaled, full_matrices=False)
    return np.asarray(left[:, weight > tolerance * weight[0]])


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

    Returns
    -------
    Scores
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


def null_maxima(
    unit: Array,
    sign: Array,
    *,
    draws: int,
    rng: np.random.Generator,
    estimated: Sequence[tuple[NDArray[np.bool_], float]] = (),
) -> Array:
    """Sorted maxima (draws,) of the admissible statistics when nothing is wrong: draws of N(0, U^T U).

    Parameters
    ----------
    unit : (n, k)
        Directions of `Scores`.
    sign : (k,)
    draws : int
    rng : Generator
    estimated : sequence of ((n,) bool, float)
        Rows whose noise level was estimated, and the samples behind it: few samples widen the tails.
    """
    known = np.ones(len(unit), dtype=bool)
    for rows, _ in estimated:
        known &= ~rows
    z = np.zeros((draws, unit.shape[1]))
    for rows, freedom in ((known, 0.0), *estimated):
        if np.any(rows):
            part = scores_of_noise(unit[rows], draws=draws, rng=rng)
            if freedom:
                part /= np.sqrt(rng.chisquare(freedom, draws) / freedom)[:, None]
            z += part
    return np.sort(admissible(z, sign).max(axis=1))


ALIKE = 1e-6
"""Of the largest value: what differs by less differs by rounding. Forms of a cause may have the very same trace."""


def descending(values: Array) -> NDArray[np.int_]:
    """Order (n,) of values, the largest first; such as are alike stay in their own order, the simpler form first."""
    order = np.argsort(-values, kind="stable")
    falls = -np.diff(values[order], prepend=values[order[:1]])
    place = np.cumsum(falls > ALIKE * np.max(np.abs(values), initial=0.0))
    return np.asarray(order[np.lexsort((order, place))])


def scores_of_noise(columns: Array, *, draws: int, rng: np.random.Generator) -> Array:
    """What unit noise scores along columns C (n, k): draws (draws, k) of N(0, C^T C).

    By the symmetric root of C^T C, the one root that moves no further than C does. The rows of a triangular one turn
    freely where columns are nearly dependent, and the same seed then makes other draws on another processor.
    """
    if len(columns) <= columns.shape[1]:
        return np.asarray(rng.standard_normal((draws, len(columns))) @ columns)
    variances, directions = np.linalg.eigh(columns.T @ columns)
    root = (directions * np.sqrt(np.maximum(variances, 0.0))) @ directions.T
    return np.asarray(rng.standard_normal((draws, len(root))) @ root)


def threshold(maxima: Array, level: float) -> float:
    """Value the largest statistic exceeds with probability ``level`` when nothing is wrong."""
    return float(np.quantile(maxima, 1.0 - level))


def adjusted_p(statistic: Array, maxima: Array) -> Array:
    """Family-wise p-value of each statistic, from the simulated maxima and beyond them by the Sidak tail.

    The number of effectively independent tests of the tail is read from the upper tenth of the simulated maxima.
    """
    at = float(np.quantile(maxima, 0.9))
    tests = np.log(0.9) / np.log1p(-2.0 * special.ndtr(-at))
    single = 2.0 * special.ndtr(-np.maximum(statistic, 1e-12))
    tail = -np.expm1(tests * np.log1p(-np.minimum(single, 1.0 - 1e-12)))
    rank = np.searchsorted(maxima, statistic, side="left")
    simulated = (maxima.size - rank + 1.0) / (maxima.size + 1.0)
    return np.where(maxima.size - rank >= 50, simulated, np.minimum(tail, simulated))

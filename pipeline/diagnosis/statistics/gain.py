"""What an extension is worth on steps it has not seen.

Whole displacement steps are left out, both branches of a level together; base and extended model are fitted to the rest
and both predict what was left out. Misfits are weighed by the predictive covariance of the extended model,

    C = I + J_out (J_in^T J_in)^-1 J_out^T,

so that what neither model could know (a law beyond the curvatures met) counts for neither. Reported is the share of the
excess misfit that the extension removes,

    1 - (chi2_ext - N) / (chi2_base - N),

which lies between 0 and 1: an extension that comes below the noise has removed all, one that does worse nothing. It has
an interval by parametric bootstrap, and root mean squares in N and m for people stand beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from pipeline.records import Array


@dataclass(frozen=True, eq=False)
class Fold:
    """Predictions of one left-out level, whitened residuals (n,) of both models and Jacobians of the extended one.

    ``inside`` (N - n, p) are the rows the extended model was fitted to (priors included), ``outside`` (n, p) the rest.
    """

    base: Array
    extended: Array
    inside: Array
    outside: Array


def folds_by_level(displacement: Array, branch: tuple[str, ...], *, same: float) -> list[list[int]]:
    """Steps grouped by displacement (closer than ``same``, m); the mounted step is never left out."""
    steps = [i for i in np.argsort(displacement, kind="stable") if branch[i] != "mounted"]
    groups: list[list[int]] = []
    for i in steps:
        if groups and displacement[i] - displacement[groups[-1][-1]] <= same:
            groups[-1].append(int(i))
        else:
            groups.append([int(i)])
    return groups


def held_out(folds: list[Fold], *, draws: int, rng: np.random.Generator) -> tuple[float, tuple[float, float]] | None:
    """Share of the excess removed over all folds, and its 95 % interval.

    None where the base model's excess on them is within three standard deviations of chance: a share of nothing.
    """
    whitened = [whitened_by_prediction(fold) for fold in folds]
    before, after = (np.concatenate(residuals) for residuals in zip(*whitened, strict=True))
    count = len(before)
    excess = float(before @ before) - count
    if excess <= 3.0 * np.sqrt(2.0 * count):
        return None
    removed = float(np.clip((float(before @ before) - float(after @ after)) / excess, 0.0, 1.0))
    # what the extension takes away is the signal; noise is drawn anew, as large as what it leaves
    signal = before - after
    level = np.sqrt(max(1.0, float(after @ after) / count))
    size = float(np.linalg.norm(signal))
    # of the noise only its part along the signal and its square count, so nothing as long as the samples is drawn
    along = level * rng.standard_normal(draws)
    gained = size**2 + 2.0 * size * along
    base_chi2 = gained + along**2 + level**2 * rng.chisquare(max(count - 1, 1), draws)
    share = np.clip(gained / np.maximum(base_chi2 - count, 0.5 * excess), 0.0, 1.0)
    low, high = np.quantile(share, [0.025, 0.975])
    return removed, (float(min(low, removed)), float(max(high, removed)))


def whitened_by_prediction(fold: Fold) -> tuple[Array, Array]:
    """Both residuals (n,) of a fold, whitened by the predictive covariance C = I + R R^T of its rows left out.

    With the thin singular value decomposition R = U S V^T, C^(-1/2) = I + U ((1 + S^2)^(-1/2) - I) U^T: nothing of size
    n x n is made, however many samples a hold has. Directions the fitted rows do not determine get a variance of 1e8
    instead of infinity: no prediction, no verdict.
    """
    size = np.linalg.norm(np.vstack([fold.inside, fold.outside]), axis=0)
    size = np.where(size > 0.0, size, 1.0)
    _, weight, right = linalg.svd(fold.inside / size, full_matrices=False)
    reach = (fold.outside / size) @ right.T / np.maximum(weight, 1e-4 * max(weight.max(initial=0.0), 1e-300))
    left, spread, _ = linalg.svd(reach, full_matrices=False)
    less = 1.0 / np.sqrt(1.0 + spread**2) - 1.0
    return fold.base + left @ (less * (left.T @ fold.base)), fold.extended + left @ (less * (left.T @ fold.extended))

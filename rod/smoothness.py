"""Linearised posterior of the inverse problem, averaged over the smoothness of the law, and what fewer knots would say.

Near the optimum the whitened data are linear in the unknowns, so mean, covariance and evidence for every size tau of
the smoothness prior (`rod.knots`) follow from one normal matrix. What the data leave open about tau widens the bands.
The same matrix, projected on splines through fewer control points, gives the evidence of their number without a fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rod.evaluation import Evaluation
from rod.fit_model import FitModel
from rod.knots import log_prior_volume, roughness

Array = NDArray[np.float64]

TAU_STEPS = 25
"""Values of tau averaged over: a factor 1.25 apart."""


@dataclass(frozen=True)
class Averaged:
    """Posterior of the unknowns.

    Attributes
    ----------
    mean : (q,)
    covariance : (q, q)
    response : (q, q)
        Mean inverse normal matrix: a change dr of the whitened data residual moves the mean by -response J^T dr.
    tau : float
        Of largest evidence.
    log_evidence : float
        Of the model, up to a constant of the data.
    """

    mean: Array
    covariance: Array
    response: Array
    tau: float
    log_evidence: float


def averaged(
    model: FitModel, found: Evaluation, *, taus: tuple[float, float], without: tuple[str, ...] = ()
) -> Averaged:
    """Posterior from the rows of an evaluation, the blocks named in `without` left out."""
    J, value = _data_rows(found, without)
    return _average(value, J, found.unknowns, roughness(model.knots), taus)


def evidence_of_knots(model: FitModel, found: Evaluation, knots: Array, *, taus: tuple[float, float]) -> float:
    """Log evidence of other, fewer control points, from the linearisation of a fit with many."""
    J, value = _data_rows(found, ())
    k = model.knots.size
    onto = np.asarray(CubicSpline(knots, np.eye(knots.size), bc_type="natural")(model.knots))
    z, *_ = np.linalg.lstsq(onto, found.unknowns[:k], rcond=None)
    moved = value + J[:, :k] @ (onto @ z - found.unknowns[:k])
    projected = np.hstack([J[:, :k] @ onto, J[:, k:]])
    unknowns = np.concatenate([z, found.unknowns[k:]])
    return _average(moved, projected, unknowns, roughness(knots), taus).log_evidence


def _data_rows(found: Evaluation, without: tuple[str, ...]) -> tuple[Array, Array]:
    keep = np.ones(found.value.size, dtype=bool)
    for name in ("smoothness", *without):
        keep[found.blocks[name]] = False
    return found.jacobian[keep], found.value[keep]


def _average(value: Array, J: Array, unknowns: Array, smooth: Array, taus: tuple[float, float]) -> Averaged:
    k, size = smooth.shape[0], unknowns.size
    normal, pull, chi2 = J.T @ J, -J.T @ value, float(value @ value)
    S = np.zeros((size, size))
    S[:k, :k] = smooth
    volume, bend = log_prior_volume(smooth), S @ unknowns
    grid = np.linspace(np.log(taus[0]), np.log(taus[1]), TAU_STEPS)
    evidence, moves, inverses = [], [], []
    for log_tau in grid:
        weight = np.exp(-2.0 * log_tau)
        A = normal + S * weight
        unit = 1.0 / np.sqrt(np.diag(A))
        scaled = unit[:, None] * A * unit
        inverse = unit[:, None] * np.linalg.pinv(scaled, hermitian=True) * unit
        force = pull - bend * weight
        move = inverse @ force
        log_det = np.linalg.slogdet(scaled)[1] - 2.0 * np.sum(np.log(unit))
        misfit = chi2 + weight * (unknowns @ bend) - force @ move
        evidence.append(-0.5 * (misfit + log_det) + volume - (k - 2) * log_tau)
        moves.append(move)
        inverses.append(inverse)
    top = max(evidence)
    share = np.exp(np.array(evidence) - top)
    log_evidence = float(top + np.log(share.mean()))
    share /= share.sum()
    move, response = np.tensordot(share, moves, 1), np.tensordot(share, inverses, 1)
    spread = np.array(moves) - move
    covariance = response + (share[:, None] * spread).T @ spread
    tau = float(np.exp(grid[int(np.argmax(evidence))]))
    return Averaged(unknowns + move, covariance, response, tau, log_evidence)

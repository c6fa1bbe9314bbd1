"""Linearised posterior of the inverse problem, averaged over the smoothness of the law; evidence of fewer knots.

Near the optimum the whitened data are linear in the unknowns, so mean, covariance and evidence for every size of the
priors of the law's form (`rod.inverse.knots`) follow from one normal matrix. What the data leave open about those sizes
widens the bands.
The same matrix, projected on splines through fewer control points, gives the evidence of their number without a fit.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rod.inverse.evaluation import Evaluation
from rod.inverse.fit_model import FitModel
from rod.inverse.knots import first_slope, log_prior_volume, roughness

Array = NDArray[np.float64]

TAU_STEPS = 15
"""Values of tau averaged over: a factor 1.7 apart, over which the posterior hardly changes."""

SLOPES, SLOPE_STEPS = (0.03, 3.0), 5
"""Sizes of the prior of the slope d log f / dt at K0: from none that could be seen to a factor e^3 over the range."""


@dataclass(frozen=True)
class Averaged:
    """Posterior of the unknowns.

    Attributes
    ----------
    mean : (q,)
    covariance : (q, q)
    response : (q, q)
        Mean inverse normal matrix: a change dr of the whitened data residual moves the mean by -response J^T dr.
    shrinkage : (q, k)
        By how much the mean falls short of a law with the values z at its k knots, per unit of z: zero for every
        straight line whose slope the data show.
    tau, slope : float
        Sizes of roughness and of the slope at K0 of largest evidence.
    log_evidence : float
        Of the model, up to a constant of the data.
    """

    mean: Array
    covariance: Array
    response: Array
    shrinkage: Array
    tau: float
    slope: float
    log_evidence: float


def averaged(
    model: FitModel, found: Evaluation, *, taus: tuple[float, float], without: tuple[str, ...] = ()
) -> Averaged:
    """Posterior from the rows of an evaluation, the blocks named in `without` left out."""
    J, value = _data_rows(found, without)
    return _average(value, J, found.unknowns, model.knots, taus)


def evidence_of_knots(model: FitModel, found: Evaluation, knots: Array, *, taus: tuple[float, float]) -> float:
    """Log evidence of other, fewer control points, from the linearisation of a fit with many."""
    J, value = _data_rows(found, ())
    k = model.knots.size
    onto = np.asarray(CubicSpline(knots, np.eye(knots.size), bc_type="natural")(model.knots))
    z, *_ = np.linalg.lstsq(onto, found.unknowns[:k], rcond=None)
    moved = value + J[:, :k] @ (onto @ z - found.unknowns[:k])
    projected = np.hstack([J[:, :k] @ onto, J[:, k:]])
    unknowns = np.concatenate([z, found.unknowns[k:]])
    return _average(moved, projected, unknowns, knots, taus).log_evidence


def _data_rows(found: Evaluation, without: tuple[str, ...]) -> tuple[Array, Array]:
    keep = np.ones(found.value.size, dtype=bool)
    for name in ("smoothness", *without):
        keep[found.blocks[name]] = False
    return found.jacobian[keep], found.value[keep]


def _average(value: Array, J: Array, unknowns: Array, knots: Array, taus: tuple[float, float]) -> Averaged:
    """Average over the sizes of roughness and slope; only the laws' unknowns (control points, K0) change with them.

    The other unknowns are eliminated once: with A = [[A_ll, A_ln], [A_nl, A_nn]] every prior acts on the Schur
    complement of A_nn, and mean, covariance and response of all unknowns are linear in what is found there.
    """
    k, size = knots.size, unknowns.size
    law, rest = slice(0, k + 1), slice(k + 1, size)
    A, pull, chi2 = J.T @ J, -J.T @ value, float(value @ value)
    inner = np.asarray(np.linalg.inv(A[rest, rest]), dtype=np.float64)
    back = -inner @ A[rest, law]
    schur, force = A[law, law] + A[law, rest] @ back, pull[law] + back.T @ pull[rest]
    chi2 -= float(pull[rest] @ inner @ pull[rest])
    _, log_det_rest = np.linalg.slogdet(A[rest, rest])
    S, g = np.zeros((k + 1, k + 1)), np.zeros(k + 1)
    S[:k, :k], g[:k] = roughness(knots), first_slope(knots)
    volume, z = log_prior_volume(S[:k, :k]), unknowns[law]
    grid = np.linspace(np.log(taus[0]), np.log(taus[1]), TAU_STEPS)
    slopes = np.linspace(np.log(SLOPES[0]), np.log(SLOPES[1]), SLOPE_STEPS)
    unit = 1.0 / np.sqrt(np.diag(schur))
    evidence, moves, inverses, shrunk, sizes = [], [], [], [], []
    for log_tau, log_slope in itertools.product(grid, slopes):
        prior = S * np.exp(-2.0 * log_tau) + np.outer(g, g) * np.exp(-2.0 * log_slope)
        scaled = unit[:, None] * (schur + prior) * unit
        inverse = unit[:, None] * np.linalg.inv(scaled) * unit
        toward = force - prior @ z
        move = inverse @ toward
        log_det = float(np.linalg.slogdet(scaled)[1]) - 2.0 * float(np.sum(np.log(unit)))
        misfit = chi2 + float(z @ prior @ z) - float(toward @ move)
        evidence.append(-0.5 * (misfit + log_det + log_det_rest) + volume - (k - 2) * log_tau - log_slope)
        moves.append(move)
        inverses.append(inverse)
        shrunk.append(inverse @ prior)
        sizes.append((float(np.exp(log_tau)), float(np.exp(log_slope))))
    top = max(evidence)
    share = np.exp(np.array(evidence) - top)
    log_evidence = float(top + np.log(share.mean()))
    share /= share.sum()
    move, response, shrinkage = (np.tensordot(share, parts, 1) for parts in (moves, inverses, shrunk))
    spread = np.array(moves) - move
    covariance = response + (share[:, None] * spread).T @ spread
    whole = np.concatenate([move, inner @ pull[rest] + back @ move])
    tau, slope = sizes[int(np.argmax(evidence))]
    return Averaged(
        unknowns + whole,
        _extended(covariance, inner, back),
        _extended(response, inner, back),
        np.vstack([shrinkage, back @ shrinkage])[:, :k],
        tau,
        slope,
        log_evidence,
    )


def _extended(law: Array, inner: Array, back: Array) -> Array:
    """Covariance of all unknowns from that of the laws' unknowns; the others follow by ``back``."""
    across = back @ law
    return np.block([[law, across.T], [across, inner + across @ back.T]])

"""Linearised posterior of a fit with a spline of log f, averaged over the priors of the law's form.

Near the optimum the whitened data are linear in the unknowns, so mean, covariance and evidence for every prior of the
law's form (`pipeline.diagnosis.fits.spline_prior`: along what and how smooth, how steep at rest) follow from one normal
matrix. What the data leave open about the prior widens the bands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.fits.knots import first_slope, roughness
from pipeline.diagnosis.fits.spline_prior import Along, LawPrior, log_volume

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
        Also the response: a change dr of the whitened data residual moves the mean by -covariance J^T dr, priors whose
        weight it changes included, since d log(evidence) of each is -(J (its mean - mean))^T dr up to a common term.
    shrinkage : (q, k)
        By how much the mean falls short of a law with the values z at its k knots, per unit of z.
    prior : LawPrior
        Of largest evidence.
    law_covariance : (k, k)
        Of z by the priors alone, of the sizes that the data make likely, with the level held at the first knot.
    log_evidence : float
        Of the model, up to a constant of the data.
    """

    mean: Array
    covariance: Array
    shrinkage: Array
    prior: LawPrior
    law_covariance: Array
    log_evidence: float


def _priors(along: tuple[Along, ...], taus: tuple[float, float]) -> tuple[list[LawPrior], Array, Array]:
    """All priors averaged over, their precisions of z and K0 (n, k + 1, k + 1), and the logs of their norms (n,)."""
    k = along[0].places.size
    sizes = np.meshgrid(_even(taus, TAU_STEPS), _even(SLOPES, SLOPE_STEPS), indexing="ij")
    tau, slope = (np.exp(axis.ravel()) for axis in sizes)
    precisions = np.zeros((len(along), tau.size, k + 1, k + 1))
    norms = np.zeros((len(along), tau.size))
    for (at, share), precision, norm in zip(along, precisions, norms, strict=True):
        g = first_slope(at)
        precision[:, :k, :k] = roughness(at) / tau[:, None, None] ** 2 + np.outer(g, g) / slope[:, None, None] ** 2
        # Each prior counts as often as it has directions: the roughness leaves straight lines free.
        norm[:] = np.log(share) + log_volume(at) - (k - 2) * np.log(tau) - np.log(slope)
    priors = [LawPrior(at, float(a), float(b)) for at, _ in along for a, b in zip(tau, slope, strict=True)]
    return priors, precisions.reshape(-1, k + 1, k + 1), norms.ravel()


def _even(bounds: tuple[float, float], count: int) -> Array:
    """Logarithms of `count` sizes between bounds, a constant factor apart."""
    return np.linspace(np.log(bounds[0]), np.log(bounds[1]), count)


def average(value: Array, J: Array, unknowns: Array, along: tuple[Along, ...], taus: tuple[float, float]) -> Averaged:
    """Average over the priors of the law's form; only the laws' unknowns (control points, K0) change with them.

    Parameters
    ----------
    value : (n,)
        Whitened residuals of data and of other prior knowledge than that on the law's form.
    J : (n, q)
        Their derivatives by the unknowns.
    unknowns : (q,)
        Where they were taken: logarithms of f_EI at the k knots first, then K0 in any unit, then all others.
    along : tuple of Along
        Places of the knots along what the law may be smooth.
    taus : (low, high)
        Range of the roughness.

    Strategy: the other unknowns are eliminated once: with A = [[A_ll, A_ln], [A_nl, A_nn]] every prior acts on the
    Schur complement of A_nn, and mean, covariance and response of all unknowns are linear in what is found there.
    """
    k = along[0].places.size
    law, rest = slice(0, k + 1), slice(k + 1, unknowns.size)
    # by orthogonal factors: in the difference of the squares what data that agree with each other tell would be lost
    Q, R = np.linalg.qr(J[:, rest])
    solved = np.linalg.inv(R)
    inner, back, offset = solved @ solved.T, -solved @ (Q.T @ J[:, law]), -solved @ (Q.T @ value)
    beside, left = J[:, law] - Q @ (Q.T @ J[:, law]), value - Q @ (Q.T @ value)
    schur, force, chi2 = beside.T @ beside, -beside.T @ left, float(left @ left)
    log_det_rest = 2.0 * float(np.sum(np.log(np.abs(np.diag(R)))))

    priors, precisions, norms = _priors(along, taus)
    z = unknowns[law]
    # Unknowns of very different size; what the data do not see at all is zero but for rounding.
    unit = 1.0 / np.sqrt(np.maximum(np.diag(schur), np.finfo(float).eps * np.sum(J**2, axis=0).max()))
    inverses, log_det = _inverted(unit[:, None] * (schur + precisions) * unit)
    inverses, log_det = unit[:, None] * inverses * unit, log_det - 2.0 * float(np.sum(np.log(unit)))
    toward = force - precisions @ z
    moves = np.einsum("nij,nj->ni", inverses, toward)
    misfit = chi2 + (precisions @ z) @ z - np.sum(toward * moves, axis=1)
    evidence = norms - 0.5 * (misfit + log_det + log_det_rest)

    top = float(evidence.max())
    share = np.exp(evidence - top)
    log_evidence = top + float(np.log(share.mean()))
    share /= share.sum()
    move = share @ moves
    spread = moves - move
    covariance = np.tensordot(share, inverses, 1) + (share[:, None] * spread).T @ spread
    shrinkage = np.eye(k + 1) - covariance @ schur
    whole = np.concatenate([move, offset + back @ move])
    return Averaged(
        unknowns + whole,
        _extended(covariance, inner, back),
        np.vstack([shrinkage, back @ shrinkage])[:, :k],
        priors[int(np.argmax(evidence))],
        _typical_covariance(priors, share, along),
        log_evidence,
    )


def _inverted(precisions: Array) -> tuple[Array, Array]:
    """Inverses (n, m, m) of precisions, and logs (n,) of their determinants; none of rounding becomes negative.

    A direction that neither data nor prior know has a precision of zero, and rounding may put it on either side of
    that: the variance then came out negative, and its root was no number. It is huge.
    """
    values, vectors = np.linalg.eigh(precisions)
    least = values.shape[-1] * np.finfo(float).eps * values[:, -1:]
    values = np.maximum(values, least)
    inverses = (vectors / values[:, None, :]) @ vectors.transpose(0, 2, 1)
    return np.asarray(inverses), np.asarray(np.sum(np.log(values), axis=1))


def _typical_covariance(priors: list[LawPrior], share: Array, along: tuple[Along, ...]) -> Array:
    """Prior covariance of z for the geometric means of tau and slope along each of the places.

    A mean of the covariances themselves would be that of the widest priors, however unlikely the data make them.
    """
    k = along[0].places.size
    covariance = np.zeros((k, k))
    logs = np.log([(prior.tau, prior.slope) for prior in priors]).reshape(len(along), -1, 2)
    for (at, _), weights, sizes in zip(along, share.reshape(len(along), -1), logs, strict=True):
        if not weights.any():
            continue  # the data leave no evidence at all to laws that are smooth along these places
        tau, slope = np.exp(weights @ sizes / weights.sum())
        rows = LawPrior(at, float(tau), float(slope)).rows[:, 1:]
        covariance[1:, 1:] += weights.sum() * np.linalg.inv(rows.T @ rows)
    return covariance


def _extended(law: Array, inner: Array, back: Array) -> Array:
    """Covariance of all unknowns from that of the laws' unknowns; the others follow by ``back``."""
    across = back @ law
    return np.block([[law, across.T], [across, inner + across @ back.T]])

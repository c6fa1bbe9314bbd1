"""What is known of the form of a law before its data, and the posterior averaged over what is not known of it.

The unknowns of a law are the coefficients a of g = log c on a `rod.compliance_law.LawBasis`, over its abscissa t = xi
from 0 to 1, or over the logarithm of its distance from rest. With g1, g2, g3 the derivatives of g by t, a prior of one form is one of

    rough   exp(-(1 / 2 tau^2) int (g2^2 + (g1 / R)^2) dt)         R = `REACH`
    smooth  exp(-(1 / 2 tau^2) int (g3^2 + g2^2 + g1^2) dt)

times exp(-(dg/dxi(rest) / S)^2 / 2) with S of `REST_SLOPES`: most cables bend alike to both sides of rest.
They are proper but for the level, so K0 and the stiffness at rest cannot run away together. Laws that fall smoothly are
known twice as well with the smooth ones; knees and plateaus are followed by the rough ones alone; laws that change most
just beside rest, where covers hide the cable, by those over the logarithm. Nothing is chosen: the posterior is the
average over all of them and over all tau, each normalised and weighted by its evidence (Laplace), and the bands hold
what the data leave open.

Both ways to the characteristic read the law through this module; nothing else do they share.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from rod.compliance_law import LawBasis, splines

Array = NDArray[np.float64]

REACH = 0.25
"""Of the abscissa: so far apart the log compliance of a rough law has forgotten itself."""

REST_SLOPES = (0.5, 3.0)
"""Prior standard deviations of g1 at rest: of cables that bend alike to both sides, whose law is flat there, and of
such as were set and are steepest there."""

NEAR_REST = 0.02
"""Of the abscissa: nearer to rest its logarithm is a straight line. So much lies under the covers of most photos."""

ROUGH, SMOOTH = np.geomspace(0.05, 300.0, 8), np.geomspace(0.05, 300.0, 12)
"""Values of tau: from laws of one stiffness to such as change it a hundredfold within a tenth of the range, a factor
of two to three apart, over which the posterior hardly changes."""


@dataclass(frozen=True, eq=False)
class Priors:
    """All priors of a law's form.

    Attributes
    ----------
    precisions : (n, p, p)
        Of the coefficients.
    log_norms : (n,)
        Logarithms of the densities' norms, the level left out.
    """

    precisions: Array
    log_norms: Array


def _squares(spline: BSpline, at: Array, weights: Array, pace: Array, bend: Array, turn: Array) -> list[Array]:
    """Integrals (p, p) of g1^2, g2^2, g3^2 over an abscissa t of which `at` (n,) has dt, d^2t, d^3t by xi."""
    by_xi = [np.asarray(spline(at, order)) for order in (1, 2, 3)]
    pace, bend, turn = (v[:, None] for v in (pace, bend, turn))
    first = by_xi[0] / pace
    second = (by_xi[1] - first * bend) / pace**2
    third = (by_xi[2] - 3.0 * second * pace * bend - first * turn) / pace**3
    return [d.T @ (weights[:, None] * pace * d) for d in (first, second, third)]


@lru_cache(maxsize=64)
def _forms(size: int, rest: float, *, smooth: bool) -> Priors:
    """Priors of `size` coefficients, rest at the abscissa `rest`."""
    spline = splines(size)
    edges = np.unique(np.append(spline.t, rest))
    nodes, weights = np.polynomial.legendre.leggauss(6)  # exact along xi, to 1e-3 along its logarithm
    half = 0.5 * np.diff(edges)[:, None]
    at, weight = (edges[:-1, None] + half * (1.0 + nodes)).ravel(), (half * weights).ravel()
    reach = max(rest, 1.0 - rest)
    apart = np.abs(at - rest) / reach + NEAR_REST
    unit, side = reach * np.log((1.0 + NEAR_REST) / NEAR_REST), np.sign(at - rest)
    none = np.zeros_like(at)
    along = [
        _squares(spline, at, weight, np.ones_like(at), none, none),
        _squares(
            spline,
            at,
            weight,
            1.0 / (unit * apart),
            -side / (unit * reach * apart**2),
            2.0 / (unit * reach**2 * apart**3),
        ),
    ]
    rise = np.asarray(spline(rest, 1))
    level = np.full((size, size), 1.0 / size)  # B-splines of equal coefficients are the level, which has no prior
    made = []
    for first, second, third in along:
        families = [(second + first / REACH**2, ROUGH)]
        if smooth:
            families.append((third + second + first, SMOOTH))
        for slope in REST_SLOPES:
            made += [form / tau**2 + np.outer(rise, rise) / slope**2 for form, taus in families for tau in taus]
    precisions = np.array(made)
    return Priors(precisions, 0.5 * np.linalg.slogdet(precisions + level)[1])


def priors(basis: LawBasis, *, smooth: bool = True) -> Priors:
    """All priors of a law's form, or those of rough laws alone.

    With few data or much noise a smooth law is always the likeliest; a fit that is on its way takes the rough ones.
    """
    return _forms(basis.size, float(basis.xi[2 * basis.rest]), smooth=smooth)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Posterior of all unknowns of a fit, averaged over the priors of its law's form.

    Attributes
    ----------
    mean : (q,)
    covariance : (q, q)
        Also the response: a change dr of the whitened residual moves the mean by -covariance J^T dr, priors whose
        weight it changes included, since d log(evidence) of each is -(J (its mean - mean))^T dr up to a common term.
    shrinkage : (q, p)
        By how much the mean falls short of a law with the coefficients a, per unit of a.
    weights : (n,)
        Of the priors.
    log_evidence : float
        Of the model, up to a constant of the data.
    law_covariance : (p, p)
        Of the coefficients by the priors alone, as likely as the data make them, the level held.
    """

    mean: Array
    covariance: Array
    shrinkage: Array
    weights: Array
    log_evidence: float
    law_covariance: Array


def averaged(value: Array, J: Array, unknowns: Array, forms: Priors) -> Posterior:
    """Average over the priors of the law's form, from the linearisation of a fit.

    Parameters
    ----------
    value : (n,)
        Whitened residuals of data and of all prior knowledge but that on the law's form.
    J : (n, q)
        Their derivatives by the unknowns.
    unknowns : (q,)
        Where they were taken: coefficients of the law first, then all others.
    forms : Priors

    Strategy: what is no coefficient is eliminated once, by orthogonal factors (in a difference of squares what data
    that agree with each other tell would be lost); every prior acts on what is left, and mean, covariance and response
    of all unknowns are linear in what is found there.
    """
    p = forms.precisions.shape[1]
    Q, R = np.linalg.qr(J[:, p:])
    solved = np.linalg.inv(R)
    inner, back, offset = solved @ solved.T, -solved @ (Q.T @ J[:, :p]), -solved @ (Q.T @ value)
    beside, left = J[:, :p] - Q @ (Q.T @ J[:, :p]), value - Q @ (Q.T @ value)
    schur, pull, chi2 = beside.T @ beside, -beside.T @ left, float(left @ left)
    a = unknowns[:p]
    inverses, log_det = _inverted(schur + forms.precisions)
    toward = pull - forms.precisions @ a
    moves = np.einsum("nij,nj->ni", inverses, toward)
    misfit = chi2 + (forms.precisions @ a) @ a - np.sum(toward * moves, axis=1)
    log_det_rest = 2.0 * float(np.sum(np.log(np.abs(np.diag(R)))))
    evidence = forms.log_norms - 0.5 * (misfit + log_det + log_det_rest)
    top = float(evidence.max())
    weights = np.exp(evidence - top)
    log_evidence = top + float(np.log(weights.mean()))
    weights /= weights.sum()
    move = weights @ moves
    spread = moves - move
    covariance = np.tensordot(weights, inverses, 1) + (weights[:, None] * spread).T @ spread
    shrinkage = np.eye(p) - covariance @ schur
    across = back @ covariance
    return Posterior(
        unknowns + np.concatenate([move, offset + back @ move]),
        np.block([[covariance, across.T], [across, inner + across @ back.T]]),
        np.vstack([shrinkage, back @ shrinkage]),
        weights,
        log_evidence,
        _typical_covariance(forms, weights),
    )


def _inverted(precisions: Array) -> tuple[Array, Array]:
    """Inverses (n, p, p) of precisions, and logs (n,) of their determinants; none of rounding becomes negative."""
    values, vectors = np.linalg.eigh(precisions)
    values = np.maximum(values, values.shape[-1] * np.finfo(float).eps * values[:, -1:])
    inverses = (vectors / values[:, None, :]) @ vectors.transpose(0, 2, 1)
    return np.asarray(inverses), np.asarray(np.sum(np.log(values), axis=1))


def _typical_covariance(forms: Priors, weights: Array) -> Array:
    """Covariance of the coefficients by the likely priors: the inverse of their mean precision but for the level.

    A mean of the covariances themselves would be that of the widest priors, however unlikely the data make them.
    """
    return np.asarray(np.linalg.pinv(np.tensordot(weights, forms.precisions, 1), rcond=1e-12, hermitian=True))

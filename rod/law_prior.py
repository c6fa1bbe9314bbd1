"""What is known of the form of a law before its data, and the posterior averaged over what is not known of it.

The unknowns of a law are the coefficients a of g = log c on a `rod.compliance_law.LawBasis`, over its abscissa t = xi
from 0 to 1. With g1, g2, g3 the derivatives of g by t, a prior of one form is one of

    rough   exp(-(1 / 2 tau^2) int (g2^2 + (g1 / R)^2) dt)         R = `REACH`
    smooth  exp(-(1 / 2 tau^2) int (g3^2 + g2^2 + g1^2) dt)
    quick   rough, and in one third of the abscissa freer by a factor `FREER`

with tau of `TAUS`, times exp(-(g1(rest) / S)^2 / 2) with S of `REST_SLOPES`: most cables bend alike to both sides
of rest. They are proper but for the level, so K0 and the stiffness at rest cannot run away together. Laws that fall
smoothly are known twice as well with the smooth ones; waves and steep stretches are followed by the rough ones; laws
that change at one place and hardly elsewhere, as where wires begin to slip, by the quick ones, which need not let the
rest be as rough.
Nothing is chosen: the posterior is the average over all of them and over all tau, each normalised and weighted by its
evidence (Laplace), half of the weight beforehand with the quick ones, and the bands hold what the data leave open.

Both ways to the characteristic read the law through this module; nothing else do they share.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from rod.array import Array
from rod.compliance_law import LawBasis, splines

REACH = 0.25
"""Of the abscissa: so far apart the log compliance of a rough law has forgotten itself."""

REST_SLOPES = (0.5, 3.0)
"""Prior standard deviations of g1 at rest: of cables that bend alike to both sides, whose law is flat there, and of
such as were set and are steepest there."""

QUICK = 1.0 / 3.0
"""Of the abscissa: as much as a sudden change of the law is spread over (`rod.compliance_law`)."""

FREER = 5.0
"""How much faster a quick law may change there: as large as a knee is beside what goes on along the rest of a law."""

PLACES = 8
"""Of the third, over the abscissa: no change is farther from the middle of one than a seventh of it."""

ROUNDING = 1e-11
"""Of the scale of an unknown: what falls below is rounding."""

Forms = Literal["rough", "even", "all"]
"""Rough laws; these and the smooth ones, which change alike everywhere; and the quick ones as well."""

TAUS = np.geomspace(0.05, 300.0, 12)
"""From laws of one stiffness to such as change it a hundredfold within a tenth of the range, a factor of two apart,
over which the posterior hardly changes."""


@dataclass(frozen=True, eq=False)
class Family:
    """Priors of one form with all `TAUS`: precisions ``form / tau^2 + fixed`` of the coefficients.

    Attributes
    ----------
    form, fixed : (p, p)
    log_norms : (t,)
        Logarithms of the densities' norms, the level left out, and of their share beforehand beside other families.
    """

    form: Array
    fixed: Array
    log_norms: Array


def family(form: Array, fixed: Array, share: float = 1.0) -> Family:
    """Family with its norms and its share."""
    precisions = form / TAUS[:, None, None] ** 2 + fixed
    # B-splines of equal coefficients are the level, which has no prior: one as large as the others, taken out again
    size, scale = len(form), np.trace(precisions, axis1=1, axis2=2)
    held = precisions + scale[:, None, None] * np.full((size, size), 1.0 / size)
    return Family(form, fixed, np.log(share) + 0.5 * (np.linalg.slogdet(held)[1] - np.log(scale)))


def integrals(spline: BSpline, within: tuple[float, float] = (0.0, 1.0)) -> list[Array]:
    """Integrals (p, p) of g1^2, g2^2, g3^2 over the abscissa of the splines, or a part of it."""
    edges = np.unique(np.clip(spline.t, *within))
    nodes, weights = np.polynomial.legendre.leggauss(3)  # exact for the fourth power
    half = 0.5 * np.diff(edges)[:, None]
    at, weight = (edges[:-1, None] + half * (1.0 + nodes)).ravel(), (half * weights).ravel()
    derivatives = (np.asarray(spline(at, order)).T for order in (1, 2, 3))
    return [(d * weight) @ d.T for d in derivatives]


@lru_cache(maxsize=64)
def _families(size: int, rest: float, forms: Forms) -> tuple[Family, ...]:
    """Priors of `size` coefficients, rest at the abscissa `rest`."""
    spline = splines(size)
    rise = np.asarray(spline(rest, 1))
    squares = integrals(spline)
    rough = _rough(squares)
    slopes = [np.outer(rise, rise) / slope**2 for slope in REST_SLOPES]
    kinds = [rough] if forms == "rough" else [rough, sum(squares[1:], squares[0])]
    even = tuple(family(form, slope) for slope in slopes for form in kinds)
    if forms != "all":
        return even
    begins = np.linspace(0.0, 1.0 - QUICK, PLACES)
    freed = [_rough(integrals(spline, (begin, begin + QUICK))) for begin in begins]
    share = len(even) / (len(freed) * len(slopes))
    free = 1.0 - FREER**-2
    return even + tuple(family(rough - free * own, slope, share) for own in freed for slope in slopes)


def _rough(squares: list[Array]) -> Array:
    """Form (p, p) of a rough law from `integrals`."""
    return squares[1] + squares[0] / REACH**2


def priors(basis: LawBasis, forms: Forms = "all") -> tuple[Family, ...]:
    """The priors of a law's form.

    With few data or much noise a smooth law is always the likeliest; a fit that is on its way takes the rough ones.
    """
    return _families(basis.size, float(basis.xi[2 * basis.rest]), forms)


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
    weights : (f, t)
        Of the priors.
    log_evidence : float
        Of the model, up to a constant of the data.
    information : (p, p)
        Of the data on the coefficients.
    """

    mean: Array
    covariance: Array
    shrinkage: Array
    weights: Array
    log_evidence: float
    information: Array

    @property
    def law_forms(self) -> Array:
        """The single normal prior that leads to the same posterior, as forms (p, k) of one standard deviation each.

        Its precision is that of the posterior less the data's. Where nothing is left, the level above all, it says
        nothing, and there is no form.
        """
        p = len(self.information)
        variances, axes = np.linalg.eigh(self.covariance[:p, :p])
        root = axes * np.sqrt(np.maximum(variances, 0.0))
        told, turned = np.linalg.eigh(root.T @ self.information @ root)  # shares of the precision that are the data's
        known = told < 1.0 - 1e-9
        return np.asarray((root @ turned)[:, known] / np.sqrt(1.0 - told[known]))


def averaged(value: Array, J: Array, unknowns: Array, families: tuple[Family, ...]) -> Posterior:
    """Average over the priors of the law's form, from the linearisation of a fit.

    Parameters
    ----------
    value : (n,)
        Whitened residuals of data and of all prior knowledge but that on the law's form.
    J : (n, q)
        Their derivatives by the unknowns.
    unknowns : (q,)
        Where they were taken: coefficients of the law first, then all others.
    families : tuple of Family

    Strategy: what is no coefficient is eliminated once, by orthogonal factors (in a difference of squares what data
    that agree with each other tell would be lost); every prior acts on what is left, and mean, covariance and response
    of all unknowns are linear in what is found there.
    """
    p = len(families[0].form)
    Q, R = np.linalg.qr(J[:, p:])
    solved = np.linalg.inv(R)
    inner, back, offset = solved @ solved.T, -solved @ (Q.T @ J[:, :p]), -solved @ (Q.T @ value)
    beside, left = J[:, :p] - Q @ (Q.T @ J[:, :p]), value - Q @ (Q.T @ value)
    schur, pull = beside.T @ beside, -beside.T @ left
    ended = [conditioned(schur, pull[:, None], unknowns[:p], one) for one in families]
    # what all have in common: the misfit of the data and what the unknowns eliminated fill of it
    common = -0.5 * float(left @ left) - float(np.sum(np.log(np.abs(np.diag(R)))))
    evidence = common + np.array([one.evidence[:, 0] for one in ended])
    top = float(evidence.max())
    weights = np.exp(evidence - top)
    log_evidence = top + float(np.log(weights.mean()))
    weights /= weights.sum()
    moves = [one.moves[..., 0] for one in ended]
    move = np.sum([one.vectors @ (w @ m) for one, m, w in zip(ended, moves, weights, strict=True)], axis=0)
    covariance = np.zeros((p, p))
    for one, own, w in zip(ended, moves, weights, strict=True):
        spread = own @ one.vectors.T - move
        covariance += (one.vectors * (w @ (1.0 / one.precisions))) @ one.vectors.T + (w[:, None] * spread).T @ spread
    shrinkage = np.eye(p) - covariance @ schur
    across = back @ covariance
    return Posterior(
        unknowns + np.concatenate([move, offset + back @ move]),
        np.block([[covariance, across.T], [across, inner + across @ back.T]]),
        np.vstack([shrinkage, back @ shrinkage]),
        weights,
        log_evidence,
        schur,
    )


class Conditioned(NamedTuple):
    """One family given the data, in coordinates `vectors` (..., p, p) in which all its precisions are diagonal.

    Precisions (..., t, p), moves (..., t, p, d); the logarithm of the evidence (..., t, d) lacks what all families have
    in common.
    """

    vectors: Array
    precisions: Array
    moves: Array
    evidence: Array


def conditioned(schur: Array, pull: Array, a: Array, one: Family) -> Conditioned:
    """Posterior of the coefficients for all tau at once: data and form are diagonal in one and the same coordinates.

    Parameters
    ----------
    schur : (..., p, p)
        Information of the data on the coefficients, all other unknowns eliminated.
    pull : (..., p, d)
        What it pulls at them with, for each of d data sets, at the coefficients ``a`` (p,).
    a : (p,)
    one : Family
    """
    # prior and data hold every law but for rounding, and a constant one is not to fall short by it
    root, log_det = inverse_root(schur + one.fixed + one.form, rounding=10.0 * len(a) * np.finfo(float).eps)
    turn = root.swapaxes(-1, -2)
    share, turned = np.linalg.eigh(root @ one.form @ turn)
    vectors = turn @ turned
    share, tau = np.clip(share, 0.0, 1.0)[..., None, :], TAUS[:, None]
    precisions = (1.0 - share) + share / tau**2
    turn = vectors.swapaxes(-1, -2)
    fixed, form = turn @ (one.fixed @ a), turn @ (one.form @ a)
    known = (fixed[..., None, :] + form[..., None, :] / tau**2)[..., None]
    toward = (turn @ pull)[..., None, :, :] - known
    prior = a @ (one.fixed @ a) + (a @ (one.form @ a)) / TAUS**2
    gained = np.sum(toward**2 / precisions[..., None], axis=-2) - prior[:, None]
    log_det = np.sum(np.log(precisions), axis=-1) + log_det[..., None]
    evidence = (one.log_norms - 0.5 * log_det)[..., None] + 0.5 * gained
    return Conditioned(vectors, precisions, toward / precisions[..., None], evidence)


def inverse_root(H: Array, *, rounding: float = ROUNDING) -> tuple[Array, Array]:
    """W (..., r, r) with W' W = H^-1, and log|H| (...)."""
    root, scale = _root(H, rounding)
    return np.linalg.inv(root) / scale[..., None, :], _log_squares(root, scale)


def least(H: Array, last: int) -> tuple[Array, Array]:
    """What the best combination of all other columns leaves of the ``last`` ones, squared, and log|H| of those others.

    Parameters
    ----------
    H : (..., r + last, r + last)
        Products of all columns.
    last : int

    Returns
    -------
    (..., last), (...)
    """
    root, scale = _root(H, ROUNDING)
    first = H.shape[-1] - last
    left = (root[..., first:, first:] ** 2).sum(axis=-1) * scale[..., first:] ** 2
    return left, _log_squares(root[..., :first, :first], scale[..., :first])


def _root(H: Array, rounding: float) -> tuple[Array, Array]:
    """Cholesky factor (..., r, r) of H with all its diagonal scaled to 1, and the scale (..., r)."""
    shown = np.diagonal(H, axis1=-2, axis2=-1)
    scale = np.sqrt(np.where(shown > 1e-100, shown, 1.0))  # of an unknown that nothing shows any unit will do
    whole = H / scale[..., :, None]
    whole /= scale[..., None, :]
    whole += rounding * np.eye(H.shape[-1])
    return np.asarray(np.linalg.cholesky(whole), dtype=np.float64), scale


def _log_squares(root: Array, scale: Array) -> Array:
    return np.asarray(2.0 * np.log(np.diagonal(root, axis1=-2, axis2=-1) * scale).sum(axis=-1))

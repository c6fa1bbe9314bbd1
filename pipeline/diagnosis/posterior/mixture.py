"""How far f_EI and K0 may lie from a fit by all that is believed: the mixture over hypotheses and error models.

Every hypothesis that was refitted, with and without something else, is under every error model (`evidence`) a normal
distribution of log f_EI at curvatures K_i and of K0: about that fit, with the error model's own mean and covariance. A
cause that was weighed by the linear model alone moves the base model's unknowns by -(J^+ c) a, with its amount a and
variance given each size beforehand. So effects too weak to be named, names that cannot be told apart, and what no cause
makes are in the band, each as far as it is believed.

The band is the narrowest symmetric one about the curve that answers which holds 95 % of the mixture at every curvature.
What it has beyond that curve's own band is told as factors, correlated along the curvature like the mixture.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtr

from pipeline.diagnosis.fits.extended import factor_of, stated
from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.posterior.error_grid import ErrorGrid
from pipeline.diagnosis.posterior.evidence import SIZES, as_told, moments
from pipeline.diagnosis.posterior.hypotheses import LEVEL, Posterior
from pipeline.records import Array
from pipeline.result import Curve, Widening, visited
from rod.inverse.fit import Fit

NEGLIGIBLE = 0.002
"""Probability of a hypothesis or an error model that is left out; the band lets 5 % lie outside."""

COLUMNS = 4
"""Factors that carry the correlation along the curvature; log f_EI goes by few and smooth ones."""


class _Parts(NamedTuple):
    """Components: weight (c,), mean (c, n + 1) beside the answer and factors of the covariance (c, n + 1, p)."""

    weight: Array
    mean: Array
    root: Array


class Centre(NamedTuple):
    """What is stated: log f_EI at curvatures (n,) 1/m and, last, K0 (n + 1,), with the standard deviations."""

    kappa: Array
    values: Array
    std: Array


def centre_of(curve: Curve) -> Centre:
    """A curve of f_EI where a cable was bent to, at as many curvatures as tell it."""
    seen = visited("extended", curve)
    assert seen is not None  # a curve of a fit has two points at least
    at = np.unique(np.linspace(0, len(seen.kappa) - 1, READ).astype(int))
    tangent, std = np.maximum(seen.tangent, 1e-3 * float(np.max(seen.tangent)))[at], seen.tangent_std[at]
    rest, rest_std = seen.pre_curvature, seen.pre_curvature_std
    return Centre(seen.kappa[at], np.append(np.log(tangent), rest), np.append(std / tangent, rest_std))


READ = 31
"""Curvatures at which hypotheses are compared: f_EI is smooth between its 12 control points."""


def widening(
    grid: ErrorGrid,
    posterior: Posterior,
    base: Fit,
    suspicion: Suspicion,
    centre: Centre,
    *,
    own: tuple[Fit, Fit] | None = None,
) -> Widening:
    """What all hypotheses add to the band of a curve.

    ``own``: a refit, and that refit with its law identified again, whose curve it is: there the model is linear enough
    for what each error model says of it. Without them the curve is that of the base model without something else,
    fitted by way one.
    """
    refit, nearest = own or (base, base)
    here, (move, _) = stated(nearest, centre.kappa), as_told(grid, nearest)
    # what way one states is the mean over all priors of the law for data as wrong as they say
    offset = np.zeros_like(centre.values) if own else centre.values - here.values - here.rows @ move
    parts = [
        *_refits(grid, posterior, base, centre, {id(refit): nearest}, offset),
        _unfitted(grid, posterior, base, suspicion, centre, offset),
    ]
    weight = np.concatenate([part.weight for part in parts])
    mean = np.vstack([part.mean for part in parts])
    variance = np.vstack([np.sum(part.root**2, axis=2) for part in parts])
    band = _half_width(weight / weight.sum(), mean, np.sqrt(variance)) / 1.96  # of a normal one
    extra = np.sqrt(np.maximum(band**2 - centre.std**2, 0.0))
    covariance = sum(_covariance(part) for part in parts)
    return _told(centre.kappa, extra, np.asarray(covariance) / weight.sum())


def _refits(
    grid: ErrorGrid, posterior: Posterior, base: Fit, centre: Centre, again: dict[int, Fit], offset: Array
) -> Iterator[_Parts]:
    """Components of the base model and of every refit, for the error models that count.

    ``again``: what is looked at in the place of the fit that is the answer; without something else that lies beside its
    fit by an ``offset`` (n + 1,).
    """
    chances: dict[int, tuple[Fit, dict[bool, float]]] = {}
    for one in posterior.believed:
        fitted = one.found.fitted if one.found else base
        if one.probability > NEGLIGIBLE and (one.found or one.something_else or not one.causes):
            chance = chances.setdefault(id(fitted), (fitted, {}))[1]
            disturbed = one.something_else and not (one.found and one.found.unnamed)
            chance[disturbed] = chance.get(disturbed, 0.0) + one.probability
    for own, (fitted, chance) in chances.items():
        fitted = again.get(own, fitted)
        here = stated(fitted, centre.kappa)
        found = moments(grid if True in chance else grid.plain, fitted, negligible=NEGLIGIBLE)
        for rest, probability in chance.items():
            these, beside = found.rest == rest, offset if own in again and not rest else 0.0
            root = here.rows @ factor_of(found.covariance[these])
            mean = here.values + beside - centre.values + found.move[these] @ here.rows.T
            yield _Parts(probability * found.weight[these], mean, root)


def _unfitted(
    grid: ErrorGrid, posterior: Posterior, base: Fit, suspicion: Suspicion, centre: Centre, shift: Array
) -> _Parts:
    """Components of causes that the linear model alone weighed, each in its loudest form and any size beforehand."""
    here, scores, (move, known) = stated(base, centre.kappa), suspicion.scores, as_told(grid, base)
    unit = np.linalg.norm(base.jacobian, axis=0)
    unit = np.where(unit > 0.0, unit, 1.0)
    pseudo = np.linalg.pinv(base.jacobian / unit, rcond=1e-7) / unit[:, None]
    own = here.rows @ factor_of(known)
    about = here.values + here.rows @ move + shift - centre.values
    weight, mean, root = [], [], []
    for one in posterior.believed:
        if one.found or len(one.causes) != 1 or one.something_else or one.probability < NEGLIGIBLE:
            continue
        best = suspicion.best(one.causes[0])
        if best is None or not scores.norm[best] > 0.0:
            continue  # of what these data do not show at all the size is a mere belief: a blind spot, told as such
        cause = suspicion.causes[one.causes[0]]
        along = -here.rows @ (pseudo @ suspicion.columns[:, best])
        flat, variance = float(scores.estimate[best]), float(scores.std[best]) ** 2
        size = (SIZES * cause.plausible(base.extension.facts)) ** 2
        amount, left = flat * size / (size + variance), variance * size / (size + variance)
        log = -0.5 * (flat**2 / (size + variance) + np.log(size + variance))
        log += log_ndtr(cause.sign * amount / np.sqrt(left)) if cause.sign else 0.0
        weight.append(one.probability * np.exp(log - logsumexp(log)))
        mean.append(about + amount[:, None] * along)
        root.append(np.dstack([np.broadcast_to(own, (len(size), *own.shape)), np.sqrt(left)[:, None] * along]))
    if not weight:
        return _Parts(np.zeros(0), np.zeros((0, len(centre.values))), np.zeros((0, len(centre.values), 1)))
    return _Parts(np.concatenate(weight), np.vstack(mean), np.vstack(root))


def _half_width(weight: Array, mean: Array, std: Array) -> Array:
    """Half of the narrowest symmetric interval about zero (n,) that holds 95 % of a mixture (c,), by bisection."""
    low, high = np.zeros(mean.shape[1]), np.max(np.abs(mean) + 6.0 * std, axis=0)
    for _ in range(40):
        middle = 0.5 * (low + high)
        inside = weight @ (ndtr((middle - mean) / std) - ndtr((-middle - mean) / std))
        low, high = np.where(inside < LEVEL, middle, low), np.where(inside < LEVEL, high, middle)
    return np.asarray(high)


def _covariance(part: _Parts) -> Array:
    """Sum over components (n + 1, n + 1) of weight times second moment about the answer."""
    spread = np.einsum("c,cip,cjp->ij", part.weight, part.root, part.root, optimize=True)
    return np.asarray(spread + np.einsum("c,ci,cj->ij", part.weight, part.mean, part.mean, optimize=True))


def _told(kappa: Array, extra: Array, covariance: Array) -> Widening:
    """Factors whose rows are as long as ``extra`` (n + 1,) says and turn like the covariance (n + 1, n + 1)."""
    std = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(std, std))
    rows = vectors[:, -COLUMNS:] * np.sqrt(np.maximum(values[-COLUMNS:], 0.0))
    factor = extra[:, None] * rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    return Widening(
        kappa_per_m=kappa.tolist(), tangent_factor=factor[:-1].tolist(), pre_curvature_factor_per_m=factor[-1].tolist()
    )

"""How probable the data are under a fitted model, and under that model with one more column: evidence of hypotheses.

About a fit the model is linear: with whitened residual r, sensitivities J, rows of prior knowledge (r_p, J_p), an
error model C of `error_grid` and a prior exp(n - a' P a / 2) of the law's coefficients a, one of `rod.law_prior`,
b = J' C^-1 r + J_p' r_p - P a and H = J' C^-1 J + J_p' J_p + P,

    log p = n - 1/2 (r' C^-1 r + r_p' r_p + a' P a - b' H^-1 b) - 1/2 log|C| - 1/2 log|H| + (p / 2) log 2 pi,

flat in all that has no prior: the law's level and K0, which all hypotheses share, and amounts. The mean over all priors
of the law and the sum over all error models count. Held to one prior, a law with an early knee is less likely than a
smooth one beside a cause that is not there. An amount has beforehand a normal distribution about zero, of a size s
times the plausible one, s anywhere from 0.003 to 10. With its estimate a and variance S (flat, from H) that multiplies
p by

    mean over s of  N(a; 0, S + s^2 plausible^2) * 2 Phi(m / d)        m, d: mean and std of the amount given s,

the second factor where its sign is known. A place or a width that is tuned has the variance of a uniform distribution
over its range. Hypotheses that differ by a column c of the linear model alone follow from one H:

    S = 1 / (c' C^-1 c - u' H^-1 u),   a = S (c' C^-1 r - u' H^-1 b),   u = J' C^-1 c.

Source: MacKay (1992), Bayesian interpolation, eqs. 2.4 and 2.5; the size of an amount is integrated over, not chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import erfcx, log_ndtr

from pipeline.diagnosis.posterior.error_grid import ErrorGrid
from pipeline.diagnosis.posterior.products import ASTRAY
from pipeline.diagnosis.posterior.unknowns import (
    LOG_2PI,
    NOTHING,
    Solved,
    conditional,
    log_sum,
    mean_over_laws,
    of_known_size,
    solved_alone,
    solved_for,
    solved_once,
)
from pipeline.records import Array
from rod.inverse.cause import Cause
from rod.inverse.extension import Term
from rod.inverse.fit import Fit
from rod.inverse.prediction import Facts

SIZES = np.geomspace(0.003, 10.0, 8)
"""Sizes s of an amount, in plausible ones: steps of a factor three, over which a normal density hardly changes."""

INVISIBLE = 1e-9
"""Of a column's square: what falls below is rounding."""

FEW = 12.0
"""Of log p: a prior of the law that is so much less likely than all together counts for nothing beside a further column
either."""


class Evidence(NamedTuple):
    """Log probability of the data, by the model alone (``plain``) and with something else besides (``rest``).

    Without something else: ``moved``: probability that displacements scatter beyond the log, and by how much if so (m);
    ``rig``: probability that the rig is off by what rigs ordinarily are, and by how much if so, in those standard
    deviations.
    """

    plain: float
    rest: float
    moved: tuple[float, float]
    rig: tuple[float, float]


class WithColumn(NamedTuple):
    """The same (k,) for the fit with each of k further columns."""

    plain: Array
    rest: Array


def evidence(
    grid: ErrorGrid, fitted: Fit, terms: Sequence[Term] = (), columns: Array | None = None
) -> tuple[Evidence, WithColumn]:
    """Evidence of a fit, and of the fit with each of some further columns; see `evidences`."""
    if columns is None:
        return _summed(grid, fitted, terms, solved_once(grid, fitted))[0]
    return evidences(grid, fitted, fitted.residual[:, None], terms, columns)[0]


def evidences(
    grid: ErrorGrid, fitted: Fit, residuals: Array, terms: Sequence[Term], columns: Array
) -> list[tuple[Evidence, WithColumn]]:
    """Evidence of one linear model for several residuals, and of it with each of some further columns.

    Parameters
    ----------
    grid : ErrorGrid
    fitted : Fit
        The model; its own residual counts for nothing.
    residuals : (N, d)
        Whitened, prior rows last.
    terms : (k,) of Term
        What the columns are.
    columns : (N, k)
        Whitened traces per unit of amount.
    """
    return _summed(grid, fitted, terms, solved_for(grid, fitted, columns, residuals))


def _summed(grid: ErrorGrid, fitted: Fit, terms: Sequence[Term], solved: Solved) -> list[tuple[Evidence, WithColumn]]:
    """Evidence for each residual, over all priors of the law and all error models."""
    by_law = solved.flat + _amounts(fitted, solved) + solved.products.log_prior[:, None, None, None]
    posterior, rest = mean_over_laws(by_law), solved.products.rest
    plain, disturbed = (_total(posterior[part]) for part in (~rest, rest))
    further = _with_each(fitted, terms, solved, by_law)
    weight, scales = np.exp(posterior[~rest] - plain), solved.products.scales[~rest]
    found = []
    for k, one in enumerate(weight.T):
        moved = _moved(scales[:, 0], one) if fitted.beyond_log.size else (0.0, 0.0)
        rig = _moved(scales[:, -1], one) if scales.shape[1] > fitted.beyond_log.size else (0.0, 0.0)
        own_evidence = Evidence(float(plain[k]), float(disturbed[k]), moved, rig)
        found.append((own_evidence, WithColumn(*(part[k] for part in further))))
    return found


class SomethingElse(NamedTuple):
    """What beside a fit is likeliest to be something else: whitened rows (n,) of the data.

    ``astray``: what displacements are off by where that is it (root mean square, m); 0 where it is something else.
    """

    rows: Array
    astray: float


def something_else(grid: ErrorGrid, fitted: Fit) -> SomethingElse:
    """What beside a fit is likeliest to be something else."""
    solved = solved_alone(grid, fitted)
    weight = np.where(solved.products.rest, mean_over_laws(solved.flat)[:, 0] + solved.products.log_prior, -np.inf)
    best = int(np.argmax(weight))
    data, (residual, jacobian) = len(grid.photos) + len(grid.forces), fitted.as_logged
    move = conditional(solved, solved.flat, np.array([best]))[0][0]
    size, beside = jacobian.shape[1], np.hstack(of_known_size(grid, fitted))
    scales = solved.products.scales[best]
    by = scales * move[size:]
    own = by[: len(fitted.beyond_log)]
    if own.size and scales[0] >= ASTRAY[0]:
        return SomethingElse(beside[:, : own.size] @ own, float(np.sqrt(np.mean(own**2))))
    left = residual[:data] - jacobian[:data] @ move[:size] - beside @ by
    return SomethingElse(grid.something_else(solved.products.sizes[best], left), 0.0)


class Moments(NamedTuple):
    """What error models say of a fit's own unknowns: how likely each is (g,), moves (g, p), covariances (g, p, p).

    ``rest`` (g,): whether an error model holds something else. The weights of either kind sum to 1. The first error
    model takes data for as wrong as they say. Errors of displacements beyond the log's are not among the moves.
    """

    weight: Array
    move: Array
    covariance: Array
    rest: NDArray[np.bool_]


def moments(grid: ErrorGrid, fitted: Fit, *, negligible: float) -> Moments:
    """Mean and covariance of a fit's unknowns under every error model of a weight above ``negligible``."""
    return _moments(solved_alone(grid, fitted), fitted, negligible)


def as_told(grid: ErrorGrid, fitted: Fit) -> tuple[Array, Array]:
    """Mean (p,) and covariance (p, p) of a fit's unknowns by data that are as wrong as they say."""
    first = grid.kinds[0]
    held, kind = next(iter(grid.hold.items())), first._replace(shapes=first.shapes[:1], pairs=first.pairs[:1])
    stated = replace(grid, kinds=(kind,), hold=dict([held]))
    found = _moments(solved_once(stated, fitted), fitted, negligible=1.0)
    return found.move[0], found.covariance[0]


def _moments(solved: Solved, fitted: Fit, negligible: float) -> Moments:
    by_law, rest = solved.flat + _amounts(fitted, solved), solved.products.rest
    log_weight = mean_over_laws(by_law)[:, 0] + solved.products.log_prior
    weight = np.zeros(len(rest))
    for part in (rest, ~rest):
        weight[part] = np.exp(log_weight[part] - _total(log_weight[part]))
    kept = np.union1d([0], np.flatnonzero(weight > negligible))
    # a law that looks smooth, or bent, where something else is at work is not known to be: its priors stay as they were
    by_law = np.where(rest[:, None, None, None], 0.0, by_law)
    move, covariance = conditional(solved, by_law, kept)
    size = fitted.extension.size
    own = np.delete(np.arange(size), fitted.beyond_stated)
    moves, covariances = np.zeros((len(kept), size)), np.zeros((len(kept), size, size))
    moves[:, own] = move[:, : own.size]
    covariances[:, own[:, None], own] = covariance[:, : own.size, : own.size]
    return Moments(weight[kept], *_sized(fitted, solved.amounts, moves, covariances), rest[kept])


def _sized(fitted: Fit, amounts: Sequence[int], move: Array, covariance: Array) -> tuple[Array, Array]:
    """Mean (k, p) and covariance (k, p, p) with what is known of the size of each amount.

    Of some the data tell nothing: a gain of the load cell that is free takes the scale of f_EI with it.
    """
    extension = fitted.extension
    for at in amounts:
        plausible = extension.terms[extension.amounts_at.index(at)].cause.plausible(extension.facts)
        value, column = fitted.vector[at] + move[:, at], covariance[:, :, at]
        wide = column[:, at, None] + (SIZES * plausible) ** 2
        log = -0.5 * (value[:, None] ** 2 / wide + np.log(wide))
        share = np.exp(log - _total(log.T)[:, None])
        once, twice = np.sum(share / wide, axis=1), np.sum(share / wide**2, axis=1)
        move = move - column * (value * once)[:, None]
        less = once - value**2 * (twice - once**2)
        covariance = covariance - less[:, None, None] * column[:, :, None] * column[:, None, :]
    return move, covariance


def _total(logs: Array) -> Array:
    """Log of the sum over the error models (G, ...); minus infinity where a grid has none of a kind."""
    return log_sum(logs) if len(logs) else np.full(logs.shape[1:], -np.inf)


def _moved(scatter: Array, weight: Array) -> tuple[float, float]:
    chance = float(weight[scatter > 0.0].sum())
    return chance, float(np.sqrt(weight @ scatter**2 / chance)) if chance > 0.0 else 0.0


def _amounts(fitted: Fit, solved: Solved) -> Array:
    """Log of the factor (G, l, t, d) by which the prior of the fit's own amounts changes p.

    Where p is nothing beside the largest it is left as it is.
    """
    extension, total = fitted.extension, np.zeros(solved.flat.shape)
    owner = [extension.terms[extension.amounts_at.index(k)].cause for k in solved.amounts]
    if not owner:
        return total
    rest = solved.products.rest
    best = np.max(solved.flat, axis=(1, 2), keepdims=True)
    top = np.stack([np.max(best[part], axis=0) if part.any() else np.zeros(best.shape[1:]) for part in (~rest, rest)])
    told = solved.flat > top[rest.astype(int)] - NOTHING
    value = (fitted.vector[solved.amounts] + solved.move)[told]
    covariance = np.broadcast_to(solved.covariance[:, :, :, None], (*solved.move.shape, len(owner)))[told]
    causes = list(dict.fromkeys(owner))
    causes.sort(key=lambda cause: -owner.count(cause))  # the last one is the cheapest
    own = [[k for k, other in enumerate(owner) if other is cause] for cause in causes]
    total[told] = _sizes_unknown(value, covariance, [*zip(causes, own, strict=True)], extension.facts)
    return total


def _sizes_unknown(value: Array, covariance: Array, parts: Sequence[tuple[Cause, list[int]]], facts: Facts) -> Array:
    """Log mean over the sizes s of all causes of N(value; 0, covariance + s^2 plausible^2), times 2 Phi, (n,).

    Parameters
    ----------
    value, covariance : (n, k), (n, k, k)
        Estimates of the amounts and how well they are known.
    parts : list of (cause, positions of its amounts)
        Two causes may be known together alone, so the second one is weighed given the first one at each size.
    facts : Facts
    """
    (cause, own), *others = parts
    sizes, mine = (SIZES * cause.plausible(facts)) ** 2, covariance[:, own][..., own]
    if not others and len(own) == 1:
        alone, variance = value[:, own[0]], mine[:, 0, 0]
        flat = 0.5 * (alone**2 / variance + np.log(variance) + LOG_2PI)
        return log_gain(alone, variance, cause.plausible(facts), cause.sign) - flat
    logs = []
    for size in sizes:
        wide = np.linalg.inv(mine + size * np.eye(len(own)))
        there = (wide @ value[:, own, None])[..., 0]
        log = 0.5 * (np.linalg.slogdet(wide)[1] - np.sum(value[:, own] * there, axis=1) - len(own) * LOG_2PI)
        if cause.sign:
            # the variance of each given s: prior minus what the data take of it
            left = size * (1.0 - size * np.einsum("nii->ni", wide))
            log += np.sum(np.log(2.0) + log_ndtr(cause.sign * size * there / np.sqrt(np.maximum(left, 1e-300))), axis=1)
        if others:
            across = covariance[:, :, own]
            moved = value - (across @ there[..., None])[..., 0]
            log += _sizes_unknown(moved, covariance - across @ wide @ across.swapaxes(1, 2), others, facts)
        logs.append(log)
    return np.asarray(log_sum(np.array(logs)) - np.log(len(SIZES)))


def _with_each(fitted: Fit, terms: Sequence[Term], solved: Solved, by_law: Array) -> Array:
    """Log p (2, d, k) with each further column, without and with something else: of the priors of the law that matter.

    ``by_law`` (G, l, t, d): log p of each error model and prior of the law.
    """
    several = by_law.shape[-1]
    if not terms:
        return np.zeros((2, several, 0))
    law, half = _onto_law(solved)
    pulled = solved.products.cross[:, :several] - solved.pull.swapaxes(1, 2) @ half
    mean, beside = mean_over_laws(by_law), solved.products.rest
    least = mean + np.log(by_law[0, ..., 0].size) - FEW
    # something else that is nothing for a residual is left out for it, though others in its company asked for it
    least[beside] = np.maximum(least[beside], np.max(mean[beside], axis=0, initial=-np.inf) - NOTHING)
    total = np.full((2, several, law.shape[2]), -np.inf)
    for number, logs in enumerate(by_law.transpose(1, 3, 0, 2)):
        one, precision = solved.laws[number], told_of_columns(solved, number)
        along = one.vectors.swapaxes(1, 2) @ law
        for d in range(several):
            model, tau = np.nonzero(logs[d] > least[:, d, None])
            wide = 1.0 / precision[model, tau]
            amount = (pulled[:, None, d] - one.moves[..., d] @ along)[model, tau] * wide
            added = logs[d][model, tau] + _gains(fitted, terms, amount, wide)
            rest = beside[model]
            for part, own in enumerate((~rest, rest)):
                total[part, d] = np.logaddexp(total[part, d], _total(added[:, own].T))
    return np.asarray(total - np.log(by_law[0, ..., 0].size))


def told_of_columns(solved: Solved, number: int) -> Array:
    """What the data tell of the amount of each column (G, t, k), 1 / S, by one family of the law's priors."""
    one, (law, half), square = solved.laws[number], _onto_law(solved), solved.products.square
    alone = square - np.einsum("gik,gik->gk", half, half)
    left = alone[:, None] - (1.0 / one.precisions) @ (one.vectors.swapaxes(1, 2) @ law) ** 2
    return np.asarray(np.maximum(left, (INVISIBLE * square + 1e-300)[:, None]))


def _onto_law(solved: Solved) -> tuple[Array, Array]:
    """Columns onto the law (G, p, k) and onto all other unknowns (G, r, k), the latter eliminated."""
    cross, size = solved.products.cross, solved.across.shape[2]
    first = cross.shape[1] - solved.half.shape[1]
    half = solved.half @ cross[:, first:]
    return cross[:, first - size : first] - solved.across.swapaxes(1, 2) @ half, half


def _gains(fitted: Fit, terms: Sequence[Term], amount: Array, variance: Array) -> Array:
    """`log_gain` (k, n) of columns (k,) from their flat estimates and variances (n, k)."""
    found, facts = np.ascontiguousarray(amount.T), fitted.extension.facts
    for k, (term, wide) in enumerate(zip(terms, np.ascontiguousarray(variance.T), strict=True)):
        found[k] = log_gain(found[k], wide, term.cause.plausible(facts), term.cause.sign)
    return found


def log_gain(amount: Array | float, variance: Array | float, plausible: float, sign: int) -> Array:
    """Log of the factor by which a cause of a flat estimate and its variance, of one shape, changes p.

    With x^2 = a^2 s^2 / (S (S + s^2)) it is the mean over s of (S / (S + s^2))^(1/2) exp(x^2 / 2), times 2 Phi(x) where
    the sign is known; exp(x^2 / 2) 2 Phi(-x) = erfcx(x / 2^(1/2)), so nothing overflows where the largest exponential
    is taken out.
    """
    value, own = np.atleast_1d(amount), np.atleast_1d(variance)
    half, sizes = 0.5 * value * (value / own), (SIZES * plausible) ** 2
    right = sign * value > 0.0 if sign else np.ones(value.shape, dtype=bool)
    toward, root = np.where(right, half, 0.0), np.sqrt(half)
    top, total = toward * (sizes[-1] / (own + sizes[-1])), np.zeros(value.shape)
    against, twice = np.where(right, -1.0, 1.0) * np.exp(-top), 2.0 * right
    for size in sizes:
        wide = own + size
        share = size / wide
        likely = np.exp(toward * share - top)
        if sign:
            likely = twice * likely + against * erfcx(root * np.sqrt(share))
        total += np.sqrt(own / wide) * likely
    return np.asarray(top + np.log(total / len(SIZES)))

"""How probable the data are under a fitted model, and under that model with one more column: evidence of hypotheses.

About a fit the model is linear: with whitened residual r, sensitivities J, rows of prior knowledge (r_p, J_p) and an
error model C of `error_grid`, b = J' C^-1 r + J_p' r_p and H = J' C^-1 J + J_p' J_p,

    log p = -1/2 (r' C^-1 r + r_p' r_p - b' H^-1 b) - 1/2 log|C| - 1/2 log|H| + (p / 2) log 2 pi,

flat in all that has no prior row: law and K0, which all hypotheses share, and amounts. An amount has beforehand a
normal distribution about zero, of a size s times the plausible one, s anywhere from 0.003 to 10. With its estimate a
and variance S (flat, from H) that multiplies p by

    mean over s of  N(a; 0, S + s^2 plausible^2) * 2 Phi(m / d)        m, d: mean and std of the amount given s,

the second factor where its sign is known. A place or a width that is tuned has the variance of a uniform distribution
over its range. Hypotheses that differ by a column c of the linear model alone follow from one H:

    S = 1 / (c' C^-1 c - u' H^-1 u),   a = S (c' C^-1 r - u' H^-1 b),   u = J' C^-1 c.

Source: MacKay (1992), Bayesian interpolation, eqs. 2.4 and 2.5; the size of an amount is integrated over, not chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from pipeline.diagnosis.posterior.error_grid import ErrorGrid, Products
from rod.inverse.extension import Term
from rod.inverse.fit import Fit

Array = NDArray[np.float64]

SIZES = np.geomspace(0.003, 10.0, 8)
"""Sizes s of an amount, in plausible ones: steps of a factor three, over which a normal density hardly changes."""

ROUNDING, INVISIBLE = 1e-11, 1e-9
"""Of the scale of an unknown, and of a column's square: what falls below is rounding."""

LOG_2PI = float(np.log(2.0 * np.pi))


class Evidence(NamedTuple):
    """Log probability of the data, by the model alone (``plain``) and with something else besides (``rest``).

    Without something else: ``moved``: probability that displacements scatter beyond the log, and by how much if so (m);
    ``rig``: probability that zero, length and camera are off by what they ordinarily are.
    """

    plain: float
    rest: float
    moved: tuple[float, float]
    rig: float


class WithColumn(NamedTuple):
    """The same (k,) for the fit with each of k further columns."""

    plain: Array
    rest: Array


@dataclass(frozen=True, eq=False)
class _Solved:
    """What the fit's own unknowns are for every error model.

    ``flat`` (G, d): log p flat in the amounts. ``half`` (G, p, p): W with W' W = H^-1; ``pull`` (G, p, d): W b.
    ``amounts``: those of the vector that no prior row states. ``move`` (G, d, a) of these and ``covariance`` (G, a, a).
    """

    products: Products
    flat: Array
    half: Array
    pull: Array
    amounts: list[int]
    move: Array
    covariance: Array


def evidence(
    grid: ErrorGrid, fitted: Fit, terms: Sequence[Term] = (), columns: Array | None = None
) -> tuple[Evidence, WithColumn]:
    """Evidence of a fit, and of the fit with each of some further columns; see `evidences`."""
    return evidences(grid, fitted, fitted.residual[:, None], terms, columns)[0]


def evidences(
    grid: ErrorGrid, fitted: Fit, residuals: Array, terms: Sequence[Term] = (), columns: Array | None = None
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
    columns : (N, k) or None
        Whitened traces per unit of amount.
    """
    more = np.zeros((len(residuals), 0)) if columns is None else columns
    solved = _solved(grid, fitted, more, residuals)
    own = solved.flat + _amounts(fitted, solved)
    added = own[..., None] + _column_gain(fitted, terms, solved)
    prior, rest = solved.products.log_prior, solved.products.rest
    posterior = own + prior[:, None]
    plain, disturbed = (_total(posterior[part]) for part in (~rest, rest))
    further = [_total(added[part] + prior[part, None, None]) for part in (~rest, rest)]
    weight, scales = np.exp(posterior[~rest] - plain), solved.products.scales[~rest]
    found = []
    for k, one in enumerate(weight.T):
        moved = _moved(scales[:, 0], one) if grid.displacements.shape[1] else (0.0, 0.0)
        rig = float(one @ (scales[:, -1] > 0.0)) if grid.rig.shape[1] else 0.0
        own_evidence = Evidence(float(plain[k]), float(disturbed[k]), moved, rig)
        found.append((own_evidence, WithColumn(*(part[k] for part in further))))
    return found


def something_else(grid: ErrorGrid, fitted: Fit) -> Array:
    """What beside a fit is likeliest to be something else, as whitened rows (n,) of the data."""
    solved = _solved(grid, fitted, np.zeros((len(fitted.residual), 0)), fitted.residual[:, None])
    weight = np.where(solved.products.rest, solved.flat[:, 0] + solved.products.log_prior, -np.inf)
    best = int(np.argmax(weight))
    size, data = fitted.extension.size, len(grid.photos) + len(grid.forces)
    move = solved.half[best].T @ solved.pull[best, :, 0]
    moved = grid.beside[:data] @ (solved.products.scales[best] * move[size:])
    left = fitted.residual[:data] - fitted.jacobian[:data] @ move[:size] - moved
    return grid.something_else(solved.products.sizes[best], left)


def log_sum(logs: Array) -> Array:
    """Log of the sum of exponentials along the first axis, all finite: in a tenth of the time that scipy's takes."""
    top = np.max(logs, axis=0)
    return np.asarray(top + np.log(np.exp(logs - top).sum(axis=0)))


class Moments(NamedTuple):
    """What the error models say of a fit's own unknowns: how likely each is (G,), moves (G, p), covariances (G, p, p).

    ``rest`` (G,): whether an error model holds something else.
    """

    log_weight: Array
    move: Array
    covariance: Array
    rest: NDArray[np.bool_]


def moments(grid: ErrorGrid, fitted: Fit) -> Moments:
    """Mean and covariance of a fit's unknowns under every error model."""
    solved = _solved(grid, fitted, np.zeros((len(fitted.residual), 0)), fitted.residual[:, None])
    weight = (solved.flat + _amounts(fitted, solved))[:, 0] + solved.products.log_prior
    own = solved.half[:, :, : fitted.extension.size]
    turned = own.swapaxes(1, 2)
    return Moments(weight, (turned @ solved.pull)[..., 0], turned @ own, solved.products.rest)


def _total(logs: Array) -> Array:
    """Log of the sum over the error models (G, ...); minus infinity where a grid has none of a kind."""
    return log_sum(logs) if len(logs) else np.full(logs.shape[1:], -np.inf)


def _moved(scatter: Array, weight: Array) -> tuple[float, float]:
    chance = float(weight[scatter > 0.0].sum())
    return chance, float(np.sqrt(weight @ scatter**2 / chance)) if chance > 0.0 else 0.0


def _solved(grid: ErrorGrid, fitted: Fit, more: Array, residuals: Array) -> _Solved:
    """The fit's unknowns, columns in the order residuals (N, d), J, displacements."""
    data, several = len(grid.photos) + len(grid.forces), residuals.shape[1]
    columns = np.hstack([residuals, fitted.jacobian])
    places, mid, std = _places(fitted)
    first = len(columns) - data
    known = np.zeros((first + len(places), columns.shape[1]))
    known[:first] = columns[data:]
    for row, (at, middle, width) in enumerate(zip(places, mid, std, strict=True), start=first):
        known[row, :several], known[row, several + at] = (middle - fitted.vector[at]) / width, 1.0 / width
    products = grid.products(columns[:data], known, more[:data])
    H, b = products.own[:, several:, several:], products.own[:, several:, :several]
    shown = np.einsum("gii->gi", H)
    scale = np.sqrt(np.where(shown > 1e-100, shown, 1.0))  # of an unknown that nothing shows any unit will do
    unit = 1.0 / scale
    H = H * unit[:, :, None] * unit[:, None, :]
    np.einsum("gii->gi", H)[:] += ROUNDING
    amounts = _unknown(fitted)
    root = np.asarray(np.linalg.cholesky(H), dtype=np.float64)
    half = _inverse(root) * unit[:, None]
    pull = half @ b
    own = half[:, :, amounts]
    log_det = 2.0 * np.log(np.einsum("gii->gi", root) * scale).sum(axis=1)
    # places, waves and displacements have normal densities, whose factors of 2 pi cancel; law and K0 are in all alike
    normal = 0.5 * len(amounts) * LOG_2PI - float(np.sum(np.log(std))) + sum(_log_known(fitted))
    squares = np.einsum("gdd->gd", products.own[:, :several, :several]) - np.sum(pull**2, axis=1)
    flat = normal - 0.5 * (squares + (products.log_det + log_det)[:, None])
    move, covariance = pull.swapaxes(1, 2) @ own, own.swapaxes(1, 2) @ own
    return _Solved(products, flat, half, pull, amounts, move, covariance)


def _inverse(root: Array) -> Array:
    """Inverses of lower triangular factors (g, n, n), row by row for all at once."""
    solved = np.zeros_like(root)
    for j in range(root.shape[1]):
        solved[:, j, :j] = -(root[:, j, None, :j] @ solved[:, :j, :j])[:, 0]
        solved[:, j, j] = 1.0
        solved[:, j] /= root[:, j, j, None]
    return solved


def _unknown(fitted: Fit) -> list[int]:
    """Positions in the vector of amounts that no prior row states."""
    terms = zip(fitted.extension.amounts_at, fitted.extension.terms, strict=True)
    return [at for at, term in terms if not np.isfinite(term.variant.known)]


def _places(fitted: Fit) -> tuple[list[int], list[float], list[float]]:
    """Positions in the vector of places and widths that are tuned, the middle and the std of their range."""
    at, mid, std = [], [], []
    for first, term in zip(fitted.extension.amounts_at, fitted.extension.terms, strict=True):
        for j, name in enumerate(term.variant.tuned, start=first + 1):
            low, high = term.variant.range(name)
            at.append(j)
            mid.append(0.5 * (low + high))
            std.append((high - low) / np.sqrt(12.0))
    return at, mid, std


def _log_known(fitted: Fit) -> list[float]:
    """Logarithms of the densities' heights of amounts that prior rows state already (waves along the cable)."""
    facts = fitted.extension.facts
    terms = [term for term in fitted.extension.terms if np.isfinite(term.variant.known)]
    return [-float(np.log(term.variant.known * term.cause.plausible(facts))) for term in terms]


def _amounts(fitted: Fit, solved: _Solved) -> Array:
    """Log of the factor (G, d) by which the prior of the fit's own amounts changes p."""
    extension, total = fitted.extension, np.zeros(solved.flat.shape)
    owner = [extension.terms[extension.amounts_at.index(at)].cause for at in solved.amounts]
    value = fitted.vector[solved.amounts] + solved.move
    for cause in {cause.name: cause for cause in owner}.values():
        at = [k for k, other in enumerate(owner) if other is cause]
        covariance = solved.covariance[:, None, at][..., at]
        total += _size_unknown(value[..., at], covariance, cause.plausible(extension.facts), cause.sign)
    return total


def _size_unknown(value: Array, covariance: Array, plausible: float, sign: int) -> Array:
    """Log mean over s of N(value; 0, covariance + s^2 plausible^2), times 2 Phi for each amount of known sign.

    Shapes: value (..., k), covariance (..., k, k).
    """
    sizes = (SIZES * plausible) ** 2
    if value.shape[-1] == 1:
        return _one_size_unknown(value[..., 0], covariance[..., 0, 0], sizes, sign)
    wide = covariance[..., None, :, :] + sizes[:, None, None] * np.eye(value.shape[-1])
    there = np.linalg.solve(wide, value[..., None, :, None])[..., 0]
    log = -0.5 * (np.sum(value[..., None, :] * there, axis=-1) + np.linalg.slogdet(2.0 * np.pi * wide)[1])
    if sign:
        mean = sizes[:, None] * there
        # the variance of each given s: prior minus what the data take of it
        left = sizes[:, None] * (1.0 - sizes[:, None] * np.einsum("...ii->...i", np.linalg.inv(wide)))
        log = log + np.sum(np.log(2.0) + log_ndtr(sign * mean / np.sqrt(np.maximum(left, 1e-300))), axis=-1)
    return np.asarray(log_sum(np.moveaxis(log, -1, 0)) - np.log(len(SIZES)))


def _column_gain(fitted: Fit, terms: Sequence[Term], solved: _Solved) -> Array:
    """Log of the factor (G, d, k) by which each further column changes p."""
    square, cross, several = solved.products.square, solved.products.cross, solved.flat.shape[1]
    half = solved.half @ cross[:, several:]
    precision = np.maximum(square - np.einsum("gik,gik->gk", half, half), INVISIBLE * square + 1e-300)[:, None]
    amount = (cross[:, :several] - solved.pull.swapaxes(1, 2) @ half) / precision
    facts, gains = fitted.extension.facts, np.zeros(amount.shape)
    for k, term in enumerate(terms):
        plausible = term.cause.plausible(facts)
        gains[..., k] = log_gain(amount[..., k], 1.0 / precision[..., k], plausible, term.cause.sign)
    return gains


def log_gain(amount: Array | float, variance: Array | float, plausible: float, sign: int) -> Array:
    """Log of the factor by which a cause of a flat estimate and its variance, of one shape, changes p."""
    value, wide = np.atleast_1d(amount), np.atleast_1d(variance)
    flat = 0.5 * (value**2 / wide + np.log(wide) + LOG_2PI)
    return np.asarray(flat + _one_size_unknown(value, wide, (SIZES * plausible) ** 2, sign))


def _one_size_unknown(value: Array, variance: Array, sizes: Array, sign: int) -> Array:
    """The same for a single amount: value and variance of one shape."""
    sizes = sizes.reshape(-1, *[1] * value.ndim)
    wide = variance + sizes
    log = -0.5 * (value**2 / wide + np.log(wide) + LOG_2PI)
    if sign:
        log = log + np.log(2.0) + log_ndtr(sign * value * np.sqrt(sizes / (wide * variance)))
    return np.asarray(log_sum(log) - np.log(len(SIZES)))

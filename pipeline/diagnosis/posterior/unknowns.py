"""What a fit's unknowns are for every error model: all but the law's eliminated, then the law's by each prior of it.

For the notation see `evidence`. With L for the law's coefficients and R for all other unknowns,

    S = H_LL - H_LR H_RR^-1 H_RL,   s = b_L - H_LR H_RR^-1 b_R

is what the data tell of the law, and of each family of its priors (`rod.law_prior.conditioned`) all sizes are found at
once. Error models that hold something else are many; those of no weight by the one prior that the fit holds its law by
are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.posterior.error_grid import ErrorGrid
from pipeline.diagnosis.posterior.products import Models, Products
from pipeline.records import Array
from rod.inverse.fit import Fit
from rod.inverse.laws import AnyLaw
from rod.law_prior import Conditioned, conditioned, inverse_root, least

NOTHING = 16.0
"""Of log p: what lies so far below the largest is nothing whatever the prior of an amount makes of it."""

AT_ONCE = 256
"""Error models whose products a processor's cache holds."""

LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class Solved:
    """What the fit's own unknowns are for every error model: p of the law, then r others; l families of its prior.

    The others are eliminated first: ``half`` (G, r, r), W with W' W the inverse of their information; ``across``
    (G, r, p) and ``pull`` (G, r, d), W times their products with the law's and with b. Then the law's by each family,
    see `rod.law_prior.Conditioned`. ``flat`` (G, l, t, d): log p flat in the amounts. ``amounts``: positions in the
    vector of those that no prior row states, ``move`` (G, l, t, d, a) of these and ``covariance`` (G, l, t, a, a).
    """

    products: Products
    half: Array
    across: Array
    pull: Array
    laws: tuple[Conditioned, ...]
    flat: Array
    amounts: list[int]
    move: Array
    covariance: Array


def solved_once(grid: ErrorGrid, fitted: Fit) -> Solved:
    """The unknowns of a fit for its own residual, without further columns."""
    return solved_for(grid, fitted, np.zeros((len(fitted.residual), 0)), fitted.residual[:, None])


solved_alone = lru_cache(maxsize=1)(solved_once)
"""The same, kept until another fit is asked for: the one that answers is asked for several times."""


def solved_for(grid: ErrorGrid, fitted: Fit, more: Array, residuals: Array) -> Solved:
    """The unknowns of a fit for residuals (N, d) in the place of its own; ``more`` (N, k): further columns."""
    form, several = fitted.extension.base.law, residuals.shape[1]
    assert isinstance(form, AnyLaw)
    size = form.size
    models, normal = _models(grid, fitted, form, more, residuals)
    law = slice(several, several + size)
    amounts = _unknown(fitted)
    # places, waves and displacements have normal densities, whose factors of 2 pi cancel; law and K0 are in all alike
    normal += 0.5 * len(amounts) * LOG_2PI
    products = models.at(_that_matter(models, _by_one_prior(fitted, models, several), beside=more.shape[1] > 0))
    half, log_det = inverse_root(products.own[:, law.stop :, law.stop :])
    pull, across = np.split(half @ products.own[:, law.stop :, : law.stop], [several], axis=2)
    schur = products.own[:, law, law] - across.swapaxes(1, 2) @ across
    pulls = products.own[:, law, :several] - across.swapaxes(1, 2) @ pull
    squares = np.einsum("gdd->gd", products.own[:, :several, :several]) - np.sum(pull**2, axis=1)
    common = normal - 0.5 * (squares + (products.log_det + log_det)[:, None])
    a = fitted.vector[:size]
    laws = tuple(conditioned(schur, pulls, a, one) for one in form.families)
    flat = common[:, None, None] + np.stack([one.evidence for one in laws], axis=1)
    own = half[:, :, np.array(amounts, dtype=int) - size - len(fitted.beyond_stated)].swapaxes(1, 2)
    alone, moves, covariances = (own @ pull).swapaxes(1, 2)[:, None], [], []
    for one in laws:
        along = own @ across @ one.vectors
        moves.append(alone - np.einsum("gap,gtpd->gtda", along, one.moves))
        covariances.append(np.einsum("gap,gtp,gbp->gtab", along, 1.0 / one.precisions, along, optimize=True))
    covariance = np.stack(covariances, axis=1) + (own @ own.swapaxes(1, 2))[:, None, None]
    return Solved(products, half, across, pull, laws, flat, amounts, np.stack(moves, axis=1), covariance)


def _models(grid: ErrorGrid, fitted: Fit, law: AnyLaw, more: Array, residuals: Array) -> tuple[Models, float]:
    """Columns in the order residuals, sensitivities, displacements and rig; and the logs of the heights of priors.

    What the fit holds the form of its law by, and its displacements, is one prior of many, and left out. How far a law
    falls from rest is known besides (`rod.inverse.laws.SOFTER`).
    """
    data, several, base = len(grid.photos) + len(grid.forces), residuals.shape[1], fitted.extension.base
    beyond, (residual, jacobian) = fitted.beyond_stated, fitted.as_logged
    columns = np.hstack([residuals + (residual - fitted.residual)[:, None], jacobian])
    stated = np.delete(columns[data:], np.arange(base.known, len(base.prior)), axis=0)
    places = fitted.extension.places
    known = np.zeros((len(stated) + len(places) + 1, columns.shape[1]))
    known[: len(stated)] = stated
    falls, by = law.softening(fitted.vector[: law.size])
    known[-1, :several], known[-1, several : several + law.size] = -falls, by
    for row, (at, middle, std) in enumerate(places, start=len(stated)):
        known[row, :several] = (middle - fitted.vector[at]) / std
        known[row, several + at - len(beyond)] = 1.0 / std
    found = grid.models(columns[:data], known, *of_known_size(grid, fitted), more[:data])
    return found, sum(_log_known(fitted)) - sum(float(np.log(std)) for _, _, std in places)


def of_known_size(grid: ErrorGrid, fitted: Fit) -> tuple[Array, Array]:
    """Whitened sensitivities of the data to displacements (N, m), per m, and to the rig (N, r), per usual error."""
    base, rows = fitted.extension.base, fitted.jacobian[: len(grid.photos) + len(grid.forces)]
    return rows[:, fitted.beyond_log], rows[:, base.rig_at] * np.array(base.rig_std)


def _by_one_prior(fitted: Fit, models: Models, several: int) -> Array:
    """Log p (G, d) by the one prior of the law that the fit holds it by, flat in the amounts, up to a constant."""
    prior, size = fitted.extension.base.law.prior, fitted.extension.base.law.size
    held = np.hstack([np.repeat(-prior @ fitted.vector[:size, None], several, axis=1), prior])
    known, found = held.T @ held, []
    for some in np.array_split(np.arange(len(models.of)), len(models.of) // AT_ONCE + 1):
        products = models.at(some)
        products.own[:, : len(known), : len(known)] += known
        left, log_det = least(products.own[:, ::-1, ::-1], several)  # residuals last
        found.append(-0.5 * (left[:, ::-1] + (products.log_det + log_det)[:, None]))
    return np.concatenate(found)


def _that_matter(models: Models, rough: Array, *, beside: bool) -> NDArray[np.int_]:
    """Error models, with and without something else, that are not nothing by a rough log p (G, d), and the first one.

    Further columns ``beside`` the fit may make any of those without something else the likeliest.
    """
    log, kept = rough + models.log_prior[:, None], np.arange(len(rough)) == 0
    for part in (models.rest, ~models.rest):
        kept |= part & np.any(log > np.max(log[part], axis=0, initial=-np.inf) - NOTHING, axis=1)
    return np.flatnonzero(kept | (~models.rest & beside))


def mean_over_laws(by_law: Array) -> Array:
    """Log of the mean (G, d) over the families of the law's prior and their sizes (G, l, t, d)."""
    whole = by_law.reshape(len(by_law), -1, by_law.shape[-1]).swapaxes(0, 1)
    return np.asarray(log_sum(whole) - np.log(len(whole)))


def log_sum(logs: Array) -> Array:
    """Log of the sum of exponentials along the first axis, all finite: in a tenth of the time that scipy's takes."""
    top = np.max(logs, axis=0)
    return np.asarray(top + np.log(np.exp(logs - top).sum(axis=0)))


def conditional(solved: Solved, by_law: Array, kept: NDArray[np.int_]) -> tuple[Array, Array]:
    """Mean (k, n) and covariance (k, n, n) of all unknowns under some error models, over the priors of the law."""
    log = by_law[kept, :, :, 0]
    share = np.exp(log - np.max(log, axis=(1, 2), keepdims=True))
    share /= share.sum(axis=(1, 2), keepdims=True)
    laws = [(one.vectors[kept], one.precisions[kept], one.moves[kept, ..., 0]) for one in solved.laws]
    law = sum(np.einsum("gij,gt,gtj->gi", V, share[:, k], move) for k, (V, _, move) in enumerate(laws))
    covariance = np.zeros((len(kept), law.shape[1], law.shape[1]))
    for k, (V, precisions, moves) in enumerate(laws):
        covariance += np.einsum("gij,gt,gtj,gkj->gik", V, share[:, k], 1.0 / precisions, V, optimize=True)
        spread = moves @ V.swapaxes(1, 2) - law[:, None]
        covariance += np.einsum("gt,gti,gtj->gij", share[:, k], spread, spread, optimize=True)
    half, across = solved.half[kept], solved.across[kept]
    back = half.swapaxes(1, 2) @ across
    beside = (half.swapaxes(1, 2) @ solved.pull[kept])[..., 0] - (back @ law[..., None])[..., 0]
    joint = -back @ covariance
    own = half.swapaxes(1, 2) @ half - joint @ back.swapaxes(1, 2)
    above = np.concatenate([covariance, joint.swapaxes(1, 2)], axis=2)
    whole = np.concatenate([above, np.concatenate([joint, own], axis=2)], axis=1)
    return np.concatenate([law, beside], axis=1), whole


def _unknown(fitted: Fit) -> list[int]:
    """Positions in the vector of amounts that no prior row states."""
    terms = zip(fitted.extension.amounts_at, fitted.extension.terms, strict=True)
    return [at for at, term in terms if not np.isfinite(term.variant.known)]


def _log_known(fitted: Fit) -> list[float]:
    """Logarithms of the densities' heights of amounts that prior rows state already (waves along the cable)."""
    facts = fitted.extension.facts
    terms = [term for term in fitted.extension.terms if np.isfinite(term.variant.known)]
    return [-float(np.log(term.variant.known * term.cause.plausible(facts))) for term in terms]

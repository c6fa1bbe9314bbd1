"""How large a cause must be to be found: to be likelier than the base model, with a stated power.

The data that an effect of amount A makes without noise are told by the base model under every error model and prior of
the law alike (`unknowns`); with w_j their weights where nothing is hidden, and n_j^2 what the data tell of the amount,

    sum_j w_j g_j(A) exp(-A^2 n_j^2 / 2) / sum_j w_j exp(-A^2 n_j^2 / 2)

is what its cause gains, g_j by `evidence.log_gain`. What a rig that is off, displacements that scatter, or a law of
another form take of the effect is in it. Beyond that A comes what noise takes with the stated power.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri

from pipeline.diagnosis.fits.search import TRACE, Suspicion, direction
from pipeline.diagnosis.posterior.error_grid import ErrorGrid
from pipeline.diagnosis.posterior.evidence import log_gain, told_of_columns
from pipeline.diagnosis.posterior.hypotheses import SHARES
from pipeline.diagnosis.posterior.unknowns import log_sum, solved_for
from pipeline.diagnosis.statistics.score import span
from pipeline.records import Array
from rod.inverse.fit import Fit
from rod.inverse.observation import Observation

LOUDEST = 40.0
"""Standard deviations: what is found neither at that size nor at the largest possible one is found at none."""

POSSIBLE = 30.0
"""Plausible sizes: no rig has more of a cause."""

DRAWS, BINS = 16, 24
"""Of noise, over which log weights are means; and of what the data tell of an amount."""

LINEAR = (0.02, 3.0)
"""Amounts within these multiples of where a trace was computed are taken as proportional."""


@dataclass(frozen=True, eq=False)
class Detectable:
    """Smallest amounts at which causes are found, by the trace of each form as it was computed.

    Attributes
    ----------
    observation : Observation
    fitted : Fit
        The base model.
    suspicion : Suspicion
    linear : (k,)
        Amount of each direction, were its trace proportional to it; infinite where it is found at none.
    """

    observation: Observation
    fitted: Fit
    suspicion: Suspicion
    linear: Array

    def each(self, cause: int) -> dict[int, float]:
        """Of every usual form of a cause (direction -> amount); infinite where only more than a rig can have is found.

        A trace computed at a large amount says little of the smallest one that is seen, unless it is known how it
        grows.
        """
        plausible, found = self._plausible(cause), {}
        for k in map(int, self.suspicion.of(cause)):
            variant = self.suspicion.terms[k].variant
            if variant.rare or (variant.trace != 1.0 and variant.power == 1.0):
                continue
            at = TRACE * variant.trace * plausible
            amount = at * (self.linear[k] / at) ** (1.0 / variant.power)
            found[k] = float(amount) if amount <= POSSIBLE * plausible else np.inf
        return found

    def in_any_form(self, cause: int) -> float:
        """Whatever form a cause has; infinite if some form is never found."""
        return max(self.each(cause).values(), default=np.inf)

    def clearest(self, cause: int) -> int | None:
        """The form (direction) of a cause that is found at the smallest amount; None without usual forms."""
        each = self.each(cause)
        # forms that all lack a trace at their usual size may have one at a larger
        return min(each, key=lambda k: (each[k], -self.suspicion.scores.norm[k])) if each else None

    def smallest(self, cause: int) -> float:
        """Smallest amount of a cause, in its clearest form, that is found; infinite if none is.

        A trace that grows otherwise than in proportion (stiff ends: with the square) is computed anew at the amount
        found, by fixed-point steps in the logarithm; three reach a few per cent.
        """
        best = self.clearest(cause)
        if best is None:
            return float("inf")
        term, norm = self.suspicion.terms[best], float(self.suspicion.scores.norm[best])
        amount, plausible = float(self.linear[best]), self._plausible(cause)
        if norm <= 0.0 or term.variant.power != 1.0 or not np.isfinite(amount):
            return self.each(cause)[best]
        needed, at, basis = amount * norm, TRACE * plausible, span(self.fitted.as_logged[1])
        for _ in range(3):
            if not LINEAR[0] * at < amount < LINEAR[1] * at or amount > POSSIBLE * plausible:
                tried = min(amount, POSSIBLE * plausible)
                column = direction(self.observation, self.fitted, term, amount=tried)
                norm = float(np.linalg.norm(column - basis @ (basis.T @ column)))
                if norm <= 0.0 or not np.isfinite(norm):
                    break
                at, amount = amount, float(np.sqrt(amount * needed / norm))
        return amount

    def _plausible(self, cause: int) -> float:
        return self.suspicion.causes[cause].plausible(self.fitted.extension.facts)


def detectable(
    grid: ErrorGrid, observation: Observation, fitted: Fit, suspicion: Suspicion, *, power: float
) -> Detectable:
    """What a test finds, by its base model, the scores about it and its error models, with a probability ``power``."""
    weight, told = _told(grid, fitted, suspicion)
    shares = SHARES[0][0] / SHARES[1][0] * len(set(suspicion.owner.tolist()))
    facts, norm = fitted.extension.facts, suspicion.scores.norm
    linear = np.full(len(suspicion.terms), np.inf)
    for k, term in enumerate(suspicion.terms):
        plausible = term.cause.plausible(facts)
        if norm[k] > 0.0:
            odds = float(np.log(shares * len(suspicion.of(int(suspicion.owner[k])))))
            most = max(LOUDEST / norm[k], POSSIBLE * plausible)
            found = found_at(weight[:, k], told[:, k], odds, most, plausible, term.cause.sign)
            linear[k] = found + float(ndtri(power)) / norm[k]
    return Detectable(observation, fitted, suspicion, linear)


def _told(grid: ErrorGrid, fitted: Fit, suspicion: Suspicion) -> tuple[Array, Array]:
    """Weights (b, k) where nothing is hidden and what the data tell of each amount (b, k), in bins of the latter."""
    noise = np.zeros((len(fitted.residual), DRAWS))
    count = len(grid.photos) + len(grid.forces)
    noise[:count] = np.random.default_rng(0).standard_normal((count, DRAWS))
    solved = solved_for(grid.plain, fitted, suspicion.columns, noise)
    log = solved.flat.mean(axis=-1) + solved.products.log_prior[:, None, None]
    weight = np.exp(log.ravel() - log_sum(log.ravel()))
    told = np.stack([told_of_columns(solved, one) for one in range(len(solved.laws))], axis=1)
    told = np.log(told.reshape(weight.size, -1))
    low, high = told.min(axis=0), told.max(axis=0)
    at = np.minimum((BINS * (told - low) / np.maximum(high - low, 1e-12)).astype(int), BINS - 1)
    sums, means = np.zeros((BINS, told.shape[1])), np.zeros((BINS, told.shape[1]))
    for k, own in enumerate(at.T):
        sums[:, k] = np.bincount(own, weights=weight, minlength=BINS)
        means[:, k] = np.bincount(own, weights=weight * told[:, k], minlength=BINS)
    return sums, np.exp(means / np.maximum(sums, 1e-300))


def found_at(weight: Array, told: Array, odds: float, most: float, plausible: float, sign: int) -> float:
    """Amount at which a cause gains as much as it is less likely beforehand; infinite if that is above ``most``."""
    kept = weight > 0.0
    weight, told = np.log(weight[kept]), told[kept]

    def gained(amount: float) -> float:
        left = weight - 0.5 * amount**2 * told
        gain = log_gain(np.full(told.shape, amount), 1.0 / told, plausible, sign)
        return float(log_sum(left + gain) - log_sum(left)) - odds

    return np.inf if gained(most) < 0.0 else float(brentq(gained, 0.0, most))

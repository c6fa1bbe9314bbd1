"""The law of a fitted model as the mean over all priors of its form (`rod.law_prior`), and how well it is known.

A fit has one wide prior on its law, the same whatever extends the model. What is reported is the mean over all priors,
along an abscissa that is laid along the law found. Amounts and forms of causes, bearing axes, scale and length are
unknowns beside the law, and their errors are in its band.

Where the model leaves more than noise, rows of that kind (forces; chords and shapes) count so much less: the misfit
then is an error of the model, and neither the law nor its band may take it for knowledge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rod.array import Array
from rod.inverse.base_fit import laid_along
from rod.inverse.fit import Fit, evaluated, shown
from rod.inverse.laws import Abscissa, AnyLaw
from rod.inverse.observation import Observation, of_hold
from rod.law_prior import Posterior, averaged, priors

LAYINGS, MOVES, SETTLED = 3, 6, 0.05
"""Times that the abscissa is laid along the law found, steps to the mean on each, and the standard deviations by which
the unknowns may still move then."""

LAW_STEP, SHORTER = 1.0, 4
"""Of log f in one step: a factor e; and halvings of a step that leads to a cable without equilibrium."""

FORGOTTEN = 100.0
"""Plausible sizes: prior of the amount of a cause where data tell nothing of it, so that its band is not infinite."""


def mean_law(observation: Observation, fitted: Fit, overs: Sequence[Abscissa] = ("bend",)) -> Fit:
    """The model at the mean over all priors of its law, on the likeliest of some abscissae.

    The fit as it is where that has no equilibrium. For ``overs`` see `rod.inverse.laws.AnyLaw`.
    """
    means = (_mean_over(observation, fitted, over) for over in overs)
    found = [one for one in means if one is not fitted] or [fitted]  # a fit on its way is no rival of a mean
    return found[0] if len(found) == 1 else max(found, key=lambda one: _log_evidence(observation, one))


def _log_evidence(observation: Observation, fitted: Fit) -> float:
    louder = float(np.log(weights(observation, fitted)).sum())
    return mean_posterior(observation, fitted).log_evidence + louder


def _mean_over(observation: Observation, fitted: Fit, over: Abscissa) -> Fit:
    found, weight = fitted, weights(observation, fitted)
    for _ in range(LAYINGS):
        extension, vector = laid_along(found, over)
        there = _at(observation, replace(found, extension=extension), vector)
        mean = None if there is None else _at_mean(observation, there)
        # a mean is off by a standard deviation of each unknown at most; farther off, what is linear is no guide (two
        # spots in one place)
        if mean is None or _misfit(mean, weight) > _misfit(fitted, weight) + extension.size:
            break
        found = mean
    return found


def _misfit(fitted: Fit, weight: Array) -> float:
    """Chi-square of the data, weighed (N,), and of all that is known but the form of the law."""
    known = len(weight) + fitted.extension.base.known
    return float(
        np.sum((weight * fitted.residual[: len(weight)]) ** 2) + np.sum(fitted.residual[len(weight) : known] ** 2)
    )


def _at_mean(observation: Observation, start: Fit) -> Fit:
    """The model at the mean over all priors of its law, by whole steps that may raise chi-square.

    Where the law falls steeply, a method that never lets it rise creeps along a curved valley.
    """
    here, held = start, np.zeros(start.extension.size, dtype=bool)
    for _ in range(MOVES):
        posterior = mean_posterior(observation, here, held=held)
        move = posterior.mean - here.vector
        # cut at the end of its range, one number would leave all others where they belong beside another
        outside = here.extension.brought_inside(posterior.mean) != posterior.mean
        if np.any(outside & ~held):
            held |= outside
            continue
        if np.all(np.abs(move) <= SETTLED * np.sqrt(np.diag(posterior.covariance))):
            return replace(here, converged=True)
        law = here.extension.base.law
        move = move * min(1.0, LAW_STEP / max(float(np.abs(move[: law.size]).max()), 1e-300))
        trials = (here.extension.brought_inside(here.vector + 0.5**k * move) for k in range(SHORTER))
        there = next((one for one in (_at(observation, here, trial) for trial in trials) if one is not None), None)
        if there is None:
            break
        here = there
    return here


def _at(observation: Observation, fitted: Fit, vector: Array) -> Fit | None:
    """The model at another vector, not fitted; None where that is impossible."""
    if not fitted.extension.admissible(vector):
        return None
    there = evaluated(observation, fitted.extension, shown(observation, fitted.extension, vector, fitted.run))
    return None if there.run.prediction is None else replace(there, converged=fitted.converged)


def mean_posterior(
    observation: Observation, fitted: Fit, *, beside: Array | None = None, held: NDArray[np.bool_] | None = None
) -> Posterior:
    """Posterior over all priors of the law's form, from the linearisation of a fit.

    ``beside`` (N, j) are traces of further unknowns, each of standard deviation one and mean zero; ``held`` (p,) says
    which numbers of causes stay where they are.
    """
    return rows_posterior(fitted, *linearised(observation, fitted, beside), held=held)


def rows_posterior(fitted: Fit, value: Array, J: Array, *, held: NDArray[np.bool_] | None = None) -> Posterior:
    """The same from the rows (n,), (n, q) of `linearised`, or from some of them."""
    law = fitted.extension.base.law
    assert isinstance(law, AnyLaw)
    if held is not None:
        J = np.where(np.pad(held, (0, J.shape[1] - len(held))), 0.0, J)
        J, value = np.vstack([J, np.eye(len(held), J.shape[1])[held]]), np.r_[value, np.zeros(held.sum())]
    return averaged(value, J, np.r_[fitted.vector, np.zeros(J.shape[1] - len(fitted.vector))], priors(law.basis))


def linearised(observation: Observation, fitted: Fit, beside: Array | None = None) -> tuple[Array, Array]:
    """Residual (n,) and its derivative: data by their `weights`, and all prior knowledge but that of the law.

    For ``beside`` see `mean_posterior`.
    """
    beside = np.zeros((len(fitted.residual), 0)) if beside is None else beside
    base, facts = fitted.extension.base, fitted.extension.facts
    count, weight = observation.rows.count, weights(observation, fitted)
    known = count + base.known
    value = np.r_[weight * fitted.residual[:count], fitted.residual[count:known]]
    columns = np.hstack([fitted.jacobian, beside])
    J = -np.vstack([weight[:, None] * columns[:count], columns[count:known]])
    extension, further = fitted.extension, beside.shape[1]
    vector, middle, std = np.r_[fitted.vector, np.zeros(further)], np.zeros(J.shape[1]), np.ones(J.shape[1])
    for term, at in zip(extension.terms, extension.amounts_at, strict=True):
        std[at] = min(FORGOTTEN, term.variant.known) * term.cause.plausible(facts)
    for at, *of_range in extension.places:
        middle[at], std[at] = of_range
    own = slice(len(base.names), None)
    return np.r_[value, ((vector - middle) / std)[own]], np.vstack([J, np.diag(1.0 / std)[own]])


def weights(observation: Observation, fitted: Fit) -> Array:
    """Weights (N,) of the data: a kind (forces, photos) that fits badly counts for less.

    Photos fit as badly as they pull lengths, scale and axes away from what is known of these.
    """
    count, known = observation.rows.count, fitted.extension.base.known
    pulled = max(float(np.sum(fitted.residual[count : count + known] ** 2)) - known, 0.0)
    weight = np.ones(count)
    for kind, beside in ((observation.rows.force, 0.0), (~observation.rows.force, pulled)):
        if np.any(kind):
            misfit = float(np.sum(fitted.residual[:count][kind] ** 2)) + beside
            weight[kind] = 1.0 / np.sqrt(max(1.0, misfit / np.count_nonzero(kind)))
    return weight


def moved_by_forces(observation: Observation, fitted: Fit, response: Array, errors: Sequence[Array]) -> Array:
    """Moves (p, e) of the vector by errors (n,) N, each of which the forces of all steps share."""
    count = observation.rows.count
    shift = np.zeros((count, len(errors)))
    for column, newtons in zip(shift.T, errors, strict=True):
        column[observation.rows.force] = np.concatenate(force_rows(observation, newtons))
    weight = weights(observation, fitted)[:, None] ** 2
    return np.asarray(response @ (fitted.jacobian[:count].T @ (weight * shift)))


def force_rows(observation: Observation, newtons: Array) -> list[Array]:
    """Whitened change (h,) of every hold where its force changes by ``newtons`` (n,) N."""
    holds = zip(observation.forces, newtons, observation.force_std, observation.force_common, strict=True)
    return [of_hold(np.full(len(data), off / std), alike / std) for data, off, std, alike in holds]

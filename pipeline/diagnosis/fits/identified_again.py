"""f_EI identified again, with the causes in the model that were found, averaged over what is not known of its form.

The diagnosis weighs causes beside a law of one wide prior. What is named is in the model, and its law is found as in
the inverse problem: as the mean over all priors of its form (`rod.law_prior`), along an abscissa that is laid along the
law found. Amounts and forms of the causes, the bearing axes, scale and length are unknowns beside the law, and their
errors are in its band.

Where even the extended model leaves more than noise, rows of that kind (forces, chords and shapes) count so much less:
the misfit then is an error of the model, and neither the law nor its band may take it for knowledge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.fits.fit import Fit, evaluated
from pipeline.diagnosis.fits.laws import AnyLaw
from pipeline.diagnosis.fits.search import suspect
from pipeline.diagnosis.fits.workbench import laid_along
from pipeline.diagnosis.observations.observation import Observation, of_hold
from rod.law_prior import Posterior, averaged, priors

Array = NDArray[np.float64]

LAYINGS, MOVES, SETTLED = 3, 6, 0.05
"""Times that the abscissa is laid along the law found, steps to the mean on each, and the standard deviations by which
the unknowns may still move then."""

LAW_STEP, SHORTER = 1.0, 4
"""Of log c in one step: a factor e; and halvings of a step that leads to a cable without equilibrium."""

FORGOTTEN = 100.0
"""Plausible sizes: prior of the amount of a cause where data tell nothing of it, so that its band is not infinite."""

SPREAD = 0.5
"""Of the size of a cause: standard deviation of each further form that it may have. Two elements that stood for three
missed their sum by 8 %, sums for other loops by 0 to 12 %: up to six standard deviations of the fit without them."""


@dataclass(frozen=True, eq=False)
class Identified:
    """A fitted model with the covariance of its parameters.

    Attributes
    ----------
    fitted : Fit
        At the mean over the priors of the law.
    covariance : (p, p)
        Of the vector of ``fitted``, the spread over the priors included.
    other : Fit or None
        Another answer that the data allow, as `extended.curve` takes it; its vector alone counts.
    sizes : dict of name -> (size, std)
        Of the causes whose forms add up: the sum of the forms, and how well it is known if the forms may be any.
    """

    fitted: Fit
    covariance: Array
    other: Fit | None = None
    sizes: dict[str, tuple[float, float]] = field(default_factory=dict)


def identified_again(
    observation: Observation,
    fitted: Fit,
    *,
    force_errors: Sequence[Array] = (),
) -> Identified:
    """The law of a fitted model identified again; the fit as it is where that has no equilibrium.

    ``force_errors`` (n,) N each are errors of one standard deviation that the forces of all steps share.
    """
    found = fitted
    for _ in range(LAYINGS):
        extension, vector = laid_along(found)
        there = _at(observation, replace(found, extension=extension), vector)
        mean = None if there is None else _at_mean(observation, there)
        # a mean is off by a standard deviation of each unknown at most; farther off, what is linear is no guide (two
        # spots in one place)
        if mean is None or _told(observation, mean) > _told(observation, fitted) + extension.size:
            break
        found = mean
    covariance = _averaged(observation, found).covariance
    for errors in force_errors:
        moved = _moved_by_forces(observation, found, covariance, errors)
        covariance = covariance + np.outer(moved, moved)
    return _with_other_forms(observation, Identified(found, covariance))


def _told(observation: Observation, fitted: Fit) -> float:
    """Chi-square of the data and of what is known but of the form of the law."""
    known = observation.rows.count + fitted.extension.base.known
    return float(np.sum(fitted.residual[:known] ** 2))


def _at_mean(observation: Observation, start: Fit) -> Fit:
    """The model at the mean over all priors of its law, by whole steps as in `rod.inverse.fit`."""
    here, held = start, np.zeros(start.extension.size, dtype=bool)
    for _ in range(MOVES):
        posterior = _averaged(observation, here, held=held)
        move = posterior.mean - here.vector
        # cut at the end of its range, one number would leave all others where they belong beside another
        outside = here.extension.brought_inside(posterior.mean) != posterior.mean
        if np.any(outside & ~held):
            held |= outside
            continue
        if np.all(np.abs(move) <= SETTLED * np.sqrt(np.diag(posterior.covariance))):
            break
        law = here.extension.base.law
        move = move * min(1.0, LAW_STEP / max(float(np.abs(move[: law.size]).max()), 1e-300))
        trials = (here.extension.brought_inside(here.vector + 0.5**k * move) for k in range(SHORTER))
        there = next((one for one in (_at(observation, here, trial) for trial in trials) if one is not None), None)
        if there is None:
            break
        here = there
    return here


def _moved_by_forces(observation: Observation, fitted: Fit, response: Array, errors: Array) -> Array:
    """Move (p,) of the vector by an error (n,) N of the forces of all steps."""
    common = observation.force_common or (0.0,) * len(observation.forces)
    rows = [
        of_hold(np.full(len(data), off / std), alike / std)
        for data, off, std, alike in zip(observation.forces, errors, observation.force_std, common, strict=True)
    ]
    count = observation.rows.count
    shift = np.zeros(count)
    shift[observation.rows.force] = np.concatenate(rows)
    return np.asarray(response @ (fitted.jacobian[:count].T @ (_weights(observation, fitted) ** 2 * shift)))


def _with_other_forms(observation: Observation, again: Identified) -> Identified:
    """Where the law lies if the forms of a cause that add up may be any: part of the band, and no better answer.

    A sum of few elements stands for a loop of friction whose true form nobody knows (Bouc and Wen's or Dahl's is none).
    Elements of other slips, of either sign, take something from the law or give to it. How far it goes with them is as
    far as it is off: 0.7 to 1.7 % on five loops of such forms (true errors 1.2 to 1.6 %), 0.5 % on one of two elements.
    The size of the cause is known no better than the sum over all of them is, see `SPREAD`.
    """
    fitted = again.fitted
    causes, beside = _other_forms(observation, fitted)
    if beside.shape[1] == 0:
        return again
    law = len(fitted.extension.base.names)
    mean = _averaged(observation, fitted, beside=beside).mean
    # amounts and forms stay: a linear move may leave their range, and the law is all that it is asked for
    other = replace(fitted, vector=np.concatenate([mean[:law], fitted.vector[law:]]))
    covariance = _averaged(observation, fitted, beside=SPREAD * beside).covariance
    sizes = {}
    for name in dict.fromkeys(causes):
        own = _amounts_of(fitted, name)
        size = float(np.sum(fitted.vector[own]))
        total = np.zeros(len(covariance))
        total[own] = 1.0
        total[fitted.extension.size :] = SPREAD * abs(size) * (np.array(causes) == name)
        sizes[name] = (size, float(np.sqrt(total @ covariance @ total)))
    return replace(again, other=other, sizes=sizes)


def _amounts_of(fitted: Fit, name: str) -> list[int]:
    """Positions in the vector of the amounts of a cause."""
    extension = fitted.extension
    return [at for at, term in zip(extension.amounts_at, extension.terms, strict=True) if term.cause.name == name]


def _other_forms(observation: Observation, fitted: Fit) -> tuple[list[str], Array]:
    """Names (j,) and traces (N, j) of further forms of the causes whose forms add up, each as large as its cause."""
    names: list[str] = []
    columns = [np.zeros((len(fitted.residual), 0))]
    for cause in {term.cause.name: term.cause for term in fitted.extension.terms if term.cause.additive}.values():
        size = abs(float(np.sum(fitted.vector[_amounts_of(fitted, cause.name)])))
        seen = suspect(observation, fitted, [cause])
        names += [cause.name] * seen.columns.shape[1]
        columns.append(size * seen.columns)
    return names, np.hstack(columns)


def _averaged(
    observation: Observation, fitted: Fit, *, beside: Array | None = None, held: NDArray[np.bool_] | None = None
) -> Posterior:
    """Posterior over all priors of the law's form, from the linearisation of a fit.

    ``beside`` (N, j) are traces of further unknowns, each of standard deviation one and mean zero; ``held`` (p,) says
    which numbers of causes stay where they are.
    """
    law = fitted.extension.base.law
    assert isinstance(law, AnyLaw)
    value, J = _data_rows(observation, fitted, np.zeros((len(fitted.residual), 0)) if beside is None else beside)
    if held is not None:
        J[:, np.flatnonzero(held)] = 0.0
        J, value = np.vstack([J, np.eye(len(held), J.shape[1])[held]]), np.r_[value, np.zeros(held.sum())]
    return averaged(value, J, np.r_[fitted.vector, np.zeros(J.shape[1] - len(fitted.vector))], priors(law.basis))


def _data_rows(observation: Observation, fitted: Fit, beside: Array) -> tuple[Array, Array]:
    """Residual and its derivative: data, each kind as heavy as it fits, and all prior knowledge but that on the law."""
    base, facts = fitted.extension.base, fitted.extension.facts
    count, weight = observation.rows.count, _weights(observation, fitted)
    known = count + base.known
    value = np.r_[weight * fitted.residual[:count], fitted.residual[count:known]]
    columns = np.hstack([fitted.jacobian, beside])
    J = -np.vstack([weight[:, None] * columns[:count], columns[count:known]])
    sizes, seen_from = [], []  # of an amount its zero, of a place or a time where it was found
    for term, at in zip(fitted.extension.terms, fitted.extension.amounts_at, strict=True):
        tuned = [term.variant.scale(name) for name in term.variant.tuned]
        sizes += [min(FORGOTTEN, term.variant.known) * term.cause.plausible(facts), *tuned]
        seen_from += [fitted.vector[at], *np.zeros(len(tuned))]
    sizes += [1.0] * beside.shape[1]
    seen_from += [0.0] * beside.shape[1]
    weak = np.hstack([np.zeros((len(sizes), len(base.names))), np.diag(1.0 / np.array(sizes))])
    return np.r_[value, np.array(seen_from) / np.array(sizes)], np.vstack([J, weak])


def _weights(observation: Observation, fitted: Fit) -> Array:
    """Of the data (N,): each kind as heavy as it fits."""
    count = observation.rows.count
    weight = np.ones(count)
    for kind in (observation.rows.force, ~observation.rows.force):
        if np.any(kind):
            weight[kind] = 1.0 / np.sqrt(max(1.0, float(np.mean(fitted.residual[:count][kind] ** 2))))
    return weight


def _at(observation: Observation, fitted: Fit, vector: Array) -> Fit | None:
    """The model at another vector, not fitted; None where that is impossible."""
    if not fitted.extension.admissible(vector):
        return None
    there = evaluated(observation, fitted.extension, vector, fitted.run)
    return None if there.run.prediction is None else replace(there, converged=fitted.converged)

"""f_EI identified again, with the causes in the model that were found: a fine law, averaged over how smooth it may be.

The diagnosis looks for causes with a coarse law under one prior, since a law of many control points would eat them.
What is named is in the model and can be eaten no more, so its law may be as fine as that of the identification: many
control points, smooth along the curvature or along the moment, how smooth and how steep at rest averaged over by their
evidence (`pipeline.diagnosis.fits.spline_prior`, `pipeline.diagnosis.fits.spline_average`). Amounts and forms of the
causes, the bearing axes, scale and length are unknowns beside the law, and their errors are in its band.

Where even the extended model leaves more than noise, rows of that kind (forces, chords and shapes) count so much less:
the misfit then is an error of the model, and neither the law nor its band may take it for knowledge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.fits.extension import Extension
from pipeline.diagnosis.fits.fit import Fit, evaluated, fit_from
from pipeline.diagnosis.fits.search import suspect
from pipeline.diagnosis.fits.spline_average import Averaged, average
from pipeline.diagnosis.fits.spline_prior import FIRST_SIZES, places_of
from pipeline.diagnosis.fits.workbench import with_knots
from pipeline.diagnosis.observations.observation import Observation, of_hold
from pipeline.settings.diagnosis import DiagnosisSettings

Array = NDArray[np.float64]

TAUS = (0.05, 60.0)
"""Range of the roughness of log f that is averaged over: from nearly straight to a change by a factor e^7."""

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
    settings: DiagnosisSettings,
    *,
    force_errors: Sequence[Array] = (),
) -> Identified:
    """The law of a fitted model identified again, or the fit as it is where a finer law has no equilibrium.

    Two fits: one under a wide prior, whose linearisation tells along what and how smooth the law is; then one under the
    likeliest prior, from whose linearisation mean and covariance over all priors follow.

    ``force_errors`` (n,) N each are errors of one standard deviation that the forces of all steps share.
    """
    if fitted.extension.base.straight or len(fitted.extension.base.knots) < 3:
        return Identified(fitted, fitted.covariance)
    tau, slope = FIRST_SIZES
    extension, vector = with_knots(fitted, settings.knots_identified)
    base = replace(extension.base, roughness=tau, rest_slope=slope, places=None)
    rich = _fit(observation, replace(extension, base=base), vector, fitted, settings)
    if rich is None:
        return Identified(fitted, fitted.covariance)
    likely = _averaged(observation, rich).prior
    base = replace(base, roughness=likely.tau, rest_slope=likely.slope, places=likely.places)
    settled = _fit(observation, replace(extension, base=base), rich.vector, rich, settings) or rich
    posterior = _averaged(observation, settled)
    mean = _at(observation, settled, posterior.mean)
    found = settled if mean is None else mean
    covariance = posterior.covariance
    for errors in force_errors:
        moved = _moved_by_forces(observation, found, covariance, errors)
        covariance = covariance + np.outer(moved, moved)
    return _with_other_forms(observation, Identified(found, covariance), settings)


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


def _fit(
    observation: Observation, extension: Extension, vector: Array, near: Fit, settings: DiagnosisSettings
) -> Fit | None:
    """Fit from a vector; None where that has no equilibrium."""
    found = fit_from(observation, extension, vector, near, settings)
    return None if found.run.prediction is None else found


def _with_other_forms(observation: Observation, again: Identified, settings: DiagnosisSettings) -> Identified:
    """Where the law lies if the forms of a cause that add up may be any: part of the band, and no better answer.

    A sum of few elements stands for a loop of friction whose true form nobody knows (Bouc and Wen's or Dahl's is none).
    Elements of other slips, of either sign, take something from the law or give to it. How far it goes with them is as
    far as it is off: 0.7 to 1.7 % on five loops of such forms (true errors 1.2 to 1.6 %), 0.5 % on one of two elements.
    The size of the cause is known no better than the sum over all of them is, see `SPREAD`.
    """
    fitted = again.fitted
    causes, beside = _other_forms(observation, fitted, settings)
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


def _other_forms(observation: Observation, fitted: Fit, settings: DiagnosisSettings) -> tuple[list[str], Array]:
    """Names (j,) and traces (N, j) of further forms of the causes whose forms add up, each as large as its cause."""
    names: list[str] = []
    columns = [np.zeros((len(fitted.residual), 0))]
    for cause in {term.cause.name: term.cause for term in fitted.extension.terms if term.cause.additive}.values():
        size = abs(float(np.sum(fitted.vector[_amounts_of(fitted, cause.name)])))
        seen = suspect(observation, fitted, [cause], visible=settings.visible, trace=settings.trace)
        names += [cause.name] * seen.columns.shape[1]
        columns.append(size * seen.columns)
    return names, np.hstack(columns)


def _averaged(observation: Observation, fitted: Fit, *, beside: Array | None = None) -> Averaged:
    """Posterior over all priors of the law's form, from the linearisation of a fit; see `spline_average`.

    ``beside`` (N, j) are traces of further unknowns, each of standard deviation one and mean zero.
    """
    base = fitted.extension.base
    law, K0 = base.characteristic(fitted.vector), base.pre_curvature(fitted.vector)
    value, J = _data_rows(observation, fitted, np.zeros((len(fitted.residual), 0)) if beside is None else beside)
    unknowns = np.r_[fitted.vector, np.zeros(J.shape[1] - len(fitted.vector))]
    return average(value, J, unknowns, places_of(law, base.knots + K0, K0), TAUS)


def _data_rows(observation: Observation, fitted: Fit, beside: Array) -> tuple[Array, Array]:
    """Residual and its derivative: data, each kind as heavy as it fits, and all prior knowledge but that on the law."""
    base, facts = fitted.extension.base, fitted.extension.facts
    count, weight = observation.rows.count, _weights(observation, fitted)
    known = count + base.known
    value = np.r_[weight * fitted.residual[:count], fitted.residual[count:known]]
    columns = np.hstack([fitted.jacobian, beside])
    J = -np.vstack([weight[:, None] * columns[:count], columns[count:known]])
    sizes = []
    for term in fitted.extension.terms:
        sizes.append(min(FORGOTTEN, term.variant.known) * term.cause.plausible(facts))
        sizes.extend(term.variant.scale(name) for name in term.variant.tuned)
    sizes.extend(np.ones(beside.shape[1]))
    weak = np.diag(1.0 / np.array(sizes))
    rest = np.hstack([np.zeros((len(sizes), len(base.names))), weak])
    return np.r_[value, np.zeros(len(sizes))], np.vstack([J, rest])


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

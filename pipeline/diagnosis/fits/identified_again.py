"""f_EI of a model with causes in it: the mean over all priors of its law, and how far other forms would move it.

Sums of few forms stand for what nobody knows the form of. How far the law goes where other forms are let in is part of
its band, and the size of the cause is known no better than the sum over all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pipeline.diagnosis.causes.begun import OTHER_STIFFNESS
from pipeline.diagnosis.fits.search import suspect
from pipeline.records import Array
from rod.inverse.fit import Fit
from rod.inverse.mean_law import mean_law, mean_posterior, moved_by_forces
from rod.inverse.observation import Observation

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
    found = mean_law(observation, fitted)
    covariance = mean_posterior(observation, found).covariance
    moved = moved_by_forces(observation, found, covariance, force_errors)
    again = Identified(found, covariance + moved @ moved.T, _of_the_middle(found))
    return _with_other_forms(observation, again)


def _of_the_middle(fitted: Fit) -> Fit | None:
    """The model with f_EI of the middle of a cable whose stiffness varies, along it or over the steps; else None.

    Of a cable with a soft spot the rest is wanted, and is its middle; with several forms none of its places may be the
    one that the law is of. Of moments that are others from a step on nobody knows which ones are right, those before or
    after, and the middle is the mean over the steps. How far it lies from the law is part of the band.
    """
    extension, profile = fitted.extension, fitted.run.model.bending.rod.section.profile
    ratio = 1.0 if profile is None else float(np.median(profile))
    for k in extension.terms_of(OTHER_STIFFNESS):
        course = OTHER_STIFFNESS.course(extension.terms[k].variant, extension.facts)
        ratio *= 1.0 + float(fitted.vector[extension.amounts_at[k]] * np.mean(course))
    return None if ratio == 1.0 else replace(fitted, vector=extension.base.stiffer(fitted.vector, ratio))


def _with_other_forms(observation: Observation, again: Identified) -> Identified:
    """Where the law lies if a cause has any forms that add up: part of the band, and no better answer.

    A sum of few elements stands for a loop of friction whose true form nobody knows. Elements of other slips, of either
    sign, move the law about as far as it is off: 0.7 to 1.7 % on five loops (true errors 1.2 to 1.6 %). The size of the
    cause is known no better than the sum over all of them is, see `SPREAD`.
    """
    fitted = again.fitted
    causes, beside = _other_forms(observation, fitted)
    if beside.shape[1] == 0:
        return again
    law = len(fitted.extension.base.names)
    mean = mean_posterior(observation, fitted, beside=beside).mean
    # amounts and forms stay: a linear move may leave their range, and the law is all that it is asked for
    other = replace(fitted, vector=np.concatenate([mean[:law], fitted.vector[law:]]))
    covariance = mean_posterior(observation, fitted, beside=SPREAD * beside).covariance
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

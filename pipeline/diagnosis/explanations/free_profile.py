"""A profile along the cable in any form: a sum of waves in the place of the forms it was found by.

A step, a kink or several bumps are no form of the catalogue, and what three forms leave of a strong one is many times
the noise. Once a cause along the cable is in the model, its profile may be whatever the photos ask for. Photos of the
force-free cable show K0(s) directly, photos under load by what does not grow with the moment, so that waves are a
nearly linear problem; they come in blocks as long as each block pays for itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.profile import WAVE_COST, deviation, position_of, profile, wave
from pipeline.diagnosis.explanations.forms import SHAPE_GAIN
from pipeline.diagnosis.fits.search import VISIBLE
from pipeline.diagnosis.statistics.score import span
from rod.inverse.extension import Extension, Term
from rod.inverse.fit import Fit, fit_from
from rod.inverse.observation import Observation
from rod.inverse.sensitivities import profile_columns

Array = NDArray[np.float64]

BLOCKS = (8, 16, 24)
"""Numbers of waves. Of a sharp step of K0 by 3 1/m, 24 leave waves of 0.5 um across the cable: a twentieth of a pixel's
tenth, below what a photo shows. A shape has 20 functions a photo, so more could hardly be told apart."""

EACH = 2.0 * WAVE_COST
"""Chi-square for each further number that a block must remove besides ``shape_gain``."""


def with_free_profile(observation: Observation, fitted: Fit, cause: Cause, *, hopeless: float = np.inf) -> Fit:
    """Replace the forms of a cause along the cable by waves, where these explain the data better.

    Parameters
    ----------
    observation : Observation
    fitted : Fit
        With the cause in it.
    cause : Cause
        Any; one that is no profile along the cable leaves the model as it is.
    hopeless : float
        Chi-square above which the result is of no use.
    """
    if not cause.varies or not _may_pay(observation, fitted, cause, hopeless):
        return fitted
    best, most = fitted, fitted.chi2 - (1.0 - SHARED) * _excess(fitted)
    for count in BLOCKS:
        extension, start = in_waves(best, cause, count)
        found = fit_from(observation, extension, start, best)
        if found.run.prediction is not None and best.chi2 - found.chi2 > price(found, best):
            best = found
        elif best is not fitted:
            break  # what replaces spots may need more waves than the first block has
        if best is not fitted and best.converged and _left_by_all(observation, best, cause) > most:
            return fitted
    return best if _excess(best) < SHARED * _excess(fitted) else fitted


SHARED = 0.25
"""Share of the misfit beyond noise that waves may leave: what takes only a part of it away takes it from another misfit
(a law that is too coarse for a steep fall left 380; waves took half of that and put f_EI 8 % off)."""


def _excess(fitted: Fit) -> float:
    """Chi-square beyond noise."""
    return fitted.chi2 - (len(fitted.residual) - fitted.extension.size)


def in_waves(fitted: Fit, cause: Cause, count: int) -> tuple[Extension, Array]:
    """The model with ``count`` waves in the place of the forms of a cause, and the vector nearest to the fitted one.

    Waves have mean zero; a mean that the forms had (spots) goes to the law, or to K0.
    """
    own = fitted.extension.terms_of(cause)
    rest, vector = fitted.extension.without(fitted.vector, own)
    uniform, varying = rest.model(vector), fitted.extension.model(fitted.vector)
    terms = tuple(Term(cause, wave(k)) for k in range(1, count + 1))
    position = position_of(uniform)
    waves = np.column_stack([np.ones_like(position), *(profile(term.variant, position) for term in terms)])
    mean, *amounts = np.linalg.lstsq(waves, deviation(uniform, varying, cause), rcond=None)[0]
    if cause.unit == "-":
        vector = rest.base.stiffer(vector, 1.0 + max(mean, -0.9))
        amounts = [amount / (1.0 + max(mean, -0.9)) for amount in amounts]
    elif (bend := rest.base.pre_curvature_index) is not None:
        vector[bend] += mean
    return Extension(rest.base, rest.facts, (*rest.terms, *terms)), np.r_[vector, amounts]


def price(found: Fit, simpler: Fit) -> float:
    """Chi-square that a model must remove for its further numbers."""
    return _price(found.extension.size - simpler.extension.size)


def _price(further: int) -> float:
    return SHAPE_GAIN + EACH * max(further, 0)


def _may_pay(observation: Observation, fitted: Fit, cause: Cause, hopeless: float) -> bool:
    """Whether waves beside what is fitted would remove enough, by the linear model."""
    further = BLOCKS[0] - sum(fitted.extension.terms[k].size for k in fitted.extension.terms_of(cause))
    if _excess(fitted) < _price(further):
        return False
    removed = fitted.chi2 - _left_by_all(observation, fitted, cause)
    if not fitted.converged:  # what is left then says little of what waves would leave
        return fitted.chi2 - removed < max(hopeless, 0.5 * fitted.chi2) or not np.isfinite(hopeless)
    return removed > _price(further) and fitted.chi2 - removed < hopeless


def _left_by_all(observation: Observation, fitted: Fit, cause: Cause) -> float:
    """Chi-square that all waves beside what is fitted would leave, by the linear model."""
    terms = [Term(cause, wave(k)) for k in range(1, BLOCKS[-1] + 1)]
    columns = profile_columns(observation, fitted.extension, fitted.vector, fitted.run, terms)
    known = span(fitted.jacobian)
    beside = columns - known @ (known.T @ columns)
    seen = np.linalg.norm(beside, axis=0) > VISIBLE * np.linalg.norm(columns, axis=0)
    return fitted.chi2 - float(np.sum((span(beside[:, seen]).T @ fitted.residual) ** 2))

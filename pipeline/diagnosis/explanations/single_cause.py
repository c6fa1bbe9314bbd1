"""One cause put into the model, in the form or the few forms of it that explain the data best.

A score says where to begin, and no more: a soft spot on one side looks like a stiff one on the other until it has found
its place. So a refit starts from several forms. Of each setting (what all forms that act together have in common) the
best goes on, further forms are added where they may act together, and the cheapest model is the explanation.
"""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.explanations.candidates import LEAST, NEARLY_AS_LOUD, kinds
from pipeline.diagnosis.explanations.forms import SHAPE_GAIN, as_one_form, with_more_forms
from pipeline.diagnosis.explanations.free_profile import price, with_free_profile
from pipeline.diagnosis.explanations.refit import cost, fit_term
from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.posterior.explanation import Explanation, explanation_of
from pipeline.diagnosis.statistics.score import descending
from rod.inverse.fit import FITS, Fit, fit_from
from rod.inverse.observation import Observation


def refit_one(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    cause: int,
    *,
    rival: float = np.inf,
) -> Explanation | None:
    """Fit the model with one cause in it; None where it cannot be simulated or has no admissible amount.

    ``rival`` is the chi-square another cause has reached: one that stays far above it after its first fit is not tried
    from other starts and with further forms.
    """
    kind = suspicion.causes[cause]
    hopeless = rival + LEAST
    found = _in_any_form(observation, base, suspicion, cause, hopeless) if kind.varies else None
    if found is None:
        best = _by_setting(observation, base, suspicion, cause, hopeless=hopeless)
        if kind.combines:
            for setting, one in best.items():
                best[setting] = _several(observation, one, kind, setting, hopeless=hopeless)
        found = min(best.values(), key=cost, default=None)
    return None if found is None else explanation_of((cause,), base, found)


def _several(observation: Observation, one: Fit, kind: Cause, setting: str, *, hopeless: float) -> Fit:
    """Add to a model with one form of a cause whatever further forms pay for themselves."""
    several = with_more_forms(observation, one, kind, setting, hopeless=hopeless)
    worse = SHAPE_GAIN * (len(several.extension.terms) - 1)
    several = as_one_form(observation, several, worse=worse)
    return with_free_profile(observation, several, kind, hopeless=hopeless)


def _in_any_form(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    cause: int,
    hopeless: float,
) -> Fit | None:
    """A profile along the cable: as waves (a nearly linear problem) where its best form leaves more than noise.

    Where fewer forms do as well as the waves, they are the explanation.
    """
    kind, direction = suspicion.causes[cause], suspicion.best(cause)
    to_the_noise = FITS * (len(base.residual) - base.extension.size)
    if direction is None or base.chi2 < to_the_noise:
        return None
    first = fit_term(observation, base, suspicion, direction)
    if first is None or first.chi2 < to_the_noise:
        return None
    free = with_free_profile(observation, first, kind)
    if free.chi2 > to_the_noise:
        return free if free.chi2 > hopeless else None  # what no profile does no few forms will do
    worse = price(free, first)
    spot = as_one_form(observation, free, worse=worse)
    few = with_more_forms(observation, first, kind, "", hopeless=free.chi2 + worse)
    return min((free, spot, few), key=cost)


def _by_setting(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    cause: int,
    *,
    hopeless: float,
) -> dict[str, Fit]:
    """The best fit of a single form of a cause for each setting; empty where no form can be simulated."""
    to_the_noise = FITS * (len(base.residual) - base.extension.size)
    best: dict[str, Fit] = {}
    enough: dict[str, int] = {}
    for direction in _first_forms(suspicion, cause):
        # a law of any form beside the wrong kind of a cause may leave no more than noise, so each kind is tried, and
        # what needs fewer numbers than one that leaves no more
        term = suspicion.terms[direction]
        if term.size >= enough.get(term.variant.label, np.inf):
            continue
        found = _fit_form(observation, base, suspicion, direction, hopeless=hopeless)
        if found is None:
            continue
        if found.converged and found.chi2 < to_the_noise:
            enough[term.variant.label] = term.size
        setting = term.variant.setting
        best[setting] = min(best.get(setting, found), found, key=cost)
    return best


def _fit_form(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    direction: int,
    *,
    hopeless: float,
) -> Fit | None:
    """Fit with one form in the model, its place and width tuned too unless that stalls (traces of slip have kinks)."""
    found = fit_term(observation, base, suspicion, direction, hopeless=hopeless)
    if found is None or found.converged or not suspicion.terms[direction].variant.tuned:
        return found
    held = fit_term(observation, base, suspicion, direction, hopeless=hopeless, tuned=False)
    further = fit_from(observation, found.extension, found.vector, found, hopeless=hopeless)
    return min((one for one in (found, held, further) if one is not None and one.run.prediction is not None), key=cost)


def _first_forms(suspicion: Suspicion, cause: int) -> list[int]:
    """Forms to start a refit with: up to four that score near the best one, and the best of each other kind."""
    own = suspicion.of(cause)
    ranked = [int(k) for k in own[descending(suspicion.statistic[own])]]
    least = NEARLY_AS_LOUD * suspicion.statistic[ranked[0]]
    loud = [k for k in ranked[:4] if suspicion.statistic[k] >= least]
    return list(dict.fromkeys([*loud, *kinds(suspicion, cause)]))

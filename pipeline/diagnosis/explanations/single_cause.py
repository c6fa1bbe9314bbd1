"""One cause put into the model, in the form or the few forms of it that explain the data best.

A score says where to begin, and no more: a soft spot on one side sounds like a stiff one on the other until it has
found its place. So a refit starts from several forms. Of each setting (what all forms that act together have in common)
the best goes on, further forms are added where they may act together, and the cheapest model is the explanation.
"""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.explanations.explanation import Explanation, explanation_of
from pipeline.diagnosis.explanations.forms import as_one_spot, with_more_forms
from pipeline.diagnosis.explanations.refit import fit_terms
from pipeline.diagnosis.fits.fit import Fit
from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.observations.observation import Observation
from pipeline.settings.diagnosis import DiagnosisSettings

NEARLY_AS_LOUD = 0.75
"""Share of the loudest score; a misplaced spot keeps that much of the score it would have at its place."""


def refit_one(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    cause: int,
    settings: DiagnosisSettings,
    *,
    rival: float = np.inf,
) -> Explanation | None:
    """Fit the model with one cause in it; None where it cannot be simulated or has no admissible amount.

    ``rival`` is the chi-square another cause has reached: one that stays far above it after its first fit is not tried
    from other starts and with further forms.
    """
    kind = suspicion.causes[cause]
    hopeless = rival + settings.refit_least + settings.hopeless * base.chi2
    best = _by_setting(observation, base, suspicion, cause, settings, hopeless=hopeless)
    if not best:
        return None
    if kind.combines:
        for setting, one in best.items():
            several = with_more_forms(observation, one, kind, setting, settings, hopeless=hopeless)
            best[setting] = as_one_spot(observation, several, settings)
    return explanation_of((cause,), base, min(best.values(), key=_cost), suspicion)


def _by_setting(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    cause: int,
    settings: DiagnosisSettings,
    *,
    hopeless: float,
) -> dict[str, Fit]:
    """The best fit of a single form of a cause for each setting; empty where no form can be simulated."""
    to_the_noise = settings.fits * (len(base.residual) - base.extension.size)
    best: dict[str, Fit] = {}
    for direction in _first_forms(suspicion, cause):
        if any(one.converged and one.chi2 < to_the_noise for one in best.values()):
            break
        found = _fit_form(observation, base, suspicion, direction, settings, hopeless=hopeless)
        if found is None:
            continue
        setting = suspicion.terms[direction].variant.setting
        best[setting] = min(best.get(setting, found), found, key=_cost)
        if found.chi2 >= hopeless and _are_starts_only(suspicion, cause):
            break
    return best


def _fit_form(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    direction: int,
    settings: DiagnosisSettings,
    *,
    hopeless: float,
) -> Fit | None:
    """Fit with one form in the model, its place and width tuned along unless that stalls.

    Where the trace has kinks (slip), a form that is tuned may stall; the form as it is scored does not.
    """
    found = fit_terms(observation, base, suspicion, (direction,), settings, hopeless=hopeless)
    if found is None or found.converged or not suspicion.terms[direction].variant.tuned:
        return found
    held = fit_terms(observation, base, suspicion, (direction,), settings, hopeless=hopeless, tuned=False)
    return held if held is not None and _cost(held) < _cost(found) else found


def _first_forms(suspicion: Suspicion, cause: int) -> list[int]:
    """Forms to start a refit with: up to four nearly as loud as the loudest, and the loudest of the other kinds.

    A soft spot on one side sounds like a stiff one on the other until it has found its place, and like smooth forms.
    Which setting is right may show only when further forms act beside.
    """
    own = suspicion.of(cause)
    ranked = [int(k) for k in own[np.argsort(-suspicion.statistic[own], kind="stable")]]
    least = NEARLY_AS_LOUD * suspicion.statistic[ranked[0]]
    loud = [k for k in ranked[:4] if suspicion.statistic[k] >= least]
    first = suspicion.terms[ranked[0]].variant
    other = [k for k in ranked if suspicion.terms[k].variant.tuned != first.tuned]
    elsewhere = [k for k in ranked if suspicion.terms[k].variant.setting != first.setting]
    return list(dict.fromkeys([*loud, *other[:1], *elsewhere[:1]]))


def _are_starts_only(suspicion: Suspicion, cause: int) -> bool:
    """Whether the forms of a cause differ by nothing but a number that a refit tunes, and of them one acts alone."""
    variants = [suspicion.terms[k].variant for k in suspicion.of(cause)]
    return not suspicion.causes[cause].combines and all(v.tuned and v.setting == variants[0].setting for v in variants)


def _cost(fitted: Fit) -> float:
    """Chi-square plus two for every parameter."""
    return fitted.chi2 + 2.0 * fitted.extension.size

"""One cause put into the model, in the form or the few forms of it that explain the data best.

A score says where to begin, and no more: a soft spot on one side looks like a stiff one on the other until it has found
its place. So a refit starts from several forms. The best of each kind goes on: with the other components of one thing,
or as a sum of all forms where these add up.
"""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.explanations.candidates import LEAST, NEARLY_AS_LOUD, kind_of, kinds
from pipeline.diagnosis.explanations.forms import as_one_form, in_all_forms, with_all_components
from pipeline.diagnosis.explanations.free_profile import free_profile
from pipeline.diagnosis.explanations.refit import cost, fit_term
from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.explanation import Explanation, explanation_of
from pipeline.diagnosis.statistics.score import descending
from rod.inverse.base_fit import settled
from rod.inverse.cause import Profile
from rod.inverse.fit import FITS, Fit
from rod.inverse.observation import Observation

ALSO = 0.01
"""Probability from which a cause is refitted besides those that come near the best score, a form beside the best."""


def refits(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    cause: int,
    *,
    rival: float = np.inf,
) -> list[Explanation]:
    """Fit the model with one cause in it; empty where it cannot be simulated or has no admissible amount.

    In the few forms that explain the data best; a profile along the cable also in any form, and in the one form nearest
    to what was found. ``rival`` is the chi-square another cause has reached: one that stays far above it after its
    first fit is not tried from other starts and with further forms.
    """
    kind, hopeless = suspicion.causes[cause], rival + LEAST
    found = [*_by_kind(observation, base, suspicion, cause, hopeless=hopeless).values()]
    # one form or component alone is left beside all of them for the evidence to choose
    if kind.additive:
        found += [in_all_forms(observation, one, kind, one.extension.terms[-1].variant.setting) for one in found]
    parts = ((one, one.extension.terms[-1]) for one in found)
    found += [
        with_all_components(observation, one, term, hopeless=hopeless) for one, term in parts if term.variant.component
    ]
    # half a cost is minus the logarithm of a likelihood
    enough = min(map(cost, found), default=np.inf) - 2.0 * np.log(ALSO)
    found = [one for one in dict.fromkeys(found) if cost(one) < enough]
    if isinstance(kind, Profile) and found:
        found += free_profile(observation, found[0], kind) if found[0].reduced_chi2 > FITS else []
        found += as_one_form(observation, found[-1])
    return [explanation_of((cause,), base, one) for one in found]


Refits = dict[int, tuple[float, list[Explanation]]]
"""Causes that were refitted already: the rival each had, and what was found."""


def known_refits(bench: Workbench, cause: int, known: Refits, *, rival: float) -> list[Explanation]:
    """`refits`, unless ``known`` has them with a rival no better; they are put there."""
    if cause not in known or known[cause][0] < rival:
        known[cause] = rival, refits(bench.observation, bench.base, bench.suspicion, cause, rival=rival)
    return known[cause][1]


def _by_kind(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    cause: int,
    *,
    hopeless: float,
) -> dict[tuple[str, ...], Fit]:
    """The best fit of a single form of a cause for each kind (`kind_of`); empty where no form can be simulated."""
    best: dict[tuple[str, ...], Fit] = {}
    enough: dict[str, int] = {}
    for direction in _first_forms(suspicion, cause):
        # a law of any form beside the wrong kind of a cause may leave no more than noise, so each kind is tried, and
        # what needs fewer numbers than one that leaves no more
        term = suspicion.terms[direction]
        if term.size >= enough.get(term.variant.label, np.inf):
            continue
        found = fit_term(observation, base, suspicion, direction, hopeless=hopeless)
        if found is None:
            continue
        if not found.converged and found.chi2 < hopeless:
            found = settled(observation, found)
        freedom = len(found.residual) - found.extension.size
        if found.converged and found.chi2 < freedom + 2.0 * np.sqrt(2.0 * freedom):
            enough[term.variant.label] = term.size
        best[kind_of(term)] = min(best.get(kind_of(term), found), found, key=cost)
        if not (term.cause.additive or term.variant.component):  # of forms that stand alone those near the best stay
            hopeless = min(hopeless, found.chi2 + LEAST)
    return best


def _first_forms(suspicion: Suspicion, cause: int) -> list[int]:
    """Forms to start a refit with: up to four that score near the best one, and the best of each other kind."""
    own = suspicion.of(cause)
    ranked = [int(k) for k in own[descending(suspicion.statistic[own])]]
    least = NEARLY_AS_LOUD * suspicion.statistic[ranked[0]]
    loud = [k for k in ranked[:4] if suspicion.statistic[k] >= least]
    return list(dict.fromkeys([*loud, *kinds(suspicion, cause)]))

"""Several forms of one cause together: how many the data ask for, and whether they are one form after all.

A profile along the cable is a sum of smooth forms and spots, friction between the wires a sum of elements that slip one
after the other. Forms are added while each pays for itself; those that a later one has made needless go again; and
where they add up to one spot or one step, that is tried in their place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.profile import forms_between
from pipeline.diagnosis.explanations.refit import cost, fit_term
from pipeline.diagnosis.fits.search import Suspicion, suspect
from pipeline.diagnosis.statistics.score import descending
from rod.inverse.cause import Variant
from rod.inverse.extension import Extension, Term
from rod.inverse.fit import Fit, fit_from
from rod.inverse.observation import Observation

SHAPES_MOST = 3
"""Forms of one cause that are combined in a refit at most."""

SHAPE_GAIN = 16.0
"""Chi-square by which a further form of the same cause must pay (4 sigma)."""

LEAST_SHARE = 0.02
"""Of what a model leaves: far above the noise any form removes a little, and models that none of them brings to it were
given one after the other, each with all refits that tell which of them are needless."""


def with_more_forms(
    observation: Observation,
    fitted: Fit,
    cause: Cause,
    setting: str,
    *,
    hopeless: float,
) -> Fit:
    """Add forms of a cause to the model as long as each removes ``shape_gain``, or `LEAST_SHARE` of the misfit if more.

    Parameters
    ----------
    observation : Observation
    fitted : Fit
        With the cause in it already.
    cause : Cause
        One whose forms may act together.
    setting : str
        Of the forms that may act together (`causes.cause.Variant`).
    hopeless : float
        Chi-square above which the result is of no use.
    """
    if cause.additive:
        return in_all_forms(observation, fitted, cause, setting)
    if cause.whole:
        return _with_all_components(observation, fitted, cause, setting)
    while len(fitted.extension.terms_of(cause)) < SHAPES_MOST:
        least = max(SHAPE_GAIN, LEAST_SHARE * fitted.chi2)
        more = suspect(observation, fitted, [cause])
        fitting = np.array([may_join(term, fitted, setting) for term in more.terms], dtype=bool)
        fresh = fitting & np.array([term not in fitted.extension.terms for term in more.terms], dtype=bool)
        if fitted.chi2 - _loudest(more.statistic, fitting) ** 2 >= hopeless:
            break
        added: Fit | None = None
        # a form that is there already, put beside itself, starts on the ridge where neither knows its amount
        for eligible in (fresh, fitting):
            if _loudest(more.statistic, eligible) ** 2 >= least:
                fits = (fit_term(observation, fitted, more, start) for start in _starts(more, eligible))
                added = min((one for one in fits if one is not None), key=lambda one: one.chi2, default=None)
            if added is not None and fitted.chi2 - added.chi2 >= least:
                break
        if added is None or fitted.chi2 - added.chi2 < least:
            break
        fitted = without_needless_forms(observation, added, cause)
    return fitted


def _with_all_components(observation: Observation, fitted: Fit, cause: Cause, setting: str) -> Fit:
    """Fit the components of one thing that are not in the model yet as well, from nothing."""
    known = fitted.extension
    present = {known.terms[k].variant.label for k in known.terms_of(cause)}
    forms = (form for form in cause.variants(known.facts) if form.setting == setting)
    added = tuple(Term(cause, form) for form in forms if form.label not in present)
    extension = replace(known, terms=(*known.terms, *added))
    found = fit_from(observation, extension, np.r_[fitted.vector, np.zeros(len(added))], fitted)
    return fitted if found.run.prediction is None else found


def in_all_forms(observation: Observation, fitted: Fit, cause: Cause, setting: str) -> Fit:
    """Fit all forms of a cause whose amounts add up, then keep those that the model needs.

    Amounts of one sign are a nearly linear problem; added one by one they are not, as no single form of a round loop
    promises anything. Forms of each kind are tried by themselves too, as places are few.
    """
    forms = [form for form in cause.variants(fitted.extension.facts) if form.setting == setting]
    kinds = {label: [form for form in forms if form.label == label] for label in (form.label for form in forms)}
    tried = [*kinds.values(), *([forms] if len(kinds) > 1 else [])]
    return min((fitted, *(_spread(observation, fitted, cause, some) for some in tried)), key=cost)


def _spread(observation: Observation, fitted: Fit, cause: Cause, forms: Sequence[Variant]) -> Fit:
    own = fitted.extension.terms_of(cause)
    total = sum(fitted.amount(k)[0] for k in own)
    rest, vector = fitted.extension.without(fitted.vector, own)
    every = tuple(Term(cause, replace(form, tuned=())) for form in forms)
    start = np.r_[vector, np.full(len(every), total / len(every))]
    spread = fit_from(observation, replace(rest, terms=(*rest.terms, *every)), start, fitted)
    if spread.run.prediction is None:
        return fitted
    amounts = zip(forms, spread.vector[len(vector) :], strict=True)
    needed = [(Term(cause, form), amount) for form, amount in amounts if amount > LEAST_SHARE * total]
    if not needed:
        return fitted
    start = np.concatenate([spread.vector[: len(vector)], *(term.numbers(amount) for term, amount in needed)])
    found = fit_from(observation, replace(rest, terms=(*rest.terms, *(term for term, _ in needed))), start, spread)
    return fitted if found.run.prediction is None else without_needless_forms(observation, found, cause)


def may_join(term: Term, fitted: Fit, setting: str) -> bool:
    """Whether a form can be one of those that act together.

    Not one without a place of its own beside itself: what two opposite amounts of it remove is another cause's trace.
    """
    if term.variant.setting != setting:
        return False
    present = [(other.cause, other.variant.as_usual) for other in fitted.extension.terms]
    return term.variant.has_place or (term.cause, term.variant.as_usual) not in present


def _starts(more: Suspicion, eligible: NDArray[np.bool_]) -> list[int]:
    """The form that scores highest, and the same at another amount (a square trace tells nothing of the sign)."""
    ranked = [int(k) for k in descending(more.statistic * eligible) if eligible[k]]
    first = more.terms[ranked[0]].variant.as_usual
    return [k for k in ranked if more.terms[k].variant.as_usual == first][:2]


def _loudest(statistic: NDArray[np.float64], eligible: NDArray[np.bool_]) -> float:
    """Largest statistic of the eligible directions; 0 without any."""
    return float(statistic[eligible].max(initial=0.0))


def without_needless_forms(observation: Observation, fitted: Fit, cause: Cause) -> Fit:
    """Drop the forms of a cause that later ones have made needless: each removes less than ``shape_gain``."""
    while len(own := fitted.extension.terms_of(cause)) > 1:
        enough = fitted.chi2 + SHAPE_GAIN
        shorter = [
            fit_from(observation, *fitted.extension.without(fitted.vector, {form}), fitted, hopeless=enough)
            for form in own
        ]
        simplest = min(shorter, key=lambda one: one.chi2 if one.run.prediction is not None else np.inf)
        if simplest.run.prediction is None or simplest.chi2 > enough:
            break
        fitted = simplest
    return fitted


def as_one_form(observation: Observation, fitted: Fit) -> list[Fit]:
    """One spot, piece or step in the place of several forms along the cable, the best of the three; empty without any.

    A strong spot sought from beside its place ends in a minimum of its own; the sum of the forms tells where it is.
    """
    extension, found = fitted.extension, list[Fit]()
    count = len(extension.terms)
    if count < 2 or len(extension.terms_of(extension.terms[0].cause)) < count:
        return []
    cause = extension.terms[0].cause
    for variant, amount, stiffer in forms_between(extension.base_model(fitted.vector), extension.model(fitted.vector)):
        alone = Extension(extension.base, extension.facts, (Term(cause, variant),))
        start = alone.base.stiffer(alone.start(fitted.vector, (amount,)), 1.0 + stiffer)
        found.append(fit_from(observation, alone, start, fitted))
    return sorted((one for one in found if one.run.prediction is not None), key=lambda one: one.chi2)[:1]

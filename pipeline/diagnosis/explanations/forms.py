"""Several forms of one cause together: how many the data ask for, and whether they are one form after all.

Friction between the wires is a sum of elements that slip one after the other, relaxation one of several times: all are
fitted at once, and those that are not needed go again. A load has two components. Where waves along the cable add up to
one spot, piece or step, that is tried in their place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.profile import forms_between
from pipeline.diagnosis.explanations.candidates import far_behind
from pipeline.diagnosis.explanations.refit import cost
from rod.inverse.cause import Variant
from rod.inverse.extension import Extension, Term
from rod.inverse.fit import Fit, fit
from rod.inverse.observation import Observation

SHAPE_GAIN = 16.0
"""Chi-square by which a further form of the same cause must pay (4 sigma)."""

LEAST_SHARE = 0.02
"""Of the sum of all forms: what has less of it is not tried by itself."""


def with_all_components(observation: Observation, fitted: Fit, term: Term, *, hopeless: float = np.inf) -> Fit:
    """Fit the other components of the thing that a term of the model is one of, if they are not in it yet.

    From nothing; from as much as there is of the term where amounts have one sign, and the trace of little may be none.
    """
    known, cause = fitted.extension, term.cause
    present = {known.terms[k].variant.label for k in known.terms_of(cause)}
    others = {form.label: form for form in cause.variants(known.facts) if form.setting == term.variant.setting}
    added = tuple(Term(cause, form) for label, form in others.items() if label not in present)
    if not added:
        return fitted
    begin = fitted.amount(known.terms_of(cause)[0])[0] if cause.sign else 0.0
    start = np.r_[fitted.vector, np.full(len(added), begin)]
    found = fit(observation, replace(known, terms=(*known.terms, *added)), start, near=fitted.run, hopeless=hopeless)
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
    spread = fit(observation, replace(rest, terms=(*rest.terms, *every)), start, near=fitted.run)
    if spread.run.prediction is None:
        return fitted
    amounts = zip(forms, spread.vector[len(vector) :], strict=True)
    needed = [(form, amount) for form, amount in amounts if amount > LEAST_SHARE * total]
    if not needed:
        return fitted
    found = [fitted]
    for places in dict.fromkeys([("at",), *(form.tuned for form, _ in needed)]):  # then with widths as well
        some = [(Term(cause, replace(form, tuned=places[: len(form.tuned)])), amount) for form, amount in needed]
        start = np.concatenate([spread.vector[: len(vector)], *(term.numbers(amount) for term, amount in some)])
        extension = replace(rest, terms=(*rest.terms, *(term for term, _ in some)))
        whole = fit(observation, extension, start, near=spread.run)
        if whole.run.prediction is not None:
            found.append(without_needless_forms(observation, whole, cause))
    return min(found, key=cost)


def without_needless_forms(observation: Observation, fitted: Fit, cause: Cause) -> Fit:
    """Drop the forms of a cause that later ones have made needless: each removes less than ``shape_gain``."""
    while len(own := fitted.extension.terms_of(cause)) > 1:
        enough = fitted.chi2 + SHAPE_GAIN
        shorter = [
            fit(observation, *fitted.extension.without(fitted.vector, {form}), near=fitted.run, hopeless=enough)
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
        found.append(fit(observation, alone, start, near=fitted.run, hopeless=far_behind(fitted.chi2)))
    return sorted((one for one in found if one.run.prediction is not None), key=lambda one: one.chi2)[:1]

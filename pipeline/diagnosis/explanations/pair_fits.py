"""Pairs of causes as they are fitted: a single cause with what scores beside it.

A pair gets all forms of its causes, as a single cause has: without its lesser part a load at an angle leaves a wrong
pair the better one. Forms with a place of their own (elements of friction, profiles along the cable) cost several
refits, so only the best pairs get them (`in_any_form`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.diagnosis.explanations.candidates import LEAST, NEARLY_AS_LOUD, kinds
from pipeline.diagnosis.explanations.forms import with_more_forms
from pipeline.diagnosis.explanations.free_profile import free_profile
from pipeline.diagnosis.explanations.refit import cost, fit_term
from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.explanation import Explanation, explanation_of
from rod.inverse.cause import Profile
from rod.inverse.extension import Extension, Term
from rod.inverse.fit import FITS, fit_from


def pairs_beside(bench: Workbench, best: Explanation, second: Suspicion, causes: Sequence[int]) -> list[Explanation]:
    """A single cause with each of some others, those in the model already left out; hopeless fits end early."""
    found, rival = [], np.inf
    for cause in causes:
        if cause == best.causes[0] or not second.of(cause).size:
            continue
        forms = kinds(second, cause)
        loud = [form for form in forms if second.statistic[form] >= NEARLY_AS_LOUD * second.statistic[forms[0]]]
        fits = (fit_term(bench.observation, best.fitted, second, form, hopeless=rival + LEAST) for form in loud)
        fitted = min((one for one in fits if one is not None), key=cost, default=None)
        if fitted is not None:
            rival = min(rival, fitted.chi2)
            found.append(explanation_of((best.causes[0], cause), bench.base, fitted))
    return found


def together(bench: Workbench, directions: Sequence[int]) -> list[Explanation]:
    """Causes that hide each other, fitted from what the linear model says of all at once; empty if that fails."""
    base, suspicion = bench.base, bench.suspicion
    terms = tuple(suspicion.terms[k] for k in directions)
    table = np.hstack([base.jacobian, suspicion.columns[:, list(directions)]])
    size = np.linalg.norm(table, axis=0)
    move = np.linalg.lstsq(table / np.where(size > 0.0, size, 1.0), base.residual, rcond=1e-7)[0]
    move = move / np.where(size > 0.0, size, 1.0)
    extension = Extension(base.extension.base, bench.facts, terms)
    start = extension.start(base.vector + move[: len(base.vector)], tuple(move[len(base.vector) :]))
    fitted = fit_from(bench.observation, extension, extension.brought_inside(start), base)
    causes = tuple(int(suspicion.owner[k]) for k in directions)
    return [explanation_of(causes, base, fitted)] if fitted.converged else []


def with_all_forms(bench: Workbench, found: list[Explanation]) -> list[Explanation]:
    """Pairs, best first, with further forms of their causes; one that stays far above the best is left as it is."""
    every: dict[frozenset[int], Explanation] = {}
    for pair in sorted(found, key=lambda e: -e.worth):
        if frozenset(pair.causes) not in every:
            rival = min((e.fitted.chi2 for e in every.values()), default=np.inf)
            every[frozenset(pair.causes)] = with_own_forms(bench, pair, rival=rival)
    return list(every.values())


def with_own_forms(bench: Workbench, pair: Explanation, *, rival: float) -> Explanation:
    """A pair with further directions of its causes (a load, a tilt), as far as they can bring it near a rival."""
    fitted, hopeless, facts = pair.fitted, rival + LEAST, bench.facts
    for kind in (bench.suspicion.causes[cause] for cause in pair.causes):
        if not kind.combines or any(form.has_place for form in kind.variants(facts)):
            continue
        for setting in {term.variant.setting for term in fitted.extension.terms if term.cause is kind}:
            fitted = with_more_forms(bench.observation, fitted, kind, setting, hopeless=hopeless)
    return pair if fitted is pair.fitted else explanation_of(pair.causes, bench.base, fitted)


def in_any_form(bench: Workbench, found: Sequence[Explanation]) -> list[Explanation]:
    """The best pairs with further forms that have a place, and with profiles of any form; hopeless ones left out."""
    new: list[Explanation] = []
    for pair in sorted(found, key=lambda e: -e.worth)[:IN_ANY_FORM]:
        hopeless, fitted = min(e.fitted.chi2 for e in (*found, *new)) + LEAST, [pair.fitted]
        for kind in (bench.suspicion.causes[cause] for cause in pair.causes):
            if isinstance(kind, Profile):
                fitted += free_profile(bench.observation, fitted[-1], kind) if fitted[-1].reduced_chi2 > FITS else []
            elif kind.combines:
                for setting in {term.variant.setting for term in fitted[-1].extension.terms if term.cause is kind}:
                    fitted.append(with_more_forms(bench.observation, fitted[-1], kind, setting, hopeless=hopeless))
        new += [explanation_of(pair.causes, bench.base, one) for one in dict.fromkeys(fitted) if one is not pair.fitted]
        new += by_step(bench, explanation_of(pair.causes, bench.base, fitted[-1]))
    return new


def by_step(bench: Workbench, one: Explanation) -> list[Explanation]:
    """An explanation with causes (of one form each) that differ from step to step, in one way at a time."""
    known, found = one.fitted.extension, []
    for kind in (bench.suspicion.causes[cause] for cause in one.causes):
        own = known.terms_of(kind)
        for forms in kind.by_step(one.fitted.amount(own[0])[0], bench.facts) if len(own) == 1 else ():
            extension = replace(known, terms=(*known.terms, *(Term(kind, form) for form in forms)))
            start = np.r_[one.fitted.vector, np.zeros(len(forms))]
            fitted = fit_from(bench.observation, extension, start, one.fitted)
            if fitted.run.prediction is not None:
                found.append(explanation_of(one.causes, bench.base, fitted))
    return found


IN_ANY_FORM = 2
"""Pairs, the best first, that get forms with a place of their own; time."""

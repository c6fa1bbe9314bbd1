"""Pairs of causes as they are fitted: a single cause with what scores beside it.

A pair gets all components of its causes, as a single cause has: without its lesser part a load at an angle leaves a
wrong pair the better one. Sums of forms (elements of friction, profiles along the cable) cost several refits, so only
the best pairs get them (`in_any_form`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.diagnosis.explanations.candidates import LEAST, NEARLY_AS_LOUD, kinds
from pipeline.diagnosis.explanations.forms import in_all_forms, with_all_components
from pipeline.diagnosis.explanations.free_profile import free_profile
from pipeline.diagnosis.explanations.refit import cost, fit_term
from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.explanation import Explanation, explanation_of
from rod.inverse.cause import Profile
from rod.inverse.extension import Extension, Term
from rod.inverse.fit import FITS, fit


def pairs_beside(
    bench: Workbench, best: Explanation, second: Suspicion, causes: Sequence[int], *, hopeless: float
) -> list[Explanation]:
    """A single cause with each of some others, those in the model already left out.

    ``hopeless``: chi-square above which a fit is of no use; what one pair has reached is a measure for the next.
    """
    found = []
    for cause in causes:
        if cause == best.causes[0] or not second.of(cause).size:
            continue
        forms = kinds(second, cause)
        loud = [form for form in forms if second.statistic[form] >= NEARLY_AS_LOUD * second.statistic[forms[0]]]
        fits = (fit_term(bench.observation, best.fitted, second, form, hopeless=hopeless) for form in loud)
        fitted = min((one for one in fits if one is not None), key=cost, default=None)
        if fitted is not None:
            hopeless = min(hopeless, fitted.chi2 + LEAST)
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
    fitted = fit(bench.observation, extension, extension.brought_inside(start), near=base.run)
    causes = tuple(int(suspicion.owner[k]) for k in directions)
    return [explanation_of(causes, base, fitted)] if fitted.converged else []


def with_all_forms(bench: Workbench, found: list[Explanation], *, hopeless: float = np.inf) -> list[Explanation]:
    """Pairs, best first, with all components of their causes; above a chi-square of ``hopeless`` that is of no use."""
    every: dict[frozenset[int], Explanation] = {}
    for pair in sorted(found, key=lambda e: -e.worth):
        if frozenset(pair.causes) not in every:
            every[frozenset(pair.causes)] = with_components(bench, pair, hopeless=hopeless)
    return list(every.values())


def with_components(bench: Workbench, pair: Explanation, *, hopeless: float = np.inf) -> Explanation:
    """A pair with the other components of what it has one of, such as the second one of a load."""
    fitted = pair.fitted
    for term in pair.fitted.extension.terms:
        if term.variant.component:
            fitted = with_all_components(bench.observation, fitted, term, hopeless=hopeless)
    return pair if fitted is pair.fitted else explanation_of(pair.causes, bench.base, fitted)


def in_any_form(bench: Workbench, found: Sequence[Explanation]) -> list[Explanation]:
    """The best two pairs, for the time that takes, with sums of forms, and with profiles of any form."""
    new: list[Explanation] = []
    for pair in sorted(found, key=lambda e: -e.worth)[:2]:
        fitted = [pair.fitted]
        for kind in (bench.suspicion.causes[cause] for cause in pair.causes):
            if isinstance(kind, Profile):
                fitted += free_profile(bench.observation, fitted[-1], kind) if fitted[-1].reduced_chi2 > FITS else []
            elif kind.additive:
                for setting in {term.variant.setting for term in fitted[-1].extension.terms if term.cause is kind}:
                    fitted.append(in_all_forms(bench.observation, fitted[-1], kind, setting))
        new += [explanation_of(pair.causes, bench.base, one) for one in dict.fromkeys(fitted) if one is not pair.fitted]
        new += by_step(bench, explanation_of(pair.causes, bench.base, fitted[-1]))
    return new


def by_step(bench: Workbench, one: Explanation, *, hopeless: float = np.inf) -> list[Explanation]:
    """An explanation with causes (of one form each) that differ from step to step, in one way at a time.

    ``hopeless``: chi-square above which that is of no use.
    """
    known, found = one.fitted.extension, []
    for kind in (bench.suspicion.causes[cause] for cause in one.causes):
        own = known.terms_of(kind)
        for forms in kind.by_step(one.fitted.amount(own[0])[0], bench.facts) if len(own) == 1 else ():
            extension = replace(known, terms=(*known.terms, *(Term(kind, form) for form in forms)))
            start = np.r_[one.fitted.vector, np.zeros(len(forms))]
            fitted = fit(bench.observation, extension, start, near=one.fitted.run, hopeless=hopeless)
            if fitted.run.prediction is not None:
                found.append(explanation_of(one.causes, bench.base, fitted))
    return found

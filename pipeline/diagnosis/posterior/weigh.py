"""From fitted models to hypotheses: each refit weighed at its own fit, causes without one by the linear model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.unnamed import UNNAMED
from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.posterior.error_grid import ErrorGrid
from pipeline.diagnosis.posterior.evidence import Evidence, WithColumn, evidence
from pipeline.diagnosis.posterior.explanation import Explanation
from pipeline.diagnosis.posterior.hypotheses import Hypothesis
from rod.inverse.fit import Fit
from rod.inverse.prediction import Facts


@dataclass(frozen=True, eq=False)
class Weighed:
    """A fit and what the linear model says of each further cause beside it.

    Attributes
    ----------
    own : Evidence
    further : dict of cause -> (plain, rest)
        Mean over the forms of the cause.
    """

    own: Evidence
    further: dict[int, tuple[float, float]]


def weighed(grid: ErrorGrid, fitted: Fit, suspicion: Suspicion | None = None) -> Weighed:
    """Evidence of a fit, and of every cause beside it that ``suspicion``, the scores about it, has forms of."""
    if suspicion is None or not suspicion.terms:
        return Weighed(evidence(grid, fitted)[0], {})
    return of_causes(suspicion, *evidence(grid, fitted, suspicion.terms, suspicion.columns))


def of_causes(suspicion: Suspicion, own: Evidence, added: WithColumn) -> Weighed:
    """From the evidence of forms, each beside a fit, to that of causes."""
    further = {}
    for cause in range(len(suspicion.causes)):
        forms = suspicion.of(cause)
        if forms.size:
            plain, rest = (float(np.logaddexp.reduce(values[forms]) - np.log(forms.size)) for values in added)
            further[cause] = plain, rest
    return Weighed(own, further)


def refitted(grid: ErrorGrid, found: Explanation, facts: Facts) -> Hypothesis:
    """The hypothesis of a refit, its forms one choice of many each; what has no name is something else."""
    own = evidence(grid, found.fitted)[0]
    extension = found.fitted.extension
    unnamed = {cause: found_at[0] for cause in UNNAMED if (found_at := extension.terms_of(cause))}
    causes = [t.cause for t in extension.terms if t.cause not in unnamed and not np.isfinite(t.variant.known)]
    # all components of one thing are one choice
    whole = {t.cause for t in extension.terms if t.variant.component and causes.count(t.cause) > 1}
    tried = sum(_kinds(cause, facts, whole=False) for cause in causes if cause not in whole)
    tried += sum(_kinds(cause, facts, whole=True) for cause in whole)
    if unnamed:
        chances = sum(float(np.log(cause.chance(extension.terms[k].variant, facts))) for cause, k in unnamed.items())
        return Hypothesis(found.causes, -np.inf, own.plain - tried + chances, found)
    return Hypothesis(found.causes, own.plain - tried, own.rest - tried, found)


def _kinds(cause: Cause, facts: Facts, *, whole: bool) -> float:
    """Log of the number of forms of a cause that differ by more than a place; ``whole``: all components are one."""
    labels = {("" if whole and form.component else form.label, form.setting) for form in cause.variants(facts)}
    return float(np.log(max(len(labels), 1)))

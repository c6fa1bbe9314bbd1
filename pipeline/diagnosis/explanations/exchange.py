"""Exchange of the causes of a pair: each is judged rightly beside the right amount of the other alone.

Each cause of the best pair is taken out in turn, everything is scored beside the other as it is there, and what scores
nearly as much is refitted in its place, until no exchange makes the pair better.
"""

from __future__ import annotations

from pipeline.diagnosis.explanations.candidates import candidates
from pipeline.diagnosis.explanations.effort import TO_THE_END, Effort
from pipeline.diagnosis.explanations.pair_fits import settled, with_own_forms
from pipeline.diagnosis.explanations.refit import fit_terms
from pipeline.diagnosis.fits.fit import Fit, evaluated
from pipeline.diagnosis.fits.search import suspect
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.explanation import Explanation, explanation_of

MARGIN, MOST = 0.15, 4
"""Share of the score beside the other cause that a rival may fall short of, and rivals refitted at most; time."""

EXCHANGES = 2
"""Rounds at most; the second is for what the first has put right."""


def exchanged(bench: Workbench, found: list[Explanation], effort: Effort = TO_THE_END) -> list[Explanation]:
    """What comes of exchanging either cause of the best pair, until no exchange makes it better."""
    every, done = list(found), set[frozenset[int]]()
    for _ in range(EXCHANGES):
        best = max(every, key=lambda e: e.worth, default=None)
        if best is None or effort.spent or frozenset(best.causes) in done:
            break
        done.add(frozenset(best.causes))
        if not best.fitted.converged:
            best = settled(bench, best)
            every.append(best)
        for place in (0, 1):
            every += _in_place_of(bench, best, place, effort)
    return every[len(found) :]


def _in_place_of(bench: Workbench, pair: Explanation, place: int, effort: Effort) -> list[Explanation]:
    """The pair with one of its causes replaced by whatever scores nearly as much beside the other."""
    suspicion, other, found = bench.suspicion, pair.causes[1 - place], []
    rest = _without(bench, pair.fitted, pair.causes[place])
    if rest is None:
        return []
    beside = suspect(bench.observation, rest, suspicion.causes)
    if beside.statistic.size == 0:
        return []
    for cause in candidates(beside, margin=MARGIN, most=MOST):
        direction = beside.best(cause)
        if effort.spent:
            break
        if cause in pair.causes or direction is None:
            continue  # itself, or further forms of the other cause: that is a single cause
        fitted = fit_terms(bench.observation, rest, beside, (direction,), hopeless=pair.fitted.chi2)
        if fitted is not None and not fitted.converged:  # kinks: the form as it is scored does not stall
            held = fit_terms(bench.observation, rest, beside, (direction,), hopeless=pair.fitted.chi2, tuned=False)
            fitted = held if held is not None and held.chi2 < fitted.chi2 else fitted
        if fitted is not None:
            causes = (cause, other) if place == 0 else (other, cause)
            new = explanation_of(causes, bench.base, fitted)
            found.append(with_own_forms(bench, new, rival=pair.fitted.chi2))
    return found


def _without(bench: Workbench, fitted: Fit, cause: int) -> Fit | None:
    """The model with a cause taken out and all else left where it is; None where that has no equilibrium."""
    extension, vector = fitted.extension.without(
        fitted.vector, fitted.extension.terms_of(bench.suspicion.causes[cause])
    )
    rest = evaluated(bench.observation, extension, vector, fitted.run)
    return None if rest.run.prediction is None else rest

"""Two causes at once: which pairs are refitted, when one is accepted, and which pairs the data cannot tell from it.

A second cause is asked for where something scores beside the best single cause, or where a pair removes more than any
single cause can on the exhaustive linear search (the best single cause may be neither of two that act together). Two
causes may also hide each other: their scores cancel, and only the best pair stands out (`masking`).

How much a second cause scores says little beside a first that leaves far more than noise, so then every significant one
is tried; to be named it must remove ``pair_share`` in any case. Pairs are fitted (`pair_fits`), their causes exchanged
(`exchange`), the best of them given all forms their causes may have, and those accepted are weighed (`pair_set`).
"""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.causes.law import LAW
from pipeline.diagnosis.causes.profile import is_wave
from pipeline.diagnosis.explanations.effort import TO_THE_END, Effort
from pipeline.diagnosis.explanations.exchange import exchanged
from pipeline.diagnosis.explanations.explanation import Explanation
from pipeline.diagnosis.explanations.free_profile import EACH
from pipeline.diagnosis.explanations.pair_fits import (
    beside_best,
    in_any_form,
    linear_pairs,
    refitted_pairs,
    with_all_forms,
)
from pipeline.diagnosis.explanations.pair_set import TwoCauses, weighed_pairs
from pipeline.diagnosis.fits.bootstrap import widening
from pipeline.diagnosis.fits.search import Suspicion, suspect
from pipeline.diagnosis.fits.workbench import Workbench, scored
from pipeline.diagnosis.statistics.pairs import null_pair_gain
from pipeline.settings.diagnosis import DiagnosisSettings


def second_cause(
    bench: Workbench, singles: list[Explanation], named: set[int], settings: DiagnosisSettings, effort: Effort
) -> tuple[TwoCauses | None, list[int], bool]:
    """Pairs that are significant beyond the best single cause and of which neither half can be dropped.

    Another control point of the law beside a cause is a finer base and no second cause; that pair stands for the cause
    alone, which must then be one of those ``named`` by itself.

    Returns
    -------
    TwoCauses or None
    list of int
        Where a single cause stays more probable: causes of pairs that may stand instead of it.
    bool
        Whether a search for a second cause that something speaks for was ended before its end.
    """
    best = max(singles, key=lambda e: e.gain)
    suspicion = bench.suspicion
    second = suspect(bench.observation, best.fitted, suspicion.causes, visible=settings.visible, trace=settings.trace)
    if second.statistic.size == 0:
        return None, [], False
    limit = scored(bench.test, bench.observation, best.fitted, second, settings).limit
    least = max(limit**2, settings.pair_share * best.gain)
    # forms of a cause that act together, and amounts far from linear, score less than they remove
    settled = best.fitted.reduced_chi2 < settings.fits
    announced = least if settled else limit**2
    linear = linear_pairs(bench, settings)
    beyond = linear[0].gain - max(best.gain, bench.largest**2) if linear else 0.0
    suspected = max(float(second.statistic.max()) ** 2, beyond) > announced
    if not _composed(best) and not suspected:
        return None, [], False
    found = refitted_pairs(bench, linear, settings, hopeless=best.fitted.chi2, effort=effort)
    found += beside_best(bench, best, second, settings)
    found = with_all_forms(bench, found, settings)
    found += in_any_form(bench, found, settings, effort=effort)

    def acceptable(pair: Explanation) -> bool:
        beside_law = [c for c in pair.causes if suspicion.causes[c].name != LAW]
        known = len(beside_law) != 1 or beside_law[0] in named
        possible = pair.impossible(suspicion.causes, settings.impossible) is None
        # a loud cause of not quite the right form leaves some of its trace, but two that leave the noise where none
        # alone does are both needed, however loud the first is
        whole = not settled and pair.fitted.reduced_chi2 < settings.fits
        enough = limit**2 if whole else least
        return known and possible and _both_needed(pair, singles, suspicion, enough, significant=limit**2)

    accepted = [pair for pair in found if acceptable(pair)]
    # beside a single cause that leaves the noise, only pairs that come near it are worth a search
    near = best.fitted.chi2 + settings.refit_least + settings.hopeless * bench.base.chi2 if settled else np.inf
    new = exchanged(bench, [pair for pair in accepted if pair.fitted.chi2 < near], settings, effort)
    new += in_any_form(bench, new, settings, rivals=accepted, effort=effort)
    accepted += [pair for pair in new if acceptable(pair)]
    two, instead = weighed_pairs(bench, accepted, settings, [e for e in singles if _composed(e)])
    return two, instead, suspected and effort.spent


def _composed(single: Explanation) -> bool:
    """Whether a single cause acts in several forms, and so may do what two causes do."""
    return len(single.fitted.extension.terms) > 1


def _both_needed(
    pair: Explanation, singles: list[Explanation], suspicion: Suspicion, least: float, *, significant: float
) -> bool:
    """Whether either half would be missed: beside the other, and against all single causes that are simpler.

    Beside the other it need but be ``significant``: how much it removes there is known from the linear model alone.
    """
    for cause in pair.causes:
        extension = pair.fitted.extension
        at = [extension.amounts_at[k] for k in extension.terms_of(suspicion.causes[cause])]
        amount, covariance = pair.fitted.vector[at], pair.fitted.covariance[np.ix_(at, at)]
        if float(amount @ np.linalg.solve(covariance, amount)) <= significant:
            return False
    refitted = {e.causes[0] for e in singles}
    # waves remove some of any misfit: beside a single cause without them each must pay for itself
    simpler = [
        e.gain + EACH * max(_waves(pair) - _waves(e), 0)
        for e in singles
        if not _composed(e) or e.weighed.tuned < pair.weighed.tuned
    ]
    dear = EACH * _waves(pair)
    simpler += [_linear_gain(suspicion, cause) + dear for cause in pair.causes if cause not in refitted]
    return pair.gain - max(simpler, default=0.0) > least


def _waves(found: Explanation) -> int:
    return sum(is_wave(term.variant) for term in found.fitted.extension.terms)


def masking(bench: Workbench, settings: DiagnosisSettings, effort: Effort = TO_THE_END) -> TwoCauses | None:
    """Two causes of which neither scores because each takes the other's trace away; None where no pair stands out."""
    linear = linear_pairs(bench, settings)
    if not linear or linear[0].gain < settings.masked_least:
        return None
    suspicion = bench.suspicion
    rng = np.random.default_rng(settings.seed)
    limit = null_pair_gain(
        suspicion.scores.unit,
        suspicion.sign,
        suspicion.owner,
        collinear=settings.pair_collinear,
        level=settings.masked_false_alarm,
        draws=settings.masked_draws,
        rng=rng,
    )
    if linear[0].gain <= limit:
        return None
    # where curvature of the base model widens the scores, it does so to both of a pair
    limit *= widening(bench, settings) ** 2
    if linear[0].gain <= limit:
        return None
    found = refitted_pairs(bench, linear, settings, hopeless=bench.base.chi2, effort=effort)
    found = exchanged(bench, found, settings, effort)
    law = [k for k, cause in enumerate(suspicion.causes) if cause.name == LAW]
    found = [e for e in found if e.impossible(suspicion.causes, settings.impossible) is None]
    return weighed_pairs(bench, [e for e in found if e.gain > limit and not set(law) & set(e.causes)], settings, [])[0]


def _linear_gain(suspicion: Suspicion, cause: int) -> float:
    own = suspicion.of(cause)
    return float(np.max(suspicion.statistic[own]) ** 2) if own.size else 0.0

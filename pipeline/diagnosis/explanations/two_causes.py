"""Two causes at once: which pairs are refitted, when one is accepted, and which pairs the data cannot tell from it.

A second cause is asked for where something scores beside the best single cause, or where a pair removes more than any
single cause can on the exhaustive linear search (the best single cause may be neither of two that act together). Two
causes may also hide each other: their scores cancel, and only the best pair stands out (`masking`).

A pair has all forms of its causes, as a single cause has: without its lesser part a load at an angle left a wrong pair
the better one. How much a second cause scores says little beside a first that leaves far more than noise, so then every
significant one is tried; to be named it must remove ``pair_share`` in any case.

The linear search is only a start, since one cause of a pair is judged rightly beside the right amount of the other
alone: each cause of the best pair is taken out in turn, everything is scored beside the other as it is there, and what
scores nearly as much is refitted in its place (`_exchanged`), until no exchange makes the pair better.

Every pair that is accepted for itself is weighed like the single causes are (`verdict.probabilities`); those that
together hold 95 % form the set, and with them every pair that differs by a twin. So each of the two causes has a class
of names: what stands in its place in the pairs of the set.

One cause of several forms may do what two plain ones do (friction between the wires in two elements: friction of the
bearings and set). It has as many free numbers, so a larger gain of either is no proof. Both are weighed, two causes
with a lower probability beforehand, and whichever wins, the other joins the names unless it is improbable. A pair that
removes as much with no more numbers joins them in any case: the data do not speak against it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.explanations.candidates import candidates
from pipeline.diagnosis.explanations.effort import TO_THE_END, Effort
from pipeline.diagnosis.explanations.explanation import Explanation, explanation_of
from pipeline.diagnosis.explanations.forms import with_more_forms
from pipeline.diagnosis.explanations.refit import fit_terms
from pipeline.diagnosis.fits.bootstrap import widening
from pipeline.diagnosis.fits.fit import Fit, evaluated, fit_from
from pipeline.diagnosis.fits.search import Suspicion, suspect
from pipeline.diagnosis.fits.workbench import Workbench, scored
from pipeline.diagnosis.statistics.pairs import Pair, best_pairs, null_pair_gain, pair_gains
from pipeline.diagnosis.statistics.twins import between_causes, cosines
from pipeline.diagnosis.statistics.verdict import credible_set, probabilities, with_twins
from pipeline.settings.diagnosis import DiagnosisSettings

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TwoCauses:
    """Pairs that the data cannot tell apart.

    Attributes
    ----------
    pairs : list of Explanation
        Most probable first; the causes of each in the order of the first one's: what stands for what.
    probability : list of float
        Of each, given that it is one of them or one of ``alone``.
    alone : tuple of int
        Causes of several forms that may stand for both.
    """

    pairs: list[Explanation]
    probability: list[float]
    alone: tuple[int, ...] = ()

    def names(self, place: int) -> list[int]:
        """Causes that may stand at a place (0 or 1), the most probable pair's first."""
        return list(dict.fromkeys([*(pair.causes[place] for pair in self.pairs), *self.alone]))

    def chance(self, cause: int) -> float:
        """Probability of the pairs a cause is part of."""
        return sum(p for p, pair in zip(self.probability, self.pairs, strict=True) if cause in pair.causes)


def second_cause(
    bench: Workbench, singles: list[Explanation], named: set[int], settings: DiagnosisSettings, effort: Effort
) -> tuple[TwoCauses | None, list[int]]:
    """Pairs that are significant beyond the best single cause and of which neither half can be dropped.

    Another control point of the law beside a cause is a finer base and no second cause; that pair stands for the cause
    alone, which must then be one of those ``named`` by itself.

    Returns
    -------
    TwoCauses or None
    list of int
        Where a single cause stays more probable: causes of pairs that may stand instead of it.
    """
    best = max(singles, key=lambda e: e.gain)
    suspicion = bench.suspicion
    second = suspect(bench.observation, best.fitted, suspicion.causes, visible=settings.visible, trace=settings.trace)
    if second.statistic.size == 0:
        return None, []
    limit = scored(bench.test, bench.observation, best.fitted, second, settings).limit
    least = max(limit**2, settings.pair_share * best.gain)
    # forms of a cause that act together, and amounts far from linear, score less than they remove
    settled = best.fitted.reduced_chi2 < settings.fits
    announced = least if settled else limit**2
    linear = _linear_pairs(bench, settings)
    beyond = linear[0].gain - max(best.gain, bench.largest**2) if linear else 0.0
    if not _composed(best) and max(float(second.statistic.max()) ** 2, beyond) <= announced:
        return None, []
    found = _refitted(bench, linear, settings, hopeless=best.fitted.chi2, effort=effort)
    found += _beside(bench, best, second, settings)
    found = _with_all_forms(bench, found, settings)

    def acceptable(pair: Explanation) -> bool:
        beside_law = [c for c in pair.causes if suspicion.causes[c].name != "nonlinear_stiffness"]
        known = len(beside_law) != 1 or beside_law[0] in named
        possible = pair.impossible(suspicion.causes, settings.impossible) is None
        # a loud cause of not quite the right form leaves some of its trace, but two that leave the noise where none
        # alone does are both needed, however loud the first is
        whole = not settled and pair.fitted.reduced_chi2 < settings.fits
        enough = limit**2 if whole else least
        return known and possible and _both_needed(pair, singles, suspicion, enough, significant=limit**2)

    accepted = [pair for pair in found if acceptable(pair)]
    accepted += [pair for pair in _exchanged(bench, accepted, settings, effort) if acceptable(pair)]
    return _weighed(bench, accepted, settings, [e for e in singles if _composed(e)])


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
    simpler = [e.gain for e in singles if not _composed(e) or e.weighed.tuned < pair.weighed.tuned]
    simpler += [_linear_gain(suspicion, cause) for cause in pair.causes if cause not in refitted]
    return pair.gain - max(simpler, default=0.0) > least


def masking(bench: Workbench, settings: DiagnosisSettings, effort: Effort = TO_THE_END) -> TwoCauses | None:
    """Two causes of which neither scores because each takes the other's trace away; None where no pair stands out."""
    linear = _linear_pairs(bench, settings)
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
    found = _refitted(bench, linear, settings, hopeless=bench.base.chi2, effort=effort)
    found = _exchanged(bench, found, settings, effort)
    law = [k for k, cause in enumerate(suspicion.causes) if cause.name == "nonlinear_stiffness"]
    found = [e for e in found if e.impossible(suspicion.causes, settings.impossible) is None]
    return _weighed(bench, [e for e in found if e.gain > limit and not set(law) & set(e.causes)], settings, [])[0]


def _linear_pairs(bench: Workbench, settings: DiagnosisSettings) -> list[Pair]:
    """Best pairs of the exhaustive linear search about the base model that are worth a refit."""
    suspicion = bench.suspicion
    cosine = cosines(suspicion.scores.unit)
    gains = pair_gains(suspicion.scores.z, cosine, suspicion.sign, suspicion.owner, collinear=settings.pair_collinear)
    pairs = best_pairs(gains, suspicion.owner, count=settings.pairs_refitted)
    least = pairs[0].gain - max(settings.refit_least, settings.refit_margin * pairs[0].gain) if pairs else 0.0
    return [pair for pair in pairs if pair.gain > least]


def _linear_gain(suspicion: Suspicion, cause: int) -> float:
    own = suspicion.of(cause)
    return float(np.max(suspicion.statistic[own]) ** 2) if own.size else 0.0


def _refitted(
    bench: Workbench,
    pairs: list[Pair],
    settings: DiagnosisSettings,
    *,
    hopeless: float,
    effort: Effort = TO_THE_END,
) -> list[Explanation]:
    """The pairs, fitted in full from their linear amounts; the best two in any case."""
    suspicion, found = bench.suspicion, []
    z, norm, unit = suspicion.scores.z, suspicion.scores.norm, suspicion.scores.unit
    for rank, pair in enumerate(pairs):
        if rank > 1 and effort.spent:
            break
        one, other = pair.first, pair.second
        c = float(unit[:, one] @ unit[:, other])
        amounts = tuple(
            float((z[own] - c * z[rest]) / (1.0 - c * c) / norm[own]) for own, rest in ((one, other), (other, one))
        )
        fitted = fit_terms(
            bench.observation, bench.base, suspicion, (one, other), settings, amounts=amounts, hopeless=hopeless
        )
        if fitted is not None:
            causes = (int(suspicion.owner[one]), int(suspicion.owner[other]))
            found.append(explanation_of(causes, bench.base, fitted, suspicion))
    return found


def _beside(bench: Workbench, best: Explanation, second: Suspicion, settings: DiagnosisSettings) -> list[Explanation]:
    """The best single cause with each of the two that score most beside it."""
    found = []
    for cause in candidates(second, settings)[:2]:
        direction = second.best(cause)
        if cause == best.causes[0] or direction is None:
            continue
        fitted = fit_terms(bench.observation, best.fitted, second, (direction,), settings)
        if fitted is not None:
            found.append(explanation_of((best.causes[0], cause), bench.base, fitted, bench.suspicion))
    return found


def _with_all_forms(bench: Workbench, found: list[Explanation], settings: DiagnosisSettings) -> list[Explanation]:
    """The pairs with further forms of their causes, the best first; one that stays far above it is left as it is.

    A load at an angle to the chord is no better than half of itself beside another cause, as it is alone.
    """
    every: dict[frozenset[int], Explanation] = {}
    for pair in sorted(found, key=lambda e: -_worth(e)):
        if frozenset(pair.causes) not in every:
            rival = min((e.fitted.chi2 for e in every.values()), default=np.inf)
            every[frozenset(pair.causes)] = _with_own_forms(bench, pair, settings, rival=rival)
    return list(every.values())


def _with_own_forms(bench: Workbench, pair: Explanation, settings: DiagnosisSettings, *, rival: float) -> Explanation:
    """A pair with further forms of its causes, as far as they can bring it near a rival's chi-square.

    Of causes whose forms are directions (a load, a tilt); a form with a place of its own is tuned instead.
    """
    fitted, hopeless, facts = pair.fitted, rival + settings.refit_least, bench.facts
    for kind in (bench.suspicion.causes[cause] for cause in pair.causes):
        if not kind.combines or any(form.tuned for form in kind.variants(facts)):
            continue
        for setting in {term.variant.setting for term in fitted.extension.terms if term.cause is kind}:
            fitted = with_more_forms(bench.observation, fitted, kind, setting, settings, hopeless=hopeless)
    return pair if fitted is pair.fitted else explanation_of(pair.causes, bench.base, fitted, bench.suspicion)


def _exchanged(
    bench: Workbench, found: list[Explanation], settings: DiagnosisSettings, effort: Effort = TO_THE_END
) -> list[Explanation]:
    """What comes of exchanging either cause of the best pair, until no exchange makes it better."""
    every, done = list(found), set[frozenset[int]]()
    for _ in range(EXCHANGES):
        best = max(every, key=_worth, default=None)
        if best is None or effort.spent or frozenset(best.causes) in done:
            break
        done.add(frozenset(best.causes))
        if not best.fitted.converged:
            best = _settled(bench, best, settings)
            every.append(best)
        for place in (0, 1):
            every += _in_place_of(bench, best, place, settings, effort)
    return every[len(found) :]


def _settled(bench: Workbench, pair: Explanation, settings: DiagnosisSettings) -> Explanation:
    """A pair whose fit ran out of steps, fitted on from where it stands: beside a half-way cause scores mislead."""
    fitted = pair.fitted
    for _ in range(ATTEMPTS):
        further = fit_from(bench.observation, fitted.extension, fitted.vector, fitted, settings)
        gained, fitted = fitted.chi2 - further.chi2, further
        if fitted.converged or gained < settings.shape_gain:
            break
    return explanation_of(pair.causes, bench.base, fitted, bench.suspicion)


ATTEMPTS = 3
"""Fits at most that go on where the last one ran out of steps."""

EXCHANGES = 2
"""Rounds at most; the second is for what the first has put right."""


def _worth(explanation: Explanation) -> float:
    """Logarithm of its weight, as far as fit and free numbers go."""
    return 0.5 * explanation.gain - explanation.weighed.tuned


def _in_place_of(
    bench: Workbench, pair: Explanation, place: int, settings: DiagnosisSettings, effort: Effort
) -> list[Explanation]:
    """The pair with one of its causes replaced by whatever scores nearly as much beside the other."""
    suspicion, other, found = bench.suspicion, pair.causes[1 - place], []
    rest = _without(bench, pair.fitted, pair.causes[place])
    if rest is None:
        return []
    beside = suspect(bench.observation, rest, suspicion.causes, visible=settings.visible, trace=settings.trace)
    if beside.statistic.size == 0:
        return []
    near = settings.model_copy(update={"refit_margin": settings.exchange_margin, "refit_most": settings.exchange_most})
    for cause in candidates(beside, near):
        direction = beside.best(cause)
        if effort.spent:
            break
        if cause in pair.causes or direction is None:
            continue  # itself, or further forms of the other cause: that is a single cause
        fitted = fit_terms(bench.observation, rest, beside, (direction,), settings, hopeless=pair.fitted.chi2)
        if fitted is not None and not fitted.converged:  # kinks: the form as it is scored does not stall
            held = fit_terms(
                bench.observation, rest, beside, (direction,), settings, hopeless=pair.fitted.chi2, tuned=False
            )
            fitted = held if held is not None and held.chi2 < fitted.chi2 else fitted
        if fitted is not None:
            causes = (cause, other) if place == 0 else (other, cause)
            new = explanation_of(causes, bench.base, fitted, suspicion)
            found.append(_with_own_forms(bench, new, settings, rival=pair.fitted.chi2))
    return found


def _without(bench: Workbench, fitted: Fit, cause: int) -> Fit | None:
    """The model with a cause taken out and all else left where it is; None where that has no equilibrium."""
    extension, vector = fitted.extension.without(
        fitted.vector, fitted.extension.terms_of(bench.suspicion.causes[cause])
    )
    rest = evaluated(bench.observation, extension, vector, fitted.run)
    return None if rest.run.prediction is None else rest


def _weighed(
    bench: Workbench, found: list[Explanation], settings: DiagnosisSettings, singles: list[Explanation]
) -> tuple[TwoCauses | None, list[int]]:
    """The set of pairs, each pair of causes once, by its best fit; and what may stand instead, see `second_cause`.

    ``singles`` are the causes of several forms that may do what two do.
    """
    best: dict[frozenset[int], Explanation] = {}
    for pair in sorted(found, key=lambda e: -_worth(e)):
        best.setdefault(frozenset(pair.causes), pair)
    if not best:
        return None, []
    pairs = list(best.values())
    every = [*pairs, *singles]
    freedom = max(len(bench.base.residual) - bench.base.extension.size, 1)
    weight = probabilities(
        [e.weighed for e in every],
        reduced_chi2=min(e.fitted.chi2 for e in every) / freedom,
        implausible=settings.implausible,
    )
    weight = weight * np.where(np.arange(len(every)) < len(pairs), settings.pair_prior, 1.0)
    weight /= weight.sum()
    members = credible_set(weight, level=settings.set_level)
    if float(weight[: len(pairs)].sum()) < 0.5:
        instead = [*(pairs[k] for k in members if k < len(pairs)), *_as_good(pairs, every[members[0]], settings)]
        return None, list(dict.fromkeys(cause for pair in instead for cause in pair.causes))
    alone = tuple(dict.fromkeys(every[k].causes[0] for k in members if k >= len(pairs)))
    suspicion = bench.suspicion
    closeness = between_causes(cosines(suspicion.scores.unit), suspicion.owner, len(suspicion.causes))
    own = weight[: len(pairs)]
    members = [k for k in members if k < len(pairs)]
    first = pairs[members[0]]
    pairs = [_in_order(pair, first, closeness) for pair in pairs]
    alike = np.array([min(closeness[a, b] for a, b in zip(pair.causes, first.causes, strict=True)) for pair in pairs])
    gain = np.array([pair.gain for pair in pairs])
    members = with_twins(members, own, gain, alike, cosine=settings.twin_cosine, margin=settings.twin_margin)
    share = own[members] / (own[members].sum() + weight[len(pairs) :].sum())
    return TwoCauses([pairs[k] for k in members], share.tolist(), alone), []


def _as_good(pairs: list[Explanation], single: Explanation, settings: DiagnosisSettings) -> list[Explanation]:
    """Pairs that remove as much as a single cause of several forms with no more numbers: only a prior is against it."""
    return [
        pair
        for pair in pairs
        if pair.gain > single.gain - settings.twin_margin and pair.weighed.tuned <= single.weighed.tuned
    ]


def _in_order(pair: Explanation, first: Explanation, closeness: Array) -> Explanation:
    """The pair with each cause at the place of the one it stands for in ``first``."""
    (a, b), (c, d) = first.causes, pair.causes
    crossed = closeness[a, d] + closeness[b, c] > closeness[a, c] + closeness[b, d]
    same = (a == c) + (b == d) - (a == d) - (b == c)  # a name they share keeps its place, however close the others are
    return replace(pair, causes=(d, c)) if same < 0 or (same == 0 and crossed) else pair

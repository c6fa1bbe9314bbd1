"""Two causes at once: which pairs are refitted, when one is accepted, and which pairs the data cannot tell from it.

A second cause is asked for where something scores beside the best single cause, or where a pair removes more than any
single cause can on the exhaustive linear search (the best single cause may be neither of two that act together). Two
causes may also hide each other: their scores cancel, and only the best pair stands out (`masking`).

Every pair that is accepted for itself is weighed like the single causes are (`verdict.probabilities`); those that
together hold 95 % form the set, and with them every pair that differs by a twin. So each of the two causes has a class
of names: what stands in its place in the pairs of the set.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.explanation import Explanation, candidates, explanation_of, fit_terms
from pipeline.diagnosis.pairs import Pair, best_pairs, null_pair_gain, pair_gains
from pipeline.diagnosis.search import Suspicion, suspect
from pipeline.diagnosis.twins import between_causes, cosines
from pipeline.diagnosis.verdict import credible_set, probabilities, with_twins
from pipeline.diagnosis.workbench import Workbench, scored
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
        Of each, given that it is one of them.
    """

    pairs: list[Explanation]
    probability: list[float]

    def names(self, place: int) -> list[int]:
        """Causes that may stand at a place (0 or 1), the most probable pair's first."""
        return list(dict.fromkeys(pair.causes[place] for pair in self.pairs))

    def chance(self, cause: int) -> float:
        """Probability of the pairs a cause is part of."""
        return sum(p for p, pair in zip(self.probability, self.pairs, strict=True) if cause in pair.causes)


def second_cause(
    bench: Workbench, singles: list[Explanation], named: set[int], settings: DiagnosisSettings
) -> TwoCauses | None:
    """Pairs that are significant beyond the best single cause and of which neither half can be dropped.

    Another control point of the law beside a cause is a finer base and no second cause; that pair stands for the cause
    alone, which must then be one of those ``named`` by itself.
    """
    best = max(singles, key=lambda e: e.gain)
    suspicion = bench.suspicion
    second = suspect(bench.observation, best.fitted, suspicion.causes, visible=settings.visible, trace=settings.trace)
    if second.statistic.size == 0:
        return None
    limit = scored(bench.test, bench.observation, best.fitted, second, settings).limit
    least = max(limit**2, settings.pair_share * best.gain)
    linear = _linear_pairs(bench, settings)
    beyond = linear[0].gain - max(best.gain, bench.largest**2) if linear else 0.0
    if max(float(second.statistic.max()) ** 2, beyond) <= least:
        return None
    found = _refitted(bench, linear, settings, hopeless=best.fitted.chi2)
    found += _beside(bench, best, second, settings)
    alone = {e.causes[0]: e.gain for e in singles}
    accepted = []
    for pair in found:
        beside_law = [c for c in pair.causes if suspicion.causes[c].name != "nonlinear_stiffness"]
        if len(beside_law) == 1 and beside_law[0] not in named:
            continue
        others = [alone.get(cause, _linear_gain(suspicion, cause)) for cause in pair.causes]
        if pair.gain - max(best.gain, *others) > least:
            accepted.append(pair)
    return _weighed(bench, accepted, settings)


def masking(bench: Workbench, settings: DiagnosisSettings) -> TwoCauses | None:
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
    found = _refitted(bench, linear, settings, hopeless=bench.base.chi2)
    law = [k for k, cause in enumerate(suspicion.causes) if cause.name == "nonlinear_stiffness"]
    return _weighed(bench, [e for e in found if e.gain > limit and not set(law) & set(e.causes)], settings)


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
    bench: Workbench, pairs: list[Pair], settings: DiagnosisSettings, *, hopeless: float
) -> list[Explanation]:
    """The pairs, fitted in full from their linear amounts."""
    suspicion, found = bench.suspicion, []
    z, norm, unit = suspicion.scores.z, suspicion.scores.norm, suspicion.scores.unit
    for pair in pairs:
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


def _weighed(bench: Workbench, found: list[Explanation], settings: DiagnosisSettings) -> TwoCauses | None:
    """The set of pairs, each pair of causes once, by its best fit."""
    best: dict[frozenset[int], Explanation] = {}
    for pair in sorted(found, key=lambda e: -e.gain):
        best.setdefault(frozenset(pair.causes), pair)
    if not best:
        return None
    pairs = list(best.values())
    freedom = max(len(bench.base.residual) - bench.base.extension.size, 1)
    weight = probabilities(
        [e.weighed for e in pairs], reduced_chi2=pairs[0].fitted.chi2 / freedom, implausible=settings.implausible
    )
    suspicion = bench.suspicion
    closeness = between_causes(cosines(suspicion.scores.unit), suspicion.owner, len(suspicion.causes))
    members = credible_set(weight, level=settings.set_level)
    first = pairs[members[0]]
    pairs = [_in_order(pair, first, closeness) for pair in pairs]
    alike = np.array([min(closeness[a, b] for a, b in zip(pair.causes, first.causes, strict=True)) for pair in pairs])
    gain = np.array([pair.gain for pair in pairs])
    members = with_twins(members, weight, gain, alike, cosine=settings.twin_cosine, margin=settings.twin_margin)
    share = weight[members] / weight[members].sum()
    return TwoCauses([pairs[k] for k in members], share.tolist())


def _in_order(pair: Explanation, first: Explanation, closeness: Array) -> Explanation:
    """The pair with each cause at the place of the one it stands for in ``first``."""
    (a, b), (c, d) = first.causes, pair.causes
    crossed = closeness[a, d] + closeness[b, c] > closeness[a, c] + closeness[b, d]
    same = (a == c) + (b == d) - (a == d) - (b == c)  # a name they share keeps its place, however close the others are
    return replace(pair, causes=(d, c)) if same < 0 or (same == 0 and crossed) else pair

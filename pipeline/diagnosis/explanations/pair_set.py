"""The set of pairs that the data cannot tell apart, and whether a single cause of several forms stands for both.

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

from pipeline.diagnosis.explanations.explanation import Explanation
from pipeline.diagnosis.explanations.pair_fits import worth
from pipeline.diagnosis.fits.workbench import Workbench
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


def weighed_pairs(
    bench: Workbench, found: list[Explanation], settings: DiagnosisSettings, singles: list[Explanation]
) -> tuple[TwoCauses | None, list[int]]:
    """The set of pairs, each pair of causes once, by its best fit; and what may stand instead, see `second_cause`.

    ``singles`` are the causes of several forms that may do what two do.
    """
    best: dict[frozenset[int], Explanation] = {}
    for pair in sorted(found, key=lambda e: -worth(e)):
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

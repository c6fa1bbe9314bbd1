"""What was concluded about one specimen, before it is put into words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.diagnosis.explanations.search import Search
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.error_grid import ErrorGrid
from pipeline.diagnosis.posterior.explanation import Explanation
from pipeline.diagnosis.posterior.hypotheses import Posterior
from rod.inverse.fit import Fit


@dataclass(frozen=True, eq=False)
class Conclusion:
    """What was concluded, before it is put into words.

    Attributes
    ----------
    posterior : Posterior
        Probabilities of all hypotheses.
    grid : ErrorGrid
        Error models that were integrated over.
    accepted : Explanation or None
        What the model is extended by: the likeliest cause or pair; where something else is likelier, the nearest one.
    classes : tuple of tuple of int
        For each of its causes the names that may stand in its place, itself first.
    unmodelled : bool
        Whether something is likelier that no cause of the catalogue makes.
    """

    posterior: Posterior
    grid: ErrorGrid
    accepted: Explanation | None
    classes: tuple[tuple[int, ...], ...]
    unmodelled: bool

    def fitted(self, bench: Workbench) -> Fit:
        """The model that was concluded: extended where something was accepted, else the base model."""
        return bench.base if self.accepted is None else self.accepted.fitted

    @property
    def singles(self) -> list[Explanation]:
        """Single causes that were refitted, most probable first."""
        return [one.found for one in self.posterior.explanations(count=1) if one.found is not None]

    @property
    def rivals(self) -> list[Explanation]:
        """Other refits that these data cannot tell from the accepted one."""
        own = None if self.accepted is None else set(self.accepted.causes)
        return [one.found for one in self.posterior.credible() if one.found and set(one.causes) != own]


def conclusion_of(bench: Workbench, search: Search) -> Conclusion:
    """The conclusion that the hypotheses of a search allow."""
    believed = search.posterior
    word = believed.word
    if word == "base":
        return Conclusion(believed, search.grid, None, (), unmodelled=False)
    unmodelled = believed.unexplained
    count = 2 if believed.total(count=2, something_else=False) > believed.total(count=1, something_else=False) else 1
    refits = believed.beside_something_else() if unmodelled else believed.explanations(count=count)
    first = next(iter(refits), None)
    accepted = None if first is None else first.found
    if accepted is None or unmodelled:
        alone = () if accepted is None else tuple((cause,) for cause in accepted.causes)
        return Conclusion(believed, search.grid, accepted, alone, unmodelled=True)
    classes = _classes(bench, believed, accepted)
    return Conclusion(believed, search.grid, accepted, classes, unmodelled=False)


def _classes(bench: Workbench, believed: Posterior, accepted: Explanation) -> tuple[tuple[int, ...], ...]:
    """Names that may stand for each cause of the accepted explanation, from the credible set.

    In another pair each cause stands for the one it is closer to; a single cause stands for both of a pair, and the
    closer one of a pair for a single cause. A set that holds the accepted causes and another one says nothing against
    them.
    """
    close = bench.suspicion.closeness()
    np.fill_diagonal(close, 2.0)
    places: list[list[int]] = [[cause] for cause in accepted.causes]
    for other in believed.credible():
        if set(accepted.causes) < set(other.causes):
            continue
        if len(places) == 1 or len(other.causes) == 1:
            for place, own in zip(places, accepted.causes, strict=True):
                place.append(max(other.causes, key=lambda cause: close[own, cause]))
            continue
        (a, b), (c, d) = accepted.causes, other.causes
        straight = close[a, c] + close[b, d] >= close[a, d] + close[b, c]
        for place, cause in zip(places, (c, d) if straight else (d, c), strict=True):
            place.append(cause)
    return tuple(tuple(dict.fromkeys(place)) for place in places)

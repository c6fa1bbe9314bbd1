"""What is believed: probabilities of all hypotheses about one specimen, each with and without something else besides.

    hypothesis                      beforehand   what it says
    base                            0.55         the simulation is right
    one cause                       0.30         shared by all causes the data can show, and by the forms of each
    two causes                      0.06         shared by all pairs
    something else                  0.05         none of these: what no cause makes (see `error_grid`)
    one cause and something else    0.03
    two causes and something else   0.01

The probability of each is that share times its evidence (`evidence`): at its own refit where it has one, else by the
linear model about the base, the mean over the forms of the cause. What acts on the cable and has no name
(`causes.unnamed`) is something else that is refitted. Ten times another share changes few words: with base 0.8 three
more real effects of 59 stay silent, with 0.3 three nulls of 36 get a name.

What is said is something else where that is likelier than not, else the likelier of the base model and causes of the
catalogue. Beside causes each of which is there at 95 % something else is told from 95 % on: below, these may be all.
Among causes that the data make likelier than the base model, the smallest set that holds 95 % of their probability
cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.posterior.explanation import Explanation
from rod.inverse.extension import Term

Word = Literal["base", "causes", "rest"]

SHARES = {0: (0.55, 0.05), 1: (0.30, 0.03), 2: (0.06, 0.01)}
"""Probability beforehand by the number of causes, without and with something else."""

LEVEL = 0.95
"""Probability that a set of names holds."""


ALIKE = 0.1
"""Log evidence: what exceeds the base model's by less is no likelier. Causes that the data cannot show have the same as
the base model but for rounding."""


class Hypothesis(NamedTuple):
    """Causes (indices of the catalogue) with log evidence, ``plain`` and with something else; ``found``: the refit."""

    causes: tuple[int, ...]
    plain: float
    rest: float
    found: Explanation | None = None

    @property
    def terms(self) -> tuple[Term, ...]:
        """Of the refit."""
        return self.found.fitted.extension.terms if self.found else ()


class Believed(NamedTuple):
    """A hypothesis with its probability, and by how much its log evidence exceeds that of the base model."""

    causes: tuple[int, ...]
    something_else: bool
    probability: float
    gain: float
    found: Explanation | None


@dataclass(frozen=True, eq=False)
class Posterior:
    """All hypotheses, most probable first; probabilities sum to 1."""

    believed: tuple[Believed, ...]

    def total(self, *, count: int | None = None, something_else: bool | None = None) -> float:
        """Probability of all with so many causes (any if None), with or without something else (either if None)."""
        return sum(
            one.probability
            for one in self.believed
            if count in (None, len(one.causes)) and something_else in (None, one.something_else)
        )

    @property
    def word(self) -> Word:
        """What is likelier than not, or likelier than the other of base model and causes."""
        base, rest = self.total(count=0, something_else=False), self.total(something_else=True)
        return "rest" if rest >= 0.5 else "base" if base >= 1.0 - base - rest else "causes"

    @property
    def unexplained(self) -> bool:
        """Whether something else is told: where that is the word; beside causes that are surely there, surely too."""
        alone = next((one.causes for one in self.believed if one.causes and not one.something_else), ())
        there = [sum(one.probability for one in self.believed if cause in one.causes) for cause in alone]
        rest = self.total(something_else=True)
        return self.word == "rest" and (rest >= LEVEL or min(there, default=0.0) < LEVEL)

    def of(self, cause: int) -> float:
        """Probability of all that hold a cause and nothing else."""
        return sum(one.probability for one in self.believed if cause in one.causes and not one.something_else)

    def explanations(self, *, count: int | None = None) -> list[Believed]:
        """Refitted causes without something else, most probable first; so many of them if asked."""
        return [
            one
            for one in self.believed
            if one.found is not None and not one.something_else and count in (None, len(one.causes))
        ]

    def beside_something_else(self) -> list[Believed]:
        """Refitted causes beside something else, most probable first."""
        return [one for one in self.believed if one.found is not None and one.something_else]

    def credible(self) -> list[Believed]:
        """The smallest set of causes, without something else, that holds 95 % of the probability of all these.

        What the data make no likelier than the base model is no name for what was found. The likeliest causes come
        first, and with them all that hold them and another one: these say nothing against them.
        """
        named = [one for one in self.believed if one.causes and not one.something_else and one.gain > ALIKE]
        likeliest = [one for one in named if set(named[0].causes) <= set(one.causes)]
        enough, whole, found = 0.0, sum(one.probability for one in named), list[Believed]()
        for one in dict.fromkeys([*likeliest, *named]):
            found.append(one)
            enough += one.probability
            if enough >= LEVEL * whole:
                break
        return found


def posterior(hypotheses: Sequence[Hypothesis], causes: Sequence[Cause]) -> Posterior:
    """Probabilities of hypotheses; of several about the same causes the likeliest refit counts, unnamed ones apart.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        With the base model, which has no causes.
    causes : sequence of Cause
        That share what is given to one cause, and to pairs, beforehand.
    """
    best: dict[tuple[frozenset[int], bool, Explanation | None], tuple[bool, float, Hypothesis]] = {}
    for one in hypotheses:
        unnamed = one.found if one.found is not None and one.found.unnamed else None
        for something_else, value in ((False, one.plain), (True, one.rest)):
            key = frozenset(one.causes), something_else, unnamed
            found = one.found is not None or not one.causes, value, one
            if np.isfinite(value) and (key not in best or found[:2] > best[key][:2]):
                best[key] = found
    many = max(len(causes), 1)
    ways = {0: 1, 1: many, 2: max(many * (many - 1) // 2, 1)}
    base, rows = next(one.plain for one in hypotheses if not one.causes), []
    for (_, something_else, _), (_, value, one) in best.items():
        share = SHARES[len(one.causes)][something_else] / ways[len(one.causes)]
        rows.append((value + np.log(share), value - base, one, something_else))
    top = max(value for value, *_ in rows)
    weights = [float(np.exp(value - top)) for value, *_ in rows]
    whole = sum(weights)
    believed = [
        Believed(one.causes, something_else, weight / whole, gain, one.found)
        for weight, (_, gain, one, something_else) in zip(weights, rows, strict=True)
    ]
    return Posterior(tuple(sorted(believed, key=lambda one: -one.probability)))

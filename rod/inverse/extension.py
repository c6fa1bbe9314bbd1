"""The model that is fitted: the base model with causes added to it as terms, and how its parameter vector is laid out.

The vector holds the parameters of the base model first (see `base`), then the numbers of each term: its amount,
and whatever of its form (place, width) is tuned along. What a term does to the model is the business of its cause; here
is only which number goes where, and how far it may go.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rod.array import Array
from rod.inverse.base import Base
from rod.inverse.cause import Cause, Variant
from rod.inverse.prediction import Facts, Model, end_for_end

STEP = 1e-3
"""Of a plausible amount, or of the range of a place: step of a difference quotient."""


class Term(NamedTuple):
    """A cause in one of its forms."""

    cause: Cause
    variant: Variant

    @property
    def size(self) -> int:
        """How many numbers it has in the vector."""
        return 1 + len(self.variant.tuned)

    @property
    def sign(self) -> int:
        """1 if its amount cannot be negative; what is known beforehand lies to both sides of zero."""
        return 0 if np.isfinite(self.variant.known) else self.cause.sign

    def numbers(self, amount: float) -> Array:
        """Its numbers (size,) in the vector at an amount, the form as it is."""
        return np.array([amount, *(self.variant.number(name) for name in self.variant.tuned)])


@dataclass(frozen=True, eq=False)
class Extension:
    """Base model and the terms added to it; ``turned``: with the cable turned end for end."""

    base: Base
    facts: Facts
    terms: tuple[Term, ...] = ()
    turned: bool = False

    @cached_property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.base.names) + sum(term.size for term in self.terms)

    @cached_property
    def amounts_at(self) -> tuple[int, ...]:
        """Position in the vector of each term's amount; the numbers of its form follow."""
        sizes = [term.size for term in self.terms]
        return tuple(len(self.base.names) + sum(sizes[:k]) for k in range(len(sizes)))

    def terms_of(self, cause: Cause) -> list[int]:
        """Which terms are forms of a cause."""
        return [k for k, term in enumerate(self.terms) if term.cause is cause]

    @cached_property
    def places(self) -> tuple[tuple[int, float, float], ...]:
        """Position in the vector of every number of a form that is tuned; middle and standard deviation of its range.

        Anywhere in its range is as likely.
        """
        found = []
        for at, term in zip(self.amounts_at, self.terms, strict=True):
            for j, name in enumerate(term.variant.tuned, start=at + 1):
                low, high = term.variant.range(name)
                found.append((j, 0.5 * (low + high), (high - low) / np.sqrt(12.0)))
        return tuple(found)

    @cached_property
    def prior(self) -> Array:
        """Rows (m, p) of prior knowledge, of unit variance: those of the base model, then of the amounts of terms."""
        rows = self.base.prior
        own = [np.hstack([rows, np.zeros((len(rows), self.size - rows.shape[1]))])]
        for at, term in zip(self.amounts_at, self.terms, strict=True):
            if np.isfinite(term.variant.known):
                own.append(np.eye(1, self.size, at) / (term.variant.known * term.cause.plausible(self.facts)))
        return np.vstack(own)

    @cached_property
    def steps(self) -> Array:
        """Steps (p,) of difference quotients."""
        added: list[float] = []
        for term in self.terms:
            added.append(STEP * term.cause.plausible(self.facts))
            added.extend(STEP * term.variant.scale(name) for name in term.variant.tuned)
        return np.asarray(np.r_[self.base.steps(self.facts), added])

    def start(self, vector: Array, amounts: tuple[float, ...]) -> Array:
        """Vector of this extension from one of the base model and an amount for each term."""
        numbers = [term.numbers(amount) for term, amount in zip(self.terms, amounts, strict=True)]
        return np.concatenate([vector[: len(self.base.names)], *numbers])

    def without(self, vector: Array, gone: Collection[int]) -> tuple[Extension, Array]:
        """The model without some of its terms, and its vector with all other numbers where they were."""
        numbers = [
            np.arange(at, at + term.size)
            for k, (at, term) in enumerate(zip(self.amounts_at, self.terms, strict=True))
            if k in gone
        ]
        kept = tuple(term for k, term in enumerate(self.terms) if k not in gone)
        return replace(self, terms=kept), np.delete(vector, np.concatenate(numbers)) if numbers else vector.copy()

    def base_model(self, vector: Array) -> Model:
        """The base model at a vector, without the terms."""
        return self.base.model(vector[: len(self.base.names)], steps=len(self.facts.branch))

    def model(self, vector: Array, *, of: Model | None = None) -> Model:
        """The model at a vector; ``of`` is the base model there, where it is known already."""
        model = self.base_model(vector) if of is None else of
        for k, (at, term) in enumerate(zip(self.amounts_at, self.terms, strict=True)):
            model = term.cause.apply(model, float(vector[at]), self.formed(vector, k).variant, self.facts)
        return end_for_end(model) if self.turned else model

    def formed(self, vector: Array, k: int) -> Term:
        """Term ``k`` with its place and width as they stand in the vector."""
        term, at = self.terms[k], self.amounts_at[k]
        tuned = {name: float(vector[at + 1 + j]) for j, name in enumerate(term.variant.tuned)}
        return term._replace(variant=term.variant.moved(tuned))

    def admissible(self, vector: Array) -> bool:
        """Whether the vector describes a possible cable: base model, signs of amounts and places within their range."""
        if not self.base.admissible(vector[: len(self.base.names)]):
            return False
        for at, term in zip(self.amounts_at, self.terms, strict=True):
            if term.sign * vector[at] < 0.0:
                return False
            for j, name in enumerate(term.variant.tuned):
                low, high = term.variant.range(name)
                if not low <= vector[at + 1 + j] <= high:
                    return False
        return True

    def brought_inside(self, vector: Array) -> Array:
        """The vector (p,) with amounts of a wrong sign at zero and places at the end of the range they have left."""
        inside = vector.copy()
        for at, term in zip(self.amounts_at, self.terms, strict=True):
            if term.sign:
                inside[at] = term.sign * max(term.sign * inside[at], 0.0)
            for j, name in enumerate(term.variant.tuned):
                inside[at + 1 + j] = np.clip(inside[at + 1 + j], *term.variant.range(name))
        return inside

"""Scores of all causes about a fitted model: one whitened column for every form of every cause.

A column is the change of the residual when the cause is put into the fitted model at a share of its plausible size, per
unit of amount: large enough that a cause whose trace grows with the square of its amount (stiff ends) is seen, small
enough for the linear model. Where only the observation changes, nothing is simulated anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.statistics.score import Scores, admissible, descending, score
from pipeline.diagnosis.statistics.twins import between_causes, cosines
from pipeline.records import Array
from rod.inverse.extension import Term
from rod.inverse.fit import Fit
from rod.inverse.observation import Observation
from rod.inverse.sensitivities import whole_residual
from rod.inverse.simulation import run

VISIBLE = 1e-3
"""Surviving fraction below which a cause counts as invisible."""

TRACE = 0.2
"""Share of its plausible size at which a cause's trace is computed."""


@dataclass(frozen=True, eq=False)
class Suspicion:
    """Scores of all forms of all causes about a fitted model.

    Attributes
    ----------
    causes : tuple of Cause
        The catalogue.
    terms : tuple of Term
        The ``k`` directions.
    owner : (k,) int
        Index of the cause of each direction.
    sign : (k,)
        Admissible sign; 0 for both.
    columns : (N, k)
    scores : Scores
    """

    causes: tuple[Cause, ...]
    terms: tuple[Term, ...]
    owner: NDArray[np.int_]
    sign: Array
    columns: Array
    scores: Scores

    @property
    def statistic(self) -> Array:
        """Admissible test statistic (k,) of each direction."""
        return admissible(self.scores.z, self.sign)

    def of(self, cause: int) -> NDArray[np.int_]:
        """Directions of a cause."""
        return np.flatnonzero(self.owner == cause)

    def closeness(self, of: NDArray[np.int_] | slice = slice(None)) -> Array:
        """Largest ``|cos|`` (causes, causes) between the directions, all or some, of any two causes."""
        return between_causes(cosines(self.scores.unit[:, of]), self.owner[of], len(self.causes))

    @property
    def usual(self) -> NDArray[np.int_]:
        """Directions that are no rare forms."""
        return np.flatnonzero([not term.variant.rare for term in self.terms])

    def best(self, cause: int) -> int | None:
        """Direction of a cause with the largest statistic; by ``|z|`` where none is admissible; None without forms."""
        own = self.of(cause)
        if own.size == 0:
            return None
        statistic = self.statistic[own]
        if statistic.max() <= 0.0:
            return int(own[descending(np.abs(self.scores.z[own]))[0]])
        return int(own[descending(statistic)[0]])


def suspect(observation: Observation, fitted: Fit, causes: Sequence[Cause], *, of_law: bool = False) -> Suspicion:
    """Score every form of every cause about a fitted model.

    Causes in the model already are scored only with forms that may be combined. Forms that the law takes over explain
    nothing; ``of_law`` asks for these alone.

    Parameters
    ----------
    observation : Observation
    fitted : Fit
        With a prediction.
    causes : sequence of Cause
    """
    present = {term.cause.name for term in fitted.extension.terms}
    facts = fitted.extension.facts
    terms, owner, columns = [], [], []
    for index, cause in enumerate(causes):
        if cause.name in present and not cause.combines:
            continue
        for variant in (form for form in cause.variants(facts) if form.of_law == of_law):
            term = Term(cause, variant)
            amount = TRACE * variant.trace * cause.plausible(facts)
            columns.append(direction(observation, fitted, term, amount=amount))
            terms.append(term)
            owner.append(index)
    table = np.column_stack(columns) if columns else np.zeros((len(fitted.residual), 0))
    scores = score(*fitted.as_logged, table, visible=VISIBLE)
    sign = np.array([float(term.cause.sign) for term in terms])
    return Suspicion(tuple(causes), tuple(terms), np.array(owner, dtype=int), sign, table, scores)


def beside_usual(fitted: Fit, suspicion: Suspicion) -> Suspicion:
    """The scores beside displacements that scatter, and a rig that is off, as is usual."""
    return replace(suspicion, scores=score(fitted.residual, fitted.jacobian, suspicion.columns, visible=VISIBLE))


def direction(observation: Observation, fitted: Fit, term: Term, *, amount: float) -> Array:
    """Whitened column (N,) of one form of a cause, from zero to ``amount``.

    Where that amount leaves no equilibrium near the fitted one, smaller ones are tried, then the other sign: a base
    model that stands for a large cause lies at its limits. Where none does, all are sought along paths. A column of
    zeros says that not even a trace can be simulated.
    """
    facts = fitted.extension.facts
    smaller = [amount * share for share in SMALLER]
    trials = smaller if term.cause.sign else [*smaller, *(-step for step in smaller[1:])]
    for patient, step in product((False, True), trials):
        model = term.cause.apply(fitted.run.model, step, term.variant, facts)
        shown = run(model, facts, near=fitted.run, patient=patient).prediction
        there = whole_residual(observation, shown, fitted.vector, fitted.extension.prior)
        if there is not None:
            return (fitted.residual - there) / step
    return np.zeros_like(fitted.residual)


SMALLER = (1.0, 0.1, 0.01, 1e-3, 1e-4)
"""Of an amount: traces from the least one are still right to 1e-4 (measured where all have an equilibrium)."""

"""Residual of a model against an observation, and how it moves with every parameter: the rows and columns of a fit.

Rows: the whitened data in the order of `observation.Row`, then one row per piece of prior knowledge. Columns: whatever
bends the cable by the implicit function theorem (`rod.sensitivity`), in one go for all parameters (`bending`);
what only load cell and camera change by the observers alone. Nothing is simulated anew but where a number changes the
kind of the model (a load that keeps the mounted cable from lying free); then by difference quotients with warm starts.

Sign: residual = data - model, so the Jacobian here is that of the model, ``d residual = - jacobian d vector``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rod.array import Array
from rod.inverse.bending import bending_numbers, combined, plainly
from rod.inverse.extension import Extension
from rod.inverse.linearised import columns_of
from rod.inverse.observation import Observation, residual
from rod.inverse.prediction import Model, Prediction
from rod.inverse.simulation import Run, moved, observed, run

SHORT = 1e-2
"""Of the step of a difference quotient, for what is not simulated: at a thousandth of its range the trace of a
relaxation time was 4 % off."""


def whole_residual(
    observation: Observation, prediction: Prediction | None, vector: Array, prior: Array
) -> Array | None:
    """Residual (N,) with the rows of prior knowledge at the end; None where the model has no equilibrium."""
    if prediction is None:
        return None
    return np.concatenate((residual(observation, prediction), -prior @ vector))


def sensitivities(observation: Observation, extension: Extension, vector: Array, base_model: Model, here: Run) -> Array:
    """Jacobian (N, p) of the model, prior rows included.

    A quotient that runs into a model without equilibrium is taken to the other side; a column of zeros is left where
    neither side has one.

    Parameters
    ----------
    observation : Observation
    extension : Extension
    vector : (p,)
    base_model : Model
        That of ``extension`` at the vector.
    here : Run
        Of the model at the vector, with a prediction.
    """
    base, facts, steps = extension.base, extension.facts, extension.steps.copy()
    assert here.prediction is not None and here.bare is not None
    bends, simulated = bending_numbers(extension, vector, base_model, here.model)
    by = combined(here, facts, bends)
    bent = observed(moved(here.bare, by, range(len(bends.at)), steps[bends.at]), here.model, facts)
    seen = [j for j in range(len(vector)) if j not in bends.at and j not in simulated]
    of_base, of_causes = ([j for j in seen if (j < len(base.names)) == own] for own in (True, False))
    steps[of_causes] *= SHORT
    trials = vector + np.diag(steps)
    every = (base.observer(trials[of_base]), *here.model.observers[1:])
    same = Prediction.varied([here.bare] * len(of_base))
    ways = [(bends.at, bent), (of_base, observed(same, replace(here.model, observers=every), facts))]
    if of_causes:
        models = (plainly(extension, trials[j], base_model)[-1] for j in of_causes)
        ways.append((of_causes, Prediction.varied([observed(here.bare, model, facts) for model in models])))
    count, prior = observation.rows.count, extension.prior
    table = np.zeros((count + len(prior), len(vector)))
    for at, there in ways:
        table[:count, at] = columns_of(observation, here.prediction, there, steps[at])
    table[count:] = prior
    for j in simulated:
        table[:, j] = _quotient(observation, extension, vector, base_model, here, j)
    return table


def _quotient(
    observation: Observation, extension: Extension, vector: Array, base_model: Model, here: Run, j: int
) -> Array:
    """Column (N,) of one number by a whole simulation beside."""
    at_here = whole_residual(observation, here.prediction, vector, extension.prior)
    assert at_here is not None
    for signed in (extension.steps[j], -extension.steps[j]):
        trial = vector.copy()
        trial[j] += signed
        if not extension.admissible(trial):
            continue
        there = run(extension.model(trial, of=base_model), extension.facts, near=here)
        value = whole_residual(observation, there.prediction, trial, extension.prior)
        if value is not None:
            return np.asarray((at_here - value) / signed)
    return np.zeros_like(at_here)

"""Displacements that scatter more than the log tells: what they do to a fit, and the test with their scatter in it.

A bow rises with the square root of the travel, so photos tell the travel of a step to a micrometre, where a dial gauge
or a spindle is read to ten. Taken as exact, a scatter of five micrometres is a misfit that no cause removes. It is one
of the sizes that the error models of `pipeline.diagnosis.posterior.error_grid` integrate over; where it is likelier
than none, the test is diagnosed again with displacements known to that scatter only, so that f_EI allows for it.

Code: ``log/displacement-scatter``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.faults import Faults
from pipeline.records import doubtful
from rod.inverse.fit import Fit, evaluated, fit_from
from rod.inverse.laws import AnyLaw
from rod.inverse.observation import Observation
from rod.stiffness_law import StiffnessLaw

Array = NDArray[np.float64]


def displacement_columns(observation: Observation, fitted: Fit) -> Array:
    """Whitened sensitivities (N, k) of a fitted model to errors (m) of the displacements under load.

    None (k = 0) where the model has such errors among its unknowns already.
    """
    base, facts = fitted.extension.base, fitted.extension.facts
    none, count = np.zeros((len(fitted.residual), 0)), len(base.names) - 2
    if base.moved:
        return none
    at = facts.pushed
    loose = replace(base, moved=at, moved_std=np.ones(len(at)), moved_first=np.zeros(len(at)))
    vector = np.r_[fitted.vector[:count], np.zeros(len(at)), fitted.vector[count:]]
    made = evaluated(observation, replace(fitted.extension, base=loose), vector, fitted.run)
    if made.run.prediction is None:
        return none
    columns = np.zeros((len(fitted.residual), len(at)))
    columns[: observation.rows.count] = made.jacobian[: observation.rows.count, count : count + len(at)]
    return columns


def with_exact_displacements(observation: Observation, exact: Fit, scattered: Fit) -> Fit | None:
    """A model fitted beside displacements that scatter, fitted to the same test with exact ones; None where it cannot.

    ``exact`` is a fit of the base model with exact displacements.
    """
    known, given = exact.extension.base, scattered.extension.base
    law, moved, first = given.characteristic(scattered.vector), len(given.moved), given.law.size
    assert isinstance(law, StiffnessLaw) and isinstance(known.law, AnyLaw)
    rest = np.delete(scattered.vector[first:], np.arange(moved) + len(given.names) - 2 - moved - first)
    extension = replace(scattered.extension, base=known, facts=exact.extension.facts)
    found = fit_from(observation, extension, np.r_[known.law.basis.projected(law.rise), rest], exact)
    return None if found.run.prediction is None else found


def with_scatter(faults: Faults, std: float) -> Faults:
    """The test with displacements under load known to ``std`` (m), or as badly as before, and a finding."""
    steps = tuple(
        step
        if step.branch == "mounted" or step.displacement is None
        else replace(step, displacement_std=max(std, step.displacement_std or 0.0))
        for step in faults.test.steps
    )
    finding = doubtful("log/displacement-scatter", std_m=std)
    return replace(faults, test=replace(faults.test, steps=steps), findings=(*faults.findings, finding))

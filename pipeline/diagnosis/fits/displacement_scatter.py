"""Displacements that scatter more than the log tells: found by what photos and forces say of each step.

A bow rises with the square root of the travel, so photos tell the travel of a step to a micrometre, where a dial gauge
or a spindle is read to ten. Taken as exact, a scatter of five micrometres was a misfit that no cause removes. It has no
order that a load, a branch or a time could follow: a zero, a frame that yields, or a wrong scale make a line of it,
which is left to them. From four steps under load on it is asked for beside whatever was concluded, so that every name
stands with the scatter allowed for: taken as exact, ten micrometres were told as a second cause, and f_EI went along.

``likelihood of a scatter beside the concluded model, lines apart -> each known to that``

Where the model beside which it is asked for is none of the test's (nothing explains it), the errors are left open
instead, and what is not a line of them is the scatter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.fits.faults import Faults
from pipeline.diagnosis.fits.fit import Fit, evaluated
from pipeline.diagnosis.fits.workbench import Workbench, prepare
from pipeline.diagnosis.observations.prediction import Facts
from pipeline.diagnosis.statistics.variance_component import Component, component
from pipeline.records import Finding
from pipeline.rounding import plain
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.measurement import MeasuredTest

Array = NDArray[np.float64]

LEAST_STEPS = 4
"""A line takes two, and two more are the least of which a scatter could be told."""

LEAST_RATIO = 1.5
"""Scatter over what is allowed for anyway: less than that comes out of four to six errors without any."""

LEAST_SHARE = 0.5
"""Share of the misfit beyond noise that the errors must remove: they take a little of any, and what leaves hardly more
than noise would then pass for noise (a wave along the cable that comes and goes did)."""


RARE = 1e-3
"""Probability of a scatter as clear by noise alone: a second diagnosis is asked for that often without need."""


@dataclass(frozen=True, eq=False)
class Scattered:
    """The test with displacements known to their scatter only.

    ``faults`` and ``bench`` are those of that test; ``price`` is what a likelihood pays for the errors, in chi-square.
    """

    faults: Faults
    bench: Workbench
    price: float


def scatter_beside(faults: Faults, bench: Workbench, fitted: Fit, settings: DiagnosisSettings) -> Scattered | None:
    """The test with displacements that scatter as they do beside a fitted model, and its base model.

    Parameters
    ----------
    faults : Faults
    bench : Workbench
        Of the test with displacements as exact as the log tells.
    fitted : Fit
        What was concluded of it.
    settings : DiagnosisSettings

    Returns
    -------
    Scattered or None
        With the finding ``log/displacement-scatter``; None where they do not scatter more than is allowed for anyway.
    """
    at, known = _logged(faults.test), fitted.extension.base
    if len(at) < LEAST_STEPS or known.moved:
        return None
    columns = _columns(bench, fitted, at)
    if columns is None:
        return None
    most = settings.displacement_scatter
    found = component(fitted.residual, fitted.jacobian, columns, lines=_lines(bench.facts, at), most=most)
    if found is None or found.p_value > RARE or not LEAST_RATIO * settings.displacement_std < found.std < most:
        return None
    if found.share < LEAST_SHARE:
        return None
    again = _told(faults, bench, at, found, settings)
    return None if again is None else Scattered(*again, found.price + 2.0 * (1 - len(at)))


def _columns(bench: Workbench, fitted: Fit, at: list[int]) -> Array | None:
    """Whitened sensitivities (N, k) of a fitted model to the displacements (m) of some steps."""
    base, count = fitted.extension.base, len(fitted.extension.base.names) - 2
    loose = replace(base, moved=tuple(at), moved_std=np.ones(len(at)), moved_first=np.zeros(len(at)))
    vector = np.r_[fitted.vector[:count], np.zeros(len(at)), fitted.vector[count:]]
    made = evaluated(bench.observation, replace(fitted.extension, base=loose), vector, fitted.run)
    if made.run.prediction is None:
        return None
    columns = np.zeros((len(fitted.residual), len(at)))
    data = bench.observation.rows.count
    columns[:data] = made.jacobian[:data, count : count + len(at)]
    return columns


def with_scatter(faults: Faults, bench: Workbench, settings: DiagnosisSettings) -> tuple[Faults, Workbench] | None:
    """The test with displacements known to their scatter only, and its base model.

    Parameters
    ----------
    faults : Faults
    bench : Workbench
        Of the test with displacements as exact as the log tells.
    settings : DiagnosisSettings

    Returns
    -------
    (Faults, Workbench) or None
        With the finding ``log/displacement-scatter``; None where they do not scatter more than is allowed for anyway.
    """
    at, knots = _logged(faults.test), len(bench.base.extension.base.knots)
    if len(at) < LEAST_STEPS:
        return None
    most = settings.displacement_scatter
    left_open = prepare(replace(faults, test=_known_to(faults.test, at, most)), settings, knots=knots)
    if isinstance(left_open, str):
        return None
    found = scatter_of_errors(left_open.base, bench.facts, most)
    if found is None or not LEAST_RATIO * settings.displacement_std < found.std < most:
        return None
    misfit = bench.base.chi2 - (len(bench.base.residual) - bench.base.extension.size)
    if bench.base.chi2 - left_open.base.chi2 < LEAST_SHARE * misfit:
        return None
    return _told(faults, bench, at, found, settings)


def _logged(test: MeasuredTest) -> list[int]:
    """Steps under load whose displacement the log gives."""
    return [i for i, step in enumerate(test.steps) if step.branch != "mounted" and step.displacement is not None]


def _told(
    faults: Faults, bench: Workbench, at: list[int], scatter: Component, settings: DiagnosisSettings
) -> tuple[Faults, Workbench] | None:
    """The test with displacements known to their scatter, told as a finding, and its base model."""
    found = replace(
        faults,
        test=_known_to(faults.test, at, scatter.std),
        findings=(*faults.findings, told(scatter)),
    )
    again = prepare(found, settings, knots=len(bench.base.extension.base.knots))
    return None if isinstance(again, str) else (found, again)


def told(scatter: Component) -> Finding:
    """The finding ``log/displacement-scatter``."""
    size, least, most = (plain(1e6 * value, 2) for value in (scatter.std, *scatter.between))
    message = (
        f"the displacements of the log scatter by {size} um (95 %: {least} to {most} um) about what photos and forces "
        "say of each step, more than the log tells; the diagnosis allowed for that"
    )
    return Finding("log/displacement-scatter", "warning", message)


def scatter_of_errors(fitted: Fit, facts: Facts, most: float) -> Component | None:
    """Scatter of the displacements beside a model that has their errors among its parameters; see `component`.

    The errors are put back into what the model leaves, so what was supposed of their scatter plays no part; their own
    squares would count as free what the law and the causes have taken of them.
    """
    base, at = fitted.extension.base, list(fitted.extension.base.moved)
    own = slice(len(base.names) - 2 - len(at), len(base.names) - 2)
    errors = fitted.jacobian[:, own]
    columns = errors.copy()
    columns[len(columns) - len(fitted.extension.prior) :] = 0.0
    left = fitted.residual + errors @ fitted.vector[own]
    rest = np.delete(fitted.jacobian, own, axis=1)
    return component(left, rest, columns, lines=_lines(facts, at), most=most)


def _lines(facts: Facts, at: list[int]) -> Array:
    """Courses (k, 2) of errors that are no scatter: a constant, and what grows with the displacement."""
    return np.column_stack([np.ones(len(at)), facts.displacement[at]])


def _known_to(test: MeasuredTest, steps: list[int], std: float) -> MeasuredTest:
    """The test with displacements of some steps known to ``std`` (m), or as badly as before."""
    return replace(
        test,
        steps=tuple(
            replace(step, displacement_std=max(std, step.displacement_std or 0.0)) if i in steps else step
            for i, step in enumerate(test.steps)
        ),
    )

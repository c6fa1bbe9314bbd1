"""Displacements that scatter more than the log tells: found by what photos and forces say of each step.

A bow rises with the square root of the travel, so photos tell the travel of a step to a micrometre, where a dial gauge
or a spindle is read to ten. Taken as exact, a scatter of five micrometres was a misfit that no cause removes. It has no
order that a load, a branch or a time could follow: a zero, a frame that yields, or a wrong scale make a line of it,
which is left to them. So it is asked for only where no cause was found, from four steps under load on.

``errors of all displacements left open -> what is not a line of them -> scatter -> each known to that``
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.diagnosis.fits.faults import Faults
from pipeline.diagnosis.fits.workbench import Workbench, prepare
from pipeline.records import Finding
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.measurement import MeasuredTest

LEAST_STEPS = 4
"""A line takes two, and two more are the least of which a scatter could be told."""

LEAST_RATIO = 1.5
"""Scatter over what is allowed for anyway: less than that comes out of four to six errors without any."""

LEAST_SHARE = 0.5
"""Share of the misfit beyond noise that the errors must remove: they take a little of any, and what leaves hardly more
than noise would then pass for noise (a wave along the cable that comes and goes did)."""


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
    knots = len(bench.base.extension.base.knots)
    at = [i for i, step in enumerate(faults.test.steps) if step.branch != "mounted" and step.displacement is not None]
    if len(at) < LEAST_STEPS:
        return None
    most = settings.displacement_scatter
    left_open = prepare(replace(faults, test=_known_to(faults.test, at, most)), settings, knots=knots)
    if isinstance(left_open, str):
        return None
    base, vector = left_open.base.extension.base, left_open.base.vector
    errors = base.shift(vector, len(faults.test.steps))
    travel = bench.facts.displacement[at]
    line = np.column_stack([np.ones(len(at)), travel])
    off = np.asarray(errors)[at] - line @ np.linalg.lstsq(line, np.asarray(errors)[at], rcond=None)[0]
    scatter = float(np.sqrt(np.sum(off**2) / (len(at) - line.shape[1])))
    if not LEAST_RATIO * settings.displacement_std < scatter < most:
        return None
    misfit = bench.base.chi2 - (len(bench.base.residual) - bench.base.extension.size)
    if bench.base.chi2 - left_open.base.chi2 < LEAST_SHARE * misfit:
        return None
    message = (
        f"the displacements of the log scatter by {1e6 * scatter:.2g} um about what photos and forces say of each "
        "step, more than the log tells; the diagnosis allowed for that"
    )
    found = replace(
        faults,
        test=_known_to(faults.test, at, scatter),
        findings=(*faults.findings, Finding("log/displacement-scatter", "warning", message)),
    )
    again = prepare(found, settings, knots=knots)
    return None if isinstance(again, str) else (found, again)


def _known_to(test: MeasuredTest, steps: list[int], std: float) -> MeasuredTest:
    """The test with displacements of some steps known to ``std`` (m), or as badly as before."""
    return replace(
        test,
        steps=tuple(
            replace(step, displacement_std=max(std, step.displacement_std or 0.0)) if i in steps else step
            for i, step in enumerate(test.steps)
        ),
    )

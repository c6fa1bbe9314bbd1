"""A test that was not made: what a model says would be measured, as if it had been.

From a model and circumstances to a `rod.measurement.MeasuredTest` without noise, whose stated uncertainties are those
of a template. The design of experiments and the choice of the next one work on it with the same code as on real data.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.records import Array
from rod.inverse.observation import CHORD_STD
from rod.inverse.prediction import Facts
from rod.inverse.simulation import Run
from rod.measurement import MeasuredShape, MeasuredStep, MeasuredTest


@dataclass(frozen=True)
class Precision:
    """How well the planned test would be measured.

    Attributes
    ----------
    force_std : N
        Of one sample.
    chord_std : m
    section_std, correlation_length, systematic_std, systematic_length : m
        Of the midline sections, see `rod.measurement.MeasuredShape`.
    section_pitch : m
        Distance between sections.
    cover : m
        What the bearing covers hide of the cable at both ends.
    scale_std, length_std : relative, m
    """

    force_std: float
    chord_std: float
    section_std: float
    correlation_length: float
    systematic_std: float
    systematic_length: float
    section_pitch: float
    cover: float
    scale_std: float
    length_std: float


def precision_of(test: MeasuredTest, force_std: Array) -> Precision:
    """Precision of a test that was made: the median of its photos.

    Raises
    ------
    ValueError
        If no photo was measured.
    """
    shapes = [step.shape for step in test.steps if step.shape is not None]
    if not shapes:
        raise ValueError("no step has a measured shape")
    chords = [step.chord_std for step in test.steps if step.chord_std is not None]

    def median(values: list[float]) -> float:
        return float(np.median(values))

    return Precision(
        force_std=median(list(force_std)),
        chord_std=median(chords) if chords else CHORD_STD * test.length,
        section_std=median([float(np.median(shape.section_std)) for shape in shapes]),
        correlation_length=median([shape.correlation_length for shape in shapes]),
        systematic_std=median([shape.systematic_std for shape in shapes]),
        systematic_length=median([shape.systematic_length for shape in shapes]),
        section_pitch=median([float(np.median(np.diff(np.sort(shape.section_s)))) for shape in shapes]),
        cover=median([float(shape.section_s.min()) for shape in shapes]),
        scale_std=test.scale_std,
        length_std=test.length_std,
    )


def more_steps(facts: Facts, displacements: list[float], branches: list[str]) -> Facts:
    """Circumstances with further steps at the end, held and timed like the last one."""
    count = len(displacements)
    cycle = float(facts.clock[-1] - facts.clock[-2]) if len(facts.clock) > 1 else 60.0
    by_log = facts.chord_by_log[-1] + facts.displacement[-1] - np.array(displacements)
    return replace(
        facts,
        branch=(*facts.branch, *branches),
        displacement=np.r_[facts.displacement, displacements],
        displacement_std=np.r_[facts.displacement_std, np.zeros(count)],
        photo_time=np.r_[facts.photo_time, np.full(count, facts.photo_time[-1])],
        hold_times=(*facts.hold_times, *[facts.hold_times[-1]] * count),
        force_share=np.r_[facts.force_share, [float(branch != "mounted") for branch in branches]],
        clock=np.r_[facts.clock, facts.clock[-1] + cycle * np.arange(1, count + 1)],
        picture_centre=np.vstack([facts.picture_centre, np.repeat(facts.picture_centre[-1:], count, axis=0)]),
        chord_by_log=np.r_[facts.chord_by_log, by_log],
    )


def planned_test(made: Run, facts: Facts, precision: Precision, *, photos: bool = True) -> MeasuredTest:
    """What a run would be measured as, without noise.

    Raises
    ------
    ValueError
        If the run has no prediction.
    """
    seen = made.prediction
    if seen is None:
        raise ValueError(f"nothing can be planned on a model without equilibrium: {made.failed and made.failed.advice}")
    steps = []
    for i, branch in enumerate(facts.branch):
        times = facts.hold_times[i]
        shape = _shape(seen.s, seen.x[i], seen.y[i], seen.theta[i], precision) if photos else None
        steps.append(
            MeasuredStep(
                step=i,
                branch=branch,
                displacement=float(facts.displacement[i]),
                force=float(seen.force[i]),
                force_std=precision.force_std,
                chord=float(seen.chord[i]) if photos else None,
                chord_std=precision.chord_std if photos else None,
                shape=shape,
                time=float(facts.clock[i] + facts.photo_time[i]) if facts.timed else None,
                hold_times=facts.clock[i] + times if facts.timed else None,
                hold_forces=seen.samples[i],
                picture_centre=(float(facts.picture_centre[i, 0]), float(facts.picture_centre[i, 1])),
                chord_by_log=bool(np.isfinite(facts.chord_by_log[i])),
            )
        )
    return MeasuredTest(
        facts.length,
        precision.length_std,
        precision.scale_std,
        tuple(steps),
        facts.moving,
        picture_half_diagonal=facts.half_diagonal,
    )


def _shape(s: Array, x: Array, y: Array, theta: Array, precision: Precision) -> MeasuredShape:
    """Measured shape of a predicted curve; the smooth curve has no parameters of its own (p = 0)."""
    sections = np.arange(precision.cover, float(s[-1]) - precision.cover, precision.section_pitch)
    none = np.zeros((len(s), 0))
    return MeasuredShape(
        s=s,
        x=x,
        y=y,
        theta=theta,
        kappa=-np.gradient(theta, s),
        seen=(s >= precision.cover) & (s <= s[-1] - precision.cover),
        basis_normal=none,
        basis_theta=none,
        basis_kappa=none,
        covariance=np.zeros((0, 0)),
        section_s=sections,
        section_x=np.interp(sections, s, x),
        section_y=np.interp(sections, s, y),
        section_std=np.full(len(sections), precision.section_std),
        correlation_length=precision.correlation_length,
        systematic_std=precision.systematic_std,
        systematic_length=precision.systematic_length,
    )

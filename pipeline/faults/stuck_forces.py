"""Forces that stand still while the bearing moves: a load cell at the end of its range, or a channel that froze.

A live channel scatters. In a hold that was cut off at the end of the range, or repeats what was last read, it does not,
or only by what comes after the cell. So a hold counts as stuck if it scatters far less than those that are not at the
top of the log, and either repeats to the digit or is at the top. Logs of one sample a step show it by repeating their
largest force to the digit. Symbols: F ratio of the variances, both about a straight line in time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from pipeline.records import Array
from rod.inverse.force_noise import resolution
from rod.measurement import MeasuredStep

LEAST_SAMPLES = 4
"""Of a hold, for its scatter to count: a line takes two."""

QUIET = 1.0 / 25.0
"""F below which a hold is too quiet: a fifth of the scatter, more than load or time of day make."""

CHANCE = 1e-5
"""Probability of so small an F in a live hold: one false in ten thousand tests of ten steps."""

AT_TOP = 5.0
"""Standard deviations of its own by which the mean of a hold that is cut off lies below the largest sample of all."""

FINE = 2e-4
"""Last digit over the largest force: in a coarser log two steps may read the same force by chance."""


class _Hold(NamedTuple):
    mean: float
    variance: float
    freedom: int
    repeats: bool


def stuck_forces(steps: tuple[MeasuredStep, ...]) -> list[int]:
    """Indices of the loaded steps whose force stands still."""
    samples = [step.samples for step in steps]
    loaded = [i for i, step in enumerate(steps) if step.branch != "mounted"]
    if len(loaded) < 2:
        return []
    every = np.abs(np.concatenate(samples))
    top = float(every.max())
    digit = resolution(samples)
    if all(values.size < LEAST_SAMPLES for values in samples):
        return _repeated(steps, samples, loaded, top) if digit < FINE * top else []
    holds = {i: _hold(values, digit) for i, values in enumerate(samples) if values.size >= LEAST_SAMPLES}
    high = {i: top - abs(hold.mean) <= AT_TOP * np.sqrt(hold.variance) for i, hold in holds.items()}
    return [
        i
        for i in loaded
        if i in holds
        and (holds[i].repeats or high[i])
        and _is_quiet(holds[i], [h.variance for j, h in holds.items() if j != i and not h.repeats and not high[j]])
    ]


def _hold(values: Array, digit: float) -> _Hold:
    """Scatter of the samples about a line; at least that of rounding to the last digit."""
    line = np.column_stack([np.ones(values.size), np.linspace(-1.0, 1.0, values.size)])
    off = values - line @ np.linalg.lstsq(line, values, rcond=None)[0]
    freedom = values.size - 2
    variance = max(float(off @ off) / freedom, digit**2 / 12.0)
    return _Hold(float(np.mean(values)), variance, freedom, bool(np.ptp(values) == 0.0))


def _is_quiet(hold: _Hold, others: list[float]) -> bool:
    if not others:
        return False
    ratio = hold.variance / float(np.median(others))
    return ratio < QUIET and float(special.chdtr(hold.freedom, hold.freedom * ratio)) < CHANCE


def _repeated(steps: tuple[MeasuredStep, ...], samples: list[Array], loaded: list[int], top: float) -> list[int]:
    """Steps at several displacements that repeat the largest force of the log to the digit."""
    same = [i for i in loaded if np.all(np.abs(samples[i]) == top)]
    return same if len({steps[i].displacement for i in same}) > 1 else []

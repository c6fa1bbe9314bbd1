"""Noise level of a force sample, from the samples within the holds.

``samples of a hold about their own smooth course -> one level, or a level for each hold -> how well it is known``

One level for all holds, unless they differ beyond chance. Four samples beyond a straight line scatter by a tenth of
their level once in three hundred, and taken at their word such a hold outweighs all the others: a specimen without
effect then lost force in its holds by 13 sigma. So the test is corrected for few samples (Bartlett 1937), and where
holds do differ, each level is drawn to the others as far as its few samples leave it open (Smyth 2004: variances of an
inverse chi-square whose level and spread all holds tell together). With the level goes its freedom: scores that stand
on one hold have the wide tails of the samples of that hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from rod.array import Array
from rod.measurement import MeasuredStep


@dataclass(frozen=True)
class ForceNoise:
    """How much one force sample scatters.

    Attributes
    ----------
    std : (n,) N
        Of each step.
    freedom : int
        Samples behind a level that all holds share, or behind all levels; 0 where they are stated.
    own : tuple of float
        Freedom of each step's level, where each has its own; else empty.
    """

    std: Array
    freedom: int
    own: tuple[float, ...] = ()


def force_noise(steps: tuple[MeasuredStep, ...], *, floor: float, distinct: float) -> ForceNoise:
    """Scatter of the samples within the holds, each hold with its own straight line in time.

    Where the holds decay beyond chance, each has its own share of one exponential besides: a force that relaxes within
    the first samples is no straight line, and taken for noise it hid all that forces tell (a loss of 3 % in 2 s doubled
    the level). One common level, unless the holds differ beyond chance: then each hold has its own.

    Parameters
    ----------
    steps : tuple of MeasuredStep
    floor : N
        Bounds the level from below: a log of few digits scatters by rounding.
    distinct : float
        Level of the two tests.
    """
    plain = _scatter(steps, None)
    if not plain.freedom.any():
        # stated is what the force of a hold is known to
        samples = [len(step.samples) for step in steps]
        return ForceNoise(np.maximum([step.force_std for step in steps] * np.sqrt(samples), floor), 0)
    found = _decaying(steps, plain, distinct) or plain
    total = int(found.freedom.sum())
    pooled = float(found.squares.sum()) / total
    if not _differ(found, floor, distinct):
        return ForceNoise(np.full(len(steps), max(np.sqrt(pooled), floor)), total)
    variance, own = _drawn_together(found, floor)
    return ForceNoise(np.maximum(np.sqrt(variance), floor), total, tuple(own.tolist()))


def _differ(found: _Scatter, floor: float, level: float) -> bool:
    """Whether the holds scatter unequally beyond chance: Bartlett's test, corrected for few samples.

    No hold counts as quieter than the floor: samples that repeat in all digits are no measure of how quiet it is.
    """
    used = found.freedom > 0
    freedom = found.freedom[used]
    if len(freedom) < 2:
        return False
    total = freedom.sum()
    own = np.maximum(found.squares[used] / freedom, floor**2)
    if not own.min() > 0.0:
        return False
    statistic = total * np.log(freedom @ own / total) - freedom @ np.log(own)
    correction = 1.0 + (np.sum(1.0 / freedom) - 1.0 / total) / (3.0 * (len(freedom) - 1))
    return bool(special.chdtrc(len(freedom) - 1, statistic / correction) < level)


SPREADS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Freedoms tried for the spread of the levels: below one they say nothing of each other, at 16 they are nearly one."""


def _drawn_together(found: _Scatter, floor: float) -> tuple[Array, Array]:
    """Variances (n,) N^2 of the holds, drawn to each other, and the freedom (n,) behind them.

    s_i^2 / s^2 follows F with f_i and d degrees of freedom, and the variance of a hold is (d s^2 + f_i s_i^2) /
    (d + f_i), here the mean over the likelihood of s and d: the likeliest d of seven holds is too large too often.
    """
    used = found.freedom > 0
    freedom = found.freedom[used].astype(float)
    own = np.maximum(found.squares[used] / freedom, floor**2)
    levels, spreads = np.geomspace(own.min(), own.max(), 31)[:, None], np.array(SPREADS)
    # the density of F, without what depends on neither level nor spread
    half, ahead = 0.5 * freedom[:, None, None], (freedom * own)[:, None, None] / (spreads * levels)
    beta = special.betaln(half, 0.5 * spreads)
    likely = (half * np.log(ahead) - (half + 0.5 * spreads) * np.log1p(ahead) - beta).sum(axis=0)
    weight = np.exp(likely - likely.max())
    weight /= weight.sum()
    variance = np.full(len(found.freedom), float(np.sum(weight * levels)))
    behind = np.full(len(found.freedom), float(np.sum(weight / spreads)))
    for i, k in enumerate(np.flatnonzero(used)):
        variance[k] = np.sum(weight * (spreads * levels + freedom[i] * own[i]) / (spreads + freedom[i]))
        behind[k] = np.sum(weight / (spreads + freedom[i]))
    return variance, 1.0 / behind


HARMONICS = np.arange(1, 30)
"""Of the sawtooth of a rounding error over the force; the variance of the others is 2 % of the whole."""


def common_rounding(steps: tuple[MeasuredStep, ...], std: Array) -> Array:
    """Standard deviation (n,) N of what rounding does to all samples of a hold alike.

    Samples that scatter over several digits average their rounding out; those that repeat one number all have the same
    error, of variance digit^2 / 12. Between, the mean error over a scatter sigma of the force f is the sawtooth
    ``sum_k (-1)^k d / (pi k) sin(2 pi k f / d) exp(-2 (pi k sigma / d)^2)`` (Widrow and Kollar, Quantization Noise,
    2008), of which f may be anywhere. With a digit of a hundredth of the largest force, holds of 60 equal samples were
    taken for known to a hundredth of their error.

    Parameters
    ----------
    steps : tuple of MeasuredStep
    std : (n,) N
        Of one sample, its rounding included.
    """
    digit = resolution([step.samples for step in steps])
    if not digit > 0.0:
        return np.zeros(len(steps))
    scatter = np.maximum((std / digit) ** 2 - 1.0 / 12.0, 0.0)
    variance = np.exp(-4.0 * np.pi**2 * np.outer(scatter, HARMONICS**2)) / (2.0 * np.pi**2 * HARMONICS**2)
    return np.asarray(digit * np.sqrt(variance.sum(axis=1)))


ROUNDING = 1e-9
"""Of the largest force: numbers that close are the same number."""

LEAST_GAPS, LEAST_STEP = 3, 50.0
"""Differences within holds, and decimals of a step: chance makes three of fifty decimals multiples of the least once in
a hundred.
"""


def resolution(samples: Sequence[Array]) -> float:
    """Step (N) between the forces that a load cell can show; 0 if there is none, as after a conversion of units.

    Whole steps of a converter, 0.0223 N, are logged with more digits than they have: where all differences within the
    holds are multiples of the least one, that is the step, else the last decimal.
    """
    digit = _last_digit(np.concatenate(samples))
    gaps = np.concatenate([np.diff(np.unique(hold)) for hold in samples])
    if gaps.size < LEAST_GAPS or not digit > 0.0:
        return digit
    step = float(gaps.min())
    whole = np.abs(gaps - step * np.round(gaps / step)) <= 2.0 * digit
    return step if step > LEAST_STEP * digit and whole.all() else digit


def _last_digit(forces: Array) -> float:
    """Value of the last decimal of all forces, N; 0 if they have no end."""
    top = float(np.max(np.abs(forces), initial=0.0))
    for places in range(-3, 13):
        if np.all(np.abs(forces - np.round(forces, places)) <= ROUNDING * top):
            return 10.0**-places
    return 0.0


class _Scatter(NamedTuple):
    """Sums of squares (n,) N^2 of the samples of every hold about their smooth course, and their freedom (n,)."""

    squares: Array
    freedom: NDArray[np.int_]


DECAYS = (0.03, 0.06, 0.12, 0.25, 0.5)
"""Time constants tried, shares of the longest hold: below them the first sample alone is off, above a line does it."""


def _decaying(steps: tuple[MeasuredStep, ...], plain: _Scatter, level: float) -> _Scatter | None:
    """Scatter about a line and a decay in every hold; None where that removes no more than chance does (F-test)."""
    span = max((float(np.ptp(times)) for step in steps if (times := _times(step)).size), default=0.0)
    if span <= 0.0:
        return None
    best = min((_scatter(steps, share * span) for share in DECAYS), key=lambda one: float(one.squares.sum()))
    free, rest = int(best.freedom.sum()), float(best.squares.sum())
    spent = int(plain.freedom.sum()) - free
    if free <= 0 or spent <= 0:
        return None
    ratio = (float(plain.squares.sum()) - rest) / spent / max(rest / free, 1e-300)
    return best if float(special.fdtrc(spent, free, ratio)) < level else None


def _scatter(steps: tuple[MeasuredStep, ...], decay: float | None) -> _Scatter:
    """Scatter within the holds about a line in time and, given its time constant, a decay."""
    squares, freedom = np.zeros(len(steps)), np.zeros(len(steps), dtype=int)
    for i, step in enumerate(steps):
        if step.hold_forces is None:
            continue
        course = [np.ones(len(step.hold_forces))]
        times = _times(step)
        if np.ptp(times) > 0.0:
            since = times - times.min()
            course.append(since / since.max() - 0.5)
            if decay is not None:
                course.append(np.exp(-since / decay))
        smooth = np.column_stack(course[: len(step.hold_forces)])
        scatter = step.hold_forces - smooth @ np.linalg.lstsq(smooth, step.hold_forces, rcond=None)[0]
        squares[i], freedom[i] = float(scatter @ scatter), len(scatter) - smooth.shape[1]
    return _Scatter(squares, freedom)


def _times(step: MeasuredStep) -> Array:
    """Times (h,) s of the samples of a hold, or their numbers where the log has no time; empty without samples."""
    count = 0 if step.hold_forces is None else len(step.hold_forces)
    return np.arange(float(count)) if step.hold_times is None else step.hold_times

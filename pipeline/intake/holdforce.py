"""The force at the time of the photo, from the samples of a hold: samples -> force and its standard deviation.

While a step is held the force relaxes and the load cell drifts; the photo sees one moment. All holds of a log are
fitted together by polynomials in time of one degree, the lowest after which the holds as a whole ask for no higher one
(F-test over all holds), so that no hold picks its own trend by chance. Symbols: ``t`` time scaled to -1..1 in a hold,
``sigma`` the standard deviation of one sample, ``rho`` the correlation of neighbouring samples.

Source: ordinary least squares and its prediction variance, Draper & Smith, Applied Regression Analysis, 3rd ed.,
sections 3.1 and 6.1; variance inflation (1 + rho)/(1 - rho) of a first-order autoregressive series, Priestley,
Spectral Analysis and Time Series, section 5.3.2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.records import Array
from pipeline.settings.intake import IntakeSettings

HIGHEST_DEGREE = 4
"""Of the polynomial in time; relaxation over a hold is followed to 1 % by it."""

LEVEL = 0.01
"""Significance at which the holds together ask for one degree more: few false ones."""


@dataclass(frozen=True)
class Hold:
    """Samples of one hold: ``times`` (n,) in s or in sample numbers, ``forces`` (n,) N, time of the photo or None."""

    times: Array
    forces: Array
    photo_time: float | None


@dataclass(frozen=True)
class HoldForces:
    """Force and standard deviation of each hold in N, the degree of the trend, whether samples tell the deviation."""

    force: tuple[float, ...]
    std: tuple[float, ...]
    degree: int
    sampled: bool


def hold_forces(holds: Sequence[Hold], *, resolution: float, settings: IntakeSettings) -> HoldForces:
    """Forces at the times of the photos.

    Parameters
    ----------
    holds : sequence of Hold
        In the order of the log; each with at least one sample.
    resolution : float
        N, value of the last digit of the log.

    Returns
    -------
    HoldForces
        A deviation is never zero: the resolution of the log is its floor, and without repeated samples a share of the
        largest force (``force_std_relative``) stands in.
    """
    largest = max(float(np.max(np.abs(hold.forces))) for hold in holds)
    # the last two: a log of zeros or of endless digits
    floor = max(resolution / math.sqrt(12.0), 1e-9 * largest, 1e-12)
    degree = _degree(holds)
    fits = [_Fit.of(hold, degree) for hold in holds]
    freedom = sum(fit.freedom for fit in fits)
    if freedom == 0:
        sigma = max(settings.force_std_relative * largest, floor)
        return HoldForces(tuple(fit.value for fit in fits), tuple(sigma for _ in fits), degree, sampled=False)
    inflation = math.sqrt(_inflation(fits))
    sigmas = [sigma * inflation for sigma in _sigmas(fits, floor)]
    bend = _left_over(holds, fits, sigmas, degree)
    std = tuple(
        math.hypot(sigma * fit.leverage, floor, fit.wander, bend) for sigma, fit in zip(sigmas, fits, strict=True)
    )
    return HoldForces(tuple(fit.value for fit in fits), std, degree, sampled=True)


@dataclass(frozen=True)
class _Fit:
    """Trend of one hold: value at the photo, prediction factor, residuals and their degrees of freedom."""

    value: float
    leverage: float
    wander: float  # N, how far the trend runs in the hold where the moment of the photo is not known
    residuals: Array
    freedom: int

    @classmethod
    def of(cls, hold: Hold, degree: int) -> _Fit:
        degree = _possible(hold, degree)
        t, photo = _scaled(hold)
        basis = np.polynomial.legendre.legvander(t, degree)
        at = np.polynomial.legendre.legvander(np.array([0.0 if photo is None else photo]), degree)[0]
        reference = float(np.mean(hold.forces))  # offsets taken out first: a drift of 1 mN on 100 N keeps its digits
        coefficients, *_ = np.linalg.lstsq(basis, hold.forces - reference, rcond=None)
        covariance = np.linalg.pinv(basis.T @ basis)
        trend = basis @ coefficients
        return cls(
            value=reference + float(at @ coefficients),
            leverage=math.sqrt(float(at @ covariance @ at)),
            wander=float(np.std(trend)) if photo is None else 0.0,
            residuals=hold.forces - reference - trend,
            freedom=len(t) - degree - 1,
        )


def _scaled(hold: Hold) -> tuple[Array, float | None]:
    """Times of a hold on -1..1; the photo is not allowed outside: no force is extrapolated."""
    first, last = float(hold.times[0]), float(hold.times[-1])
    half = (last - first) / 2.0
    if half <= 0.0:
        return np.zeros_like(hold.times), None if hold.photo_time is None else 0.0
    middle = (last + first) / 2.0
    photo = None if hold.photo_time is None else min(1.0, max(-1.0, (hold.photo_time - middle) / half))
    return (hold.times - middle) / half, photo


def _possible(hold: Hold, degree: int) -> int:
    """The highest degree a hold supports: at least two samples more than parameters, at distinct times."""
    return max(0, min(degree, len(hold.times) - 3, len(np.unique(hold.times)) - 2))


def _degree(holds: Sequence[Hold]) -> int:
    """The lowest degree to which neither one nor two more degrees add significantly, over all holds."""
    highest = HIGHEST_DEGREE + 2
    rss = np.sum([_left_squares(hold, highest) for hold in holds], axis=0)
    freedom = [sum(len(h.times) - 1 - _possible(h, degree) for h in holds) for degree in range(highest + 1)]
    for degree in range(HIGHEST_DEGREE):
        steps = (degree + 1, degree + 2)
        if all(_p_value(rss[degree], freedom[degree], rss[more], freedom[more]) > LEVEL for more in steps):
            return degree
    return HIGHEST_DEGREE


def _left_squares(hold: Hold, highest: int) -> Array:
    """Sum of squared residuals of one hold for the degrees 0 to ``highest``, from one orthogonal basis."""
    possible = _possible(hold, highest)
    basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(_scaled(hold)[0], possible))
    forces = hold.forces - np.mean(hold.forces)
    taken = np.cumsum((basis.T @ forces) ** 2)
    left = np.maximum(float(forces @ forces) - taken, 0.0)
    return np.concatenate([left, np.full(highest - possible, left[-1])])


def _p_value(rss: float, freedom: int, rss_more: float, freedom_more: int) -> float:
    """F-test of a larger against a smaller model; 1 where it cannot be made."""
    added = freedom - freedom_more
    if added <= 0 or freedom_more <= 0 or rss_more <= 0.0:
        return 1.0
    from scipy.special import fdtrc  # takes a quarter of a second, and who only hands out specimens reads no log

    return float(fdtrc(added, freedom_more, (rss - rss_more) / added / (rss_more / freedom_more)))


def _left_over(holds: Sequence[Hold], fits: Sequence[_Fit], sigmas: Sequence[float], degree: int) -> float:
    """What a trend of one degree more would still change at the photos, rms over the holds beyond its own noise, in N.

    A relaxation is no polynomial; without any trend nothing is left over.
    """
    if degree == 0:
        return 0.0
    finer = [_Fit.of(hold, degree + 1) for hold in holds]
    excess = [
        (more.value - fit.value) ** 2 - sigma**2 * (more.leverage**2 - fit.leverage**2)
        for fit, more, sigma in zip(fits, finer, sigmas, strict=True)
    ]
    return math.sqrt(max(0.0, sum(excess) / len(excess)))


def _inflation(fits: Sequence[_Fit]) -> float:
    """(1 + rho)/(1 - rho) from the residuals of all holds; at least 1.

    A fit of p parameters to n white samples leaves neighbours correlated by about -p/n; that is added back.
    """
    products = sum(float(fit.residuals[1:] @ fit.residuals[:-1]) for fit in fits)
    squares = sum(float(fit.residuals @ fit.residuals) for fit in fits)
    samples = sum(len(fit.residuals) for fit in fits)
    parameters = sum(len(fit.residuals) - fit.freedom for fit in fits)
    if squares <= 0.0:
        return 1.0
    rho = products / squares + parameters / samples
    noticeable = 2.0 / math.sqrt(samples)  # below two standard errors of rho the samples count as independent
    rho = min(0.95, rho) if rho > noticeable else 0.0
    return (1.0 + rho) / (1.0 - rho)


def _sigmas(fits: Sequence[_Fit], floor: float) -> list[float]:
    """Standard deviation of a sample in each hold: common to all unless Bartlett's test at 1 % says they differ.

    Where they differ each hold keeps its own, drawn with the weight of four samples toward the mean of their
    logarithms: a variance from few samples is itself uncertain, and a single loud hold makes no quiet one uncertain.
    """
    freedom = np.array([fit.freedom for fit in fits], dtype=np.float64)
    rss = np.array([float(fit.residuals @ fit.residuals) for fit in fits])
    pooled = max(float(rss.sum() / freedom.sum()), floor**2)
    used = freedom > 0
    variances = np.maximum(rss[used] / freedom[used], floor**2)
    if np.count_nonzero(used) > 1:
        from scipy.special import chdtrc

        nu, groups = freedom[used], int(np.count_nonzero(used))
        correction = 1.0 + (np.sum(1.0 / nu) - 1.0 / nu.sum()) / (3.0 * (groups - 1))
        statistic = (nu.sum() * math.log(pooled) - float(np.sum(nu * np.log(variances)))) / correction
        if chdtrc(groups - 1, max(statistic, 0.0)) < 0.01:
            # the logarithm of a variance from nu degrees of freedom falls short by 1 / nu in the mean
            usual, weight = math.exp(float(np.sum(nu * np.log(variances) + 1.0)) / nu.sum()), 4.0
            toward = np.where(used, usual, pooled)  # a hold of a single sample may be a loud one
            return [math.sqrt(v) for v in (rss + weight * toward) / (freedom + weight)]
    return [math.sqrt(pooled)] * len(fits)

"""Errors of a fitted curve: of its curvature and place, by light and by what its width varies, and of its length."""

from __future__ import annotations

import numpy as np

from pipeline.records import Array
from pipeline.settings.vision.centerline import CurveSettings
from pipeline.vision.centerline.curve_fit import CurveFit
from pipeline.vision.centerline.midline import slow_part
from rod.measurement import slow_covariance

_WIDTH_EXCESS = 1.5
"""Ratio of the errors by the width's variation to those that scatter and light tell, above which the former count: over
ten effective parameters chance passes it once in a hundred.
"""


def std_along(basis: Array, covariance: Array) -> Array:
    """Standard deviation (n,) of ``basis`` (n, p) times parameters with a covariance (p, p)."""
    return np.asarray(np.sqrt(np.maximum(((basis @ covariance) * basis).sum(axis=1), 0.0)))


def slow_errors(fit: CurveFit, std: float, length: float) -> Array:
    """Covariance of q that a slow error of the midline makes, carried through the fit.

    The light's error follows the direction of the cable against the light, a smooth function of s; that of the edges'
    waves what lies along them: Gaussian correlation.
    """
    return np.asarray(fit.smooth.gain @ slow_covariance(fit.s[fit.weight > 0.0], ((std, length),)) @ fit.smooth.gain.T)


def width_excess(fit: CurveFit, off_width: Array, covariance: Array, options: CurveSettings) -> float:
    """Ratio, at least 1, of the errors of the curvature to those that scatter and light tell.

    The cable's width is constant, so half of what the measured width varies is an error of the edges that no bend of
    the cable can pass for: carried through the fit like the midline's, it is what the midline's errors do to kappa.
    The ratio is that of each point: the ends, ten times less certain than the rest, would speak for all. What of the
    width is slow is the light's, and counts there.
    """
    used = fit.weight > 0.0
    half, s = 0.5 * (off_width - slow_part(fit.s, off_width, options.slow_width_order))[used], fit.s[used]
    bend = fit.curve.curvature_basis(s)
    ratio = float(np.sqrt(np.mean((bend @ (fit.smooth.gain @ half) / std_along(bend, covariance)) ** 2)))
    return ratio if ratio > _WIDTH_EXCESS else 1.0


def length_std(fit: CurveFit, s: Array, normal: Array, covariance: Array) -> float:
    """Standard deviation of the arc length between two fixed points: its change is ``-int kappa dn ds``."""
    row = np.trapezoid(fit.curve.curvature(s)[:, None] * normal, s, axis=0)
    return float(np.sqrt(np.maximum(row @ covariance @ row, 0.0)))

"""Errors of a fitted curve: of its curvature and place, by light, and of its length."""

from __future__ import annotations

import numpy as np

from pipeline.records import Array
from pipeline.vision.centerline.curve_fit import CurveFit
from rod.measurement import slow_covariance


def std_along(basis: Array, covariance: Array) -> Array:
    """Standard deviation (n,) of ``basis`` (n, p) times parameters with a covariance (p, p)."""
    return np.asarray(np.sqrt(np.maximum(((basis @ covariance) * basis).sum(axis=1), 0.0)))


def slow_errors(fit: CurveFit, std: float, length: float) -> Array:
    """Covariance of q that a slow error of the midline makes, carried through the fit.

    The light's error follows the direction of the cable against the light, a smooth function of s; that of the edges'
    waves what lies along them: Gaussian correlation.
    """
    return np.asarray(fit.smooth.gain @ slow_covariance(fit.s[fit.weight > 0.0], ((std, length),)) @ fit.smooth.gain.T)


def length_std(fit: CurveFit, s: Array, normal: Array, covariance: Array) -> float:
    """Standard deviation of the arc length between two fixed points: its change is ``-int kappa dn ds``."""
    row = np.trapezoid(fit.curve.curvature(s)[:, None] * normal, s, axis=0)
    return float(np.sqrt(np.maximum(row @ covariance @ row, 0.0)))

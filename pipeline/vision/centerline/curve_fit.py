"""Curve through points along a cable: a penalised spline of the curvature, with joint covariance.

The spline covers the whole range, the parts without points included: there the curve is continued by the penalty, with
the uncertainty that follows from it. Gauss-Newton on the distances along the normal; each linear step is a penalised
least-squares problem, whitened for errors with correlation ``exp(-ds/l)`` and solved by QR of the stacked
``[R; sqrt(mu) D]`` (`pipeline.vision.centerline.smoothing`). The penalty ``int (d^k kappa / ds^k)^2 ds`` has its
weight, and the noise its correlation length, by restricted maximum likelihood; what is left open about the weight goes
into the covariance.

Never is ``kappa`` or its slope forced at the ends: moment-free ends carry ``kappa = K0`` with a finite slope.
``s`` along the curve, lengths in any one unit, axes those of the points.

Source: O'Sullivan (1986) for the penalty; Patterson and Thompson (1971) and Wahba (1983) for REML and the posterior
covariance; the reasons for a spline of the curvature are measured in the tests.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.records import Array
from pipeline.vision.centerline.curvature import PENALTY_ORDER, Frame, PlaneCurve
from pipeline.vision.centerline.smoothing import Problem, Smooth
from pipeline.vision.median import median, scatter
from rod.measurement import slow_covariance

_BIAS_SHARE = 0.5
"""Part of the penalty's bias that counts as uncertainty: an equilibrium is smoother than the penalty's random walk;
with 1 the 95 % band of kappa covered 98.6 % of smooth bows, with 0 92 %, with 0.5 97 %.
"""


@dataclass(frozen=True)
class CurveFit:
    """A curve fitted to points, with what is known of its errors.

    Attributes
    ----------
    smooth : Smooth
        Covariance of q and gain on the points' normal displacements.
    points : (n, 2)
    std : (n,)
        As given; the errors are ``smooth.sigma`` times that.
    s : (n,)
        Feet of the points.
    residual : (n,)
        Distances of the points along the normal, positive to the left of the curve.
    weight : (n,)
        Robust weight of each point; 1 for all that agree with their neighbours.
    """

    curve: PlaneCurve
    smooth: Smooth
    points: Array
    std: Array
    s: Array
    residual: Array
    weight: Array

    @property
    def point_std(self) -> Array:
        """Standard deviation of every point (n,), larger where it counts less."""
        return np.asarray(self.smooth.sigma * self.std / np.sqrt(np.maximum(self.weight, 1e-9)))


def initial_curve(points: Array, s: Array, frame: Frame) -> PlaneCurve:
    """Curve whose angle follows that of a polyline ``points`` ``(n, 2)`` at ``s``, smoothed firmly; a start only."""
    step = np.diff(points, axis=0)
    theta, middle = np.unwrap(np.arctan2(step[:, 1], step[:, 0])), 0.5 * (s[1:] + s[:-1])
    # The nearest of the frame's own places: they lie closer than the points of any polyline that is a start.
    nearest = np.rint(np.interp(middle, frame.grid, np.arange(len(frame.grid)))).astype(int)
    turns = np.column_stack([np.ones(len(middle)), frame.integrals[nearest]])
    weight = np.sqrt(np.hypot(*step.T))
    penalty = np.column_stack([np.zeros(len(frame.penalty)), frame.penalty])
    # A share of 1e-6 leaves wiggles longer than about a fifth of the range: the shape, not the noise of the polyline.
    penalty *= 1e-3 * np.linalg.norm(turns * weight[:, None]) / np.linalg.norm(penalty)
    weighted = turns * weight[:, None]
    # Normal equations lose half the digits, which a start can spare.
    solution = np.linalg.solve(weighted.T @ weighted + penalty.T @ penalty, weighted.T @ (theta * weight))
    curve = PlaneCurve(frame, solution[1:], np.zeros(2), float(solution[0]))
    return PlaneCurve(frame, solution[1:], np.mean(points - curve.at(s)[0], axis=0), float(solution[0]))


def fit_curve(points: Array, std: Array, *, start: PlaneCurve, s: Array, longest: float) -> CurveFit:
    """Curve through points ``(n, 2)`` with relative errors ``std`` ``(n,)`` along the normal, by Gauss-Newton.

    Parameters
    ----------
    start : PlaneCurve
        First guess, as `initial_curve` gives; carries the knots.
    s : (n,)
        Guess of the points' arc lengths, ascending.
    longest : length
        Bound of the errors' correlation length: longer errors cannot be told from the curve.
    """
    curve, weight, moved = start, np.ones(len(points)), 0.0
    # The correlation is sought once, when the curve is nearly there: each search costs seven factorisations.
    length = median(np.diff(s))
    for iteration in range(8):
        s, residual = _step_to_foot(curve, points, s)
        spread = max(scatter(residual / std, 0.0), 1e-12)
        if iteration:
            # A step leaves less than a tenth of its length: points as near as that may still be the curve's. A gap
            # among them starts the fit pixels off, and all beyond it would count as outliers.
            weight = _biweight(residual / std, max(spread, 0.1 * moved))
        before, problem = curve, _linear(curve, s, residual, std, weight)
        if iteration == 1:
            length = problem.correlation_length(longest)
        step = problem.estimate(length) - before.parameters
        curve = before.moved(step)
        moved = float(np.max(np.abs(problem.design @ step)) / median(std))
        # A hundredth of a point's error: the curve's own is a tenth to a third of it.
        if iteration > 1 and moved < 0.01 * spread:
            break
    smooth = problem.smooth(length, bias_share=_BIAS_SHARE)
    curve = before.moved(smooth.estimate - before.parameters)
    s, residual = _step_to_foot(curve, points, curve.foot(points, s, steps=1))
    return CurveFit(curve, smooth, points, std, s, residual, weight)


def follow_points(points: Array, *, start: PlaneCurve, s: Array) -> PlaneCurve:
    """Smooth curve along most of the points ``(n, 2)``, of equal errors, for the next search: no covariance."""
    even, curve, apart = np.ones(len(points)), start, median(np.diff(s))
    weight = even
    for _ in range(2):
        s, residual = _step_to_foot(curve, points, s)
        curve = curve.moved(_linear(curve, s, residual, even, weight).estimate(apart) - curve.parameters)
        _, left = _step_to_foot(curve, points, s)
        weight = _biweight(left, max(scatter(left, 0.0), 1e-12))
    return curve


def _linear(curve: PlaneCurve, s: Array, residual: Array, std: Array, weight: Array) -> Problem:
    """Distances along the normal, linear in q; points without weight left out."""
    used = weight > 0.0
    normal = curve.normal_basis(s[used])
    return Problem(
        design=normal,
        data=residual[used] + normal[:, 2:] @ curve.coefficients,
        penalty=curve.frame.penalty,
        null=2 + PENALTY_ORDER,
        std=std[used] / np.sqrt(weight[used]),
        position=s[used],
        least=rms_of_bow(curve, PENALTY_ORDER) ** 2 * float(np.ptp(curve.frame.knots)),
    )


def rms_of_bow(curve: PlaneCurve, order: int) -> float:
    """Rms of ``d^k kappa / ds^k`` of a half wave from end to end whose curvature varies as much as the curve's.

    An elastica between two bearings obeys ``kappa'' = -(P / EI) kappa``: it is no parabola, however little of the rest
    the photo shows. A sine of amplitude A has the variance ``A^2 (1/2 - 4/pi^2)``.
    """
    amplitude2 = float(np.var(curve.frame.values @ curve.coefficients)) / (0.5 - 4.0 / np.pi**2)
    return float(np.sqrt(0.5 * amplitude2) * (np.pi / np.ptp(curve.frame.knots)) ** order)


def _step_to_foot(curve: PlaneCurve, points: Array, s: Array) -> tuple[Array, Array]:
    """Feet of points near ``s``, and the distances along the normal.

    One evaluation serves both: a foot missed by ds changes the distance by ``kappa ds^2 / 2``, nothing for a point near
    the curve.
    """
    where, angle = curve.at(s)
    cos, sin = np.cos(angle), np.sin(angle)
    du, dv = points[:, 0] - where[:, 0], points[:, 1] - where[:, 1]
    return s + cos * du + sin * dv, cos * dv - sin * du


def _biweight(residual: Array, spread: float) -> Array:
    """Weights: 1 up to four spreads, which Gaussian errors pass once in 16,000, falling to 0 at six."""
    beyond = np.clip((np.abs(residual) / spread - 4.0) / 2.0, 0.0, 1.0)
    return np.asarray((1.0 - beyond**2) ** 2)


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

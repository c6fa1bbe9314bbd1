"""Curve through points along a cable: a penalised spline of the curvature, integrated twice, with joint covariance.

    kappa(s) = sum_j c_j B_j(s),   theta(s) = theta_a + int kappa ds,
    (x, y)(s) = (x, y)_a + int (cos theta, sin theta) ds

``s`` runs along the curve, ``kappa = d theta / ds`` in the axes of the points, whatever they are; lengths in any one
unit. ``B_j`` are cubic B-splines on evenly spaced knots over the whole range, the parts without points included: there
the curve is continued by the penalty, with the uncertainty that follows from it.

Parameters ``q = (offset, turn, c_1 .. c_J)``: displacement of the anchor (mid-range) along its normal, its angle, the
spline. The anchor moves along its normal only, else the curve could slide along itself. Gauss-Newton on the distances
along the normal; each linear step is a penalised least-squares problem, whitened for errors with correlation
``exp(-ds/l)`` and solved by QR of the stacked ``[R; sqrt(mu) D]``.
The penalty ``int (d^k kappa / ds^k)^2 ds`` has its weight, and the noise its correlation length, by restricted maximum
likelihood; what is left open about the weight goes into the covariance.

Never is ``kappa`` or its slope forced at the ends: moment-free ends carry ``kappa = K0`` with a finite slope.

Source: O'Sullivan (1986) for the penalty; Patterson and Thompson (1971) and Wahba (1983) for REML and the posterior
covariance; the reasons for a spline of the curvature are measured in the tests.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from pipeline.records import Array
from pipeline.vision.smoothing import Problem, Smooth

DEGREE = 3
_CELLS = 256  # of quadrature, about: leaves 2e-9 of the length at a turn of 0.03 rad per cell


@dataclass(frozen=True)
class Frame:
    """Knots with everything that depends on them alone.

    Attributes
    ----------
    knots : (J + 4,)
    grid : (2 G + 1,)
        Ends and middles of the cells of quadrature.
    anchor : int
        Index of the anchor in ``grid``; even.
    values, integrals : (2 G + 1, J)
        Splines and their integrals from the anchor.
    penalty : (d, J)
        Root of the penalty: ``|penalty @ c|^2 = int (d^k kappa / ds^k)^2 ds``.
    """

    knots: Array
    grid: Array
    anchor: int
    values: Array
    integrals: Array
    penalty: Array

    @property
    def size(self) -> int:
        """Number of parameters q."""
        return int(self.values.shape[1]) + 2


def make_frame(start: float, end: float, *, intervals: int, order: int, breaks: tuple[float, ...] = ()) -> Frame:
    """Knots from ``start`` to ``end``; at each of ``breaks`` the slope of the curvature may jump (a point load).

    Raises
    ------
    ValueError
        If a break lies outside the range or ``intervals`` is below 4.
    """
    if intervals < 4 or not end > start:
        raise ValueError("a curvature spline needs end > start and at least 4 intervals")
    if any(not start < at < end for at in breaks):
        raise ValueError("a break must lie inside the range")
    inner = np.linspace(start, end, intervals + 1)[1:-1]
    if breaks:  # no knot closer than half an interval to a break, which has multiplicity 3
        gap = np.abs(inner[:, None] - np.asarray(breaks)).min(axis=1)
        inner = np.sort(np.r_[inner[gap > 0.5 * (end - start) / intervals], np.repeat(breaks, DEGREE)])
    knots = np.r_[[start] * (DEGREE + 1), inner, [end] * (DEGREE + 1)]
    count = len(knots) - DEGREE - 1
    spline = BSpline(knots, np.eye(count), DEGREE)
    edges = np.unique(knots)
    each = max(2, round(_CELLS / intervals)) + 1
    nodes = np.interp(np.arange((each - 1) * (len(edges) - 1) + 1) / (each - 1), np.arange(len(edges)), edges)
    grid = np.empty(2 * len(nodes) - 1)
    grid[::2], grid[1::2] = nodes, 0.5 * (nodes[1:] + nodes[:-1])
    anchor = 2 * (len(nodes) // 2)
    integral = spline.antiderivative()(grid)
    return Frame(knots, grid, anchor, spline(grid), integral - integral[anchor], _penalty(spline, edges, order))


def _penalty(spline: BSpline, edges: Array, order: int) -> Array:
    abscissae, weights = np.polynomial.legendre.leggauss(max(1, DEGREE + 1 - order))  # exact for the square
    half = 0.5 * np.diff(edges)
    at = (0.5 * (edges[1:] + edges[:-1])[:, None] + half[:, None] * abscissae).ravel()
    return np.asarray(np.sqrt(np.outer(half, weights)).ravel()[:, None] * spline(at, nu=order))


class _Nodes(NamedTuple):
    """Grid nodes, angles and tangents on the whole grid, and the position's coefficients ``(cells, 2)`` by power."""

    s: Array
    theta: Array
    tangent: Array
    position: tuple[Array, Array, Array, Array]


@dataclass(frozen=True)
class PlaneCurve:
    """A curve: frame, spline coefficients ``(J,)``, point ``(2,)`` and angle of the anchor."""

    frame: Frame
    coefficients: Array
    point: Array
    angle: float

    @property
    def parameters(self) -> Array:
        """Parameters q ``(J + 2,)``; offset and turn count from here, so they are zero."""
        return np.concatenate([np.zeros(2), self.coefficients])

    def curvature(self, s: Array) -> Array:
        """Curvature at ``s`` (d theta / ds)."""
        return np.asarray(BSpline(self.frame.knots, self.coefficients, DEGREE)(s))

    @cached_property
    def _nodes(self) -> _Nodes:
        frame = self.frame
        theta = self.angle + frame.integrals @ self.coefficients
        tangent = np.column_stack([np.cos(theta), np.sin(theta)])
        nodes = frame.grid[::2]
        points = self.point + _integrate(tangent, frame.grid, frame.anchor)
        # Cubic Hermite pieces in powers of the share of the cell: the tangents are known.
        width = np.diff(nodes)[:, None]
        step, first, last = np.diff(points, axis=0), width * tangent[:-2:2], width * tangent[2::2]
        return _Nodes(nodes, theta, tangent, (points[:-1], first, 3 * step - 2 * first - last, first + last - 2 * step))

    def at(self, s: Array) -> tuple[Array, Array]:
        """Points ``(n, 2)`` and angles ``(n,)`` at ``s``; beyond the range the curve goes on straight."""
        nodes, theta, _, (c0, c1, c2, c3) = self._nodes
        inside = np.clip(s, nodes[0], nodes[-1])
        cell = np.clip(np.searchsorted(nodes, inside) - 1, 0, len(nodes) - 2)
        # The angle by the parabola through both ends and the middle of the cell.
        t = (inside - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
        a, m, b = theta[2 * cell], theta[2 * cell + 1], theta[2 * cell + 2]
        angle = a * (1 - t) * (1 - 2 * t) + 4 * m * t * (1 - t) + b * t * (2 * t - 1)
        f = t[:, None]
        where = c0[cell] + f * (c1[cell] + f * (c2[cell] + f * c3[cell]))
        beyond = np.asarray(s) - inside
        if beyond.any():
            where = where + beyond[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        return where, angle

    def foot(self, points: Array, s: Array, *, steps: int = 3) -> Array:
        """Arc length of the feet of points ``(n, 2)``, from a guess ``s``; Newton steps without the curvature."""
        for _ in range(steps):
            where, angle = self.at(s)
            s = s + np.cos(angle) * (points[:, 0] - where[:, 0]) + np.sin(angle) * (points[:, 1] - where[:, 1])
        return s

    def bases(self, s: Array) -> tuple[Array, Array, Array]:
        """Derivatives ``(n, J + 2)`` of normal displacement, angle and curvature at ``s`` with respect to q."""
        frame = self.frame
        inside = np.clip(s, frame.knots[0], frame.knots[-1])
        spline = BSpline(frame.knots, np.eye(frame.size - 2), DEGREE)
        turn = spline.antiderivative()(inside) - spline.antiderivative()(frame.grid[frame.anchor])
        zero, one = np.zeros((len(inside), 1)), np.ones((len(inside), 1))
        return self.normal_basis(s), np.column_stack([zero, one, turn]), np.column_stack([zero, zero, spline(inside)])

    def normal_basis(self, s: Array) -> Array:
        """Derivatives ``(n, J + 2)`` of the displacement along the normal at ``s`` with respect to q."""
        frame = self.frame
        nodes, theta, tangent, _ = self._nodes
        turns = np.column_stack([np.ones(len(theta)), frame.integrals])  # of the angle, by turn and coefficients
        along_x = _integrate(-tangent[:, 1:] * turns, frame.grid, frame.anchor)
        along_y = _integrate(tangent[:, :1] * turns, frame.grid, frame.anchor)
        inside = np.clip(s, nodes[0], nodes[-1])
        cell = np.clip(np.searchsorted(nodes, inside) - 1, 0, len(nodes) - 2)
        f = ((inside - nodes[cell]) / (nodes[cell + 1] - nodes[cell]))[:, None]
        angle = self.at(inside)[1]
        sin, cos = np.sin(angle)[:, None], np.cos(angle)[:, None]
        moved_x, moved_y = (a[cell] * (1.0 - f) + a[cell + 1] * f for a in (along_x, along_y))
        normal = -sin * moved_x + cos * moved_y
        beyond = np.asarray(s) - inside
        if beyond.any():
            nearest = 2 * np.where(beyond < 0.0, 0, len(nodes) - 1)
            normal += beyond[:, None] * turns[nearest]
        return np.column_stack([np.cos(angle - theta[frame.anchor]), normal])

    def moved(self, step: Array) -> PlaneCurve:
        """The curve after a change ``(J + 2,)`` of q."""
        at = self.angle
        point = self.point + step[0] * np.array([-np.sin(at), np.cos(at)])
        return PlaneCurve(self.frame, self.coefficients + step[2:], point, float(at + step[1]))


def _integrate(values: Array, grid: Array, anchor: int) -> Array:
    """Simpson's integral from the anchor to the nodes ``grid[::2]``, of values on ``grid``."""
    cells = (values[:-2:2] + 4.0 * values[1::2] + values[2::2]) * ((grid[2::2] - grid[:-2:2]) / 6.0)[:, None]
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(cells, axis=0)])
    return np.asarray(total - total[anchor // 2])


@dataclass(frozen=True)
class CurveFit:
    """A curve fitted to points, with what is known of its errors.

    Attributes
    ----------
    curve : PlaneCurve
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


def initial_curve(points: Array, s: Array, frame: Frame) -> PlaneCurve:
    """Curve whose angle follows that of a polyline ``points`` ``(n, 2)`` at ``s``, smoothed firmly; a start only."""
    step = np.diff(points, axis=0)
    theta, middle = np.unwrap(np.arctan2(step[:, 1], step[:, 0])), 0.5 * (s[1:] + s[:-1])
    spline = BSpline(frame.knots, np.eye(frame.size - 2), DEGREE).antiderivative()
    at_anchor = spline(frame.grid[frame.anchor])
    turns = np.column_stack([np.ones(len(middle)), spline(middle) - at_anchor])
    weight = np.sqrt(np.hypot(*step.T))
    penalty = np.column_stack([np.zeros(len(frame.penalty)), frame.penalty])
    # A share of 1e-6 leaves wiggles longer than about a fifth of the range: the shape, not the noise of the polyline.
    penalty *= 1e-3 * np.linalg.norm(turns * weight[:, None]) / np.linalg.norm(penalty)
    weighted = turns * weight[:, None]
    # Normal equations lose half the digits, which a start can spare.
    solution = np.linalg.solve(weighted.T @ weighted + penalty.T @ penalty, weighted.T @ (theta * weight))
    curve = PlaneCurve(frame, solution[1:], np.zeros(2), float(solution[0]))
    return PlaneCurve(frame, solution[1:], np.mean(points - curve.at(s)[0], axis=0), float(solution[0]))


def fit_curve(
    points: Array,
    std: Array,
    *,
    start: PlaneCurve,
    s: Array,
    order: int,
    longest: float,
    correlation_length: float | None = None,
    iterations: int = 8,
    bias_share: float = 0.5,
) -> CurveFit:
    """Curve through points ``(n, 2)`` with relative errors ``std`` ``(n,)`` along the normal, by Gauss-Newton.

    Parameters
    ----------
    start : PlaneCurve
        First guess, as `initial_curve` gives; carries the knots.
    s : (n,)
        Guess of the points' arc lengths, ascending.
    order : int
        Order of the penalised derivative of the curvature, as in `make_frame`.
    longest : length
        Bound of the correlation length: longer errors cannot be told from the curve.
    correlation_length : length, optional
        Of the errors; sought if not given.
    bias_share : float
        Part of the penalty's bias that counts as uncertainty; see `pipeline.vision.smoothing.Problem.smooth`.
        Equilibria of a cable are smoother than the penalty's random walk: all of it would be too much.
    """
    curve, s, weight, length = _settle(
        points,
        std,
        start,
        s,
        order=order,
        longest=longest,
        correlation_length=correlation_length,
        iterations=iterations,
    )
    s, residual = _step_to_foot(curve, points, s)
    smooth = _linear(curve, s, residual, std, weight, order).smooth(length, bias_share=bias_share)
    curve = curve.moved(smooth.estimate - curve.parameters)
    s, residual = _step_to_foot(curve, points, curve.foot(points, s, steps=1))
    return CurveFit(curve, smooth, points, std, s, residual, weight)


def follow_points(points: Array, *, start: PlaneCurve, s: Array, order: int) -> PlaneCurve:
    """Smooth curve along points ``(n, 2)`` of equal errors, for the next search: two steps, no covariance."""
    spacing = float(np.median(np.diff(s)))
    return _settle(
        points, np.ones(len(points)), start, s, order=order, longest=spacing, correlation_length=spacing, iterations=2
    )[0]


def _settle(
    points: Array,
    std: Array,
    curve: PlaneCurve,
    s: Array,
    *,
    order: int,
    longest: float,
    correlation_length: float | None,
    iterations: int,
) -> tuple[PlaneCurve, Array, Array, float]:
    """Gauss-Newton with robust weights: curve, feet of the points, their weights and correlation length."""
    weight = np.ones(len(points))
    # The correlation is sought once, when the curve is nearly there: each search costs seven factorisations.
    length = float(np.median(np.diff(s))) if correlation_length is None else correlation_length
    for iteration in range(iterations):
        s, residual = _step_to_foot(curve, points, s)
        spread = max(1.4826 * float(np.median(np.abs(residual / std))), 1e-12)
        if iteration:
            weight = _biweight(residual / std, spread)
        problem = _linear(curve, s, residual, std, weight, order)
        if iteration == 1 and correlation_length is None:
            length = problem.correlation_length(longest)
        step = problem.estimate(length) - curve.parameters
        curve = curve.moved(step)
        # A hundredth of a point's error: the curve's own is a tenth to a third of it.
        if iteration > 1 and np.max(np.abs(problem.design @ step)) < 0.01 * spread * np.median(std):
            break
    return curve, s, weight, length


def _linear(curve: PlaneCurve, s: Array, residual: Array, std: Array, weight: Array, order: int) -> Problem:
    """Distances along the normal, linear in q; points without weight left out."""
    used = weight > 0.0
    normal = curve.normal_basis(s[used])
    return Problem(
        design=normal,
        data=residual[used] + normal[:, 2:] @ curve.coefficients,
        penalty=curve.frame.penalty,
        null=2 + order,
        std=std[used] / np.sqrt(weight[used]),
        position=s[used],
        least=_bow_roughness(curve, order),
    )


def _bow_roughness(curve: PlaneCurve, order: int) -> float:
    """``int (d^k kappa / ds^k)^2 ds`` of a half wave from end to end whose curvature varies as much as the curve's.

    An elastica between two bearings obeys ``kappa'' = -(P / EI) kappa``: it is no parabola, however little of the rest
    the photo shows. A sine of amplitude A has the variance ``A^2 (1/2 - 4/pi^2)``.
    """
    knots = curve.frame.knots
    length = float(knots[-1] - knots[0])
    amplitude2 = float(np.var(curve.frame.values @ curve.coefficients)) / (0.5 - 4.0 / np.pi**2)
    return amplitude2 * 0.5 * length * float((np.pi / length) ** (2 * order))


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

"""Plane curve with a cubic spline for its curvature, integrated twice, and its derivatives by all parameters.

    kappa(s) = sum_j c_j B_j(s),   theta(s) = theta_a + int kappa ds,
    (x, y)(s) = (x, y)_a + int (cos theta, sin theta) ds

``s`` runs along the curve, ``kappa = d theta / ds`` in the axes of the points, whatever they are; lengths in any one
unit. ``B_j`` are cubic B-splines on evenly spaced knots over the whole range.

Parameters ``q = (offset, turn, c_1 .. c_J)``: displacement of the anchor (mid-range) along its normal, its angle, the
spline. The anchor moves along its normal only, else the curve could slide along itself.
`pipeline.vision.centerline.curve_fit` lays such curves through points.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline, CubicHermiteSpline

from pipeline.records import Array

DEGREE = 3
PENALTY_ORDER = 3
"""Derivative of kappa that is penalised: 3 leaves a parabola free, the bow's first shape; 2 was 30 % worse inside the
span.
"""


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
        Root of the penalty: ``|penalty @ c|^2 = int (d^k kappa / ds^k)^2 ds``, k as `PENALTY_ORDER`.
    """

    knots: Array
    grid: Array
    anchor: int
    values: Array
    integrals: Array
    penalty: Array

    @cached_property
    def turns(self) -> Array:
        """Derivatives ``(2 G + 1, J + 1)`` of the angle on the grid by turn and coefficients."""
        return np.column_stack([np.ones(len(self.grid)), self.integrals])

    @property
    def size(self) -> int:
        """Number of parameters q."""
        return int(self.values.shape[1]) + 2


def make_frame(length: float, *, intervals: int) -> Frame:
    """Even knots from 0 to ``length``.

    Raises
    ------
    ValueError
        If there is no length or ``intervals`` is below 4.
    """
    if intervals < 4 or not length > 0.0:
        raise ValueError("a curvature spline needs a length and at least 4 intervals")
    unit = _unit_frame(intervals)
    return Frame(
        knots=length * unit.knots,
        grid=length * unit.grid,
        anchor=unit.anchor,
        values=unit.values,
        integrals=length * unit.integrals,
        penalty=length ** (0.5 - PENALTY_ORDER) * unit.penalty,
    )


@cache
def _unit_frame(intervals: int) -> Frame:
    """Even knots from 0 to 1: the same for all photos, whatever the length of the cable on them."""
    edges = np.linspace(0.0, 1.0, intervals + 1)
    knots = np.r_[[0.0] * DEGREE, edges, [1.0] * DEGREE]
    spline = BSpline(knots, np.eye(intervals + DEGREE), DEGREE)
    # About 192 cells of quadrature leave 6e-9 of the length at a turn of 0.04 rad per cell.
    nodes = np.linspace(0.0, 1.0, intervals * max(2, round(192 / intervals)) + 1)
    grid = np.empty(2 * len(nodes) - 1)
    grid[::2], grid[1::2] = nodes, 0.5 * (nodes[1:] + nodes[:-1])
    anchor = 2 * (len(nodes) // 2)
    integral = spline.antiderivative()(grid)
    return Frame(knots, grid, anchor, spline(grid), integral - integral[anchor], _penalty(spline, edges))


def _penalty(spline: BSpline, edges: Array) -> Array:
    abscissae, weights = np.polynomial.legendre.leggauss(DEGREE + 1 - PENALTY_ORDER)  # exact for the square
    half = 0.5 * np.diff(edges)
    at = (0.5 * (edges[1:] + edges[:-1])[:, None] + half[:, None] * abscissae).ravel()
    return np.asarray(np.sqrt(np.outer(half, weights)).ravel()[:, None] * spline(at, nu=PENALTY_ORDER))


class _Nodes(NamedTuple):
    """Grid nodes, angles and tangents on the whole grid, and cubics of x, y and theta between the nodes."""

    s: Array
    theta: Array
    tangent: Array
    pieces: CubicHermiteSpline[np.float64]


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
        bend = frame.values[::2] @ self.coefficients
        pieces = CubicHermiteSpline(nodes, np.c_[points, theta[::2]], np.c_[tangent[::2], bend])
        return _Nodes(nodes, theta, tangent, pieces)

    def at(self, s: Array) -> tuple[Array, Array]:
        """Points ``(n, 2)`` and angles ``(n,)`` at ``s``; beyond the range the curve goes on straight."""
        nodes, _, _, pieces = self._nodes
        inside = np.clip(s, nodes[0], nodes[-1])
        found = pieces(inside)
        where, angle = found[:, :2], found[:, 2]
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
        splines = BSpline(frame.knots, np.eye(frame.size - 2), DEGREE)
        whole = splines.antiderivative()
        turn = whole(inside) - whole(frame.grid[frame.anchor])
        zero, one = np.zeros((len(inside), 1)), np.ones((len(inside), 1))
        bend = np.column_stack([zero, zero, splines(inside)])
        return self.normal_basis(s), np.column_stack([zero, one, turn]), bend

    def normal_basis(self, s: Array) -> Array:
        """Derivatives ``(n, J + 2)`` of the displacement along the normal at ``s`` with respect to q."""
        frame = self.frame
        nodes, theta, tangent, _ = self._nodes
        along_x = _integrate(-tangent[:, 1:] * frame.turns, frame.grid, frame.anchor)
        along_y = _integrate(tangent[:, :1] * frame.turns, frame.grid, frame.anchor)
        inside = np.clip(s, nodes[0], nodes[-1])
        cell = np.clip(np.searchsorted(nodes, inside) - 1, 0, len(nodes) - 2)
        f = ((inside - nodes[cell]) / (nodes[cell + 1] - nodes[cell]))[:, None]
        angle = self.at(inside)[1]
        sin, cos = np.sin(angle)[:, None], np.cos(angle)[:, None]
        near, far = 1.0 - f, f
        normal = (cos * near) * along_y.take(cell, axis=0) + (cos * far) * along_y.take(cell + 1, axis=0)
        normal -= (sin * near) * along_x.take(cell, axis=0) + (sin * far) * along_x.take(cell + 1, axis=0)
        beyond = np.asarray(s) - inside
        if beyond.any():
            nearest = 2 * np.where(beyond < 0.0, 0, len(nodes) - 1)
            normal += beyond[:, None] * frame.turns[nearest]
        return np.column_stack([np.cos(angle - theta[frame.anchor]), normal])

    def moved(self, step: Array) -> PlaneCurve:
        """The curve after a change ``(J + 2,)`` of q."""
        point = self.point + step[0] * np.array([-np.sin(self.angle), np.cos(self.angle)])
        return PlaneCurve(self.frame, self.coefficients + step[2:], point, float(self.angle + step[1]))


def normals(angle: Array) -> Array:
    """Unit normals ``(n, 2)`` of tangents at some angles ``(n,)``."""
    return np.column_stack([-np.sin(angle), np.cos(angle)])


def _integrate(values: Array, grid: Array, anchor: int) -> Array:
    """Simpson's integral from the anchor to the nodes ``grid[::2]``, of values on ``grid``."""
    cells = (values[:-2:2] + 4.0 * values[1::2] + values[2::2]) * ((grid[2::2] - grid[:-2:2]) / 6.0)[:, None]
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(cells, axis=0)])
    return np.asarray(total - total[anchor // 2])

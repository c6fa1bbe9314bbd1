"""Distance of a measured midline from a simulated shape, along the simulated normal, with exact derivatives.

Measured points lie in the chord frame of their photo. The true frame differs by the errors of the bearing axes and of
the scale: ``true = left + (1 + scale) R(roll) measured`` with ``left`` = (along, across) of the left axis and
``roll = (across_right - across_left) / chord``. The foot of each point on the simulated curve is found by Newton's
method, so sliding along the curve costs nothing; at the foot the derivative of the distance with respect to anything
that moves the curve is minus its normal displacement there.

Axes and signs: chord frame of `rod.measurement`; distance positive along ``(-sin theta, cos theta)``, measured minus
simulated; SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rod.measurement import MeasuredShape
from rod.midline import Midline

Array = NDArray[np.float64]

FEET = 3
"""Newton steps to the feet: from a start within a tenth of a radius of curvature three leave less than 1e-9 m."""


@dataclass(frozen=True)
class Simulated:
    """Shape and force of one simulated step, with derivatives by the q parameters of the rod.

    Attributes
    ----------
    s, x, y, theta, kappa : (n,) m, m, m, rad, 1/m
        At the vertices.
    force : N
    x_by, y_by, theta_by : (n, q) m, m, rad
    force_by : (q,) N
    """

    s: Array
    x: Array
    y: Array
    theta: Array
    kappa: Array
    force: float
    x_by: Array
    y_by: Array
    theta_by: Array
    force_by: Array


@dataclass(frozen=True)
class Pose:
    """Error of the chord frame of one photo: both axes along and across the chord (m), and the common scale."""

    left_along: float
    left_across: float
    right_along: float
    right_across: float
    scale: float


@dataclass(frozen=True)
class Distance:
    """Distances of the points of a midline (b,) m, and derivatives.

    ``by_model`` (b, q) is minus the normal displacement at the foot; ``by_pose`` (b, 5) in the order of `Pose`, with
    the imposed chord held, whose change is the model's; ``s`` (b,) m are the feet on the simulated curve.
    """

    value: Array
    by_model: Array
    by_pose: Array
    s: Array


def distance(data: Midline, shape: Simulated, pose: Pose, chord: float) -> Distance:
    """Distances of a midline from a simulated shape.

    Parameters
    ----------
    data : Midline
    shape : Simulated
    pose : Pose
    chord : m
        Of the photo; turns the sideways errors of the axes into a roll.
    """
    turned_x, turned_y = _turned(data.x, data.y, pose, chord)
    stretch = 1.0 + pose.scale
    value, s, nx, ny = _feet(
        shape, data.s * stretch, pose.left_along + stretch * turned_x, pose.left_across + stretch * turned_y
    )
    moved = nx[:, None] * _between(shape.s, s, shape.x_by, -np.sin(shape.theta)[:, None] * shape.theta_by)
    moved += ny[:, None] * _between(shape.s, s, shape.y_by, np.cos(shape.theta)[:, None] * shape.theta_by)
    spin = stretch / chord * (nx * -turned_y + ny * turned_x)
    by_pose = np.column_stack([nx, ny - spin, np.zeros_like(nx), spin, nx * turned_x + ny * turned_y])
    return Distance(value, -moved, by_pose, s)


def curve_distance(curve: MeasuredShape, shape: Simulated, pose: Pose, chord: float) -> tuple[Array, Array]:
    """Distance of the smooth curve of a photo from a simulated shape at its n points, and their feet, (n,) m each."""
    x, y = _turned(curve.x, curve.y, pose, chord)
    stretch = 1.0 + pose.scale
    return _feet(shape, curve.s * stretch, pose.left_along + stretch * x, pose.left_across + stretch * y)[:2]


def _turned(x: Array, y: Array, pose: Pose, chord: float) -> tuple[Array, Array]:
    roll = (pose.right_across - pose.left_across) / chord
    c, sn = np.cos(roll), np.sin(roll)
    return c * x - sn * y, sn * x + c * y


def _feet(shape: Simulated, guess: Array, px: Array, py: Array) -> tuple[Array, Array, Array, Array]:
    """Distance of points (px, py) from the curve, arc length of their feet, and the normal there."""
    s = np.clip(guess, shape.s[0], shape.s[-1])
    state = np.column_stack([shape.x, shape.y, shape.theta])
    slope = np.column_stack([np.cos(shape.theta), np.sin(shape.theta), -shape.kappa])
    for _ in range(FEET):
        x, y, theta = _between(shape.s, s, state, slope).T
        along = np.cos(theta) * (px - x) + np.sin(theta) * (py - y)
        across = -np.sin(theta) * (px - x) + np.cos(theta) * (py - y)
        # theta falls by kappa ds, so a point off the curve by `across` sees the arc length stretched.
        s = s + along / np.maximum(1.0 + np.interp(s, shape.s, shape.kappa) * across, 0.2)
    x, y, theta = _between(shape.s, s, state, slope).T
    nx, ny = -np.sin(theta), np.cos(theta)
    return nx * (px - x) + ny * (py - y), s, nx, ny


def _between(grid: Array, s: Array, value: Array, slope: Array) -> Array:
    """Cubic Hermite interpolation of values and slopes (n, q) on a grid (n,) at s (b,), to (b, q)."""
    cell = np.clip(np.searchsorted(grid, s) - 1, 0, grid.size - 2)
    h = grid[cell + 1] - grid[cell]
    t, h = ((s - grid[cell]) / h)[:, None], h[:, None]
    start, end = value[cell], value[cell + 1]
    rise = t**2 * (3.0 - 2.0 * t)
    curve = t * (1.0 - t) * h * ((1.0 - t) * slope[cell] - t * slope[cell + 1])
    return np.asarray(start + rise * (end - start) + curve)

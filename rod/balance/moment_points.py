"""What one photo says of the law K(m): its moment ``m(s) = P y(s)`` and the positions that a curvature leads to.

Along the seen cable the moment is known from the photo alone (Eq. 13). A law and K0 make of it a curvature K(s), and
that, integrated twice from axis to axis, a midline. It is held against the raw midline of the photo, not the curvature
against that of a smooth curve: what smoothing rounds off, and how its error runs along the cable, need not be known.
The smooth curve R(s) with tangent t, normal n and curvature K_c is what positions are counted from. To first order in
K - K_c the cable lies along the normal at

    u(s) = u(0) n(s) . n(0) + turn t(s) . (R(s) - R(0)) - int_0^s (K - K_c)(s') t(s) . (R(s) - R(s')) ds'

where u is given at both axes, and the turn at the left one is free.

The residual is moved by the noise of the midline (directly, and through y and the moment), by the force, by the errors
of both axes on this photo, and by what all photos have in common: their scale, the errors of the bearing axes across
the chord, and that the axes are seen above the cable (`CommonErrors`).

Axes and signs: chord frame of `rod.measurement`; SI units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.linalg import solve_triangular
from scipy.sparse import csr_array, diags_array

from rod.array import Array
from rod.compliance_law import ComplianceLaw
from rod.measurement import MeasuredShape, MeasuredStep, MeasuredTest
from rod.midline import LEAST_SECTIONS, Midline, midline

CELLS = 400
"""Of the integral along the cable: where the law has a kink, it is in error by a third of a photo's noise."""

HIDDEN = 20
"""Pieces of an arc under a cover."""

TURN = 0.3
"""Standard deviation of the turn at the left axis, rad: far more than any smooth curve is off by."""

ROUNDED = 1e-6
"""Of the length: error of a position by the integral along the cable, a twentieth of a good photo's."""

AXES = ("left_along", "left_across", "right_along", "right_across")


class CommonErrors(NamedTuple):
    """What is wrong on all photos alike, in the signs of the chord frame: what is added to a measured place.

    ``scale`` is relative; that of the axes (`AXES`) and of the camera's foot in m; ``parallax``, relative, takes the
    axes toward the foot, which lies at the picture's centre (`rod.measurement`).
    """

    scale: float = 0.0
    left_along: float = 0.0
    left_across: float = 0.0
    right_along: float = 0.0
    right_across: float = 0.0
    foot_along: float = 0.0
    foot_across: float = 0.0
    parallax: float = 0.0


@dataclass(frozen=True)
class MomentPoints:
    """One photo: n points from axis to axis, and r positions, the blocks of the midline and last the right axis.

    Attributes
    ----------
    step : MeasuredStep
    s : (n,) m
    kappa : (n,) 1/m
        Of the smooth curve.
    y : (n,) m
        Of the midline.
    free : (n,)
        1 where the cable is seen; under a cover it ends at the axis, wherever that is found, and this at 0.
    along : (n,)
        Place on the chord, x / chord.
    axes_by_common : (4, 7)
        Derivative of `AXES` by the common errors but the scale.
    force, force_std : N
        Zero in the mounted step: force-free by definition of the branch, whatever the load cell reads.
    photo : Midline
    offset : (r,) m
        Of the positions from the smooth curve's, which starts at the left axis.
    by_curvature : (r, n) m^2
        Derivative of the residual by a curvature of the law.
    y_by_photo : (n, r - 1)
        Derivative of y by the blocks of the midline.
    by_axes : (r, 4)
        Derivative of the residual by what is added to measured places to count them from the true axes (`AXES`), where
        it does not act through the moment.
    by_turn : (r, 1) m
        Derivative by the turn at the left axis, per rad.
    axis_std : m
        Of each coordinate of an axis on this photo.
    """

    step: MeasuredStep
    s: Array
    kappa: Array
    y: Array
    free: Array
    along: Array
    axes_by_common: Array
    force: float
    force_std: float
    photo: Midline
    offset: Array
    by_curvature: Array
    y_by_photo: csr_array
    by_axes: Array
    by_turn: Array
    axis_std: float

    @property
    def length(self) -> float:
        """Traced length of the curve, axis to axis, m."""
        return float(np.ptp(self.s))

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Where the cable is seen, (n,)."""
        return np.asarray(self.free == 1.0, bool)

    @property
    def moment(self) -> Array:
        """Bending moment P y as photographed, (n,) N m."""
        return self.force * self.y

    def true_moment(self, errors: CommonErrors) -> Array:
        """Bending moment P y with the common errors taken back, (n,) N m."""
        moved = self.y_by_axes @ (self.axes_by_common @ np.array(errors[1:]))
        return np.asarray(self.force * (self.y * (1.0 + errors.scale) + moved))

    @property
    def y_by_axes(self) -> Array:
        """Derivative of y by `AXES`, (n, 4)."""
        none = np.zeros_like(self.y)
        return np.column_stack([none, self.free * (1.0 - self.along), none, self.free * self.along])


@dataclass(frozen=True)
class Residual:
    """Residual of one photo against a law, whitened, and its derivatives (whitened rows).

    `whitened` turns changes of the raw residual (r, k) into whitened rows. ``by_source`` holds the raw derivatives with
    respect to the sources of error, each per standard deviation: ``photo`` (r, r - 1), ``force`` (r, 1), `AXES`.
    """

    value: Array
    jacobian: Array
    whitened: Callable[[Array], Array]
    by_source: dict[str, Array]


def moment_points(test: MeasuredTest) -> tuple[MomentPoints, ...]:
    """Points of every step that has a photo, in the order of the test."""
    return tuple(
        _points_of(step, step.shape, midline(step.shape))
        for step in test.steps
        if step.shape is not None and step.shape.section_s.size >= LEAST_SECTIONS
    )


def _points_of(step: MeasuredStep, shape: MeasuredShape, photo: Midline) -> MomentPoints:
    mounted = step.branch == "mounted"
    chord = float(shape.x[-1]) if step.chord is None else step.chord
    cx, cy = step.picture_centre or (0.5 * chord, 0.0)
    places, free = _tied(shape, chord)
    s, curve, theta, kappa = places[:, 0], places[:, 1:3], places[:, 3], places[:, 4]
    at, where = np.append(photo.s, s[-1]), np.vstack([photo.on_curve, curve[-1:]])
    tangent, normal = _frame(np.append(photo.theta, theta[-1]))
    # trapezium rule; the integrand vanishes where the integral ends
    width = 0.5 * (np.diff(s, prepend=s[0]) + np.diff(s, append=s[-1]))
    lever = np.einsum("ik,ijk->ij", tangent, where[:, None] - curve[None])
    by_curvature = np.where(s[None] < at[:, None], lever, 0.0) * width
    first = _frame(theta[:1])[1][0]
    start = np.outer(normal @ first, first)  # along itself a curve may begin anywhere
    end = float(normal[-1] @ (np.array([chord, 0.0]) - curve[-1]))
    last = np.eye(at.size)[:, -1:]
    y_by_photo = diags_array(free * np.cos(theta)) @ _between(s, photo.s)
    return MomentPoints(
        step=step,
        s=s,
        kappa=kappa,
        y=curve[:, 1] + y_by_photo @ photo.offset,
        free=free,
        along=curve[:, 0] / chord,
        axes_by_common=np.hstack([np.eye(4), np.vstack([np.eye(2)] * 2), [[-cx], [-cy], [chord - cx], [-cy]]]),
        force=0.0 if mounted else step.force,
        force_std=0.0 if mounted else step.force_std,
        photo=photo,
        offset=np.append(photo.offset, end) + start @ curve[0] - by_curvature @ kappa,
        by_curvature=by_curvature,
        y_by_photo=y_by_photo,
        by_axes=np.hstack([start, -last * normal]),
        by_turn=np.sum(tangent * (where - curve[0]), axis=1)[:, None],
        axis_std=(step.chord_std or 0.0) / np.sqrt(2.0),
    )


def _frame(theta: Array) -> tuple[Array, Array]:
    """Tangents and normals (k, 2) of directions (k,)."""
    cos, sin = np.cos(theta), np.sin(theta)
    return np.column_stack([cos, sin]), np.column_stack([-sin, cos])


def _tied(shape: MeasuredShape, chord: float) -> tuple[Array, Array]:
    """The smooth curve (n, 5), s, x, y, theta and kappa, under covers arcs to the axes; and `MomentPoints.free` (n,).

    A smooth curve may wind there as it likes. What positions are counted from must not be far from the cable.
    """
    first, last = np.flatnonzero(shape.seen)[[0, -1]]
    s = np.linspace(shape.s[first], shape.s[last], CELLS + 1)
    x = CubicHermiteSpline(shape.s, shape.x, np.cos(shape.theta))(s)
    y = CubicHermiteSpline(shape.s, shape.y, np.sin(shape.theta))(s)
    rows = np.column_stack([s, x, y, CubicSpline(shape.s, np.column_stack([shape.theta, shape.kappa]))(s)])
    left = _arc(rows[0], np.zeros(2), -1.0)[::-1] if first > 0 else rows[:0]
    right = _arc(rows[-1], np.array([chord, 0.0]), 1.0) if last < shape.s.size - 1 else rows[:0]
    free = np.concatenate([np.linspace(0.0, 1.0, len(left)), np.ones(len(rows)), np.linspace(1.0, 0.0, len(right))])
    return np.vstack([left, rows, right]), free


def _arc(row: Array, axis: Array, way: float) -> Array:
    """The arc (`HIDDEN` + 1, 5) from a place of a curve to an axis, forth (`way` 1) or back (-1) along the curve."""
    s, x, y, theta, _ = row
    heading = way * np.array([np.cos(theta), np.sin(theta)])
    apart = axis - row[1:3]
    turn = np.arctan2(heading[0] * apart[1] - heading[1] * apart[0], heading @ apart)
    along = np.linspace(0.0, np.hypot(*apart) / np.sinc(turn / np.pi), HIDDEN + 1)
    share = turn * np.linspace(0.0, 1.0, HIDDEN + 1)
    straight, angle = way * along * np.sinc(share / np.pi), theta + share
    kappa = np.full(along.size, -2.0 * way * turn / along[-1])
    return np.column_stack(
        [s + way * along, x + straight * np.cos(angle), y + straight * np.sin(angle), theta + 2.0 * share, kappa]
    )


def _between(s: Array, nodes: Array) -> csr_array:
    """Linear interpolation from values at increasing nodes (k,) to s (n,), constant beyond, as a matrix (n, k)."""
    at = np.clip(s, nodes[0], nodes[-1])
    left = np.maximum(np.searchsorted(nodes, at) - 1, 0)
    share = (at - nodes[left]) / np.diff(nodes)[left]
    row = np.arange(s.size)
    weights, places = np.concatenate([1.0 - share, share]), np.concatenate([left, left + 1])
    return csr_array((weights, (np.concatenate([row, row]), places)), shape=(s.size, nodes.size))


def residual(
    data: MomentPoints,
    law: ComplianceLaw,
    pre_curvature: float,
    *,
    varying: Array,
    errors: CommonErrors,
    blur: float = 1.0,
) -> Residual:
    """Whitened residual of one photo.

    Parameters
    ----------
    varying : (n,) 1/m
        K0(s) minus its mean.
    errors : CommonErrors
    blur : float
        Factor on all that is known of the noise.

    Returns
    -------
    Residual
        Columns of the jacobian: coefficients of log c (p), K0, then `CommonErrors` in their units.
    """
    m, stretch = data.true_moment(errors), 1.0 + errors.scale
    c = law.compliance(m)
    kappa = stretch * (pre_curvature + varying + law.bend(m))
    onto = stretch * data.by_curvature
    bent = onto * (c * data.force)  # by y
    axes = data.by_axes + bent @ data.y_by_axes
    by_common = axes @ data.axes_by_common
    value = data.offset + data.by_curvature @ kappa + data.by_axes @ (data.axes_by_common @ np.array(errors[1:]))
    photo = np.asarray(bent @ data.y_by_photo)
    photo[:-1] += np.eye(photo.shape[1])
    by_source = {
        "photo": blur * photo @ data.photo.factor,
        "force": blur * data.force_std * (onto @ (c * data.y))[:, None],
    } | {name: -blur * data.axis_std * column[:, None] for name, column in zip(AXES, axes.T, strict=True)}
    noise = np.hstack([*by_source.values(), TURN * data.by_turn])
    covariance = noise @ noise.T
    rounding = len(covariance) * np.finfo(float).eps * float(covariance.diagonal().max())
    covariance[np.diag_indices_from(covariance)] += max((ROUNDED * data.length) ** 2, rounding)
    factor = np.linalg.cholesky(covariance)

    def whitened(columns: Array) -> Array:
        return np.asarray(solve_triangular(factor, columns, lower=True, check_finite=False))

    by_scale = bent @ data.y + data.by_curvature @ (kappa / stretch)
    columns = np.column_stack([onto @ law.bend_by_coefficients(m), onto.sum(axis=1), by_scale, by_common])
    return Residual(whitened(value), whitened(columns), whitened, by_source)


def pointwise_graph(step: MeasuredStep) -> tuple[Array, Array]:
    """The paper's graph of one photo (Fig. 7): K(s) and ``(dm/ds) / (dK/ds)`` (Eq. 14), 1/m and N m^2.

    Kept for comparison. It is 0/0 at mid-span, where it is NaN, and biased wherever the photo is noisy.

    Raises `ValueError` if the step has no photo.
    """
    shape = step.shape
    if shape is None:
        raise ValueError(f"step {step.step} has no photo")
    seen = shape.seen
    s, kappa = shape.s[seen], shape.kappa[seen]
    turn = np.gradient(kappa, s)
    lift = np.gradient(step.force * shape.y[seen], s)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(np.abs(turn) > 1e-6 * np.max(np.abs(turn), initial=0.0), lift / turn, np.nan)
    return kappa, ratio

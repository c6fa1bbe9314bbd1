"""What one photo says of the law K(m): its moment ``m(s) = P y(s)`` and the positions that a curvature leads to.

Along the seen cable the moment is known from the photo alone (Eq. 13). A law and K0 make of it a curvature K(s), and
that, integrated twice from axis to axis, a midline. It is held against the raw midline of the photo, not the curvature
against that of a smooth curve: what smoothing rounds off, and how its error runs along the cable, need not be known.
The smooth curve R(s) with tangent t, normal n and curvature K_c is what positions are counted from. To first order in
K - K_c the cable lies along the normal at

    u(s) = n(s) . left + turn t(s) . (R(s) - R(0)) - int_0^s (K - K_c)(s') t(s) . (R(s) - R(s')) ds'

with ``left`` the left axis as counted from R(0); the turn at the left axis is free, and at the right one u is given.

The residual is moved by the noise of the midline (directly, and through y and the moment), by the force, by the errors
of both axes on this photo, and by what all photos have in common: their scale, the errors of the bearing axes across
the chord, and that the axes are seen above the cable (`CommonErrors`).

Axes and signs: chord frame of `rod.measurement`; SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from rod.compliance_law import ComplianceLaw
from rod.measurement import MeasuredShape, MeasuredStep, MeasuredTest
from rod.midline import Midline, midline

Array = NDArray[np.float64]

CELLS = 400
"""Of the integral along the cable: where the law has a kink, it is in error by a third of a photo's noise."""

LEAST_SECTIONS = 8
"""Raw midline points that make a shape."""

TURN = 0.3
"""Standard deviation of the turn at the left axis, rad: far more than any smooth curve is off by."""

NO_ERROR = 1e-9
"""Of the length: independent error of a position that keeps the covariance regular where axes are without error."""

AXES = ("left_along", "left_across", "right_along", "right_across")


class CommonErrors(NamedTuple):
    """What is wrong on all photos alike, in the signs of the chord frame.

    ``true y = (1 + scale) y + left_across (1 - x/chord) + right_across x/chord + foot_across - parallax centre`` with
    the y of the picture's centre (`rod.measurement`). ``scale`` and ``parallax`` are relative, the others in m. Along
    the chord the axes move no moment.
    """

    scale: float
    left_across: float = 0.0
    right_across: float = 0.0
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
    seen : (n,) bool
        Where no cover hides the cable.
    along : (n,)
        Place on the chord, x / chord.
    centre : m
        y of the picture's centre; zero where that is not known.
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
    seen: NDArray[np.bool_]
    along: Array
    centre: float
    force: float
    force_std: float
    photo: Midline
    offset: Array
    by_curvature: Array
    y_by_photo: Array
    by_axes: Array
    by_turn: Array
    axis_std: float

    @property
    def length(self) -> float:
        """Traced length of the curve, axis to axis, m."""
        return float(self.s[-1])

    @property
    def moment(self) -> Array:
        """Bending moment P y as photographed, (n,) N m."""
        return self.force * self.y

    def true_moment(self, errors: CommonErrors) -> Array:
        """Bending moment P y with the common errors taken back, (n,) N m."""
        return self.force * (self.y * (1.0 + errors.scale) + self.y_by_common[:, 1:] @ np.array(errors[1:]))

    @property
    def y_by_common(self) -> Array:
        """Derivative of the true y by the common errors, (n, 5)."""
        one = np.ones_like(self.y)
        return np.column_stack([self.y, 1.0 - self.along, self.along, one, -self.centre * one])

    @property
    def by_common(self) -> Array:
        """Derivative of the residual by the common errors but the scale where they do not act through y, (r, 4)."""
        left, right = self.by_axes[:, 1], self.by_axes[:, 3]
        return np.column_stack([left, right, left + right, -self.centre * (left + right)])


@dataclass(frozen=True)
class Residual:
    """Residual of one photo against a law, whitened, and its derivatives (all rows whitened).

    `whitener` turns a change of the raw residual into whitened rows. ``by_source`` holds the raw derivatives with
    respect to the sources of error, each per standard deviation: ``photo`` (r, r - 1), ``force`` (r, 1), `AXES`.
    """

    value: Array
    jacobian: Array
    whitener: Array
    by_source: dict[str, Array]


def moment_points(test: MeasuredTest, *, blocks: int = 160) -> tuple[MomentPoints, ...]:
    """Points of every step that has a photo, in the order of the test; `blocks` as in `rod.midline.midline`."""
    return tuple(
        _points_of(step, step.shape, midline(step.shape, blocks=blocks))
        for step in test.steps
        if step.shape is not None and step.shape.section_s.size >= LEAST_SECTIONS
    )


def _points_of(step: MeasuredStep, shape: MeasuredShape, photo: Midline) -> MomentPoints:
    mounted = step.branch == "mounted"
    chord = float(np.hypot(shape.x[-1] - shape.x[0], shape.y[-1] - shape.y[0])) if step.chord is None else step.chord
    s = np.linspace(shape.s[0], shape.s[-1], CELLS + 1)
    theta, kappa = (np.interp(s, shape.s, v) for v in (shape.theta, shape.kappa))
    curve = np.column_stack(
        [
            CubicHermiteSpline(shape.s, shape.x, np.cos(shape.theta))(s),
            CubicHermiteSpline(shape.s, shape.y, np.sin(shape.theta))(s),
        ]
    )
    at, where, angle = np.append(photo.s, s[-1]), np.vstack([photo.on_curve, curve[-1:]]), np.append(photo.theta, theta[-1])
    tangent, normal = np.column_stack([np.cos(angle), np.sin(angle)]), np.column_stack([-np.sin(angle), np.cos(angle)])
    # trapezium rule; the integrand vanishes where the integral ends
    width = np.gradient(s) * np.where((s == s[0]) | (s == s[-1]), 0.5, 1.0)
    lever = np.einsum("ik,ijk->ij", tangent, where[:, None] - curve[None])
    by_curvature = np.where(s[None] < at[:, None], lever, 0.0) * width
    begin, end = -curve[0], np.array([chord, 0.0]) - curve[-1]
    ends = float(np.array([-np.sin(theta[0]), np.cos(theta[0])]) @ begin), float(normal[-1] @ end)
    last = np.eye(at.size)[:, -1:]
    y_by_photo = np.cos(theta)[:, None] * _between(s, np.concatenate([s[:1], photo.s, s[-1:]]))
    moved = np.concatenate([ends[:1], photo.offset, ends[1:]])
    return MomentPoints(
        step=step,
        s=s,
        kappa=kappa,
        y=curve[:, 1] + y_by_photo @ moved,
        seen=np.interp(s, shape.s, shape.seen.astype(float)) > 0.5,
        along=curve[:, 0] / chord,
        centre=0.0 if step.picture_centre is None else step.picture_centre[1],
        force=0.0 if mounted else step.force,
        force_std=0.0 if mounted else step.force_std,
        photo=photo,
        offset=np.append(photo.offset, ends[1]) - normal @ begin - by_curvature @ kappa,
        by_curvature=by_curvature,
        y_by_photo=y_by_photo[:, 1:-1],
        by_axes=np.hstack([normal, -last * normal]),
        by_turn=np.sum(tangent * (where - curve[0]), axis=1)[:, None],
        axis_std=(step.chord_std or 0.0) / np.sqrt(2.0),
    )


def _between(s: Array, nodes: Array) -> Array:
    """Linear interpolation from values at increasing nodes (k,) to s (n,), as a matrix (n, k)."""
    return np.stack([np.interp(s, nodes, unit) for unit in np.eye(nodes.size)], axis=1)


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
    value = data.offset + data.by_curvature @ kappa + data.by_common @ np.array(errors[1:])
    photo = bent @ data.y_by_photo
    photo[:-1] += np.eye(photo.shape[1])
    left, right = bent @ (1.0 - data.along), bent @ data.along
    axes = data.by_axes + np.column_stack([0.0 * left, left, 0.0 * left, right])
    by_source = {
        "photo": blur * photo @ data.photo.factor,
        "force": blur * data.force_std * (onto @ (c * data.y))[:, None],
    } | {name: -blur * data.axis_std * column[:, None] for name, column in zip(AXES, axes.T, strict=True)}
    noise = np.hstack([*by_source.values(), TURN * data.by_turn])
    covariance = noise @ noise.T
    covariance[np.diag_indices_from(covariance)] += NO_ERROR**2 * data.length**2
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    by_common = bent @ data.y_by_common
    by_common[:, 0] += data.by_curvature @ (kappa / stretch)
    by_common[:, 1:] += data.by_common
    columns = np.column_stack([onto @ law.bend_by_coefficients(m), onto.sum(axis=1), by_common])
    return Residual(whitener @ value, whitener @ columns, whitener, by_source)


def pointwise_graph(step: MeasuredStep) -> tuple[Array, Array]:
    """The paper's graph of one photo (Fig. 7): K(s) and ``(dm/ds) / (dK/ds)`` (Eq. 14), 1/m and N m^2.

    Kept for comparison. It is 0/0 at mid-span, where it is NaN, and biased wherever the photo is noisy.

    Raises
    ------
    ValueError
        If the step has no photo.
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

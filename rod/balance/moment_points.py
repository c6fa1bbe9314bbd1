"""Curvature against moment on each photo, and what moves those points: the data of the balance way.

One photo becomes up to `points` places along the seen cable with K(s) from the smooth curve and ``m(s) = P y(s)``
(Eq. 13). The residual against a compliance curve, ``rho = K - K0 - bend(m)``, is moved by the parameters of the
smooth curve (through K and y together), by the force, and by what all photos have in common: their scale, the errors
of the bearing axes across the chord, and that the axes are seen above the cable (`CommonErrors`). What each photo adds
to the errors of the axes is part of the covariance of its curve: it shifts and turns the whole chord frame.

Axes and signs: chord frame of `rod.measurement`; SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rod.compliance_law import ComplianceLaw
from rod.measurement import MeasuredShape, MeasuredStep, MeasuredTest

Array = NDArray[np.float64]


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
    """Points of one photo.

    Attributes
    ----------
    step : MeasuredStep
    length : m
        Traced length of the curve, axis to axis.
    s : (n,) m
    kappa : (n,) 1/m
    y : (n,) m
    along : (n,)
        Place on the chord, x / chord.
    centre : m
        y of the picture's centre; zero where that is not known.
    force, force_std : N
        Zero in the mounted step: force-free by definition of the branch, whatever the load cell reads.
    by_curve_kappa : (n, p) 1/m, by_curve_y : (n, p) m
        Derivatives of curvature and y with respect to the curve's parameters, covariance `curve_covariance` (p, p).
    """

    step: MeasuredStep
    length: float
    s: Array
    kappa: Array
    y: Array
    along: Array
    centre: float
    force: float
    force_std: float
    by_curve_kappa: Array
    by_curve_y: Array
    curve_covariance: Array

    @property
    def moment(self) -> Array:
        """Bending moment P y as photographed, (n,) N m."""
        return self.force * self.y

    def true_moment(self, errors: CommonErrors) -> Array:
        """Bending moment P y with the common errors taken back, (n,) N m."""
        lift = errors.left_across * (1.0 - self.along) + errors.right_across * self.along
        return self.force * (self.y * (1.0 + errors.scale) + lift + errors.foot_across - errors.parallax * self.centre)


@dataclass(frozen=True)
class Residual:
    """Residual of one photo against a compliance curve, whitened, and its derivatives (all rows whitened).

    `whitener` turns a change of the raw residual into whitened rows. ``by_source`` holds the raw derivatives with
    respect to the sources of error ``curve`` (n, p) and ``force`` (n, 1). ``informative`` is the number
    of rows whose noise is the photo's: a curve of p parameters fills only p of n rows, the others hold the floor.
    """

    value: Array
    jacobian: Array
    whitener: Array
    by_source: dict[str, Array]
    informative: float


def moment_points(test: MeasuredTest, *, points: int = 60) -> tuple[MomentPoints, ...]:
    """Points of every step that has a photo, in the order of the test."""
    return tuple(
        _points_of(step, step.shape, points)
        for step in test.steps
        if step.shape is not None and np.count_nonzero(step.shape.seen) >= 8
    )


def _points_of(step: MeasuredStep, shape: MeasuredShape, points: int) -> MomentPoints:
    seen = np.flatnonzero(shape.seen)
    keep = np.unique(np.round(np.linspace(0, seen.size - 1, min(points, seen.size))).astype(int))
    at = seen[keep]
    mounted = step.branch == "mounted"
    chord = float(np.hypot(shape.x[-1] - shape.x[0], shape.y[-1] - shape.y[0])) if step.chord is None else step.chord
    return MomentPoints(
        step=step,
        length=float(shape.s[-1]),
        s=shape.s[at],
        kappa=shape.kappa[at],
        y=shape.y[at],
        along=shape.x[at] / chord,
        centre=0.0 if step.picture_centre is None else step.picture_centre[1],
        force=0.0 if mounted else step.force,
        force_std=0.0 if mounted else step.force_std,
        by_curve_kappa=shape.basis_kappa[at],
        by_curve_y=np.cos(shape.theta[at])[:, None] * shape.basis_normal[at],
        curve_covariance=shape.covariance,
    )


def residual(
    data: MomentPoints,
    curve: ComplianceLaw,
    pre_curvature: float,
    *,
    varying: Array,
    errors: CommonErrors,
    floor: float,
) -> Residual:
    """Whitened residual of one photo.

    Parameters
    ----------
    varying : (n,) 1/m
        K0(s) minus its mean.
    errors : CommonErrors
    floor : 1/m
        Standard deviation of the curvature that no photo resolves.

    Returns
    -------
    Residual
        Columns of the jacobian: coefficients of log c (p), K0, then `CommonErrors` in their units.
    """
    kappa, m = data.kappa / (1.0 + errors.scale), data.true_moment(errors)
    c = curve.compliance(m)
    rho = kappa - pre_curvature - varying - curve.bend(m)
    stiff = (c * data.force)[:, None]
    by_source = {
        "curve": data.by_curve_kappa - stiff * data.by_curve_y,
        "force": -(c * data.y)[:, None],
    }
    covariance = by_source["curve"] @ data.curve_covariance @ by_source["curve"].T
    covariance += data.force_std**2 * by_source["force"] @ by_source["force"].T
    covariance[np.diag_indices_from(covariance)] += floor**2
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    columns = np.column_stack(
        [
            -curve.bend_by_coefficients(m),
            -np.ones(m.size),
            -(kappa + c * data.moment),
            -stiff * (1.0 - data.along[:, None]),
            -stiff * data.along[:, None],
            -stiff,
            stiff * data.centre,
        ]
    )
    informative = m.size - floor**2 * float(np.sum(whitener**2))
    return Residual(whitener @ rho, whitener @ columns, whitener, by_source, informative)


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

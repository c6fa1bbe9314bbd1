"""Way two: from photos and forces to the characteristic by the balance equations, without any simulation (Sec. 5).

Between moment-free bearings statics alone gives the bending moment, ``m(s) = P y(s)`` (Eq. 13), and the photo gives the
curvature ``K(s)``. All points of all photos lie on one curve K(m) if the cable is uniform; its slope is the compliance,
and the bending stiffness characteristic (tangent reading) is

    f_EI(K) = dm/dK = 1 / c(m),    K(m) = K0 + int_0^m c dm'.

Strategy: the paper differentiates m and K along s and divides (Eq. 14); that graph is kept for comparison
(`rod.balance.moment_points.pointwise_graph`), but it is 0/0 at mid-span and biased by noise. Here K is regressed on m,
once over all photos and both halves, and no derivative of a photo is taken: K(m) along the photo, integrated twice, is
held against the raw midline. The moment is nearly free of error, so there is no attenuation; what error it has (force,
bearing axes, scale, position) is carried into the covariance of the residual together with that of the midline. The
compliance is a positive spline (`rod.compliance_law`), fitted in `rod.balance.moment_regression`.

Signs and axes: chord frame of `rod.measurement`; P positive in compression, K positive toward the bow; SI units.

Source: *Identification of Nonlinear Elastic Bending Behavior for Cable Simulation*, Sec. 5, Eqs. (13), (14).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from rod.array import Array
from rod.balance.moment_points import CommonErrors, MomentPoints, moment_points
from rod.balance.moment_regression import (
    BOW_TERMS,
    MomentModel,
    Regression,
    assumption_checks,
    regress,
    uniform_at_rest,
)
from rod.compliance_law import moment_basis
from rod.measured_law import POINTS, MeasuredLaw, Source, propagated
from rod.measurement import MeasuredTest

CONTRADICTION = 2.0
"""Root mean square of whitened residuals beyond which photos and forces contradict each other."""


LEVEL = 0.01
"""Significance of the test of uniform pre-curvature below which K0(s) is taken from the force-free photo."""


class BalanceOutcome(Enum):
    """How the balance way ended; the value is advice to the reader."""

    MEASURED = "all photos and forces were laid on one curve of moment over curvature"
    NO_PHOTO = (
        "no loaded step has both a photo and a force, and the balance equations need both; check why the photos were "
        "rejected"
    )
    NO_MOMENT = (
        "the curvature does not grow with the moment; this usually means that the force log counts tension as positive "
        "(set rig.force_sign) or that photos and forces are mixed up (check the column image)"
    )
    STALLED = (
        "the regression did not settle; this usually means that one photo or force contradicts the others: compare the "
        "points of the photos"
    )


@dataclass(frozen=True)
class BalanceGraph:
    """What the balance equations make of a test; SI units.

    Attributes
    ----------
    outcome : BalanceOutcome
    law : MeasuredLaw or None
        None with any other outcome than ``MEASURED``. K0 is the zero of the moment, all photos.
    points : tuple of MomentPoints
    varying : (4,) 1/m
        Legendre coefficients 1 to 4 of K0(s) - K0; zeros unless a force-free photo shows them.
    checks : dict
        See `rod.balance.moment_regression.assumption_checks`; ``noise_factor`` is the factor on the noise within which
        photos and forces obey one curve; ``uniform_at_rest_p`` tests the force-free photo for a constant curvature.
    """

    outcome: BalanceOutcome
    law: MeasuredLaw | None = None
    points: tuple[MomentPoints, ...] = ()
    varying: tuple[float, ...] = (0.0,) * BOW_TERMS
    checks: dict[str, float] = field(default_factory=dict)


def balance(test: MeasuredTest) -> BalanceGraph:
    """Characteristic from moments ``P y`` and curvatures of all photos.

    With an ``outcome`` other than ``MEASURED``, and no curve, where the data refuse.
    """
    data = moment_points(test)
    if not any(points.force != 0.0 for points in data):
        return BalanceGraph(BalanceOutcome.NO_PHOTO, points=data)
    kappa, m = (np.concatenate([getattr(d, name)[d.seen] for d in data]) for name in ("kappa", "moment"))
    slope, intercept = (float(v) for v in np.polyfit(m, kappa, 1))
    if not slope > 0.0:
        return BalanceGraph(BalanceOutcome.NO_MOMENT, points=data)
    basis = moment_basis(float(m.min()), float(m.max()), unit=slope)
    axis, beside = test.axis_std, test.axis_parallax_std * test.camera_foot_std
    common = CommonErrors(test.scale_std, axis, axis, axis, axis, beside, beside, test.axis_parallax_std)
    model = MomentModel(data, basis, common, force_errors=test.common_force_errors)
    rest = next((d for d in data if d.force == 0.0), None)
    start = intercept if rest is None else float(rest.kappa[rest.seen].mean())
    at_rest = 1.0 if rest is None else uniform_at_rest(model, rest)
    found = _regress_in_spite_of_misfit(replace(model, varying=at_rest < LEVEL), start)
    if found is None:
        return BalanceGraph(BalanceOutcome.STALLED, points=data)
    checks = assumption_checks(replace(found.model, blur=1.0), found) | {"noise_factor": found.model.blur}
    if rest is not None:
        checks["uniform_at_rest_p"] = at_rest
    return _graph(found.model, found, checks)


def _regress_in_spite_of_misfit(model: MomentModel, start: float) -> Regression | None:
    """Regression that counts as noise what photos and forces leave beside one curve, where that is far above noise."""
    for _ in range(8):
        found = regress(model, pre_curvature=start)
        misfit = CONTRADICTION
        if found is not None:
            chi2 = sum(float(row.value @ row.value) for row in found.rows)
            misfit = float(np.sqrt(chi2 / max(sum(row.value.size for row in found.rows) - model.size, 1)))
            if misfit <= CONTRADICTION:
                return found
        model = replace(model, blur=max(misfit, CONTRADICTION) * model.blur)
    return None


def _graph(model: MomentModel, found: Regression, checks: dict[str, float]) -> BalanceGraph:
    """Read moment, tangent and secant off the compliance on a grid of curvature, with bands by propagation."""
    curve, p = found.curve, model.size
    K0, errors = float(found.unknowns[p]), model.errors(found.unknowns)
    met = np.concatenate([d.true_moment(errors)[d.seen] for d in model.data])
    # the abscissa was laid along the regression before: beyond it, by a little at most, nothing is known of the law
    ends = np.clip([met.min(), met.max()], curve.basis.moments[0], curve.basis.moments[-1])
    low, high = K0 + curve.bend(ends)
    kappa = np.linspace(float(low), float(high), POINTS)
    m, f = curve.bound(np.array([K0]))(kappa)
    by_moment, by_log = np.zeros((2, m.size, found.unknowns.size))
    by_moment[:, :p] = curve.moment_by_parameters(kappa, K0)
    by_moment[:, p] = -f
    by_log[:, :p] = curve.log_tangent_by_parameters(kappa, K0)
    by_log[:, p] = curve.log_slope(m) * f
    by_forces = _moved_by_forces(model, found)
    law = propagated(
        kappa,
        K0,
        moment=m,
        tangent=f,
        by_moment=by_moment,
        by_log=by_log,
        by_pre_curvature=np.eye(found.unknowns.size)[p],
        covariance=found.posterior.covariance + by_forces @ by_forces.T,
    )
    loaded, loaded_std = _loaded_pre_curvature(model, found)
    return BalanceGraph(
        outcome=BalanceOutcome.MEASURED,
        law=replace(
            law,
            gains=_gains(model, found, by_log) | {("common_force", -1): by_log @ by_forces},
            # Coefficients of log c = -log f by least squares on the grid, which covers the moments of the basis.
            shortfall=by_log @ found.posterior.shrinkage @ np.linalg.pinv(curve.basis.at(m)),
            loaded_pre_curvature=loaded,
            loaded_pre_curvature_std=loaded_std,
        ),
        points=model.data,
        varying=tuple(float(v) for v in model.bow(found.unknowns)),
        checks=checks,
    )


def _gains(model: MomentModel, found: Regression, by_log: Array) -> dict[Source, Array]:
    """Response of log(tangent) to every source of error: the estimate moves by -response J^T W d(residual)."""
    # With the normal matrix A and a common error e of prior variance 1 the law is off by (A^-1 (A - 1) e) = -A^-1 e.
    common = -by_log @ found.posterior.covariance[:, model.common]
    gains: dict[Source, Array] = {(name, -1): common[:, [i]] for i, name in enumerate(CommonErrors._fields)}
    for data, row in zip(model.data, found.rows, strict=True):
        response = -by_log @ found.posterior.covariance @ model.columns(data, row).T
        for name, columns in row.by_source.items():
            gains[name, data.step.step] = response @ row.whitened(columns)
    return gains


def _moved_by_forces(model: MomentModel, found: Regression) -> Array:
    """Moves (q, e) of the unknowns by errors that several forces have in common."""
    moved = np.zeros((found.unknowns.size, len(model.force_errors)))
    for data, row in zip(model.data, found.rows, strict=True):
        by_force = row.whitened(row.by_source["force"][:, 0])
        shares = [
            errors.get(data.step.step, 0.0) / (model.blur * data.force_std or 1.0) for errors in model.force_errors
        ]
        moved -= np.outer(found.posterior.covariance @ (model.columns(data, row).T @ by_force), shares)
    return moved


def _loaded_pre_curvature(model: MomentModel, found: Regression) -> tuple[float, float]:
    """K0 and its std by the loaded photos alone: the same linearisation without the rows of force-free photos."""
    loaded = [k for k, d in enumerate(model.data) if d.force != 0.0]
    value = np.concatenate([found.rows[k].value for k in loaded])
    J = np.vstack([model.columns(model.data[k], found.rows[k]) for k in loaded])
    posterior = replace(model, varying=False).posterior(found.unknowns, value, J)
    p = model.size
    return float(posterior.mean[p]), float(np.sqrt(posterior.covariance[p, p]))

"""What identification writes into ``result.json``: curves, misfit in units and in sigma, residuals of each photo."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.identify.findings import pre_curvature_sources
from pipeline.identify.identification import Identification
from pipeline.records import Array, Finding
from pipeline.result import (
    AgreementPart,
    BalancePart,
    Curve,
    InversePart,
    KnotPart,
    MisfitPart,
    PointwisePart,
    StepPart,
)
from rod.balance import BalanceGraph
from rod.balance.moment_points import pointwise_graph
from rod.compliance_law import ComplianceLaw
from rod.inverse import Estimate, InverseOutcome
from rod.inverse.evaluation import StepFit
from rod.inverse.fit_model import FitModel
from rod.inverse.photo_residual import Pose, curve_distance
from rod.measured_law import MeasuredLaw
from rod.measurement import MeasuredShape

READINGS = 8
"""Points of the fitted law that are listed; the curve has them all."""

POINTS = 6
"""Of the points of a photo that the balance equations read, one in so many is drawn: some sixty."""


@dataclass(frozen=True)
class PhotoResidual:
    """Fitted curvature and distance of one photo's centerline from the simulated shape, at the centerline's points."""

    kappa_fit_per_m: list[float]
    shape_residual_m: list[float]
    shape_residual_std_m: list[float]


@dataclass(frozen=True)
class IdentificationParts:
    """Parts of the result by identification; ``photos`` by step number."""

    inverse: InversePart
    balance: BalancePart
    agreement: AgreementPart
    steps: list[StepPart]
    photos: dict[int, PhotoResidual] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()


def identification_parts(found: Identification) -> IdentificationParts:
    """Everything that identification says, as parts of the result."""
    return IdentificationParts(
        inverse=inverse_part(found),
        balance=balance_part(found.balance),
        agreement=agreement_part(found),
        steps=_steps(found),
        photos=_photos(found.inverse),
        findings=found.findings,
    )


def curve(way: Estimate | BalanceGraph) -> Curve | None:
    """Curve of a way on the visited range; None without one."""
    law = way.law
    if law is None:
        return None
    values, vectors = np.linalg.eigh(law.log_covariance)
    # Directions below a millionth of the largest variance are rounding.
    keep = values > 1e-6 * values[-1]
    root = np.sqrt(values[keep])
    factor = law.tangent[:, None] * vectors[:, keep] * root
    return Curve(
        kappa_per_m=_list(law.kappa),
        moment_Nm=_list(law.moment),
        moment_std_Nm=_list(law.moment_std),
        tangent_Nm2=_list(law.tangent),
        tangent_std_Nm2=_list(law.tangent_std),
        secant_Nm2=_list(law.secant),
        secant_std_Nm2=_list(law.secant_std),
        supported=[True] * law.kappa.size,
        tangent_factor_Nm2=[_list(row) for row in factor],
        pre_curvature_factor_per_m=_list(vectors[:, keep].T @ law.rest_covariance / root),
    )


def inverse_part(found: Identification) -> InversePart:
    """The inverse problem."""
    way = found.inverse
    spline, law, model = way.characteristic, way.law, way.model
    if spline is None or law is None or model is None:
        return InversePart(**InversePart.ending(way.outcome), converged=False, iterations=way.iterations)
    stds = np.sqrt(np.diag(way.covariance))
    return InversePart(
        **InversePart.ending(way.outcome),
        converged=way.outcome in (InverseOutcome.CONVERGED, InverseOutcome.NOT_VISIBLE),
        iterations=way.iterations,
        pre_curvature_per_m=law.pre_curvature,
        pre_curvature_std_per_m=law.pre_curvature_std,
        supported_per_m=(float(law.kappa[0]), float(law.kappa[-1])),
        knots=_readings(law, spline),
        curve=curve(way),
        misfit=misfit_part(way),
        nuisance={
            name: (model.nuisance(way.unknowns, name), float(stds[model.index(name)]) * std)
            for name, std in model.nuisances.items()
        },
        branches={name: part for name, branch in found.branches.items() if (part := curve(branch)) is not None},
    )


def _readings(law: MeasuredLaw, fitted: ComplianceLaw) -> list[KnotPart]:
    """Points of the law, dense where it bends most: evenly along its own abscissa (`rod.compliance_law`)."""
    place = fitted.basis.place(law.moment)
    even = np.linspace(place[0], place[-1], READINGS)
    return [
        KnotPart(kappa_per_m=float(k), tangent_Nm2=float(f), std_Nm2=float(std))
        for k, f, std in zip(
            *(np.interp(even, place, v) for v in (law.kappa, law.tangent, law.tangent_std)), strict=True
        )
    ]


def misfit_part(way: Estimate) -> MisfitPart | None:
    """Residuals in units and in sigma; None without a fit."""
    if way.evaluation is None or way.model is None:
        return None
    steps, blocks, value = way.evaluation.steps, way.evaluation.blocks, way.evaluation.value
    forces = [step.force[0] for step in steps if step.force is not None]
    distances = [step.photo[0] for step in steps if step.photo is not None]
    bends = [_bend(way.model, way.unknowns, step) for step in steps if step.photo is not None]
    by_block = {name: (float(value[b] @ value[b]), float(b.stop - b.start)) for name, b in blocks.items()}
    data = {name: pair for name, pair in by_block.items() if name != "prior"}
    return MisfitPart(
        force_rmse_N=_rms(np.array(forces)),
        shape_rmse_m=_rms(np.concatenate(distances)) if distances else 0.0,
        curvature_rmse_per_m=_rms(np.concatenate(bends)) if bends else None,
        chi2=sum(chi2 for chi2, _ in by_block.values()),
        # Each prior adds a row and takes an unknown; the laws' own unknowns are what the data pay.
        degrees_of_freedom=sum(n for _, n in data.values()) - way.model.laws,
        chi2_by_block=by_block,
    )


def balance_part(way: BalanceGraph) -> BalancePart:
    """The balance equations."""
    law = way.law
    if law is None:
        return BalancePart(**BalancePart.ending(way.outcome))
    pointwise = []
    for points in way.points:
        if points.force != 0.0:
            kappa, ratio = pointwise_graph(points.step)
            good = np.isfinite(ratio)
            pointwise.append(
                PointwisePart(step=points.step.step, kappa_per_m=_list(kappa[good]), tangent_Nm2=_list(ratio[good]))
            )
    return BalancePart(
        **BalancePart.ending(way.outcome),
        pre_curvature_per_m=law.pre_curvature,
        pre_curvature_std_per_m=law.pre_curvature_std,
        supported_per_m=(float(law.kappa[0]), float(law.kappa[-1])),
        curve=curve(way),
        points_kappa_per_m=_list(np.concatenate([p.kappa[p.seen][::POINTS] for p in way.points])),
        points_moment_Nm=_list(np.concatenate([p.moment[p.seen][::POINTS] for p in way.points])),
        pointwise=pointwise,
        checks=way.checks,
    )


def agreement_part(found: Identification) -> AgreementPart:
    """The comparison; K0 by its sources also where there is nothing to compare."""
    sources = pre_curvature_sources(found)
    agreement = found.agreement
    if agreement is None:
        return AgreementPart(pre_curvature=sources)
    return AgreementPart(
        rms_relative=agreement.rms_relative,
        max_relative=agreement.max_relative,
        compatible=agreement.compatible,
        p_value=agreement.p_value,
        level=agreement.level,
        range_per_m=agreement.range_per_m,
        pre_curvature=sources,
        hints=list(map(str, agreement.hints)),
    )


def _steps(found: Identification) -> list[StepPart]:
    fitted = {}
    if found.inverse.evaluation is not None:
        fitted = {fit.data.step.step: fit.simulated.force for fit in found.inverse.evaluation.steps}
    return [
        StepPart(
            step=step.step,
            branch=step.branch,
            displacement_m=0.0 if step.displacement is None else step.displacement,
            force_N=step.force,
            force_std_N=step.force_std,
            force_fit_N=fitted.get(step.step),
            image=found.images.get(step.step),
        )
        for step in found.test.steps
    ]


def _photos(way: Estimate) -> dict[int, PhotoResidual]:
    if way.evaluation is None or way.model is None:
        return {}
    return {
        fit.data.step.step: _photo(way.model, way.unknowns, fit, fit.data.step.shape)
        for fit in way.evaluation.steps
        if fit.photo is not None and fit.data.step.shape is not None
    }


def _pose(model: FitModel, u: Array, fit: StepFit) -> Pose:
    return Pose(*model.pose(u, fit.data), model.nuisance(u, "scale"))


def _photo(model: FitModel, u: Array, fit: StepFit, shape: MeasuredShape) -> PhotoResidual:
    value, feet = curve_distance(shape, fit.simulated, _pose(model, u, fit), fit.chord)
    std = np.sqrt(np.maximum(np.einsum("ip,pq,iq->i", shape.basis_normal, shape.covariance, shape.basis_normal), 0.0))
    kappa = np.interp(feet, fit.simulated.s, fit.simulated.kappa)
    return PhotoResidual(_list(kappa), _list(value), _list(std))


def _bend(model: FitModel, u: Array, fit: StepFit) -> Array:
    """Measured minus fitted curvature where the cable is seen, 1/m."""
    shape = fit.data.step.shape
    if shape is None:
        return np.empty(0)
    feet = curve_distance(shape, fit.simulated, _pose(model, u, fit), fit.chord)[1]
    return np.asarray((shape.kappa - np.interp(feet, fit.simulated.s, fit.simulated.kappa))[shape.seen])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _list(values: Array) -> list[float]:
    return [float(v) for v in values]

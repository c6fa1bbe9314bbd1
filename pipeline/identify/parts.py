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
from rod.inverse.laws import FreeLaw
from rod.inverse.observation import KINDS
from rod.inverse.photo_fit import distance_std, photo_fit
from rod.measured_law import MeasuredLaw

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
        kappa_per_m=law.kappa.tolist(),
        moment_Nm=law.moment.tolist(),
        moment_std_Nm=law.moment_std.tolist(),
        tangent_Nm2=law.tangent.tolist(),
        tangent_std_Nm2=law.tangent_std.tolist(),
        secant_Nm2=law.secant.tolist(),
        secant_std_Nm2=law.secant_std.tolist(),
        supported=[True] * law.kappa.size,
        tangent_factor_Nm2=factor.tolist(),
        pre_curvature_factor_per_m=(vectors[:, keep].T @ law.rest_covariance / root).tolist(),
    )


def inverse_part(found: Identification) -> InversePart:
    """The inverse problem."""
    way = found.inverse
    fitted, law = way.characteristic, way.law
    if fitted is None or law is None:
        return InversePart(**InversePart.ending(way.outcome), converged=False)
    return InversePart(
        **InversePart.ending(way.outcome),
        converged=way.outcome in (InverseOutcome.CONVERGED, InverseOutcome.NOT_VISIBLE),
        pre_curvature_per_m=law.pre_curvature,
        pre_curvature_std_per_m=law.pre_curvature_std,
        supported_per_m=(float(law.kappa[0]), float(law.kappa[-1])),
        knots=_readings(law, fitted),
        curve=curve(way),
        misfit=misfit_part(way),
        nuisance={name: (value, std) for name, (value, std, _) in way.nuisances.items()},
        branches={name: part for name, branch in found.branches.items() if (part := curve(branch)) is not None},
    )


def _readings(law: MeasuredLaw, fitted: FreeLaw) -> list[KnotPart]:
    """Points of the law, dense where it bends most: evenly along its own abscissa (`rod.stiffness_law`)."""
    over_moments = isinstance(fitted, ComplianceLaw)
    place = fitted.basis.place(law.moment if over_moments else law.kappa - law.pre_curvature)
    even = np.linspace(place[0], place[-1], READINGS)
    return [
        KnotPart(kappa_per_m=float(k), tangent_Nm2=float(f), std_Nm2=float(std))
        for k, f, std in zip(
            *(np.interp(even, place, v) for v in (law.kappa, law.tangent, law.tangent_std)), strict=True
        )
    ]


def misfit_part(way: Estimate) -> MisfitPart | None:
    """Residuals in units and in sigma; None without a fit."""
    observation, fitted = way.observation, way.fitted
    if observation is None or fitted is None or fitted.run.prediction is None:
        return None
    holds = zip(observation.forces, fitted.run.prediction.samples, strict=True)
    forces = [float(np.mean(data - model[: len(data)])) for data, model in holds if len(data)]
    distances = [photo_fit(observation, fitted, photo, photo.sections).distance for photo in observation.photos]
    kinds = [way.chi2(kind) for kind in KINDS[:-1]]
    base = fitted.extension.base
    return MisfitPart(
        force_rmse_N=_rms(np.array(forces)),
        shape_rmse_m=_rms(np.concatenate(distances)) if distances else 0.0,
        chi2=sum(chi2 for chi2, _ in kinds),
        # each prior adds a row and takes an unknown; law and K0 are what the data pay
        degrees_of_freedom=sum(n for _, n in kinds) - base.law.size - 1,
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
                PointwisePart(step=points.step.step, kappa_per_m=kappa[good].tolist(), tangent_Nm2=ratio[good].tolist())
            )
    return BalancePart(
        **BalancePart.ending(way.outcome),
        pre_curvature_per_m=law.pre_curvature,
        pre_curvature_std_per_m=law.pre_curvature_std,
        supported_per_m=(float(law.kappa[0]), float(law.kappa[-1])),
        curve=curve(way),
        points_kappa_per_m=np.concatenate([p.kappa[p.seen][::POINTS] for p in way.points]).tolist(),
        points_moment_Nm=np.concatenate([p.moment[p.seen][::POINTS] for p in way.points]).tolist(),
        pointwise=pointwise,
        checks=way.checks,
    )


def agreement_part(found: Identification) -> AgreementPart:
    """The comparison; K0 by its sources also where there is nothing to compare."""
    sources = pre_curvature_sources(found)
    agreement = found.agreement
    if agreement is None:
        return AgreementPart(pre_curvature=sources)
    hints = list(map(str, agreement.hints))
    return AgreementPart(**vars(agreement) | {"pre_curvature": sources, "hints": hints})


def _steps(found: Identification) -> list[StepPart]:
    way, simulated = found.inverse, {}
    if way.test is not None and way.fitted is not None and way.fitted.run.prediction is not None:
        steps = zip(way.test.steps, way.fitted.run.prediction.force, strict=True)
        simulated = {step.step: float(force) for step, force in steps}
    return [
        StepPart(
            step=step.step,
            branch=step.branch,
            displacement_m=0.0 if step.displacement is None else step.displacement,
            force_N=step.force,
            force_std_N=step.force_std,
            force_fit_N=simulated.get(step.step),
            image=found.images.get(step.step),
        )
        for step in found.test.steps
    ]


def _photos(way: Estimate) -> dict[int, PhotoResidual]:
    observation, fitted, test = way.observation, way.fitted, way.test
    if observation is None or fitted is None or test is None:
        return {}
    found = {}
    for photo in observation.photos:
        step = test.steps[photo.step]
        if (shape := step.shape) is None:
            continue
        at = photo_fit(observation, fitted, photo, shape)
        std = distance_std(photo, shape)
        found[step.step] = PhotoResidual(at.kappa.tolist(), at.distance.tolist(), std.tolist())
    return found


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0

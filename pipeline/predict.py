"""A new experiment by the identified model: from a result and displacement steps to forces and shapes with bands.

The model is a cable without friction and set: the characteristic the result answers with (extended, else inverse, else
balance) and its pre-curvature K0, on an ideal rig of any length (Sec. 2 of the paper: what f_EI is identified for).

Uncertainty: the result holds f on a grid K_j with F F^T its covariance, K0 with its standard deviation, and the
standard deviation of the moment m(K) = int_{K0}^{K} f dk. Because of

    dm(K) = int_{K0}^{K} df dk - f(K0) dK0,

the last contains the covariance of K0 with f:  2 f(K0) cov(K0, int df) = var(int df) + f(K0)^2 var(K0) - var(m).
`identified_model` reads it off there, so that forces get the band that belongs to the moment curve: errors of f and
of K0 largely cancel in it. The joint covariance goes to forces and shapes by the derivatives of `rod.sensitivity`, to
first order. Length and displacements of the new experiment are exact.

Outside the curvatures that were visited no cable was looked at: such a step is refused, or marked where the caller
asks for it; then f goes on straight and the band says nothing about what the cable does there.

Signs and units: chord frame, SI; force positive in compression; displacement positive where the bearings approach.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

from pipeline.records import Finding
from pipeline.result import Result
from pipeline.settings.predict import PredictSettings
from pipeline.visited import Visited, best, pre_curvature
from rod.bending_test import BendingTest, simulate
from rod.characteristic import Characteristic
from rod.equilibrium import Equilibrium
from rod.sensitivity import derivatives

Array = NDArray[np.float64]
Zero = Literal["natural", "length"]
Status = Literal["predicted", "extrapolated", "refused", "no equilibrium"]

# Arrays of a predicted step along the cable.
PREDICTED = (
    "s_m",
    "x_m",
    "x_std_m",
    "y_m",
    "y_std_m",
    "theta_rad",
    "theta_std_rad",
    "kappa_per_m",
    "kappa_std_per_m",
)

# Share of the largest moment band below which a direction of the covariance tells nothing about its link to K0:
# the integrals are trapezoidal sums, right to about 1e-4.
RESOLVED = 1e-2


@dataclass(frozen=True, eq=False)
class IdentifiedModel:
    """Characteristic and pre-curvature of a result with their joint covariance.

    Attributes
    ----------
    method : str
        ``extended``, ``inverse`` or ``balance``.
    characteristic : Characteristic
        Tangent reading, a control point at each of the n curvatures of the result.
    pre_curvature : 1/m
    factor : (n + 1, r)
        F with F F^T the covariance of the n control points (N m^2) and, last, the pre-curvature (1/m).
    visited : (low, high) 1/m
    """

    method: str
    characteristic: Characteristic
    pre_curvature: float
    factor: Array
    visited: tuple[float, float]

    @property
    def pre_curvature_std(self) -> float:
        """Standard deviation of the pre-curvature, 1/m."""
        return float(np.linalg.norm(self.factor[-1]))

    def bending_test(self, length: float, *, zero: Zero = "natural", elements: int = 100) -> BendingTest:
        """An ideal test of such a cable of another length, m."""
        return BendingTest(length, self.characteristic, self.pre_curvature, zero=zero, elements=elements)


@dataclass(frozen=True, eq=False)
class PredictedStep:
    """One displacement step; arrays along the cable are empty and the force is None unless a shape was computed.

    Attributes
    ----------
    displacement_m : float
    status : {"predicted", "extrapolated", "refused", "no equilibrium"}
    reason : str
        Why not simply predicted.
    chord_m, force_N, force_std_N, kappa_max_per_m : float or None
    s_m, x_m, x_std_m, y_m, y_std_m, theta_rad, theta_std_rad, kappa_per_m, kappa_std_per_m : (m,)
    """

    displacement_m: float
    status: Status
    reason: str = ""
    chord_m: float | None = None
    force_N: float | None = None
    force_std_N: float | None = None
    kappa_max_per_m: float | None = None
    s_m: Sequence[float] = ()
    x_m: Sequence[float] = ()
    x_std_m: Sequence[float] = ()
    y_m: Sequence[float] = ()
    y_std_m: Sequence[float] = ()
    theta_rad: Sequence[float] = ()
    theta_std_rad: Sequence[float] = ()
    kappa_per_m: Sequence[float] = ()
    kappa_std_per_m: Sequence[float] = ()


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted experiment.

    Attributes
    ----------
    specimen : str
        Whose characteristic it is.
    method : str
    length_m : float
    zero : {"natural", "length"}
        Where displacement is counted from.
    pre_curvature_per_m, pre_curvature_std_per_m : float
    visited_per_m : (low, high)
    reachable_m : float or None
        Largest displacement within the visited range; computed where a step lies beyond it.
    steps : tuple of PredictedStep
    findings : tuple of Finding
    """

    specimen: str
    method: str
    length_m: float
    zero: Zero
    pre_curvature_per_m: float
    pre_curvature_std_per_m: float
    visited_per_m: tuple[float, float]
    reachable_m: float | None
    steps: tuple[PredictedStep, ...]
    findings: tuple[Finding, ...] = ()


def predict(
    result: Result,
    displacements_m: Sequence[float],
    *,
    length_m: float | None = None,
    zero: Zero = "natural",
    extrapolate: bool = False,
    settings: PredictSettings | None = None,
) -> Prediction | None:
    """Forces and shapes of a new experiment by the identified model.

    Parameters
    ----------
    result : Result
    displacements_m : sequence of float
        Steps, m.
    length_m : float, optional
        Between the bearing axes; by default that of the specimen.
    zero : {"natural", "length"}
        Displacement is counted from the mounted, force-free cable, or from the chord that equals the length.
    extrapolate : bool
        Compute steps beyond the visited range too, marked ``extrapolated``, instead of refusing them.
    settings : PredictSettings, optional

    Returns
    -------
    Prediction or None
        None if the result holds no characteristic.

    Raises
    ------
    ValueError
        For no displacement, one that is not finite, or a length that is not positive.
    """
    settings = settings or PredictSettings()
    length = result.specimen.length_m if length_m is None else length_m
    if not len(displacements_m) or not np.all(np.isfinite(displacements_m)):
        raise ValueError("give finite displacements")
    model = identified_model(result)
    if model is None:
        return None
    if length is None or not (np.isfinite(length) and length > 0.0):
        raise ValueError(f"a cable cannot be {length} m long")
    test = model.bending_test(length, zero=zero, elements=settings.elements)
    steps = tuple(_step(test, model, float(d), extrapolate, settings) for d in displacements_m)
    limit = reachable(test, model) if any(step.status != "predicted" for step in steps) else None
    return Prediction(
        specimen=result.specimen.id,
        method=model.method,
        length_m=length,
        zero=zero,
        pre_curvature_per_m=model.pre_curvature,
        pre_curvature_std_per_m=model.pre_curvature_std,
        visited_per_m=model.visited,
        reachable_m=limit,
        steps=tuple(_explained(step, limit) for step in steps),
        findings=tuple(_findings(result, model)),
    )


def identified_model(result: Result) -> IdentifiedModel | None:
    """Characteristic, K0 and joint covariance of a result; None without a characteristic."""
    curve = best(result)
    if curve is None:
        return None
    K0, std = pre_curvature(result, curve)
    law = Characteristic.from_ordinates(curve.kappa, curve.tangent)
    low, high = float(curve.kappa[0]), float(curve.kappa[-1])
    return IdentifiedModel(curve.method, law, K0, _joint_factor(curve, K0, std), (low, high))


def reachable(test: BendingTest, model: IdentifiedModel) -> float | None:
    """Largest displacement at which the cable is still within the visited range, m; None if there is none."""
    high = model.visited[1]

    def excess(displacement: float) -> float:
        (step,) = simulate(test, [displacement], branch="up")
        return float(step.kappa.max()) / high - 1.0 if step.good else 1.0

    # Pushed by half its length a cable is bent to a mean curvature of about 4 / length: bracket from there downward.
    top = 0.5 * test.length
    return float(brentq(excess, 0.0, top, xtol=1e-6 * top)) if excess(0.0) < 0.0 < excess(top) else None


def _step(
    test: BendingTest, model: IdentifiedModel, displacement: float, extrapolate: bool, settings: PredictSettings
) -> PredictedStep:
    """One step, on its own: without friction and set it does not matter what came before."""
    bent = simulate(test, [displacement], branch="up")
    (step,) = bent
    if not step.good:
        return PredictedStep(displacement, "no equilibrium", step.outcome.advice)
    (low, high), sharpest = model.visited, float(step.kappa.max())
    slack = settings.range_slack * (high - low)
    status: Status = "predicted"
    reason = ""
    if sharpest > high + slack or step.kappa.min() < min(low, model.pre_curvature) - slack:
        reason = (
            f"curvature {step.kappa.min():.3g} to {sharpest:.3g} 1/m leaves the visited range {low:.3g} to {high:.3g}"
        )
        if not extrapolate:
            return PredictedStep(displacement, "refused", reason, chord_m=step.chord, kappa_max_per_m=sharpest)
        status = "extrapolated"
    return replace(_with_bands(test, model, bent), displacement_m=displacement, status=status, reason=reason)


def _explained(step: PredictedStep, limit: float | None) -> PredictedStep:
    """A step without equilibrium that lies beyond the visited range: what the continued law does there says nothing."""
    if step.status != "no equilibrium" or limit is None or step.displacement_m <= limit:
        return step
    reason = "bends the cable beyond the visited range, where its characteristic is not known"
    return replace(step, status="refused", reason=reason)


def _with_bands(test: BendingTest, model: IdentifiedModel, bent: tuple[Equilibrium, ...]) -> PredictedStep:
    """Force and shape of an equilibrium with standard deviations to first order."""
    (by,) = derivatives(test, bent, ["ordinates", "pre_curvature"])
    (step,) = bent

    def std(columns: Array) -> Array:
        return np.asarray(np.linalg.norm(columns @ model.factor, axis=-1))

    return PredictedStep(
        displacement_m=0.0,
        status="predicted",
        chord_m=step.chord,
        force_N=step.force,
        force_std_N=float(std(by.force)),
        kappa_max_per_m=float(step.kappa.max()),
        s_m=step.s.tolist(),
        x_m=step.x.tolist(),
        x_std_m=std(by.x).tolist(),
        y_m=step.y.tolist(),
        y_std_m=std(by.y).tolist(),
        theta_rad=step.theta.tolist(),
        theta_std_rad=std(by.theta).tolist(),
        kappa_per_m=step.kappa.tolist(),
        kappa_std_per_m=std(by.kappa).tolist(),
    )


def _joint_factor(curve: Visited, K0: float, std: float) -> Array:
    """Factor of the joint covariance of f along the curve and K0, (n + 1, r); see the module.

    Without a factor of f its errors are taken as one common factor on the whole curve: the widest band of a force.
    """
    F = curve.factor if curve.factor.shape[1] else curve.tangent_std[:, None]
    rise = cumulative_trapezoid(F, curve.kappa, axis=0, initial=0)
    rise -= np.array([np.interp(K0, curve.kappa, column) for column in rise.T])  # int_{K0}^{K} of each column
    f0 = float(np.interp(K0, curve.kappa, curve.tangent))
    linked = (np.sum(rise**2, axis=1) + (f0 * std) ** 2 - curve.moment_std**2) / (2.0 * f0)
    size = RESOLVED * np.linalg.norm(rise, axis=1).max()
    link = np.linalg.solve(rise.T @ rise / size**2 + np.eye(F.shape[1]), rise.T @ linked / size**2)
    length = float(np.linalg.norm(link))
    link *= min(1.0, std / length) if length > 0.0 else 0.0  # a correlation of one at most
    own = np.sqrt(max(std**2 - float(link @ link), 0.0))
    return np.block([[F, np.zeros((len(F), 1))], [link[None, :], np.array([[own]])]])


def _findings(result: Result, model: IdentifiedModel) -> list[Finding]:
    """What a reader of the prediction must know about the model it was made with."""
    found = []
    if model.method == "balance":
        message = "The fit did not converge; the prediction rests on the balance equations, whose bands are wider."
        found.append(Finding("predict/balance", "warning", message))
    diagnosis = result.diagnosis
    if diagnosis is not None and diagnosis.causes:
        names = ", ".join(cause.name for cause in diagnosis.causes)
        message = (
            f"The diagnosis found {names}. The prediction is of the ideal test of the cable itself: what belongs to "
            "the rig is left out rightly, what belongs to the cable (friction, set, variation along it) is missing."
        )
        found.append(Finding("predict/cause", "warning", message))
    if diagnosis is not None and diagnosis.verdict == "unexplained":
        message = "The model leaves a misfit that no known cause removes; bands do not contain it."
        found.append(Finding("predict/unexplained", "warning", message))
    return found

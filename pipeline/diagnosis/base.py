"""The base model: what is fitted before anything is suspected.

A cable of uniform pre-curvature K0 with a spline characteristic f_EI(K - K0) (tangent reading, control points fixed
before the diagnosis), on ideal bearings, the displacement counted from the mounted position, loading and unloading with
one and the same law. Beside them, with the prior knowledge the measurement states: the scale of the photos and the length
of the cable. Every candidate cause is an addition to this.

Parameters, in this order: the ordinates (relative to a reference stiffness), K0 (1/m), relative error of the stated px/mm,
relative error of the stated length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.camera import scaled
from pipeline.diagnosis.prediction import Facts, Model, Observer
from rod.bending_test import BendingTest
from rod.characteristic import Characteristic
from rod.knots import place_knots
from rod.measurement import MeasuredTest

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Base:
    """Recipe of the base model.

    Attributes
    ----------
    knots : (p,) 1/m
        Control points over the excess curvature K - K0.
    stiffness : N m^2
        Reference of the ordinates.
    length : m
        As stated.
    scale_std, length_std : relative
        Prior knowledge.
    elements : int
    straight : bool
        K0 is held at zero (where the machinery starts from the poorest model).
    """

    knots: Array
    stiffness: float
    length: float
    scale_std: float
    length_std: float
    elements: int
    straight: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        bend = () if self.straight else ("pre_curvature",)
        return (*(f"stiffness_{i}" for i in range(len(self.knots))), *bend, "scale", "length")

    @property
    def pre_curvature_index(self) -> int | None:
        """Position of K0 in the vector, None if it is held at zero."""
        return None if self.straight else len(self.knots)

    @property
    def prior_std(self) -> Array:
        """Standard deviation (p,) of the prior of each parameter; infinite where nothing is known."""
        free = len(self.knots) + (0 if self.straight else 1)
        return np.r_[np.full(free, np.inf), self.scale_std, self.length_std]

    def steps(self, facts: Facts) -> Array:
        """Steps (p,) of difference quotients: a thousandth of what would be a large change."""
        bend = [] if self.straight else [1e-4 * facts.curvature_scale]
        return np.r_[np.full(len(self.knots), 1e-4), bend, 1e-6, 1e-6]

    def pre_curvature(self, vector: Array) -> float:
        """K0, 1/m."""
        return 0.0 if self.straight else float(vector[len(self.knots)])

    def characteristic(self, vector: Array) -> Characteristic:
        """f_EI over the excess curvature."""
        ordinates = self.stiffness * vector[: len(self.knots)]
        return Characteristic.from_ordinates(self.knots, ordinates, reading="tangent", abscissa="excess")

    def model(self, vector: Array) -> Model:
        """The model at a parameter vector."""
        bending = BendingTest(
            self.length / (1.0 + float(vector[-1])),
            self.characteristic(vector),
            self.pre_curvature(vector),
            elements=self.elements,
        )
        return Model(bending).observed(self.observer(vector))

    def observer(self, vector: Array) -> Observer:
        """First observer of every model: the camera with its scale."""
        return scaled(float(vector[len(self.names) - 2]))

    def ordinate_shares(self, knots: Array) -> Array:
        """Value (k, p) of the cardinal splines of the base's control points at ``knots`` (k,)."""
        return np.column_stack(
            [Characteristic.from_ordinates(self.knots, unit).f(knots) for unit in np.eye(len(self.knots))]
        )

    def admissible(self, vector: Array) -> bool:
        """Whether the stiffness is positive at every control point and nothing is absurd."""
        ordinates = vector[: len(self.knots)]
        return bool(np.all(ordinates > 0.0) and np.all(np.isfinite(vector)) and np.all(np.abs(vector[-2:]) < 0.3))


def start(test: MeasuredTest, facts: Facts, *, knots: int, elements: int, straight: bool = False) -> tuple[Base, Array]:
    """Base model and first guess: a constant stiffness by regression of the photographed curvature on the moment P y.

    ``K = K0 + P y / EI`` over all photos needs no simulation and no guess, and is within a factor two for any cable.

    Raises
    ------
    ValueError
        If no step has both a photo and a force.
    """
    curvature, moment = [], []
    for step in test.steps:
        if step.shape is not None:
            inside = slice(len(step.shape.s) // 10, -(len(step.shape.s) // 10) or None)
            curvature.append(step.shape.kappa[inside])
            moment.append(step.force * step.shape.y[inside])
    if not curvature:
        raise ValueError("no step has a measured shape")
    K, m = np.concatenate(curvature), np.concatenate(moment)
    slope, rest = np.polyfit(m, K, 1) if np.ptp(m) > 0.0 else (0.0, float(np.mean(K)))
    if not slope > 0.0:  # a straight, force-free cable or a force of the wrong sign: any positive stiffness will do
        slope, rest = np.ptp(K) / max(float(np.max(np.abs(m))), 1e-30), 0.0
    reach = max(float(np.quantile(K, 0.995)) - rest, 0.2 * facts.curvature_scale)
    base = Base(
        knots=place_knots(0.0, reach, knots) if knots > 2 else np.linspace(0.0, reach, knots),
        stiffness=float(1.0 / slope),
        length=test.length,
        scale_std=max(test.scale_std, 1e-7),
        length_std=max(test.length_std / test.length, 1e-7),
        elements=elements,
        straight=straight,
    )
    vector = np.r_[np.ones(max(knots, 1)), [] if straight else [rest], 0.0, 0.0]
    return base, vector

"""The base model: what is fitted before anything is suspected.

A cable of uniform pre-curvature K0 with a spline characteristic f_EI(K - K0) (tangent reading, control points fixed
before the diagnosis), on ideal bearings, the displacement counted from the mounted position, loading and unloading with
one and the same law. Beside them, with the prior knowledge the measurement states: where the bearing axes are on all
photos alike, the scale of the photos and the length of the cable. Every candidate cause is an addition to this.

Parameters, in this order: logarithms of the ordinates over a reference stiffness (so the stiffness is positive), K0
(1/m), errors of the axes along and across the chord (m; only if the measurement states any), errors of the displacement
of single steps (m; only where the log scatters, or has none), relative error of the stated px/mm, relative error of the
stated length. A weak prior keeps the law smooth, ``int (d^2 log f / dt^2)^2 dt / tau^2`` with t from 0 to 1 over the
control points (see `pipeline.diagnosis.fits.knots`): without a photo of the force-free cable, K0 and the stiffness near
K0 are else free to run away together.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.camera import axes_off, scaled
from pipeline.diagnosis.fits.knots import first_slope, place_knots, roughness
from pipeline.diagnosis.observations.prediction import Facts, Model, Observer
from rod.bending_test import BendingTest
from rod.characteristic import Characteristic
from rod.measurement import MeasuredTest

Array = NDArray[np.float64]

AXES = ("left_along", "left_across", "right_along", "right_across", "parallax")

EXACT = 1e-7
"""Relative standard deviation of a length that is stated as exact: below any photo's resolution."""

FLOOR = 0.02
"""Share of the largest ordinate below which no law starts: beyond its own control points a spline may fall to zero."""

MOVED = "displacement_"
"""Begin of the name of the error of a step's displacement; its index follows."""


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
    axis_std : m
        Prior knowledge of each coordinate of the axes, common to all photos; 0 if they are exact.
    axis_parallax_std, camera_foot_std : relative, m
        Of what is seen above the cable beyond that (`rod.measurement.MeasuredTest`).
    elements : int
    roughness : float
        tau of the prior on the law.
    rest_slope : float
        Standard deviation of d log f / dt at K0: a cable that bends alike to both sides has slope zero there.
    places : (p,) or None
        Of the control points, where the law is smooth along another quantity than the curvature.
    first : 1/m
        K0 of the first guess.
    straight : bool
        K0 is held at zero (where the machinery starts from the poorest model).
    moved : tuple of int
        Indices of the steps whose displacement is not exact, in rising order.
    moved_std : (k,) m
        Prior knowledge of the errors of their displacements.
    moved_first : (k,) m
        First guess of those errors.
    """

    knots: Array
    stiffness: float
    length: float
    scale_std: float
    length_std: float
    elements: int
    roughness: float
    first: float = 0.0
    straight: bool = False
    axis_std: float = 0.0
    axis_parallax_std: float = 0.0
    camera_foot_std: float = 0.0
    rest_slope: float = 1.0
    places: Array | None = None
    moved: tuple[int, ...] = ()
    moved_std: Array = field(default_factory=lambda: np.zeros(0))
    moved_first: Array = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        bend = () if self.straight else ("pre_curvature",)
        moved = (f"{MOVED}{i}" for i in self.moved)
        return (*(f"stiffness_{i}" for i in range(len(self.knots))), *bend, *self.axes, *moved, "scale", "length")

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the errors of the bearing axes."""
        return AXES if self.axis_std > 0.0 or self.axis_parallax_std > 0.0 else ()

    @property
    def observed(self) -> tuple[str, ...]:
        """Names of the parameters that change what is seen and not what happens."""
        return (*self.axes, "scale")

    def axis_errors(self, vector: Array) -> Array:
        """Errors (5,) of the axes in the order of `AXES`, m and relative."""
        first = len(self.knots) + (not self.straight)
        return np.asarray(vector[first : first + len(AXES)]) if self.axes else np.zeros(len(AXES))

    def shift(self, vector: Array, steps: int) -> Array | float:
        """Errors (steps,) of the displacements, m; a plain zero where all are exact."""
        if not self.moved:
            return 0.0
        shift = np.zeros(steps)
        shift[list(self.moved)] = vector[-2 - len(self.moved) : -2]
        return shift

    @property
    def pre_curvature_index(self) -> int | None:
        """Position of K0 in the vector, None if it is held at zero."""
        return None if self.straight else len(self.knots)

    @property
    def prior(self) -> Array:
        """Prior knowledge as rows (m, p) of unit variance, around zero: scale, length, axes, places, smoothness."""
        count, size = len(self.knots), len(self.names)
        rows = [np.eye(size)[-2] / self.scale_std, np.eye(size)[-1] / self.length_std]
        if self.axes:
            first = self.names.index(self.axes[0])
            rows.extend(self._axis_rows() @ np.eye(size)[first : first + len(self.axes)])
        if self.moved:
            rows.extend(np.eye(size)[-2 - len(self.moved) : -2] / self.moved_std[:, None])
        if count > 2:
            places = self.knots if self.places is None else self.places
            weight, mode = np.linalg.eigh(roughness(places))
            kept = weight > 1e-9 * weight[-1]
            bend = np.sqrt(weight[kept])[:, None] * mode.T[kept] / self.roughness
            if not self.straight:  # only then the control points count from the curvature at rest
                bend = np.vstack([bend, first_slope(places) / self.rest_slope])
            rows.extend(np.hstack([bend, np.zeros((len(bend), size - count))]))
        return np.array(rows)

    def _axis_rows(self) -> Array:
        """Prior of the axes' errors (5, 5): each its own, what the camera's foot moves alike, and the parallax."""
        own = max(self.axis_std, EXACT * self.length)
        alike = np.tile(np.eye(2), (2, 2))
        covariance = np.diag([own**2] * 4 + [max(self.axis_parallax_std, EXACT) ** 2])
        covariance[:4, :4] += (self.axis_parallax_std * self.camera_foot_std) ** 2 * alike
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))

    @property
    def known(self) -> int:
        """Number of rows of prior knowledge that are not about the form of the law; they come first."""
        return 2 + len(self.axes) + len(self.moved)

    def steps(self, facts: Facts) -> Array:
        """Steps (p,) of difference quotients: a thousandth of what would be a large change."""
        bend = [] if self.straight else [1e-4 * facts.curvature_scale]
        places = np.full(len(self.axes) + len(self.moved), 1e-6 * facts.length)
        return np.asarray(np.r_[np.full(len(self.knots), 1e-4), bend, places, 1e-6, 1e-6])

    def neutral(self, *, stiffness: float = 1.0, bend: float = 0.0) -> Array:
        """Vector of a first guess: constant stiffness (times ``stiffness``), and K0 (plus ``bend``, 1/m)."""
        rest = [] if self.straight else [self.first + bend]
        law, axes = np.full(len(self.knots), np.log(stiffness)), np.zeros(len(self.axes))
        return np.asarray(np.r_[law, rest, axes, self.moved_first, 0.0, 0.0])

    def pre_curvature(self, vector: Array) -> float:
        """K0, 1/m."""
        return 0.0 if self.straight else float(vector[len(self.knots)])

    def characteristic(self, vector: Array) -> Characteristic:
        """f_EI over the excess curvature."""
        return Characteristic.from_ordinates(self.knots, self.ordinates(vector), reading="tangent", abscissa="excess")

    def model(self, vector: Array, *, steps: int = 0) -> Model:
        """The model at a parameter vector; ``steps`` of the test, which count where displacements are not exact."""
        bending = BendingTest(
            self.length / (1.0 + float(vector[-1])),
            self.characteristic(vector),
            self.pre_curvature(vector),
            elements=self.elements,
        )
        return Model(bending, shift=self.shift(vector, steps)).observed(self.observer(vector))

    def observer(self, vector: Array) -> Observer:
        """First observer of every model: the camera with its scale, and the axes found on its photos."""
        camera = scaled(float(vector[len(self.names) - 2]))
        if not self.axes:
            return camera
        errors = axes_off(self.axis_errors(vector))
        return lambda prediction, facts: errors(camera(prediction, facts), facts)

    def law_directions(self, vector: Array, knots: Array) -> Array:
        """Change (k, p) of the law at ``knots`` (k,) per unit of the first p parameters, N m^2."""
        own = np.array_equal(knots, self.knots)
        return (np.eye(len(knots)) if own else self._cardinal(knots)) * self.ordinates(vector)

    def following(self, law: Characteristic) -> Array:
        """Parameters (p,) of this law's control points that lie on another law, as far as that is stiff enough."""
        return np.asarray(np.log(np.maximum(law.f(self.knots), FLOOR * float(np.max(law.ordinates))) / self.stiffness))

    def ordinates(self, vector: Array) -> Array:
        """Control points (p,) of the law, N m^2."""
        return np.asarray(self.stiffness * np.exp(vector[: len(self.knots)]))

    @cached_property
    def between(self) -> Array:
        """The law per ordinate (5 (p - 1), p) at five places from each control point to the next."""
        shares = np.linspace(0.0, 1.0, 7)[1:-1]
        return self._cardinal((self.knots[:-1, None] + np.diff(self.knots)[:, None] * shares).ravel())

    def _cardinal(self, at: Array) -> Array:
        return np.column_stack(
            [Characteristic.from_ordinates(self.knots, unit).f(at) for unit in np.eye(len(self.knots))]
        )

    def admissible(self, vector: Array) -> bool:
        """Whether nothing is absurd: stiffness within e^12 of the reference, scale and length within 30 %."""
        law = np.abs(vector[: len(self.knots)])
        return bool(np.all(law < 12.0) and np.all(np.isfinite(vector)) and np.all(np.abs(vector[-2:]) < 0.3))


def start(
    test: MeasuredTest,
    facts: Facts,
    *,
    knots: int,
    elements: int,
    smoothness: float,
    straight: bool = False,
    exact: float = 0.0,
) -> Base:
    """Base model with its first guess: a constant stiffness by regression of photographed curvature on the moment P y.

    ``K = K0 + P y / EI`` over all photos needs no simulation and no guess, and is within a factor two for any cable.
    A displacement that is known to ``exact`` (m) or better has no error of its own.

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
    moved = tuple(np.flatnonzero(facts.displacement_std > exact).tolist())
    return Base(
        knots=place_knots(0.0, reach, knots) if knots > 2 else np.linspace(0.0, reach, knots),
        stiffness=float(1.0 / slope),
        length=test.length,
        scale_std=max(test.scale_std, EXACT),
        length_std=max(test.length_std / test.length, EXACT),
        elements=elements,
        roughness=smoothness,
        first=float(rest),
        straight=straight,
        axis_std=test.axis_std,
        axis_parallax_std=test.axis_parallax_std,
        camera_foot_std=test.camera_foot_std,
        moved=moved,
        moved_std=facts.displacement_std[list(moved)],
        moved_first=np.array([_first_error(test, facts, i, 0.0 if straight else float(rest)) for i in moved]),
    )


def _first_error(test: MeasuredTest, facts: Facts, index: int, pre_curvature: float) -> float:
    """Guess of the error of a step's displacement, m: of one that no log states, by its photo and the natural chord."""
    chord = test.steps[index].chord
    if test.steps[index].displacement is not None or chord is None:
        return 0.0
    natural = test.length * float(np.sinc(0.5 * pre_curvature * test.length / np.pi))
    return natural - chord - float(facts.displacement[index])

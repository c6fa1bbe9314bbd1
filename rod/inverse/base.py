"""The base model: what is fitted before anything is suspected.

A cable of uniform pre-curvature K0 with a law of any form (`laws`), on ideal bearings, the displacement counted
from the mounted position, loading and unloading with one and the same law. Beside them, with the prior knowledge the
measurement states: where the bearing axes are on all photos alike, how far the camera is from looking straight down
through a true lens, the scale of the photos and the length of the cable. Every candidate cause is an addition to this.

Parameters, in this order: the unknowns of the law, K0 (1/m), errors of the axes and of the camera (only if the
measurement states any of the axes), errors of the displacement of single steps (m; only where the log scatters, or has
none), what every rig is off by (`RIG`; where it is not taken as exact), relative error of the stated px/mm, relative
error of the stated length.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rod.array import Array
from rod.bending_test import BendingTest
from rod.characteristic import ParametricCurve
from rod.compliance_law import moment_basis
from rod.inverse.camera import DISTORTED, axes_off, scaled, tilt_of
from rod.inverse.laws import COEFFICIENTS, AnyLaw, FewPoints, Law, as_photographed
from rod.inverse.prediction import Facts, Model, Observer, Prediction
from rod.measurement import MeasuredTest

ELEMENTS = 120
"""Of the simulated cable: its force is right to 1e-4, a thirtieth of a load cell's."""

AXES = ("left_along", "left_across", "right_along", "right_across", "parallax", "tilt_along", "tilt_across", "lens")

SQUARE = 0.05
"""Of the plausible tilt and distortion of a camera: what is left of them where it was set up with care, a tenth of a
degree. Photos that are right to a hundredth of a pixel show that much; it changes f_EI by a fifth of a percent."""

EXACT = 1e-7
"""Relative standard deviation of a length that is stated as exact: below any photo's resolution."""

MOVED = "displacement_"
"""Begin of the name of the error of a step's displacement; its index follows."""

RIG = ("displacement_zero", "force_zero", "length_beyond", "lean_along", "lean_across")
"""What a rig is off by beyond all that is stated of it: zeros of displacement under load (m) and of force (N), relative
error of the length, lean of the camera along and across the chord (1/m)."""


@dataclass(frozen=True, eq=False)
class Base:
    """Recipe of the base model.

    Attributes
    ----------
    law : Law
        Of p unknowns.
    length : m
        As stated.
    scale_std, length_std : relative
        Prior knowledge.
    axis_std : m
        Prior knowledge of each coordinate of the axes, common to all photos; 0 if they are exact.
    axis_parallax_std, camera_foot_std : relative, m
        Of what is seen above the cable beyond that (`rod.measurement.MeasuredTest`).
    elements : int
    first : 1/m
        K0 of the first guess.
    seen : (p + 1,) or None
        Unknowns of the law and K0 (1/m) as the photos show them by the moment P y.
    straight : bool
        K0 is held at zero (where the machinery starts from the poorest model).
    moved : tuple of int
        Indices of the steps whose displacement is not exact, in rising order.
    moved_std : (k,) m
        Prior knowledge of the errors of their displacements.
    moved_first : (k,) m
        First guess of those errors.
    pushed : tuple of int
        Indices of the steps under load, which a wrong zero of the displacement moves.
    rig_std : (5,) or empty
        Prior knowledge of what the rig is off by, in the order of `RIG`; exact where empty.
    """

    law: Law
    length: float
    scale_std: float
    length_std: float
    elements: int = ELEMENTS
    first: float = 0.0
    seen: Array | None = None
    straight: bool = False
    axis_std: float = 0.0
    axis_parallax_std: float = 0.0
    camera_foot_std: float = 0.0
    moved: tuple[int, ...] = ()
    moved_std: Array = field(default_factory=lambda: np.zeros(0))
    moved_first: Array = field(default_factory=lambda: np.zeros(0))
    pushed: tuple[int, ...] = ()
    rig_std: tuple[float, ...] = ()

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        bend = () if self.straight else ("pre_curvature",)
        moved = (f"{MOVED}{i}" for i in self.moved)
        before = (*(f"stiffness_{i}" for i in range(self.law.size)), *bend, *self.axes, *moved)
        return (*before, *RIG[: len(self.rig_std)], "scale", "length")

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the errors of the bearing axes."""
        return AXES if self.axis_std > 0.0 or self.axis_parallax_std > 0.0 else ()

    @property
    def observed(self) -> tuple[str, ...]:
        """Names of the parameters that change what is seen and not what happens."""
        return (*self.axes, "scale")

    def axis_errors(self, vector: Array) -> Array:
        """Errors (..., 8) of axes and camera as in `AXES`, m, relative and 1/m; the lean of the rig in them."""
        errors = np.zeros((*vector.shape[:-1], len(AXES)))
        if self.axes:
            first = self.law.size + (not self.straight)
            errors += vector[..., first : first + len(AXES)]
        if self.rig_std:
            errors[..., 5:7] += vector[..., self.rig_at[3:]]
        return errors

    def beyond_log(self, facts: Facts, exact: float) -> NDArray[np.int_]:
        """Positions in the vector of errors of displacements that the log tells to ``exact`` (m) or better."""
        return np.arange(len(self.names))[self.moved_at][facts.displacement_std[list(self.moved)] <= exact]

    @property
    def rig_at(self) -> NDArray[np.int_]:
        """Positions in the vector of what the rig is off by."""
        return np.arange(len(self.names) - 2 - len(self.rig_std), len(self.names) - 2)

    @property
    def lengths_at(self) -> NDArray[np.int_]:
        """Positions in the vector of relative errors of the length."""
        return np.append(self.rig_at[2:3], len(self.names) - 1)

    @property
    def moved_at(self) -> slice:
        """Where in the vector the errors of displacements are."""
        stop = len(self.names) - 2 - len(self.rig_std)
        return slice(stop - len(self.moved), stop)

    def shift(self, vector: Array, steps: int) -> Array | float:
        """Errors (steps,) of the displacements, m; a plain zero where all are exact."""
        if not (self.moved or self.rig_std):
            return 0.0
        shift = np.zeros(steps)
        shift[list(self.moved)] = vector[self.moved_at]
        shift[list(self.pushed)] += vector[self.rig_at[:1]].sum()  # none where the rig is exact
        return shift

    @property
    def pre_curvature_index(self) -> int | None:
        """Position of K0 in the vector, None if it is held at zero."""
        return None if self.straight else self.law.size

    @property
    def prior(self) -> Array:
        """Prior knowledge as rows (m, p) of unit variance, around zero: scale, length, axes, places, law."""
        count, size = self.law.size, len(self.names)
        rows = [np.eye(size)[-2] / self.scale_std, np.eye(size)[-1] / self.length_std]
        if self.axes:
            first = self.names.index(self.axes[0])
            rows.extend(self._axis_rows() @ np.eye(size)[first : first + len(self.axes)])
        if self.moved:
            rows.extend(np.eye(size)[self.moved_at] / self.moved_std[:, None])
        if self.rig_std:
            rows.extend(np.eye(size)[self.rig_at] / np.array(self.rig_std)[:, None])
        return np.vstack([*rows, np.pad(self.law.prior, ((0, 0), (0, size - count)))])

    def _axis_rows(self) -> Array:
        """Prior (8, 8): each axis its own error, what the camera's foot moves alike, the parallax, and the camera."""
        own = max(self.axis_std, EXACT * self.length)
        alike = np.tile(np.eye(2), (2, 2))
        tilt = SQUARE * tilt_of(self.length)
        camera = [tilt**2, tilt**2, (SQUARE * DISTORTED) ** 2]
        covariance = np.diag([own**2] * 4 + [max(self.axis_parallax_std, EXACT) ** 2, *camera])
        covariance[:4, :4] += (self.axis_parallax_std * self.camera_foot_std) ** 2 * alike
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))

    @property
    def known(self) -> int:
        """Number of rows of prior knowledge that are not about the form of the law; they come first."""
        return 2 + len(self.axes) + len(self.moved) + len(self.rig_std)

    def steps(self, facts: Facts) -> Array:
        """Steps (p,) of difference quotients: a thousandth of what would be a large change."""
        bend = [] if self.straight else [1e-4 * facts.curvature_scale]
        places = np.full(len(self.axes) + len(self.moved), 1e-6 * facts.length)
        rig = [1e-6 * facts.length, 1e-4 * facts.force_scale, *[1e-6] * 3][: len(self.rig_std)]
        return np.asarray(np.r_[np.full(self.law.size, 1e-4), bend, places, rig, 1e-6, 1e-6])

    def neutral(self, *, stiffness: float = 1.0, bend: float = 0.0) -> Array:
        """Vector of a first guess: constant stiffness (times ``stiffness``), and K0 (plus ``bend``, 1/m)."""
        rest = [] if self.straight else [self.first + bend]
        axes = np.zeros(len(self.axes))
        rig = np.zeros(len(self.rig_std))
        return np.asarray(np.r_[self.law.stiffer(stiffness), rest, axes, self.moved_first, rig, 0.0, 0.0])

    def as_seen(self) -> Array:
        """Vector of a first guess by the photos alone; the neutral one where they do not tell."""
        if self.seen is None or self.straight:
            return self.neutral()
        return np.asarray(np.r_[self.seen, self.neutral()[self.law.size + 1 :]])

    def stiffer(self, vector: Array, factor: float) -> Array:
        """A vector of this or an extended model with all of the law so much stiffer."""
        return np.asarray(np.r_[vector[: self.law.size] + self.law.stiffer(factor), vector[self.law.size :]])

    def pre_curvature(self, vector: Array) -> float:
        """K0, 1/m."""
        return 0.0 if self.straight else float(vector[self.law.size])

    def characteristic(self, vector: Array) -> ParametricCurve:
        """f_EI over the excess curvature."""
        return self.law.curve(vector[: self.law.size])

    def model(self, vector: Array, *, steps: int = 0) -> Model:
        """The model at a parameter vector; ``steps`` of the test, which count where displacements are not exact."""
        bending = BendingTest(
            self.length / float(np.prod(1.0 + vector[self.lengths_at])),
            self.characteristic(vector),
            self.pre_curvature(vector),
            elements=self.elements,
        )
        return Model(bending, shift=self.shift(vector, steps)).observed(self.observer(vector))

    def observer(self, vector: Array) -> Observer:
        """First observer of every model: camera with its scale, axes found on its photos, zero of the load cell.

        Of k vectors (k, p) it makes k variations of a prediction.
        """
        seen = [scaled(vector[..., len(self.names) - 2])]
        if self.axes or self.rig_std:
            seen.append(axes_off(self.axis_errors(vector)))
        zero = vector[..., self.rig_at[1:2]].sum(axis=-1, keepdims=True)

        def observer(prediction: Prediction, facts: Facts) -> Prediction:
            for one in seen:
                prediction = one(prediction, facts)
            samples = tuple(held + zero for held in prediction.samples)
            return replace(prediction, force=prediction.force + zero, samples=samples)

        return observer

    def admissible(self, vector: Array) -> bool:
        """Whether nothing is absurd: stiffness within e^12 of the reference, scale and length within 30 %."""
        law = np.abs(vector[: self.law.size])
        return bool(np.all(law < 12.0) and np.all(np.isfinite(vector)) and np.all(np.abs(vector[-2:]) < 0.3))


def start(
    test: MeasuredTest,
    facts: Facts,
    *,
    points: int = 0,
    straight: bool = False,
    exact: float = 0.0,
    begin: tuple[float, float] | None = None,
    side: float | None = None,
) -> Base:
    """Base model with its first guesses, by the photographed curvature over the moment P y: a constant, and any law.

    ``K = K0 + P y / EI`` over all photos needs no simulation and no guess, and is within a factor two for any cable.
    The law is one of any form, or a spline of ``points``. With ``begin`` (N m^2, 1/m) given it is that constant EI and
    K0, with ``side`` (1/m) the law that photos show beside that K0. A displacement that is known to ``exact`` (m) or
    better has no error of its own.

    Raises `ValueError` if no step has both a photo and a force.
    """
    K, m = measured_curvatures(test)
    slope, rest = np.polyfit(m, K, 1) if np.ptp(m) > 0.0 else (0.0, float(np.mean(K)))
    if not slope > 0.0:  # a straight, force-free cable or a force of the wrong sign: any positive stiffness will do
        slope, rest = np.ptp(K) / max(float(np.max(np.abs(m))), 1e-30), 0.0
    reach = max(float(np.quantile(K, 0.995)) - rest, 0.2 * facts.curvature_scale)
    stiffness = float(1.0 / slope)
    if begin is not None:
        stiffness, rest = begin
    rest = rest if side is None else side
    law: Law = FewPoints(np.linspace(0.0, reach, points), stiffness)
    seen = None
    if not points:
        law = AnyLaw(moment_basis(0.0, reach, unit=stiffness, size=COEFFICIENTS))
        shown = None if begin is not None else as_photographed(m, K, unit=stiffness, rest=side)
        if shown is not None:
            law, coefficients, bend = shown
            seen = np.r_[coefficients, bend]
    moved = tuple(np.flatnonzero(facts.displacement_std > exact).tolist())
    return Base(
        law=law,
        seen=seen,
        length=test.length,
        scale_std=max(test.scale_std, EXACT),
        length_std=max(test.length_std / test.length, EXACT),
        first=float(rest),
        straight=straight,
        axis_std=test.axis_std,
        axis_parallax_std=test.axis_parallax_std,
        camera_foot_std=test.camera_foot_std,
        moved=moved,
        moved_std=facts.displacement_std[list(moved)],
        pushed=facts.pushed,
        moved_first=np.array([_first_error(test, facts, i, 0.0 if straight else float(rest)) for i in moved]),
    )


def bent_at_rest(test: MeasuredTest) -> float | None:
    """Size of K0, 1/m, by how far apart the axes stood at rest; None where no photo or log tells it."""
    chords = [step.chord for step in test.steps if step.branch == "mounted" and step.chord is not None]
    logged = [(step.chord, step.displacement) for step in test.steps]
    chords = chords or [chord + moved for chord, moved in logged if chord is not None and moved is not None]
    if not chords:
        return None
    half_turn = np.linspace(0.0, np.pi, 2001)
    found = np.interp(-float(np.mean(chords)) / test.length, -np.sinc(half_turn / np.pi), half_turn)
    return float(found) * 2.0 / test.length


def _first_error(test: MeasuredTest, facts: Facts, index: int, pre_curvature: float) -> float:
    """Guess of the error of a step's displacement, m: of one that no log states, by its photo and the natural chord."""
    chord = test.steps[index].chord
    if test.steps[index].displacement is not None or chord is None:
        return 0.0
    natural = test.length * float(np.sinc(0.5 * pre_curvature * test.length / np.pi))
    # a cable that is seen longer than it is said to be is pressed all the same: by a thousandth of it at least
    return max(natural - chord, 1e-3 * test.length) - float(facts.displacement[index])


def measured_curvatures(test: MeasuredTest) -> tuple[Array, Array]:
    """Curvature (n,) 1/m and moment P y (n,) N m wherever photos show the cable, but for their outermost tenths.

    Raises `ValueError` if no step has both a photo and a force.
    """
    curvature, moment = [], []
    for step in test.steps:
        if step.shape is not None:
            inside = slice(len(step.shape.s) // 10, -(len(step.shape.s) // 10) or None)
            curvature.append(step.shape.kappa[inside])
            moment.append(step.force * step.shape.y[inside])
    if not curvature:
        raise ValueError("no step has a measured shape")
    return np.concatenate(curvature), np.concatenate(moment)

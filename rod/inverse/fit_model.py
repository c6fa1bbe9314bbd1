"""Unknowns and data of the inverse problem: what is fitted, with which priors, to which steps.

Unknowns u, all of order one:

    a      coefficients of the law (`rod.compliance_law`): its stiffness is positive whatever they are
    k0     K0 times the length
    then, in units of their prior standard deviations, the nuisances: the cable's ``length``, the common ``scale`` of
    the photos, the ``zero`` of displacement (only where a step has no photo), and the position of both bearing axes,
    along and across the chord: what all photos have in common, what each photo adds, and the ``parallax`` of axes seen
    on covers above the plane of the scale: away from the camera's foot by one part of the way to it

Signs and units: `rod.measurement`; SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rod.bending_test import BendingTest
from rod.compliance_law import ComplianceLaw, LawBasis
from rod.measurement import MeasuredStep, MeasuredTest
from rod.midline import Midline, midline

Array = NDArray[np.float64]

POSE = ("left_along", "left_across", "right_along", "right_across")

NO_ERROR = 1e-7
"""Of the length: standard deviation of an axis for which none is stated, below any photo's resolution."""


@dataclass(frozen=True)
class StepData:
    """One step of the fit.

    Attributes
    ----------
    step : MeasuredStep
    midline : Midline or None
        Independent data of its photo.
    chord : m or None
        By the photo.
    axis_std : m
        Of each coordinate of a bearing axis.
    """

    step: MeasuredStep
    midline: Midline | None
    chord: float | None
    axis_std: float

    @property
    def at_rest(self) -> bool:
        """Whether the cable is free of force: the mounted step."""
        return self.step.branch == "mounted"

    def from_foot(self, part: str) -> float:
        """Coordinate `part` (one of `POSE`) of a bearing axis, counted from the middle of the picture, m."""
        chord = self.chord or 0.0
        along, across = self.step.picture_centre or (0.5 * chord, 0.0)
        side, _, direction = part.partition("_")
        if direction == "across":
            return -across
        return (chord if side == "right" else 0.0) - along


@dataclass(frozen=True)
class FitModel:
    """Data and fixed choices of one fit.

    Attributes
    ----------
    data : tuple of StepData
    length : m
        As told.
    basis : LawBasis
        Of the law; with a unit of the cable's own size, the fit of a cable a thousand times stiffer is the same.
    elements : int
        Of the simulated rod.
    zero : m or None
        Distance of the axes at displacement zero by the photos; None: the natural chord.
    nuisances : dict of name -> std
        In the order of the unknowns; m, the scale relative.
    blur : (shapes, forces)
        Factors on the noise of the data, above 1 where the simulation cannot follow them within their noise: what it
        gets wrong then counts as noise, and neither the law nor the nuisances are bent to hide it.
    force_errors : tuple of mappings of step number -> N
        See `rod.measurement.MeasuredTest`; they are in the bands and not in the fit.
    """

    data: tuple[StepData, ...]
    length: float
    basis: LawBasis
    elements: int
    zero: float | None
    nuisances: dict[str, float]
    blur: tuple[float, float] = (1.0, 1.0)
    force_errors: tuple[Mapping[int, float], ...] = ()

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.laws + len(self.nuisances)

    @property
    def laws(self) -> int:
        """Number of unknowns that are not nuisances: coefficients and K0."""
        return self.basis.size + 1

    def index(self, name: str) -> int:
        """Place of a nuisance among the unknowns."""
        return self.laws + list(self.nuisances).index(name)

    def nuisance(self, u: Array, name: str) -> float:
        """A nuisance in its own unit."""
        return float(u[self.index(name)]) * self.nuisances[name]

    def pose(self, u: Array, data: StepData) -> tuple[float, float, float, float]:
        """Positions of the bearing axes on the photo of a step in the order of `POSE`, m."""
        parts = [sum(c * self.nuisance(u, name) for name, c in self.pose_terms(part, data)) for part in POSE]
        return parts[0], parts[1], parts[2], parts[3]

    def pose_terms(self, part: str, data: StepData) -> tuple[tuple[str, float], ...]:
        """Nuisances, each with its factor, that add up to one of `POSE` on the photo of a step."""
        # what moves both axes alike: the camera's foot is not just in the middle of the picture
        foot = "foot_" + part.partition("_")[2]
        common = ((part, 1.0), (foot, 1.0), ("parallax", data.from_foot(part)))
        return ((f"{part}/{data.step.step}", 1.0), *((name, c) for name, c in common if name in self.nuisances))

    def cable_length(self, u: Array) -> float:
        """Length of the cable, m."""
        return self.length + self.nuisance(u, "length")

    def pre_curvature(self, u: Array) -> float:
        """K0, 1/m."""
        return float(u[self.basis.size]) / self.length

    def law(self, u: Array) -> ComplianceLaw:
        """The law."""
        return self.basis.law(u[: self.basis.size])

    def bending_test(self, u: Array) -> BendingTest:
        """The simulated experiment."""
        return BendingTest(self.cable_length(u), self.law(u), self.pre_curvature(u), elements=self.elements)

    def start(self, law: ComplianceLaw, pre_curvature: float) -> Array:
        """Unknowns (q,) of a law and K0 (1/m), nuisances at their means."""
        u = np.zeros(self.size)
        u[: self.basis.size] = law.coefficients if law.basis is self.basis else self.basis.projected(law)
        u[self.basis.size] = pre_curvature * self.length
        return u

    def on(self, basis: LawBasis, u: Array) -> tuple[FitModel, Array]:
        """The model with another basis, and the unknowns (q,) of the same law there."""
        coefficients = basis.projected(self.law(u))
        return replace(self, basis=basis), np.concatenate([coefficients, u[self.basis.size :]])


def step_data(test: MeasuredTest, *, blocks: int = 160) -> tuple[StepData, ...]:
    """Data of every step that says something about the cable: photos, and forces of loaded steps.

    Raises
    ------
    ValueError
        If two steps have one number: residuals and nuisances are named by it.
    """
    if len({step.step for step in test.steps}) < len(test.steps):
        raise ValueError("every step of a test needs a number of its own")
    data = []
    for step in test.steps:
        shape = step.shape if step.shape is not None and step.shape.section_s.size >= 8 else None
        if shape is None and (step.branch == "mounted" or step.displacement is None):
            continue
        chord = step.chord
        if shape is not None and chord is None:
            chord = float(np.hypot(shape.x[-1] - shape.x[0], shape.y[-1] - shape.y[0]))
        axis_std = max((step.chord_std or 0.0) / np.sqrt(2.0), NO_ERROR * test.length)
        photo = None if shape is None else midline(shape, blocks=blocks)
        data.append(StepData(step, photo, None if photo is None else chord, axis_std))
    return tuple(data)


def zero_of_displacement(data: tuple[StepData, ...]) -> tuple[float, float] | None:
    """Distance of the axes at displacement zero by the photos and its std with scatter, m; None without photos."""
    pairs = [
        (d.chord + d.step.displacement, np.sqrt(2.0) * d.axis_std)
        for d in data
        if d.chord is not None and d.step.displacement is not None
    ]
    if not pairs:
        return None
    zeros, stds = np.array(pairs).T
    spread = float(zeros.std(ddof=1)) if zeros.size > 1 else 0.0
    return float(zeros.mean()), float(np.hypot(spread, stds.max()))


def fit_model(test: MeasuredTest, data: tuple[StepData, ...], basis: LawBasis, *, elements: int) -> FitModel:
    """Model of the given steps with its nuisances."""
    nuisances = {"length": test.length_std, "scale": test.scale_std}
    zero = zero_of_displacement(data)
    if zero is not None and any(d.midline is None for d in data):
        nuisances["zero"] = zero[1]
    if test.axis_std > 0.0:
        nuisances |= dict.fromkeys(POSE, test.axis_std)
    if test.axis_parallax_std > 0.0:
        beside = test.axis_parallax_std * test.camera_foot_std
        nuisances |= {"parallax": test.axis_parallax_std, "foot_along": beside, "foot_across": beside}
    for d in data:
        if d.midline is not None:
            nuisances |= {f"{name}/{d.step.step}": d.axis_std for name in POSE}
        elif d.step.displacement_std:
            nuisances[f"moved/{d.step.step}"] = d.step.displacement_std
    return FitModel(
        data,
        test.length,
        basis,
        elements,
        None if zero is None else zero[0],
        nuisances,
        force_errors=test.common_force_errors,
    )

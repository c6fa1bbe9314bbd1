"""What a model says would be measured: the bent cable of every step, seen by load cell, displacement log and camera.

`Facts` are the circumstances every model shares (when was a force sampled, which way did the bearing move);
`Prediction` is what the rod and the observers make of them. All lengths in m, in the chord frame of `rod.measurement`.

A model is a `rod.bending_test.BendingTest` and a chain of observers. An observer turns one `Prediction` into another: a
load cell that drifts, a camera that looks askew. A cause changes either of the two, see `pipeline.diagnosis.causes`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rod.array import Array
from rod.bending_test import BendingTest
from rod.equilibrium import Branch
from rod.measurement import MeasuredStep, MeasuredTest


@dataclass(frozen=True, eq=False)
class Facts:
    """Circumstances of a bending test of ``n`` steps.

    Attributes
    ----------
    branch : tuple of str
        ``mounted``, ``loading`` or ``unloading``.
    displacement : (n,) m
        By the log; from the photographed chord where the log has none. 0 at a mounted step within its own scatter.
    displacement_std : (n,) m
        Of each of them, as the log scatters; 0 where it is not told, and at rest.
    photo_time : (n,) s
        Time of the photo since the hold began; the middle of the hold where the log has no time.
    hold_times : tuple of (h,) s
        Times of the force samples since the hold began; numbers of the samples where the log has no time.
    clock : (n,) s
        When the hold began, since the first hold.
    picture_centre : (n, 2) m
        In the chord frame of each photo.
    half_diagonal : m
        Of the picture, on the plane of the cable.
    moving : str
        Bearing that is pushed, ``left`` or ``right``.
    timed : bool
        Whether the log has times.
    length : m
    force_scale, moment_scale : N, N m
        Largest force, and largest force times bow.
    curvature_scale : 1/m
        Range of the curvatures met.
    force_share : (n,)
        Measured force, as a share of the largest one.
    chord_by_log : (n,) m
        As far from the other one the axis that moves was put on a photo by the log; NaN where the photo shows it.
    bends : (n,) 1/m
        Largest bend from rest up to each step, by a fitted model; empty before any is.
    rest_side : {"natural", "up", "down"}
        To which photos show the mounted cable bowed; ``natural`` without such a photo.
    """

    branch: tuple[str, ...]
    displacement: Array
    displacement_std: Array
    photo_time: Array
    hold_times: tuple[Array, ...]
    clock: Array
    picture_centre: Array
    half_diagonal: float
    moving: str
    timed: bool
    length: float
    force_scale: float
    moment_scale: float
    curvature_scale: float
    force_share: Array
    chord_by_log: Array
    bends: Array = field(default_factory=lambda: np.zeros(0))
    rest_side: Branch = "natural"

    @property
    def travel(self) -> float:
        """Largest displacement, m."""
        return float(np.ptp(np.append(self.displacement, 0.0)))

    @property
    def pushed(self) -> tuple[int, ...]:
        """Indices of the steps under load."""
        return tuple(i for i, branch in enumerate(self.branch) if branch != "mounted")

    @property
    def returns(self) -> bool:
        """Whether there is an unloading branch."""
        return "unloading" in self.branch


def facts_of(test: MeasuredTest) -> Facts:
    """Circumstances of a measured test; what the log leaves out is replaced by what the photos say."""
    steps = test.steps
    shapes = [step.shape for step in steps if step.shape is not None]
    bow = max((float(np.max(np.abs(shape.y))) for shape in shapes), default=0.2 * test.length)
    bend = max((_range(shape.kappa[shape.seen]) for shape in shapes if np.any(shape.seen)), default=0.0)
    forces = np.array([abs(step.force) for step in steps])
    force = float(forces.max())
    timed = all(step.hold_times is not None and step.time is not None for step in steps)
    begin, holds, photo, number = [], [], [], 0.0
    for step in steps:
        samples = number + np.arange(len(step.samples), dtype=float)
        number += samples.size
        times = step.hold_times if timed and step.hold_times is not None else samples
        begin.append(float(times[0]))
        holds.append(times - times[0])
        photo.append(float(np.mean(times) if not timed or step.time is None else step.time) - begin[-1])
    displacement, scatter = _displacements(test)
    centre = [step.picture_centre or (0.5 * (step.chord or test.length), 0.5 * bow) for step in steps]
    return Facts(
        branch=tuple(step.branch for step in steps),
        displacement=displacement,
        displacement_std=scatter,
        photo_time=np.array(photo),
        hold_times=tuple(holds),
        clock=np.array(begin) - begin[0],
        picture_centre=np.array(centre, dtype=float),
        half_diagonal=test.picture_half_diagonal or 0.75 * test.length,
        moving=test.moving,
        timed=timed,
        length=test.length,
        force_scale=force,
        moment_scale=force * bow,
        curvature_scale=bend or 1.0 / test.length,
        force_share=forces / (force or 1.0),
        rest_side=_rest_side(steps),
        chord_by_log=np.array([step.chord if step.chord_by_log else np.nan for step in steps], dtype=float),
    )


def _rest_side(steps: Sequence[MeasuredStep]) -> Branch:
    bows = [float(np.mean(step.shape.y)) for step in steps if step.branch == "mounted" and step.shape is not None]
    return ("up" if np.mean(bows) > 0.0 else "down") if bows else "natural"


def _range(kappa: Array) -> float:
    """Range of curvatures of a photo, 1/m, without the outermost 2 %: at the rim of what is seen they are uncertain."""
    low, high = np.quantile(kappa, [0.02, 0.98])
    return float(high - low)


UNLOGGED = 0.05
"""Share of the length: how far the displacement of a step that no log states may be from what its photo says."""

AT_REST = 4.0
"""Standard deviations: a mounted step that the log shows nearer to zero is at zero, and free of force."""


def _displacements(test: MeasuredTest) -> tuple[Array, Array]:
    """Displacements (n,) and their standard deviations (n,), m.

    Without a log it is the photos that say where the bearing stood: what a step then counts with is a mere start, and
    its chord decides.
    """
    found = []
    for step in test.steps:
        std = step.displacement_std or 0.0
        if step.displacement is None:
            found.append((_by_chord(test, step), UNLOGGED * test.length))
        elif step.branch == "mounted" and abs(step.displacement) <= AT_REST * std:
            found.append((0.0, 0.0))
        else:
            found.append((step.displacement, std))
    value, std = np.array(found).T
    return value, std


def _by_chord(test: MeasuredTest, step: MeasuredStep) -> float:
    """Displacement of a step by its chord, m: from the force-free cable's, or else from the length."""
    rest = [other.chord for other in test.steps if other.branch == "mounted" and other.chord is not None]
    if step.chord is None:
        if step.branch == "mounted":
            return 0.0
        raise ValueError(f"step {step.step} has neither a displacement nor a photographed chord")
    return (float(np.mean(rest)) if rest else test.length) - step.chord


@dataclass(frozen=True, eq=False)
class Prediction:
    """What would be read at every step; ``n`` steps, ``v`` points along the cable.

    Variations of one prediction are one too, with a leading axis in every array: observers let it through.

    Attributes
    ----------
    force : (n,) N
        At the time of the photo, as the load cell shows it.
    samples : tuple of (h,) N
        The hold's samples as the load cell shows them.
    chord : (n,) m
        As the camera sees it.
    s : (v,) m
        Arc length of the points.
    x, y, theta : (n, v) m, rad
        Shapes in the chord frame, as the camera sees them.
    at_once : (n,) N or None
        ``force`` before anything of it relaxed: what relaxes at several rates does so side by side. None where nothing
        does.
    """

    force: Array
    samples: tuple[Array, ...]
    chord: Array
    s: Array
    x: Array
    y: Array
    theta: Array
    at_once: Array | None = None

    @classmethod
    def varied(cls, each: Sequence[Prediction]) -> Prediction:
        """Predictions as the variations of one."""
        names = ("force", "chord", "s", "x", "y", "theta")
        holds = zip(*(one.samples for one in each), strict=True)
        return cls(
            samples=tuple(np.stack(hold) for hold in holds),
            **{name: np.stack([getattr(one, name) for one in each]) for name in names},
        )


Observer = Callable[[Prediction, Facts], Prediction]


@dataclass(frozen=True, eq=False)
class Model:
    """The experiment as simulated, and how it is observed; observers act in order.

    ``shift`` (n,) m is added to the displacements of the log, step by step.
    """

    bending: BendingTest
    observers: tuple[Observer, ...] = ()
    shift: Array | float = 0.0

    def observed(self, observer: Observer) -> Model:
        """Same experiment, one more observer at the end of the chain."""
        return replace(self, observers=(*self.observers, observer))


def end_for_end(model: Model) -> Model:
    """The model with its cable turned end for end: what belongs to rig, load cell and camera stays."""
    section = model.bending.rod.section
    profile = None if section.profile is None else section.profile[::-1].copy()
    bending = replace(model.bending, pre_curvature=section.pre_curvature[::-1].copy(), stiffness_profile=profile)
    return replace(model, bending=bending)

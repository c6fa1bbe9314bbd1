"""One evaluation of the inverse problem: simulate all steps, hold them against the data, with exact derivatives.

Residuals, each divided by its standard deviation: distance of the midline from the simulated shape along the normal
(whitened, `rod.midline`), force measured minus simulated, and the prior of each nuisance. What is known of
the form of the law (`rod.law_prior`) comes in with the fit.

The chord of a photo is imposed on the simulation as measured, the errors of the axes taken back:
``chord = measured (1 + scale) + left_along - right_along``. Steps without a photo are imposed by the displacement log,
``chord = zero - displacement``. A force-free (mounted) photo is held against the arc of curvature K0, and its chord
against that of the arc; its force says something about the load cell, nothing about the cable, and is left out.

Signs and units: `rod.measurement`; SI.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rod.bending_test import simulate
from rod.equilibrium import Equilibrium, Outcome
from rod.inverse.fit_model import POSE, FitModel, StepData
from rod.inverse.photo_residual import Pose, Simulated, distance
from rod.sensitivity import derivatives

Array = NDArray[np.float64]

PARAMETERS = ("ordinates", "pre_curvature", "length", "chord")
"""Of the simulated rod, in the order of the derivatives of `Simulated`."""

LOG_RANGE = 60.0
"""Of log c over its unit: what lies beyond, 26 orders of magnitude either way, is a fit on its way to nowhere."""

CHORD_OF_ARC = 1e-2
"""How sharply the chord of a force-free photo is that of the arc, in standard deviations of an axis: almost exactly."""


@dataclass(frozen=True)
class StepFit:
    """One step of an evaluation, in units.

    Attributes
    ----------
    data : StepData
    simulated : Simulated
        With derivatives by `PARAMETERS`.
    chord : m
        Imposed; at rest that of the arc.
    photo : ((b,), (b, q), (b,)) or None
        Distance of the midline along the normal (m), its derivative by all unknowns, and the feet's arc length (m).
    force : (N, (q,)) or None
        Measured minus simulated, with derivative; None at rest.
    gap : (m, (q,)) or None
        At rest: measured chord, errors of the axes taken back, minus that of the arc.
    """

    data: StepData
    simulated: Simulated
    chord: float
    photo: tuple[Array, Array, Array] | None
    force: tuple[float, Array] | None
    gap: tuple[float, Array] | None


@dataclass(frozen=True)
class Evaluation:
    """Whitened residuals of all data and priors.

    Attributes
    ----------
    unknowns : (q,)
    value : (r,)
        Infinite if an equilibrium does not exist.
    jacobian : (r, q)
    blocks : dict of name -> slice
        ``shape/<step>``, ``force/<step>``, ``chord/<step>``, ``prior``.
    steps : tuple of StepFit
    equilibria : tuple of Equilibrium
        Of the loaded steps; warm starts for a neighbour.
    failure : Outcome or None
        Of the first equilibrium that does not exist.
    """

    unknowns: Array
    value: Array
    jacobian: Array
    blocks: dict[str, slice]
    steps: tuple[StepFit, ...] = ()
    equilibria: tuple[Equilibrium, ...] = ()
    failure: Outcome | None = None

    def chi2(self, kind: str) -> tuple[float, int]:
        """Sum of squares and number of the residuals of all blocks of a kind: ``shape``, ``force``, ``prior``, ..."""
        rows = [block for name, block in self.blocks.items() if name.partition("/")[0] == kind]
        values = [self.value[block] for block in rows]
        return sum(float(v @ v) for v in values), sum(v.size for v in values)


def evaluate(model: FitModel, u: Array, *, starts: tuple[Equilibrium, ...] = ()) -> Evaluation:
    """Residuals and jacobian at the unknowns `u`; `starts` are the equilibria of a neighbour."""
    if np.any(np.abs(u[: model.basis.size]) > LOG_RANGE):
        return Evaluation(u, np.full(1, np.inf), np.zeros((1, model.size)), {}, failure=Outcome.LIMIT_POINT)
    imposed = [imposed_chord(model, u, d) for d in model.data]
    bent = [k for k, d in enumerate(model.data) if not d.at_rest]
    shapes = {k: free_cable(model, u) for k, d in enumerate(model.data) if d.at_rest}
    equilibria: tuple[Equilibrium, ...] = ()
    if bent:
        test = model.bending_test(u)
        equilibria = simulate(
            test, chords=[imposed[k][0] for k in bent], branch="up", starts=starts or None, patient=not starts
        )
        failure = next((e.outcome for e in equilibria if not e.good), None)
        if failure is not None:
            return Evaluation(u, np.full(1, np.inf), np.zeros((1, model.size)), {}, failure=failure)
        slopes = derivatives(test, equilibria, PARAMETERS)
        for k, e, slope in zip(bent, equilibria, slopes, strict=True):
            shapes[k] = Simulated(e.s, e.x, e.y, e.theta, e.kappa, e.force, slope.x, slope.y, slope.theta, slope.force)
    fits = tuple(_step_fit(model, u, d, shapes[k], imposed[k]) for k, d in enumerate(model.data))
    return _whitened(model, u, fits, equilibria)


def imposed_chord(model: FitModel, u: Array, data: StepData) -> tuple[float, Array]:
    """Chord imposed on a step, m, and its derivative by all unknowns (q,)."""
    by = np.zeros(model.size)
    if data.chord is not None:
        by[model.index("scale")] = data.chord * model.nuisances["scale"]
        chord = data.chord * (1.0 + model.nuisance(u, "scale"))
        for part, sign in (("left_along", 1.0), ("right_along", -1.0)):
            for name, c in model.pose_terms(part, data):
                by[model.index(name)] += sign * c * model.nuisances[name]
                chord += sign * c * model.nuisance(u, name)
        return chord, by
    moved = data.step.displacement or 0.0
    if (own := f"moved/{data.step.step}") in model.nuisances:
        by[model.index(own)] = -model.nuisances[own]
        moved += model.nuisance(u, own)
    if model.zero is None:
        arc = free_cable(model, u)
        return float(arc.x[-1]) - moved, by + arc.x_by[-1] @ _chain(model, u, np.zeros(model.size))
    by[model.index("zero")] = model.nuisances["zero"]
    return model.zero + model.nuisance(u, "zero") - moved, by


def _chain(model: FitModel, u: Array, chord_by: Array) -> Array:
    """Derivatives of coefficients, K0, length and chord by all unknowns, (k + 3, q)."""
    k = model.basis.size
    chain = np.zeros((k + 3, model.size))
    chain[np.arange(k), np.arange(k)] = 1.0
    chain[k, k] = 1.0 / model.length
    chain[k + 1, model.index("length")] = model.nuisances["length"]
    chain[k + 2] = chord_by
    return chain


def free_cable(model: FitModel, u: Array) -> Simulated:
    """The force-free cable: an arc of curvature K0 on its chord, with derivatives by all unknowns."""
    K0, length = model.pre_curvature(u), model.cable_length(u)
    s = np.linspace(0.0, length, model.elements + 1)
    a, b = 0.5 * K0 * (length - s), 0.5 * K0 * s
    sinc = np.sinc(b / np.pi)
    # Below 1e-3 the closed form of d(sin b / b)/db loses digits to its series -b/3.
    slope = np.where(np.abs(b) < 1e-3, -b / 3.0, (np.cos(b) - sinc) / np.where(np.abs(b) < 1e-3, 1.0, b))
    x, y = s * np.cos(a) * sinc, s * np.sin(a) * sinc
    x_K0 = 0.5 * s * (-np.sin(a) * (length - s) * sinc + np.cos(a) * slope * s)
    y_K0 = 0.5 * s * (np.cos(a) * (length - s) * sinc + np.sin(a) * slope * s)
    # By the length with s / length held, as for every other shape; the chord of an arc is not imposed.
    theta, stretch, none = a - b, s / length, np.zeros_like(s)

    def by(pre_curvature: Array, cable_length: Array) -> Array:
        return np.column_stack([np.zeros((s.size, model.basis.size)), pre_curvature, cable_length, none])

    return Simulated(
        s,
        x,
        y,
        theta,
        np.full_like(s, K0),
        0.0,
        by(x_K0, stretch * np.cos(theta) - 0.5 * K0 * s * np.sin(a) * sinc),
        by(y_K0, stretch * np.sin(theta) + 0.5 * K0 * s * np.cos(a) * sinc),
        by(0.5 * length - s, K0 * (0.5 - stretch)),
        np.zeros(model.basis.size + 3),
    )


def _step_fit(model: FitModel, u: Array, data: StepData, shape: Simulated, imposed: tuple[float, Array]) -> StepFit:
    chord, chord_by = imposed
    chain = _chain(model, u, chord_by)
    gap = (chord - float(shape.x[-1]), chord_by - shape.x_by[-1] @ chain) if data.at_rest else None
    force = None if data.at_rest else (data.step.force - shape.force, -shape.force_by @ chain)
    photo = None
    if data.midline is not None:
        pose = Pose(*model.pose(u, data), model.nuisance(u, "scale"))
        found = distance(data.midline, shape, pose, chord)
        by = found.by_model @ chain
        terms = (*(model.pose_terms(part, data) for part in POSE), (("scale", 1.0),))
        for moved_by, column in zip(terms, found.by_pose.T, strict=True):
            for name, c in moved_by:
                by[:, model.index(name)] += c * column * model.nuisances[name]
        photo = (found.value, by, found.s)
    return StepFit(data, shape, chord, photo, force, gap)


def _whitened(model: FitModel, u: Array, fits: tuple[StepFit, ...], equilibria: tuple[Equilibrium, ...]) -> Evaluation:
    values: list[Array] = []
    rows: list[Array] = []
    blocks: dict[str, slice] = {}

    def add(name: str, value: Array, jacobian: Array) -> None:
        first = sum(v.size for v in values)
        blocks[name] = slice(first, first + value.size)
        values.append(value)
        rows.append(jacobian)

    for fit in fits:
        step = fit.data.step
        if fit.photo is not None and fit.data.midline is not None:
            white = fit.data.midline.whitener / model.blur[0]
            add(f"shape/{step.step}", white @ fit.photo[0], white @ fit.photo[1])
        if fit.force is not None:
            std = step.force_std * model.blur[1]
            add(f"force/{step.step}", np.array([fit.force[0]]) / std, fit.force[1][None] / std)
        if fit.gap is not None:
            std = CHORD_OF_ARC * fit.data.axis_std * model.blur[0]
            add(f"chord/{step.step}", np.array([fit.gap[0]]) / std, fit.gap[1][None] / std)
    prior = np.zeros((len(model.nuisances), model.size))
    prior[:, model.laws :] = np.eye(len(model.nuisances))
    add("prior", u[model.laws :], prior)
    return Evaluation(u, np.concatenate(values), np.vstack(rows), blocks, fits, equilibria)

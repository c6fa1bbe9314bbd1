"""Way one, the inverse problem: from photos and forces to the characteristic by simulating the experiment (Sec. 4).

The discrete rod is fitted to the positions of the midlines and to the forces of all steps at once, each residual
divided by its standard deviation (Eq. (7) with statistical weights in place of w; the paper's own objective is in
`rod.paper_fit`). Unknowns and data: `rod.inverse.fit_model`; residuals and exact jacobian: `rod.inverse.evaluation`;
the law and what is known of its form: `rod.compliance_law`, `rod.law_prior`; the method: `rod.inverse.fit`.

Strategy: (1) a rough regression of K on P y gives a law and K0; (2) fits from there and, where K0 may have a
second valley, from both sides of it; the best by its evidence; (3) where the simulation cannot follow the data within
their noise, the misfit counts as noise; (4) bands by propagation, on the visited range only.

Signs and axes: chord frame of `rod.measurement`; P positive in compression, K positive toward the bow; f_EI is the
tangent reading dm/dK; SI units.

Source: *Identification of Nonlinear Elastic Bending Behavior for Cable Simulation*, Sec. 4, Eqs. (6), (7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rod.compliance_law import ComplianceLaw, moment_basis
from rod.equilibrium import Outcome
from rod.inverse.estimate import Estimate, InverseOutcome, read_off
from rod.inverse.evaluation import Evaluation, evaluate, imposed_chord
from rod.inverse.fit import Fit, fit
from rod.inverse.fit_model import FitModel, StepData, fit_model, step_data
from rod.law_prior import averaged, priors
from rod.measurement import MeasuredTest

__all__ = ["Estimate", "InverseOptions", "InverseOutcome", "estimate"]

Array = NDArray[np.float64]

OPPOSITE = -0.5
"""Correlation of curvature and moment below which forces contradict photos; noise brings it to zero, not below."""

REACHING = 10
"""Chords shortened one after the other at most; they share their nuisances, so one or two bring all within reach."""

REACH = 4.0
"""Standard deviations of what is stated by which chords may be shortened; a length that is wrong asks for more."""

SIDE = 0.15
"""Of the range of curvature: how far to both sides of K0 a second valley is looked for."""

ROUGH, INDEPENDENT, REGRESSIONS = 0.02, 30.0, 12
"""Of the regression that a fit starts from: curvatures are off by that share of their range, so many of them on their
own, and so many iterations, which need not settle."""

FITS = 1.14
"""Root mean square of the whitened residuals of photos up to which a fit needs no other start: with hundreds of data
noise alone stays below it."""


@dataclass(frozen=True)
class InverseOptions:
    """Numbers of the inverse problem, each with its reason.

    Attributes
    ----------
    elements : int
        Of the simulated rod: its error at 100 is 1e-4 of the force, a thirtieth of a load cell's.
    blocks : int
        Independent data of one photo at most, see `rod.midline`.
    grid : int
        Points of the reported curve.
    """

    elements: int = 100
    blocks: int = 160
    grid: int = 61


def estimate(
    test: MeasuredTest, *, start: tuple[float, float] | None = None, options: InverseOptions | None = None
) -> Estimate:
    """Characteristic, pre-curvature and their uncertainty by fitting the simulated experiment.

    Parameters
    ----------
    test : MeasuredTest
    start : (N m^2, 1/m) or None
        Constant EI and K0 to start from; None takes both from a regression of curvature on moment.
    options : InverseOptions or None
        None means the defaults.

    Returns
    -------
    Estimate
        Look at ``outcome``.
    """
    options = options or InverseOptions()
    data = step_data(test, blocks=options.blocks)
    if not any(d.midline is not None and not d.at_rest and d.step.force != 0.0 for d in data):
        return Estimate(InverseOutcome.NO_DATA)
    moments, curvatures = moments_and_curvatures(data)
    if np.corrcoef(moments, curvatures)[0, 1] < OPPOSITE:
        return Estimate(InverseOutcome.OPPOSITE_FORCES)
    straight = straight_line(moments, curvatures) if start is None else start
    basis = moment_basis(float(moments.min()), float(moments.max()), unit=1.0 / straight[0])
    model = fit_model(test, data, basis, elements=options.elements)
    line = basis.law(np.zeros(basis.size)), straight[1]
    used = 0
    for law, K0 in ([regressed(*line, moments, curvatures)] if start is None else []) + [line]:
        best = _from(model, law, K0)
        used += best.evaluations
        if best.posterior is not None:
            break
    if best.posterior is None or not any(d.at_rest for d in data) or best.model.blur[0] * best.misfit[0] > FITS:
        if best.posterior is not None:
            law, K0 = best.model.law(best.evaluation.unknowns), best.model.pre_curvature(best.evaluation.unknowns)
        apart = SIDE * float(np.ptp(curvatures))
        for begin in (K0 - apart, K0 + apart):
            found = _from(model, law, begin)
            used += found.evaluations
            if found.log_evidence > best.log_evidence:
                best = found
    if best.posterior is None:
        limit = best.evaluation.failure is Outcome.LIMIT_POINT
        return Estimate(InverseOutcome.LIMIT_POINT if limit else InverseOutcome.NO_EQUILIBRIUM, iterations=used)
    result = read_off(
        best.model,
        best.evaluation,
        best.posterior,
        grid=options.grid,
        outcome=InverseOutcome.CONVERGED if best.settled else InverseOutcome.STALLED,
    )
    if result.converged and result.invisible:
        result = replace(result, outcome=InverseOutcome.NOT_VISIBLE)
    return replace(result, iterations=used)


def _from(model: FitModel, law: ComplianceLaw, K0: float) -> Fit:
    """Fit from a law and K0 (1/m)."""
    model = replace(model, basis=law.basis)
    u = model.start(law, K0)
    trial = evaluate(model, u)
    if trial.failure is Outcome.UNREACHABLE:
        u = within_reach(model, u)
        trial = evaluate(model, u)
    if trial.failure is None:
        u = rescaled(model, trial)
    return fit(model, u)


def moments_and_curvatures(data: tuple[StepData, ...]) -> tuple[Array, Array]:
    """P y (N m) and curvature (1/m) wherever a photo shows the cable: for a rough start only."""
    moments, curvatures = [], []
    for d in data:
        shape = d.step.shape
        if d.midline is not None and shape is not None:
            moments.append(np.zeros(int(shape.seen.sum())) if d.at_rest else d.step.force * shape.y[shape.seen])
            curvatures.append(shape.kappa[shape.seen])
    return np.concatenate(moments), np.concatenate(curvatures)


def straight_line(m: Array, K: Array) -> tuple[float, float]:
    """Constant EI (N m^2) and K0 (1/m) by a straight line of curvature over moment."""
    slope, K0 = (float(v) for v in np.polyfit(m, K, 1))
    # Noise alone may turn the slope around; its size is still a start.
    return 1.0 / max(abs(slope), ROUGH * float(np.ptp(K) / np.ptp(m))), K0


def regressed(law: ComplianceLaw, K0: float, m: Array, K: Array) -> tuple[ComplianceLaw, float]:
    """Law and K0 (1/m) by a rough regression of curvature on moment from a straight line, all points of all photos.

    The line would do for most cables. One that loses its stiffness early is bent along half of its length at nearly one
    moment: a line through that lies far from its K0.
    """
    basis = law.basis
    u = np.concatenate([law.coefficients, [K0]])
    std = ROUGH * float(np.ptp(K)) * np.sqrt(K.size / INDEPENDENT)
    for _ in range(REGRESSIONS):
        law = basis.law(u[:-1])
        J = np.column_stack([law.bend_by_coefficients(m), np.ones(m.size)]) / std
        move = averaged((law.bend(m) + u[-1] - K) / std, J, u, priors(basis, smooth=False)).mean - u
        u = u + move * min(1.0, 1.0 / max(float(np.abs(move[:-1]).max()), 1e-300))
    return basis.law(u[:-1]), float(u[-1])


def within_reach(model: FitModel, u: Array) -> Array:
    """Unknowns (q,) whose nuisances bring every imposed chord down to that of the force-free cable.

    Covers that are seen too far apart, or a scale a little off, make chords of hardly bent cables longer than the cable
    itself: those before the first bend and, unloaded again, after the last. What is doubted most is moved most: the
    change is the smallest in units of the priors that will do. Where that is beyond all doubt the unknowns are returned
    as they are.
    """
    given, u = u, u.copy()
    natural = model.bending_test(u).zero_chord
    for _ in range(REACHING):
        chord, by = max((imposed_chord(model, u, d) for d in model.data if not d.at_rest), key=lambda one: one[0])
        by = by[model.laws :]
        if chord <= natural or not by.any():
            break
        u[model.laws :] -= by * (chord - natural) / (by @ by)
    return u if np.linalg.norm(u[model.laws :]) < REACH else given


def rescaled(model: FitModel, trial: Evaluation) -> Array:
    """Unknowns (p,), stiffness scaled to the forces: f -> c f leaves the shapes and multiplies the forces by c."""
    pairs = [(s.data.step.force, s.simulated.force, s.data.step.force_std) for s in trial.steps if s.force is not None]
    measured, simulated, std = np.array(pairs).T
    c = float(np.sum(measured * simulated / std**2) / np.sum((simulated / std) ** 2))
    u = trial.unknowns.copy()
    if c > 0.0:
        u[: model.basis.size] -= np.log(c)
    return u

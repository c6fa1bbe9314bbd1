"""Way one, the inverse problem: from photos and forces to the characteristic by simulating the experiment (Sec. 4).

The discrete rod is fitted to the positions of the midlines and to the forces of all steps at once, each residual
divided by its standard deviation (Eq. (7) with statistical weights in place of w; the paper's own objective is in
`rod.paper_fit`). Unknowns and data: `rod.inverse.fit_model`; residuals and exact jacobian: `rod.inverse.evaluation`;
scipy's trust-region reflective method.

Strategy: (1) a fit with three control points from a straight line of K over P y; (2) a fit with many control points
over the range that the cable visits, whose linearisation gives the evidence of every smaller number; (3) a fit with the
chosen number, the smoothness of log f averaged over with its evidence as the weight, so the band holds the error of the
spline itself; (4) bands by propagation, on the visited range only.

Signs and axes: chord frame of `rod.measurement`; P positive in compression, K positive toward the bow; f_EI is the
tangent reading dm/dK; SI units.

Source: *Identification of Nonlinear Elastic Bending Behavior for Cable Simulation*, Sec. 4, Eqs. (6), (7).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rod.equilibrium import Outcome
from rod.inverse.control_points import FIRST_BLUR, START_PRECISION, Fit, chosen_knots, fit
from rod.inverse.estimate import Estimate, InverseOutcome, read_off
from rod.inverse.evaluation import Evaluation, evaluate, imposed_chord
from rod.inverse.fit_model import FitModel, StepData, fit_model, step_data
from rod.inverse.knots import place_knots
from rod.inverse.options import InverseOptions
from rod.measurement import MeasuredTest

__all__ = ["Estimate", "InverseOptions", "InverseOutcome", "estimate"]

Array = NDArray[np.float64]

OPPOSITE = -0.5
"""Correlation of curvature and moment below which forces contradict photos; noise brings it to zero, not below."""

REACHING = 10
"""Chords shortened one after the other at most; they share their nuisances, so one or two bring all within reach."""

REACH = 4.0
"""Standard deviations of what is stated by which chords may be shortened; a length that is wrong asks for more."""


def estimate(
    test: MeasuredTest, *, start: tuple[float, float] | None = None, options: InverseOptions | None = None
) -> Estimate:
    """Characteristic, pre-curvature and their uncertainty by fitting the simulated experiment.

    Parameters
    ----------
    test : MeasuredTest
    start : (N m^2, 1/m) or None
        Constant EI and K0 to start from; None takes both from a straight line of curvature over moment.
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
    line = straight_line(moments, curvatures)
    fits: list[Fit] = []
    for begin in [line if start is None else start, *_further_starts(line, test.length)]:
        fits.append(first_fit(test, data, begin, line, options))
        if fits[-1].settled and fits[-1].chi2 < fits[-1].evaluation.value.size:
            break  # residuals of the size of the blurred noise: no other optimum can be much better
    best = min(fits, key=lambda f: f.chi2)
    if best.evaluation.failure is not None:
        return Estimate(_refusal(best.evaluation.failure), iterations=sum(f.evaluations for f in fits))
    chosen, evidence, evaluations = chosen_knots(best, options)
    result = read_off(
        chosen.model,
        chosen.evaluation,
        chosen.posterior(options.tau),
        options=options,
        outcome=InverseOutcome.CONVERGED if chosen.settled else InverseOutcome.STALLED,
    )
    if result.converged and result.invisible:
        result = replace(result, outcome=InverseOutcome.NOT_VISIBLE)
    return replace(result, evidence=evidence, iterations=evaluations + sum(f.evaluations for f in fits))


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
    slope, K0 = np.polyfit(m / np.abs(m).max(), K, 1)
    # Noise alone may turn the slope around; its size is still a start.
    return float(np.abs(m).max() / max(abs(slope), 1e-3 * np.ptp(K))), float(K0)


def _further_starts(line: tuple[float, float], length: float) -> list[tuple[float, float]]:
    """Starts for data on which the first one fails: the straight line, and K0 to both sides of it."""
    EI, K0 = line
    return [line, *((EI, K0 + turn / length) for turn in (-0.4, 0.4))]


def first_fit(
    test: MeasuredTest,
    data: tuple[StepData, ...],
    begin: tuple[float, float],
    line: tuple[float, float],
    options: InverseOptions,
) -> Fit:
    """Three control points over the measured range of curvature, from a constant EI and K0."""
    EI, K0 = begin
    seen = np.concatenate([d.step.shape.kappa[d.step.shape.seen] for d in data if d.step.shape is not None])
    low, high = line[1], float(np.quantile(seen, 0.995))
    knots = place_knots(min(low, high - 0.2 * abs(high)), high, 3)
    model = replace(fit_model(test, data, knots, elements=options.elements, unit=line[0]), blur=FIRST_BLUR)
    u = model.start(np.full(3, EI), K0)
    trial = evaluate(model, u)
    if trial.failure is Outcome.UNREACHABLE:
        u = within_reach(model, u)
        trial = evaluate(model, u)
    if trial.failure is None:
        u = rescaled(model, trial)
    return fit(model, u, starts=trial.equilibria, evaluations=options.evaluations, precision=START_PRECISION)


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
        u[: model.knots.size] += np.log(c)
    return u


def _refusal(failure: Outcome) -> InverseOutcome:
    return InverseOutcome.LIMIT_POINT if failure is Outcome.LIMIT_POINT else InverseOutcome.NO_EQUILIBRIUM

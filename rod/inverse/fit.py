"""Fit of a model to an observation: Gauss-Newton on whitened residuals, damped where whole steps lead nowhere.

What is fitted is an `extension.Extension`, the base model with or without causes added; rows and columns of the linear
problem are those of `sensitivities`. One iteration takes the first of these that lowers chi-square: the whole
step, a part of it, steps of rising damping (Levenberg, Marquardt). It ends when the linear model promises nothing more,
when a step brought nothing, when damped steps hardly bring anything, or when what is left could not save a model that
lies too far behind.

Nothing here raises for a model without equilibrium: the step is shortened, and a fit that cannot start says so in
``Fit.advice``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rod.array import Array
from rod.inverse.extension import Extension
from rod.inverse.observation import DISPLACEMENT_STD, Observation
from rod.inverse.prediction import Model
from rod.inverse.sensitivities import sensitivities, whole_residual
from rod.inverse.simulation import Run, run
from rod.inverse.step import Linearised, lasting, reach

ITERATIONS, TOLERANCE = 15, 1e-3
"""Gauss-Newton steps at most, where three to five are usual; change of chi-square at which a fit is done."""

FITS = 1.4
"""Reduced chi-square up to which a model explains the data: above it other starts and forms are tried."""

KINKS = 1.0
"""Chi-square, less than a sigma, times the reduced one where that is above 1. Where damped steps would not bring so
much in all the steps left, none follows. What the linear model promises still is due to kinks (slip, set), which it
does not see; where it promises more than that, the fit has stalled."""

PROMISED = 4.0
"""Of what the linear model promises: as much as a fit is trusted to gain in all. Of 590 fits in nine trials one that
came near what another had reached gained more, 6.5 times (forces without a name, of no weight); of causes friction
gained most, 2.8 times."""

PART = 0.4
"""Share of a step that leads too far; where amount and stiffness act as a product, halves of a step did."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted model.

    Attributes
    ----------
    extension : Extension
    vector : (p,)
    run : Run
    residual : (N,)
        Whitened, prior rows last.
    jacobian : (N, p)
        Sensitivities of the model: ``d residual = - jacobian d vector``; prior rows ``1 / std``.
    converged : bool
    """

    extension: Extension
    vector: Array
    run: Run
    residual: Array
    jacobian: Array
    converged: bool

    @property
    def chi2(self) -> float:
        """Sum of squares, priors included."""
        return float(self.residual @ self.residual)

    @property
    def reduced_chi2(self) -> float:
        """Chi-square per degree of freedom; 1 is noise."""
        return self.chi2 / max(len(self.residual) - self.extension.size, 1)

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the parameters; invisible combinations get a huge variance, not an infinite one."""
        size = np.linalg.norm(self.jacobian, axis=0)
        size = np.where(size > 0.0, size, 1.0)
        _, weight, right = np.linalg.svd(self.jacobian / size, full_matrices=False)
        root = right.T / np.maximum(weight, 1e-8 * weight[0])
        return np.asarray((root @ root.T) / np.outer(size, size))

    @property
    def beyond_log(self) -> NDArray[np.int_]:
        """Positions in the vector of errors of displacements that are as good as exact by the log."""
        return self.extension.base.beyond_log(self.extension.facts, DISPLACEMENT_STD)

    @property
    def as_logged(self) -> tuple[Array, Array]:
        """Residual (N,) and sensitivities (N, q), to first order, with displacements and rig as exact as stated."""
        at = self.beyond_stated
        return self.residual + self.jacobian[:, at] @ self.vector[at], np.delete(self.jacobian, at, axis=1)

    @property
    def beyond_stated(self) -> NDArray[np.int_]:
        """Positions in the vector of errors that no statement of the data holds: of displacements, and of the rig."""
        return np.concatenate([self.beyond_log, self.extension.base.rig_at])

    @property
    def excess(self) -> Array:
        """Curvatures (n,) of all steps beyond what each place of the cable has at rest, 1/m; its outermost ends apart.

        For what a set adds to the rest see `rod.section`: it is not taken off.
        """
        rod = self.run.model.bending.rod
        K0, first = rod.section.pre_curvature, 1 - rod.shown.start
        return np.concatenate([(step.kappa[first : first + K0.size] - K0)[2:-2] for step in self.run.steps])

    @property
    def pre_curvature(self) -> float:
        """K0, 1/m."""
        return self.extension.base.pre_curvature(self.vector)

    def amount(self, term: int) -> tuple[float, float]:
        """Amount of a term and its standard deviation."""
        at = self.extension.amounts_at[term]
        return float(self.vector[at]), float(np.sqrt(self.covariance[at, at]))


def fit(
    observation: Observation,
    extension: Extension,
    start: Array | State | Fit,
    *,
    iterations: int = ITERATIONS,
    tolerance: float = TOLERANCE,
    near: Run | None = None,
    cutoff: float = 1e-7,
    kept: NDArray[np.bool_] | None = None,
    hopeless: float = np.inf,
) -> Fit:
    """Gauss-Newton with shortened steps from ``start``.

    Parameters
    ----------
    observation : Observation
    extension : Extension
    start : (p,), State or Fit
        Where to begin: a vector, or what is known already of this model and this observation at one.
    iterations : int
        At most.
    tolerance : float
        Fall of chi-square, over the reduced chi-square where that is above 1, at which the fit is done.
    near : Run or None
        Run of a similar model, for warm starts.
    cutoff : float
        Combinations of parameters that show less than this share of the clearest one stay where they are.
    kept : (N,) bool or None
        Rows the model is fitted to; all of them are predicted.
    hopeless : float
        Chi-square above which the fit is of no use: it ends where neither several times what the linear model
        promises nor the steps left, each as good as the better of the last two, would get there; as converged if
        whole steps are taken and the linear model promises no more.

    Returns
    -------
    Fit
        ``converged`` is False if the iterations ran out or the start has no equilibrium.
    """
    if isinstance(start, Fit):
        begin, state = start, State(start.vector, extension.base_model(start.vector), start.run, start.residual)
    else:
        state = start if isinstance(start, State) else shown(observation, extension, np.asarray(start, float), near)
        begin = evaluated(observation, extension, state)
        if state.run.prediction is None:
            return begin
    jacobian = begin.jacobian
    rows = np.ones(len(state.residual), dtype=bool) if kept is None else kept
    converged, damping, falls = False, 0.0, [np.inf, np.inf]
    for left in range(iterations, 0, -1):
        cost = state.cost(rows)
        bounds = lasting(extension, state.vector)
        linear = Linearised(jacobian[rows], state.residual[rows], cutoff, bounds, reach(extension))
        left_over = max(cost / max(int(rows.sum()), 1), 1.0)  # a sigma of what a misfit leaves is no sigma of the noise
        if linear.expected_fall < tolerance * left_over:
            converged = True
            break
        if cost - min(PROMISED * linear.expected_fall, left * max(falls[-2:])) > hopeless:
            converged = damping == 0.0 and cost - linear.expected_fall > hopeless
            break
        lower = _lower(observation, extension, state, linear, damping, rows)
        if lower is None:
            converged = linear.expected_fall < KINKS * left_over
            break
        raised, (state, damping) = lower[1] > damping > 0.0, lower
        jacobian = sensitivities(observation, extension, state.vector, state.base_model, state.run)
        fall = cost - state.cost(rows)
        falls.append(fall)
        if fall < tolerance * left_over and damping == 0.0:
            converged = True
            break
        if damping > 0.0 and left * max(falls[-2:]) < KINKS * left_over:
            converged = linear.expected_fall < KINKS * left_over
            break
        if not raised:  # what was too little a step ago is not tried again at once
            damping = 0.1 * damping if damping > 1e-4 else 0.0
    return Fit(extension, state.vector, state.run, state.residual, jacobian, converged)


class State(NamedTuple):
    """A model at a vector (p,): without its terms, its run, and the residual (N,), of no length without equilibrium."""

    vector: Array
    base_model: Model
    run: Run
    residual: Array

    def cost(self, rows: NDArray[np.bool_] | None = None) -> float:
        """Sum of squares, of the named rows; infinite without equilibrium."""
        if self.run.prediction is None:
            return np.inf
        return float(np.sum((self.residual if rows is None else self.residual[rows]) ** 2))


def shown(
    observation: Observation, extension: Extension, vector: Array, near: Run | None, *, patient: bool = True
) -> State:
    """What a model shows at a vector (p,); for ``near`` and ``patient`` see `rod.inverse.simulation.run`."""
    base_model = extension.base_model(vector)
    here = run(extension.model(vector, of=base_model), extension.facts, near=near, patient=patient)
    value = whole_residual(observation, here.prediction, vector, extension.prior)
    return State(vector, base_model, here, np.zeros(0) if value is None else value)


def evaluated(observation: Observation, extension: Extension, at: State) -> Fit:
    """The model in a state, not fitted; without residual and Jacobian where it has no equilibrium there."""
    jacobian = np.zeros((0, extension.size))
    if at.run.prediction is not None:
        jacobian = sensitivities(observation, extension, at.vector, at.base_model, at.run)
    return Fit(extension, at.vector, at.run, at.residual, jacobian, False)


def _lower(
    observation: Observation,
    extension: Extension,
    state: State,
    linear: Linearised,
    damping: float,
    rows: NDArray[np.bool_],
) -> tuple[State, float] | None:
    """First state of lower chi-square, and the damping that led there; None where eight trials find none.

    A whole step first; then a part of it, which follows a curved valley where damping would creep along its wall; then
    steps of rising damping.
    """
    least = max(damping, 1e-5)
    for used, share in ((damping, 1.0), (least, PART), *((least * 10.0**k, 1.0) for k in range(1, 7))):
        trial = extension.brought_inside(state.vector + share * linear.step(used))
        if not extension.admissible(trial):
            continue
        there = shown(observation, extension, trial, state.run, patient=False)
        if there.cost(rows) < state.cost(rows):
            return there, used
    return None

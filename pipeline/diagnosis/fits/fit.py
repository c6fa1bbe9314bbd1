"""Fit of a model to an observation: Gauss-Newton on whitened residuals, with causes added to the base model or not.

``Extension`` is the base model with terms (a cause in one of its forms); its parameter vector is the base's, then for
each term its amount and whatever of the form is tuned along. Rows of the residual: the observation's, then one per
parameter with prior knowledge. Nothing here raises for a model without equilibrium: the step is shortened, and a fit
that cannot start says so in ``Fit.advice``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.cause import Cause, Variant
from pipeline.diagnosis.fits.base import Base
from pipeline.diagnosis.observations.observation import Observation, residual
from pipeline.diagnosis.observations.prediction import Facts, Model, Prediction, end_for_end
from pipeline.diagnosis.observations.simulation import Run, base_derivatives, moved, observed, run
from rod.characteristic import Characteristic
from rod.sensitivity import Derivatives

Array = NDArray[np.float64]


class Term(NamedTuple):
    """A cause in one of its forms."""

    cause: Cause
    variant: Variant


@dataclass(frozen=True, eq=False)
class Extension:
    """Base model and the terms added to it; ``turned``: with the cable turned end for end."""

    base: Base
    facts: Facts
    terms: tuple[Term, ...] = ()
    turned: bool = False

    @property
    def owners(self) -> tuple[int, ...]:
        """Position in the vector of each term's amount."""
        at, first = [], len(self.base.names)
        for term in self.terms:
            at.append(first)
            first += 1 + len(term.variant.tuned)
        return tuple(at)

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.base.names) + sum(1 + len(term.variant.tuned) for term in self.terms)

    @cached_property
    def prior(self) -> Array:
        """Rows (m, p) of prior knowledge, of unit variance."""
        rows = self.base.prior
        return np.hstack([rows, np.zeros((len(rows), self.size - rows.shape[1]))])

    @property
    def steps(self) -> Array:
        """Steps (p,) of difference quotients."""
        added: list[float] = []
        for term in self.terms:
            added.append(1e-3 * term.cause.plausible(self.facts))
            added.extend(1e-3 * term.variant.scale(name) for name in term.variant.tuned)
        return np.asarray(np.r_[self.base.steps(self.facts), added])

    def start(self, vector: Array, amounts: tuple[float, ...]) -> Array:
        """Vector of this extension from one of the base model and an amount for each term."""
        parts = [vector[: len(self.base.names)]]
        for term, amount in zip(self.terms, amounts, strict=True):
            parts.append(np.r_[amount, [getattr(term.variant, name) for name in term.variant.tuned]])
        return np.concatenate(parts)

    def base_model(self, vector: Array) -> Model:
        """The base model at a vector, without the terms."""
        return self.base.model(vector[: len(self.base.names)])

    def model(self, vector: Array, *, of: Model | None = None) -> Model:
        """The model at a vector; ``of`` is the base model there, where it is known already."""
        model = self.base_model(vector) if of is None else of
        for at, term in zip(self.owners, self.terms, strict=True):
            tuned = {name: float(vector[at + 1 + j]) for j, name in enumerate(term.variant.tuned)}
            model = term.cause.apply(model, float(vector[at]), term.variant.moved(tuned), self.facts)
        return end_for_end(model) if self.turned else model

    def admissible(self, vector: Array) -> bool:
        """Whether the vector describes a possible cable; signs of amounts are judged after the fit, not here."""
        if not self.base.admissible(vector[: len(self.base.names)]):
            return False
        for at, term in zip(self.owners, self.terms, strict=True):
            if term.cause.sign * vector[at] < 0.0:
                return False
            for j, name in enumerate(term.variant.tuned):
                low, high = term.variant.range(name)
                if not low <= vector[at + 1 + j] <= high:
                    return False
        return True


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
    advice : str
        Why there is no fit, or what stopped it.
    """

    extension: Extension
    vector: Array
    run: Run
    residual: Array
    jacobian: Array
    converged: bool
    advice: str = ""

    @property
    def chi2(self) -> float:
        """Sum of squares, priors included."""
        return float(self.residual @ self.residual)

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the parameters; invisible combinations get a huge variance, not an infinite one."""
        size = np.linalg.norm(self.jacobian, axis=0)
        size = np.where(size > 0.0, size, 1.0)
        _, weight, right = np.linalg.svd(self.jacobian / size, full_matrices=False)
        root = right.T / np.maximum(weight, 1e-8 * weight[0])
        return np.asarray((root @ root.T) / np.outer(size, size))

    def amount(self, term: int) -> tuple[float, float]:
        """Amount of a term and its standard deviation."""
        at = self.extension.owners[term]
        return float(self.vector[at]), float(np.sqrt(self.covariance[at, at]))


def whole_residual(
    observation: Observation, prediction: Prediction | None, vector: Array, prior: Array
) -> Array | None:
    """Residual with the rows of prior knowledge at the end; None where the model has no equilibrium."""
    if prediction is None:
        return None
    return np.asarray(np.r_[residual(observation, prediction), -prior @ vector])


def sensitivities(observation: Observation, extension: Extension, vector: Array, base_model: Model, here: Run) -> Array:
    """Jacobian (N, p) of the model, prior rows included.

    Control points, K0 and length by the implicit function theorem, scale by the observers alone, amounts and forms of
    causes by difference quotients with warm starts; a quotient that runs into a model without equilibrium is taken to
    the other side.
    """
    prior = extension.prior
    at_here = whole_residual(observation, here.prediction, vector, prior)
    assert at_here is not None and here.bare is not None
    columns = _base_columns(observation, extension, vector, here, at_here)
    first = len(columns)
    for j, step in enumerate(extension.steps[first:], start=first):
        column = np.zeros_like(at_here)
        for signed in (step, -step):
            trial = vector.copy()
            trial[j] += signed
            if not extension.admissible(trial):
                continue
            there = run(extension.model(trial, of=base_model), extension.facts, near=here)
            value = whole_residual(observation, there.prediction, trial, prior)
            if value is not None:
                column = (at_here - value) / signed
                break
        columns.append(column)
    return np.column_stack(columns)


def _base_columns(
    observation: Observation, extension: Extension, vector: Array, here: Run, at_here: Array
) -> list[Array]:
    """Columns of the base parameters, in their order."""
    base, facts, model, bare = extension.base, extension.facts, here.model, here.bare
    assert bare is not None
    names = ("ordinates", *(() if base.straight else ("pre_curvature",)), "length")
    by = base_derivatives(here, facts, names)
    law = model.bending.characteristic
    # where a cause has put further control points into the law, a base ordinate moves them along the base spline
    share = base.law_directions(vector, law.knots if isinstance(law, Characteristic) else base.knots)
    count = share.shape[0]
    bent = [name for name in base.names if name not in base.observed]
    change = np.zeros((count + (0 if base.straight else 1) + 1, len(bent)))
    change[:count, : share.shape[1]] = share
    if (bend := base.pre_curvature_index) is not None:
        change[count, bend] = 1.0
    change[-1, -1] = -model.bending.length / (1.0 + vector[len(base.names) - 1])
    by = tuple(_combined(d, change) for d in by)
    columns = []
    prior, steps = extension.prior, extension.steps
    for j in range(len(base.names)):
        trial = vector.copy()
        trial[j] += steps[j]
        if base.names[j] in base.observed:
            shown = observed(bare, replace(model, observers=(base.observer(trial), *model.observers[1:])), facts)
        else:
            shown = observed(moved(bare, by, bent.index(base.names[j]), float(steps[j])), model, facts)
        value = whole_residual(observation, shown, trial, prior)
        assert value is not None
        columns.append((at_here - value) / steps[j])
    return columns


def _combined(d: Derivatives, change: Array) -> Derivatives:
    """Derivatives with respect to combinations (columns of ``change``) of the parameters."""
    return Derivatives(
        tuple(str(i) for i in range(change.shape[1])),
        *(getattr(d, name) @ change for name in ("s", "x", "y", "theta", "kappa", "moment", "force", "chord")),
    )


def fit(
    observation: Observation,
    extension: Extension,
    start: Array,
    *,
    iterations: int,
    tolerance: float,
    near: Run | None = None,
    cutoff: float = 1e-7,
    begin: Fit | None = None,
    kept: NDArray[np.bool_] | None = None,
    hopeless: float = np.inf,
) -> Fit:
    """Gauss-Newton with shortened steps from ``start``.

    Parameters
    ----------
    observation : Observation
    extension : Extension
    start : (p,)
    iterations : int
        At most.
    tolerance : float
        Fall of chi-square at which the fit is done.
    near : Run or None
        Run of a similar model, for warm starts.
    cutoff : float
        Combinations of parameters that show less than this share of the clearest one stay where they are.
    begin : Fit or None
        Fit of this model to this observation, to go on from: nothing is computed anew at its vector.
    kept : (N,) bool or None
        Rows the model is fitted to; all of them are predicted.
    hopeless : float
        Chi-square above which the fit is of no use: it ends where the steps left, each as good as the better of the
        last two, would not get there; as converged if whole steps are taken and the linear model promises no more.

    Returns
    -------
    Fit
        ``converged`` is False if the iterations ran out or the start has no equilibrium.
    """
    if begin is not None:
        state, jacobian = (
            _State(begin.vector, extension.base_model(begin.vector), begin.run, begin.residual),
            begin.jacobian,
        )
    else:
        vector = np.asarray(start, dtype=float)
        base_model = extension.base_model(vector)
        here = run(extension.model(vector, of=base_model), extension.facts, near=near)
        value = whole_residual(observation, here.prediction, vector, extension.prior)
        if value is None:
            empty = np.zeros((0, extension.size))
            return Fit(extension, vector, here, np.zeros(0), empty, False, here.advice)
        state = _State(vector, base_model, here, value)
        jacobian = sensitivities(observation, extension, vector, base_model, here)
    rows = np.ones(len(state.value), dtype=bool) if kept is None else kept
    converged, damping, crawled, falls = False, 0.0, 0, [np.inf, np.inf]
    for left in range(iterations, 0, -1):
        scaled = _Scaled(jacobian[rows], state.value[rows], cutoff)
        if scaled.expected < tolerance:
            converged = True
            break
        if state.cost(rows) - left * max(falls[-2:]) > hopeless:
            converged = damping == 0.0 and state.cost(rows) - scaled.expected > hopeless
            break
        accepted = _lower(observation, extension, state, scaled, damping, rows)
        if accepted is None:
            converged = scaled.expected < 1.0  # rounding of kinks (slip, set) below a sigma; more is a stall
            break
        before, (state, damping) = state.cost(rows), accepted
        jacobian = sensitivities(observation, extension, state.vector, state.base_model, state.here)
        falls.append(fall := before - state.cost(rows))
        if fall < tolerance and damping == 0.0:
            converged = True
            break
        crawled = crawled + 1 if damping > 0.0 and fall < CRAWL * before else 0
        if crawled == PATIENCE:
            break
        damping = 0.1 * damping if damping > 1e-4 else 0.0
    advice = "" if converged else "the fit did not settle"
    return Fit(extension, state.vector, state.here, state.value, jacobian, converged, advice)


CRAWL, PATIENCE = 2e-3, 4
"""Share of chi-square; so many damped steps in succession that lower it by less lead nowhere in reasonable time."""

PART = 0.4
"""Share of a step that leads too far; where amount and stiffness act as a product, halves of a step did."""


class _State(NamedTuple):
    """A vector with its base model, its run and its residual."""

    vector: Array
    base_model: Model
    here: Run
    value: Array

    def cost(self, rows: NDArray[np.bool_]) -> float:
        """Sum of squares of the named rows."""
        return float(np.sum(self.value[rows] ** 2))


def _lower(
    observation: Observation,
    extension: Extension,
    state: _State,
    scaled: _Scaled,
    damping: float,
    rows: NDArray[np.bool_],
) -> tuple[_State, float] | None:
    """First state of lower chi-square, and the damping that led there; None where eight trials find none.

    A whole step first; then a part of it, which follows a curved valley where damping would creep along its wall; then
    steps of rising damping.
    """
    least = max(damping, 1e-5)
    for used, share in ((damping, 1.0), (least, PART), *((least * 10.0**k, 1.0) for k in range(1, 7))):
        trial = _inside(extension, state.vector, state.vector + share * scaled.step(used))
        if not extension.admissible(trial):
            continue
        base_model = extension.base_model(trial)
        there = run(extension.model(trial, of=base_model), extension.facts, near=state.here, patient=False)
        value = whole_residual(observation, there.prediction, trial, extension.prior)
        if value is not None and np.sum(value[rows] ** 2) < state.cost(rows):
            return _State(trial, base_model, there, value), used
    return None


class _Scaled:
    """Levenberg-Marquardt steps from one linearisation; columns of unit length, so ``damping`` is a pure number."""

    def __init__(self, jacobian: Array, value: Array, cutoff: float) -> None:
        size = np.linalg.norm(jacobian, axis=0)
        self.size = np.where(size > 0.0, size, 1.0)
        left, weight, self.right = np.linalg.svd(jacobian / self.size, full_matrices=False)
        self.kept = weight > cutoff * weight[0]
        self.weight, self.along = weight, np.where(self.kept, left.T @ value, 0.0)

    @property
    def expected(self) -> float:
        """Fall of chi-square the linear model promises for the whole step."""
        return float(self.along @ self.along)

    def step(self, damping: float) -> Array:
        """Step, held back where the data hardly tell the direction (relative weight below ``damping``)."""
        weight = np.where(self.kept, self.weight, 1.0)
        filtered = weight / (weight**2 + (damping * self.weight[0]) ** 2)
        return np.asarray(self.right.T @ (filtered * self.along) / self.size)


def _inside(extension: Extension, vector: Array, trial: Array) -> Array:
    """The trial, taken back into its range; the law changes by a factor two at most, K0 by a fifth of its range."""
    clipped = trial.copy()
    for at, term in zip(extension.owners, extension.terms, strict=True):
        if term.cause.sign:
            clipped[at] = term.cause.sign * max(term.cause.sign * clipped[at], 0.0)
        for j, name in enumerate(term.variant.tuned):
            clipped[at + 1 + j] = np.clip(clipped[at + 1 + j], *term.variant.range(name))
    count = len(extension.base.knots)
    clipped[:count] = np.clip(clipped[:count], vector[:count] - 0.7, vector[:count] + 0.7)
    if (bend := extension.base.pre_curvature_index) is not None:
        reach = 0.2 * extension.facts.curvature_scale
        clipped[bend] = np.clip(clipped[bend], vector[bend] - reach, vector[bend] + reach)
    return clipped

"""Fits with a given number of control points, and the choice of that number by its evidence.

Control points lie on the range that the fitted cable visits. The evidence of their number is the probability of the
data with all unknowns and the smoothness of the law averaged over.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rod.equilibrium import Equilibrium
from rod.inverse.evaluation import Evaluation, evaluate
from rod.inverse.fit_model import FitModel
from rod.inverse.knots import place_knots
from rod.inverse.law_prior import LawPrior, first_prior
from rod.inverse.options import InverseOptions
from rod.inverse.smoothness import Averaged, averaged, evidence_of_knots

Array = NDArray[np.float64]

FIRST_BLUR = (10.0, 10.0)
"""Of the first fit: with few control points the simulation cannot follow good photos, and must not try."""

MISFIT = 4.0
"""Mean square of whitened residuals above which they count as misfit of the simulation, not as luck."""

SETTLING = 6
"""Fits with many control points at most; the visited range and the blur settle in two or three."""

FINAL_PRECISION = 1e-9
"""Of chi2, where a fit ends: a thousandth of a standard deviation for a thousand data."""

START_PRECISION = 1e-6
"""Of chi2, for fits from which others start: three hundredths of a standard deviation for a thousand data."""


@dataclass(frozen=True)
class Fit:
    """A fit that ended: model, evaluation at the optimum, number of evaluations, and whether it settled."""

    model: FitModel
    evaluation: Evaluation
    evaluations: int
    settled: bool

    @property
    def chi2(self) -> float:
        """Sum of squares of all whitened residuals."""
        return float(self.evaluation.value @ self.evaluation.value)

    def visited(self) -> tuple[float, float]:
        """Smallest and largest curvature of the simulated cable over all steps, 1/m."""
        kappas = [step.simulated.kappa for step in self.evaluation.steps]
        return float(min(k.min() for k in kappas)), float(max(k.max() for k in kappas))

    def posterior(self, taus: tuple[float, float]) -> Averaged:
        """Linearised posterior, averaged over the smoothness."""
        return averaged(self.model, self.evaluation, taus=taus)


def fit(
    model: FitModel,
    start: Array,
    *,
    starts: tuple[Equilibrium, ...] = (),
    evaluations: int = 60,
    precision: float = FINAL_PRECISION,
) -> Fit:
    """Least squares from the unknowns `start` (q,), scipy's trust-region reflective method with the exact jacobian.

    Where a trial has no equilibrium its residuals are infinite, and the method shortens its step. It ends where a step
    gains less than `precision` of chi2.
    """
    last = evaluate(model, start, starts=starts)
    if last.failure is not None:
        return Fit(model, last, 1, False)
    best, count = last, 1

    def at(u: Array) -> Evaluation:
        nonlocal last, best, count
        if not np.array_equal(u, last.unknowns):
            found = evaluate(model, u, starts=best.equilibria)
            count += 1
            if found.failure is not None:
                found = replace(found, value=np.full(best.value.size, np.inf))
            elif found.value @ found.value < best.value @ best.value:
                best = found
            last = found
        return last

    def value(u: Array) -> Array:
        return at(u).value

    def jacobian(u: Array) -> Array:
        return at(u).jacobian

    result = least_squares(
        value,
        start,
        jacobian,
        x_scale="jac",
        ftol=precision,
        xtol=precision,
        gtol=0.1 * precision,
        max_nfev=evaluations,
    )
    return Fit(model, best, count, result.status > 0)


def refit(
    known: Fit,
    knots: Array,
    prior: LawPrior,
    *,
    blur: tuple[float, float],
    evaluations: int,
    precision: float = FINAL_PRECISION,
) -> Fit:
    """The same data with other control points and another blur, started from a fit that is known."""
    model = replace(known.model, knots=knots, prior=prior, blur=blur)
    u = known.evaluation.unknowns
    start = np.concatenate([known.model.carried(u, knots), u[known.model.knots.size :]])
    return fit(model, start, starts=known.evaluation.equilibria, evaluations=evaluations, precision=precision)


def blur_needed(found: Fit) -> tuple[float, float]:
    """Factors on the noise of shapes and forces with which the residuals of a fit agree; 1 where they do already."""
    factors = []
    for kind, blur in zip(("shape", "force"), found.model.blur, strict=True):
        chi2, count = found.evaluation.chi2(kind)
        ratio = blur**2 * chi2 / count if count else 1.0
        factors.append(float(np.sqrt(ratio)) if ratio > MISFIT else 1.0)
    return factors[0], factors[1]


def rich_fit(first: Fit, options: InverseOptions) -> tuple[Fit, int]:
    """Fit with the largest number of control points over the range it visits, blurred as its residuals need."""
    rich, used = first, 0
    for _ in range(SETTLING):
        knots, blur = place_knots(*rich.visited(), options.knots[1]), blur_needed(rich)
        found = refit(
            rich, knots, first_prior(knots), blur=blur, evaluations=options.evaluations, precision=START_PRECISION
        )
        used += found.evaluations
        if found.evaluation.failure is not None:
            break
        moved = np.abs(np.subtract(found.visited(), rich.visited())).max()
        same = np.allclose(blur_needed(found), blur, rtol=0.2)
        rich = found
        if same and moved < 0.02 * np.ptp(rich.visited()):
            break
    return rich, used


def chosen_knots(first: Fit, options: InverseOptions) -> tuple[Fit, dict[int, float], int]:
    """Fit with the number of control points that follows from the data.

    A fit with the largest number is linearised; the evidence of every smaller number follows from it. ``spare`` control
    points more than the best are used, or half as many as those if that is more: they leave the error of the spline
    itself within the smoothness prior's band, and a law that asks for many (it has a kink) is followed least.

    Returns
    -------
    Fit
        At the mean over the smoothness.
    dict
        Log evidence of each number of control points, against the best.
    int
        Evaluations used.
    """
    least, most = options.knots
    rich, used = rich_fit(first, options)
    low, high = rich.visited()
    evidence = {
        count: evidence_of_knots(rich.model, rich.evaluation, place_knots(low, high, count), taus=options.tau)
        for count in range(least, most + 1)
    }
    best = max(evidence, key=lambda count: evidence[count])
    count = min(best + max(options.spare, best // 2), most)
    knots = place_knots(low, high, count)
    prior = rich.posterior(options.tau).prior.carried(rich.model.knots, knots)
    chosen = refit(rich, knots, prior, blur=rich.model.blur, evaluations=options.evaluations)
    used += chosen.evaluations
    if chosen.evaluation.failure is not None:  # the start with fewer control points has no equilibrium
        chosen = rich
    posterior = chosen.posterior(options.tau)
    model = replace(chosen.model, prior=posterior.prior)
    mean = evaluate(model, posterior.mean, starts=chosen.evaluation.equilibria)
    used += 1
    if mean.failure is None:
        chosen = replace(chosen, model=model, evaluation=mean)
    return chosen, {n: value - evidence[best] for n, value in evidence.items()}, used

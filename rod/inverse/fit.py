"""The fit of the inverse problem: Gauss-Newton toward the posterior mean, over all priors of the law's form at once.

Every iteration simulates the test, linearises, and moves to the mean over the priors (`rod.law_prior`), so no prior is
chosen on the way. Where the law falls steeply, a method that lets the cost never rise creeps along a curved valley;
whole steps, held back only in the law and K0, leave it. To keep them on the way the noise is taken larger at first
(`ANNEALED`), and the abscissa of the law is laid along the law found so far (`rod.compliance_law.refreshed`) whenever
the noise is lowered.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rod.compliance_law import refreshed
from rod.inverse.evaluation import Evaluation, evaluate
from rod.inverse.fit_model import FitModel
from rod.law_prior import Posterior, averaged, priors

Array = NDArray[np.float64]

ANNEALED = (30.0, 5.0, 1.0)
"""Factors on the noise, one after the other: a start that is off by a factor of two is ten standard deviations of good
photos away, where their linearisation says nothing."""

ROUGHLY, FINELY = 0.5, 0.002
"""Standard deviations by which the unknowns may still move where the noise is lowered, and in the end."""

LAW_STEP = 1.0
"""Of log c in one step: a factor e."""

BEND_STEP = 0.3
"""Of K0 in one step, over the range of the bend."""

SHORTER = 6
"""Halvings of a step that leads to a cable without equilibrium."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit that ended: model, last evaluation with the posterior there, number of evaluations, and whether settled."""

    model: FitModel
    evaluation: Evaluation
    posterior: Posterior | None
    evaluations: int
    settled: bool

    @property
    def chi2(self) -> float:
        """Sum of squares of all whitened residuals."""
        return float(self.evaluation.value @ self.evaluation.value)

    def moments(self) -> tuple[float, float]:
        """Smallest and largest bending moment of the simulated cable over all steps, N m."""
        law, K0 = self.model.law(self.evaluation.unknowns), self.model.pre_curvature(self.evaluation.unknowns)
        kappas = np.concatenate([step.simulated.kappa for step in self.evaluation.steps])
        m = law.moment(np.array([kappas.min(), kappas.max()]), K0)
        return float(m[0]), float(m[1])


def fit(model: FitModel, start: Array, *, blur: tuple[float, float] = (1.0, 1.0), evaluations: int = 60) -> Fit:
    """Fit from the unknowns `start` (q,); noise of shapes and forces is `blur` times as large as stated at least."""
    used, u = 0, start
    found = Fit(model, evaluate(model, start), None, 1, False)
    for factor in ANNEALED:
        if found.evaluation.failure is not None:
            break
        if used:
            basis = refreshed(found.model.law(found.evaluation.unknowns), *found.moments())
            model, u = found.model.on(basis, found.evaluation.unknowns)
        louder = max(factor, blur[0]), max(factor, blur[1])
        within = FINELY if factor == ANNEALED[-1] else ROUGHLY
        found = _settle(replace(model, blur=louder), u, found.evaluation, within, evaluations - used, smooth=False)
        used += found.evaluations
    if found.settled:
        found = _settle(found.model, found.evaluation.unknowns, found.evaluation, FINELY, evaluations, smooth=True)
        used += found.evaluations
    return replace(found, evaluations=used)


def _settle(model: FitModel, start: Array, near: Evaluation, within: float, evaluations: int, *, smooth: bool) -> Fit:
    """Gauss-Newton until the unknowns move by less than `within` standard deviations; see `priors` for `smooth`."""
    forms = priors(model.basis, smooth=smooth)
    here, count = evaluate(model, start, starts=near.equilibria), 1
    if here.failure is not None:
        return Fit(model, here, None, count, False)
    while True:
        posterior = averaged(here.value, here.jacobian, here.unknowns, forms)
        move = posterior.mean - here.unknowns
        settled = bool(np.all(np.abs(move) <= within * np.sqrt(np.diag(posterior.covariance)) + 1e-12))
        if settled or count >= evaluations:
            return Fit(model, here, posterior, count, settled)
        move = move * min(1.0, _reach(model, here, move))
        for _ in range(SHORTER):
            there = evaluate(model, here.unknowns + move, starts=here.equilibria)
            count += 1
            if there.failure is None:
                break
            move = 0.5 * move
        if there.failure is not None:
            return Fit(model, here, posterior, count, False)
        here = there


def _reach(model: FitModel, here: Evaluation, move: Array) -> float:
    """Share of a step that moves law and K0 as far as one step may."""
    p = model.basis.size
    log_c = float(np.abs(model.basis.at_ends @ move[:p]).max())
    kappas = np.concatenate([step.simulated.kappa for step in here.steps])
    bend = BEND_STEP * max(float(np.ptp(kappas)), 1e-12) * model.length
    return min(LAW_STEP / max(log_c, 1e-300), bend / max(abs(float(move[p])), 1e-300))

"""The fit of the inverse problem: Gauss-Newton toward the posterior mean, over all priors of the law's form at once.

Every iteration simulates the test, linearises, and moves to the mean over the priors (`rod.law_prior`), so no prior is
chosen on the way. Where the law falls steeply, a method that lets the cost never rise creeps along a curved valley;
whole steps, held back only in the law and K0, leave it. To keep them on the way the noise is taken larger at first
(`LOUD`), and the abscissa of the law is laid along the law found so far (`rod.compliance_law.refreshed`) whenever
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

LOUD, LOWERED = 30.0, 6.0
"""Factor on the noise that a fit begins with, or what its start asks for, and by how much it is lowered from stage to
stage: a start that is off by a factor of two is ten standard deviations of good photos away, where their linearisation
says nothing."""

FOLLOWS = 2.0
"""Root mean square of whitened residuals above which the simulation does not follow the data; no luck makes as much."""

ROUGHLY, FINELY = 0.5, 0.002
"""Standard deviations by which the unknowns may still move where the noise is lowered, and in the end."""

LAYINGS = 2
"""Times that the abscissa is laid along the law found in the end; each leaves a quarter of what the way there left."""

LAW_STEP = 1.0
"""Of log c in one step: a factor e."""

BEND_STEP = 0.3
"""Of K0 in one step, over the range of the bend."""

EVALUATIONS = 60
"""Bound of one fit; ten are usual."""

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
    def misfit(self) -> tuple[float, float]:
        """Root mean square of the residuals of shapes and forces in units of the noise of `model`; 1 where unknown."""
        shapes, forces = (self._rms(kind) for kind in ("shape", "force"))
        return shapes, forces

    def _rms(self, kind: str) -> float:
        chi2, count = self.evaluation.chi2(kind)
        return float(np.sqrt(chi2 / count)) if count else 1.0

    @property
    def log_evidence(self) -> float:
        """Log evidence of the data with their stated noise; minus infinity where nothing was fitted."""
        if self.posterior is None:
            return -np.inf
        counts = (self.evaluation.chi2(kind)[1] for kind in ("shape", "force"))
        louder = sum(count * np.log(blur) for count, blur in zip(counts, self.model.blur, strict=True))
        return self.posterior.log_evidence - float(louder)

    def moments(self) -> tuple[float, float]:
        """Smallest and largest bending moment of the simulated cable over all steps, N m."""
        law, K0 = self.model.law(self.evaluation.unknowns), self.model.pre_curvature(self.evaluation.unknowns)
        kappas = np.concatenate([step.simulated.kappa for step in self.evaluation.steps])
        m = law.moment(np.array([kappas.min(), kappas.max()]), K0)
        return float(m[0]), float(m[1])


def fit(model: FitModel, start: Array) -> Fit:
    """Fit from the unknowns `start` (q,).

    The noise is lowered to what is stated, or as far as the simulation follows the data. Where it does not, its misfit
    counts as noise from there on: a law that is let follow closer bends to hide what the simulation lacks.
    """
    found, loud = Fit(model, evaluate(model, start), None, 1, False), None
    used, noise = 1, max(LOUD, max(found.misfit) / FOLLOWS)
    while found.evaluation.failure is None:
        # toward data that contradict each other laws become wavy, and cost fifty times as much: foreseen, not tried
        misfit = (0.0, 0.0) if loud is None else _foreseen(loud, noise)
        if max(misfit) <= FOLLOWS:
            quiet = _quieter(found, (noise, noise), FINELY if noise == 1.0 else ROUGHLY, EVALUATIONS - used)
            used, misfit = used + quiet.evaluations, quiet.misfit
        if loud is not None and max(misfit) > FOLLOWS:
            found = _quieter(loud, _needed(loud, misfit, noise), ROUGHLY)
            used += found.evaluations
            break
        found = loud = quiet
        if noise == 1.0 or not found.settled:
            break
        noise = max(1.0, noise / LOWERED)
    if found.settled:
        # along the law found: where the abscissa was laid before depends on the way here
        within = FINELY if max(found.model.blur) == 1.0 else ROUGHLY
        for _ in range(LAYINGS):
            if found.settled:
                found = _quieter(found, found.model.blur, within, smooth=True)
                used += found.evaluations
    return replace(found, evaluations=used)


def _foreseen(found: Fit, noise: float) -> tuple[float, float]:
    """`Fit.misfit` after a fit with another noise, to first order; the law stays within about a factor e."""
    here, p, louder = found.evaluation, found.model.basis.size, np.ones(found.evaluation.value.size)
    for name, block in here.blocks.items():
        if name != "prior":
            louder[block] = found.model.blur[name.startswith("force/")] / noise
    value, J = louder * here.value, louder[:, None] * here.jacobian
    move = np.linalg.lstsq(np.vstack([J, np.eye(p, J.shape[1])]), np.concatenate([-value, np.zeros(p)]), rcond=None)[0]
    return replace(found, evaluation=replace(here, value=value + J @ move)).misfit


def _needed(loud: Fit, misfit: tuple[float, float], noise: float) -> tuple[float, float]:
    """Noise of shapes and forces with which residuals agree: by the last fit that followed them, as stated at least.

    ``misfit`` is what is left with a lower ``noise`` of both.
    """
    needed = []
    for one, other, blur in zip(loud.misfit, misfit, loud.model.blur, strict=True):
        rms = blur * one if other > FOLLOWS else min(blur * one, noise * other)
        needed.append(rms if rms > FOLLOWS else 1.0)
    return needed[0], needed[1]


def _quieter(
    found: Fit, noise: tuple[float, float], within: float, evaluations: int = EVALUATIONS, *, smooth: bool = False
) -> Fit:
    """From a fit on with another noise, the abscissa of the law laid along the law found."""
    model, u = found.model, found.evaluation.unknowns
    if found.posterior is not None:
        known = found.posterior.covariance[: model.basis.size, : model.basis.size]
        model, u = model.on(refreshed(model.law(u), known, *found.moments()), u)
    return _settle(replace(model, blur=noise), u, found.evaluation, within, evaluations, smooth=smooth)


def _settle(model: FitModel, start: Array, near: Evaluation, within: float, evaluations: int, *, smooth: bool) -> Fit:
    """Gauss-Newton until the unknowns move by less than `within` standard deviations; see `priors` for `smooth`."""
    forms = priors(model.basis, smooth=smooth)
    here, count = evaluate(model, start, starts=near.equilibria), 1
    if here.failure is not None:
        return Fit(model, here, None, count, False)
    share, before = 1.0, np.zeros(len(model.basis.at_ends))
    while True:
        posterior = averaged(here.value, here.jacobian, here.unknowns, forms)
        move = posterior.mean - here.unknowns
        settled = bool(np.all(np.abs(move) <= within * np.sqrt(np.diag(posterior.covariance)) + 1e-12))
        if settled or count >= evaluations:
            return Fit(model, here, posterior, count, settled)
        # a step back on the one before overshot the same valley: half as far, until steps agree again
        law = model.basis.at_ends @ move[: model.basis.size]
        share = 0.5 * share if law @ before < 0.0 else min(1.0, 2.0 * share)
        before, move = law, share * move * min(1.0, _reach(model, here, move))
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

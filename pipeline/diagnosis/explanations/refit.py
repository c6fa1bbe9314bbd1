"""A term put beside what a fitted model has already, and everything fitted again in full.

Scores are local: their amounts are right only as far as the model is linear. A refit starts from that linear estimate,
the other parameters moved out of the new term's place, or from the share of it that fits best; and from another K0,
where the base model may have gone elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.diagnosis.fits.search import TRACE, Suspicion
from pipeline.diagnosis.posterior.products import WORSE
from pipeline.records import Array
from rod.inverse.extension import Extension, Term
from rod.inverse.fit import PROMISED, Fit, State, fit, shown
from rod.inverse.observation import Observation

SHARES = (1.0, 0.3, 0.1)
"""Of a linear estimate, tried before a refit."""

SANE = 5.0
"""Plausible sizes: no refit starts from a larger amount, however far the linear model goes."""

ELSEWHERE = 0.1
"""Of the curvature scale: a base model whose K0 is so far from what photos show has gone elsewhere."""


@dataclass(frozen=True, eq=False)
class Addition:
    """A term to be added to a fitted model, with its linear estimate.

    Attributes
    ----------
    base : Fit
        The model it is put beside.
    term : Term
    amount : float
        Linear estimate, in the unit of its cause.
    column : (N,)
        Its whitened trace per unit of amount.
    """

    base: Fit
    term: Term
    amount: float
    column: Array

    @property
    def extension(self) -> Extension:
        """The model with the term in it."""
        known = self.base.extension
        return Extension(known.base, known.facts, (*known.terms, self.term))

    def start(self, vector: Array, *, share: float = 1.0) -> Array:
        """Vector to start `extension` from: the model so far, then a share of the term's amount, within its limits."""
        term, usual = self.term, self.term.cause.plausible(self.base.extension.facts)
        traced = TRACE * abs(term.variant.trace) * usual
        # what leaves as much trace as the linear estimate promises, where the trace grows with a power of it
        bent = np.sign(share * self.amount) * traced * abs(share * self.amount / traced) ** (1.0 / term.variant.power)
        value = float(np.clip(bent, -SANE * usual, SANE * usual))
        if term.cause.sign > 0 and value <= 0.0:  # far from the noise the linear estimate says nothing of the sign
            value = share * usual
        base, vector = self.base.extension.base, vector.copy()
        # what a model that lacks the term took for errors of the rig, beyond those of the worse rigs, are none
        most = WORSE * np.array(base.rig_std)
        vector[base.rig_at] = np.clip(vector[base.rig_at], -most, most)
        return np.concatenate([vector, term.numbers(value)])


def fit_term(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    direction: int,
    *,
    hopeless: float = np.inf,
) -> Fit | None:
    """Fit a model with one further term, from every start that is worth trying; the best fit.

    Parameters
    ----------
    observation : Observation
    base : Fit
        The model so far.
    suspicion : Suspicion
        Scores about that model.
    direction : int
        Of ``suspicion``, to become a term.
    hopeless : float
        Chi-square above which the fit is of no use.

    Returns
    -------
    Fit or None
        None where the model has no equilibrium from any start, or where its score promises nothing of use.
    """
    term = suspicion.terms[direction]
    added = Addition(base, term, float(suspicion.scores.estimate[direction]), suspicion.columns[:, direction])
    best: Fit | None = None
    elsewhere = _elsewhere(added)
    if not elsewhere and base.chi2 - PROMISED * suspicion.scores.z[direction] ** 2 > hopeless:
        return None
    for start in (linear_start(observation, added), *elsewhere):
        found = fit(observation, added.extension, start, near=base.run, hopeless=hopeless)
        if found.run.prediction is not None and (best is None or found.chi2 < best.chi2):
            best, hopeless = found, min(hopeless, found.chi2)  # from elsewhere only what leads lower is of use
    return best


def cost(fitted: Fit) -> float:
    """Chi-square plus two for every parameter (Akaike), infinite without equilibrium."""
    return fitted.chi2 + 2.0 * fitted.extension.size if fitted.run.prediction is not None else np.inf


def linear_start(observation: Observation, added: Addition) -> Array | State:
    """Start of a refit: the largest share of the linear estimate that brings the model nearer to the data.

    The other parameters are moved along: those that stayed would keep the place of the cause. The last, smallest trial
    leaves them. Where none comes nearer, the one that goes least astray.
    """
    base, extension = added.base, added.extension
    size = np.linalg.norm(base.jacobian, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    left = base.residual - added.column * added.amount
    move = np.linalg.lstsq(base.jacobian / size, left, rcond=1e-7)[0] / size
    trials = [added.start(base.vector + share * move, share=share) for share in SHARES]
    trials.append(added.start(base.vector, share=SHARES[-1]))
    best: State | None = None
    for trial in trials:
        if extension.admissible(trial):
            there = shown(observation, extension, trial, base.run, patient=False)
            best = there if best is None or there.cost() < best.cost() else best
            if best.cost() < base.chi2:
                break
    # where none has an equilibrium, the last one is at least a possible cable: whole moves may leave every range
    return trials[-1] if best is None or best.run.prediction is None else best


def _elsewhere(added: Addition) -> list[Array]:
    """Further starts: with K0 of the other sign, and with the law and K0 that photos show, where it may be wrong."""
    base, facts = added.base.extension.base, added.base.extension.facts
    at = base.pre_curvature_index
    if at is None or len(base.names) != len(added.base.vector):
        return []
    K0, seen, mirrored = float(added.base.vector[at]), base.as_seen(), base.neutral()
    mirrored[at] = -K0
    far = abs(float(seen[at]) - K0) > ELSEWHERE * facts.curvature_scale
    return [*([added.start(seen)] if far else []), *([added.start(mirrored)] if "mounted" not in facts.branch else [])]

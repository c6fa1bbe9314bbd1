"""How large a cause must be to be found: to be likelier than the base model, with a stated power."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri

from pipeline.diagnosis.fits.fit import Fit
from pipeline.diagnosis.fits.search import Suspicion, direction
from pipeline.diagnosis.observations.observation import Observation
from pipeline.diagnosis.posterior.evidence import log_gain
from pipeline.diagnosis.posterior.hypotheses import SHARES
from pipeline.diagnosis.statistics.score import span

LOUDEST = 40.0
"""Standard deviations: what is not found at that size, ten times the plausible one being less, is found at none."""


def sigma_needed(plausible: float, *, forms: int, causes: int, sign: int, power: float) -> float:
    """Size of an effect (standard deviations) that makes one cause likelier than the base model with a power.

    Parameters
    ----------
    plausible : float
        Plausible size of the cause, in standard deviations of its amount.
    forms, causes : int
        That share the probability beforehand.
    sign : int
        0 where the amount may have either.
    power : float
        Probability at which it is so.
    """
    needed = np.log(SHARES[0][0] / SHARES[1][0] * forms * causes)

    def short(z: float) -> float:
        return float(needed - log_gain(z, 1.0, plausible, abs(sign))[0])

    if short(LOUDEST) > 0.0:
        return np.inf
    return float(brentq(short, 0.0, LOUDEST)) + float(ndtri(power))


def detectable_amount(
    observation: Observation, fitted: Fit, suspicion: Suspicion, cause: int, *, power: float, trace: float
) -> float:
    """Smallest amount of a cause, in its clearest form, that is found with the given power; infinite if none is.

    A trace that grows otherwise than in proportion (stiff ends: with the square) is computed anew at the amount found,
    by fixed-point steps in the logarithm; three reach a few per cent.
    """
    # a trace computed at a large amount says little of the smallest one that is seen
    own = np.array([k for k in suspicion.of(cause) if suspicion.terms[k].variant.trace == 1.0], dtype=int)
    if own.size == 0 or not np.any(suspicion.scores.norm[own] > 0.0):
        return float("inf")
    best = int(own[np.argmax(suspicion.scores.norm[own])])
    plausible = suspicion.causes[cause].plausible(fitted.extension.facts)
    needed = sigma_needed(
        plausible * float(suspicion.scores.norm[best]),
        forms=len(suspicion.of(cause)),
        causes=len(set(suspicion.owner.tolist())),
        sign=suspicion.causes[cause].sign,
        power=power,
    )
    amount = needed / float(suspicion.scores.norm[best])
    at = trace * plausible
    basis = span(fitted.jacobian)
    for _ in range(3):
        if not LINEAR[0] * at < amount < LINEAR[1] * at or amount > 30.0 * plausible:
            column = direction(observation, fitted, suspicion.terms[best], amount=min(amount, 30.0 * plausible))
            norm = float(np.linalg.norm(column - basis @ (basis.T @ column)))
            if norm <= 0.0 or not np.isfinite(norm):
                break
            at, amount = amount, float(np.sqrt(amount * needed / norm))
    return amount


LINEAR = (0.02, 3.0)
"""Amounts within these multiples of where a trace was computed are taken as proportional."""

"""How large a cause must be to be found: to be likelier than the base model, with a stated power.

So large beside a rig whose zero, length and camera are off by what they ordinarily are.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri

from pipeline.diagnosis.fits.search import TRACE, Suspicion, direction, taken_by_rig
from pipeline.diagnosis.posterior.error_grid import MOVED
from pipeline.diagnosis.posterior.evidence import log_gain
from pipeline.diagnosis.posterior.hypotheses import SHARES
from pipeline.diagnosis.statistics.score import span
from rod.inverse.fit import Fit
from rod.inverse.observation import Observation

LOUDEST = 40.0
"""Standard deviations: what is found neither at that size nor at the largest possible one is found at none."""

POSSIBLE = 30.0
"""Plausible sizes: no rig has more of a cause."""


def sigma_needed(
    plausible: float, *, forms: int, causes: int, sign: int, power: float, rig: tuple[float, float] = (0.0, 0.0)
) -> float:
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
    rig : (share, log)
        What a rig that is off by what every rig is takes of the effect's square, and what its evidence pays
        (`pipeline.diagnosis.fits.search.taken_by_rig`).
    """
    needed = np.log(SHARES[0][0] / SHARES[1][0] * forms * causes)
    off = np.log(MOVED[0.0, 1.0] / MOVED[0.0, 0.0])

    def short(z: float) -> float:
        taken = np.logaddexp(0.0, off + 0.5 * rig[0] * z * z - rig[1])
        return float(needed + taken - log_gain(z, 1.0, plausible, abs(sign))[0])

    # what every rig has of a cause may be many times what the data tell of it
    most = max(LOUDEST, POSSIBLE * plausible)
    if short(most) > 0.0:
        return np.inf
    return float(brentq(short, 0.0, most)) + float(ndtri(power))


def in_each_form(fitted: Fit, suspicion: Suspicion, cause: int, *, power: float) -> dict[int, float]:
    """Smallest amount of every usual form of a cause (direction -> amount) that is found with the given power.

    By the trace of each form as it was computed; infinite where the data do not show it, or only at more than
    a rig can have. A trace computed at a large amount says little of the smallest one that is seen, unless it is known
    how it grows.
    """
    terms, scores, kind = suspicion.terms, suspicion.scores, suspicion.causes[cause]
    plausible, own, found = kind.plausible(fitted.extension.facts), suspicion.of(cause), {}
    taken, volume = taken_by_rig(scores.unit[:, own], fitted, suspicion)
    for k, share in zip(map(int, own), map(float, taken), strict=True):
        variant, norm = terms[k].variant, float(scores.norm[k])
        if variant.rare or (variant.trace != 1.0 and variant.power == 1.0):
            continue
        forms, causes = len(own), len(set(suspicion.owner.tolist()))
        rig = (share, volume)
        needed = sigma_needed(plausible * norm, forms=forms, causes=causes, sign=kind.sign, power=power, rig=rig)
        at = TRACE * variant.trace * plausible
        amount = at * (needed / (norm * at)) ** (1.0 / variant.power) if norm > 0.0 else np.inf
        found[k] = float(amount) if amount <= POSSIBLE * plausible else np.inf
    return found


def in_any_form(fitted: Fit, suspicion: Suspicion, cause: int, *, power: float) -> float:
    """Smallest amount of a cause that is found whatever form it has; infinite if some form never is."""
    return max(in_each_form(fitted, suspicion, cause, power=power).values(), default=np.inf)


def clearest(suspicion: Suspicion, each: Mapping[int, float]) -> int:
    """The form (direction) of those `in_each_form` tells that is found at the smallest amount."""
    # forms that all lack a trace at their usual size may have one at a larger
    return min(each, key=lambda k: (each[k], -suspicion.scores.norm[k]))


def detectable_amount(
    observation: Observation, fitted: Fit, suspicion: Suspicion, cause: int, *, power: float
) -> float:
    """Smallest amount of a cause, in its clearest form, that is found with the given power; infinite if none is.

    A trace that grows otherwise than in proportion (stiff ends: with the square) is computed anew at the amount found,
    by fixed-point steps in the logarithm; three reach a few per cent.
    """
    each = in_each_form(fitted, suspicion, cause, power=power)
    if not each:
        return float("inf")
    best = clearest(suspicion, each)
    variant, norm = suspicion.terms[best].variant, float(suspicion.scores.norm[best])
    if norm <= 0.0 or variant.power != 1.0:
        return each[best]
    plausible = suspicion.causes[cause].plausible(fitted.extension.facts)
    forms, causes = len(suspicion.of(cause)), len(set(suspicion.owner.tolist()))
    sign = suspicion.causes[cause].sign
    share, volume = taken_by_rig(suspicion.scores.unit[:, [best]], fitted, suspicion)
    rig = (float(share[0]), volume)
    needed = sigma_needed(plausible * norm, forms=forms, causes=causes, sign=sign, power=power, rig=rig)
    amount, at = needed / norm, TRACE * plausible
    basis = span(fitted.jacobian)
    for _ in range(3):
        if not LINEAR[0] * at < amount < LINEAR[1] * at or amount > POSSIBLE * plausible:
            column = direction(observation, fitted, suspicion.terms[best], amount=min(amount, POSSIBLE * plausible))
            norm = float(np.linalg.norm(column - basis @ (basis.T @ column)))
            if norm <= 0.0 or not np.isfinite(norm):
                break
            at, amount = amount, float(np.sqrt(amount * needed / norm))
    return amount


LINEAR = (0.02, 3.0)
"""Amounts within these multiples of where a trace was computed are taken as proportional."""

"""From refitted explanations to a verdict: probabilities, the set of names that cannot be told apart, and the word.

Every explanation (one cause, or two) removes a chi-square ``gain`` from the base model's misfit. With a flat prior on
the size of an effect in sigma, the weight of an explanation is ``exp(gain / 2)`` times

* ``1 / 2`` where the amount may have either sign;
* the mean over the scanned forms of ``exp(z^2 / 2)`` relative to the best one, so that trying many forms buys nothing;
* ``exp(-1)`` for every number tuned beyond the amount (Akaike);
* a loss for amounts beyond any plausible size, by the inverse square.

The gain is divided by the reduced chi-square of the best explanation where that exceeds 1: where even the best form
does not fit to the noise, a difference between two imperfect forms is no proof.

The causes that together hold 95 % of the weight form the set, and with them every twin of the best one: whatever points
the same way and removes as much, so that only the weights of forms and sizes speak against it. One name: ``named``;
several: ``class``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

Array = NDArray[np.float64]
Verdict = Literal["adequate", "named", "class", "two_causes", "unexplained", "underpowered"]


@dataclass(frozen=True)
class Weighed:
    """What decides about one explanation.

    Attributes
    ----------
    gain : float
        Chi-square it removes from the base model.
    tuned : int
        Numbers fitted beyond one amount.
    scan : float
        Log of the mean over the scanned forms of ``exp(z^2 / 2)``, relative to the best form; 0 without a scan.
    signs : int
        1 if the amount has one admissible sign, else 2.
    excess : float
        Amount over plausible size.
    """

    gain: float
    tuned: int = 0
    scan: float = 0.0
    signs: int = 2
    excess: float = 0.0


def scan_share(statistic: Array) -> float:
    """Log-mean of ``exp(t^2 / 2)`` over the forms of one cause, relative to the largest: 0 for one form."""
    half = 0.5 * np.asarray(statistic) ** 2
    return float(logsumexp(half) - np.log(half.size) - half.max())


def probabilities(options: list[Weighed], *, reduced_chi2: float, implausible: float) -> Array:
    """Probability of each explanation, given that one of them is right.

    Parameters
    ----------
    options : list of Weighed
    reduced_chi2 : float
        Of the best explanation; values below 1 count as 1.
    implausible : float
        Multiple of the plausible size from which weight is lost.
    """
    temper = max(1.0, reduced_chi2)
    log_weight = np.array(
        [
            (0.5 * o.gain + o.scan - o.tuned) / temper
            - np.log(o.signs)
            - 2.0 * np.log(max(1.0, abs(o.excess) / implausible))
            for o in options
        ]
    )
    return np.asarray(np.exp(log_weight - logsumexp(log_weight)))


def credible_set(probability: Array, *, level: float) -> list[int]:
    """Smallest set of explanations that holds at least ``level``, most probable first."""
    order = np.argsort(-probability, kind="stable")
    needed = int(np.searchsorted(np.cumsum(probability[order]), level - 1e-12)) + 1
    return [int(k) for k in order[: min(needed, len(order))]]


def with_twins(
    members: list[int], probability: Array, gain: Array, closeness: Array, *, cosine: float, margin: float
) -> list[int]:
    """The set with the twins of its first member.

    Parameters
    ----------
    members : list of int
        As of `credible_set`.
    probability, gain : (n,)
        Of each explanation.
    closeness : (n,)
        |cos| of each explanation's direction with that of the first member.
    cosine, margin : float
        Twins are closer than ``cosine`` and remove at most ``margin`` less chi-square than the first member.
    """
    twin = (closeness > cosine) & (gain > gain[members[0]] - margin)
    order = np.argsort(-probability, kind="stable")
    return [*members, *(int(k) for k in order if twin[k] and int(k) not in members)]


def decide(*, detected: bool, alien: bool, two: bool, names: int, powerless: bool) -> Verdict:
    """The word for what was found.

    Parameters
    ----------
    detected : bool
        A cause's score exceeds the family-wise threshold.
    alien : bool
        What is left after the best explanation (or of the base model, if nothing was detected) exceeds noise and is no
        small share of the misfit.
    two : bool
        A second cause was accepted.
    names : int
        Size of the set of names.
    powerless : bool
        Effects of plausible size would not have been seen either.
    """
    if alien:
        return "unexplained"
    if not detected:
        return "underpowered" if powerless else "adequate"
    if two:
        return "two_causes"
    return "named" if names == 1 else "class"

"""An explanation: one or two causes in the model, fitted in full."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.begun import BEGUN
from pipeline.diagnosis.causes.profile import WAVE_COST, is_wave, largest_of
from rod.inverse.fit import Fit


@dataclass(frozen=True, eq=False)
class Explanation:
    """One or two causes in the model, fitted.

    Attributes
    ----------
    causes : tuple of int
        Indices into the catalogue, the stronger first.
    fitted : Fit
    gain : float
        Chi-square removed from the base model.
    """

    causes: tuple[int, ...]
    fitted: Fit
    gain: float

    @property
    def begun(self) -> bool:
        """Whether it holds what begins between two holds, which is no cause of the catalogue."""
        return any(term.cause in BEGUN for term in self.fitted.extension.terms)

    @property
    def worth(self) -> float:
        """Half of the chi-square removed, less one for every number fitted: which of many is worth going on with."""
        terms = self.fitted.extension.terms
        numbers = sum(len(term.variant.tuned) + (WAVE_COST if is_wave(term.variant) else 1) for term in terms)
        return 0.5 * self.gain - numbers

    def sigma(self, cause: Cause) -> float:
        """How many standard deviations the amounts of a cause, all its forms together, lie from zero."""
        extension = self.fitted.extension
        at = [extension.amounts_at[k] for k in extension.terms_of(cause)]
        amount, covariance = self.fitted.vector[at], self.fitted.covariance[np.ix_(at, at)]
        return float(np.sqrt(max(float(amount @ np.linalg.solve(covariance, amount)), 0.0)))

    def amount(self, cause: Cause) -> tuple[float, float]:
        """Size of a cause and its standard deviation: the sum of its forms where they add up, else the largest.

        What differs from step to step does so about that size.
        That of a profile along the cable is its largest deviation beyond doubt, of all forms together.
        """
        extension, own = self.fitted.extension, self.fitted.extension.terms_of(cause)
        at = [extension.amounts_at[i] for i in own]
        covariance = self.fitted.covariance[np.ix_(at, at)]
        if cause.varies and len(own) > 1:
            forms = [extension.formed(self.fitted.vector, i).variant for i in own]
            weight = largest_of(forms, self.fitted.vector[at], covariance, cause)
        elif cause.additive:
            weight = np.ones(len(own))
        else:
            whole = [k for k in own if not np.isfinite(extension.terms[k].variant.known)]
            return max((self.fitted.amount(i) for i in whole), key=lambda pair: abs(pair[0]))
        variance = float(weight @ covariance @ weight)
        return float(weight @ self.fitted.vector[at]), float(np.sqrt(max(variance, 0.0)))


def explanation_of(causes: tuple[int, ...], base: Fit, fitted: Fit) -> Explanation:
    """A fitted model as the explanation by the causes in it."""
    return Explanation(causes, fitted, base.chi2 - fitted.chi2)

"""An explanation: one or two causes in the model, fitted in full."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.profile import largest, largest_of
from pipeline.diagnosis.causes.unnamed import UNNAMED
from pipeline.records import Array
from rod.inverse.cause import Profile, Variant
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
    def unnamed(self) -> bool:
        """Whether it holds what acts on the cable and is no cause of the catalogue."""
        return any(term.cause in UNNAMED for term in self.fitted.extension.terms)

    @property
    def worth(self) -> float:
        """Half of the chi-square removed, less one for every number fitted: which of many is worth going on with."""
        return 0.5 * self.gain - sum(1 + len(term.variant.tuned) for term in self.fitted.extension.terms)

    def sigma(self, cause: Cause) -> float:
        """How many standard deviations the amounts of a cause, all its forms together, lie from zero."""
        _, amount, covariance = self._forms(cause)
        return float(np.sqrt(max(float(amount @ np.linalg.solve(covariance, amount)), 0.0)))

    def amount(self, cause: Cause) -> tuple[float, float]:
        """Size of a cause and its standard deviation: the sum of its forms where they add up, else the largest.

        What differs from step to step does so about that size.
        That of a profile along the cable is its largest deviation beyond doubt, of all forms together.
        """
        forms, amounts, covariance = self._forms(cause)
        if isinstance(cause, Profile) and len(forms) > 1:
            return _total(largest_of(forms, amounts, covariance, cause), amounts, covariance)
        if cause.additive:
            return _total(np.ones(len(forms)), amounts, covariance)
        whole = [k for k, form in enumerate(forms) if not np.isfinite(form.known)]
        return max((_total(np.eye(len(forms))[k], amounts, covariance) for k in whole), key=lambda pair: abs(pair[0]))

    def size(self, cause: Cause) -> tuple[float, float, str] | None:
        """What the forms of a cause make up where that says more than its amount: size, standard deviation, unit."""
        forms, amounts, covariance = self._forms(cause)
        made = cause.together(forms, self.fitted.extension.facts)
        if made is None:
            return None
        unit, rows = made
        return *_total(largest(rows, amounts, covariance), amounts, covariance), unit

    def _forms(self, cause: Cause) -> tuple[list[Variant], Array, Array]:
        """The k forms of a cause as fitted, their amounts (k,) and the covariance (k, k) of these."""
        extension, vector = self.fitted.extension, self.fitted.vector
        own = extension.terms_of(cause)
        at = [extension.amounts_at[i] for i in own]
        return [extension.formed(vector, i).variant for i in own], vector[at], self.fitted.covariance[np.ix_(at, at)]


def _total(weight: Array, amounts: Array, covariance: Array) -> tuple[float, float]:
    """Weighted sum of amounts and its standard deviation."""
    return float(weight @ amounts), float(np.sqrt(max(float(weight @ covariance @ weight), 0.0)))


def explanation_of(causes: tuple[int, ...], base: Fit, fitted: Fit) -> Explanation:
    """A fitted model as the explanation by the causes in it."""
    return Explanation(causes, fitted, base.chi2 - fitted.chi2)

"""An explanation: one or two causes in the model, fitted in full, with all that decides about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.profile import WAVE_COST, is_profile, is_wave, largest_of
from pipeline.diagnosis.fits.fit import Fit
from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.statistics.verdict import Weighed, scan_share


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
    weighed : Weighed
    """

    causes: tuple[int, ...]
    fitted: Fit
    gain: float
    weighed: Weighed

    def amount(self, cause: Cause) -> tuple[float, float]:
        """Size of a cause and its standard deviation: the sum of its forms where they add up, else the largest.

        That of a profile along the cable is its largest deviation beyond doubt, of all forms together.
        """
        extension, own = self.fitted.extension, self.fitted.extension.terms_of(cause)
        at = [extension.amounts_at[i] for i in own]
        covariance = self.fitted.covariance[np.ix_(at, at)]
        if is_profile(cause) and len(own) > 1:
            forms = [extension.formed(self.fitted.vector, i).variant for i in own]
            weight = largest_of(forms, self.fitted.vector[at], covariance, cause)
        elif cause.additive:
            weight = np.ones(len(own))
        else:
            return max((self.fitted.amount(i) for i in own), key=lambda pair: abs(pair[0]))
        variance = float(weight @ covariance @ weight)
        return float(weight @ self.fitted.vector[at]), float(np.sqrt(max(variance, 0.0)))

    def impossible(self, catalogue: Sequence[Cause], most: float) -> Cause | None:
        """A cause that would have to be larger, by two standard deviations, than ``most`` plausible sizes; or None."""
        for cause in (catalogue[k] for k in self.causes):
            amount, std = self.amount(cause)
            if cause.limited and abs(amount) - 2.0 * std > most * cause.plausible(self.fitted.extension.facts):
                return cause
        return None


def explanation_of(causes: tuple[int, ...], base: Fit, fitted: Fit, suspicion: Suspicion) -> Explanation:
    """A fitted model as the explanation by the causes in it, with what decides about it."""
    terms = fitted.extension.terms
    kinds = [suspicion.causes[cause] for cause in causes]
    gain = base.chi2 - fitted.chi2
    weighed = Weighed(
        gain=gain,
        tuned=sum(len(term.variant.tuned) + (WAVE_COST if is_wave(term.variant) else 1) for term in terms) - 1,
        scan=sum(scan_share(suspicion.statistic[suspicion.of(cause)]) for cause in causes),
        signs=int(np.prod([1 if kind.sign else 2 for kind in kinds])),
    )
    found = Explanation(causes, fitted, gain, weighed)
    excess = max(abs(found.amount(kind)[0]) / kind.plausible(fitted.extension.facts) for kind in kinds)
    return replace(found, weighed=replace(weighed, excess=excess))

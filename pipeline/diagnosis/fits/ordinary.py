"""A rig that is off by what every rig is: zeros of displacement and force, length and camera beside a fitted model.

So much is among the errors of the data (`pipeline.diagnosis.posterior.error_grid`) and is named by nobody. Where it is
likelier than an exact rig, residuals and f_EI of a model with causes are those beside it, and the reader is
told its size.

Code: ``rig/ordinary``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.diagnosis.fits.search import Suspicion
from pipeline.messages import Message, word
from pipeline.records import Finding, inferred
from rod.inverse.extension import Term
from rod.inverse.fit import Fit, fit_from
from rod.inverse.observation import Observation


def beside_ordinary_rig(observation: Observation, fitted: Fit, suspicion: Suspicion, off: float = 1.0) -> Fit | None:
    """Fit a model with the small errors that every rig has; None without an equilibrium.

    ``off``: their size, in usual ones.
    """
    terms = ordinary_terms(suspicion, fitted, off)
    wider = replace(fitted.extension, terms=(*fitted.extension.terms, *terms))
    found = fit_from(observation, wider, np.r_[fitted.vector, np.zeros(len(terms))], fitted)
    return None if found.run.prediction is None else found


def ordinary_terms(suspicion: Suspicion, fitted: Fit, off: float = 1.0) -> tuple[Term, ...]:
    """What every rig has a little of, each of a size that is known, but what is in the model already."""
    present = {term.cause.name for term in fitted.extension.terms}
    return tuple(
        Term(term.cause, replace(form, known=off * form.ordinary / term.cause.plausible(fitted.extension.facts)))
        for term in suspicion.terms
        if (form := term.variant).ordinary > 0.0 and term.cause.name not in present
    )


SEEN = 2.0
"""Standard deviations from zero at which an amount is told."""


def told(found: Fit) -> tuple[Finding, ...]:
    """Finding on what a rig is off by, as far as the data show it."""
    parts = []
    for k, term in enumerate(found.extension.terms):
        amount, std = found.amount(k)
        if np.isfinite(term.variant.known) and term.variant.ordinary > 0.0 and abs(amount) > SEEN * std:
            size = (amount, std, term.cause.unit)
            parts.append(Message("rig/ordinary.part", cause=word(term.cause.name), size=size))
    return (inferred("rig/ordinary", parts=parts),) if parts else ()

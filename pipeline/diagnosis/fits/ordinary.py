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
    base, present = fitted.extension.base, {term.cause.name for term in fitted.extension.terms}
    terms = tuple(
        Term(term.cause, replace(form, known=off * form.ordinary / term.cause.plausible(fitted.extension.facts)))
        for term in suspicion.terms
        if (form := term.variant).ordinary > 0.0 and term.cause.name not in present
    )
    zeros = tuple(off * std for std in base.zeros_std)
    wider = replace(fitted.extension, base=replace(base, zeros_std=zeros), terms=(*fitted.extension.terms, *terms))
    found = fit_from(observation, wider, np.r_[fitted.vector, np.zeros(len(terms))], fitted)
    return None if found.run.prediction is None else found


SEEN = 2.0
"""Standard deviations from zero at which an amount is told."""


def told(found: Fit) -> tuple[Finding, ...]:
    """Finding on what a rig is off by, as far as the data show it."""
    extension, own = found.extension, np.sqrt(np.diag(found.covariance))
    present = {term.cause.name for term in extension.terms if not np.isfinite(term.variant.known)}
    small = [*zip(("displacement_offset", "force_offset"), ("m", "N"), extension.base.zeros_at.tolist(), strict=False)]
    for at, term in zip(extension.amounts_at, extension.terms, strict=True):
        if np.isfinite(term.variant.known) and term.variant.ordinary > 0.0:
            small.append((term.cause.name, term.cause.unit, at))
    parts = [
        Message("rig/ordinary.part", cause=word(name), size=(float(found.vector[at]), float(own[at]), unit))
        for name, unit, at in small
        if name not in present and abs(found.vector[at]) > SEEN * own[at]
    ]
    return (inferred("rig/ordinary", parts=parts),) if parts else ()

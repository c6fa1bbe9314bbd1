"""Where what no cause explains sits, in words and numbers."""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.causes.begun import BEGUN
from pipeline.diagnosis.causes.lever import LEVER
from pipeline.diagnosis.causes.unnamed import PLACE, POINTS, UNKNOWN
from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.fits.maps import across_cable
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.evidence import something_else
from pipeline.messages import Message
from pipeline.result import LeftoverPart
from rod.inverse.fit import Fit
from rod.inverse.observation import KINDS


def described(bench: Workbench, conclusion: Conclusion) -> LeftoverPart:
    """Say where in the data that is which is likeliest to be something else."""
    observation, fitted = bench.observation, conclusion.fitted(bench)
    field, astray = something_else(conclusion.grid, fitted)
    unnamed = _unnamed(bench, fitted)
    square = field**2
    total = max(float(square.sum()), 1e-300)
    share = {KINDS[k]: float(square[observation.rows.kind == k].sum()) / total for k in range(len(KINDS) - 1)}
    strongest = int(np.argmax(np.bincount(observation.rows.step, weights=square)))
    shape, step = across_cable(observation, field, strongest), bench.test.steps[strongest]
    at = None if shape is None else float(shape[0][int(np.argmax(np.abs(shape[1])))])
    loudest = max(share, key=lambda kind: share[kind])
    place = Message("left.place", at_m=at) if at is not None and loudest == "shape" else ""
    said = unnamed or Message("left.over", where=f"{loudest}s", step=step.step, branch=step.branch, place=place)
    if astray and not unnamed:
        said = Message("left.astray", size_m=astray, step=step.step, branch=step.branch)
    return LeftoverPart(
        **LeftoverPart.told(said),
        probability=conclusion.posterior.total(something_else=True),
        chi2=float(field @ field),
        noise_factor=observation.photo_noise.factor,
        share=share,
        place=at,
        shape_m=[] if shape is None else shape[1].tolist(),
        s_m=[] if shape is None else shape[0].tolist(),
        step=step.step,
    )


def _unnamed(bench: Workbench, fitted: Fit) -> Message | None:
    """What acts on the cable and has no name in the catalogue, if that is in the model."""
    for k, term in enumerate(fitted.extension.terms):
        if term.cause in UNKNOWN:
            return _unknown(bench, fitted)
        size = (*fitted.amount(k), term.cause.unit)
        if term.cause is LEVER:
            return Message(LEVER.name, side=term.variant.label, size=size)
        if term.cause in BEGUN:
            step = bench.test.steps[int(term.variant.at)]
            more = Message("begun.growing") if term.variant.width else ""
            return Message(term.cause.name, step=step.step, branch=step.branch, size=size, more=more)
    return None


def _unknown(bench: Workbench, fitted: Fit) -> Message:
    """Where forces or moments act that no model has, since which step, and when they are largest."""
    extension = fitted.extension
    cause = next(one for one in UNKNOWN if extension.terms_of(one))
    own = extension.terms_of(cause)
    forms, at = [extension.terms[k].variant for k in own], [extension.amounts_at[k] for k in own]
    unit, rows = cause.together(forms, bench.facts)
    labels = tuple(dict.fromkeys(form.label for form in forms))
    loudest = int(np.argmax(np.abs(rows @ fitted.vector[at])))
    row, steps, first = rows[loudest], bench.test.steps, int(forms[0].width)
    step, std = steps[loudest % len(steps)], np.sqrt(row @ fitted.covariance[np.ix_(at, at)] @ row)
    return Message(
        cause.name,
        place=_place(bench, fitted) or Message(next(name for name, some in cause.places.items() if some == labels)),
        since=Message("unnamed.since", step=steps[first].step) if first else "",
        step=step.step,
        branch=step.branch,
        size=(float(row @ fitted.vector[at]), float(std), unit),
    )


def _place(bench: Workbench, fitted: Fit) -> Message | None:
    """Where along the cable a force acts that no model has; None where there is no such place."""
    for k in fitted.extension.terms_of(PLACE):
        (beside, std), length = fitted.amount(k), bench.facts.length
        at = POINTS[fitted.extension.terms[k].variant.label] + beside
        return Message("unnamed.at", at=(at * length, std * length, "m"))
    return None

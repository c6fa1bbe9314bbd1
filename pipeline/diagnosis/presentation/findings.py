"""What a conclusion asks the reader to know beside its sentence: a cause that is too large, a search that was ended.

Codes: ``diagnosis/impossible-size``, ``rig/ordinary``.
"""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.messages import Message, word
from pipeline.records import Finding, doubtful, inferred
from rod.inverse.fit import Fit


def too_large(bench: Workbench, conclusion: Conclusion) -> tuple[Finding, ...]:
    """What would explain an unexplained specimen if it could be that large."""
    if conclusion.accepted is None:
        return ()
    for cause in (bench.suspicion.causes[k] for k in conclusion.accepted.causes):
        amount, std = conclusion.accepted.amount(cause)
        times = abs(amount) / cause.plausible(bench.facts)
        if not cause.limited or abs(amount) - 2.0 * std < IMPOSSIBLE * cause.plausible(bench.facts):
            continue
        size = (amount, std, cause.unit)
        return (doubtful("diagnosis/impossible-size", cause=word(cause.name), size=size, times=times),)
    return ()


IMPOSSIBLE = 20.0
"""Plausible sizes: a tilt of 40 degrees, stiff ends over a third of the cable, all force lost in a hold."""


SEEN = 2.0
"""Standard deviations from zero at which an error of the rig is told."""

NAMES = ("displacement_offset", "m"), ("force_offset", "N"), ("length_error", "-"), *[("camera_tilt", "1/m")] * 2
"""What an error of each of `rod.inverse.base.RIG` is called where it is large, and its unit."""


def rig_told(fitted: Fit) -> tuple[Finding, ...]:
    """Finding on what a rig is off by, as far as the data show it, beside the causes of a model."""
    present, own = {term.cause.name for term in fitted.extension.terms}, np.sqrt(np.diag(fitted.covariance))
    parts = [
        Message("rig/ordinary.part", cause=word(name), size=(float(fitted.vector[at]), float(own[at]), unit))
        for (name, unit), at in zip(NAMES, fitted.extension.base.rig_at.tolist(), strict=False)
        if name not in present and abs(fitted.vector[at]) > SEEN * own[at]
    ]
    return (inferred("rig/ordinary", parts=parts),) if parts else ()

"""What a conclusion asks the reader to know beside its sentence: a cause that is too large, a search that was ended.

Code: ``diagnosis/impossible-size``.
"""

from __future__ import annotations

from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.messages import word
from pipeline.records import Finding, doubtful


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

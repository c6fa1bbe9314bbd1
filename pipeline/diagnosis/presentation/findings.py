"""What a conclusion asks the reader to know beside its sentence: a cause that is too large, a search that was ended.

Codes: ``diagnosis/impossible-size``, ``diagnosis/search-ended``.
"""

from __future__ import annotations

from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.words import spoken
from pipeline.records import Finding
from pipeline.settings.diagnosis import DiagnosisSettings
from pipeline.units import amount_unit


def too_large(bench: Workbench, conclusion: Conclusion, settings: DiagnosisSettings) -> tuple[Finding, ...]:
    """What would explain an unexplained specimen if it could be that large."""
    for explanation in conclusion.impossible[:1]:
        cause = explanation.impossible(bench.suspicion.causes, settings.impossible)
        if cause is None:
            break
        amount, std = explanation.amount(cause)
        size = amount_unit(cause.unit, amount, std).text(amount, std)
        times = abs(amount) / cause.plausible(bench.facts)
        message = (
            f"{spoken(cause.name)} would remove the misfit, but only at {size}, {times:.0f} times its usual size: it "
            "is something else, or scale, length or photos are wrong"
        )
        return (Finding("diagnosis/impossible-size", "warning", message),)
    return ()


def search_ended(conclusion: Conclusion) -> tuple[Finding, ...]:
    """That not everything was tried, where the search was ended."""
    if not conclusion.curtailed:
        return ()
    message = (
        "the search for causes was ended before all of them, and all pairs of them, were tried, it took too long: "
        "another cause or pair may explain the data better"
    )
    return (Finding("diagnosis/search-ended", "warning", message),)

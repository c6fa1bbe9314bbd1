"""Where what no cause explains sits, in words and numbers."""

from __future__ import annotations

from typing import Any

from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.fits.maps import whereabouts
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.evidence import something_else
from pipeline.diagnosis.words import spoken

WHERE = {"force": "in the forces", "chord": "in the chords", "shape": "in the shapes"}


def described(bench: Workbench, conclusion: Conclusion) -> dict[str, Any]:
    """What is likeliest to be something else, as `pipeline.result.DiagnosisPart` holds it.

    Returns
    -------
    dict
        ``message``, ``probability`` of something else, ``chi2`` of its pattern, ``noise`` (level of the photos' noise),
        ``share`` by kind of data, ``step`` and ``place`` (m) where it is strongest, and, where that step has a photo,
        the pattern ``shape_m`` over ``s_m``; ``spoken``: the loudest kind.
    """
    observation, fitted = bench.observation, bench.base if conclusion.accepted is None else conclusion.accepted.fitted
    field = something_else(conclusion.grid, fitted)
    found = whereabouts(observation, field)
    step = bench.test.steps[found.step]
    loudest = max(found.share, key=lambda kind: found.share[kind])
    place = "" if found.place is None or loudest != "shape" else f", most at s = {1e3 * found.place:.0f} mm"
    factor = observation.photo_noise.factor
    pattern = {} if found.s is None else {"shape_m": found.across, "s_m": found.s}
    return {
        "message": f"what is left sits {WHERE[loudest]}, strongest at step {step.step} ({step.branch}){place}",
        "probability": conclusion.posterior.total(something_else=True),
        "chi2": float(field @ field),
        "noise": "as stated" if factor == 1.0 else f"sections scatter {factor:.2f} times as much as stated",
        "share": found.share,
        "place": found.place,
        **pattern,
        "step": step.step,
        "spoken": spoken(loudest),
    }

"""Where what no cause explains sits, in words and numbers."""

from __future__ import annotations

from typing import Any

from pipeline.diagnosis.fits.maps import whereabouts
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.statistics.leftover import Leftover
from pipeline.diagnosis.words import spoken

WHERE = {"force": "in the forces", "chord": "in the chords", "shape": "in the shapes"}


def described(bench: Workbench, left: Leftover) -> dict[str, Any]:
    """The leftover as `pipeline.result.DiagnosisPart` holds it.

    Returns
    -------
    dict
        ``message``, ``p_value``, ``chi2``, ``fields`` (chi-square that noise puts there), ``excess``, ``noise`` (level
        of the photos' noise), ``share`` by kind of data, ``step`` and ``place`` (m) where it is strongest, and, where
        that step has a photo, the pattern ``shape_m`` over ``s_m``; ``spoken``: the loudest kind.
    """
    observation = bench.observation
    found = whereabouts(observation, left.field[: observation.rows.count])
    step = bench.test.steps[found.step]
    loudest = max(found.share, key=lambda kind: found.share[kind])
    place = "" if found.place is None or loudest != "shape" else f", most at s = {1e3 * found.place:.0f} mm"
    factor = observation.photo_noise.factor
    pattern = {} if found.s is None else {"shape_m": found.across, "s_m": found.s}
    return {
        "message": f"what is left sits {WHERE[loudest]}, strongest at step {step.step} ({step.branch}){place}",
        "p_value": left.p_value,
        "chi2": left.chi2,
        "fields": left.size,
        "excess": left.excess,
        "noise": "as stated" if factor == 1.0 else f"sections scatter {factor:.2f} times as much as stated",
        "share": found.share,
        "place": found.place,
        **pattern,
        "step": step.step,
        "spoken": spoken(loudest),
    }

"""Whether the steps of a force log follow each other as in a bending test: none doubled, missing or going back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from pipeline.records import Finding, LoadStep, doubtful


def order_findings(steps: Sequence[LoadStep], tolerance: float, *, name: str) -> Iterator[Finding]:
    """Contradictions between neighbouring steps.

    Parameters
    ----------
    steps : sequence of LoadStep
        In the order of the log.
    tolerance : float
        m, displacements that close are equal.
    name : str
        Of the log, for the messages.
    """
    for before, after in pairwise(steps):
        change = after.displacement_m - before.displacement_m
        place = {"file": name, "line": after.line, "step": after.step, "before": before.step}
        way = {"from_m": before.displacement_m, "to_m": after.displacement_m}
        if after.branch == before.branch and abs(change) <= tolerance:
            yield doubtful("steps/doubled.place", **place, **way)
        elif {"loading": -change, "unloading": change}.get(after.branch, 0.0) > tolerance:
            yield doubtful("steps/branch", branch=after.branch, **place, **way)
        if abs(after.step - before.step) > 1:
            yield doubtful("steps/missing", **place)
    for step in steps:
        if step.branch == "mounted" and abs(step.displacement_m) > tolerance:
            at = step.displacement_m
            yield doubtful("steps/branch.mounted", file=name, line=step.line, step=step.step, displacement_m=at)

"""Do the steps of a force log follow each other as those of a bending test do? Doubled, missing, on the wrong way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from pipeline.intake.noted import doubtful
from pipeline.records import Finding, LoadStep


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
        place = f"{name}, line {after.line}: step {after.step}"
        change = after.displacement_m - before.displacement_m
        way = f"from {before.displacement_m * 1e3:.4g} to {after.displacement_m * 1e3:.4g} mm"
        if after.branch == before.branch and abs(change) <= tolerance:
            yield doubtful("steps/doubled", f"{place} has the displacement of step {before.step}, it goes {way}")
        elif {"loading": -change, "unloading": change}.get(after.branch, 0.0) > tolerance:
            yield doubtful("steps/branch", f"{place} is called {after.branch}, but the displacement goes {way}")
        if abs(after.step - before.step) > 1:
            yield doubtful("steps/missing", f"{place} follows step {before.step}: steps between them are missing")
    for step in steps:
        if step.branch == "mounted" and abs(step.displacement_m) > tolerance:
            yield doubtful(
                "steps/branch",
                f"{name}, line {step.line}: step {step.step} is called mounted, but its displacement is "
                f"{step.displacement_m * 1e3:.4g} mm",
            )

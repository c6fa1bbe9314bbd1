"""What the simulation gets wrong, which cause explains it, what that is worth, and what to measure next.

`diagnose` turns a measured test into `pipeline.result.DiagnosisPart` and findings on the data; `explain` says in words
what a cause is. The recipe: measured noise first; score tests with a family-wise threshold; full refits of the confused
set; classes instead of forced names; pairs; what is left; the gain on held-out steps; blind spots; the next experiment.
"""

from __future__ import annotations

from pipeline.diagnosis.diagnose import diagnose, with_corrected_forces
from pipeline.diagnosis.words import explain

__all__ = ["diagnose", "explain", "with_corrected_forces"]

"""What the simulation gets wrong, which cause explains it, what that is worth, and what to measure next.

`diagnose` turns a measured test into `pipeline.result.DiagnosisPart` and findings; `explain` says in words
what a cause is. The recipe: measured noise first; scores of all causes about the base model; full refits of those that
matter, and of pairs; the probability of each hypothesis, "something else" included; classes instead of forced names;
the gain on held-out steps; blind spots; the next experiment.
"""

from __future__ import annotations

from pipeline.diagnosis.diagnose import Diagnosed, diagnose
from pipeline.diagnosis.words import explain

__all__ = ["Diagnosed", "diagnose", "explain"]

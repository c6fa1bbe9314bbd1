"""What was concluded about one specimen, before it is put into words."""

from __future__ import annotations

from dataclasses import dataclass, field

from pipeline.diagnosis.explanations.explanation import Explanation
from pipeline.diagnosis.explanations.pair_set import TwoCauses
from pipeline.diagnosis.statistics.leftover import Leftover


@dataclass(frozen=True, eq=False)
class Conclusion:
    """What was concluded, before it is put into words.

    Attributes
    ----------
    singles : list of Explanation
        Refitted single causes, most probable first.
    probability : list of float
        Of each.
    members : int
        How many of them form the set of names.
    accepted : Explanation or None
        What the model is extended by: the most probable single cause, or a pair.
    two : TwoCauses or None
        The pairs that the data cannot tell from the accepted one, which is the first; None for a single cause.
    left : Leftover
        Test of what the accepted model (or the base model) leaves.
    alien : bool
        Whether that exceeds noise and is no small share.
    instead : list of int
        Causes of pairs that may stand instead of a single cause of several forms.
    impossible : list of Explanation
        Single causes that would remove more than the accepted one, but only at a size that such a cause cannot have.
    curtailed : bool
        Whether the search for causes was ended before its end.
    """

    singles: list[Explanation]
    probability: list[float]
    members: int
    accepted: Explanation | None
    two: TwoCauses | None
    left: Leftover
    alien: bool
    instead: list[int] = field(default_factory=list)
    impossible: list[Explanation] = field(default_factory=list)
    curtailed: bool = False

    @property
    def names(self) -> list[int]:
        """Causes that form the set of names of a single cause, most probable first."""
        return list(dict.fromkeys([*(e.causes[0] for e in self.singles[: self.members]), *self.instead]))

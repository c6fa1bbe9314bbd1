"""How long a search for causes may go on.

Foreign data, or forms no catalogue has, leave every pair far above the noise: searches went on for minutes and found
nothing better. What is given up first is what the right names need least: further forms and pairs far down the lists.
Single causes and the best pairs are fitted in any case. The reader is told (`diagnose`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.diagnosis.observations.work import newton_steps


@dataclass(frozen=True)
class Effort:
    """Newton steps of this thread at which a search gives up; infinite for one that goes to its end.

    Steps and no seconds: the same data must give the same names on every machine.
    """

    end: float = np.inf

    @classmethod
    def of(cls, steps: int) -> Effort:
        """A search that begins now."""
        return cls(newton_steps() + steps)

    @property
    def spent(self) -> bool:
        """Whether nothing further may be begun."""
        return newton_steps() > self.end


TO_THE_END = Effort()

"""How long a search for two causes may go on.

Foreign data, or forms no catalogue has, leave every pair far above the noise: searches went on for minutes and found
nothing better. What is given up first is what the right names need least: exchanges of causes, then pairs far down the
linear list. Single causes, the two best pairs and everything after the search are never given up, and the reader is
told (`diagnose`).
"""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time

import numpy as np


@dataclass(frozen=True)
class Effort:
    """Processor time of this process, s, at which a search gives up; infinite for one that goes to its end."""

    end: float = np.inf

    @classmethod
    def of(cls, seconds: float) -> Effort:
        """A search that begins now."""
        return cls(process_time() + seconds)

    @property
    def spent(self) -> bool:
        """Whether nothing further may be begun."""
        return process_time() > self.end


TO_THE_END = Effort()

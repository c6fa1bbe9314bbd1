"""Way one: photos and forces to f_EI(K) and K0 by simulating the experiment (Sec. 4): see `rod.inverse.problem`."""

from rod.inverse.estimate import Estimate, InverseOutcome
from rod.inverse.problem import InverseOptions, estimate

__all__ = ["Estimate", "InverseOptions", "InverseOutcome", "estimate"]

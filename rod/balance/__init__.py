"""Way two: photos and forces to f_EI(K) and K0 by the balance equations (Sec. 5): see `rod.balance.graph`."""

from rod.balance.graph import BalanceGraph, BalanceOutcome, balance

__all__ = ["BalanceGraph", "BalanceOutcome", "balance"]

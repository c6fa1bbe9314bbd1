"""Numbers of the inverse problem, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class InverseOptions:
    """Numbers of the inverse problem, each with its reason.

    Attributes
    ----------
    elements : int
        Of the simulated rod: its error at 100 is 1e-4 of the force, a thirtieth of a load cell's.
    blocks : int
        Independent data of one photo at most, see `rod.midline`.
    grid : int
        Points of the reported curve.
    """

    elements: int = 100
    blocks: int = 160
    grid: int = 61

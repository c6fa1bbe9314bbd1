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
        Independent data of one photo at most, see `rod.inverse.whitening`.
    knots : (least, most)
        Numbers of control points tried.
    tau : (low, high)
        Range of the roughness of log f that is averaged over: from nearly straight to a change by a factor e^7.
    spare : int
        Control points more than the evidence asks for, at least; half as many as it asks for where that is more. A law
        that is not a spline is then still within the band: coverage 0.78 with none, 0.95 with two on stick-slip laws;
        on 36 laws with a kink, most of which ask for six and more, 0.84 with two of at most 8 control points, 0.89 with
        half of at most 12 (still less than it should be: a kink in the midst of noise looks like a smooth law).
    grid : int
        Points of the reported curve.
    evaluations : int
        Bound of one fit; ten are usual.
    invisible : float
        Standard deviation of log f beyond which a control point counts as not visible: a factor of 1.6.
    """

    elements: int = 100
    blocks: int = 160
    knots: tuple[int, int] = (3, 12)
    tau: tuple[float, float] = (0.05, 60.0)
    spare: int = 2
    grid: int = 61
    evaluations: int = 60
    invisible: float = 0.5

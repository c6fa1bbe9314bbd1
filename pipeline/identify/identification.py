"""The record of an identification: what both ways make of one test, and what was noticed on the way."""

from __future__ import annotations

from dataclasses import dataclass, field

from pipeline.identify.agreement import Agreement
from pipeline.records import Finding
from rod.balance import BalanceGraph
from rod.inverse import Estimate
from rod.measurement import MeasuredTest


@dataclass(frozen=True)
class Identification:
    """What both ways make of one test.

    Attributes
    ----------
    test : MeasuredTest
    inverse : Estimate
        All steps together.
    balance : BalanceGraph
    branches : dict of branch -> Estimate
        ``loading`` (with the force-free photo) and ``unloading`` apart, where the test has both.
    branches_p : float or None
        Probability of a difference between the branches as large as this if both had one characteristic.
    rest : (K0, std) or None
        Mean curvature of the force-free photo, 1/m.
    agreement : Agreement or None
    images : dict of step -> name of its photo
    findings : tuple of Finding
    """

    test: MeasuredTest
    inverse: Estimate
    balance: BalanceGraph
    branches: dict[str, Estimate] = field(default_factory=dict)
    branches_p: float | None = None
    rest: tuple[float, float] | None = None
    agreement: Agreement | None = None
    images: dict[int, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

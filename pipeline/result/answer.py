"""The answer of a result, decided here alone: which curve it is, why, and whether it may be used.

A fault of the data (a unit or sign of the force, photos of something else) makes numbers that fit and are none of the
cable's. They are told, but in no mean and no comparison. SI units, as in `pipeline.result.parts.Curve`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pipeline.messages import Message
from pipeline.result.diagnosed import DiagnosisPart
from pipeline.result.parts import AnswerPart, FindingPart, Method, WayPart
from pipeline.result.visited import Visited, html_table, visited

if TYPE_CHECKING:
    from pipeline.result.whole import Result


@dataclass(frozen=True, eq=False)
class Answer:
    """The answer of a result: everything that reads one number or curve out of a result reads it here.

    Attributes
    ----------
    usable : bool
        False where a fault of the data makes the numbers none of the cable's.
    said : Message
        Why it is this curve, or why it is not usable; `reason` in English.
    curve : Visited or None
        f_EI with its band and K0, over the curvatures that were visited; None if no way gave any.
    """

    usable: bool
    said: Message
    curve: Visited | None

    @property
    def reason(self) -> str:
        """Why it is this curve, or why it is not usable, in a sentence."""
        return str(self.said)

    @property
    def method(self) -> Method | None:
        """Which curve it is: ``extended``, ``inverse`` or ``balance``."""
        return None if self.curve is None else self.curve.method

    @property
    def pre_curvature_per_m(self) -> float | None:
        """K0, 1/m."""
        return None if self.curve is None else self.curve.pre_curvature

    @property
    def pre_curvature_std_per_m(self) -> float | None:
        """Standard deviation of K0, 1/m."""
        return None if self.curve is None else self.curve.pre_curvature_std

    def stored(self) -> AnswerPart:
        """What ``result.json`` keeps of it; the curve stands there under its method."""
        names = ("method", "usable", "pre_curvature_per_m", "pre_curvature_std_per_m")
        return AnswerPart(**{name: getattr(self, name) for name in names}, **AnswerPart.told(self.said))

    def _repr_html_(self) -> str:
        """Show the answer in a notebook."""
        return html_table("answer", self.told())

    def told(self) -> tuple[tuple[str, str], ...]:
        """The answer in words, by name."""
        which = "unusable" if not self.usable else self.method or "none"
        return (("answer", f"{which}: {self.reason}"), *(() if self.curve is None else self.curve.told()))


def curves(result: Result) -> dict[str, Visited]:
    """Visited parts of all characteristics of a result, by method."""
    ways: tuple[tuple[Method, WayPart | None], ...] = (("inverse", result.inverse), ("balance", result.balance))
    parts = [
        visited(method, way.curve, (way.pre_curvature_per_m, way.pre_curvature_std_per_m))
        for method, way in ways
        if way is not None
    ]
    parts.append(visited("extended", result.diagnosis.extended if result.diagnosis else None))
    return {part.method: part for part in parts if part is not None}


def refuted(diagnosis: DiagnosisPart | None) -> bool:
    """Whether the extended model leaves a misfit, too, and knows f_EI less well: its curve is no answer."""
    return diagnosis is not None and diagnosis.extended_refuted


def set_aside(result: Result) -> frozenset[str]:
    """Methods whose curve is not f_EI: those without the cause that was found, or an extended one that is refuted."""
    answering = result.answer.method
    if answering == "extended":
        return frozenset({"inverse", "balance"})
    return frozenset({"extended"}) if refuted(result.diagnosis) and answering is not None else frozenset()


def trusted(result: Result) -> dict[str, Visited]:
    """`curves` without an extended one that is `refuted`, unless nothing else was found."""
    parts = curves(result)
    kept = {method: part for method, part in parts.items() if method != "extended"}
    return kept if kept and refuted(result.diagnosis) else parts


def _best(result: Result) -> Visited | None:
    """The characteristic that answers: extended unless refuted, else inverse if its fit converged, else balance."""
    parts = trusted(result)
    fitted = result.inverse is not None and result.inverse.converged
    order = ("extended", "inverse", "balance") if fitted else ("extended", "balance", "inverse")
    return next((parts[method] for method in order if method in parts), None)


def leading(findings: Iterable[FindingPart]) -> FindingPart | None:
    """The fault of the data that is said before every number: an error, or a force of doubtful size; None without one.

    Why a way to f_EI was refused stands where its numbers would be, and an error of the program is none of the data.
    """
    faults = [f for f in findings if not f.code.startswith("identify/") and not f.code.endswith("/program-error")]
    first = (f for f in faults if f.level == "error")
    return next(first, next((f for f in faults if f.code == "size/force"), None))


OF_NO_CABLE = {"size/force", "length/other-cable", "photo/moving-apart"}
"""Findings after which f_EI is that of no cable, or of another, of whatever level: a diagnosis could not mend it."""


def answer_of(result: Result) -> Answer:
    """The answer of a result: as stored; of a result that stores none, or about to be stored, decided now."""
    stored = result.answer_
    if stored is not None:
        curve = None if stored.method is None else curves(result).get(stored.method)
        return Answer(stored.usable, stored.said, curve)
    curve = _best(result)
    fault = data_fault(result, curve)
    if curve is None:
        first = next((f.said for f in result.findings if f.level == "error"), Message("answer.none"))
        return Answer(False, fault or refusal(result) or first, None)
    return Answer(fault is None, fault or _why(result, curve.method), curve)


def refusal(result: Result) -> Message | None:
    """Why the first photo was refused, if all of them were."""
    photos = result.photos
    if not photos or not all(photo.reason for photo in photos):
        return None
    return Message("photos.one", image=photos[0].image, said=photos[0].said)


def _why(result: Result, method: str) -> Message:
    """Why a curve is the answer."""
    if method == "extended":
        unexplained = result.diagnosis is not None and result.diagnosis.verdict == "unexplained"
        return Message("answer.nearest" if unexplained else "answer.extended")
    if refuted(result.diagnosis):
        return Message("answer.refuted")
    if method == "inverse" and result.inverse is not None and result.inverse.converged:
        return Message("answer.inverse")
    return Message("answer.balance" if method == "balance" else "answer.only")


def data_fault(result: Result, curve: Visited | None) -> Message | None:
    """What makes the numbers of a result none of the cable's; None if nothing does.

    Faults that were left out or corrected (a photo of another step, a dead load cell, a sign turned midway) do not.
    """
    diagnosis = result.diagnosis
    turned = diagnosis is not None and any(part.factor < 0.0 for part in diagnosis.corrected_forces)
    wrong = OF_NO_CABLE if turned else OF_NO_CABLE | {"force/sign"}
    told = next((finding.said for finding in result.findings if finding.code in wrong), None)
    negative = curve is not None and float(np.mean(curve.tangent)) <= 0.0  # the cable would help to bend itself
    return told or (Message("fault.negative") if negative else None)

"""The diagnosis in plain words: verdict, headline, and the page of `cablebend explain`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from pipeline.diagnosis.causes import CATALOGUE, Cause
from pipeline.messages import PER, Message, entry, word
from pipeline.result import CausePart, CauseRow

Verdict = Literal["adequate", "named", "class", "two_causes", "unexplained", "underpowered"]


def verdict(*, found: bool, unmodelled: bool, classes: tuple[tuple[int, ...], ...], powerless: bool) -> Verdict:
    """The verdict, a word of contract.md.

    Parameters
    ----------
    found : bool
        A cause, or something else, is likelier than the base model.
    unmodelled : bool
        Something else is.
    classes : tuple of tuple of int
        Names in the place of each cause.
    powerless : bool
        Effects of plausible size would not have been seen either.
    """
    if unmodelled:
        return "unexplained"
    if not found:
        return "underpowered" if powerless else "adequate"
    if len(classes) > 1:
        return "two_causes"
    return "named" if len(classes[0]) == 1 else "class"


def headline(
    verdict: Verdict,
    *,
    causes: Sequence[CausePart],
    explained: float | None,
    change: float | None,
    beside: float,
    seen: Message,
    left: Message,
) -> Message:
    """One sentence.

    Parameters
    ----------
    verdict : Verdict
    causes : sequence of CausePart
        What was found, each with its class of names.
    explained : share or None
        Of the held-out excess misfit.
    change : relative or None
        Root mean square change of f_EI.
    beside : float
        Probability of something else besides, told where that is likelier than not.
    seen : Message
        What could have been seen, for ``adequate`` and ``underpowered``.
    left : Message
        Where the unexplained misfit sits.
    """
    if verdict in ("adequate", "underpowered"):
        return Message(f"diagnosis.{verdict}", seen=seen)
    if verdict == "unexplained":
        return Message("diagnosis.unexplained", left=left)
    found = [{"names": map(word, part.class_), "size": part.stated} for part in causes]
    shift = "" if change is None else Message("diagnosis.shift", change=change)
    effects = {
        "gain": "" if explained is None else Message("diagnosis.gain", share=min(explained, 1.0)),
        "shift": Message("diagnosis.beside", shift=shift, chance=beside) if beside >= 0.5 else shift,
    }
    if verdict == "class":
        return Message("diagnosis.class", first=word(causes[0].class_[0]), **found[0], **effects)
    told = [Message("diagnosis.cause", **cause) for cause in found]
    if verdict == "two_causes":
        return Message("diagnosis.two-causes", causes=told, **effects)
    return Message("diagnosis.named", cause=told[0], **effects)


def could_have_been_seen(seen: Sequence[CauseRow], total: int) -> Message:
    """What the data could have shown: the first three of the causes ``seen`` at a plausible size, of ``total``."""
    if not seen:
        return Message("diagnosis.seen-none", total=total)
    least = ((r, (r.detectable_in_any_form or r.minimal_detectable or 0.0, None, r.unit)) for r in seen[:3])
    such = [Message("diagnosis.from", cause=word(row.name), size=size) for row, size in least]
    return Message("diagnosis.seen", seen=len(seen), total=total, such=such)


def cause_by_name(name: str) -> Cause:
    """The class of a cause.

    Raises
    ------
    ValueError
        For an unknown name; the message lists the known ones.
    """
    for cause in CATALOGUE:
        if cause.name == name:
            return cause
    raise ValueError(f"unknown cause {name!r}; known are {', '.join(cause.name for cause in CATALOGUE)}")


PRE_CURVATURE = ("pre_curvature", "1/m", 0, "cable")
"""Part of the base model, so no class of the catalogue, but a name of the contract like the others."""


def explain(name: str, language: str = "en") -> str:
    """Page on one cause: what it is, what shows it, what it is confused with, what to do at the rig."""
    if name == PRE_CURVATURE[0]:
        _, unit, sign, seat = PRE_CURVATURE
    else:
        cause = cause_by_name(name)
        unit, sign, seat = cause.unit, cause.sign, cause.seat
    summary, amount, needs, apart, remedy = Message(f"cause.{name}").parts(language)
    page = Message(
        "explain.cause",
        title=name if language == "en" else f"{name}: {word(name).said(language)}",
        unit=unit.replace(" per ", PER[language]),
        sign="not-negative" if sign else "either-sign",
        summary=summary,
        amount=amount,
        seat=seat,
        needs=needs,
        apart=apart,
        remedy=remedy,
        settled=entry("settled", name),
    )
    return page.said(language) + "\n"

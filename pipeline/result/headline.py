"""The answer of a result in words: one sentence for the first screen, and a headline with what the diagnosis says.

A fault of the data comes before all numbers; numbers that are not usable are in no sentence.
"""

from __future__ import annotations

import math

from pipeline.messages import Message
from pipeline.result.answer import leading, refusal
from pipeline.result.visited import Visited
from pipeline.result.whole import Result


def opening(result: Result) -> Message:
    """f_EI at both ends of what the data determine and K0, after a fault; or why there is none to be used."""
    name, answer = result.specimen.id, result.answer
    if answer.curve is None:
        return _unmeasured(result)
    if not answer.usable:
        return Message("sentences", sentences=[Message("opening.unusable", id=name, reason=_brief(answer.said))])
    fault = leading(result.findings)
    lead = [] if fault is None else [_brief(fault.said)]
    curve = answer.curve
    rest = Message("opening.rest", K0_per_m=(curve.pre_curvature, curve.pre_curvature_std))
    return Message("sentences", sentences=[*lead, _range(name, curve), rest])


def headline(result: Result) -> Message:
    """The answer in one sentence, whether the ways agree, and what the diagnosis says."""
    curve, agreement, diagnosis = result.answer.curve, result.agreement, result.diagnosis
    said = [opening(result)]
    if curve is None or not result.answer.usable:
        return said[0]
    # both ways lack a cause that was found and is in the answer
    if agreement is not None and agreement.compatible is not None and curve.method != "extended":
        key = "opening.agree" if agreement.compatible else "opening.disagree"
        said.append(Message(key, rms=agreement.rms_relative))
    return Message("sentences", sentences=said if diagnosis is None else [*said, diagnosis.said])


def _unmeasured(result: Result) -> Message:
    name, refused, inverse = result.specimen.id, refusal(result), result.inverse
    if refused is not None:
        said = Message("opening.refused", id=name, count=len(result.photos), reason=refused)
        return Message("sentences", sentences=[said])
    faults = [finding.said for finding in result.findings if finding.level == "error"]
    other = inverse.said if inverse is not None and inverse.advice else result.answer.said
    return Message("sentences", sentences=[Message("opening.failed", id=name, reason=[*faults, other][0])])


def _range(name: str, curve: Visited) -> Message:
    if not curve.known:
        return Message("opening.unknown", id=name)
    (low, first, first_std), (high, last, last_std) = curve.ends()
    # a law is positive and its errors are relative ones: 1.3 +- 0.8 is far from 0.035 +- 0.002
    beyond = abs(math.log(last / first)) > 2.0 * math.hypot(first_std / first, last_std / last)
    return Message(
        "opening.constant" if not beyond else "opening.falls" if last < first else "opening.rises",
        id=name,
        first=(first, first_std, "N m^2", last),
        last=(last, last_std, "N m^2", first),
        low_per_m=low,
        high_per_m=high,
    )


def _brief(said: Message) -> Message:
    """What is wrong without the figures that show it: they stand with the finding."""
    reading = said.values.get("reading")
    return reading if isinstance(reading, Message) else said

"""The first screen in words: what f_EI is, how sure, whether the model was adequate, and what to do next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.report.words import Words
from pipeline.result import Result, leading, set_aside, trusted
from pipeline.result.answer import refusal
from pipeline.result.headline import opening
from pipeline.rounding import p_value

TONES = {"adequate": "good", "named": "warn", "class": "warn", "two_causes": "warn"}


@dataclass(frozen=True)
class FirstScreen:
    """The answer in a few sentences.

    Attributes
    ----------
    sentence : str
        f_EI and K0, or why there is none.
    agreement : str
        Whether the two ways agree.
    model : str
        Whether the simulation explains the data.
    advice : str
        What to do next.
    verdict, tone : str
        Label of the verdict and how to colour it: ``good``, ``warn`` or ``bad``.
    pre_curvatures : tuple of (way, value ± std)
    hidden : tuple of str
        What could hide in the data and would change f_EI by more than its band.
    doubt : str
        What the bands leave open.
    """

    sentence: str
    agreement: str
    model: str
    advice: str
    verdict: str
    tone: str
    pre_curvatures: tuple[tuple[str, str], ...]
    hidden: tuple[str, ...] = ()
    doubt: str = ""


def first_screen(result: Result, words: Words) -> FirstScreen:
    """The answer of a result in the language of the words."""
    diagnosis = result.diagnosis
    if result.status == "failed":
        verdict, tone = words("status_failed"), "bad"
    elif leading(result.findings) is not None or not result.answer.usable:
        verdict, tone = words("verdict_fault"), "bad"
    elif diagnosis is not None:
        verdict, tone = words(f"verdict_{diagnosis.verdict}"), TONES.get(diagnosis.verdict, "bad")
    else:
        verdict, tone = "", "warn"
    return FirstScreen(
        sentence=words.said(opening(result)).sentence,
        agreement=_agreement(result, words),
        model=words("model_unknown") if diagnosis is None else words.said(diagnosis.said).text,
        advice=_advice(result, words),
        verdict=verdict,
        tone=tone,
        pre_curvatures=tuple(
            (words.known(f"k0_{way}", way), words.measured(value, std))
            for way, (value, std) in pre_curvatures(result).items()
            if result.answer.usable or result.status == "failed"
        ),
        hidden=_hidden(result, words),
        doubt=words("band_unexplained") if diagnosis and diagnosis.verdict == "unexplained" else "",
    )


MOST_HIDDEN = 3
"""Lines on the first screen; all blind spots stand with the diagnosis."""


def _hidden(result: Result, words: Words) -> tuple[str, ...]:
    """Blind spots that would move f_EI, at a plausible size, farther than its band reaches; the worst first."""
    curve, diagnosis = result.answer.curve, result.diagnosis
    if curve is None or diagnosis is None or not result.answer.usable:
        return ()
    band = words.half_band * float(np.mean(curve.tangent_std / np.abs(curve.tangent)))
    worst = sorted(diagnosis.could_hide, key=lambda spot: -abs(spot.stiffness_bias_at_plausible_size))[:MOST_HIDDEN]
    beyond = (spot for spot in worst if abs(spot.stiffness_bias_at_plausible_size) > band)
    return tuple(words.blind_spot("hidden_row", spot) for spot in beyond)


def pre_curvatures(result: Result) -> dict[str, tuple[float, float | None]]:
    """K0 and its standard deviation, 1/m, by independent sources not set aside, then by the answer if it saw more."""
    found: dict[str, tuple[float, float | None]] = dict(result.agreement.pre_curvature) if result.agreement else {}
    for way, part in (("balance", result.balance), ("inverse", result.inverse)):
        if part is not None and part.pre_curvature_per_m is not None:
            found.setdefault(way, (part.pre_curvature_per_m, part.pre_curvature_std_per_m))
    found = {way: value for way, value in found.items() if way not in set_aside(result)}
    curve = result.answer.curve
    if curve is not None and (curve.method == "extended" or (curve.method == "inverse" and "photo" in found)):
        found["extended" if curve.method == "extended" else "all"] = curve.pre_curvature, curve.pre_curvature_std
    return found


WIDE = 0.5
"""Relative standard deviation of the difference of both ways at which its band reaches from nothing to double."""


def _agreement(result: Result, words: Words) -> str:
    """Difference of the two ways against what their errors lead to."""
    part, found = result.agreement, trusted(result)
    if part is None or part.rms_relative is None or not {"inverse", "balance"} <= found.keys():
        return words("agree_none")
    rms = words.number(100.0 * part.rms_relative, 2)
    if "extended" in found:
        return words("agree_without", rms=rms)
    one, two = found["inverse"], found["balance"]
    low, high = part.range_per_m or (max(one.kappa[0], two.kappa[0]), min(one.kappa[-1], two.kappa[-1]))
    grid = np.linspace(low, high, 50)
    mean = 0.5 * (np.interp(grid, one.kappa, one.tangent) + np.interp(grid, two.kappa, two.tangent))
    noise = np.hypot(np.interp(grid, one.kappa, one.tangent_std), np.interp(grid, two.kappa, two.tangent_std))
    expected = float(np.sqrt(np.mean((noise / mean) ** 2)))
    key = "agree_no" if not part.compatible else "agree_wide" if expected > WIDE else "agree_yes"
    chance = p_value(part.p_value or 0.0, decimal=words.decimal)
    return words(key, rms=rms, expected=words.number(100.0 * expected, 2), p=chance)


def _advice(result: Result, words: Words) -> str:
    """What to put right in the data, else the next experiment, else the warnings, else nothing."""
    if result.status == "failed":
        return words("next_refused" if refusal(result) else "next_failed")
    fault = leading(result.findings)
    remedy = words.code(fault.code) if fault is not None else None
    if fault is not None:
        return remedy[1] if remedy else words.said(fault.said).sentence
    if not result.answer.usable:
        return words("next_unusable")
    experiment = result.diagnosis.next_experiment if result.diagnosis else None
    if experiment is not None:
        names = ", ".join(words.cause(name) for name in experiment.separates)
        what = words.said(experiment.said).text
        what = what[:1].upper() + what[1:]
        key = "next_what" if len(experiment.separates) > 1 else "next_settles"
        return words(key, what=what, causes=names) if names else f"{what}."
    if any(finding.level != "info" for finding in result.findings):
        return words("next_findings")
    return words("next_none")

"""The word for what is believed."""

from __future__ import annotations

from typing import Literal

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

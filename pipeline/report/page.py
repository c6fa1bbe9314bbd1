"""What all pages share: the template engine, style sheets and scripts, colours as CSS variables.

Loads no drawing library: the index of ten thousand specimens is written by the process that hands out the work.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

TEMPLATES = Path(__file__).parent / "templates"

# role: (in light, in dark). The light colours differ in every role: they are how a role is found again in the SVG.
PALETTE = {
    "ink": ("#1c2127", "#e8eaed"),
    "muted": ("#5b6570", "#a3adb8"),
    "grid": ("#dfe3e8", "#343b44"),
    "paper": ("#fffffe", "#15191e"),
    "inverse": ("#0072b2", "#56b4e9"),
    "balance": ("#d55e00", "#f0a13c"),
    "extended": ("#009e73", "#2fd0a2"),
    "measured": ("#1b2026", "#f2f4f6"),
    "alarm": ("#b3261e", "#ff8a80"),
    "unvisited": ("#8a949f", "#77818c"),
}

BETWEEN = re.compile(
    r" (?=±)|(?<=±) |(?<=\d) (?=%|1/m|px|mm|µm|mN|N\b)|(?<=\b[ps]) (?=[<=])|(?<=[<=]) (?=\d)|(?<=N) (?=m(?![a-z]))"
)
"""Spaces inside a quantity: a number, its standard deviation and unit, a p value, units multiplied, a place s."""


def unbroken(value: Any) -> Any:
    """A text whose quantities no line break takes apart; markup and what is no text stay as they are."""
    return BETWEEN.sub("\u00a0", value) if isinstance(value, str) and not isinstance(value, Markup) else value


@cache
def environment() -> Environment:
    """Template engine of report and index: escapes everything, refuses names that do not exist."""
    engine = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=unbroken,
    )
    engine.filters["svg"] = lambda drawn: Markup(drawn.svg)
    return engine


def palette_css(colours: Mapping[str, tuple[str, str]] = PALETTE) -> Markup:
    """CSS variables of colours: light, dark by the reader's system, and light again on paper."""
    light = "".join(f"--{name}:{pair[0]};" for name, pair in colours.items())
    dark = "".join(f"--{name}:{pair[1]};" for name, pair in colours.items())
    return Markup(f":root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}")


def asset(name: str) -> Markup:
    """Style sheet or script of this project, put into the page as it is."""
    return Markup((TEMPLATES / name).read_text(encoding="utf-8"))

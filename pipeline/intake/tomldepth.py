"""How deep a TOML text nests, told before a parser sees it: text -> the line that goes too deep.

A parser keeps every level of a key ``a.a.a...`` as a table of its own and looks each of them up again, so 40 kB of dots
cost it gigabytes. The text is passed through once; strings and comments are stepped over as TOML writes them.
"""

from __future__ import annotations

import re

TOKEN = re.compile(
    r"""
    \"{3} (?: [^"\\] | \\. | "(?!"") )*+ (?: "{3,5} )?   # strings; without an end, to that of the line or text
    | '{3} (?: [^'] | '(?!'') )*+ (?: '{3,5} )?
    | " (?: [^"\\\n] | \\[^\n] )*+ "?
    | ' [^'\n]*+ '?
    | \# [^\n]*+
    | [.\[\]{}] | [=,\n]+
    """,
    re.VERBOSE | re.DOTALL,
)


def too_deep(text: str, most: int) -> int | None:
    """Line (from 1) of the first key of more than ``most`` parts or bracket inside so many others; None if none is."""
    brackets = parts = 1
    for found in TOKEN.finditer(text):
        token = found[0]
        if token == ".":
            parts += 1
        elif token in ("[", "{"):
            brackets, parts = brackets + 1, 1
        elif token in ("]", "}"):
            brackets, parts = brackets - 1, 1
        elif token[0] in "=,\n":
            parts = 1
        if parts > most or brackets > most + 1:
            return text.count("\n", 0, found.start()) + 1
    return None

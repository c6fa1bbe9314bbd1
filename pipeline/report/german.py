"""Sentences of rooms that have not moved to `pipeline.messages`, in German: vision, diagnosis, causes, outcomes of rod.

Those rooms write English and know no language. The catalogue in ``templates/german`` has the German twin of every such
sentence, under the sentence as it stands in the code with ``{}`` where a value goes. A sentence is recognised by its
fixed parts, what stands in the gaps is turned the same way (it may be a sentence, a cause or a number), and sentences
that were put together are taken apart again at their punctuation. What is not recognised stays English, and is said to
be so. Each room that moves takes its part of this away.

The test of this module walks the code: a new sentence without its German twin, or a twin nobody writes any more,
fails.
"""

from __future__ import annotations

import re
import string
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import pairwise
from pathlib import Path

CATALOGUE = Path(__file__).parent / "templates" / "german"
# Sentences end or begin so where others are joined to them; the same signs are stripped from the catalogue's.
EDGES = " ,;.:\n"
SEPARATORS = re.compile(r"(\n|; |: |, | and | or |\. | in | from | \(|\)|(?<=\d) (?=[a-z]))")
JOINED = {" and ": " und ", " or ": " oder ", " from ": " ab "}
# A decimal point between digits, but not in file names and versions.
DECIMAL = re.compile(r"(?<![\w./\\-])([-+]?\d+)\.(\d+)(?=(?:e[-+]?\d+)?(?!\.?\w|[/\\]))")
PERCENT = re.compile(r"(?<=\d)%")


@dataclass(frozen=True)
class Twin:
    """A sentence of the code and its German twin, both with ``{}`` where values go."""

    english: str
    german: str

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """Fixed parts of the English sentence, one more than it has gaps."""
        pieces = list(string.Formatter().parse(self.english))
        fixed = [piece[0] for piece in pieces]
        return tuple(fixed) if pieces[-1][1] is None else (*fixed, "")

    @cached_property
    def quoted(self) -> tuple[bool, ...]:
        """Gaps in quotation marks: what stands there is typed as it is."""
        return tuple(a.endswith('"') and b.startswith('"') for a, b in pairwise(self.parts))

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """The English sentence as a pattern with a group for each gap."""
        # Values side by side are single words: the place before a message is none of them.
        beside = [" " in pair for pair in pairwise(self.parts)]
        gaps = ["((?:(?!: ).)*?)" if narrow else "(.*?)" for narrow in beside]
        fixed = [re.escape(part) for part in self.parts]
        return re.compile("".join(part + gap for part, gap in zip(fixed, [*gaps, ""], strict=True)), re.DOTALL)

    def values(self, sentence: str) -> tuple[str, ...] | None:
        """What stands in the gaps of a sentence; None if it is not this one."""
        if not all(part in sentence for part in self.parts):  # cheap, and right for all but one in four hundred
            return None
        found = self.pattern.fullmatch(sentence)
        return found.groups() if found else None


def entries() -> Iterator[tuple[str, str]]:
    """English and German of the whole catalogue."""
    for file in sorted(CATALOGUE.glob("*.toml")):
        yield from tomllib.loads(file.read_text(encoding="utf-8")).items()


@cache
def _twins() -> tuple[dict[str, str], tuple[Twin, ...]]:
    """Sentences without gaps by their English text, and those with gaps, the longest fixed parts first."""
    whole: dict[str, str] = {}
    gapped = []
    for english, german in entries():
        twin = Twin(english, german)
        if len(twin.parts) == 1:
            whole[twin.parts[0]] = german.format()
        else:
            gapped.append(twin)
    return whole, tuple(sorted(gapped, key=lambda twin: -sum(map(len, twin.parts))))


def in_german(sentence: str, causes: dict[str, str]) -> tuple[str, bool]:
    """German twin of a stored sentence.

    Parameters
    ----------
    sentence : str
        As a room wrote it.
    causes : dict
        German names of the causes by their English ones.

    Returns
    -------
    str, bool
        The sentence, and whether it was recognised; if not, only its numbers were changed.
    """
    return _turned(sentence, tuple(sorted(causes.items())))


@lru_cache(maxsize=4096)  # the findings of a batch repeat themselves
def _turned(sentence: str, causes: tuple[tuple[str, str], ...]) -> tuple[str, bool]:
    known = _recognised(sentence, causes)
    if known is not None:
        return known, True
    runs = list(_runs(SEPARATORS.split(sentence), causes))
    # A word or two of German in an English sentence (of another version of the program) is neither.
    told_of = sum(_letters(text) for text, german, _ in runs if german is not None)
    if not told_of or 2 * told_of < _letters(sentence):
        return _comma(sentence), False
    told = [(_comma(text) if german is None else german) + JOINED.get(sign, sign) for text, german, sign in runs]
    return "".join(told), True


def _letters(text: str) -> int:
    return sum(sign.isalpha() for sign in text)


def _runs(tokens: list[str], causes: tuple[tuple[str, str], ...]) -> Iterator[tuple[str, str | None, str]]:
    """Pieces of text, separator, text, ...: each as long as the catalogue knows it, its German, and what follows it."""
    start = 0
    while start < len(tokens):
        for end in range(len(tokens), start, -2):
            text = "".join(tokens[start:end])
            german = _recognised(text, causes)
            if german is not None:
                break
        else:
            end, text, german = start + 1, tokens[start], None
        yield text, german, tokens[end] if end < len(tokens) else ""
        start = end + 1


def _recognised(text: str, causes: tuple[tuple[str, str], ...]) -> str | None:
    """German of exactly one sentence, name or word of the catalogue."""
    body = text.strip(EDGES)
    if not any(sign.isalpha() for sign in body):
        return None
    lead, tail = text[: text.find(body)], text[text.find(body) + len(body) :]
    other = body[0].swapcase() + body[1:]
    for form in (body, other):
        german = _exact(form, causes)
        if german is not None:
            began = form is body or body[0].islower()
            return f"{lead}{german if began else german[0].upper() + german[1:]}{tail}"
    return None


def _exact(body: str, causes: tuple[tuple[str, str], ...]) -> str | None:
    whole, gapped = _twins()
    names = dict(causes)
    if body in names:
        return names[body]
    if body in whole:
        return whole[body]
    for twin in gapped:
        values = twin.values(body)
        if values is not None:
            told = (
                value if word else _turned(value, causes)[0] for value, word in zip(values, twin.quoted, strict=True)
            )
            return twin.german.format(*told)
    return None


def _comma(text: str) -> str:
    """Numbers of a text with a decimal comma, and a blank before the percent sign."""
    return PERCENT.sub(" %", DECIMAL.sub(r"\1,\2", text))

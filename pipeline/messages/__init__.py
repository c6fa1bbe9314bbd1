"""Sentences of the program in every language it speaks: a key and named values in, a sentence out.

Whoever notices something makes a `Message`: which sentence it is, and the values that go into it, in SI units. The
sentences stand in the ``.toml`` files beside this module, English and German side by side under a key: the code of the
finding or error, and behind a dot which of its sentences, where it has several. Two texts are what is wrong and what to
do. A gap is written as in `str.format`; what may stand behind its colon:

``.3g mm``, ``.1f %``
    A number in that unit (mm, %), with the decimal sign of the language.
``± 1/m``
    A pair, value and standard deviation, in that unit.
``N``, ``N m²``
    A force or stiffness with the prefix that suits it; of a pair, value ± standard deviation.
``p``, ``plain``, ``plain1``
    A p value; a number to three significant digits, or to so many; ``curvature``, the end of a range in 1/m.
``word``
    A name used inside the program (a branch, a column) as one says it: the entry ``word.NAME``.
``amount``
    Value, standard deviation (or None) and unit, with the prefix that suits it, and further values that may follow.
``wrong``, ``capital``
    Of a message: what is wrong, without what to do; the message with a capital, as a German sentence after a colon has.
`` and ``
    Of a list: what stands between its last two parts, and a comma between the others; other signs stand between all;
    a comma, where nothing is said; a dot makes a sentence of each.

`rod` is a library and says itself, in English, how something ended: `ended` makes a message of that.
"""

from __future__ import annotations

import errno
import math
import string
import tomllib
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

from pipeline.rounding import p_value, plain, rounded
from pipeline.units import amount_unit, quantity

LONGEST = 600
"""Letters of a text that is quoted from a file: a line may have a million. What is cut is its middle."""
DECIMAL = {"en": ".", "de": ","}
PER = {"en": " per ", "de": " je "}
FACTORS = {"mm": 1e3, "µm": 1e6, "%": 1e2, "mN m²": 1e3, "°": 180.0 / math.pi, "1/m": 1.0, "N": 1.0, "": 1.0}
QUANTITIES = ("N", "N m²")
UNREADABLE = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)
"""What `Message.read` raises on values that do not fit: those of another version, or changed by somebody."""


@dataclass(frozen=True, init=False)
class Message:
    """One sentence without its words: which one it is, and what goes into it.

    Parameters
    ----------
    key : str
        Of the catalogue, such as ``log/empty`` or ``log/encoding.other-kind``; ``text`` for a sentence in English that
        stands in no catalogue, given as ``text``.
    **values : object
        Numbers in SI units, texts, paths, further messages, and lists of these.
    """

    key: str
    values: dict[str, Any]

    def __init__(self, key: str, /, **values: object) -> None:
        object.__setattr__(self, "key", key)
        given = values if key == "text" else {name: _plain(value) for name, value in values.items()}
        object.__setattr__(self, "values", given)

    def __hash__(self) -> int:
        return hash((self.key, str(self.values)))

    def __str__(self) -> str:
        return self.said()

    @property
    def code(self) -> str:
        """The key without what tells the sentences of a code apart."""
        return self.key.partition(".")[0]

    @property
    def english(self) -> bool:
        """Whether it is, or holds, a sentence that stands in no catalogue and is English in every language."""
        held = (part for value in self.values.values() for part in (value if isinstance(value, tuple) else (value,)))
        return self.key == "text" or any(isinstance(part, Message) and part.english for part in held)

    def said(self, language: str = "en") -> str:
        """The sentence in a language."""
        return "; ".join(self.parts(language))

    def parts(self, language: str = "en") -> tuple[str, ...]:
        """What is wrong and, where the catalogue has it, what to do."""
        if self.key == "text":
            return (str(self.values["text"]),)
        known = catalogue(language)
        texts = known[self.key] if language != "en" or self.key in known else _outcomes()[self.key]
        return tuple(_Gaps(language).vformat(text, (), self.values) for text in texts)

    def stored(self) -> dict[str, Any]:
        """The message as plain values for JSON."""
        return {"key": self.key, "values": {name: _stored(value) for name, value in self.values.items()}}

    @classmethod
    def read(cls, stored: Mapping[str, Any]) -> Message:
        """A message from `stored` values; one of `UNREADABLE` where they fit no sentence."""
        message = cls(stored["key"], **{name: _read(value) for name, value in stored["values"].items()})
        message.parts()
        return message


def free_text(text: str) -> Message:
    """A sentence in English that stands in no catalogue, as a message."""
    return Message("text", text=text)


def entry(kind: str, name: str) -> Message:
    """What the catalogue has of a name under ``kind.NAME``; the name with blanks where it has nothing."""
    return Message(f"{kind}.{name}") if f"{kind}.{name}" in catalogue("en") else free_text(name.replace("_", " "))


def word(name: str) -> Message:
    """A name used inside the program as one says it."""
    return entry("word", name)


def by_system(error: OSError) -> Message:
    """Why the operating system refused a file; in English alone where the catalogue does not have the reason."""
    key = f"system.{errno.errorcode.get(error.errno or 0)}"
    known = key in catalogue("en")
    return Message(key) if known else free_text((error.strerror or str(error) or type(error).__name__).lower())


def ended(outcome: Enum) -> Message:
    """How a solver, a fit or the balance ended, with its advice."""
    return Message(f"{_KINDS[type(outcome).__name__]}.{outcome.name.lower().replace('_', '-')}")


_KINDS = {"InverseOutcome": "inverse", "BalanceOutcome": "balance", "Outcome": "equilibrium"}


@cache
def _outcomes() -> dict[str, tuple[str, ...]]:
    """English of all outcomes, `rod`'s own."""
    from rod.balance import BalanceOutcome
    from rod.inverse import InverseOutcome
    from rod.newton import Outcome

    return {ended(one).key: (one.value,) for kind in (InverseOutcome, BalanceOutcome, Outcome) for one in kind}


@cache
def catalogue(language: str) -> dict[str, tuple[str, ...]]:
    """All sentences of a language by key: one text, or two where the second says what to do."""
    place = list(DECIMAL).index(language)
    rows = ((key, both[place]) for key, both in _sentences().items() if both[place])  # outcomes are English in `rod`
    return {key: (texts,) if isinstance(texts, str) else tuple(texts) for key, texts in rows}


@cache
def _sentences() -> dict[str, list[Any]]:
    files = sorted(Path(__file__).parent.glob("*.toml"))
    return {key: both for file in files for key, both in tomllib.loads(file.read_text(encoding="utf-8")).items()}


def sentence(text: str) -> str:
    """A text with a capital at its start, unless it starts with a file or a symbol."""
    first = text.split(maxsplit=1)[:1]
    plain_word = bool(first) and first[0].rstrip(",;:").isalpha() and first[0].islower()
    return f"{text[0].upper()}{text[1:]}" if plain_word else text


def shortened(text: str) -> str:
    """A text of at most `LONGEST` letters, cut in its middle."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 100]} ... {text[-95:]}"


def printable(text: str) -> str:
    """Text with line ends, control letters and bytes of a name that are no text written as Python does."""
    return "".join(c if c.isprintable() or unicodedata.category(c) == "Zs" else ascii(c)[1:-1] for c in text)


class _Gaps(string.Formatter):
    """Values of one language for the gaps of its sentences."""

    def __init__(self, language: str) -> None:
        self.language, self.decimal = language, DECIMAL[language]

    def format_field(self, value: Any, spec: str) -> str:
        """A value as the reader gets it; see the module for what ``spec`` may be."""
        if isinstance(value, Message):
            parts = value.parts(self.language)
            text = parts[0] if spec == "wrong" else "; ".join(parts)
            return sentence(text) if spec == "capital" else text
        if isinstance(value, str):
            return word(value).said(self.language) if spec == "word" else format(value, spec)
        if spec in QUANTITIES:
            number, std = value if isinstance(value, tuple) else (value, None)
            return quantity(number, spec, std, decimal=self.decimal)
        if isinstance(value, tuple) and spec[:1] == "±":
            std, number = (FACTORS[spec[2:]] * one for one in reversed(value))
            return f"{rounded(number, std, decimal=self.decimal)} {spec[2:]}"
        if isinstance(value, tuple):
            return self._amount(*value) if spec == "amount" else self._listed(value, spec)
        return self._number(value, spec)

    def _amount(self, number: float, std: float | None, unit: str, *alike: float) -> str:
        sizes = (number, *alike) if std is None else (number, std, *alike)
        shown = amount_unit(unit.replace(" per ", PER[self.language]), *sizes, decimal=self.decimal)
        return shown.plain(number, 2) if std is None else shown.text(number, std)

    def _listed(self, values: tuple[Any, ...], spec: str) -> str:
        texts = [self.format_field(value, "") for value in values]
        if spec == ".":
            return " ".join(f"{sentence(text).rstrip('.')}." for text in texts)
        if not spec.strip().isalpha():
            return (spec or ", ").join(texts)
        return spec.join([*([", ".join(texts[:-1])] if texts[1:] else []), *texts[-1:]])

    def _number(self, value: float, spec: str) -> str:
        form, _, unit = spec.partition(" ")
        number = FACTORS[unit] * value if unit else value
        if form == "p":
            text = p_value(number, decimal=self.decimal)
        elif form == "curvature":
            text = plain(number, 3, decimal=self.decimal, zeros=True)
        elif form.startswith("plain"):
            text = plain(number, int(form[5:] or 3), decimal=self.decimal)
        else:
            text = format(number, form).replace(".", self.decimal)
        return f"{text} {unit}".rstrip()


def _plain(value: Any) -> Any:
    """A value of one of the kinds that a message holds."""
    if value is None or isinstance(value, Message | bool):
        return value
    if isinstance(value, str | Path):
        return printable(shortened(str(value)))
    if isinstance(value, Iterable):
        return tuple(map(_plain, value))
    return value.item() if hasattr(value, "item") else value  # numpy's own numbers are none of JSON's


def _stored(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_stored(part) for part in value]
    return value.stored() if isinstance(value, Message) else value


def _read(value: Any) -> Any:
    if isinstance(value, list):
        return [_read(part) for part in value]
    return Message.read(value) if isinstance(value, dict) else value

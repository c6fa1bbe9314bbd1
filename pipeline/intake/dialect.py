"""How a force log is written: bytes -> lines of cells, numbers as the file's author meant them.

Encodings: UTF-8, UTF-16 and cp1252, with or without byte order mark. Separators: comma, semicolon, tab. Decimal point
or comma, decided once per file from all its numbers; thousands separators are read where they cannot be mistaken.
What could be read in two ways with different values is refused with the setting that decides.
"""

from __future__ import annotations

import codecs
import csv
import re
from array import array
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Literal

from pipeline.errors import InputError
from pipeline.intake.tomltable import shown
from pipeline.messages import Message

Decimal = Literal[".", ","]
Row = tuple[int, list[str]]  # line number from 1, cells

MOST_COLUMNS = 1000
"""In a line; what stands behind them is left as one cell."""
HEAD_CHARACTERS = 1_000_000
"""Of a log that are searched for its header, at most: a table of a thousand columns has a line of 20,000."""
SEPARATORS = ("\t", ";", ",")
MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
OTHER_FILES = {b"PK\x03\x04": "excel", b"\xd0\xcf\x11\xe0": "excel", b"%PDF": "pdf"}
"""First bytes of what is renamed to a table most often."""

POINT = re.compile(r"[+-]?(?:\d+|\d{1,3}(?:,\d{3})+)?(?:\.\d*)?(?:[eE][+-]?\d{1,3})?", re.ASCII)
COMMA = re.compile(r"[+-]?(?:\d+|\d{1,3}(?:\.\d{3})+)?(?:,\d*)?(?:[eE][+-]?\d{1,3})?", re.ASCII)
PLAIN = {".": re.compile(r"[+-]?\d+(?:\.\d+)?", re.ASCII), ",": re.compile(r"[+-]?\d+(?:,\d+)?", re.ASCII)}
LINE = re.compile(r".*\n?")
CLOCK_WITH_COMMA = re.compile(r"\d:\d\d,\d+$", re.ASCII)
INFINITE = ("inf", "-inf", "+inf", "infinity")
SHEET_ERRORS = ("#wert!", "#value!", "#div/0!", "#zahl!", "#num!", "#bezug!", "#ref!", "#name?", "#nv", "#n/a")
MISSING = frozenset(("", "-", "--", "---", "nan", "na", "n/a", "null", "none", *INFINITE, *SHEET_ERRORS))
DIGITS = frozenset("0123456789")
# Digit grouping by space or apostrophe, and the typographic minus sign
_SMOOTH = str.maketrans({" ": "", "\u00a0": "", "\u2009": "", "\u202f": "", "'": "", "’": "", "−": "-"})


def decode(data: bytes, encoding: str | None = None) -> tuple[str, str]:
    """Text of a force log and the encoding it was read in.

    UTF-16 without byte order mark shows as zero bytes at every other place; text that is not UTF-8 is taken as cp1252,
    the encoding of western Windows programs.

    Raises `InputError` ``log/encoding`` if the bytes are no text.
    """
    for begin, kind in OTHER_FILES.items():
        if data.startswith(begin):
            raise InputError(Message("log/encoding.other-kind", kind=kind))
    name = encoding or _guess(data)
    try:
        text = data.decode(name)
    except UnicodeDecodeError as error:
        raise InputError(Message("log/encoding")) from error
    # some programs fill their last block up, or end a text as CP/M did
    text = text.removeprefix("\ufeff").rstrip("\0\x1a")
    if "\0" in text:
        raise InputError(Message("log/encoding"))
    return text.replace("\r\n", "\n").replace("\r", "\n"), name


def _guess(data: bytes) -> str:
    for mark, name in MARKS:
        if data.startswith(mark):
            return name
    head = data[:2000]
    if len(head) >= 4 and len(head) % 2 == 0:
        even, odd = head[0::2].count(0), head[1::2].count(0)
        if odd > 0.4 * len(head) / 2 and even == 0:
            return "utf-16-le"
        if even > 0.4 * len(head) / 2 and odd == 0:
            return "utf-16-be"
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


@dataclass(frozen=True)
class Rows:
    """Lines of a log that are not blank, split into stripped cells whenever they are asked for.

    Line by line, so that a stray quotation mark cannot swallow the rest of the file. What is split is not kept: the
    cells of a million rows take ten times the memory of their text.

    Attributes
    ----------
    text, separator : str
    begins : array of int
        Where each row begins in the text.
    lines : array of int
        Its line, from 1.
    """

    text: str
    separator: str
    begins: array[int]
    lines: array[int]

    @classmethod
    def of(cls, text: str, separator: str) -> Rows:
        """All rows of a text."""
        begins, lines = array("q"), array("q")
        # one after the other: all lines at once take three times the memory of the text
        for number, line in enumerate(LINE.finditer(text), 1):
            if line[0].strip(" \t;,\n"):
                begins.append(line.start())
                lines.append(number)
        return cls(text, separator, begins, lines)

    def __len__(self) -> int:
        """Count of rows."""
        return len(self.begins)

    def __getitem__(self, place: int) -> Row:
        """Line number and cells of a row."""
        begin = self.begins[place]
        end = self.text.find("\n", begin)
        return self.lines[place], _cells(self.text[begin : None if end < 0 else end], self.separator)


def _cells(line: str, separator: str) -> list[str]:
    if '"' in line and len(line) < csv.field_size_limit():
        parts = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])[: MOST_COLUMNS + 1]
    else:
        parts = line.split(separator, MOST_COLUMNS)
    return [part.strip() for part in parts]


def head_rows(text: str, separator: str, most: int) -> list[Row]:
    """The first rows of a log, where its header is looked for."""
    rows = Rows.of(text[:HEAD_CHARACTERS], separator)
    return [rows[place] for place in range(min(most, len(rows)))]


def smooth(cell: str) -> str:
    """A number without grouping blanks, its minus sign an ASCII one in front: SAP writes ``1,2-``."""
    token = cell.translate(_SMOOTH)
    return f"-{token[:-1]}" if token[-1:] == "-" and token[:1].isdigit() else token


def is_missing(cell: str) -> bool:
    """True for the ways in which programs write "no value", infinity included."""
    return not cell or (cell[-1] not in DIGITS and cell.casefold() in MISSING)


def decimal_sign(
    forces: Sequence[str],
    travels: Sequence[str],
    others: Callable[[], Iterable[str]],
    *,
    separator: str,
    decimal: Decimal | None,
    farthest: float,
) -> Decimal:
    """The decimal sign of a file from all its number cells.

    Parameters
    ----------
    forces, travels : sequence of str
        Forces and displacements.
    others : callable
        Gives the remaining cells of the table. They are asked only where every force and displacement can be read both
        ways, and believed only where they agree.
    decimal : "." or ",", or None
        What the user says; it wins.
    farthest : float
        In the unit of the log. Asked last: displacements that as thousands would lie farther apart are fractions.

    Raises
    ------
    InputError
        ``log/ambiguous-decimal`` if both readings are possible and differ.
    """
    if decimal is not None:
        return decimal
    marked = [token for token in chain(forces, travels) if ("." in token or "," in token) and not is_missing(token)]
    if not marked or (separator == "," and not any("," in token for token in marked)):
        return "."
    point = comma = 0  # cells that are no number with a decimal point, with a decimal comma
    for token in map(smooth, marked):
        point += not _fits(POINT, token)
        comma += not _fits(COMMA, token)
    if bool(point) != bool(comma):
        return "," if point else "."
    if point:  # neither fits everywhere: the majority; the cells that do not fit are complained about one by one
        return "." if point <= comma else ","
    # Both fit: every one with a mark looks like 1,234 or 1.234, a thousand or a fraction
    told = {_decisive(cell) for cell in others()} - {None}
    if len(told) == 1:
        return "," if "," in told else "."
    mark: Decimal = "," if "," in marked[0] else "."
    as_thousands = [to_number(cell, "." if mark == "," else ",") for cell in travels]
    values = [value for value in as_thousands if value is not None]
    if values and max(values) - min(values) > farthest:
        return mark
    raise InputError(Message("log/ambiguous-decimal", number=repr(smooth(marked[0]))))


def _decisive(cell: str) -> Decimal | None:
    """The decimal sign that a cell of any column tells, None if it tells none.

    A clock with a comma is a German one; one with a point may stand in any file.
    """
    if CLOCK_WITH_COMMA.search(cell):
        return ","
    token = smooth(cell)
    point, comma = _fits(POINT, token), _fits(COMMA, token)
    return None if point == comma else "." if point else ","


def _fits(pattern: re.Pattern[str], token: str) -> bool:
    """True if the whole token is a number of that notation; a leading 0 group such as 0,500 is no thousand."""
    mark = "," if pattern is POINT else "."
    zero_group = mark in token and token.lstrip("+-").startswith("0")
    return bool(pattern.fullmatch(token)) and any(map(str.isdigit, token)) and not zero_group


def looks_like_number(cell: str) -> bool:
    """True for a number in either notation."""
    token = smooth(cell)
    return _fits(POINT, token) or _fits(COMMA, token)


def to_number(cell: str, decimal: Decimal) -> float | None:
    """Value of a cell; None if it is no number in this notation.

    Missing values (see `is_missing`) are not numbers: ask for them before.
    """
    if PLAIN[decimal].fullmatch(cell):  # nearly every cell of a long log: nothing to smooth, nothing grouped
        return float(cell.replace(",", "."))
    token = smooth(cell)
    if not _fits(POINT if decimal == "." else COMMA, token):
        return None
    plain = token.replace("," if decimal == "." else ".", "").replace(",", ".")
    return float(plain)


def decimals(cell: str, decimal: Decimal) -> int:
    """Digits behind the decimal sign: the resolution of the log."""
    if PLAIN[decimal].fullmatch(cell):
        return len(cell.partition(decimal)[2])
    mantissa, _, power = smooth(cell).casefold().partition("e")
    return len(mantissa.partition(decimal)[2]) - int(power or 0)


def column_names(cells: Sequence[str]) -> str:
    """The cells of a row for a message: at most ten, in quotes."""
    names = [shown(cell) for cell in cells if cell][:10]
    return ", ".join(names) or "–"

"""TOML files with known keys: text -> checked tables, every complaint with its line.

A table of keys says for each name which values it may hold; an unknown name is an error that gives the nearest known
one, because a misspelt key that is silently ignored costs a measurement. Used for ``specimen.toml`` and for settings.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.errors import Complaints, InputError
from pipeline.intake.access import LONGEST_PATH, read_bytes
from pipeline.intake.tomldepth import too_deep
from pipeline.messages import Message

Check = Callable[[Any], Any]
TWICE = re.compile("overwrite|twice|duplicate", re.IGNORECASE)  # in the words of the parser
HEADER = re.compile(r"\s*\[\[?([^\[\]]+)\]")

DEEPEST = 8
"""Parts of a key, or brackets inside each other; specimens and settings have three."""
NEAR = 0.6
"""Share of letters that a misspelt name and the one proposed for it have in common, in their order, at least."""
LONGEST_SHOWN = 60
"""Characters of a value or name in a message."""


@dataclass(frozen=True)
class TomlFile:
    """A parsed file: ``tables`` as `tomllib` gives them, ``lines`` to find where a key stands."""

    path: Path
    tables: dict[str, Any]
    lines: tuple[str, ...]

    def line_of(self, table: str, key: str | None = None) -> int | None:
        """Line (from 1) of a key of a table, or of the table's header; None if it is written some unusual way."""
        current = ""
        start = re.compile(rf"^\s*[\"']?{re.escape(key)}[\"']?\s*[=.]") if key is not None else None
        for number, line in enumerate(self.lines, 1):
            if header := HEADER.match(line):
                current = header[1].strip().strip("\"'")
                if start is None and current == table:
                    return number
            elif start is not None and current == table and start.match(line):
                return number
        return None

    def error(self, said: Message, *, table: str, key: str | None = None) -> InputError:
        """An `InputError` at the line of a key, or of the table that it names."""
        line = self.line_of(table, key) or self.line_of(".".join(filter(None, (table, key))))
        return InputError(said, path=self.path, line=line)


def read_toml(path: Path, *, limit: int) -> TomlFile:
    """Read and parse a TOML file.

    Raises `InputError` ``file/...`` as in `read_bytes`, ``toml/encoding`` if it is not UTF-8, ``toml/syntax`` if it is
    no TOML or nests deeper than ``DEEPEST``.
    """
    data = read_bytes(path, limit=limit, setting="toml_max_bytes")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise InputError(Message("toml/encoding"), path=path, line=line) from error
    text = text.replace("\r\n", "\n")
    lines = tuple(text.split("\n"))
    if (deep := too_deep(text, DEEPEST)) is not None:
        raise InputError(Message("toml/syntax.deep", levels=DEEPEST), path=path, line=deep)
    try:
        tables = tomllib.loads(text)
    except ValueError as error:  # besides TOMLDecodeError: integers of 5000 digits
        found = re.search(r"at line (\d+)", str(error))
        number = int(found[1]) if found else None
        shown = "" if number is None else f" ({lines[min(number, len(lines)) - 1].strip()[:60]!r})"
        key = "toml/syntax.twice" if TWICE.search(str(error)) else "toml/syntax"
        raise InputError(Message(key, shown=shown), path=path, line=number) from error
    return TomlFile(path, tables, lines)


def check_names(file: TomlFile, names: Collection[str], known: Collection[str], *, table: str = "") -> None:
    """Refuse unknown keys (``toml/unknown-key``) or, with ``table=""``, unknown tables (``toml/unknown-table``)."""
    wrong = Complaints()
    for name in names:
        if name in known:
            continue
        near = nearest(name, known)
        key = f"toml/unknown-{'key' if table else 'table'}{'' if near else '.far'}"
        told = Message(key, name=shown(name), table=table, near=near, known=known)
        wrong.note(file.error(told, table=table, key=name))
    wrong.settle()


def nearest(name: str, known: Collection[str]) -> str | None:
    """The known name that a misspelt one is near to, if any is; the order of ``known`` decides ties."""
    plain = name[:LONGEST_SHOWN].casefold()  # comparing takes the product of both lengths
    alike = {other: difflib.SequenceMatcher(None, plain, other.casefold()).ratio() for other in known}
    best = max(alike, key=alike.__getitem__)
    return best if alike[best] >= NEAR else None


def checked_table(file: TomlFile, table: str, checks: Mapping[str, Check]) -> dict[str, Any]:
    """Values of one table, each through its check; keys that are not given are absent.

    Raises `InputError` ``toml/unknown-key``, ``toml/wrong-value``.
    """
    values = file.tables.get(table, {})
    if not isinstance(values, dict):
        raise file.error(Message("toml/wrong-value.table", table=table), table="", key=table)
    wrong = Complaints()
    wrong.kept(check_names, file, values, tuple(checks), table=table)
    result, refused = {}, {}
    for key, value in ((key, value) for key, value in values.items() if key in checks):
        try:
            result[key] = checks[key](value)
        except ValueError as error:
            refused[key] = error.args[0]
    if refused:  # all of them at once: a template that was filled in halfway has several
        given = [f"{key} = {shown(values[key])}" for key in refused]
        told = Message("toml/wrong-value", given=given, wanted=dict.fromkeys(refused.values()))
        wrong.note(file.error(told, table=table, key=next(iter(refused))))
    wrong.settle()
    return result


def shown(value: Any) -> str:
    """A value of a file for a message, cut where it is long."""
    try:
        told = repr(value)
    except ValueError:  # an integer of more digits than Python writes, given in hexadecimal
        told = "..."
    return told if len(told) <= LONGEST_SHOWN else f"{told[: LONGEST_SHOWN - 3]}..."


# Checks: value -> value; a ValueError holds the message of what is wanted, as the object of "give ...".


def require(met: bool, wanted: str, /, **values: object) -> None:
    """Say what is wanted where a condition is not met."""
    if not met:
        raise ValueError(Message(wanted, **values))


def number(value: Any) -> float:
    """A finite number."""
    require(isinstance(value, int | float) and not isinstance(value, bool), "wanted.number")
    require(abs(value) <= 1e300, "wanted.finite")  # compares integers too large for a float as well
    return float(value)


def number_in(low: float, high: float, unit: str, si: float) -> Check:
    """A number within a range, times ``si`` as it leaves; outside, the unit is wrong."""

    def check(value: Any) -> float:
        given = number(value)
        require(low <= given <= high, "wanted.range", low=low, high=high, unit=unit)
        return given * si

    return check


def whole(low: int, high: int) -> Check:
    """An integer within a range."""

    def check(value: Any) -> int:
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        require(is_whole and low <= value <= high, "wanted.whole", low=low, high=high)
        return int(value)

    return check


def flag(value: Any) -> bool:
    """True or false."""
    require(isinstance(value, bool), "wanted.flag")
    return bool(value)


def text(value: Any) -> str:
    """A text that is not empty."""
    require(isinstance(value, str) and bool(value.strip()), "wanted.text")
    return str(value.strip())


def path_text(value: Any) -> str:
    """A text that can name a file."""
    name = text(value)
    require(len(name) <= LONGEST_PATH, "wanted.path", most=LONGEST_PATH)
    return name


def free_text(value: Any) -> str:
    """Anything a person may write as a note: texts, numbers, dates."""
    require(not isinstance(value, dict | list) and not (isinstance(value, int) and abs(value) > 1e300), "wanted.text")
    return str(value)


def one_of(*choices: str) -> Check:
    """One of a few words."""

    def check(value: Any) -> str:
        require(value in choices, "wanted.one-of", choices=[f'"{choice}"' for choice in choices])
        return str(value)

    return check

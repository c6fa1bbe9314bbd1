"""Which column of a force log is what: header cells -> roles and units.

Roles are ``step, branch, time, displacement, force, image``. English and German names are known; units stand in
the name (``Kraft [mN]``, ``F / N``, ``force_N``) or in a row of their own below it. Factors convert to
newton, metre and second.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

from pipeline.errors import InputError
from pipeline.intake.dialect import SEPARATORS, Rows, column_names, head_rows, looks_like_number
from pipeline.intake.specimenfile import MEASURED, ROLES, LogSpec
from pipeline.messages import Message

UNITS: dict[str, dict[str, float]] = {
    "force": {"N": 1.0, "mN": 1e-3, "cN": 1e-2, "daN": 10.0, "kN": 1e3, "MN": 1e6, "µN": 1e-6, "uN": 1e-6}
    | {"gf": 9.80665e-3, "kgf": 9.80665, "kp": 9.80665, "lbf": 4.4482216152605},
    "displacement": {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "µm": 1e-6, "um": 1e-6, "in": 25.4e-3, "inch": 25.4e-3},
    "time": {"s": 1.0, "sec": 1.0, "sek": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
}
ASSUMED = {"force": "N", "displacement": "mm", "time": "s"}
NAMES = {
    "step": "step|step no|step number|schritt|schritt nr|stufe|laststufe|hold|haltestufe|position nr",
    "branch": "branch|phase|direction|richtung|zweig|ast|belastungsrichtung",
    "time": "time|t|elapsed time|test time|timestamp|zeit|prüfzeit|pruefzeit|zeitstempel|uhrzeit|messzeit",
    "displacement": "displacement|travel|stroke|crosshead|crosshead displacement|position|extension|d|u|weg|"
    "verschiebung|traversenweg|standardweg|hub|kolbenweg|verfahrweg",
    "force": "force|load|reaction|reaction force|f|p|kraft|prüfkraft|pruefkraft|standardkraft|reaktionskraft|last|"
    "druckkraft",
    "image": "image|image file|picture|photo|file|filename|frame|bild|bilddatei|bildname|foto|datei|dateiname|aufnahme",
}
ROLE_OF = {name: role for role, names in NAMES.items() for name in names.split("|")}
# Names of units as they are spelled out, in small letters.
SPELLED = {"newton": "N", "newtons": "N", "millinewton": "mN", "kilonewton": "kN", "meter": "m", "metre": "m"} | {
    word: unit
    for unit, words in {
        "mm": "millimeter|millimeters|millimetre|millimetres",
        "s": "sekunde|sekunden|second|seconds|secs",
        "ms": "millisekunden|milliseconds",
        "min": "minuten|minutes",
        "h": "stunden|hours",
    }.items()
    for word in words.split("|")
}
TEMPERATURES = ("°c", "degc", "c", "k", "°f", "grad c", "deg c")
# A symbol behind the name, as in "Kraft F", "Verschiebung ux", and what was measured beside what was asked for
SYMBOL = re.compile(r"(?P<base>.*\S)\s+(?:[A-Za-z][A-Za-z]?|[A-Za-z]_\w|[Ii]st|[Aa]ctual)")
COMPONENT = re.compile(r"f[ _]?[xyz]", re.IGNORECASE)  # of a force, where a cell measures several
UNIT_IN_NAME = re.compile(
    r"(?P<base>.*?\S)\s*(?:\[(?P<square>[^\]]{0,40})\]|\((?P<round>[^)]{0,40})\)|"
    r"(?:/|\bin\b)\s{0,40}(?P<behind>[^\s/]{1,40}))\s*"
)  # without a bound on what a unit can be, a cell of brackets takes the square of its length
UNIT_AS_SUFFIX = re.compile(r"(?P<base>.*\S)[_\s](?P<unit>[^_\s]+)")
NO_UNIT = ("", "-", "1", "--")

HEAD = 300
"""Lines among which the header is looked for; the metadata blocks of testing machines have up to about 100."""


class LogUnit(NamedTuple):
    """Unit of a column: its name, SI units in it, and whether it was not given but is the usual one."""

    name: str
    factor: float
    assumed: bool


@dataclass(frozen=True)
class Columns:
    """Where the roles stand and how to convert them.

    ``index``: role -> column from 0. ``units``: role -> unit. ``header_line``, ``first_row``: line of the header, and
    index of the first row of data. ``width``: cells of the header.
    """

    index: dict[str, int]
    units: dict[str, LogUnit]
    separator: str
    header_line: int
    first_row: int
    skipped_lines: int
    width: int


def find_columns(text: str, spec: LogSpec) -> tuple[Columns, Rows]:
    """Find separator, header and meaning of the columns of a log, and all its rows that are not blank.

    What the user says (``spec``) wins over everything found. Raises `InputError` ``log/empty``, ``log/no-header``,
    ``log/no-column``, ``log/ambiguous-column``, ``log/unit``.
    """
    separators = (spec.separator,) if spec.separator else SEPARATORS
    heads = {separator: head_rows(text, separator, HEAD) for separator in separators}
    best: tuple[int, int, str] | None = None
    for separator, head in heads.items():
        if not head:
            raise InputError(Message("log/empty"))
        for row, (_, names) in enumerate(head):
            found = len(_roles(names, spec))
            if found > (best[0] if best else 1):
                best = found, row, separator
    if best is None:
        rows = max(heads.values(), key=lambda rows: len(rows[0][1]))
        # the columns may stand apart by what is no separator here
        apart = len(rows[0][1]) == 1 and re.search(r"\S(?:\s{2,}|\s*\|\s*)\S", rows[0][1][0])
        told = Message("log/no-header.apart" if apart else "log/no-header", first=column_names(rows[0][1]))
        raise InputError(told, line=rows[0][0])
    _, row, separator = best
    whole = Rows.of(text, separator)
    return _columns(whole, row, spec), whole


def _roles(header: list[str], spec: LogSpec) -> dict[str, list[int]]:
    """Columns that may be meant by each role; nothing if neither force nor displacement is among them.

    Columns given by number are for logs without a header: there the first row with numbers at these places is found.
    """
    found: dict[str, list[int]] = {}
    readings = [_readings(cell) for cell in header]
    bases = [surest for surest, *_ in readings]
    for less_sure in (1, 2):
        roles = zip(bases, (reading[less_sure] for reading in readings), strict=True)
        bases = [base or (role if role not in bases else None) for base, role in roles]
    for role in ROLES:
        if role in spec.columns:
            wanted = spec.columns[role]
            if isinstance(wanted, int):
                there = wanted <= len(header) and (role not in MEASURED or looks_like_number(header[wanted - 1]))
                places = [wanted - 1] if there else []
            else:
                plain = wanted.casefold().split()
                places = [place for place, cell in enumerate(header) if cell.casefold().split() == plain]
        else:
            places = [place for place, base in enumerate(bases) if base == role]
        if places:
            found[role] = places
    return found if {"force", "displacement"} & found.keys() else {}


def _readings(cell: str) -> tuple[str | None, str | None, str | None]:
    """Role of a header cell by its name, by what stands before a symbol, and as a component of a force."""
    if not any(map(str.isalpha, cell)):
        return None, None, None  # most of a log are numbers
    name, unit = _split_unit(cell)
    symbol = SYMBOL.fullmatch(name)
    return (
        _role(cell, name, unit),
        ROLE_OF.get(_plain(symbol["base"])) if symbol else None,
        "force" if COMPONENT.fullmatch(name) else None,
    )


def _role(cell: str, name: str, unit: str) -> str | None:
    """Role of a header cell by its name; a T in degrees is no time, and an s in mm is a way."""
    if name == "s" and unit in UNITS["displacement"]:
        return "displacement"
    role = ROLE_OF.get(_plain(cell)) or ROLE_OF.get(_plain(name))
    return None if role == "time" and unit.casefold() in TEMPERATURES else role


def _columns(rows: Rows, row: int, spec: LogSpec) -> Columns:
    line, header = rows[row]
    places = _roles(header, spec)
    for role in ("force", "displacement"):
        if role not in places:
            raise InputError(Message("log/no-column", role=role, names=column_names(header)), line=line)
    for role, where in places.items():
        if len(where) > 1:
            names = [header[place] for place in where]
            key = "log/ambiguous-column" if len(set(names)) > 1 else "log/ambiguous-column.same-name"
            raise InputError(Message(key, names=map(repr, names), role=role), line=line)
    index = {role: where[0] for role, where in places.items()}
    headless = isinstance(spec.columns.get("force"), int)
    below = rows[row + 1][1] if len(rows) > row + 1 else []
    unit_row = not headless and _is_unit_row(below, index)
    units: dict[str, LogUnit] = {}
    for role in (role for role in MEASURED if role in index):
        in_name = "" if headless else _split_unit(header[index[role]])[1]
        in_row = _bare(below[index[role]]) if unit_row else ""
        units[role] = unit_of(role, spec.units.get(role) or in_name or in_row, line)
    return Columns(
        index=index,
        units=units,
        separator=rows.separator,
        header_line=line,
        first_row=row + (0 if headless else 2 if unit_row else 1),
        skipped_lines=row,
        width=len(header),
    )


def unit_of(role: str, given: str, line: int | None) -> LogUnit:
    """The unit of a column as given; capitals matter (mN, MN) unless only one reading exists (KN, MM, SEC).

    Raises `InputError` ``log/unit``.
    """
    name, known = given or ASSUMED[role], UNITS[role]
    unit = SPELLED.get(name.casefold(), name).replace("μ", "µ")  # Greek mu and the micro sign look the same
    alike = {known[unit]} if unit in known else {known[one] for one in known if one.casefold() == unit.casefold()}
    if len(alike) == 1:
        return LogUnit(name, alike.pop(), not given)
    told = Message("log/unit", unit=repr(unit), role=role, usual=ASSUMED[role], known=known)
    raise InputError(told, line=line)


def _split_unit(cell: str) -> tuple[str, str]:
    """Name and unit of a header cell; the unit is empty if none is given."""
    if found := UNIT_IN_NAME.fullmatch(cell):
        unit = (found["square"] or found["round"] or found["behind"] or "").strip()
        return found["base"], "" if unit in NO_UNIT else unit
    if (found := UNIT_AS_SUFFIX.fullmatch(cell)) and _is_unit(found["unit"]):
        return found["base"], found["unit"]
    return cell, ""


def _is_unit(token: str) -> bool:
    return any(token.replace("μ", "µ") in known for known in UNITS.values())


def _is_unit_row(row: list[str], index: dict[str, int]) -> bool:
    """True for a row such as ``;;s;mm;[N];``: units or nothing in every cell, and at least one unit."""
    bare = [_bare(cell) for cell in row]
    units = [cell for cell in bare if cell not in NO_UNIT]
    return bool(units) and all(_is_unit(cell) for cell in units) and len(row) > max(index.values())


def _bare(cell: str) -> str:
    return cell.strip("[]() ")


def _plain(cell: str) -> str:
    """A name as it is compared: small letters, no punctuation, single blanks."""
    return " ".join(re.sub(r"[_.\-:#]+", " ", cell.casefold()).split())

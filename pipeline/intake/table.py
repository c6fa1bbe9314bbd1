"""Rows below the header of a force log -> the cells of each role, without what is no sample.

A header repeated on each page, and means and remarks below the table, are no samples. Of a row only the cells that have
a role are kept, and a cell that says what the one above it says is the same object: so a million rows take 200 MB.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass

from pipeline.errors import InputError
from pipeline.intake.columns import Columns
from pipeline.intake.dialect import Rows, is_missing
from pipeline.messages import Message

SUMMARY = re.compile(
    r"(mean|mittel(wert)?|average|avg|median|min(imum)?|max(imum)?|sum(me)?|total|gesamt|std|st\.?\s?dev|stddev|"
    r"standardabw(eichung|\.)?|stabw|spannweite|range|count|anzahl)\b.{0,40}",
    re.IGNORECASE,
)
"""First word of a row below the table, in a cell of its own."""


@dataclass(frozen=True)
class Table:
    """Rows of samples.

    Attributes
    ----------
    rows : Rows
        Of the whole log.
    places : array of int
        Which of them these are.
    cells : dict
        Role -> cells, one a row; empty where a row is too short.
    summary : tuple of int
        Lines of the rows below that are none.
    """

    rows: Rows
    places: array[int]
    cells: dict[str, list[str]]
    summary: tuple[int, ...] = ()

    @property
    def lines(self) -> array[int]:
        """Line of the log, from 1, of each row."""
        return array("q", (self.rows.lines[place] for place in self.places))

    def others(self, known: set[int]) -> Iterator[str]:
        """Cells of all other columns, read once more."""
        rows = (self.rows[place][1] for place in self.places)
        return (cell for cells in rows for place, cell in enumerate(cells) if place not in known)


def read_table(rows: Rows, columns: Columns) -> Table:
    """Split the rows below the header; raises `InputError` ``log/row-length``."""
    table, surplus = _split(rows, columns)
    end = _end_of_samples(table, columns)
    if surplus < end:
        line, cells = rows[table.places[surplus]]
        key = "log/row-length.comma" if columns.separator == "," else "log/row-length"
        raise InputError(Message(key, cells=len(cells), width=columns.width), line=line)
    summary = tuple(rows.lines[place] for place in table.places[end:])
    if not summary:
        return table
    return Table(rows, table.places[:end], {role: cells[:end] for role, cells in table.cells.items()}, summary)


def _split(rows: Rows, columns: Columns) -> tuple[Table, int]:
    """All rows but repeated headers, and the first row that has more cells than the header."""
    head = [cells for _, cells in map(rows.__getitem__, range(columns.first_row))]
    again = {tuple(cells) for cells in head if len(cells) >= columns.width}
    places, surplus = array("q"), len(rows)
    roles = [(place, list[str]()) for place in columns.index.values()]
    above = [""] * len(roles)
    for number in range(columns.first_row, len(rows)):
        _, cells = rows[number]
        if tuple(cells) in again:
            continue
        if surplus == len(rows) and any(cells[columns.width :]):
            surplus = len(places)
        places.append(number)
        for role, (place, column) in enumerate(roles):
            cell = cells[place] if place < len(cells) else ""
            if cell != above[role]:
                above[role] = cell
            column.append(above[role])
    return Table(rows, places, {role: column for role, (_, column) in zip(columns.index, roles, strict=True)}), surplus


def _end_of_samples(table: Table, columns: Columns) -> int:
    """Where means and remarks begin below the samples: no displacement, or the name of a mean in place of a number."""
    end = len(table.places)
    while end and _is_summary(table.rows[table.places[end - 1]][1], columns):
        end -= 1
    end = end or len(table.places)  # where all rows are called so, their cells are refused one by one
    own = [not is_missing(cell) for cell in table.cells["displacement"][:end]]
    full = max((row + 1 for row, there in enumerate(own) if there), default=0)
    # a displacement that stands only in the first row of each hold is missing above, too
    return full if all(own[:full]) and 2 * full > end else end


def _is_summary(cells: list[str], columns: Columns) -> bool:
    """Whether a row is called a mean, a sum or the like; a photo may have any name."""
    return any(SUMMARY.fullmatch(cell) for place, cell in enumerate(cells) if place != columns.index.get("image"))

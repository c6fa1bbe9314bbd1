"""Cells of a table that every spreadsheet reads, and none runs as a formula.

Text that would be taken for a formula gets an apostrophe in front (CWE-1236). Numbers have nine digits: below a
nanometre on a metre and beyond any band here.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain

FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n")


def neutral(cell: object) -> object:
    """Text that no spreadsheet takes for a formula or for the end of a row; anything but text unchanged."""
    if not isinstance(cell, str):
        return cell
    text = cell.replace("\r", " ")  # the writer quotes line feeds, but not a lone carriage return
    return f"'{text}" if cell.startswith(FORMULA_STARTS) else text


def _number(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.9g}"


def csv_lines(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> Iterator[str]:
    """Lines of a table, one row at a time; None and NaN are empty cells."""
    line = io.StringIO()
    writer = csv.writer(line, lineterminator="\n")
    for row in chain([heads], rows):
        writer.writerow([_number(cell) if isinstance(cell, float) else neutral(cell) for cell in row])
        yield line.getvalue()
        line.seek(0)
        line.truncate()

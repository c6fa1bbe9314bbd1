"""Units written in the cells of a force log, as in ``1.2 N``: taken out of them, and into the columns.

Only where every cell of a column has the same one, and the header no other: a single cell with a unit among bare
numbers is a mistake, and refused as no number.
"""

from __future__ import annotations

import re
from dataclasses import replace

from pipeline.errors import InputError
from pipeline.intake.columns import Columns, unit_of
from pipeline.intake.dialect import is_missing
from pipeline.intake.specimenfile import MEASURED
from pipeline.messages import Message

WITH_UNIT = re.compile(r"(?P<number>[-+−]?[\d.,\s'’]*\d(?:[eE][-+]?\d+)?)\s*(?P<unit>[^\W\d_]+)")


def without_units(
    table: dict[str, list[str]], columns: Columns, *, line: int | None
) -> tuple[dict[str, list[str]], Columns]:
    """Cells (role -> cells) without their units, and the columns with them; ``line``: the first one of the table.

    Raises `InputError` ``log/unit`` where the unit is not known, or the header says another.
    """
    for role in MEASURED:
        found = _split(table[role]) if role in table else None
        if found is None:
            continue
        cells, given = found
        try:
            unit, header = unit_of(role, given, line), columns.units[role]
        except InputError:
            if role == "time":  # ``8:00 AM``: such times are left out, the test is not
                continue
            raise
        if not header.assumed and unit.factor != header.factor:
            raise InputError(Message("log/unit.cells", header=header.name, cells=given), line=line)
        table = {**table, role: cells}
        columns = replace(columns, units={**columns.units, role: unit})
    return table, columns


def _split(cells: list[str]) -> tuple[list[str], str] | None:
    """Numbers of a column and the unit that stands in every cell that holds one; None if it does not."""
    bare, units = [], set()
    for cell in cells:
        if is_missing(cell):
            bare.append(cell)
            continue
        found = WITH_UNIT.fullmatch(cell)
        if found is None:
            return None
        bare.append(found["number"])
        units.add(found["unit"])
    return (bare, units.pop()) if len(units) == 1 else None

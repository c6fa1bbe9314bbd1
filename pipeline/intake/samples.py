"""Rows of a force log -> arrays of samples in SI units, with everything that was inferred or left out as findings.

Cells that hold no value are left out (a step number, branch or displacement that stands only in the first row of its
hold is carried down); cells that hold something else are refused with their line.
"""

from __future__ import annotations

import bisect
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.errors import InputError
from pipeline.intake.cellunits import without_units
from pipeline.intake.clock import clock_s, through_midnight
from pipeline.intake.columns import Columns
from pipeline.intake.dialect import Decimal, Rows, decimal_sign, decimals, is_missing, to_number
from pipeline.intake.specimenfile import LogSpec
from pipeline.intake.table import read_table
from pipeline.messages import Message
from pipeline.records import Array, Branch, Finding, doubtful, inferred

BRANCHES: dict[Branch, str] = {
    "mounted": "mounted|mount|force-free|start|montiert|eingebaut|kraftfrei|nullmessung",
    "loading": "loading|load|up|forward|push|belastung|belasten|laden|hin|auf|hub",
    "unloading": "unloading|unload|down|backward|back|return|entlastung|entlasten|zurück|rück|ab",
}
BRANCH_OF: dict[str, Branch] = {word: branch for branch, words in BRANCHES.items() for word in words.split("|")}

LARGEST = 1e9
"""N, mm, s or count; beyond any test, so a number that large is a slipped digit or damage."""

EPOCH_S = 1e7
"""Times beyond 115 days count from an epoch and are made relative."""


@dataclass(frozen=True)
class Samples:
    """Samples in the order of the log, one entry a row.

    Attributes
    ----------
    lines : (n,)
        Line of the log, from 1.
    forces, displacements : (n,) N, m
        Signs as in the log.
    times : (n,) s, or None
    steps : tuple of int or str, or None
        As written; None if the log has no such column.
    branches : tuple of Branch or None
    images : tuple of str
        Empty where the row names none.
    resolution : N
        Value of the last digit of the forces.
    """

    lines: Sequence[int]
    forces: Array
    displacements: Array
    times: Array | None
    steps: tuple[str, ...] | None
    branches: tuple[Branch, ...] | None
    images: tuple[str, ...]
    resolution: float
    findings: tuple[Finding, ...]

    def without(self, rows: Sequence[int]) -> Samples:
        """The samples without some rows; a photo named in one of them moves as from a row without a force."""
        kept = np.setdiff1d(np.arange(len(self.lines)), rows)
        images = _kept_images(self.images, [int(row) for row in kept], len(self.lines))
        return replace(
            self,
            lines=array("q", (self.lines[row] for row in kept)),
            forces=self.forces[kept],
            displacements=self.displacements[kept],
            times=None if self.times is None else self.times[kept],
            steps=None if self.steps is None else tuple(self.steps[row] for row in kept),
            branches=None if self.branches is None else tuple(self.branches[row] for row in kept),
            images=tuple(images[row] for row in kept),
        )


def read_samples(rows: Rows, columns: Columns, spec: LogSpec, *, length: float) -> tuple[Samples, Columns]:
    """Samples in the rows below the header, and the columns with the units that stand in the cells.

    The ``length`` (m) of the cable is farther than it was pushed. Raises `InputError` ``log/empty``,
    ``log/row-length``, ``log/ambiguous-decimal``, ``log/not-a-number``, ``log/branch``, ``log/unit``.
    """
    read = read_table(rows, columns)
    lines = read.lines
    table, columns = without_units(read.cells, columns, line=lines[0] if lines else None)
    force = table["force"]
    displacement, carried = _carry_down(table["displacement"])
    kept = array("q", (row for row, cell in enumerate(force) if not is_missing(cell) and displacement[row]))
    if not kept:
        raise InputError(Message("log/empty.no-row"))
    # columns that do not decide on the decimal sign: forces and displacements have, and step 1.2 is no number
    told = {columns.index[role] for role in ("force", "displacement", "step", "image") if role in columns.index}
    decimal = decimal_sign(
        force,
        displacement,
        lambda: read.others(told),
        separator=columns.separator,
        decimal=spec.decimal,
        farthest=length / columns.units["displacement"].factor,
    )
    numbers = _Numbers(decimal, columns, lines)
    steps = _carry_down(table["step"])[0] if "step" in table else []
    branches = _branches(table["branch"], lines) if "branch" in table else None
    times, noted = _times(table["time"], kept, numbers) if "time" in table else (None, [])
    images = _kept_images(table.get("image"), kept, len(lines))
    forces = numbers.column("force", force, kept)  # refuses what is no number, and has no decimals
    places = max(decimals(force[row], decimal) for row in kept)
    samples = Samples(
        lines=array("q", (lines[row] for row in kept)),
        forces=forces,
        displacements=numbers.column("displacement", displacement, kept),
        times=times,
        steps=tuple(steps[row] for row in kept) if any(steps) else None,
        branches=None if branches is None else tuple(branches[row] for row in kept),
        images=tuple(images[row] for row in kept),
        resolution=columns.units["force"].factor * 10.0 ** -min(max(places, -300), 300),
        findings=(*_losses(lines, force, carried, read.summary), *noted),
    )
    return samples, columns


def _losses(lines: Sequence[int], force: Sequence[str], carried: int, summary: Sequence[int]) -> list[Finding]:
    """Rows that are no samples, rows without a force, and displacements carried down."""
    findings = []
    if summary:
        findings.append(doubtful("log/summary", line=summary[0], count=len(summary)))
    empty = [row for row, cell in enumerate(force) if is_missing(cell)]
    if empty:
        first = lines[empty[0]]
        findings.append(doubtful("log/missing-force", count=len(empty), rows=len(force), line=first))
    if carried:
        findings.append(inferred("log/carried-down", count=carried))
    return findings


@dataclass(frozen=True)
class _Numbers:
    """Cells -> numbers of one file: notation, factors, and where to complain."""

    decimal: Decimal
    columns: Columns
    lines: Sequence[int]
    limit: float = LARGEST

    def value(self, role: str, cell: str, row: int) -> float:
        number = to_number(cell, self.decimal)
        if number is None or abs(number) > self.limit:
            key = "log/not-a-number" if number is None else "log/not-a-number.too-large"
            sign = "point" if self.decimal == "." else "comma"
            told = Message(key, role=role, cell=repr(cell[:40]), sign=sign)
            raise InputError(told, line=self.lines[row])
        return number

    def column(self, role: str, cells: Sequence[str], kept: Sequence[int]) -> Array:
        factor = self.columns.units[role].factor
        return np.fromiter((self.value(role, cells[row], row) * factor for row in kept), float, len(kept))


def _carry_down(cells: Sequence[str]) -> tuple[list[str], int]:
    """Cells with the gaps filled from above, and how many were filled."""
    filled, last, count = [], "", 0
    for cell in cells:
        if is_missing(cell):
            count += bool(last)
        else:
            last = cell
        filled.append(last)
    return filled, count


def _kept_images(cells: Sequence[str] | None, kept: Sequence[int], count: int) -> list[str]:
    """Photo names by row; a name in a row left out moves to the nearest row above that is kept, or else below."""
    images = ["" if cells is None or is_missing(cells[row]) else cells[row] for row in range(count)]
    for row in (row for row, name in enumerate(images) if name):
        place = bisect.bisect_left(kept, row)
        if place == len(kept) or kept[place] != row:
            nearest = kept[max(place - 1, 0)]
            images[nearest] = images[nearest] or images[row]
    return images


def _branches(cells: Sequence[str], lines: Sequence[int]) -> list[Branch] | None:
    """Branch of each row, or None if the column is empty."""
    filled, _ = _carry_down(cells)
    if not any(filled):
        return None
    first = next(cell for cell in filled if cell)
    branches = []
    for line, cell in zip(lines, filled, strict=True):
        branch = BRANCH_OF.get((cell or first).casefold())
        if branch is None:
            raise InputError(Message("log/branch", cell=repr(cell[:40])), line=line)
        branches.append(branch)
    return branches


def _times(cells: Sequence[str], kept: Sequence[int], numbers: _Numbers) -> tuple[Array | None, list[Finding]]:
    """Times of the kept rows in s, relative to the first if they are clock times or count from an epoch."""
    lines = numbers.lines
    empty = [row for row in kept if is_missing(cells[row])]
    if empty:
        level = inferred if len(empty) == len(kept) else doubtful
        return None, [level("log/missing-time", count=len(empty), line=lines[empty[0]])]
    clock = [time for row in kept if (time := clock_s(cells[row])) is not None]
    if len(clock) == len(kept):
        times = through_midnight(np.array(clock))
    elif not clock and not any(to_number(cells[row], numbers.decimal) is not None for row in kept):
        return None, [doubtful("log/time-format", cell=repr(cells[kept[0]][:40]))]
    else:
        wide = replace(numbers, limit=1e15)  # epochs in milliseconds have 13 digits
        times = wide.column("time", cells, kept)
    noted = []
    if clock or float(np.max(np.abs(times))) > EPOCH_S:
        noted.append(inferred("log/clock-time"))
        times = times - times[0]
    if np.any(np.diff(times) < 0.0):
        line = lines[kept[int(np.argmax(np.diff(times) < 0.0)) + 1]]
        return None, [doubtful("log/time-order", line=line)]
    return times, noted

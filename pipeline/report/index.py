"""``index.html`` and ``summary.csv``: all specimens of a batch, also of one that is not finished.

A specimen is a row of a few thousand bytes (`pipeline.result.row`), read from its ``entry.json``; from its result
only where there is no entry, or where the result has changed since. The page holds everything it needs: search,
filters and sorting over all rows, which are drawn as the reader scrolls to them; characteristics of selected
specimens laid over each other; repeat specimens of a type pooled. A failed specimen is a row with its reason and a
report that says what to do.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from pipeline.errors import InputError
from pipeline.intake.photos import natural_key
from pipeline.messages import Message
from pipeline.report.cells import csv_lines
from pipeline.report.files import write_atomic
from pipeline.report.page import asset, environment, palette_css, unbroken
from pipeline.report.repeats import Repeats, repeats, without_outlying
from pipeline.report.words import Words
from pipeline.result import SCHEMA, FindingPart, Result, SpecimenPart, read_result
from pipeline.result.diagnosed import CAUSES_NAMED
from pipeline.result.row import SHAPE_SIZE, STATUSES, IndexRow, from_entry, index_row
from pipeline.rounding import digits
from pipeline.settings.report import ReportSettings
from pipeline.units import Unit

BLOCK = 100
"""Rows that stand in the page as they are; all others are drawn as the reader scrolls to them, as many at a time."""

COPIED_S = 1.0
"""Of copies of a result and its entry either may be the later one by as much; a result changed by hand is later."""

HEAD, TAIL = 200, 40
"""Bytes of a ``result.json`` that tell whether it is one, and whole."""


def index_rows(out: Path, settings: ReportSettings) -> list[IndexRow]:
    """Rows of all results below a folder; those whose stiffness cannot be that of their type are not usable."""
    return without_outlying([_row_of(name, out, settings) for name in result_folders(out)])


def write_rows(rows: list[IndexRow], out: Path, settings: ReportSettings) -> tuple[Path, Path]:
    """Write ``index.html`` and ``summary.csv`` of rows into a folder; both paths."""
    page = write_atomic(out / "index.html", index_html(rows, settings))
    return page, write_atomic(out / "summary.csv", csv_lines(HEADS, map(_summed, rows)))


def result_folders(folder: Path) -> list[str]:
    """Folders below a folder that hold a result, relative to it, in the order in which people count."""
    found = []
    for top in (path for path in folder.iterdir() if not path.name.startswith(".")):
        for below, names, files in os.walk(top):  # what may not be read holds nothing for us
            names[:] = (name for name in names if not name.startswith("."))
            if "result.json" in files:
                found.append(Path(below).relative_to(folder).as_posix())
    return sorted(found, key=natural_key)


def _row_of(name: str, out: Path, settings: ReportSettings) -> IndexRow:
    """Row of a stored result: as its entry has it, else from the result."""
    place = out / name
    try:
        with (place / "entry.json").open("rb") as file:
            row, entered = from_entry(json.load(file).get("row")), os.fstat(file.fileno()).st_mtime
        if row.status != "failed" and _as_entered(place / "result.json", entered):
            report = f"{name}/report.html"
            return replace(row, report=report if (out / report).exists() else "")
    except (OSError, ValueError, AttributeError, RecursionError):
        pass  # none, or not ours: the result itself tells
    try:
        result = read_result(place)
    except InputError as error:
        finding = FindingPart.of("error", Message("result/unreadable.index", name=name, why=error.said))
        result = Result(status="failed", specimen=SpecimenPart(id=name, folder=name), findings=[finding])
    return replace(index_row(result), report=report_of(result, name, out, settings))


def _as_entered(path: Path, entered: float) -> bool:
    """Whether a ``result.json`` is still the one of ``entry.json``, by its time, its beginning and its end."""
    with path.open("rb") as file:
        status = os.fstat(file.fileno())
        head = file.read(HEAD)
        file.seek(max(0, status.st_size - TAIL))
        tail = file.read(TAIL)
    whole = head.lstrip()[:1] == b"{" and SCHEMA.encode() in head and tail.rstrip()[-1:] == b"}"
    return whole and status.st_mtime <= entered + COPIED_S


def report_of(result: Result, folder: str, out: Path, settings: ReportSettings) -> str:
    """Path of a report relative to the index, empty if there is none (yet).

    A specimen that failed may have left none (its process died, its description could not be read): it is drawn here.
    """
    path = out / folder / "report.html"
    if result.status == "failed" and path.parent.is_dir() and not path.exists():
        from pipeline.report.document import write_report  # matplotlib: for the few that need it

        write_report(result, path.parent, settings)
    return f"{folder}/report.html" if path.exists() else ""


def index_html(rows: list[IndexRow], settings: ReportSettings) -> Iterator[str]:
    """Text of ``index.html``, piece by piece: data of ten thousand rows are long."""
    words = Words.of(settings)
    means = [float(np.mean(row.curve.tangent)) for row in rows if row.curve and row.usable]
    unit = words.unit("N m²", float(np.median(means)) if means else 0.0)
    count = {status: sum(row.status == status for row in rows) for status in STATUSES}
    unusable = sum(row.state == "unusable" for row in rows)
    pooled = list(repeats(rows, unit, words))
    shown = {row.state for row in rows}
    # rows are drawn by a script too, from texts as they are; and narrow columns must break somewhere
    engine = environment().overlay(finalize=lambda value: value)
    page = engine.get_template("index.html").render(
        words=words,
        rows=[_cells(row, unit, words) for row in rows[:BLOCK]],
        unit=unbroken(unit.symbol),
        count=words("index_count", total=len(rows), **count),
        unusable=words("index_unusable", count=unusable) if unusable else "",
        verdicts=sorted(set(map(_verdict, rows))),
        types=sorted({row.type for row in rows if row.type}, key=natural_key),
        statuses=[state for state in (*STATUSES, "unusable") if state in shown],
        pooled=pooled,
        data=DATA,
        curves=CURVES,
        size=SHAPE_SIZE,
        palette=palette_css(),
        css=asset("page.css") + asset("index.css"),
        js=asset("page.js") + asset("index.js"),
    )  # fmt: skip
    before, _, after = page.rpartition(CURVES)  # a name may hold anything, and names stand before
    before, _, between = before.rpartition(DATA)
    yield before
    yield from _data(rows, pooled, unit, words)
    yield between
    yield from _list_of(_curve(row, unit) for row in rows)
    yield after


DATA, CURVES = (f"\N{OBJECT REPLACEMENT CHARACTER}{i}\N{OBJECT REPLACEMENT CHARACTER}" for i in ("data", "curves"))
"""Stand in the page where the data go. Curves are half of them and wait until some are to be drawn."""


def _verdict(row: IndexRow) -> str:
    """Verdict that the index shows: ``none`` where nothing was measured, ``fault`` where the data are not usable."""
    return {"unusable": "fault", "failed": "none"}.get(row.state, row.verdict)


def _cells(row: IndexRow, unit: Unit, words: Words) -> list[object]:
    """Texts of a row and the numbers it is sorted by, in the order in which the script of the page takes them."""
    ends = [(None, None) if end is None else end[1:] for end in (row.low, row.high)]
    # both ways lack a cause that was found and is in the answer: how far they differ says nothing
    rms = None if row.rms_relative is None or row.method == "extended" else 100.0 * row.rms_relative
    said = words.said(row.fault or row.reason or Message("text", text=""))
    state, verdict = row.state, _verdict(row)
    numbers: list[tuple[float | None, str]] = [(value, unit.number(value, std)) for value, std in ends]
    numbers.append((row.pre_curvature[0], words.measured(*row.pre_curvature)) if row.pre_curvature else (None, "–"))
    numbers.append((rms, "–" if rms is None else words.number(rms, 2)))
    return [
        *(row.id, quote(row.report), row.type, state, verdict),
        *(part for number in numbers for part in number),
        *(row.photos_used, f"{row.photos_used} / {row.photos_given}", row.warnings + row.errors),
        *(said.sentence if said.text else "", "" if said.language == words.language else said.language, row.shapes),
        _causes(row, words),
    ]


def _causes(row: IndexRow, words: Words) -> str:
    """The causes that were named, and the names that cannot be told from them; where none suffices, nothing."""
    if _verdict(row) not in CAUSES_NAMED:
        return ""
    named = f" {words('and')} ".join(words.cause(name) for name in row.causes)
    return f" {words('or')} ".join((named, *(words.cause(name) for name in row.twins)))


def _data(rows: list[IndexRow], pooled: list[Repeats], unit: Unit, words: Words) -> Iterator[str]:
    """The data of the page as JSON: first what belongs to all rows, then the cells of every row."""
    whole = {
        "axes": [words("axis_kappa"), words("axis_stiffness", unit=unit.symbol)],
        "decimal": words.decimal,
        "half": words.half_band,
        "block": BLOCK,
        "typed": any(row.type for row in rows),
        "size": SHAPE_SIZE,
        "words": {name: words(f"index_{name}") for name in ("shown", "select")}
        | {name: words(name) for name in ("shape_alt", "pooled_single", "pooled_mean", "pooled_scatter")},
        "states": {state: words(f"status_{state}") for state in (*STATUSES, "unusable")},
        "verdicts": {v: "–" if v == "none" else words(f"verdict_{v}") for v in sorted(set(map(_verdict, rows)))},
        "pooled": [_figure(entry, unit) for entry in pooled if entry.alt],
    }
    yield _json(whole)[:-1] + ',"cells":'
    yield from _list_of(_json(_cells(row, unit, words)) for row in rows)
    yield "}"


def _list_of(pieces: Iterable[str]) -> Iterator[str]:
    yield "["
    for number, piece in enumerate(pieces):
        yield f",{piece}" if number else piece
    yield "]"


def _json(value: Any) -> str:
    """JSON that neither ends a script nor is taken for a tag."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    for sign in "<>&'\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text


def _curve(row: IndexRow, unit: Unit) -> str:
    """Ends of the curvatures, f_EI in the unit of the page, and its standard deviation, to four digits."""
    if row.curve is None:
        return "null"
    parts = (row.curve.kappa[[0, -1]], unit.factor * row.curve.tangent, unit.factor * row.curve.tangent_std)
    return _json([digits(part, 4) for part in parts])


def _figure(entry: Repeats, unit: Unit) -> dict[str, Any]:
    """The mean of a type for its figure."""
    mean = entry.pooled
    parts = {"mean": mean.mean, "std": mean.std, "scatter": mean.scatter}
    scaled = {name: digits(unit.factor * values, 4) for name, values in parts.items()}
    return {"alt": entry.alt, "members": entry.members, "kappa": digits(mean.kappa, 4), **scaled}


HEADS = (
    *("id", "status", "usable", "verdict", "causes", "answer_method", "K0_per_m", "K0_std_per_m"),
    *("kappa_low_per_m", "f_EI_low_Nm2", "f_EI_low_std_Nm2", "kappa_high_per_m", "f_EI_high_Nm2", "f_EI_high_std_Nm2"),
    *("worst_finding", "reason", "type", "agreement_rms_relative", "compatible"),
    *("photos_used", "photos_given", "warnings", "errors", "report"),
)


def _summed(row: IndexRow) -> tuple[object, ...]:
    """A line of ``summary.csv``; nothing stands where nothing was measured."""
    none = (None, None, None)
    rest, ends = row.pre_curvature or (None, None), (*(row.low or none), *(row.high or none))
    told = (row.worst, str(row.fault or row.reason or ""), row.type, row.rms_relative, row.compatible)
    counts = (row.photos_used, row.photos_given, row.warnings, row.errors)
    about = (row.id, row.status, row.usable, row.verdict, ";".join(row.causes), row.method)
    return (*about, *rest, *ends, *told, *counts, row.report)

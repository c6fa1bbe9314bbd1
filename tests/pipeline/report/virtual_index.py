"""The index of a batch whose results need not be stored."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from pipeline.report.index import index_rows, report_of, write_rows
from pipeline.report.repeats import without_outlying
from pipeline.result import Result
from pipeline.result.row import index_row
from pipeline.settings import ReportSettings


def write_index(
    results: Iterable[Result] | Path, out: Path, settings: ReportSettings | None = None
) -> tuple[Path, Path]:
    """Write ``index.html`` and ``summary.csv`` over results, each with its files in ``out/<id>``, or over a folder."""
    settings = settings or ReportSettings()
    if isinstance(results, Path):
        return write_rows(index_rows(results, settings), out, settings)
    rows = [replace(index_row(r), report=report_of(r, r.specimen.id, out, settings)) for r in results]
    return write_rows(without_outlying(rows), out, settings)

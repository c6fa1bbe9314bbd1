"""``summary.csv``: a line a specimen, SI units in the names of the columns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pipeline.report.cells import csv_lines
from pipeline.result.row import IndexRow

HEADS = (
    *("id", "status", "usable", "verdict", "causes", "answer_method", "K0_per_m", "K0_std_per_m"),
    *("kappa_low_per_m", "f_EI_low_Nm2", "f_EI_low_std_Nm2", "kappa_high_per_m", "f_EI_high_Nm2", "f_EI_high_std_Nm2"),
    *("worst_finding", "reason", "type", "agreement_rms_relative", "compatible"),
    *("photos_used", "photos_given", "warnings", "errors", "report"),
)


def summary_lines(rows: Iterable[IndexRow]) -> Iterator[str]:
    """Lines of ``summary.csv``; nothing stands where nothing was measured."""
    return csv_lines(HEADS, map(_cells, rows))


def _cells(row: IndexRow) -> tuple[object, ...]:
    none = (None, None, None)
    rest, ends = row.pre_curvature or (None, None), (*(row.low or none), *(row.high or none))
    told = (row.worst, str(row.fault or row.reason or ""), row.type, row.rms_relative, row.compatible)
    counts = (row.photos_used, row.photos_given, row.warnings, row.errors)
    about = (row.id, row.status, row.usable, row.verdict, ";".join(row.causes), row.method)
    return (*about, *rest, *ends, *told, *counts, row.report)

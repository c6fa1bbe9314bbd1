"""The tables beside the report, as any spreadsheet or program reads them: comma, decimal point, UTF-8, SI units.

``characteristic.csv``, ``beam_table.csv`` and ``centerlines.csv`` are fixed by the contract; ``simulation.csv`` has
constants with errors. Text that a spreadsheet would run as a formula is disarmed, see `cells`.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from pipeline.report.cells import csv_lines
from pipeline.report.files import write_atomic
from pipeline.report.frames import beam_frame, centerlines_frame, characteristic_frame, simulation_frame
from pipeline.result import Result, to_json
from pipeline.settings import ReportSettings


def write_result(result: Result, folder: Path) -> Path:
    """Write ``result.json``, at once or not at all."""
    return write_atomic(Path(folder) / "result.json", to_json(result))


def write_tables(result: Result, folder: Path, settings: ReportSettings | None = None) -> tuple[Path, ...]:
    """Write the tables of a result into a folder; a failed specimen gets tables with heads only."""
    bounds = (settings or ReportSettings()).equivalent_range_per_m
    frames = {
        "characteristic.csv": characteristic_frame(result),
        "centerlines.csv": centerlines_frame(result),
        "beam_table.csv": beam_frame(result),
        "simulation.csv": simulation_frame(result, bounds),
    }
    return tuple(write_csv(frame, Path(folder) / name) for name, frame in frames.items())


def write_csv(frame: pd.DataFrame, path: Path) -> Path:
    """Write a table, at once or not at all."""
    return write_atomic(path, csv_text(frame))


def csv_text(frame: pd.DataFrame) -> str:
    """Text of a table, safe to open in a spreadsheet."""
    return "".join(csv_lines(list(map(str, frame)), frame.itertuples(index=False, name=None)))

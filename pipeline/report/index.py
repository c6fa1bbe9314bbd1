"""``index.html`` and ``summary.csv``: all specimens of a batch, also of one that is not finished.

Results are read one by one and only a row of each is kept, so memory does not grow with photos: some kilobytes a
specimen. The page holds everything it needs: search, filters, sorting, characteristics of selected specimens laid
over each other, repeat specimens of a type pooled. A failed specimen is a row with its reason and a report that says
what to do.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.intake.photos import natural_key
from pipeline.report.document import asset, environment, palette_css, write_report
from pipeline.report.figures import band_width
from pipeline.report.files import write_atomic
from pipeline.report.repeats import repeats
from pipeline.report.tables import write_csv
from pipeline.report.words import Words
from pipeline.result import FindingPart, Result, SpecimenPart, from_json
from pipeline.settings import ReportSettings
from pipeline.units import Unit, suited
from pipeline.visited import Visited, best, pre_curvature

SHAPE_POINTS = 14
SHAPE_SIZE = (110.0, 40.0)


@dataclass(frozen=True)
class IndexRow:
    """What the index keeps of a specimen; SI units."""

    id: str
    report: str
    type: str
    status: str
    verdict: str
    curve: Visited | None
    pre_curvature: tuple[float, float | None] | None
    rms_relative: float | None
    compatible: bool | None
    photos_used: int
    photos_given: int
    warnings: int
    errors: int
    reason: str
    shapes: str


def index_row(result: Result, report: str, settings: ReportSettings) -> IndexRow:
    """Row of one result; ``report`` is the path of its report relative to the index, empty if there is none."""
    curve = best(result)
    troubles = [f for f in result.findings if f.level == "error"] + [f for f in result.findings if f.level == "warning"]
    return IndexRow(
        id=result.specimen.id,
        report=report,
        type=result.specimen.description.get("type", ""),
        status=result.status,
        verdict=result.diagnosis.verdict if result.diagnosis else "none",
        curve=_thinned(curve, settings.index_curve_points),
        pre_curvature=pre_curvature(result, curve) if curve else None,
        rms_relative=result.agreement.rms_relative if result.agreement else None,
        compatible=result.agreement.compatible if result.agreement else None,
        photos_used=sum(photo.status == "traced" for photo in result.photos),
        photos_given=len(result.photos),
        warnings=sum(f.level == "warning" for f in result.findings),
        errors=sum(f.level == "error" for f in result.findings),
        reason=troubles[0].message if troubles else "",
        shapes=_shapes(result),
    )


def _thinned(curve: Visited | None, points: int) -> Visited | None:
    """The same curve on fewer points."""
    if curve is None or curve.kappa.size <= points:
        return curve
    grid = np.linspace(curve.kappa[0], curve.kappa[-1], points)

    def onto(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.interp(grid, curve.kappa, values)

    return Visited(
        method=curve.method,
        kappa=grid,
        moment=onto(curve.moment),
        moment_std=onto(curve.moment_std),
        tangent=onto(curve.tangent),
        tangent_std=onto(curve.tangent_std),
        secant=onto(curve.secant),
        secant_std=onto(curve.secant_std),
        factor=np.column_stack([np.zeros((points, 0)), *map(onto, curve.factor.T)]),
    )


def _shapes(result: Result) -> str:
    """SVG path of all measured shapes in the chord frame, to one scale, bow downwards."""
    traced = [photo for photo in result.photos if len(photo.x_m) > 1]
    width = max((max(photo.x_m) for photo in traced), default=0.0)
    if width <= 0.0:
        return ""
    scale = (SHAPE_SIZE[0] - 4.0) / width
    parts = []
    for photo in traced:
        chosen = np.linspace(0, len(photo.x_m) - 1, SHAPE_POINTS).round().astype(int)
        parts.append("M" + "L".join(f"{2 + scale * photo.x_m[i]:.0f} {4 + scale * photo.y_m[i]:.1f}" for i in chosen))
    return "".join(parts)


def read_results(folder: Path) -> Iterator[tuple[Result, str]]:
    """Results below a folder one by one, each with its folder relative to it; an unreadable one counts as failed."""
    names = (path.parent.relative_to(folder).as_posix() for path in folder.glob("*/**/result.json"))
    for name in sorted((name for name in names if not re.search(r"(^|/)\.", name)), key=natural_key):
        path = folder / name / "result.json"
        try:
            yield from_json(path.read_text(encoding="utf-8")), name
        except (ValueError, OSError) as error:
            yield unreadable(path, name, error), name


def unreadable(path: Path, name: str, error: Exception) -> Result:
    """A failed result in the place of a ``result.json`` that cannot be read."""
    reason = f"{path.name} of {name} cannot be read ({type(error).__name__}); run the specimen again."
    return Result(
        status="failed",
        specimen=SpecimenPart(id=name, folder=name, moving_bearing=""),
        findings=[FindingPart(code="result/unreadable", level="error", message=reason)],
    )


def write_index(
    results: Iterable[Result] | Path, out: Path, settings: ReportSettings | None = None
) -> tuple[Path, Path]:
    """Write ``index.html`` and ``summary.csv`` over all results.

    Parameters
    ----------
    results : iterable of Result, or Path
        Results, each with its files in ``out/<id>``; or the folder to look for ``result.json`` in.
    out : Path
        Folder of the index.
    settings : ReportSettings, optional

    Returns
    -------
    (Path, Path)
        index.html, summary.csv.
    """
    settings, out = settings or ReportSettings(), Path(out)
    pairs = read_results(Path(results)) if isinstance(results, str | Path) else ((r, r.specimen.id) for r in results)
    rows = [index_row(result, _report(result, folder, out, settings), settings) for result, folder in pairs]
    page = write_atomic(out / "index.html", index_html(rows, settings))
    return page, write_csv(summary_frame(rows), out / "summary.csv")


def _report(result: Result, folder: str, out: Path, settings: ReportSettings) -> str:
    """Path of a report relative to the index, empty if there is none (yet).

    A specimen that failed may have left none (its process died, its description could not be read): it is drawn here.
    """
    path = out / folder / "report.html"
    if result.status == "failed" and path.parent.is_dir() and not path.exists():
        write_report(result, path.parent, settings)
    return f"{folder}/report.html" if path.exists() else ""


def summary_frame(rows: list[IndexRow]) -> pd.DataFrame:
    """One row a specimen; SI units in the column names."""
    table = []
    for row in rows:
        curve = row.curve
        value, std = row.pre_curvature or (None, None)
        ends = (
            [None] * 6
            if curve is None
            else [v[i] for i in (0, -1) for v in (curve.kappa, curve.tangent, curve.tangent_std)]
        )
        counts = (row.photos_used, row.photos_given, row.warnings, row.errors)
        answers = (*ends, value, std, row.rms_relative, row.compatible)
        table.append([row.id, row.type, row.status, row.verdict, *answers, *counts, row.reason, row.report])
    names = ["id", "type", "status", "verdict"]
    names += [f"{end}_{name}" for end in ("low", "high") for name in ("kappa_per_m", "tangent_Nm2", "tangent_std_Nm2")]
    names += ["pre_curvature_per_m", "pre_curvature_std_per_m", "agreement_rms_relative", "compatible"]
    names += ["photos_used", "photos_given", "warnings", "errors", "reason", "report"]
    return pd.DataFrame(table, columns=names)


def index_html(rows: list[IndexRow], settings: ReportSettings) -> str:
    """Text of ``index.html``."""
    words = Words(settings.language)
    usable = [(row.type, row.curve) for row in rows if row.type and row.curve]
    unit = suited((v for row in rows if row.curve for v in row.curve.tangent), "N m²", decimal=words.decimal)
    count = {status: sum(row.status == status for row in rows) for status in ("measured", "partial", "failed")}
    return (
        environment()
        .get_template("index.html")
        .render(
            words=words,
            rows=[_cells(row, unit, words) for row in rows],
            unit=unit.symbol,
            count=words("index_count", total=len(rows), **count),
            verdicts=sorted({row.verdict for row in rows}),
            types=sorted({row.type for row in rows if row.type}),
            statuses=[status for status, number in count.items() if number],
            pooled=repeats(usable, unit, words, settings),
            data=_overlay_data(rows, unit, words, settings),
            size=SHAPE_SIZE,
            palette=palette_css(),
            css=asset("page.css") + asset("index.css"),
            js=asset("page.js") + asset("index.js"),
        )
    )


def _cells(row: IndexRow, unit: Unit, words: Words) -> dict[str, object]:
    """Texts of a row and the numbers it is sorted by."""
    curve = row.curve
    ends = (
        [(None, None), (None, None)] if curve is None else [(curve.tangent[i], curve.tangent_std[i]) for i in (0, -1)]
    )
    rms = None if row.rms_relative is None else 100.0 * row.rms_relative
    return {
        "id": row.id,
        "href": quote(row.report),
        "type": row.type,
        "status": row.status,
        "verdict": row.verdict,
        "low": (ends[0][0], unit.number(*ends[0])),
        "high": (ends[1][0], unit.number(*ends[1])),
        "k0": (row.pre_curvature[0], words.measured(*row.pre_curvature)) if row.pre_curvature else (None, "–"),
        "rms": (rms, "–" if rms is None else words.number(rms, 2)),
        "compatible": row.compatible,
        "photos": f"{row.photos_used} / {row.photos_given}",
        "photos_used": row.photos_used,
        "troubles": row.warnings + row.errors,
        "reason": words.said(row.reason),
        "shapes": row.shapes,
    }


def _overlay_data(rows: list[IndexRow], unit: Unit, words: Words, settings: ReportSettings) -> dict[str, object]:
    """Curves of all rows for the overlay, to four digits."""

    def short(values: np.ndarray) -> list[float]:
        return [float(f"{v:.4g}") for v in values]

    return {
        "axes": [words("axis_kappa"), words("axis_stiffness", unit=unit.symbol)],
        "decimal": words.decimal,
        "half": band_width(settings),
        "shown": words("index_shown", shown="{shown}", total="{total}"),
        "rows": [
            None
            if row.curve is None
            else [
                short(row.curve.kappa),
                short(unit.factor * row.curve.tangent),
                short(unit.factor * row.curve.tangent_std),
            ]
            for row in rows
        ],
    }

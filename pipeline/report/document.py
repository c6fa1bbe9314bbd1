"""``report.html``: one file that answers first and proves after, without network.

Result -> views (texts, rows, figures) -> templates. Every text is escaped by the template engine; only the SVG drawn
here is not, and its texts were escaped by matplotlib. Order of the page: the answer in a sentence and a figure; what
was wrong and what was done; evidence; what simulation programs need; data and provenance.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pipeline.report.answer import first_screen
from pipeline.report.canvas import page_colours
from pipeline.report.curves import equivalent, smallest_radius
from pipeline.report.diagnosed import diagnosis_view
from pipeline.report.evidence import (
    force_rows,
    knot_rows,
    knot_title,
    main_figure,
    map_note,
    mechanics_figures,
    photo_rows,
    photo_views,
    photos_note,
    pointer_data,
)
from pipeline.report.figures import force_unit, stiffness_unit
from pipeline.report.files import write_atomic
from pipeline.report.page import asset, environment, palette_css
from pipeline.report.provenance import fit_rows, nuisance_rows, provenance_rows, specimen_rows
from pipeline.report.words import Words
from pipeline.result import Result, curves, set_aside
from pipeline.settings import ReportSettings


def report_html(result: Result, settings: ReportSettings | None = None) -> str:
    """Text of ``report.html`` of a result, measured, partly measured or failed."""
    settings = settings or ReportSettings()
    words = Words.of(settings)
    main, diagnosis = main_figure(result, words), diagnosis_view(result, words)
    levels = {level: [f for f in result.findings if f.level == level] for level in ("error", "warning", "info")}
    rows = {"forces": force_rows, "photos": photo_rows, "knots": knot_rows}
    page = environment().get_template("report.html")
    return page.render(
        result=result,
        words=words,
        answer=first_screen(result, words),
        main=main,
        aside=_aside(result, words),
        map_note=map_note(result, words),
        shown={
            "photos": bool(result.photos) or result.status != "failed",
            "diagnosis": diagnosis is not None and diagnosis.examined,
        },
        pointer=pointer_data(result, main, words),
        levels=levels,
        photos=photo_views(result, words),
        photos_note=photos_note(result, words),
        figures=mechanics_figures(result, words),
        diagnosis=diagnosis,
        tables={name: of(result, words) for name, of in rows.items()},
        simulated=any(step.force_fit_N is not None for step in result.steps),
        knots_title=knot_title(result, words),
        force_symbol=force_unit(result, words).symbol,
        stiffness_symbol=stiffness_unit(result, words).symbol,
        use=simulation_texts(result, words, settings),
        specimen_rows=specimen_rows(result, words),
        fit_rows=fit_rows(result, words),
        nuisance_rows=nuisance_rows(result, words),
        provenance=provenance_rows(result, words),
        palette=palette_css(page_colours()),
        css=asset("page.css") + asset("report.css"),
        js=asset("page.js") + asset("report.js"),
    )


def _aside(result: Result, words: Words) -> str:
    """Label of the switch for curves that are set aside; empty where there are none."""
    aside = set_aside(result) & curves(result).keys()
    return words("aside_refuted" if "extended" in aside else "aside_without") if aside else ""


def simulation_texts(result: Result, words: Words, settings: ReportSettings) -> dict[str, Any]:
    """Equivalent constant stiffness and smallest radius in words; empty where there is none to be used."""
    texts: dict[str, Any] = {}
    curve = result.answer.curve
    if curve is not None and not result.answer.usable:
        return texts
    if curve is not None and (constant := equivalent(curve, settings.equivalent_range_per_m)):
        value = stiffness_unit(result, words).text(constant.stiffness, constant.std)
        low, high = words.curvature(constant.low), words.curvature(constant.high)
        texts["equivalent"] = words("use_equivalent_row", value=value, low=low, high=high)
        texts["bound"] = words("use_bound") if constant.bound else ""
        texts["departure"] = words("use_departure", departure=words.number(100.0 * constant.departure, 2))
        texts["method"] = curve.method
        texts["range"] = (constant.low, constant.high)
    radius = smallest_radius(result)
    if radius is not None:
        value = words.measured(1e3 * radius[0], 1e3 * radius[1])
        texts["radius"] = words("use_radius_row", value=value, step=radius[2])
    return texts


def write_report(result: Result, folder: Path, settings: ReportSettings | None = None) -> Path:
    """Write ``report.html`` into a folder, at once or not at all; its path."""
    return write_atomic(Path(folder) / "report.html", report_html(result, settings))

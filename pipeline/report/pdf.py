"""``report.pdf``: the same answer and the same figures on two to four A4 pages, for the archive.

The same input gives the same bytes: no clock, no random names. Pages: the answer; mechanics; the diagnosis, if there
was one; photos with their centerlines and where the numbers come from. Photos beyond the number in the settings are in
report.html.
"""

from __future__ import annotations

import io
import textwrap
from pathlib import Path

from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from pipeline.report import figures, maps, photos, ranking
from pipeline.report.answer import first_screen
from pipeline.report.canvas import LIGHT, Area, style
from pipeline.report.diagnosed import DiagnosisView, diagnosis_view
from pipeline.report.document import simulation_texts
from pipeline.report.evidence import force_rows
from pipeline.report.files import write_atomic
from pipeline.report.page import unbroken
from pipeline.report.provenance import fit_rows, provenance_rows, specimen_rows
from pipeline.report.ruling import printable
from pipeline.report.words import Words
from pipeline.result import DiagnosisPart, FindingPart, PhotoPart, Result, curves
from pipeline.settings import ReportSettings

PAGE = (595.0, 842.0)  # A4 in points
MARGIN = 44.0
LEADING = 1.45
# Mean width of a letter of DejaVu Sans over its size, for breaking lines.
LETTER = 0.52
# Of pictures on the page: the line over a photo of 250 pt can be judged, six photos stay below 2 MB.
DOTS_PER_INCH = 150
# Figures of half the page's width beside letters of 10 pt.
SMALL = 0.75
HALVES = ((0.0, 0.5), (0.5, 1.0))


class Sheet:
    """A page that is filled from the top: its title, texts, then parts for figures."""

    def __init__(self, title: str) -> None:
        self.figure = Figure(figsize=(PAGE[0] / 72.0, PAGE[1] / 72.0), dpi=72, facecolor="white")
        self.y = MARGIN
        self.text(title, size=9.0, color=LIGHT["muted"])
        self.y += 6.0

    def text(self, text: str, *, size: float = 10.0, bold: bool = False, color: str = LIGHT["ink"]) -> None:
        """Write a paragraph over the width of the page."""
        for line in _lines(text, size, bold):
            self.y += LEADING * size
            x, y, weight = MARGIN / PAGE[0], 1.0 - self.y / PAGE[1], "bold" if bold else "normal"
            self.figure.text(x, y, line, size=size, weight=weight, color=color)
        self.y += 0.4 * size

    def pairs(self, rows: list[tuple[str, str]], *, size: float) -> None:
        """Write names and texts, one pair a paragraph, as long as there is room."""
        for name, text in rows:
            if self.room() > 24.0:
                self.text(f"{name}: {text}", size=size)

    def parts(self, height: float, *spans: tuple[float, float], gap: float = 8.0) -> list[Area]:
        """Room for figures beside each other below what stands on the page; spans are shares of the page's width."""
        inner, heights, areas = PAGE[0] - 2.0 * MARGIN, (self.y, height, PAGE[1] - self.y - height), list[Area]()
        for left, right in spans:
            x0, x1 = MARGIN + left * inner, MARGIN + right * inner
            # a part of a figure takes its place from the ratios of its grid alone: it is the middle of nine fields
            widths = (x0, x1 - x0, PAGE[0] - x1)
            grid = self.figure.add_gridspec(3, 3, width_ratios=widths, height_ratios=heights)
            areas.append(self.figure.add_subfigure(grid[1, 1]))
        self.y += height + gap
        return areas

    def room(self) -> float:
        """Height left on the page in points."""
        return PAGE[1] - MARGIN - self.y


def _lines(text: str, size: float, bold: bool = False) -> list[str]:
    """Lines of a paragraph over the width of the page."""
    width = PAGE[0] - 2.0 * MARGIN
    return textwrap.wrap(printable(unbroken(text)), int(width / (LETTER * (1.12 if bold else 1.0) * size))) or [""]


def pdf_bytes(result: Result, settings: ReportSettings | None = None) -> bytes:
    """Content of ``report.pdf``."""
    settings = settings or ReportSettings()
    words = Words.of(settings)
    with style(SMALL):
        sheets = [answer_sheet(result, words, settings)]
        if result.steps or curves(result):
            sheets.append(_mechanics_sheet(result, words))
        view = diagnosis_view(result, words, figures=False)
        if view is not None and view.examined and result.diagnosis is not None:
            sheets.append(_diagnosis_sheet(result, result.diagnosis, view, words))
        sheets.append(_photo_sheet(result, words, settings))
        file = io.BytesIO()
        metadata = {"Creator": "cablebend", "Title": words("title", id=result.specimen.id)}
        with PdfPages(file, metadata={**metadata, "CreationDate": None, "Producer": None}) as pages:
            for number, sheet in enumerate(sheets, start=1):
                place = words("page_of", page=number, pages=len(sheets))
                sheet.figure.text(0.5, 20.0 / PAGE[1], place, size=8.0, ha="center", color=LIGHT["muted"])
                pages.savefig(sheet.figure, dpi=DOTS_PER_INCH)
    return file.getvalue()


def _head(result: Result) -> str:
    return " · ".join(part for part in (result.specimen.id, result.specimen.description.get("type", "")) if part)


def answer_sheet(result: Result, words: Words, settings: ReportSettings) -> Sheet:
    """Answer, main figure, adequacy, agreement, K0 three ways, what to do next, warnings."""
    sheet, said = Sheet(_head(result)), first_screen(result, words)
    sheet.text(said.sentence, size=14.0, bold=True)
    if curves(result):
        (area,) = sheet.parts(240.0, (0.04, 0.96))
        figures.draw_characteristic(area, result, words)
        sheet.text(words("convention", coverage=words.number(100.0 * words.coverage)), color=LIGHT["muted"])
        if said.doubt:
            sheet.text(said.doubt, bold=True)
    parts = [("what_next", said.advice)]
    if result.answer.usable:
        parts += [
            ("adequate", f"{said.verdict[:1].upper()}{said.verdict[1:]}. {said.model}" if said.verdict else said.model),
            ("two_ways", said.agreement),
        ]
    if said.hidden:
        parts.append(("hidden_here", " ".join(f"{line[:1].upper()}{line[1:]}" for line in said.hidden)))
    if said.pre_curvatures:
        parts.append(("pre_curvature", "; ".join(f"{way}: {value} 1/m" for way, value in said.pre_curvatures)))
    for title, text in parts:
        sheet.text(words(title), bold=True)
        sheet.text(text)
    use = simulation_texts(result, words, settings)
    if use:
        sheet.text(words("nav_use"), bold=True)
        for title, key in (("use_equivalent", "equivalent"), ("use_radius", "radius")):
            if use.get(key):
                sheet.text(f"{words(title)}: {use[key]}")
    levels = ("error", "warning")
    list_troubles(sheet, [finding for level in levels for finding in result.findings if finding.level == level], words)
    return sheet


def list_troubles(sheet: Sheet, findings: list[FindingPart], words: Words) -> None:
    """Warnings and errors as far as the page has room, and how many more there are."""
    size = 9.0
    if findings and sheet.room() < LEADING * (10.0 + 2.0 * size):  # of a title and a line under it
        sheet.text(f"{words('nav_findings')}: {words('more_findings', count=len(findings))}", size=size)
        return
    if findings:
        sheet.text(words("nav_findings"), bold=True)
    for number, finding in enumerate(findings):
        told = f"{words(f'level_{finding.level}')}: {words.said(finding.said).sentence}"
        if sheet.room() < LEADING * size * (len(_lines(told, size)) + 1) + size:
            sheet.text(words("more_findings", count=len(findings) - number), size=size)
            return
        sheet.text(told, size=size)


def _mechanics_sheet(result: Result, words: Words) -> Sheet:
    """Forces with their table, moment curve, curvatures, residual map."""
    sheet = Sheet(_head(result))
    sheet.text(words("nav_mechanics"), size=13.0, bold=True)
    left, right = sheet.parts(270.0, (0.0, 0.52), (0.52, 1.0))
    if result.steps:
        figures.draw_forces(left, result, words)
    if curves(result):
        figures.draw_moment(right, result, words)
    residuals = maps.answer_map(result)
    if any(photo.kappa_per_m for photo in result.photos):  # a photo without them leaves no residuals
        left, right = sheet.parts(230.0, *HALVES, gap=6.0)
        figures.draw_curvatures(left, result, words)
        if residuals is not None:
            maps.draw_map(right, residuals, words, title=words("fig_map"))
    unit = figures.force_unit(result, words).symbol
    columns = ("step", "branch", "displacement", "force", "force_fit", "residual", "sigma")
    heads = [words(f"col_{name}", unit=unit) for name in columns]
    rows = force_rows(result, words)[: max(0, int(sheet.room() / 13.0) - 2)]
    if rows:
        _grid(sheet, heads, rows)
    return sheet


def _grid(sheet: Sheet, heads: list[str], rows: list[list[str]]) -> None:
    """A table over the width of the page."""
    (area,) = sheet.parts(13.0 * (len(rows) + 1), (0.0, 1.0))
    axes = area.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    table = axes.table(cellText=rows, colLabels=heads, loc="center", cellLoc="right", edges="horizontal")
    table.auto_set_font_size(False)
    table.set_fontsize(7.5)
    for cell in table.get_celld().values():
        cell.set_linewidth(0.4)
        cell.set_edgecolor(LIGHT["grid"])


def _photo_sheet(result: Result, words: Words, settings: ReportSettings) -> Sheet:
    """Photos with their centerlines, two in a row; specimen, fit and provenance."""
    sheet = Sheet(_head(result))
    sheet.text(words("nav_photos"), size=13.0, bold=True)
    pictures = [photo for photo in result.photos if photo.preview is not None]
    shown = pictures[: settings.photos_in_pdf]
    for index in range(0, len(shown), 2):
        row = shown[index : index + 2]
        height = photos.PICTURE_HEAD + max(_height(photo) for photo in row)
        areas = sheet.parts(height, *((0.0, 0.48), (0.5, 0.98))[: len(row)], gap=4.0)
        for area, photo in zip(areas, row, strict=True):
            photos.draw_photo(area, photo, words)
    if not pictures:
        sheet.text(words("photo_none"))
    if len(pictures) > len(shown):
        sheet.text(words("more_photos", count=len(pictures) - len(shown)), size=8.5)
    sheet.text(words("nav_data"), size=13.0, bold=True)
    source = provenance_rows(result, words)
    rows = [*specimen_rows(result, words), *fit_rows(result, words), (words("reproduce"), source["command"])]
    digests = [(name, digest[:16]) for name, digest in source["inputs"]]
    sheet.pairs([*rows, *source["facts"], *digests], size=8.0)
    return sheet


def _height(photo: PhotoPart) -> float:
    """Height of a picture of half the page's width, at most a fifth of the page."""
    preview = photo.preview
    width = 0.48 * (PAGE[0] - 2.0 * MARGIN)
    return 0.0 if preview is None else min(width * preview.height / preview.width, 0.2 * PAGE[1])


def _diagnosis_sheet(result: Result, part: DiagnosisPart, view: DiagnosisView, words: Words) -> Sheet:
    """Headline, causes, ranking, maps before and after, gain, blind spots, next experiment."""
    sheet = Sheet(_head(result))
    sheet.text(words("nav_diagnosis"), size=13.0, bold=True)
    sheet.text(words.said(part.said).sentence, bold=True)
    for line in (*(cause.line for cause in view.named), *view.gain, *view.leftover):
        sheet.text(line)
    if part.table:
        height = min(ranking.ranking_height(part), 280.0)
        (area,) = sheet.parts(height, (0.05, 0.95))
        ranking.draw_ranking(area, part, words)
    before, after = part.residuals_before, part.residuals_after
    if before is not None and after is not None:
        left, right = sheet.parts(165.0, *HALVES, gap=5.0)
        maps.draw_map(left, before, words, title=words("fig_map_before"))
        maps.draw_map(right, after, words, title=words("fig_map_after"))
    texts = [(words("next_experiment"), view.next_what)] if view.next_what else []
    texts += [(words("blind_spots"), line) for line in view.blind_spots]
    sheet.pairs(texts, size=8.5)
    return sheet


def write_pdf(result: Result, folder: Path, settings: ReportSettings | None = None) -> Path:
    """Write ``report.pdf`` into a folder, at once or not at all; its path."""
    return write_atomic(Path(folder) / "report.pdf", pdf_bytes(result, settings))

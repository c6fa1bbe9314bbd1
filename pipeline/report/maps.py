"""Maps: shape residuals over arc length and step, and cosines between causes.

A residual map shows (measured - simulated) / standard deviation: rows are steps in the order of the test, columns are
arc length from the left bearing axis. Purple and orange (map PuOr) are told apart in all colour blindnesses; white is
none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage

from pipeline.records import Array
from pipeline.report.canvas import LIGHT, ONE_ROW, Area, finish, label_width, noise_band, plot_area
from pipeline.report.ruling import Ruling, rule
from pipeline.report.words import Words
from pipeline.result import PhotoPart, ResidualMap, Result

# More names than this on an axis cannot be annotated at 440 px.
ANNOTATED_NAMES = 9
SHADES = 64  # of a scale of colours; no eye tells more of them apart
# Below this width, in px, numbers under a map would run into each other: half a page of report.pdf.
NARROW = 330.0


def measured_map(result: Result) -> ResidualMap | None:
    """Residual map of the fitted simulation, from the photos themselves; None if no photo has residuals."""
    photos = [p for p in result.photos if p.shape_residual_m and len(p.shape_residual_std_m) == len(p.shape_residual_m)]
    if not photos:
        return None
    branches = {step.step: step.branch for step in result.steps}
    grid = np.linspace(0.0, max(p.s_m[-1] for p in photos), 201)
    rows: dict[str, list[list[float | None]]] = {"shape_sigma": [], "shape_m": []}
    for photo in photos:
        std, left = np.asarray(photo.shape_residual_std_m), np.where(photo.seen, photo.shape_residual_m, np.nan)
        sigma = np.divide(left, std, out=np.full(std.size, np.nan), where=std > 0.0)
        for table, values in zip(rows.values(), (sigma, left), strict=True):
            row = np.interp(grid, photo.s_m, values, left=np.nan, right=np.nan)
            table.append([float(v) if np.isfinite(v) else None for v in row])
    steps = [p.step for p in photos]
    return ResidualMap(s_m=grid.tolist(), steps=steps, branches=[branches.get(s, "") for s in steps], **rows)


def extended_map(result: Result) -> ResidualMap | None:
    """Residual map of the extended model, if that is what answers."""
    return result.diagnosis.residuals_after if result.diagnosis and result.answer.method == "extended" else None


def answer_map(result: Result) -> ResidualMap | None:
    """Residual map of the model that answers: the extended one, else the fitted simulation as the photos hold it."""
    return extended_map(result) or measured_map(result)


def photos_of_answer(result: Result) -> list[PhotoPart]:
    """The photos with what the model of the answer leaves of their shapes.

    Of an extended model the result holds no curvatures; those of the simulation without the cause are none of its own.
    """
    residuals = answer_map(result)
    if residuals is None or result.answer.method != "extended":
        return result.photos
    rows = dict(zip(residuals.steps, residuals.shape_m, strict=False))
    return [_left_by(photo, residuals.s_m, rows.get(photo.step, [])) for photo in result.photos]


def _left_by(photo: PhotoPart, s_m: list[float], left_m: list[float | None]) -> PhotoPart:
    known = any(value is not None for value in left_m)
    left = np.nan_to_num(np.interp(photo.s_m, s_m, _numbers(left_m))).tolist() if known else []
    return photo.model_copy(update={"kappa_fit_per_m": [], "shape_residual_m": left})


def map_height(residuals: ResidualMap) -> float:
    """Height of the figure of a map in px: rows that can be told apart."""
    return 72.0 + 24.0 * min(12, max(4, len(residuals.steps)))


COLUMNS = 120
"""Of a map along s; at 440 px a column is 3 px, finer is not seen."""

STRONG = 5.0
"""Standard deviations at which the colours of a map end; beyond, the size no longer matters."""


def draw_map(figure: Area, residuals: ResidualMap, words: Words, *, title: str = "") -> Axes:
    """Draw shape residuals in sigma over s and step."""
    branches = residuals.branches or [""] * len(residuals.steps)
    told = [words.known(f"branch_{branch}", branch) for branch in branches]
    names = [f"{step} {branch}" for step, branch in zip(residuals.steps, told, strict=True)]
    width = figure.bbox.width
    axes = plot_area(figure, left=label_width(names, most=0.4 * width), right=84.0, top=20.0 if title else 8.0)
    s = 1e3 * np.asarray(residuals.s_m)
    columns = np.linspace(s[0], s[-1], COLUMNS)
    table = np.array([np.interp(columns, s, _numbers(row)) for row in residuals.shape_sigma])
    # noise alone stays pale; a large misfit sets its own scale, else all of it would be one colour
    limit = max(STRONG, float(np.nanpercentile(np.abs(table), 98.0))) if np.isfinite(table).any() else 1.0
    image = axes.imshow(
        np.ma.masked_invalid(table),
        cmap="PuOr_r",
        vmin=-limit,
        vmax=limit,
        aspect="auto",
        interpolation="nearest",
        extent=(s[0], s[-1], len(residuals.steps) - 0.5, -0.5),
    )
    axes.set_facecolor(LIGHT["grid"])
    every = max(1, len(residuals.steps) // 12)
    steps = Ruling(at=tuple(range(0, len(names), every)), labels=tuple(names[::every]), grid=False)
    along = Ruling(words("axis_s"), most=6 if width > NARROW else 3, grid=False)
    finish(axes, words, x=along, y=steps)
    axes.set_title(title, loc="left")
    _scale(figure, axes, image, words("axis_sigma"), words)
    return axes


def draw_force_rest(figure: Area, before: ResidualMap, after: ResidualMap, words: Words) -> Axes:
    """Draw forces left over by step in sigma, before and after the extension."""
    axes = plot_area(figure, top=ONE_ROW)
    noise_band(axes)
    for residuals, role, marker, label in ((before, "alarm", "x", "before"), (after, "extended", "o", "after")):
        if residuals.force_sigma:
            values = _numbers(residuals.force_sigma)
            axes.plot(range(values.size), values, color=LIGHT[role], marker=marker, lw=0.8, label=words(label))
    steps = Ruling(words("step"), at=tuple(range(len(before.steps))), labels=tuple(map(str, before.steps)))
    return finish(axes, words, x=steps, y=words("axis_sigma"), legend=2)


def draw_leftover(figure: Area, s_m: list[float], shape_m: list[float], words: Words) -> Axes:
    """Draw the pattern of what no cause explains, along the cable."""
    axes, unit = plot_area(figure, top=8.0), words.unit("m", *shape_m)
    axes.axhline(0.0, color=LIGHT["muted"], lw=0.8)
    axes.plot(1e3 * np.asarray(s_m), unit.factor * np.asarray(shape_m), color=LIGHT["alarm"])
    return finish(axes, words, x=words("axis_s"), y=words("axis_residual", unit=unit.symbol))


def _numbers(row: list[float | None]) -> Array:
    return np.array([np.nan if v is None else v for v in row])


def _scale(figure: Area, axes: Axes, image: AxesImage, label: str, words: Words) -> None:
    """Colours and their values right of the axes."""
    box, width = axes.get_position(), figure.bbox.width
    bar = figure.add_axes((box.x1 + 12.0 / width, box.y0, 12.0 / width, box.height))
    low, high = image.get_clim()
    shades = np.linspace(low, high, SHADES)[:, None]
    bar.imshow(shades, cmap=image.get_cmap(), aspect="auto", origin="lower", extent=(0.0, 1.0, low, high))
    bar.spines[:].set_visible(True)
    rule(bar, "bottom", Ruling(at=()), decimal=words.decimal)
    rule(bar, "right", Ruling(label, grid=False), decimal=words.decimal)


def draw_cosines(figure: Area, cosines: dict[str, dict[str, float]], words: Words) -> Axes:
    """Draw how alike the signatures of causes are: |cos| = 1 cannot be told apart by this test."""
    names = list(dict.fromkeys([*cosines, *(other for row in cosines.values() for other in row)]))
    labels = [words.cause(name) for name in names]
    longest = label_width(labels, most=0.45 * figure.bbox.width)
    # Labels of the columns lean by 40 degrees: two thirds of their length go down.
    axes = plot_area(figure, left=longest, right=64.0, top=8.0, bottom=0.68 * longest + 8.0)
    table = np.array([[_cosine(cosines, a, b) for b in names] for a in names])
    image = axes.imshow(np.ma.masked_invalid(table), cmap="cividis", vmin=0.0, vmax=1.0, aspect="auto")
    causes = Ruling(at=tuple(range(len(names))), labels=tuple(labels), grid=False, mark=0.0)
    finish(axes, words, x=replace(causes, lean=40.0), y=causes)
    axes.spines[:].set_visible(False)
    if len(names) <= ANNOTATED_NAMES:
        size = min(9.0, 0.36 * axes.bbox.width / len(names))  # four signs are 2.2 letters wide: a fifth stays free
        for (row, column), value in np.ndenumerate(table):
            if np.isfinite(value):
                colour = "#000000" if value > 0.5 else "#fdfdfd"
                axes.text(column, row, words.fixed(value, 2), ha="center", va="center", color=colour, size=size)
    _scale(figure, axes, image, words("axis_cosine"), words)
    return axes


def _cosine(cosines: dict[str, dict[str, float]], a: str, b: str) -> float:
    """Magnitude of the cosine of two causes; not a number where it was not computed."""
    if a == b:
        return 1.0
    return abs(cosines.get(a, {}).get(b, cosines.get(b, {}).get(a, float("nan"))))

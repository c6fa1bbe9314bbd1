"""The evidence as figures and rows of tables: photos, forces, curvatures, moments, residuals.

Everything comes from `pipeline.result.Result`; a figure whose data are missing is left out, never drawn empty.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pipeline.report import figures, maps, photos
from pipeline.report.canvas import Area, Drawing, drawing
from pipeline.report.curves import seen_range
from pipeline.report.words import Said, Words
from pipeline.result import PhotoPart, ResidualMap, Result, curves, set_aside, trusted
from pipeline.rounding import digits
from pipeline.units import Unit

Size = tuple[float, float]
TALL = (400.0, 350.0)
POINTS = 8  # of the characteristic in its table
SENT = 5  # digits of numbers for the pointer: more than any band here supports, and a third of the bytes


@dataclass(frozen=True)
class PhotoView:
    """One photo on the page, what lies over its picture, and its curvature figure."""

    photo: PhotoPart
    reason: str
    seen_path: str
    hidden_path: str
    bearings: list[tuple[float, float]]
    kappa: Drawing | None


def main_figure(result: Result, words: Words) -> Drawing | None:
    """The figure of f_EI by every way; None where no way gave any."""
    parts = trusted(result)
    if not parts:
        return None
    unit = figures.stiffness_unit(result, words)
    lines = []
    for method, curve in parts.items():
        first, last = (unit.text(curve.tangent[end], curve.tangent_std[end]) for end in (0, -1))
        lines.append(words("fig_line_alt", way=words(f"way_{method}"), first=first, last=last))
    read = " ".join(Said(line, words.language).sentence for line in lines)
    low, high = min(c.kappa[0] for c in parts.values()), max(c.kappa[-1] for c in parts.values())
    draw = partial(figures.draw_characteristic, result=result, words=words)
    ends = {"low": words.curvature(low), "high": words.curvature(high)}
    return titled("characteristic", draw, words, size=(420.0, 310.0), lines=read, **ends)


def pointer_data(result: Result, main: Drawing | None, words: Words) -> dict[str, object]:
    """What the page needs to answer a pointer over the main figure: frame, values, bands, supporting photos."""
    if main is None:
        return {}
    unit, half, aside = figures.stiffness_unit(result, words), words.half_band, set_aside(result)
    ways = [
        {
            "method": method,
            "name": words(f"way_{method}"),
            "kappa": digits(curve.kappa, SENT),
            "value": digits(unit.factor * curve.tangent, SENT),
            "std": digits(unit.factor * curve.tangent_std, SENT),
            "factor": [digits(unit.factor * column, SENT) for column in curve.factor.T],
            "aside": method in aside,
        }
        for method, curve in curves(result).items()
    ]
    ranges = {photo.step: seen_range(photo) for photo in result.photos}
    return {
        "frame": main.frame,
        "unit": unit.symbol,
        "half": half,
        "decimal": words.decimal,
        "ways": ways,
        "photos": [{"step": step, "low": r[0], "high": r[1]} for step, r in ranges.items() if r],
        "words": {key: words(f"hover_{key}") for key in ("photos", "no_photos", "band", "unvisited")},
    }


def titled(
    name: str, draw: Callable[[Area], Axes], words: Words, *, key: str = "", size: Size = (400.0, 300.0), **alt: str
) -> Drawing:
    """A figure; title and description are the words ``fig_KEY`` and ``fig_KEY_alt``, by default with its name."""
    said = f"fig_{key or name}"
    return drawing(name, draw, size=size, title=words(said), description=words(f"{said}_alt", **alt))


def mechanics_figures(result: Result, words: Words) -> dict[str, Drawing]:
    """Forces, moment curve, curvatures of all photos, pointwise graph and residual map, as far as there are data."""
    drawn: dict[str, Drawing] = {}
    how: dict[str, Any] = {"result": result, "words": words}
    if result.steps:
        drawn["forces"] = titled("forces", partial(figures.draw_forces, **how), words, size=TALL)
    if curves(result):
        drawn["moment"] = titled("moment", partial(figures.draw_moment, **how), words)
    tops = [r[1] for r in map(seen_range, result.photos) if r]
    if tops:
        top = words.curvature(max(tops))
        drawn["curvatures"] = titled("curvatures", partial(figures.draw_curvatures, **how), words, top=top)
    if len(figures.fitted_branches(result)) > 1:
        drawn["branches"] = titled("branches", partial(figures.draw_branches, **how), words)
    if result.balance and result.balance.pointwise and result.balance.curve:
        drawn["pointwise"] = titled("pointwise", partial(figures.draw_pointwise, **how), words)
    residuals = maps.answer_map(result)
    if residuals is not None:
        drawn["map"] = residual_map("residual-map", residuals, words)
    return drawn


def residual_map(name: str, residuals: ResidualMap, words: Words, *, title: str = "fig_map") -> Drawing:
    """The figure of a residual map, high enough for its steps."""
    draw, size = partial(maps.draw_map, residuals=residuals, words=words), (400.0, maps.map_height(residuals))
    told = words("fig_map_alt", rms=map_rms(residuals, words))
    return drawing(name, draw, size=size, title=words(title), description=told)


def map_note(result: Result, words: Words) -> str:
    """How the residual map is read, and what its unit, one standard deviation, is in length."""
    residuals = maps.answer_map(result)
    rows = [] if residuals is None else zip(residuals.shape_m, residuals.shape_sigma, strict=False)
    pairs = [pair for row in rows for pair in zip(*row, strict=True)]
    stds = [abs(left / sigma) for left, sigma in pairs if left is not None and sigma]
    if not stds:
        return words("fig_map_note")
    size = words.unit("m", *stds).plain(float(np.median(stds)), 2)
    return f"{words('fig_map_note')} {words('fig_map_scale', size=size)}"


def map_rms(residuals: ResidualMap, words: Words) -> str:
    """Root mean square of a residual map by step, as text."""
    texts = []
    for step, row in zip(residuals.steps, residuals.shape_sigma, strict=True):
        known = np.array([v for v in row if v is not None])
        if known.size:
            texts.append(f"{step}: {words.number(float(np.sqrt(np.mean(known**2))), 2)}")
    return "; ".join(texts)


def photo_views(result: Result, words: Words) -> list[PhotoView]:
    """All photos in the order of the test."""
    return [_photo_view(index, photo, words) for index, photo in enumerate(maps.photos_of_answer(result))]


def _photo_view(index: int, photo: PhotoPart, words: Words) -> PhotoView:
    seen, hidden = photos.overlay_paths(photo)
    kappa, seen_kappa = None, seen_range(photo)
    if len(photo.s_m) > 1:
        low, high = seen_kappa or (min(photo.kappa_per_m), max(photo.kappa_per_m))
        draw = partial(photos.draw_photo_curvature, photo=photo, words=words)
        ends = {"low": words.curvature(low), "high": words.curvature(high)}
        kappa = titled(f"kappa-{index}", draw, words, key="kappa", size=TALL, **ends)
    told, marks = words.after_colon(photo.said) if photo.reason else "", photos.bearing_marks(photo)
    return PhotoView(photo, told, seen, hidden, marks, kappa)


def force_rows(result: Result, words: Words) -> list[list[str]]:
    """Rows of the table of forces: step, branch, displacement, measured, simulated, left over, in sigma."""
    unit, rows = figures.force_unit(result, words), []
    for step in figures.steps_of_answer(result):
        sigma = figures.force_residual(step)
        rest = None if step.force_fit_N is None else step.force_N - step.force_fit_N
        rows.append(
            [
                str(step.step),
                words.known(f"branch_{step.branch}", step.branch),
                words.number(1e3 * step.displacement_m, 5),
                unit.number(step.force_N, step.force_std_N),
                unit.alike(step.force_fit_N, step.force_std_N),
                "–" if rest is None else unit.number(rest, step.force_std_N),
                "–" if sigma is None else words.fixed(sigma, 1),
            ]
        )
    return rows


def photo_rows(result: Result, words: Words) -> list[list[str]]:
    """Rows of the table of photos: step, photo, outcome, chord, traced length, width, curvature seen."""
    millimetres, rows = Unit(1e3, "mm", words.decimal), []
    for photo in result.photos:
        seen = seen_range(photo)
        rows.append(
            [
                str(photo.step),
                photo.image,
                words(f"status_{photo.status}") + (f": {words.after_colon(photo.said)}" if photo.reason else ""),
                millimetres.number(photo.chord_m, photo.chord_std_m),
                millimetres.number(photo.traced_length_m, photo.traced_length_std_m),
                millimetres.number(photo.width_m, photo.width_std_m),
                "–" if seen is None else f"{words.curvature(seen[0])} … {words.curvature(seen[1])}",
            ]
        )
    return rows


def photos_note(result: Result, words: Words) -> str:
    """What the standard deviations in the table of photos leave out, because all photos share it."""
    scale = result.scale
    if scale is None or not any(photo.s_m for photo in result.photos):
        return ""
    common = [words("photos_scale", percent=words.number(100.0 * scale.std_relative, 2))]
    if scale.axis_parallax_std > 0.0:
        common.append(words("photos_axes", percent=words.number(100.0 * scale.axis_parallax_std, 2)))
    return " ".join(common)


def knot_rows(result: Result, words: Words) -> list[list[str]]:
    """Rows of the table of the characteristic that answers: curvature, and tangent with the band of the answer."""
    unit, curve, exact = figures.stiffness_unit(result, words), result.answer.curve, words("exact")
    if curve is None:
        return []
    places = [float(kappa) for kappa in np.linspace(curve.kappa[0], curve.kappa[-1], POINTS)]
    return [[f"{words.curvature(kappa)} ({exact})", unit.number(*curve.at(kappa))] for kappa in places]


def knot_title(result: Result, words: Words) -> str:
    """What `knot_rows` shows."""
    curve = result.answer.curve
    return "" if curve is None else words("table_points", way=words(f"way_{curve.method}"))

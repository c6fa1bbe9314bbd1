"""The figures of a report for a notebook: a result goes in, a matplotlib figure comes out.

Axes, units and colours are those of the report. A figure shows itself as the last line of a notebook's cell and is
saved by its ``savefig``; nothing goes through pyplot.
"""

from __future__ import annotations

import io
from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.messages import Message
from pipeline.report import figures, maps, photos
from pipeline.report.canvas import Area, style
from pipeline.report.words import Words
from pipeline.result import Result, curves
from pipeline.settings import ReportSettings

DOTS_PER_INCH = 144
"""Twice the 72 at which all figures are laid out: sharp on a screen of today."""


def plot_characteristic(result: Result, *, settings: ReportSettings | None = None) -> Figure:
    """Draw f_EI over the curvature by every way, with bands; raises ``ValueError`` where nothing was measured.

    The settings give the language and the width of the bands.
    """
    words = _words(settings, None if curves(result) else Message("misuse.no-curve", name=result.specimen.id))
    return _figure(lambda area: figures.draw_characteristic(area, result, words), (420.0, 310.0))


def plot_forces(result: Result, *, settings: ReportSettings | None = None) -> Figure:
    """Draw measured and simulated forces over the displacement; settings as in `plot_characteristic`."""
    words = _words(settings, None if result.steps else Message("misuse.no-forces", name=result.specimen.id))
    return _figure(lambda area: figures.draw_forces(area, result, words), (400.0, 350.0))


def plot_residuals(result: Result, *, settings: ReportSettings | None = None) -> Figure:
    """Draw what the model of the answer leaves of the shapes, in standard deviations, over arc length and step."""
    left = maps.answer_map(result)
    words = _words(settings, None if left else Message("misuse.no-residuals", name=result.specimen.id))
    assert left is not None
    return _figure(lambda area: maps.draw_map(area, left, words), (400.0, maps.map_height(left)))


def plot_photo(result: Result, step: int, *, settings: ReportSettings | None = None) -> Figure:
    """Draw the photo of a step with the centerline found on it; dashed where no photo shows the cable.

    Raises `ValueError` where the result holds no picture of that step.
    """
    pictures = {one.step: (one, one.preview) for one in result.photos if one.preview is not None}
    pictured = ", ".join(map(str, pictures)) or "-"
    lacking = Message("misuse.no-picture", name=result.specimen.id, step=step, pictured=pictured)
    words = _words(settings, None if step in pictures else lacking)
    photo, preview = pictures[step]
    size = (500.0, photos.PICTURE_HEAD + 500.0 * preview.height / preview.width)
    return _figure(lambda area: photos.draw_photo(area, photo, words), size)


def _words(settings: ReportSettings | None, lacking: Message | None) -> Words:
    """Words of a figure; what the result lacks for it is an error in their language."""
    words = Words.of(settings or ReportSettings())
    if lacking is not None:
        raise ValueError(lacking.said(words.language))
    return words


def _figure(draw: Callable[[Area], Axes], size: tuple[float, float]) -> Figure:
    """A figure of so many px at 72 dots per inch that shows itself in a notebook."""
    with style():
        figure = _Shown(figsize=(size[0] / 72.0, size[1] / 72.0), dpi=72, facecolor="white")
        draw(figure)
    figure.set_dpi(DOTS_PER_INCH)
    return figure


class _Shown(Figure):
    """A figure with the picture of itself that notebooks ask an object for."""

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self.savefig(file, format="png")
        return file.getvalue()

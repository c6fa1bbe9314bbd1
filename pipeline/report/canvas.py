"""From a drawing by matplotlib to a compact piece of SVG that follows the page: its colours, its font, its width.

Every figure is drawn once on matplotlib axes in the light colours of `PALETTE`; report.pdf takes it as it is. For the
page the colours are replaced by the names of CSS variables, so that dark mode is a matter of the style sheet, letters
stay letters, and identifiers get the figure's name in front, because many figures share one page.

Units: 1 unit of the SVG is 1 px at the width in which the figure was designed (matplotlib at 72 dots per inch).
Colours: Okabe and Ito (2008), "Color Universal Design", told apart by readers with any of the three colour blindnesses;
lines differ in their dashes or their width as well. Steps of a test are ordered, so they run along the map cividis.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from html import escape
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure, SubFigure

from pipeline.report.page import PALETTE
from pipeline.report.ruling import FONT, Ruling, rule, text_width
from pipeline.report.words import Words

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

# A figure of its own, or a part of a page.
Area = Figure | SubFigure

LIGHT = {role: colours[0] for role, colours in PALETTE.items()}
DASHES: dict[str, Any] = {"inverse": "-", "balance": (0, (6, 2)), "extended": "-"}
# cividis ends in a blue and a yellow that vanish on dark and white paper: these parts of it can be seen on either
STEP_RANGE_LIGHT, STEP_RANGE_DARK = (0.0, 0.82), (0.22, 1.0)
STEP_LEVELS = 24  # neighbours of a longer test share a colour; no eye tells more of them apart

NOISE = 2.0  # standard deviations inside which figures call a residual noise; 95 % of normal errors
# Room above the axes for a legend, in px.
ONE_ROW, TWO_ROWS = 22.0, 38.0
# Between the labels of an axis and both its sides, in px.
LABEL_GAP = 10.0

STYLE: dict[RcKeyType, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "cablebend",
    "font.family": FONT,
    "font.size": 11.0,
    "axes.titlesize": 11.0,
    "axes.labelsize": 11.0,
    "legend.fontsize": 10.0,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "axes.edgecolor": LIGHT["muted"],
    "axes.labelcolor": LIGHT["ink"],
    "axes.titlecolor": LIGHT["ink"],
    "text.color": LIGHT["ink"],
    "legend.labelcolor": LIGHT["ink"],
    "xtick.color": LIGHT["muted"],
    "ytick.color": LIGHT["muted"],
    "xtick.labelcolor": LIGHT["ink"],
    "ytick.labelcolor": LIGHT["ink"],
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": LIGHT["grid"],
    "grid.linewidth": 0.8,
    "axes.linewidth": 0.8,
    "lines.linewidth": 2.0,
    "hatch.linewidth": 0.6,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
    "text.parse_math": False,  # a dollar sign in a name is a dollar sign
    "path.simplify_threshold": 0.2,
}


@dataclass(frozen=True)
class Drawing:
    """A figure ready for the page.

    Attributes
    ----------
    name : str
        Identifier on the page.
    svg : str
        The ``<svg>`` element.
    frame : dict
        Where the data are in it: ``box`` = [left, top, right, bottom] in SVG units, ``x`` and ``y`` = the limits there.
    """

    name: str
    svg: str
    frame: dict[str, list[float]] = field(default_factory=dict)


@contextmanager
def style(scale: float = 1.0) -> Iterator[None]:
    """The look of all figures, and only while they are drawn; ``scale`` makes letters and lines smaller or larger."""
    sizes = {key: scale * value for key, value in STYLE.items() if key.endswith(("size", "width"))}
    with mpl.rc_context({**STYLE, **sizes}):
        yield


def drawing(
    name: str, draw: Callable[[Area], Axes], *, size: tuple[float, float] = (400.0, 300.0), title: str, description: str
) -> Drawing:
    """Draw a figure and turn it into SVG.

    Parameters
    ----------
    name : str
        Identifier, unique on the page.
    draw : callable
        Fills a matplotlib figure and returns the axes whose data the page may point at.
    size : (width, height) px
    title, description : str
        What a reader who cannot see the figure is told.
    """
    with style():
        figure = Figure(figsize=(size[0] / 72.0, size[1] / 72.0), dpi=72)
        axes = draw(figure)
        file = io.StringIO()
        FigureCanvasSVG(figure).print_svg(file, metadata={"Date": None})
        box = axes.get_position()
        frame = {
            "box": [size[0] * box.x0, size[1] * (1 - box.y1), size[0] * box.x1, size[1] * (1 - box.y0)],
            "x": [float(v) for v in axes.get_xlim()],
            "y": [float(v) for v in axes.get_ylim()],
        }
    return Drawing(name, _compact(file.getvalue(), name, size, title, description), frame)


def step_colours(count: int) -> list[str]:
    """Light colours of so many steps in order, from dark to bright."""
    levels = [round(i / max(1, count - 1) * (STEP_LEVELS - 1)) for i in range(count)]
    return [_along(STEP_RANGE_LIGHT, level) for level in levels]


@cache
def page_colours() -> dict[str, tuple[str, str]]:
    """All CSS variables of colours: name without the dashes, and (light, dark) colour."""
    steps = {f"step{i}": (_along(STEP_RANGE_LIGHT, i), _along(STEP_RANGE_DARK, i)) for i in range(STEP_LEVELS)}
    return {**PALETTE, **steps}


def _along(part: tuple[float, float], level: int) -> str:
    share = part[0] + (part[1] - part[0]) * level / (STEP_LEVELS - 1)
    return str(mpl.colors.to_hex(mpl.colormaps["cividis"](share)))


def plot_area(
    figure: Area, *, left: float = 54.0, right: float = 12.0, top: float = TWO_ROWS, bottom: float = 42.0
) -> Axes:
    """One pair of axes with margins in px: a fixed layout costs a tenth of matplotlib's constrained one."""
    width, height = figure.bbox.width, figure.bbox.height  # in px, for all figures are drawn at 72 dots per inch
    return figure.add_axes(
        (left / width, bottom / height, (width - left - right) / width, (height - top - bottom) / height)
    )


def noise_band(axes: Axes) -> None:
    """Shade where a residual in standard deviations is called noise, about a line of zero."""
    axes.axhspan(-NOISE, NOISE, color=LIGHT["unvisited"], alpha=0.16, lw=0.0)
    axes.axhline(0.0, color=LIGHT["muted"], lw=0.8)


def label_width(labels: Iterable[str], *, most: float) -> float:
    """Room in px that labels of an axis need, at most so much: names differ in length from language to language."""
    return min(most, float(STYLE["font.size"]) * max(map(text_width, labels), default=0.0) + LABEL_GAP)


def finish(axes: Axes, words: Words, *, x: str | Ruling, y: str | Ruling, legend: int = 0) -> Axes:
    """Rule the axes with names, units and the reader's number format, put the legend above; their limits are final."""
    axes.apply_aspect()
    rule(axes, "bottom", Ruling(x) if isinstance(x, str) else x, decimal=words.decimal)
    rule(axes, "left", Ruling(y) if isinstance(y, str) else y, decimal=words.decimal)
    if legend:
        many: dict[str, float] = {"handlelength": 1.1, "columnspacing": 0.9, "handletextpad": 0.4}
        spacing = many if legend > 4 else {"columnspacing": 1.4}
        axes.legend(loc="lower left", bbox_to_anchor=(-0.02, 1.0), borderaxespad=0.1, ncols=legend, **spacing)
    return axes


def _compact(svg: str, name: str, size: tuple[float, float], title: str, description: str) -> str:
    """Inline SVG: colours become variables, numbers lose invisible digits, identifiers get the figure's name."""
    body = svg[svg.index("<defs") : svg.rindex("</svg>")]
    body = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", body, flags=re.DOTALL)
    for role, (light, _) in page_colours().items():
        body = body.replace(light, f"var(--{role})")
    used = set(re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', body))
    kept = {a or b for a, b in used}
    body = body.replace(' id="set-aside"', ' class="set-aside"')
    body = re.sub(r' id="([^"]+)"', lambda m: f' id="{name}-{m[1]}"' if m[1] in kept else "", body)
    body = re.sub(r'href="#([^"]+)"', rf'href="#{name}-\1"', body)
    body = re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", body)
    body = re.sub(r"xlink:href", "href", body)
    body = re.sub(r"<[^>]+>", lambda tag: re.sub(r"-?\d+\.\d{2,}", _hundredths, tag[0]), body)  # never the texts
    body = re.sub(r"font: ([\d.]+)px [^;\"]+", r"font-size: \1px", body)
    body = re.sub(r"\s*\n\s*", " ", body)
    body = re.sub(r"> <", "><", body)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]:g} {size[1]:g}" role="img" class="plot" '
        f'id="{name}" aria-labelledby="{name}-title {name}-desc"><title id="{name}-title">{escape(title)}</title>'
        f'<desc id="{name}-desc">{escape(description)}</desc>{body}</svg>'
    )


def _hundredths(number: re.Match[str]) -> str:
    """A coordinate to a hundredth of a pixel."""
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")

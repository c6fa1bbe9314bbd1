"""Grid, marks, labels and names of axes, drawn as few artists.

matplotlib makes five artists for every tick and measures them several times: half the processor time of a figure with
two curves. Here an axis is a collection of lines for the grid, one line of marks, and a text for each label. Positions
are in px (1/72 inch) from the frame, as matplotlib's own: marks, then a gap, the labels, a gap, the name.

The limits of the axes are final when they are ruled.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ft2font import LoadFlags
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from pipeline.rounding import fixed, plain

Array = NDArray[np.float64]
Side = Literal["bottom", "left", "right"]

# Comes with matplotlib, so that a report is the same on every machine; a page shows the font of its reader.
FONT = "DejaVu Sans"
MARK = 3.0  # length of a mark, px
GAP, NAME_GAP = 3.5, 4.0  # from marks to labels, from labels to the name, px
LINE = 1.0  # height of a line of labels over its size
MARKERS = {"bottom": "|", "left": "_", "right": "_"}
BELOW = 0.5  # drawing order of the grid: under everything drawn


@dataclass(frozen=True)
class Ruling:
    """How an axis is ruled.

    Attributes
    ----------
    name : str
        With its unit.
    at : tuple of float or None
        Places of the labels; None for round numbers.
    labels : tuple of str
        At these places; none for numbers.
    most : int
        Round numbers at the most, intervals between them.
    whole : bool
        Round numbers are whole numbers.
    grid, labelled : bool
    mark : float
        Length of the marks, px.
    lean : float
        Angle of the labels, degrees.
    """

    name: str = ""
    at: tuple[float, ...] | None = None
    labels: tuple[str, ...] = ()
    most: int = 6
    whole: bool = False
    grid: bool = True
    labelled: bool = True
    mark: float = MARK
    lean: float = 0.0


def rule(axes: Axes, side: Side, ruling: Ruling, *, decimal: str) -> None:
    """Rule one axis on one side of the frame."""
    along = axes.xaxis if side == "bottom" else axes.yaxis
    along.set_visible(False)
    low, high = sorted(axes.get_xlim() if side == "bottom" else axes.get_ylim())
    places = _round_places(low, high, ruling) if ruling.at is None else np.asarray(ruling.at, float)
    frame = 1.0 if side == "right" else 0.0
    if ruling.grid:
        _grid(axes, side, places)
    if ruling.mark:
        _marks(axes, side, places, frame, ruling.mark)
    labels = (ruling.labels or numbers(places, decimal)) if ruling.labelled else ()
    _labels(axes, side, places, frame, labels, ruling)


def _round_places(low: float, high: float, ruling: Ruling) -> Array:
    """Round numbers within the limits; what rounding puts just outside counts as inside."""
    found = np.asarray(MaxNLocator(ruling.most, integer=ruling.whole).tick_values(low, high))
    slack = 1e-9 * (high - low)
    return found[(found >= low - slack) & (found <= high + slack)]


def numbers(places: Array, decimal: str) -> tuple[str, ...]:
    """Labels with the decimal sign of the language and a true minus, all to the same decimal place."""
    values = [float(f"{place:.6g}") for place in places]
    texts = [plain(value, 4) for value in values]
    if any("·" in text for text in texts):  # with powers of ten
        return tuple(plain(value, 4, decimal=decimal) for value in values)
    digits = max((len(text.partition(".")[2]) for text in texts), default=0)
    return tuple(fixed(value, digits, decimal) for value in values)


def _grid(axes: Axes, side: Side, places: Array) -> None:
    """Lines through the whole frame, under the curves."""
    if side == "bottom":
        lines, over = [((place, 0.0), (place, 1.0)) for place in places], axes.get_xaxis_transform()
    else:
        lines, over = [((0.0, place), (1.0, place)) for place in places], axes.get_yaxis_transform()
    look = {"colors": mpl.rcParams["grid.color"], "linewidths": mpl.rcParams["grid.linewidth"]}
    axes.add_collection(LineCollection(lines, transform=over, zorder=BELOW, **look), autolim=False)


def _marks(axes: Axes, side: Side, places: Array, frame: float, length: float) -> None:
    """Marks outside the frame."""
    out = {"bottom": (0.0, -0.5 * length), "left": (-0.5 * length, 0.0), "right": (0.5 * length, 0.0)}[side]
    edge = np.full(places.size, frame)
    x, y = (places, edge) if side == "bottom" else (edge, places)
    look = {"color": mpl.rcParams["xtick.color"], "mew": mpl.rcParams["xtick.major.width"]}
    line = mpl.lines.Line2D(
        x, y, ls="none", marker=MARKERS[side], ms=length, transform=_moved(axes, side, out), clip_on=False, **look
    )
    axes.add_artist(line)


def _labels(axes: Axes, side: Side, places: Array, frame: float, labels: tuple[str, ...], ruling: Ruling) -> None:
    """Labels beside their places and the name beyond them."""
    size = FontProperties(size=mpl.rcParams["xtick.labelsize"]).get_size_in_points()
    gap = ruling.mark + GAP
    beyond = gap + size * (LINE if side == "bottom" else max(map(text_width, labels), default=0.0))
    beyond = (beyond if labels else 0.0) + NAME_GAP
    look: dict[str, Any] = {"color": mpl.rcParams["xtick.labelcolor"], "size": size}
    name: dict[str, Any] = {"color": mpl.rcParams["axes.labelcolor"], "size": mpl.rcParams["axes.labelsize"]}
    if side == "bottom":
        over = _moved(axes, side, (0.0, -gap))
        look |= {"va": "top", "ha": "right" if ruling.lean else "center"}
        look |= {"rotation": ruling.lean, "rotation_mode": "anchor"} if ruling.lean else {}
        for place, label in zip(places, labels, strict=False):
            axes.text(place, 0.0, label, transform=over, **look)
        if ruling.name:
            at = axes.transAxes + _offset(axes, (0.0, -beyond))
            axes.text(0.5, 0.0, ruling.name, transform=at, va="top", ha="center", **name)
        return
    out = 1.0 if side == "right" else -1.0
    over = _moved(axes, side, (out * gap, 0.0))
    look |= {"va": "center_baseline", "ha": "left" if side == "right" else "right"}
    for place, label in zip(places, labels, strict=False):
        axes.text(frame, place, label, transform=over, **look)
    if ruling.name:
        at = axes.transAxes + _offset(axes, (out * beyond, 0.0))
        upright: dict[str, Any] = {"rotation": "vertical", "rotation_mode": "anchor", "ha": "center"}
        axes.text(frame, 0.5, ruling.name, transform=at, va="top" if side == "right" else "bottom", **upright, **name)


def _moved(axes: Axes, side: Side, by: tuple[float, float]) -> Any:
    """Transform of places along an axis and shares of the frame across it, moved by so many px."""
    return (axes.get_xaxis_transform() if side == "bottom" else axes.get_yaxis_transform()) + _offset(axes, by)


def _offset(axes: Axes, by: tuple[float, float]) -> ScaledTranslation:
    return ScaledTranslation(by[0] / 72.0, by[1] / 72.0, axes.figure.dpi_scale_trans)


def text_width(text: str) -> float:
    """Width of a text over its font size, without kerning, which is a hundredth for words and nothing for numbers."""
    return sum(map(_advance, text))


@cache
def _advance(letter: str) -> float:
    """Width of a letter over its size."""
    size = 100.0
    font = get_font(findfont(FontProperties(family=[FONT])))
    font.set_size(size, 72.0)
    return float(font.load_char(ord(letter), flags=LoadFlags.NO_HINTING).linearHoriAdvance / 65536.0 / size)


@cache
def _letters() -> frozenset[int]:
    return frozenset(get_font(findfont(FontProperties(family=[FONT]))).get_charmap())


def printable(text: str) -> str:
    """Text in which letters that the font of the figures lacks are replaced by a box."""
    letters = _letters()
    return "".join(letter if ord(letter) in letters or letter.isspace() else "□" for letter in text)

"""Grid, marks, labels and names of axes, drawn as few artists: round numbers in the reader's format, or given names.

matplotlib makes five artists for every tick and measures them several times: a quarter of the processor time of a
report. Here an axis is a collection of lines for the grid, one line of marks, and a text for each label. Lengths are in
px (1/72 inch) from the frame, as matplotlib's own: marks, then a gap, the labels, a gap, the name.

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
from matplotlib.lines import Line2D
from matplotlib.markers import TICKDOWN, TICKLEFT, TICKRIGHT
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation

from pipeline.records import Array
from pipeline.rounding import fixed, plain

Side = Literal["bottom", "left", "right"]

# Comes with matplotlib, so that a report is the same on every machine; a page shows the font of its reader.
FONT = "DejaVu Sans"
MARK = 3.0  # length of a mark, px
GAP, NAME_GAP = 3.5, 4.0  # from marks to labels, from labels to the name, px
LINE = 1.0  # height of a line of labels over its size
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


OUT = {"bottom": (0.0, -1.0), "left": (-1.0, 0.0), "right": (1.0, 0.0)}
MARKS = {"bottom": TICKDOWN, "left": TICKLEFT, "right": TICKRIGHT}
UPRIGHT: dict[str, Any] = {"rotation": "vertical", "rotation_mode": "anchor", "ha": "center"}
LABELS = {
    "bottom": {"va": "top", "ha": "center"},
    "left": {"va": "center_baseline", "ha": "right"},
    "right": {"va": "center_baseline", "ha": "left"},
}
NAMES = {"bottom": LABELS["bottom"], "left": UPRIGHT | {"va": "bottom"}, "right": UPRIGHT | {"va": "top"}}


def rule(axes: Axes, side: Side, ruling: Ruling, *, decimal: str) -> None:
    """Rule one axis on one side of the frame."""
    flat, look = side == "bottom", mpl.rcParams
    along, over = (axes.xaxis, axes.get_xaxis_transform()) if flat else (axes.yaxis, axes.get_yaxis_transform())
    along.set_visible(False)
    low, high = sorted(along.get_view_interval())
    places = _round_places(low, high, ruling) if ruling.at is None else np.asarray(ruling.at, float)
    labels = (ruling.labels or numbers(places, decimal)) if ruling.labelled else ()
    frame = 1.0 if side == "right" else 0.0
    size = FontProperties(size=look["xtick.labelsize"]).get_size_in_points()
    gap, widest = ruling.mark + GAP, LINE if flat else max(map(text_width, labels), default=0.0)

    def at(place: Any, across: Any) -> tuple[Any, Any]:
        return (place, across) if flat else (across, place)

    def moved(by: float) -> ScaledTranslation:
        """Away from the frame by so many px."""
        right, up = OUT[side]
        return ScaledTranslation(by / 72.0 * right, by / 72.0 * up, axes.figure.dpi_scale_trans)

    if ruling.grid:
        grid = {"colors": look["grid.color"], "linewidths": look["grid.linewidth"], "zorder": BELOW}
        lines = [(at(place, 0.0), at(place, 1.0)) for place in places]
        axes.add_collection(LineCollection(lines, transform=over, **grid), autolim=False)
    if ruling.mark:
        ticks = {"marker": MARKS[side], "ms": ruling.mark, "mew": look["xtick.major.width"], "clip_on": False}
        across = np.full(places.size, frame)
        axes.add_artist(Line2D(*at(places, across), ls="none", color=look["xtick.color"], transform=over, **ticks))
    lean = {"ha": "right", "rotation": ruling.lean, "rotation_mode": "anchor"} if ruling.lean else {}
    text = {"color": look["xtick.labelcolor"], "size": size, "transform": over + moved(gap)} | LABELS[side] | lean
    for place, label in zip(places, labels, strict=False):
        axes.text(*at(place, frame), label, **text)
    name = {"color": look["axes.labelcolor"], "size": look["axes.labelsize"]} | NAMES[side]
    beyond = moved((gap + size * widest if labels else 0.0) + NAME_GAP)
    axes.text(*at(0.5, frame), ruling.name, transform=axes.transAxes + beyond, **name)


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

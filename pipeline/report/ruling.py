"""Grid, marks, labels and names of axes: round numbers as the reader writes them, or names at given places.

The limits of the axes are final when they are ruled. Lengths in px (1/72 inch).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ft2font import LoadFlags
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pipeline.rounding import fixed, plain

Array = NDArray[np.float64]
Side = Literal["bottom", "left", "right"]

# Comes with matplotlib, so that a report is the same on every machine; a page shows the font of its reader.
FONT = "DejaVu Sans"
MARK = 3.0  # length of a mark, px
GAP, NAME_GAP = 3.5, 4.0  # from marks to labels, from labels to the name, px


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
    low, high = sorted(along.get_view_interval())
    places = _round_places(low, high, ruling) if ruling.at is None else np.asarray(ruling.at, float)
    labels = (ruling.labels or numbers(places, decimal)) if ruling.labelled else [""] * places.size
    if side == "right":
        axes.yaxis.tick_right()
        axes.yaxis.set_label_position("right")
    along.set_ticks(places, labels)
    along.set_tick_params(length=ruling.mark, pad=GAP)
    along.set_label_text(ruling.name)
    along.labelpad = NAME_GAP
    along.grid(ruling.grid)
    for label in along.get_ticklabels() if ruling.lean else ():
        label.set(rotation=ruling.lean, ha="right", rotation_mode="anchor")


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

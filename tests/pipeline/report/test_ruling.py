"""Axes ruled with few artists look as matplotlib's own: the same round numbers, letters as wide as it measures them."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextToPath
from matplotlib.ticker import MaxNLocator

from pipeline.report.canvas import style
from pipeline.report.ruling import FONT, Ruling, numbers, rule, text_width


def ruled(side, ruling, *, limits, decimal="."):
    """Texts of an axis that was ruled, without its name."""
    with style():
        axes = Figure(figsize=(4.0, 3.0), dpi=72).add_axes((0.2, 0.2, 0.7, 0.7))
        (axes.set_xlim if side == "bottom" else axes.set_ylim)(*limits)
        rule(axes, side, ruling, decimal=decimal)
    return [text for text in axes.texts if text.get_text() != ruling.name]


@pytest.mark.parametrize("limits", [(0.0, 181.0), (-0.25, 18.3), (-3.1e-4, 2.9e-4), (7.0, 0.0), (1e6, 5e6)])
@pytest.mark.parametrize("side", ["bottom", "left", "right"])
def test_labels_stand_at_round_numbers_within_the_limits(side, limits):
    texts = ruled(side, Ruling("f [N]"), limits=limits)
    places = [text.get_position()[0 if side == "bottom" else 1] for text in texts]
    usual = MaxNLocator(6).tick_values(*limits)
    assert places == [v for v in usual if min(limits) <= v <= max(limits)]
    assert 2 <= len(places) <= 7


@pytest.mark.parametrize(
    ("places", "decimal", "told"),
    [
        ([0.0, 2.5, 5.0], ",", ("0,0", "2,5", "5,0")),
        ([-40.0, 0.0, 40.0], ".", ("−40", "0", "40")),
        ([0.0, 1e-6, 2e-6], ".", ("0", "1.000·10⁻⁶", "2.000·10⁻⁶")),
        ([0.30000000000000004, 0.6], ".", ("0.3", "0.6")),
    ],
)
def test_numbers_of_an_axis_have_one_decimal_place(places, decimal, told):
    assert numbers(np.array(places), decimal) == told


def test_given_labels_stand_at_given_places():
    texts = ruled("left", Ruling(at=(0, 1), labels=("slack", "bent")), limits=(1.5, -0.5))
    assert [(text.get_text(), text.get_position()[1]) for text in texts] == [("slack", 0), ("bent", 1)]
    assert ruled("left", Ruling(labelled=False), limits=(0.0, 1.0)) == []


def test_whole_numbers_on_request():
    texts = ruled("bottom", Ruling("step", whole=True), limits=(0.0, 3.0))
    assert [text.get_text() for text in texts] == ["0", "1", "2", "3"]


@pytest.mark.parametrize("text", ["−12.5", "bending stiffness f_EI = dm/dκ [mN m²]", "veränderliche Vorkrümmung"])
def test_widths_are_those_of_the_font(text):
    size = 11.0
    width, _, _ = TextToPath().get_text_width_height_descent(text, FontProperties(family=FONT, size=size), ismath=False)
    assert size * text_width(text) == pytest.approx(width, rel=0.02)  # kerning

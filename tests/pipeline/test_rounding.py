"""value ± std: the rule of the Particle Data Group with its own examples, and every awkward number."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.rounding import alike, plain, rounded


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        # Review of Particle Physics, introduction, section "Rounding"
        (0.827, 0.119, "0.83 ± 0.12"),
        (0.827, 0.367, "0.8 ± 0.4"),
        (0.827, 0.963, "0.8 ± 1.0"),
        (2.0, 0.02, "2.000 ± 0.020"),
        (-1.5, 0.4, "−1.5 ± 0.4"),
        (-0.0001, 0.4, "0.0 ± 0.4"),
        (12345.0, 500.0, "12300 ± 500"),
        (2.03e-7, 5e-9, "(2.03 ± 0.05)·10⁻⁷"),
        (5.0, 0.0, "5 (exact)"),
        (5.0, None, "5 (uncertainty not known)"),
        (5.0, math.nan, "5 (uncertainty not known)"),
        (None, 1.0, "–"),
        (math.inf, 1.0, "–"),
    ],
)
def test_value_with_standard_deviation(value, std, text):
    assert rounded(value, std) == text


def test_decimal_comma():
    assert rounded(0.827, 0.119, decimal=",") == "0,83 ± 0,12"


@pytest.mark.parametrize(
    ("value", "digits", "text"), [(0.0, 3, "0"), (8.70, 3, "8.7"), (1234567.0, 3, "1.23·10⁶"), (-0.05, 2, "−0.05")]
)
def test_plain_number(value, digits, text):
    assert plain(value, digits) == text


def test_plain_number_keeps_zeros_on_request():
    assert plain(8.7, 3, zeros=True) == "8.70"


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [(1.926, 0.0024, "1,9260"), (0.0, 0.0024, "0,0000"), (1.926, 0.0, "1,926"), (1.926, None, "1,926")],
)
def test_computed_number_in_the_column_of_a_measured_one(value, std, text):
    assert alike(value, std, decimal=",") == text


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e6))
def test_rounding_moves_a_value_by_less_than_its_uncertainty(value, std):
    text = rounded(value, std)
    scale = 1.0
    if text.startswith("("):
        text, power = text[1:].split(")·10")
        scale = 10.0 ** int(power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")))
    shown = [scale * float(part.replace("−", "-")) for part in text.split(" ± ")]
    # one digit of the deviation is kept from 3.55 on, so half a unit of it is at most 0.5 / 3.55 of the deviation
    assert abs(shown[0] - value) <= 0.142 * std
    assert abs(shown[1] - std) <= 0.142 * std

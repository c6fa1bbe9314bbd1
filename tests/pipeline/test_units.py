"""Readable units: the prefix stands before the first unit, and numbers without a unit of their own keep theirs."""

import pytest

from pipeline.units import amount_unit, suited


@pytest.mark.parametrize(
    ("value", "std", "symbol", "text"),
    [
        (0.004587, 3.4e-5, "N m", "4.587 ± 0.034\u00a0mN m"),
        (3.5e-6, 2e-6, "m", "3.5 ± 2.0\u00a0µm"),
        (999.9, 10.0, "N", "1000 ± 10\u00a0N"),
        (1000.0, 20.0, "N", "1.000 ± 0.020\u00a0kN"),
        (-5e-7, 9e-7, "m/N", "−500 ± 900\u00a0nm/N"),
        (0.00049, 2e-5, "", "0.000490 ± 0.000020"),
        (0.0029, 2e-4, "1/m", "0.00290 ± 0.00020\u00a01/m"),
        (0.0, 1.0, "m", "0.0 ± 1.0\u00a0m"),
        (None, None, "m", "–\u00a0m"),
    ],
)
def test_value_with_unit(value, std, symbol, text):
    unit = suited([] if value is None else [value], symbol)
    assert unit.text(value, std) == text


def test_decimal_sign_and_exact_numbers():
    unit = suited([0.0125], "m", decimal=",")
    assert unit.plain(0.0125, 2) == "12\u00a0mm"
    assert unit.plain(0.0125) == "12,5\u00a0mm"


def test_a_share_reads_in_per_cent():
    assert amount_unit("-", 0.0015).plain(0.0015, 2) == "0.15\u00a0%"
    assert amount_unit("-", 0.0125, decimal=",").text(0.0125, 0.0007) == "1,25 ± 0,07\u00a0%"


def test_prefixes_end_where_nobody_reads_them_any_more():
    assert suited([1e-13], "N").symbol == "nN"
    assert suited([float("nan"), float("inf")], "N").symbol == "N"

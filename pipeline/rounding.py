"""A value and its standard deviation as text: as many digits as the uncertainty supports, and never without one.

The rule is that of the Particle Data Group (Review of Particle Physics, introduction, section "Rounding"): if the three
leading digits of the standard deviation lie between 100 and 354 it keeps two digits, between 355 and 949 one, and
from 950 it is rounded up to 1000 and keeps two; the value is rounded to the same decimal place.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

# Beyond these powers of ten a fixed-point number is mostly zeros and a reader miscounts them.
LARGEST_FIXED = 5
SMALLEST_FIXED = -4
SMALLEST_P = 1e-4


def rounded(value: float | None, std: float | None, *, decimal: str = ".") -> str:
    """Text ``value ± std`` with the digits the standard deviation supports.

    Parameters
    ----------
    value : float or None
        None and not-finite values give an en dash.
    std : float or None
        Standard deviation in the unit of the value; 0 means exact, None or not finite that it is not known.
    decimal : str
        Decimal sign of the reader's language.

    Returns
    -------
    str
        Such as ``2.030 ± 0.012``, ``5 (exact)``, ``(2.03 ± 0.05)·10⁻⁷`` or ``2.03 (uncertainty not known)``.
    """
    if value is None or not math.isfinite(value):
        return "–"
    if std is None or not math.isfinite(std) or std < 0.0:
        return f"{plain(value, 3, decimal=decimal)} (uncertainty not known)"
    if std == 0.0:
        return f"{plain(value, 6, decimal=decimal)} (exact)"
    power = math.floor(math.log10(max(abs(value), std)))
    if SMALLEST_FIXED <= power <= LARGEST_FIXED:
        return " ± ".join(fixed(number, _decimals(std), decimal) for number in (value, std))
    scale = 10.0**power
    inner = " ± ".join(fixed(number / scale, _decimals(std / scale), decimal) for number in (value, std))
    return f"({inner})·10{_superscript(power)}"


def alike(value: float, std: float | None, *, decimal: str = ".") -> str:
    """Text of a computed number in a column beside measured ones with this standard deviation: to the same place."""
    if std is None or not (math.isfinite(std) and std > 0.0) or not math.isfinite(value):
        return plain(value, 5, decimal=decimal)
    power = math.floor(math.log10(max(abs(value), std)))
    readable = SMALLEST_FIXED <= power <= LARGEST_FIXED
    return fixed(value, _decimals(std), decimal) if readable else plain(value, 5, decimal=decimal)


def plain(value: float, digits: int = 3, *, decimal: str = ".", zeros: bool = False) -> str:
    """Text of a number to so many significant digits: for axes, ranges and settings, which are chosen, not measured.

    Trailing zeros are kept if ``zeros`` is true.
    """
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    power = math.floor(math.log10(abs(value)))
    if SMALLEST_FIXED <= power <= LARGEST_FIXED:
        text = fixed(value, max(0, digits - 1 - power), ".")
        text = text.rstrip("0").rstrip(".") if "." in text and not zeros else text
        return text.replace(".", decimal)
    return f"{fixed(value / 10.0**power, digits - 1, decimal)}·10{_superscript(power)}"


def digits(values: Iterable[float], count: int) -> list[float]:
    """Numbers cut to so many significant digits."""
    return [float(f"{value:.{count}g}") for value in values]


def p_value(value: float, *, decimal: str = ".") -> str:
    """Text of a p value as an equation; the tails below `SMALLEST_P` are not known to any formula."""
    if value < SMALLEST_P:
        return f"p < {plain(SMALLEST_P, decimal=decimal)}"
    return f"p = {plain(value, 2, decimal=decimal)}"


def fixed(value: float, decimals: int, decimal: str = ".") -> str:
    """Fixed-point text with a true minus sign; a negative number of decimals rounds to tens, hundreds ..."""
    text = f"{round(value, decimals):.{max(0, decimals)}f}"
    if float(text) == 0.0:
        text = text.lstrip("-")
    return text.replace("-", "−").replace(".", decimal)


def _decimals(std: float) -> int:
    """Decimal places the standard deviation supports, by the rule of the Particle Data Group; negative for tens."""
    power = math.floor(math.log10(std))
    leading = round(std / 10.0**power * 100.0)
    return (1 if leading <= 354 else 0) - power


def _superscript(power: int) -> str:
    """A power of ten in superscript digits."""
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))

"""Units with the prefix that makes the numbers readable: bending stiffnesses of cables span five powers of ten.

Only the first unit of a product takes the prefix: mN m² are thousandths of a newton times square metres. A unit that
starts with a number, such as 1/m, takes none, nor does a plain number.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from pipeline.rounding import alike, plain, rounded

PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M"}


@dataclass(frozen=True)
class Unit:
    """A unit for display: shown number = factor * number in SI units."""

    factor: float
    symbol: str
    decimal: str = "."

    def text(self, value: float | None, std: float | None) -> str:
        """Value ± standard deviation, both given in SI units, with the unit."""
        return f"{self.number(value, std)}\u00a0{self.symbol}".rstrip()

    def number(self, value: float | None, std: float | None) -> str:
        """Value ± standard deviation, both given in SI units, without the unit."""
        if value is None:
            return "–"
        return rounded(self.factor * value, None if std is None else self.factor * std, decimal=self.decimal)

    def alike(self, value: float | None, std: float | None) -> str:
        """A computed number in a column beside measured ones, both given in SI units, without the unit."""
        if value is None:
            return "–"
        return alike(self.factor * value, None if std is None else self.factor * std, decimal=self.decimal)

    def plain(self, value: float, digits: int = 3) -> str:
        """A chosen or exact number, given in SI units, with the unit."""
        return f"{plain(self.factor * value, digits, decimal=self.decimal)}\u00a0{self.symbol}".rstrip()


def suited(values: Iterable[float], symbol: str, *, decimal: str = ".") -> Unit:
    """Unit whose prefix brings the largest finite magnitude between 1 and 1000.

    Parameters
    ----------
    values : iterable of float
        In SI units.
    symbol : str
        The SI unit, such as ``N m²``; empty for a plain number.
    decimal : str
        Decimal sign of the reader's language.
    """
    largest = max((abs(v) for v in values if math.isfinite(v)), default=0.0)
    power = 0 if largest == 0.0 or not symbol[:1].isalpha() else 3 * math.floor(math.log10(largest * (1.0 + 1e-12)) / 3)
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    return Unit(10.0**-power, PREFIXES[power] + symbol, decimal)


def quantity(value: float, symbol: str, std: float | None = None, *, decimal: str = ".") -> str:
    """A number in SI units within a sentence, in the unit that suits it; with ± where its ``std`` is given."""
    unit = suited((value,), symbol, decimal=decimal)
    return unit.plain(value) if std is None else unit.text(value, std)


def amount_unit(unit: str, *amounts: float, decimal: str = ".") -> Unit:
    """Unit of amounts of a cause: the contract writes ``N m^2``, and ``-`` for a share, which is read in per cent."""
    return Unit(1e2, "%", decimal) if unit == "-" else suited(amounts, unit.replace("^2", "²"), decimal=decimal)

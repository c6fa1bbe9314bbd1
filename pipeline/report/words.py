"""The words of report and index in English and German; the numbers in the reader's format.

The table is ``templates/words.toml``: ``key = ["English", "German"]``, with ``{name}`` where a value goes. Sentences of
other rooms (findings, headline of the diagnosis) and names of causes are those of `pipeline.messages`; one that no
catalogue has, such as a finding of an older version, stays English and is marked as such on the page.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

from pipeline.messages import DECIMAL, PER, Message, catalogue, entry, sentence, word
from pipeline.rounding import fixed, p_value, plain, rounded
from pipeline.units import Unit, amount_unit

if TYPE_CHECKING:
    from pipeline.result import BlindSpot
    from pipeline.settings.report import ReportSettings

TABLE = Path(__file__).parent / "templates" / "words.toml"
CODES = TABLE.with_name("codes.toml")


@cache
def _table() -> dict[str, dict[str, Any]]:
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))


@cache
def documented_codes() -> dict[str, tuple[str, str, str, str]]:
    """Meaning and remedy of every code of a message, in English and then in German; a name may end in ``*``."""
    return {code: tuple(texts) for code, texts in tomllib.loads(CODES.read_text(encoding="utf-8")).items()}


@dataclass(frozen=True)
class Said:
    """A sentence of another room as the reader gets it, and its language; ``named`` if it starts with a given name."""

    text: str
    language: str
    named: bool = False

    def __str__(self) -> str:
        return self.text

    @property
    def sentence(self) -> str:
        """The text as a sentence of its own: a capital at its start, unless that is a name, a file or a symbol."""
        return self.text if self.named else sentence(self.text)


@dataclass(frozen=True)
class Words:
    """How a report tells things: words and numbers of one language, bands of one width.

    Parameters
    ----------
    language : str
        ``en`` or ``de``.
    coverage : float
        Share of normal errors inside a band.

    Raises
    ------
    ValueError
        For another language.
    """

    language: str = "en"
    coverage: float = 0.95

    @classmethod
    def of(cls, settings: ReportSettings) -> Words:
        """The words that settings ask for."""
        return cls(settings.language, settings.band_coverage)

    def __post_init__(self) -> None:
        if self.language not in DECIMAL:
            raise ValueError(f"language {self.language!r}: one of {', '.join(DECIMAL)}")

    @property
    def decimal(self) -> str:
        """Decimal sign."""
        return DECIMAL[self.language]

    @property
    def half_band(self) -> float:
        """Half width of a band in standard deviations."""
        return NormalDist().inv_cdf(0.5 + self.coverage / 2.0)

    @property
    def _place(self) -> int:
        """Of the language in an entry."""
        return list(DECIMAL).index(self.language)

    def __call__(self, key: str, **values: object) -> str:
        """Words for a key with values put in; a key that is not in the table is a ``KeyError``."""
        text = str(_table()["words"][key][self._place])
        return text.format(**values) if values else text

    def tip(self, key: str) -> str:
        """Meaning of a term: symbol, unit, one sentence."""
        return str(_table()["tips"][key][self._place])

    def cause(self, name: str) -> str:
        """Cause of misfit by its name of the contract; an unknown one (added by a user) as its name with blanks."""
        return word(name).said(self.language)

    def said(self, said: Message) -> Said:
        """A message in this language, as far as it is known in it."""
        text = said.said(self.language)
        named = any(text.startswith(f"{said.values.get(key) or text} ") for key in ("id", "name", "a"))
        return Said(text, "en" if said.english else self.language, named)

    def after_colon(self, said: Message) -> str:
        """A message after a colon, where a German sentence has a capital."""
        told = self.said(said)
        return told.sentence if told.language == "de" else told.text

    def about(self, cause: str) -> tuple[str, str]:
        """What a cause is and what to do about it at the rig; empty for one that the catalogue does not have."""
        known = f"cause.{cause}" in catalogue(self.language)
        texts = Message(f"cause.{cause}").parts(self.language) if known else ("", "")
        return texts[0], texts[-1]

    def blind_spot(self, key: str, spot: BlindSpot) -> str:
        """A cause that these data could not have shown, by the words ``key``: what it would do to f_EI."""
        bias = self.number(100.0 * abs(spot.stiffness_bias_at_plausible_size), 2)
        return self(key, name=self.cause(spot.name), bias=bias, settled=self.settled(spot.name))

    def settled(self, cause: str) -> str:
        """The measurement that settles a cause."""
        return entry("settled", cause).said(self.language)

    def code(self, code: str) -> tuple[str, str] | None:
        """What a message's code means and what to do about it; None for one that is not known."""
        known = documented_codes()
        family = next((name for name in known if name.endswith("*") and code.startswith(name[:-1])), "")
        texts = known.get(code) or known.get(family)
        first = 2 * self._place
        return (texts[first], texts[first + 1]) if texts else None

    def known(self, key: str, name: str) -> str:
        """Words for a key made of a name; where the table does not have it, the name with blanks."""
        row = _table()["words"].get(key)
        return str(row[self._place]) if row else name.replace("_", " ")

    def number(self, value: float, digits: int = 3) -> str:
        """A chosen or exact number."""
        return plain(value, digits, decimal=self.decimal)

    def fixed(self, value: float, decimals: int) -> str:
        """An exact number to so many decimals, as columns want it."""
        return fixed(value, decimals, self.decimal)

    def curvature(self, value: float) -> str:
        """A curvature as the end of a range, in 1/m: three digits, zeros kept."""
        return plain(value, 3, decimal=self.decimal, zeros=True)

    def probability(self, value: float) -> str:
        """A p value; see `pipeline.rounding.p_value`."""
        return p_value(value, decimal=self.decimal).removeprefix("p ").removeprefix("= ")

    def measured(self, value: float | None, std: float | None) -> str:
        """A measured number with its standard deviation."""
        text = rounded(value, std, decimal=self.decimal)
        return f"{text.partition(' (')[0]} ({self('exact')})" if std == 0.0 else text

    def unit(self, unit: str, *values: float) -> Unit:
        """A unit of the contract as one writes it (per cent for a share), its prefix suited to the values."""
        return amount_unit(unit.replace(" per ", PER[self.language]), *values, decimal=self.decimal)

"""The one error a user's file can cause.

Three kinds of trouble are never mixed: a caller's mistake is a ``ValueError``; a user's file is an `InputError`;
nature's refusal (a blurred photo, no equilibrium, an invisible parameter) is a value that travels to the report.
"""

from __future__ import annotations

import unicodedata
from pathlib import Path

# Letters of a message or a remedy. Both quote files, where a line may have a million; what is cut is their middle.
LONGEST = 600


class InputError(Exception):
    """A file or setting of the user cannot be used: what is wrong, where, and what to do, in one sentence.

    Parameters
    ----------
    message : str
        What is wrong, without the path and without a final full stop.
    path : Path or str or None
        The file or folder.
    line : int or None
        Line of the file, from 1.
    code : str
        Stable code such as ``toml/unknown-key``; every code has a folder in ``fixtures/broken``.
    remedy : str
        What to do, as an order: "rename it to length_mm".
    """

    def __init__(
        self, message: str, *, path: Path | str | None = None, line: int | None = None, code: str, remedy: str
    ) -> None:
        self.message, self.path, self.line, self.code, self.remedy = message, path, line, code, remedy
        super().__init__(self.sentence)

    @property
    def sentence(self) -> str:
        """One readable sentence: place, trouble, remedy; a single line, and nothing in it that a terminal obeys."""
        place = "" if self.path is None else f"{self.path}{'' if self.line is None else f', line {self.line}'}: "
        return printable(f"{place}{_shortened(self.message)}; {_shortened(self.remedy)}.")

    def __reduce__(self) -> tuple[object, ...]:  # keyword-only arguments survive the way back from a worker process
        return (_rebuild, (self.message, self.path, self.line, self.code, self.remedy))


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 100]} ... {text[-95:]}"


def printable(text: str) -> str:
    """Text with line ends, control letters and bytes of a name that are no text written as Python does."""
    return "".join(c if c.isprintable() or unicodedata.category(c) == "Zs" else ascii(c)[1:-1] for c in text)


def _rebuild(message: str, path: Path | str | None, line: int | None, code: str, remedy: str) -> InputError:
    return InputError(message, path=path, line=line, code=code, remedy=remedy)

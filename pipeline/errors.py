"""The one error a user's file can cause.

Three kinds of trouble are never mixed: a caller's mistake is a ``ValueError``; a user's file is an `InputError`;
nature's refusal (a blurred photo, no equilibrium, an invisible parameter) is a value that travels to the report.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import ParamSpec, TypeVar

from pipeline.messages import Message, printable

Given = ParamSpec("Given")
Read = TypeVar("Read")


class InputError(Exception):
    """A file or setting of the user cannot be used: what is wrong, where, and what to do, in one sentence.

    Parameters
    ----------
    said : Message
        What is wrong and what to do; each code has a folder in ``fixtures/broken``.
    path : Path or str or None
        The file or folder.
    line : int or None
        Line of the file, from 1.
    others : tuple of InputError
        What else is wrong with the same specimen.
    """

    def __init__(
        self,
        said: Message,
        *,
        path: Path | str | None = None,
        line: int | None = None,
        others: tuple[InputError, ...] = (),
    ) -> None:
        self.said, self.path, self.line, self.others = said, path, line, others
        super().__init__(self.sentence)

    @property
    def code(self) -> str:
        """Stable code of what is wrong, such as ``toml/unknown-key``."""
        return self.said.code

    @property
    def placed(self) -> Message:
        """The whole sentence, place, trouble and remedy, as a message."""
        if self.path is None:
            return Message("error", said=self.said)
        place = {"path": self.path, "said": self.said}
        return Message("error.file", **place) if self.line is None else Message("error.line", line=self.line, **place)

    @property
    def sentence(self) -> str:
        """One readable sentence: place, trouble, remedy; a single line, and nothing in it that a terminal obeys."""
        return printable(str(self.placed))

    def __reduce__(self) -> tuple[object, ...]:  # keyword-only arguments survive the way back from a worker process
        return partial(InputError, path=self.path, line=self.line, others=self.others), (self.said,)


class Complaints:
    """Collect what is wrong with the files of a user, so that all of it is told at once and not one by one."""

    def __init__(self) -> None:
        self._found: list[InputError] = []

    def kept(self, read: Callable[Given, Read], /, *args: Given.args, **kwargs: Given.kwargs) -> Read | None:
        """What a call returns; None where it raised an `InputError`, which is kept."""
        try:
            return read(*args, **kwargs)
        except InputError as error:
            self.note(error)
            return None

    def note(self, error: InputError) -> None:
        """Keep an error and what came with it."""
        self._found += [error, *error.others]

    def settle(self) -> None:
        """Raise the first error with all others; nothing where there is none."""
        if self._found:
            first, *others = self._found
            first.others = tuple(others)
            raise first

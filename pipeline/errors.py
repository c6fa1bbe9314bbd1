"""The one error a user's file can cause.

Three kinds of trouble are never mixed: a caller's mistake is a ``ValueError``; a user's file is an `InputError`;
nature's refusal (a blurred photo, no equilibrium, an invisible parameter) is a value that travels to the report.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from pipeline.messages import Message, free_text, printable, shortened

Given = ParamSpec("Given")
Read = TypeVar("Read")


class InputError(Exception):
    """A file or setting of the user cannot be used: what is wrong, where, and what to do, in one sentence.

    Parameters
    ----------
    said : Message or str
        What is wrong and what to do; as a text what is wrong, without the path and without a final full stop.
    path : Path or str or None
        The file or folder.
    line : int or None
        Line of the file, from 1.
    code : str
        Stable code such as ``toml/unknown-key``, that of the message by default; each has a folder in
        ``fixtures/broken``.
    remedy : str
        Beside a text: what to do, as an order: "rename it to length_mm".
    others : tuple of InputError
        What else is wrong with the same specimen.
    """

    def __init__(
        self,
        said: Message | str,
        *,
        path: Path | str | None = None,
        line: int | None = None,
        code: str = "",
        remedy: str = "",
        others: tuple[InputError, ...] = (),
    ) -> None:
        self.said = free_text(f"{shortened(said)}; {shortened(remedy)}") if isinstance(said, str) else said
        self.message, self.remedy = (said, remedy) if isinstance(said, str) else (said.parts()[0], said.parts()[-1])
        self.path, self.line, self.code, self.others = path, line, code or self.said.code, others
        self._said = said
        self._given: dict[str, Any] = {"path": path, "line": line, "code": code, "remedy": remedy}
        super().__init__(self.sentence)

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
        return partial(InputError, **self._given, others=self.others), (self._said,)


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

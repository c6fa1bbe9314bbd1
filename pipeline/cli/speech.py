"""What a command says, in the language it was asked for: results on stdout, all else on stderr, tables that fit."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Sequence

import click

from pipeline.messages import Message

LANGUAGE = "cablebend.language"
"""Name under which the context of a command keeps the language."""
NARROWEST = 40
"""Columns of a terminal; a narrower one breaks the lines itself."""


def language() -> str:
    """The language that ``--language`` asked for."""
    context = click.get_current_context(silent=True)
    return "en" if context is None else str(context.meta.get(LANGUAGE, "en"))


def told(said: Message | str) -> str:
    """A message, or a sentence that is stored in English alone, in the language of the command."""
    return said.said(language()) if isinstance(said, Message) else said


def say(key: str, /, **values: object) -> None:
    """Print a sentence as a result."""
    click.echo(told(Message(key, **values)))


def note(said: Message | str) -> None:
    """Print a sentence beside the results, marked as the program's own."""
    click.echo(f"cablebend: {told(said)}", err=True)


def complaint(error: ValueError) -> str:
    """A caller's mistake as a sentence: in the language of the command where it holds a message."""
    said = error.args[0] if error.args and isinstance(error.args[0], Message) else str(error)
    return f"{told(said).rstrip('.')}."


def columns() -> int | None:
    """Columns of the terminal that results are printed to; None in a pipe, where a line may be of any length."""
    return max(NARROWEST, shutil.get_terminal_size().columns) if sys.stdout.isatty() else None


def entry(begin: str, text: str) -> str:
    """A line of a list; in a terminal its text is wrapped beside what it begins with."""
    width = columns()
    if width is None:
        return f"{begin}{text}"
    plain = click.unstyle(begin)
    indent = " " * min(len(plain), width // 3)
    lines = textwrap.wrap(f"{plain}{text}", width, subsequent_indent=indent, break_on_hyphens=False)
    return begin + "\n".join(lines)[len(plain) :]


def table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of cells as lines, the first row above a rule; all columns but the first one are set right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *others in rows:
        right = (f"{cell:>{width}}" for cell, width in zip(others, widths[1:], strict=True))
        lines.append("  ".join((f"{first:<{widths[0]}}", *right)).rstrip())
    return [lines[0], "-" * (sum(widths) + 2 * (len(widths) - 1)), *lines[1:]]

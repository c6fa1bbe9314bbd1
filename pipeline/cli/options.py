"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

POSITIVE = click.FloatRange(min=0.0, min_open=True)


def settings_options(command: Command) -> Command:
    """Add ``--settings FILE`` and ``--set section.key=value``, as ``settings_file`` and ``assignments``."""
    command = click.option(
        "--set", "assignments", multiple=True, metavar="SECTION.KEY=VALUE", help="Change one setting; repeatable."
    )(command)
    return click.option(
        "--settings",
        "settings_file",
        type=click.Path(path_type=Path, dir_okay=False, exists=True),
        metavar="FILE",
        help="Settings in TOML; `cablebend init --settings` prints all with default, unit and reason.",
    )(command)


def language_option(command: Command) -> Command:
    """Add ``--language``, as ``language``; it is the setting ``report.language`` under a name one remembers."""
    return click.option(
        "--language",
        type=click.Choice(["de", "en"]),
        help="Language of reports, index and explanations; all else in the terminal is English. English by default.",
    )(command)


def chosen_language(language: str | None) -> tuple[str, ...]:
    """The option as an assignment of a setting. It changes no result, so it is no part of the command in one."""
    return () if language is None else (f"report.language={language}",)

"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from pipeline.cli.speech import LANGUAGE

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
    """Add ``--language``: the language of what the command says, kept where `speech` finds it."""
    return click.option(
        "--language",
        type=click.Choice(["de", "en"]),
        expose_value=False,
        is_eager=True,
        callback=_keep,
        help="Language of reports and messages; English by default. This help is English.",
    )(command)


def _keep(context: click.Context, parameter: click.Parameter, value: str | None) -> None:
    if value is not None:
        context.meta[LANGUAGE] = value


def chosen_language() -> tuple[str, ...]:
    """The language as an assignment of a setting. It changes no result, so it is no part of the command in one."""
    chosen = click.get_current_context().meta.get(LANGUAGE)
    return () if chosen is None else (f"report.language={chosen}",)

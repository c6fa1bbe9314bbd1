"""Options that several commands share."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from pipeline.cli.speech import LANGUAGE

if TYPE_CHECKING:
    from pipeline.settings import Settings

Command = TypeVar("Command", bound=Callable[..., Any])

POSITIVE = click.FloatRange(min=0.0, min_open=True)
SETTINGS_FILE, ASSIGNMENTS = "cablebend.settings_file", "cablebend.assignments"
"""Names under which the context of a command keeps what was chosen."""


def settings_options(command: Command) -> Command:
    """Add ``--language``, ``--settings FILE`` and ``--set section.key=value``, for `chosen_settings`."""
    file = click.Path(path_type=Path, dir_okay=False, exists=True)
    command = _kept("--set", "assignments", multiple=True, metavar="SECTION.KEY=VALUE")(command)
    return language_option(_kept("--settings", "settings_file", type=file, metavar="FILE")(command))


def language_option(command: Command) -> Command:
    """Add ``--language``: the language of what the command says, for `speech` and `chosen_settings`."""
    return _kept("--language", type=click.Choice(["de", "en"]))(command)


def _kept(*names: str, **look: Any) -> Callable[[Command], Command]:
    """An option whose value the context of the command keeps, under its name."""
    return click.option(*names, expose_value=False, callback=_keep, **look)


def _keep(context: click.Context, parameter: click.Parameter, value: object) -> None:
    if value is not None:
        context.meta[f"cablebend.{parameter.name}"] = value


def chosen_settings(*more: str) -> Settings:
    """Settings as the options of the command say, changed by more assignments."""
    from pipeline.cli.configuration import read_settings

    meta = click.get_current_context().meta
    # it changes no result, so it is no part of the command in one
    spoken = [f"report.language={meta[LANGUAGE]}"] if LANGUAGE in meta else []
    return read_settings(meta.get(SETTINGS_FILE), (*meta.get(ASSIGNMENTS, ()), *more, *spoken))


def chosen_options() -> str:
    """The options on settings, for the command that reproduces a result from whichever folder it is run."""
    meta = click.get_current_context().meta
    options = ["--settings", str(meta[SETTINGS_FILE].absolute())] if SETTINGS_FILE in meta else []
    for assignment in meta.get(ASSIGNMENTS, ()):
        options += ["--set", assignment]
    return shlex.join(options)

"""The group of commands. A command's module is loaded when it is called, and heavy libraries when it works."""

from __future__ import annotations

import contextlib
import importlib
import signal
from collections.abc import Iterator
from typing import Any

import click

from pipeline import __version__
from pipeline.cli.options import language_option
from pipeline.cli.speech import note
from pipeline.cli.spoken import Spoken
from pipeline.errors import InputError
from pipeline.messages import Message, by_system
from pipeline.threads import one_thread

# command -> module of this room; each module has a function of the command's name
COMMANDS = (
    "run",
    "check",
    "init",
    "report",
    "predict",
    "compare",
    "export",
    "demo",
    "simulate",
    "design",
    "explain",
    "paper",
)
INTERRUPTED = 130


class Commands(Spoken, click.Group):
    """Commands found by name in their modules; a file that cannot be used is one sentence and exit code 2."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of use."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command, loaded now."""
        if cmd_name not in COMMANDS:
            return None
        command = getattr(importlib.import_module(f"pipeline.cli.{cmd_name}"), cmd_name)
        return command if isinstance(command, click.Command) else None

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; say what a user's file or setting did wrong without a traceback."""
        try:
            with _ended_alike():
                return super().invoke(ctx)
        except click.UsageError as error:
            with (error.ctx or ctx).scope(cleanup=False):  # click itself says it when the language is forgotten
                error.show()
            ctx.exit(error.exit_code)
        except InputError as error:
            note(error.placed)
            ctx.exit(2)
        except KeyboardInterrupt:
            note(Message("cli.interrupted"))
            ctx.exit(INTERRUPTED)
        except OSError as error:
            if error.filename is None:  # a closed pipe, not a place the user named
                raise
            note(Message("cli.no-place", path=error.filename, why=by_system(error)))
            ctx.exit(2)


@contextlib.contextmanager
def _ended_alike() -> Iterator[None]:
    """SIGTERM (`kill`, a shutdown, the time limit of a cluster) ends a command as Ctrl-C does."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="cablebend")
@language_option
def main() -> None:
    """Bending stiffness characteristic of cables from photos and forces."""
    one_thread()

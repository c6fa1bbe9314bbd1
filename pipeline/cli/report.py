"""``cablebend report``: draw reports, tables and index again from stored results, without measuring."""

from __future__ import annotations

from pathlib import Path

import click

from pipeline.cli.options import chosen_settings, settings_options
from pipeline.cli.speech import note, told
from pipeline.cli.spoken import Spoken
from pipeline.errors import InputError
from pipeline.messages import Message


@click.command(cls=Spoken)
@click.argument("out", type=click.Path(path_type=Path, exists=True, file_okay=False))
@settings_options
@click.pass_context
def report(ctx: click.Context, out: Path) -> None:
    """Draw everything in the results folder OUT again without measuring, for instance with `--language de`."""
    from pipeline.batch import redraw

    settings = chosen_settings()
    drawn = 0
    for name, trouble in redraw(out, settings):
        drawn += trouble is None
        click.echo(f"{name}: {told(trouble or Message('cli.drawn'))}", err=True)
    if drawn == 0:
        note(InputError(Message("out/no-results"), path=out).placed)
        ctx.exit(3)
    click.echo(out / "index.html")

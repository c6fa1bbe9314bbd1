"""``cablebend init``: a commented specimen.toml for a folder of photos, or a commented file of all settings."""

from __future__ import annotations

from pathlib import Path

import click

from pipeline.cli.options import language_option
from pipeline.cli.speech import say


@click.command(short_help="Write a specimen.toml to fill in.")
@click.argument("folders", nargs=-1, type=click.Path(path_type=Path), metavar="[FOLDER]...")
@click.option("--settings", "as_settings", is_flag=True, help="Print all settings, with default, unit and reason.")
@language_option
def init(folders: tuple[Path, ...], as_settings: bool) -> None:
    """Write a commented specimen.toml to fill in into each FOLDER of photos.

    With --settings print all settings as TOML instead, to be saved and given to `cablebend run --settings FILE`.
    """
    from pipeline.batch.orders import quoted
    from pipeline.intake.template import write_template
    from pipeline.settings import Settings

    if as_settings:
        from pipeline.cli.configuration import commented_settings

        click.echo(commented_settings(Settings()))
        return
    if not folders:
        raise click.UsageError("give a FOLDER of photos, or --settings")
    for folder in folders:
        path = write_template(folder, Settings().intake)
        say("cli.fill-in", path=path, quoted=quoted(folder))

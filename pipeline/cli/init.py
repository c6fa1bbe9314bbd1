"""``cablebend init``: a commented specimen.toml for a folder of photos, or a commented file of all settings."""

from __future__ import annotations

from pathlib import Path

import click

from pipeline.cli.options import language_option
from pipeline.cli.speech import say
from pipeline.cli.spoken import Spoken, wrong_use


@click.command(cls=Spoken)
@click.argument("folders", nargs=-1, type=click.Path(path_type=Path), metavar="[FOLDER]...")
@click.option("--settings", "as_settings", is_flag=True)
@language_option
def init(folders: tuple[Path, ...], as_settings: bool) -> None:
    """Write a commented specimen.toml to fill in into each FOLDER of photos."""
    from pipeline.batch.orders import quoted
    from pipeline.intake.template import write_template
    from pipeline.settings import Settings

    if as_settings:
        from pipeline.cli.configuration import commented_settings

        click.echo(commented_settings(Settings()))
        return
    if not folders:
        raise wrong_use("cli.no-folder")
    for folder in folders:
        path = write_template(folder, Settings().intake)
        say("cli.fill-in", path=path, quoted=quoted(folder))

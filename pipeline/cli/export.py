"""``cablebend export``: the answer of a result as input of a simulation program."""

from __future__ import annotations

from pathlib import Path

import click

from pipeline.cli.options import language_option
from pipeline.cli.predict import MISSING
from pipeline.cli.speech import complaint, note
from pipeline.cli.spoken import Spoken

NAMES = ("table", "abaqus", "calculix", "mujoco", "pyelastica")


@click.command(cls=Spoken)
@click.argument("result", type=click.Path(path_type=Path))
@click.option("--format", "form", type=click.Choice(NAMES), default="table", show_default=True)
@click.option("--range", "bounds", nargs=2, type=float, metavar="LOW HIGH")
@click.option("-o", "--out", type=click.Path(path_type=Path, dir_okay=False))
@language_option
@click.pass_context
def export(ctx: click.Context, result: Path, form: str, bounds: tuple[float, float] | None, out: Path | None) -> None:
    """Write the answer of RESULT for a simulation program."""
    from pipeline.report.exports import export as exported
    from pipeline.report.files import write_atomic
    from pipeline.result import read_result

    try:
        text = exported(read_result(result), form, bounds=bounds)
    except ValueError as error:
        note(complaint(error))
        ctx.exit(MISSING)
    if out is None:
        click.echo(text, nl=False)
    else:
        click.echo(write_atomic(out, text))

"""``cablebend export``: the answer of a result as input of a simulation program."""

from __future__ import annotations

from pathlib import Path

import click

from pipeline.cli.options import language_option
from pipeline.cli.speech import note

MISSING = 3
NAMES = ("table", "abaqus", "calculix", "mujoco", "pyelastica")


@click.command(short_help="A result as input of a simulation program.")
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--format", "form", type=click.Choice(NAMES), default="table", show_default=True,
    help="table: bend from rest and moment in two columns; abaqus: nonlinear general beam section; calculix, mujoco "
    "(4), pyelastica: one EI, at rest bent to K0.",
)  # fmt: skip
@click.option(
    "--range", "bounds", nargs=2, type=float, metavar="LOW HIGH",
    help="Curvatures, 1/m, over which one EI stands for the characteristic; by default all that were visited.",
)  # fmt: skip
@click.option("-o", "--out", type=click.Path(path_type=Path, dir_okay=False), help="File; stdout by default.")
@language_option
@click.pass_context
def export(ctx: click.Context, result: Path, form: str, bounds: tuple[float, float] | None, out: Path | None) -> None:
    """Write the answer of RESULT for a simulation program.

    RESULT is a result.json or its folder. The first lines of the file say what was measured, how well, and what the
    program asks for that a bending test does not know.

    Exit codes: 0 written; 3 the result has no usable answer, or none in that range.
    """
    from pipeline.report.exports import export as exported
    from pipeline.report.files import write_atomic
    from pipeline.result import read_result

    try:
        text = exported(read_result(result), form, bounds=bounds)
    except ValueError as error:
        note(f"{error}.")
        ctx.exit(MISSING)
    if out is None:
        click.echo(text, nl=False)
    else:
        click.echo(write_atomic(out, text))

"""``cablebend design``: what a planned experiment could see, before it is made."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli.options import POSITIVE, settings_options

if TYPE_CHECKING:
    from pipeline.diagnosis.plans.design import Design


LEGEND = """\
plausible       a size that would surprise nobody on such a rig; visible: whether it would show
survives        share of the cause's trace that f_EI, K0, scale and length cannot take up
nearest twin    the cause with the most similar trace; 1.00: no test of this plan tells the two apart
taken apart by  what is not in the plan yet and separates it from that twin"""


@click.command(short_help="What a planned test could see.")
@click.option(
    "--length-mm", default=181.0, show_default=True, type=POSITIVE, help="Cable length between the bearing axes."
)
@click.option(
    "--ei-rest", default=0.018, show_default=True, type=POSITIVE, help="Expected bending stiffness at rest, N m^2."
)
@click.option(
    "--ei-far", default=0.008, show_default=True, type=POSITIVE, help="Expected bending stiffness far from rest, N m^2."
)
@click.option(
    "--kc", default=4.5, show_default=True, type=POSITIVE,
    help="Curvature over which one goes over into the other, 1/m.",
)  # fmt: skip
@click.option("--k0", default=2.0, show_default=True, help="Expected pre-curvature, 1/m.")
@click.option("--steps", default=3, show_default=True, type=click.IntRange(1, 100), help="Loading steps.")
@click.option("--step-mm", default=4.6, show_default=True, type=POSITIVE, help="Displacement of a step.")
@click.option("--mounted/--no-mounted", default=True, show_default=True, help="Photograph the force-free cable.")
@click.option("--unload/--no-unload", default=False, show_default=True, help="Measure the way back in the same steps.")
@click.option("--photos/--no-photos", default=True, show_default=True, help="Photos, or forces alone.")
@click.option("--px-per-mm", default=11.0, show_default=True, type=POSITIVE, help="Scale of the photos.")
@click.option(
    "--force-noise", default=0.003, show_default=True, type=POSITIVE,
    help="Noise of a force sample, share of the largest.",
)  # fmt: skip
@click.option("--samples", default=8, show_default=True, type=click.IntRange(1), help="Force samples in a hold.")
@click.option("--json", "as_json", is_flag=True, help="The outlook as JSON on stdout.")
@settings_options
def design(
    length_mm: float,
    ei_rest: float,
    ei_far: float,
    kc: float,
    k0: float,
    steps: int,
    step_mm: float,
    as_json: bool,
    settings_file: Path | None,
    assignments: tuple[str, ...],
    **plan: Any,
) -> None:
    """Say what a planned test will know of f_EI, which causes it would show, and which stay invisible."""
    from pipeline.cli.configuration import read_settings
    from pipeline.diagnosis.plans.design import Plan
    from pipeline.diagnosis.plans.design import design as outlook

    settings = read_settings(settings_file, assignments)
    try:
        planned = Plan(
            length=length_mm * 1e-3,
            stiffness=ei_rest,
            stiffness_bent=ei_far,
            transition=kc,
            pre_curvature=k0,
            displacements=tuple(step_mm * 1e-3 * number for number in range(1, steps + 1)),
            **plan,
        )
        found = outlook(planned, settings.diagnosis)
    except ValueError as error:
        raise click.UsageError(f"{error}.") from error
    if as_json:
        document = dataclasses.asdict(found) | {"extent": found.extent.model_dump()}
        click.echo(json.dumps(document, indent=1, default=lambda number: number.item()))  # numpy's own bool and float
    else:
        echo_outlook(found)


def echo_outlook(found: Design) -> None:
    """Print what will be known, then a line a cause, the most visible first."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from pipeline.rounding import plain
    from pipeline.units import amount_unit

    kappa = found.extent.kappa_per_m
    click.echo(
        f"f_EI from {plain(kappa[0])} to {plain(kappa[-1])} 1/m within {plain(100.0 * found.stiffness_std, 2)} % "
        f"(1 std, rms), K0 within {plain(found.pre_curvature_std, 2)} 1/m; "
        f"a cause shows beyond {plain(found.threshold, 2)} std"
    )
    table = Table(box=SIMPLE_HEAD)
    headings = (
        "cause",
        "shows from",
        "plausible",
        "visible",
        "survives",
        "nearest twin",
        "unseen, f_EI is off by",
        "taken apart by",
    )
    for heading in headings:
        table.add_column(heading)
    for cause in found.causes:
        least, likely = cause.minimal_detectable, cause.plausible
        cells = (
            cause.name,
            "never" if least is None else amount_unit(cause.unit, least).plain(least, 2),
            amount_unit(cause.unit, likely).plain(likely, 2),
            "yes" if cause.visible else "no",
            f"{cause.surviving_fraction:.2f}",
            f"{cause.nearest_twin} {cause.twin_cosine:.2f}" if cause.nearest_twin else "–",
            f"{plain(100.0 * cause.stiffness_bias_at_plausible_size, 2)} %",
            cause.separated_by,
        )
        table.add_row(*map(Text, cells))
    Console(width=None if Console().is_terminal else 180).print(table)
    click.echo(LEGEND)

"""``cablebend design``: what a planned experiment could see, before it is made."""

from __future__ import annotations

import dataclasses
import json
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli.options import POSITIVE, chosen_settings, settings_options
from pipeline.cli.speech import columns, complaint, entry, language, say, table, told
from pipeline.cli.spoken import Spoken
from pipeline.messages import Message

if TYPE_CHECKING:
    from pipeline.diagnosis.plans.design import Design


@click.command(cls=Spoken)
@click.option("--length-mm", default=181.0, show_default=True, type=POSITIVE)
@click.option("--ei-rest", "stiffness", default=0.018, show_default=True, type=POSITIVE)
@click.option("--ei-far", "stiffness_bent", default=0.008, show_default=True, type=POSITIVE)
@click.option("--kc", "transition", default=4.5, show_default=True, type=POSITIVE)
@click.option("--k0", "pre_curvature", default=2.0, show_default=True)
@click.option("--steps", default=3, show_default=True, type=click.IntRange(1, 100))
@click.option("--step-mm", default=4.6, show_default=True, type=POSITIVE)
@click.option("--mounted/--no-mounted", default=True, show_default=True)
@click.option("--unload/--no-unload", default=False, show_default=True)
@click.option("--photos/--no-photos", default=True, show_default=True)
@click.option("--px-per-mm", default=11.0, show_default=True, type=POSITIVE)
@click.option("--force-noise", default=0.003, show_default=True, type=POSITIVE)
@click.option("--samples", default=8, show_default=True, type=click.IntRange(1))
@click.option("--json", "as_json", is_flag=True)
@settings_options
def design(length_mm: float, steps: int, step_mm: float, as_json: bool, **plan: Any) -> None:
    """Say what a planned test will know of f_EI, which causes it would show, and which stay invisible."""
    from pipeline.diagnosis.plans.design import Plan
    from pipeline.diagnosis.plans.design import design as outlook

    settings = chosen_settings()
    try:
        displacements = tuple(step_mm * 1e-3 * number for number in range(1, steps + 1))
        planned = Plan(length=length_mm * 1e-3, displacements=displacements, **plan)
        found = outlook(planned, settings.diagnosis)
    except ValueError as error:
        raise click.UsageError(complaint(error)) from error
    if as_json:
        document = dataclasses.asdict(found) | {"extent": found.extent.model_dump()}
        click.echo(json.dumps(document, indent=1, default=lambda number: number.item()))  # numpy's own bool and float
    else:
        echo_outlook(found)


def echo_outlook(found: Design) -> None:
    """Print what will be known, then each cause, the most visible first: in a terminal with its twin below it."""
    click.echo(entry("", told(found.known)))
    heads = [told(Message(f"plan.{name}")) for name in ("cause", "from", "plausible", "visible", "off")]
    lines = table([heads, *(cause.told(language()) for cause in found.causes)])
    wide = columns() is None
    for line, twin in zip(lines, ("", "", *(told(cause.twin) for cause in found.causes)), strict=True):
        click.echo(f"{line:<78}  {twin}".rstrip() if wide else line)
        if twin and not wide:
            click.echo(entry("    ", twin))
    say("plan.legend")

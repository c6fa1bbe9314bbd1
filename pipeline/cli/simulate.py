"""``cablebend simulate``: a virtual experiment as a specimen folder, with any cause hidden in it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pipeline.cli.options import POSITIVE, language_option
from pipeline.cli.speech import complaint, say
from pipeline.cli.spoken import Spoken
from pipeline.messages import Message


def effect(ctx: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Any]:
    """Causes to hide, by name."""
    from pipeline.simulate import parse_effect

    try:
        effects = [parse_effect(text) for text in texts]
        names = [name for name, _ in effects]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(Message("misuse.twice", name=twice))
        return dict(effects)
    except ValueError as error:
        raise click.BadParameter(complaint(error)) from error


@click.command(cls=Spoken)
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@click.option("--hide", "effects", multiple=True, metavar="NAME=VALUE[,VALUE]", callback=effect)
@click.option("--length-mm", default=181.0, show_default=True, type=POSITIVE)
@click.option("--diameter-mm", default=4.6, show_default=True, type=POSITIVE)
@click.option("--ei-rest", "EI0", default=0.018, show_default=True, type=POSITIVE)
@click.option("--ei-far", "EI1", default=0.0075, show_default=True, type=POSITIVE)
@click.option("--kc", default=4.5, show_default=True, type=POSITIVE)
@click.option("--k0", "K0", default=2.0, show_default=True)
@click.option(
    "--protocol", "plan", default="loading", show_default=True, type=click.Choice(["three", "loading", "unloading"])
)
@click.option("--steps", default=6, show_default=True, type=click.IntRange(1, 200))
@click.option("--step-mm", default=2.3, show_default=True, type=POSITIVE)
@click.option("--seed", default=0, show_default=True)
@language_option
def simulate(
    folder: Path, length_mm: float, diameter_mm: float, plan: Any, steps: int, step_mm: float, **cable: Any
) -> None:
    """Bend a virtual cable, photograph it, and write a specimen FOLDER; the truth goes beside it, not into it."""
    from pipeline.simulate import Experiment, protocol, simulate_specimen

    try:
        experiment = Experiment(
            id=folder.name,
            length_m=length_mm * 1e-3,
            diameter_m=diameter_mm * 1e-3,
            displacements_m=protocol(plan, steps, step_mm * 1e-3),
            **cable,
        )
        written = simulate_specimen(folder, experiment)
    except ValueError as error:
        raise click.UsageError(complaint(error)) from error
    say("cli.simulated", folder=written.folder, truth=written.truth_file)

"""``cablebend explain``: what a cause is, what shows it, what it is confused with, what to do at the rig."""

from __future__ import annotations

import click


@click.command()
@click.argument("name", required=False)
def explain(name: str | None) -> None:
    """Explain a cause of deviations between simulation and experiment; without NAME list all causes."""
    from pipeline.diagnosis import explain as page
    from pipeline.diagnosis.causes import CATALOGUE
    from pipeline.intake.tomltable import nearest

    names = ("pre_curvature", *(cause.name for cause in CATALOGUE))
    if name is None:
        for known in names:
            title, _, text = page(known).strip().partition("\n\n")
            click.echo(f"{title}\n  {' '.join(text.partition(chr(10) * 2)[0].split())}")
        return
    if name not in names:
        raise click.BadParameter(f"no cause is called {name!r}; the nearest is {nearest(name, names)}.")
    click.echo(page(name))

"""``cablebend explain``: what a cause is, what shows it, what it is confused with, what to do at the rig."""

from __future__ import annotations

import click

from pipeline.cli.options import language_option


@click.command(short_help="What a cause is and what to do.")
@click.argument("name", required=False)
@language_option
def explain(name: str | None, language: str | None) -> None:
    """Explain a cause of deviations between simulation and experiment; without NAME list all causes."""
    from pipeline.diagnosis import explain as page
    from pipeline.diagnosis.causes import CATALOGUE
    from pipeline.intake.tomltable import nearest
    from pipeline.report.words import Words

    def told(cause: str) -> str:
        said = Words(language or "en").said(page(cause)).text
        # the name that commands and result.json know stays beside its translation
        return said if said.startswith(cause) else f"{cause}: {said}"

    names = ("pre_curvature", *(cause.name for cause in CATALOGUE))
    if name is None:
        for known in names:
            title, _, text = told(known).strip().partition("\n\n")
            click.echo(f"{title}\n  {' '.join(text.partition(chr(10) * 2)[0].split())}")
        return
    if name not in names:
        raise click.BadParameter(f"no cause is called {name!r}; the nearest is {nearest(name, names)}.")
    click.echo(told(name))

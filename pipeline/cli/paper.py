"""``cablebend paper``: the source paper's virtual experiments, as numbers and figures beside its statements."""

from __future__ import annotations

from pathlib import Path

import click

from pipeline.cli.options import language_option
from pipeline.cli.speech import entry, language
from pipeline.cli.spoken import Spoken


@click.command(cls=Spoken)
@click.option("-o", "--out", required=True, type=click.Path(path_type=Path, file_okay=False))
@language_option
def paper(out: Path) -> None:
    """Compute everything of the paper that needs no real cable: paper.json, paper.html and figures."""
    from pipeline.report.paper import statements, write_paper
    from pipeline.report.words import Words

    words = Words(language())
    labels = [f"  {words(key)}: " for key in ("paper_says", "paper_here")]
    for where, *texts in statements(write_paper(out, words), words):
        click.echo("\n".join((where, *map(entry, labels, texts))))
    click.echo(out / "paper.html")

"""``cablebend explain``: what a cause or a message is, and what to do about it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import click

from pipeline.cli.options import language_option
from pipeline.cli.speech import entry, language
from pipeline.cli.spoken import Spoken, wrong_use
from pipeline.messages import Message, catalogue

if TYPE_CHECKING:
    from pipeline.report.words import Words


LABEL = re.compile(r"\w[\w ]{,16}: +")


@click.command(cls=Spoken)
@click.argument("name", required=False)
@language_option
def explain(name: str | None) -> None:
    """Explain a cause of deviations, or the code of a message."""
    from pipeline.diagnosis.causes import CATALOGUE
    from pipeline.intake.tomltable import nearest
    from pipeline.report.words import Words, documented_codes

    words = Words(language())
    causes, codes = ("pre_curvature", *(cause.name for cause in CATALOGUE)), tuple(documented_codes())
    if name is None:
        for cause in causes:
            title, summary, _ = _cause(cause, words).split("\n\n")
            click.echo(f"{title}\n{entry('  ', summary)}")
    elif name == "codes":
        for code in codes:
            click.echo(f"{code}\n{entry('  ', (words.code(code) or ('',))[0])}")
    elif name in causes:
        click.echo("\n".join(map(_line, _cause(name, words).splitlines())))
    else:
        meant = words.code(name)
        if meant is None:
            near = nearest(name, (*causes, *codes))
            raise wrong_use("cli.no-name-near" if near else "cli.no-name", name=name, near=near)
        click.echo("\n".join((name, *map(_line, meant))))


def _line(text: str) -> str:
    """A line of a page; in a terminal what follows its label is wrapped beside it."""
    label = LABEL.match(text)
    return entry(label[0], text.removeprefix(label[0])) if label else entry("", text)


def _cause(cause: str, words: Words) -> str:
    """The page of a cause, and the forms it may have."""
    from pipeline.diagnosis import explain as page

    known = catalogue(words.language)
    forms = [texts[0] for key, texts in known.items() if key.startswith(f"form.{cause}.")]
    more = f"{Message('explain.forms', forms=forms).said(words.language)}\n" if forms else ""
    return page(cause, words.language) + more

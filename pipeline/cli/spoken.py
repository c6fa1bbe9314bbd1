"""Help and complaints about the command line in the language asked for: commands and options are in the catalogue.

``help.COMMAND`` has two texts, a short one and the page; ``help.OPTION`` or ``help.COMMAND.OPTION`` says what an option
does; ``click.NAME`` is what click itself says. `click` is translated by gettext's rule, a text for a text: its modules
ask `_` for a text each time they say it.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import click
from click import core, decorators, exceptions, formatting, parser, types

from pipeline.cli.speech import LANGUAGE, language, told
from pipeline.messages import DECIMAL, Message, catalogue


@cache
def _keys() -> dict[str, str]:
    """What click says in English, and the key it has in the catalogue."""
    return {texts[0]: key for key, texts in catalogue("en").items() if key.startswith("click.")}


def translated(text: str) -> str:
    """A text of click, its gaps open, in the language asked for; as it is where the catalogue has none."""
    return catalogue(language())[_keys()[text]][0] if text in _keys() else text


for _module in (core, decorators, exceptions, formatting, parser, types):
    vars(_module).update(_=translated, ngettext=lambda one, more, count: translated(one if count == 1 else more))


class Spoken(click.Command):
    """A command whose help is in the catalogue."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Take the language first: all that is said about other options is said in it."""
        for option, value in pairwise([*args, ""]):
            asked = value if option == "--language" else option.removeprefix("--language=")
            if asked in DECIMAL:
                ctx.meta[LANGUAGE] = asked
        return super().parse_args(ctx, args)

    def get_short_help_str(self, limit: int = 45) -> str:
        """What the command is, in the list of commands."""
        return Message(f"help.{self.name}").parts(language())[0]

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the page of the command."""
        formatter.write_paragraph()
        with formatter.indentation():
            formatter.write_text(Message(f"help.{self.name}").parts(language())[-1])

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what its options do."""
        for option in self.get_params(ctx):
            if isinstance(option, click.Option):
                name = option.opts[-1].lstrip("-")
                own = f"help.{self.name}.{name}"
                option.help = told(Message(own if own in catalogue("en") else f"help.{name}"))
        super().format_options(ctx, formatter)


def wrong_use(key: str, /, **values: object) -> click.UsageError:
    """The error of a command that was called wrongly, in its language."""
    return click.UsageError(told(Message(key, **values)))

"""``cablebend run``: specimen folders -> a folder of results."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli.options import POSITIVE, chosen_options, chosen_settings, settings_options
from pipeline.cli.speech import entry, note, say, told
from pipeline.cli.spoken import Spoken
from pipeline.errors import InputError
from pipeline.messages import UNREADABLE, Message

if TYPE_CHECKING:
    from pipeline.batch import Tally
    from pipeline.settings import IntakeSettings


@click.command(cls=Spoken)
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FOLDER...")
@click.option("-o", "--out", required=True, type=click.Path(path_type=Path, file_okay=False))
@click.option("--workers", type=click.IntRange(min=1))
@click.option("--scheduler", metavar="ADDRESS")
@click.option("--timeout", "timeout_s", type=POSITIVE, metavar="SECONDS")
@click.option("--no-reports", "reports", is_flag=True, callback=lambda ctx, option, given: "false" if given else None)
@click.option("--json", "as_json", is_flag=True)
@settings_options
@click.pass_context
def run(
    ctx: click.Context, /, folders: tuple[Path, ...], out: Path, scheduler: str | None, as_json: bool, **batch: object
) -> None:
    """Measure specimens and write their reports."""
    from pipeline.batch import Store, run_batch
    from pipeline.cli.progress import progress

    options = chosen_options()
    settings = chosen_settings(*(f"batch.{name}={value}" for name, value in batch.items() if value is not None))
    specimens, refused = found(ctx, folders, settings.intake)
    with progress(len(specimens)) as show:
        tally = run_batch(
            specimens, out, settings, scheduler=scheduler, options=options, on_outcome=show.ended, on_stage=show.doing
        )
    for sentence in tally.trouble:
        note(sentence)
    store = Store(out)
    # in the order of the folders, read one at a time
    found_again = (tally.unstored.get(name) or store.entry(name) for name in tally.names)
    entries = (stored for stored in found_again if stored is not None)
    if as_json:
        echo_json(entries, tally, out)
    else:
        echo_table(entries, tally, out)
    ctx.exit(exit_code(tally, len(refused)))


def found(
    ctx: click.Context, folders: tuple[Path, ...], settings: IntakeSettings
) -> tuple[list[Path], list[InputError]]:
    """Specimens in all folders, and what was wrong with folders, which is said on stderr.

    Without any specimen the command ends: by 2 if a folder does not exist, by 3 if there is nothing in it.
    """
    from pipeline.batch.orders import quoted
    from pipeline.intake.access import is_folder
    from pipeline.intake.folder import find_specimens, find_undescribed, folders_of_kind, misnamed

    specimens: dict[Path, None] = {}
    refused = []
    for folder in folders:
        try:
            specimens.update(dict.fromkeys(find_specimens([folder], settings)))
        except InputError as error:
            refused.append(error)
            note(error.placed)
    there = [folder for folder in folders if is_folder(folder)]
    if deep := folders_of_kind("deep", there, settings):
        note(Message("cli.too-deep", levels=settings.search_depth, count=len(deep), first=deep[0]))
    for folder in find_undescribed(there, settings):
        other = misnamed(folder)
        if other is not None and folder in folders:
            continue  # said above
        undescribed = Message("cli.undescribed", folder=folder, quoted=quoted(folder))
        note(undescribed if other is None else other.placed)
    if not specimens:
        ctx.exit(2 if any(error.code == "folder/missing" for error in refused) else 3)
    return list(specimens), refused


def exit_code(tally: Tally, refused: int = 0) -> int:
    """Exit code of the contract."""
    if tally.interrupted:
        return 130
    if tally.measured == 0:
        return 3
    return 1 if tally.failed or tally.unusable or refused or tally.trouble else 0


def echo_json(entries: Iterator[dict[str, Any]], tally: Tally, out: Path) -> None:
    """One JSON document."""
    keys = ("name", "id", "folder", "status", "headline", "code")
    document = {
        "specimens": [
            {key: stored.get(key) for key in keys} | {"usable": stored.get("state") in ("measured", "partial")}
            for stored in entries
        ],
        "counts": {"total": tally.total, "measured": tally.measured, "failed": tally.failed, "kept": tally.reused},
        "unusable": tally.unusable,
        "interrupted": tally.interrupted,
        "out": str(out),
        "trouble": list(map(str, tally.trouble)),
    }
    click.echo(json.dumps(document, indent=1))


def echo_table(entries: Iterator[dict[str, Any]], tally: Tally, out: Path) -> None:
    """One entry a specimen, then the counts and where to look."""
    width = min(30, max((len(name) for name in tally.names), default=0))
    states = {state: told(Message(f"word.{state}")) for state in ("measured", "partial", "failed", "unusable")}
    stated = max(map(len, states.values()))
    for stored in entries:
        state = states["unusable" if stored.get("state") == "unusable" else stored["status"]]
        click.echo(entry(f"{stored['name']:<{width}}  {state:<{stated}}  ", told(headline_of(stored))))
    kept = Message("cli.kept", count=tally.reused) if tally.reused else ""
    unusable = Message("cli.unusable", count=tally.unusable) if tally.unusable else ""
    counts = {"measured": tally.measured, "total": tally.total, "failed": tally.failed}
    say("cli.counts", kept=kept, unusable=unusable, index=out / "index.html", **counts)
    if tally.interrupted:
        click.echo(told(Message("cli.resume")), err=True)


def headline_of(stored: dict[str, Any]) -> Message | str:
    """What an entry says of its specimen; an entry of an earlier version holds English alone."""
    try:
        return Message.read(stored["said"])
    except UNREADABLE:
        return str(stored["headline"])

"""``cablebend check``: read everything, measure nothing, say what would run and what is wrong."""

from __future__ import annotations

import json
import threading
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli.options import POSITIVE, chosen_settings, settings_options
from pipeline.cli.run import found
from pipeline.cli.speech import entry, say, told
from pipeline.cli.spoken import Spoken
from pipeline.messages import Message

if TYPE_CHECKING:
    from pipeline.result import FindingPart
    from pipeline.settings import Settings


@click.command(cls=Spoken)
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FOLDER...")
@click.option("--timeout", type=POSITIVE, metavar="SECONDS")
@click.option("--json", "as_json", is_flag=True)
@settings_options
@click.pass_context
def check(ctx: click.Context, folders: tuple[Path, ...], timeout: float | None, as_json: bool) -> None:
    """Read specimens and look at their photos without measuring; print what would run and what is wrong, and where."""
    limit = () if timeout is None else (f"batch.timeout_s={timeout}",)
    settings = chosen_settings(*limit)
    specimens, refused = found(ctx, folders, settings.intake)
    rows = checked_all(specimens, settings)
    failed = sum(not row["runs"] for row in rows)
    wrong = sum(row["status"] == "error" for row in rows)
    if as_json:
        click.echo(json.dumps({"specimens": rows, "runs": len(rows) - failed, "errors": wrong}, indent=1))
    else:
        echo_rows(rows)
        say("cli.would-run", runs=len(rows) - failed, total=len(rows))
    ctx.exit(3 if failed == len(rows) else 1 if wrong or refused else 0)


def checked_all(folders: list[Path], settings: Settings) -> list[dict[str, Any]]:
    """What a run would find in each folder, each within its time; one without a limit is read in this process."""
    from pipeline.batch.processes import in_processes

    limit = settings.batch
    if limit.in_process or (len(folders) == 1 and "timeout_s" not in limit.model_fields_set):
        return [checked(folder, settings) for folder in folders]
    rows = in_processes(
        partial(checked_in_time, settings=settings),
        folders,
        limit,
        lost=partial(without_answer, seconds=limit.timeout_s),
        attempts=0,
        interrupted=threading.Event(),
    )
    places = {str(folder): place for place, folder in enumerate(folders)}
    return sorted(rows, key=lambda row: places[row["folder"]])


def checked(folder: Path, settings: Settings) -> dict[str, Any]:
    """What a run would find in one folder and on its photos; whatever breaks in it is told as the run would tell it."""
    from pipeline.batch.specimen import refusals
    from pipeline.intake.folder import read_specimen
    from pipeline.vision.series import look_at_photos

    try:
        specimen = read_specimen(folder, settings.intake)
        seen = look_at_photos(specimen, settings.vision)
    except Exception as error:  # one folder never costs the others
        return _failed(folder, refusals(error))
    told = dict.fromkeys((*specimen.findings, *seen))
    levels = {finding.level for finding in told}
    status = "error" if "error" in levels else "warning" if "warning" in levels else "ok"
    runs = all(finding.level != "error" for finding in seen)  # with no photo left nothing is measured
    counts = {"steps": len(specimen.steps), "photos": len(specimen.images)}
    row = {"folder": str(folder), "id": specimen.id, "status": status, "runs": runs, **counts}
    return row | {"findings": [finding.document for finding in told]}


def checked_in_time(folder: Path, tell: object, *, settings: Settings) -> dict[str, Any]:
    """The same in a process that ends when the time of a specimen is over."""
    from pipeline.batch.processes import deadline

    import_module("pipeline.vision.series")  # loaded before the time begins
    with deadline(settings.batch.timeout_s):
        return checked(folder, settings)


def without_answer(folder: Path, code: int | None, started: float, *, seconds: float) -> dict[str, Any]:
    """The row of a folder whose reading did not come to an end, because its time was over or its process died."""
    from pipeline.batch.processes import OVER
    from pipeline.batch.specimen import overdue
    from pipeline.result import FindingPart

    died = FindingPart.of("error", Message("specimen/worker-died.once"))
    return _failed(folder, [overdue(seconds) if code == OVER else died])


def _failed(folder: Path, findings: list[FindingPart]) -> dict[str, Any]:
    row = {"folder": str(folder), "id": None, "status": "error", "runs": False, "steps": 0, "photos": 0}
    return row | {"findings": [finding.model_dump() for finding in findings]}


def echo_rows(rows: list[dict[str, Any]]) -> None:
    """Print a line a specimen, and below it a line for each thing that was inferred or is wrong."""
    from pipeline.result import FindingPart

    colours = {"ok": "green", "info": "cyan", "warning": "yellow", "error": "red"}
    for row in rows:
        state = click.style(f"{told(Message('word.' + row['status'])):<8}", colours[row["status"]])
        counts = f": {_count(row, 'step')}, {_count(row, 'photo')}" if row["runs"] else ""
        click.echo(f"{state} {_name(row)}{counts}")
        for finding in row["findings"]:
            level = click.style(told(Message("word." + finding["level"])), colours[finding["level"]])
            said = FindingPart(**finding).said
            click.echo(entry(f"{'':8} {level}: ", f"{told(said)} [{finding['code']}]"))


def _name(row: dict[str, Any]) -> str:
    """The id, and the folder where that has another name: copied folders keep the id of the first."""
    if row["id"] is None:
        return str(row["folder"])
    return row["id"] if Path(row["folder"]).name == row["id"] else f"{row['id']} ({row['folder']})"


def _count(row: dict[str, Any], noun: str) -> str:
    number = row[f"{noun}s"]
    return told(Message(f"cli.{noun}" if number == 1 else f"cli.{noun}s", count=number))

"""``cablebend check``: read everything, measure nothing, say what would run and what is wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli.options import settings_options
from pipeline.cli.run import found, nothing_found
from pipeline.errors import InputError

if TYPE_CHECKING:
    from pipeline.settings import IntakeSettings


@click.command(short_help="What would run and what is wrong.")
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FOLDER...")
@click.option("--json", "as_json", is_flag=True, help="The table as JSON on stdout.")
@settings_options
@click.pass_context
def check(
    ctx: click.Context,
    folders: tuple[Path, ...],
    as_json: bool,
    settings_file: Path | None,
    assignments: tuple[str, ...],
) -> None:
    """Read specimens without measuring them; print what would run and what is wrong, with file and line."""
    from pipeline.cli.configuration import read_settings

    settings = read_settings(settings_file, assignments)
    specimens, refused = found(folders, settings.intake)
    if not specimens:
        ctx.exit(nothing_found(refused))
    rows = [checked(folder, settings.intake) for folder in specimens]
    failed = sum(row["status"] == "error" for row in rows)
    if as_json:
        click.echo(json.dumps({"specimens": rows, "runs": len(rows) - failed, "errors": failed}, indent=1))
    else:
        echo_rows(rows)
        click.echo(f"{len(rows) - failed} of {len(rows)} specimens would run")
    ctx.exit(3 if failed == len(rows) else 1 if failed or refused else 0)


def checked(folder: Path, settings: IntakeSettings) -> dict[str, Any]:
    """What a run would find in one folder."""
    from pipeline.intake.folder import read_specimen

    try:
        specimen = read_specimen(folder, settings)
    except InputError as error:
        trouble = {"code": error.code, "level": "error", "message": error.sentence}
        return {"folder": str(folder), "id": None, "status": "error", "steps": 0, "photos": 0, "findings": [trouble]}
    findings = [{"code": f.code, "level": f.level, "message": f.message} for f in specimen.findings]
    status = "warning" if any(finding["level"] != "info" for finding in findings) else "ok"
    return {
        "folder": str(folder),
        "id": specimen.id,
        "status": status,
        "steps": len(specimen.steps),
        "photos": len(specimen.images),
        "findings": findings,
    }


def echo_rows(rows: list[dict[str, Any]]) -> None:
    """A line a specimen, below it a line for each thing that was inferred or is wrong, never broken into columns."""
    colours = {"ok": "green", "info": "cyan", "warning": "yellow", "error": "red"}
    for row in rows:
        state = click.style(f"{row['status']:<8}", colours[row["status"]])
        counts = "" if row["status"] == "error" else f": {_count(row, 'step')}, {_count(row, 'photo')}"
        click.echo(f"{state} {_name(row)}{counts}")
        for finding in row["findings"]:
            level = click.style(finding["level"], colours[finding["level"]])
            click.echo(f"{'':8} {level}: {finding['message']} [{finding['code']}]")


def _name(row: dict[str, Any]) -> str:
    """The id, and the folder where that has another name: copied folders keep the id of the first."""
    if row["id"] is None:
        return str(row["folder"])
    return row["id"] if Path(row["folder"]).name == row["id"] else f"{row['id']} ({row['folder']})"


def _count(row: dict[str, Any], noun: str) -> str:
    number = row[f"{noun}s"]
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"

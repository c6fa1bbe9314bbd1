"""``specimen.toml`` -> a `Specimen` without steps and a `LogSpec`: what the user says, checked, in SI units.

The keys carry their unit in the name (``length_mm``); records carry metres. Every refusal names file and line.
"""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pipeline.errors import Complaints
from pipeline.intake.access import inside, is_folder, outside
from pipeline.intake.photohints import points, read_hints
from pipeline.intake.tomltable import (
    Check,
    TomlFile,
    check_names,
    checked_table,
    flag,
    free_text,
    nearest,
    number,
    number_in,
    one_of,
    path_text,
    read_toml,
    require,
    text,
    whole,
)
from pipeline.messages import Message
from pipeline.records import Board, CameraSpec, RigSpec, Specimen
from pipeline.settings.intake import IntakeSettings

NAME = "specimen.toml"
SIZES = ("length_mm", "diameter_mm")
DESCRIPTION = ("type", "batch", "notes", "temperature_C")
ROLES = ("step", "branch", "time", "displacement", "force", "image")
MEASURED = ("time", "displacement", "force")  # the roles that have a unit


@dataclass(frozen=True)
class LogSpec:
    """What the user says about the force log; None and empty where the file itself has to tell.

    ``columns``: role -> header text, or number of the column from 1. ``units``: role -> unit.
    ``force_sign``: which sign of the log means compression; None if the user does not say.
    """

    file: str | None = None
    columns: dict[str, str | int] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    separator: str | None = None
    decimal: Literal[".", ","] | None = None
    encoding: str | None = None
    force_sign: Literal["compression", "tension"] | None = None


# Outside, a size is surely in another unit: from a fine wire to a submarine cable, a phone at 10 m to a microscope.
LENGTH = number_in(5.0, 20_000.0, "(mm)", 1e-3)
DIAMETER = number_in(0.05, 500.0, "(mm)", 1e-3)


def read_specimen_file(folder: Path, settings: IntakeSettings) -> Specimen:
    """Read ``specimen.toml`` of a folder; see `read_source` and `described` for what is raised."""
    return described(read_source(folder, settings), folder, settings)


def read_source(folder: Path, settings: IntakeSettings) -> TomlFile:
    """Parse ``specimen.toml`` of a folder; raises `InputError` ``file/...``, ``toml/encoding`` and ``toml/syntax``."""
    path = inside(folder, NAME, allow_outside=settings.allow_outside)
    if path is None:
        raise outside(folder / NAME, NAME)
    return read_toml(path, limit=settings.toml_max_bytes)


def described(source: TomlFile, folder: Path, settings: IntakeSettings) -> Specimen:
    """What a ``specimen.toml`` says of its specimen; of what the force log is, `asked_of_log` tells.

    Raises `InputError` ``toml/...``, ``file/outside``, ``camera/...``: unknown or missing key, value that cannot be
    meant; all at once.
    """
    wrong = Complaints()
    wrong.kept(check_names, source, source.tables, (*CHECKS, "photos"))
    values = {table: wrong.kept(checked_table, source, table, checks) or {} for table, checks in CHECKS.items()}
    wrong.kept(_check_sizes_given, source)
    camera = wrong.kept(_camera, source, values["camera"], folder, settings)
    hints = wrong.kept(read_hints, source)
    wrong.settle()
    assert camera is not None and hints is not None
    cable, rig = values["specimen"], values["rig"]
    return Specimen(
        id=cable.get("id", folder_name(folder)),
        folder=folder,
        length_m=cable["length_mm"],
        diameter_m=cable["diameter_mm"],
        camera=camera,
        rig=RigSpec(
            moving_bearing=rig.get("moving_bearing", "left"),
            marker_diameter_m=rig.get("bearing_marker_mm"),
            bearings_px=rig.get("bearings_px"),
            force_sign=rig.get("force_sign", "compression"),
        ),
        steps=(),
        images={},
        description={key: cable[key] for key in DESCRIPTION if key in cable},
        hints=hints,
    )


def asked_of_log(source: TomlFile) -> LogSpec:
    """What the user says about the force log in a file of which other parts may be wrong; raises as `described`."""
    log, rig = (checked_table(source, table, CHECKS[table]) for table in ("force_log", "rig"))
    return LogSpec(**log, force_sign=rig.get("force_sign"))


def _check_sizes_given(source: TomlFile) -> None:
    """Refuse a cable without length or diameter, unless a misspelt key is told that means it."""
    given = source.tables.get("specimen", {})
    if not isinstance(given, dict):
        return
    meant = {*given, *(nearest(key, SIZES) for key in given)}
    missing = [key for key in SIZES if key not in meant]
    if missing:
        add = [Message(f"toml/missing-key.{key}") for key in missing]
        key = "toml/missing-key" if len(missing) == 1 else "toml/missing-key.several"
        raise source.error(Message(key, names=missing, add=add), table="specimen")


def _camera(source: TomlFile, values: dict[str, Any], folder: Path, settings: IntakeSettings) -> CameraSpec:
    calibration: Path | None = None
    if "calibration" in values:
        name = values["calibration"]
        calibration = inside(folder, name, allow_outside=settings.allow_outside)
        if calibration is None:
            raise outside(source.path, name, source.line_of("camera", "calibration"))
        if not is_folder(calibration):
            told = Message("camera/no-calibration-folder", name=repr(name))
            raise source.error(told, table="camera", key="calibration")
        if "board" not in values:
            raise source.error(Message("camera/no-board"), table="camera", key="calibration")
    return CameraSpec(
        scale_px_per_m=values.get("scale_px_per_mm"),
        calibration=calibration,
        board=values.get("board"),
        distance_m=values.get("distance_mm"),
    )


def folder_name(folder: Path) -> str:
    """The folder's own name as an id; its real one if it was given as ``.``."""
    return plain_name(folder.name if folder.name not in ("", "..") else folder.resolve().name)


def plain_name(name: str) -> str:
    """A name any file system takes: what no file name may hold becomes ``_``."""
    return "".join("_" if _forbidden(char) else char for char in name).strip(".") or "specimen"


def _identifier(value: Any) -> str:
    """An id becomes a folder name on any system."""
    name = text(value)
    require(len(name.encode()) <= 120 and name == name.strip(".") and not any(map(_forbidden, name)), "wanted.name")
    return name


def _forbidden(char: str) -> bool:
    return char in '/\\:*?"<>|' or unicodedata.category(char).startswith("C")


def _board(value: Any) -> Board:
    require(isinstance(value, dict) and {"columns", "rows", "square_mm"} <= value.keys(), "wanted.board")
    require(value.keys() <= {"columns", "rows", "square_mm", "charuco", "marker_mm"}, "wanted.board.keys")
    side, count = number_in(0.1, 1000.0, "(mm)", 1e-3), whole(2, 1000)
    return Board(
        columns=count(value["columns"]),
        rows=count(value["rows"]),
        square_m=side(value["square_mm"]),
        charuco=flag(value.get("charuco", False)),
        marker_m=side(value["marker_mm"]) if "marker_mm" in value else None,
    )


def _columns(value: Any) -> dict[str, str | int]:
    require(isinstance(value, dict) and value.keys() <= set(ROLES), "wanted.columns", roles=ROLES)
    position = whole(1, 1000)
    names = {role: position(name) if isinstance(name, int) else text(name) for role, name in value.items()}
    require(len(set(names.values())) == len(names), "wanted.columns.different", roles=ROLES)
    return names


def _units(value: Any) -> dict[str, str]:
    require(isinstance(value, dict) and value.keys() <= set(MEASURED), "wanted.units")
    return {role: text(unit) for role, unit in value.items()}


CHECKS: dict[str, dict[str, Check]] = {
    "specimen": {
        "id": _identifier,
        "length_mm": LENGTH,
        "diameter_mm": DIAMETER,
        "type": free_text,
        "batch": free_text,
        "notes": free_text,
        "temperature_C": lambda value: f"{number(value):g}",
    },
    "camera": {
        "scale_px_per_mm": number_in(0.05, 5_000.0, "(px/mm)", 1e3),
        "calibration": path_text,
        "board": _board,
        "distance_mm": number_in(1.0, 1e6, "(mm)", 1e-3),
    },
    "rig": {
        "moving_bearing": one_of("left", "right"),
        "bearing_marker_mm": DIAMETER,
        "bearings_px": points(2, "wanted.bearings", most=2),
        "force_sign": one_of("compression", "tension"),
    },
    "force_log": {
        "file": path_text,
        "columns": _columns,
        "units": _units,
        "separator": one_of(";", ",", "\t"),
        "decimal": one_of(".", ","),
        "encoding": one_of("utf-8", "cp1252", "utf-16"),
    },
}
"""Known tables, their keys and the values these may hold; numbers with a unit leave in SI."""

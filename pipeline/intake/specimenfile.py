"""``specimen.toml`` -> `SpecimenFile`: what the user says about cable, camera, rig and force log, checked, in SI units.

The keys carry their unit in the name (``length_mm``); records carry metres. Every refusal names file and line.
"""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pipeline.intake.access import inside, is_folder, outside
from pipeline.intake.photohints import read_hints
from pipeline.intake.tomltable import (
    Check,
    TomlFile,
    check_names,
    checked_table,
    flag,
    free_text,
    number,
    number_in,
    one_of,
    path_text,
    read_toml,
    text,
    whole,
)
from pipeline.records import Board, CameraSpec, PhotoHints, RigSpec
from pipeline.settings.intake import IntakeSettings

NAME = "specimen.toml"
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
    decimal: str | None = None
    encoding: str | None = None
    force_sign: Literal["compression", "tension"] | None = None


@dataclass(frozen=True)
class SpecimenFile:
    """The contents of ``specimen.toml``. ``source`` finds the line of a key for later complaints."""

    id: str
    length_m: float
    diameter_m: float
    camera: CameraSpec
    rig: RigSpec
    log: LogSpec
    description: dict[str, str]
    source: TomlFile
    hints: dict[str, PhotoHints] = field(default_factory=dict)


def read_specimen_file(folder: Path, settings: IntakeSettings) -> SpecimenFile:
    """Read ``specimen.toml`` of a folder.

    Raises
    ------
    InputError
        Codes ``file/...`` and ``toml/...``: not readable, not TOML, unknown or missing key, value that cannot be meant.
    """
    path = inside(folder, NAME, allow_outside=settings.allow_outside)
    if path is None:
        raise outside(folder / NAME, NAME)
    source = read_toml(path, limit=settings.toml_max_bytes)
    tables = _checks(settings)
    check_names(source, source.tables, (*tables, "photos"))
    values = {table: checked_table(source, table, checks) for table, checks in tables.items()}
    cable = values["specimen"]
    lengths = {"length_mm": "the cable length between the bearing axes", "diameter_mm": "the diameter of the cable"}
    _require(source, cable, lengths)
    return SpecimenFile(
        id=cable.get("id", folder_name(folder)),
        length_m=cable["length_mm"] * 1e-3,
        diameter_m=cable["diameter_mm"] * 1e-3,
        camera=_camera(source, values["camera"], folder, settings),
        rig=_rig(values["rig"]),
        log=_log(values["force_log"], values["rig"]),
        description={key: cable[key] for key in DESCRIPTION if key in cable},
        source=source,
        hints=read_hints(source),
    )


def _checks(settings: IntakeSettings) -> dict[str, dict[str, Check]]:
    """Known tables, their keys and the values these may hold."""
    return {
        "specimen": {
            "id": _identifier,
            "length_mm": number_in(*settings.length_range_mm, "(mm)"),
            "diameter_mm": number_in(*settings.diameter_range_mm, "(mm)"),
            "type": free_text,
            "batch": free_text,
            "notes": free_text,
            "temperature_C": lambda value: f"{number(value):g}",
        },
        "camera": {
            "scale_px_per_mm": number_in(*settings.scale_range_px_per_mm, "(px/mm)"),
            "calibration": path_text,
            "board": _board,
            "distance_mm": number_in(1.0, 1e6, "(mm)"),
        },
        "rig": {
            "moving_bearing": one_of("left", "right"),
            "bearing_marker_mm": number_in(*settings.diameter_range_mm, "(mm)"),
            "bearings_px": _bearings,
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


def _require(source: TomlFile, cable: dict[str, Any], needed: dict[str, str]) -> None:
    """Refuse a table that lacks keys; all of them are named at once."""
    missing = [key for key in needed if key not in cable]
    if missing:
        names = " and ".join(missing)
        raise source.error(
            f"{names} is missing in [specimen]" if len(missing) == 1 else f"{names} are missing in [specimen]",
            table="specimen",
            code="toml/missing-key",
            remedy=f"add {' and '.join(f'{key} = ..., {needed[key]}' for key in missing)}",
        )


def _camera(source: TomlFile, values: dict[str, Any], folder: Path, settings: IntakeSettings) -> CameraSpec:
    calibration: Path | None = None
    if "calibration" in values:
        name = values["calibration"]
        calibration = inside(folder, name, allow_outside=settings.allow_outside)
        if calibration is None:
            raise outside(source.path, name, lambda: source.line_of("camera", "calibration"))
        if not is_folder(calibration):
            raise source.error(
                f"the calibration folder {name!r} does not exist",
                table="camera",
                key="calibration",
                code="camera/no-calibration-folder",
                remedy="correct the name, or give scale_px_per_mm instead",
            )
        if "board" not in values:
            raise source.error(
                "calibration needs the size of the board",
                table="camera",
                key="calibration",
                code="camera/no-board",
                remedy="add board = {columns = .., rows = .., square_mm = ..} with the inner corners and the "
                "measured side of a square",
            )
    scale, distance = values.get("scale_px_per_mm"), values.get("distance_mm")
    return CameraSpec(
        scale_px_per_m=None if scale is None else scale * 1e3,
        calibration=calibration,
        board=values.get("board"),
        distance_m=None if distance is None else distance * 1e-3,
    )


def _rig(values: dict[str, Any]) -> RigSpec:
    marker = values.get("bearing_marker_mm")
    return RigSpec(
        moving_bearing=values.get("moving_bearing", "left"),
        marker_diameter_m=None if marker is None else marker * 1e-3,
        bearings_px=values.get("bearings_px"),
        force_sign=values.get("force_sign", "compression"),
    )


def _log(values: dict[str, Any], rig: dict[str, Any]) -> LogSpec:
    return LogSpec(**values, force_sign=rig.get("force_sign"))


def folder_name(folder: Path) -> str:
    """The folder's own name as an id; its real one if it was given as ``.``."""
    return plain_name(folder.name if folder.name not in ("", "..") else folder.resolve().name)


def plain_name(name: str) -> str:
    """A name any file system takes: what no file name may hold becomes ``_``."""
    return "".join("_" if _forbidden(char) else char for char in name).strip(".") or "specimen"


def _identifier(value: Any) -> str:
    """An id becomes a folder name on any system."""
    name = text(value)
    if len(name.encode()) > 120 or name[0] == "." or name[-1] == "." or any(_forbidden(char) for char in name):
        raise ValueError('a short name without / \\ : * ? " < > | and without a dot at either end')
    return name


def _forbidden(char: str) -> bool:
    return char in '/\\:*?"<>|' or unicodedata.category(char).startswith("C")


def _board(value: Any) -> Board:
    wanted = "{columns = 9, rows = 6, square_mm = 10.0}, counting inner corners"
    if not isinstance(value, dict) or not {"columns", "rows", "square_mm"} <= value.keys():
        raise ValueError(wanted)
    if not value.keys() <= {"columns", "rows", "square_mm", "charuco", "marker_mm"}:
        raise ValueError(f"{wanted}; besides these only charuco and marker_mm are known")
    side, count = number_in(0.1, 1000.0, "(mm)"), whole(2, 1000)
    return Board(
        columns=count(value["columns"]),
        rows=count(value["rows"]),
        square_m=side(value["square_mm"]) * 1e-3,
        charuco=flag(value.get("charuco", False)),
        marker_m=side(value["marker_mm"]) * 1e-3 if "marker_mm" in value else None,
    )


def _bearings(value: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    wanted = "[[x, y], [x, y]], left and right axis in pixels of the first photo"
    if not isinstance(value, list) or len(value) != 2 or any(not isinstance(p, list) or len(p) != 2 for p in value):
        raise ValueError(wanted)
    (x0, y0), (x1, y1) = ((number(p[0]), number(p[1])) for p in value)
    if (x0, y0) == (x1, y1) or max(map(abs, (x0, y0, x1, y1))) > 1e6:
        raise ValueError(f"two different points, {wanted}")
    return (x0, y0), (x1, y1)


def _columns(value: Any) -> dict[str, str | int]:
    wanted = '{force = "Kraft [N]", displacement = "Weg [mm]"}, roles ' + ", ".join(ROLES)
    if not isinstance(value, dict) or not value.keys() <= set(ROLES):
        raise ValueError(wanted)
    position = whole(1, 1000)
    names = {role: position(name) if isinstance(name, int) else text(name) for role, name in value.items()}
    if len(set(names.values())) < len(names):
        raise ValueError(f"a different column for each role, {wanted}")
    return names


def _units(value: Any) -> dict[str, str]:
    if not isinstance(value, dict) or not value.keys() <= set(MEASURED):
        raise ValueError('{force = "mN", displacement = "mm", time = "s"}')
    return {role: text(unit) for role, unit in value.items()}

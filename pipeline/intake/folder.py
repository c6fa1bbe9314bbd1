"""From a folder on disk to a `Specimen`: read, checked, every inference a finding; nothing is measured.

A folder is a specimen if it holds a ``specimen.toml``. The force log and the photos lie beside it, see `forcelog` and
`photos`. Bad input never loses anything: a bad file is one `InputError` with path, line and remedy, a bad photo is a
finding and the rest of the specimen is read.
"""

from __future__ import annotations

import math
import os
import stat
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal

from pipeline.errors import Complaints, InputError
from pipeline.intake.access import inside, is_folder, outside, sha256, unreadable
from pipeline.intake.forcelog import read_force_log
from pipeline.intake.photohints import obeyed
from pipeline.intake.photos import NO_PHOTO, checked_photo, list_photos, match_photos, natural_key, no_photos
from pipeline.intake.plausibility import size_findings
from pipeline.intake.specimenfile import NAME, LogSpec, asked_of_log, described, read_source
from pipeline.intake.tomltable import TomlFile
from pipeline.messages import Message
from pipeline.records import Finding, Specimen, inferred
from pipeline.settings.intake import IntakeSettings

LOG_NAME = "force.csv"
SPREADSHEETS = (".xlsx", ".xls", ".xlsm", ".ods")
LOG_SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".asc")
Kind = Literal["specimen", "none", "deep"]


def find_specimens(paths: Iterable[Path], settings: IntakeSettings) -> list[Path]:
    """Specimen folders among and below the given folders, in natural order and without doubles.

    Links to folders are followed, but no folder is searched twice, and a specimen folder not further. A folder that
    cannot be looked into is among them, so that reading it tells what is in the way.

    Raises `InputError` ``folder/missing`` for a path that is no folder, ``file/unreadable`` for one that cannot be
    looked at, ``folder/no-specimen`` if there is none in one of the paths.
    """
    found: dict[Path, None] = {}
    for path in paths:
        _check_folder(path)
        here = folders_of_kind("specimen", [path], settings)
        if not here:
            raise misnamed(path) or InputError(Message("folder/no-specimen"), path=path)
        found.update(dict.fromkeys(here))
    return list(found)


def _check_folder(path: Path) -> None:
    """Refuse what is no folder, or cannot be looked at."""
    try:
        there = stat.S_ISDIR(path.stat().st_mode)
    except (FileNotFoundError, NotADirectoryError):
        there = False
    except OSError as error:
        raise unreadable(path, error) from error
    if not there:
        raise InputError(Message("folder/missing"), path=path)


def misnamed(folder: Path) -> InputError | None:
    """What to say of a folder with a ``specimen.toml`` in capitals, which not every system finds."""
    try:
        other = next((e.name for e in folder.iterdir() if e.name != NAME and e.name.casefold() == NAME), None)
    except OSError:
        return None
    return None if other is None else InputError(Message("folder/no-specimen.capitals", other=other), path=folder)


def find_undescribed(paths: Iterable[Path], settings: IntakeSettings) -> list[Path]:
    """Folders that hold photos and a table but no ``specimen.toml``: specimens somebody forgot to describe."""
    return [folder for folder in folders_of_kind("none", paths, settings) if _looks_like_one(folder, settings)]


def folders_of_kind(kind: Kind, paths: Iterable[Path], settings: IntakeSettings) -> list[Path]:
    """Folders of one kind among and below the given ones, without doubles; ``deep`` ones are not searched."""
    searched = (step for path in paths for step in _search(path, set(), settings.search_depth))
    return list(dict.fromkeys(folder for folder, found in searched if found == kind))


def _looks_like_one(folder: Path, settings: IntakeSettings) -> bool:
    """Whether a folder holds photos and a table."""
    try:
        return bool(candidate_logs(folder) and list_photos(folder, without=None, settings=settings))
    except InputError:  # more photos than are read
        return True
    except OSError:
        return False


def _search(folder: Path, seen: set[tuple[int, int]], depth: int) -> Iterator[tuple[Path, Kind]]:
    """Folders on the way down, and what each is; a specimen is not searched further.

    A folder that cannot be looked into may be one: reading it says what is in the way. ``seen`` are the identities of
    the folders searched before: many ways lead through links, and all but the first are passed over.
    """
    try:
        status = folder.stat()
        identity = (status.st_dev, status.st_ino)
        described = _is_there(folder / NAME)
        below = [] if described or identity in seen else _folders_in(folder)
    except OSError:
        yield folder, "specimen"
        return
    if described or identity not in seen:
        yield folder, "specimen" if described else "none"
    if depth == 0:
        yield from ((folder / name, "deep") for name in below)
    elif not described:
        seen.add(identity)
        for name in below:
            yield from _search(folder / name, seen, depth - 1)


def _is_there(path: Path) -> bool:
    """Whether a name stands in a folder, whatever it is; OSError if the folder does not let one see."""
    try:
        path.lstat()
    except FileNotFoundError:
        return False
    return True


def _folders_in(folder: Path) -> list[str]:
    """Names of the folders in a folder, hidden ones left out, in natural order; OSError if it cannot be listed."""
    with os.scandir(folder) as entries:
        names = [entry.name for entry in entries if not entry.name.startswith(".") and is_folder(folder / entry.name)]
    return sorted(names, key=natural_key)


def read_specimen(folder: Path, settings: IntakeSettings) -> Specimen:
    """Read and check the folder of a ``specimen.toml``: the steps of its force log, its photos, and findings; SI units.

    Raises
    ------
    InputError
        If a file cannot be used, whatever the operating system has against it; photos never raise as long as one is
        left. All that is wrong with description, log and photos comes together.
    """
    try:
        return _specimen(folder, settings)
    except OSError as error:
        raise unreadable(folder if error.filename is None else Path(os.fsdecode(error.filename)), error) from error


def _specimen(folder: Path, settings: IntakeSettings) -> Specimen:
    wrong = Complaints()
    source = wrong.kept(read_source, folder, settings)
    file = wrong.kept(described, source, folder, settings) if source else None
    # what is wrong with it is told with the rest of the description
    asked = Complaints().kept(asked_of_log, source) if source else None
    place = wrong.kept(_log_path, folder, asked, source, settings) if source and asked else None
    length = file.length_m if file else math.inf
    log = wrong.kept(read_force_log, place[0], asked, settings, length) if place and asked else None
    if asked is None and not candidate_logs(folder):
        wrong.note(_no_log(folder))
    calibration = file.camera.calibration if file else None
    photos = None
    if place and log:
        photos = wrong.kept(
            match_photos, folder, log.steps, calibration=calibration, log_name=place[0].name, settings=settings
        )
    elif not list_photos(folder, without=calibration, settings=settings):
        wrong.note(no_photos(folder, settings))
    calibrating = wrong.kept(_calibration_photos, folder, calibration, source, settings) if source else None
    wrong.settle()
    assert file and place and log and photos and calibrating
    (log_path, noted), (calibrated, doubts) = place, calibrating
    steps, hinted = obeyed(photos.steps, file.hints)
    scale = file.camera.scale_px_per_m
    sizes = size_findings(file.length_m, file.diameter_m, photos.steps, scale_px_per_m=scale, settings=settings)
    names = {NAME: folder / NAME, log_path.relative_to(folder).as_posix(): log_path}
    return replace(
        file,
        steps=steps,
        images=photos.paths,
        findings=(*noted, *log.findings, *photos.findings, *hinted, *doubts, *sizes),
        hashes={name: sha256(path) for name, path in names.items()} | photos.hashes | calibrated,
    )


def _log_path(folder: Path, asked: LogSpec, source: TomlFile, settings: IntakeSettings) -> tuple[Path, list[Finding]]:
    """The force log: the one named, else ``force.csv``, else the only text table in the folder."""
    names = [LOG_NAME] if os.path.lexists(folder / LOG_NAME) else candidate_logs(folder)
    if asked.file is None and not names:
        raise _no_log(folder)
    if asked.file is None and len(names) > 1:
        raise InputError(Message("folder/several-logs", names=names[:5], first=names[0]), path=folder)
    name = asked.file or names[0]
    path = inside(folder, name, allow_outside=settings.allow_outside)
    if path is None:
        raise outside(source.path if asked.file else folder / name, name, source.line_of("force_log", "file"))
    if not os.path.lexists(path):
        raise source.error(Message("folder/no-force-log.named", name=repr(name)), table="force_log", key="file")
    return path, [] if name in (asked.file, LOG_NAME) else [inferred("log/file-inferred", file=name)]


def _no_log(folder: Path) -> InputError:
    sheets = sorted(entry.name for entry in folder.iterdir() if entry.suffix.casefold() in SPREADSHEETS)
    key = "folder/no-force-log.sheet" if sheets else "folder/no-force-log"
    return InputError(Message(key, log=LOG_NAME, sheet=next(iter(sheets), "")), path=folder)


def candidate_logs(folder: Path) -> list[str]:
    """Files beside ``specimen.toml`` that may be a force log, in natural order."""
    names = [entry.name for entry in folder.iterdir() if entry.suffix.casefold() in LOG_SUFFIXES]
    return sorted((name for name in names if not NO_PHOTO.search(name)), key=natural_key)


def _calibration_photos(
    folder: Path, place: Path | None, source: TomlFile, settings: IntakeSettings
) -> tuple[dict[str, str], list[Finding]]:
    """Hashes of the calibration photos, and what is wrong with some of them.

    Raises `InputError` ``camera/no-calibration-photos``, ``file/outside``.
    """
    if place is None:
        return {}, []
    names = list_photos(place, without=None, settings=settings)
    if not names:
        raise source.error(Message("camera/no-calibration-photos"), table="camera", key="calibration")
    hashes: dict[str, str] = {}
    findings: list[Finding] = []
    for name in names:
        within = os.path.relpath(place / name, folder)
        if inside(folder, within, allow_outside=settings.allow_outside) is None:
            raise outside(place / name, name)
        path, digest, trouble = checked_photo(folder, within, settings)
        findings += trouble
        if path is not None:
            hashes[f"{place.name}/{name}"] = digest
    return hashes, findings

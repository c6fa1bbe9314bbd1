"""From a folder on disk to a `Specimen`: read, checked, every inference a finding; nothing is measured.

A folder is a specimen if it holds a ``specimen.toml``. The force log and the photos lie beside it, see `forcelog` and
`photos`. Bad input never loses anything: a bad file is one `InputError` with path, line and remedy, a bad photo is a
finding and the rest of the specimen is read.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from pipeline.errors import InputError
from pipeline.intake.access import inside, outside, sha256
from pipeline.intake.forcelog import read_force_log
from pipeline.intake.noted import inferred
from pipeline.intake.photos import NO_PHOTO, list_photos, match_photos, natural_key
from pipeline.intake.plausibility import size_findings
from pipeline.intake.specimenfile import NAME, SpecimenFile, read_specimen_file
from pipeline.records import Finding, Specimen
from pipeline.settings.intake import IntakeSettings

LOG_NAME = "force.csv"
LOG_SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".asc")


def find_specimens(paths: Iterable[Path], settings: IntakeSettings) -> list[Path]:
    """Specimen folders among and below the given folders, in natural order and without doubles.

    Links to folders are followed, but not in circles. A specimen folder is not searched further.

    Raises
    ------
    InputError
        ``folder/missing`` for a path that is no folder, ``folder/no-specimen`` if there is none in one of the paths.
    """
    found: dict[Path, None] = {}
    for path in paths:
        if not path.is_dir():
            raise InputError(
                "is no folder", path=path, code="folder/missing", remedy="give a specimen folder or one above"
            )
        here = [folder for folder in _search(path, (), settings.search_depth) if os.path.lexists(folder / NAME)]
        if not here:
            other = misnamed(path)
            if other is not None:
                raise other
            raise InputError(
                f"holds no {NAME}, neither itself nor in its folders",
                path=path,
                code="folder/no-specimen",
                remedy="write one with `cablebend init`",
            )
        found.update(dict.fromkeys(here))
    return list(found)


def misnamed(folder: Path) -> InputError | None:
    """What to say of a folder with a ``specimen.toml`` in capitals, which not every system finds."""
    try:
        other = next((e.name for e in folder.iterdir() if e.name != NAME and e.name.casefold() == NAME), None)
    except OSError:
        return None
    if other is None:
        return None
    return InputError(
        f"holds {other}, but no {NAME}",
        path=folder,
        code="folder/no-specimen",
        remedy=f"write its name in small letters: {NAME}",
    )


def find_undescribed(paths: Iterable[Path], settings: IntakeSettings) -> list[Path]:
    """Folders that hold photos and a table but no ``specimen.toml``: specimens somebody forgot to describe."""
    searched = (folder for path in paths for folder in _search(path, (), settings.search_depth))
    return [
        folder
        for folder in dict.fromkeys(searched)
        if not os.path.lexists(folder / NAME)
        and candidate_logs(folder)
        and list_photos(folder, without=None, settings=settings)
    ]


def _search(folder: Path, above: tuple[tuple[int, int], ...], depth: int) -> Iterator[Path]:
    """All folders on the way down to specimens, and these, which are not searched further.

    ``above`` are the identities of the folders above, to notice a circle of links.
    """
    yield folder
    if os.path.lexists(folder / NAME):
        return
    try:
        status = folder.stat()
        entries = sorted((entry.name for entry in folder.iterdir() if entry.is_dir()), key=natural_key)
    except OSError:
        return
    identity = (status.st_dev, status.st_ino)
    if identity in above or depth == 0:
        return
    for name in entries:
        if not name.startswith("."):
            yield from _search(folder / name, (*above, identity), depth - 1)


def read_specimen(folder: Path, settings: IntakeSettings) -> Specimen:
    """Read and check a specimen folder.

    Parameters
    ----------
    folder : Path
        Holds ``specimen.toml``.
    settings : IntakeSettings

    Returns
    -------
    Specimen
        In SI units, with the steps of the force log, the photos that exist, and findings.

    Raises
    ------
    InputError
        If a file cannot be used; photos never raise as long as one is left.
    """
    file = read_specimen_file(folder, settings)
    log_path, noted = _log_path(folder, file, settings)
    log = read_force_log(log_path, file.log, settings)
    photos = match_photos(
        folder, log.steps, calibration=file.camera.calibration, log_name=log_path.name, settings=settings
    )
    scale = file.camera.scale_px_per_m
    sizes = size_findings(file.length_m, file.diameter_m, photos.steps, scale_px_per_m=scale, settings=settings)
    calibration = _calibration_hashes(folder, file, settings)
    names = {NAME: folder / NAME, log_path.relative_to(folder).as_posix(): log_path}
    return Specimen(
        id=file.id,
        folder=folder,
        length_m=file.length_m,
        diameter_m=file.diameter_m,
        camera=file.camera,
        rig=file.rig,
        steps=photos.steps,
        images=photos.paths,
        description=file.description,
        findings=(*noted, *log.findings, *photos.findings, *sizes),
        hashes={name: sha256(path) for name, path in names.items()} | photos.hashes | calibration,
    )


def _log_path(folder: Path, file: SpecimenFile, settings: IntakeSettings) -> tuple[Path, list[Finding]]:
    """The force log: the one named, else ``force.csv``, else the only text table in the folder."""
    if file.log.file is not None:
        path = inside(folder, file.log.file, allow_outside=settings.allow_outside)
        if path is None:
            raise outside(file.source.path, file.log.file, lambda: file.source.line_of("force_log", "file"))
        if not os.path.lexists(path):
            raise file.source.error(
                f"the force log {file.log.file!r} does not exist",
                table="force_log",
                key="file",
                code="folder/no-force-log",
                remedy="correct the name",
            )
        return path, []
    if os.path.lexists(folder / LOG_NAME):
        path = inside(folder, LOG_NAME, allow_outside=settings.allow_outside)
        if path is None:
            raise outside(folder / LOG_NAME, LOG_NAME)
        return path, []
    names = candidate_logs(folder)
    if not names:
        raise InputError(
            "has no force log",
            path=folder,
            code="folder/no-force-log",
            remedy=f"export the forces to {LOG_NAME}, or name the file in [force_log] of {NAME}",
        )
    if len(names) > 1:
        raise InputError(
            f"holds several files that may be the force log: {', '.join(names[:5])}",
            path=folder,
            code="folder/several-logs",
            remedy=f'choose in {NAME}: [force_log] file = "{names[0]}"',
        )
    path = inside(folder, names[0], allow_outside=settings.allow_outside)
    if path is None:
        raise outside(folder / names[0], names[0])
    return path, [inferred("log/file-inferred", f"{names[0]} was taken as the force log: it is the only table")]


def candidate_logs(folder: Path) -> list[str]:
    """Files beside ``specimen.toml`` that may be a force log, in natural order."""
    names = [entry.name for entry in folder.iterdir() if entry.suffix.casefold() in LOG_SUFFIXES]
    return sorted((name for name in names if not NO_PHOTO.search(name)), key=natural_key)


def _calibration_hashes(folder: Path, file: SpecimenFile, settings: IntakeSettings) -> dict[str, str]:
    """Hashes of the calibration photos.

    Raises
    ------
    InputError
        ``camera/no-calibration-photos``.
    """
    place = file.camera.calibration
    if place is None:
        return {}
    names = list_photos(place, without=None, settings=settings)
    if not names:
        raise file.source.error(
            "the calibration folder holds no photos",
            table="camera",
            key="calibration",
            code="camera/no-calibration-photos",
            remedy="put photos of the board into it, or give scale_px_per_mm instead",
        )
    hashes = {}
    for name in names:
        path = inside(folder, os.path.relpath(place / name, folder), allow_outside=settings.allow_outside)
        if path is None:
            raise outside(place / name, name)
        hashes[f"{place.name}/{name}"] = sha256(path)
    return hashes

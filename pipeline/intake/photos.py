"""The photos of a specimen folder: which files they are, in which order, and which belongs to which step.

Thumbnails, system files and the calibration folder are left out. Names sort as people count: ``bild_2`` before
``bild_10``.
"""

from __future__ import annotations

import hashlib
import os
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from pipeline.errors import InputError
from pipeline.intake.access import check_file, inside, sha256
from pipeline.intake.tomltable import shown
from pipeline.messages import Message
from pipeline.records import Finding, LoadStep, doubtful, inferred
from pipeline.settings.intake import IntakeSettings

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
FOLDERS = ("images", "bilder", "fotos", "photos", "pictures", "aufnahmen")
# Pictures of telephones and cameras that have to be converted first.
OTHER_SUFFIXES = (".heic", ".heif", ".avif", ".webp", ".gif", ".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf")
NO_PHOTO = re.compile(r"^\.|^~|^@|thumb|vorschau|preview|^__macosx$", re.IGNORECASE)


@dataclass(frozen=True)
class FoundPhotos:
    """Photos that exist: ``paths`` by name as the steps use it, their hashes, steps with their photos, findings."""

    paths: dict[str, Path]
    hashes: dict[str, str]
    steps: tuple[LoadStep, ...]
    findings: tuple[Finding, ...]


def natural_key(name: str) -> tuple[tuple[int, int | str], ...]:
    """Key by which names sort as people count."""
    parts = re.split(r"(\d+)", name.casefold())
    return tuple((0, int(part)) if part.isdecimal() and part.isascii() else (1, part) for part in parts if part)


def list_photos(folder: Path, *, without: Path | None, settings: IntakeSettings) -> tuple[str, ...]:
    """Names (relative, with ``/``) of the photos of a folder in natural order.

    Photos lie in ``images`` (or a folder of the like, see ``FOLDERS``), or in the only folder within it that holds any,
    or beside ``specimen.toml``.

    Raises `InputError` ``folder/too-many-photos``.
    """
    names = [str(name) for name in _files(folder, without, settings) if _is_photo(name.name)]
    if len(names) > settings.photos_max:
        raise InputError(Message("folder/too-many-photos", photos=len(names), limit=settings.photos_max), path=folder)
    return tuple(sorted(names, key=natural_key))


def no_photos(folder: Path, settings: IntakeSettings, *, why: Message | None = None) -> InputError:
    """The error for a folder without a photo, or of none that can be used; pictures of other kinds are named."""
    other = [PurePosixPath(name).name for name in _of_other_kinds(folder, None, settings)]
    below = [f"{place}/{entry}" for place in _named(folder, settings) for entry in _entries(folder / place)]
    beside = [entry for entry in _entries(folder) if entry.casefold() not in FOLDERS]
    aside = [entry for entry in (*beside, *below) if _holds_photos(folder / entry)]
    told = why or Message("folder/no-photos.none")
    if other:
        told = Message("folder/no-photos.other-kinds", told=told, names=_some(other))
    remedy = "aside" if aside else "convert" if other else "put" if why is None else "as-named"
    remedies = Message(f"folder/no-photos.{remedy}", names=_some(aside))
    return InputError(Message("folder/no-photos", told=told, remedy=remedies), path=folder)


def _named(folder: Path, settings: IntakeSettings) -> list[str]:
    """Folders named after photos that do not lead out of the specimen's."""
    named = [entry for entry in _entries(folder) if entry.casefold() in FOLDERS]
    return [place for place in named if inside(folder, place, allow_outside=settings.allow_outside) is not None]


def _files(folder: Path, without: Path | None, settings: IntakeSettings) -> list[PurePosixPath]:
    """Names, relative to the folder, of everything where photos may lie."""
    places = _places(folder, settings, without)
    return [PurePosixPath(place) / entry for place in places for entry in _entries(folder / place)]


def _places(folder: Path, settings: IntakeSettings, without: Path | None) -> list[str]:
    """Where photos may lie, the folder of calibration photos left out.

    Beside ``specimen.toml``; in folders named after photos, and where one of these holds no photo itself, in the only
    folder within it that does, as cameras make it.
    """

    def calibrates(place: str) -> bool:
        return without is not None and os.path.realpath(folder / place) == os.path.realpath(without)

    places = [""]
    for place in _named(folder, settings):
        within = [
            deeper
            for entry in _entries(folder / place)
            if not NO_PHOTO.search(entry) and _holds_photos(folder / (deeper := f"{place}/{entry}"))
            if inside(folder, deeper, allow_outside=settings.allow_outside) and not calibrates(deeper)
        ]
        places.append(within[0] if len(within) == 1 and not _holds_photos(folder / place) else place)
    return [place for place in places if not calibrates(place)]


def _of_other_kinds(folder: Path, without: Path | None, settings: IntakeSettings) -> list[str]:
    """Pictures of kinds that are not read, and of which no photo of the same name is there."""
    names = [name for name in _files(folder, without, settings) if not NO_PHOTO.search(name.name)]
    read = {name.with_suffix("") for name in names if _is_photo(name.name)}
    other = [name for name in names if name.suffix.casefold() in OTHER_SUFFIXES and name.with_suffix("") not in read]
    return sorted(map(str, other), key=natural_key)


def _entries(directory: Path) -> list[str]:
    """Names in a directory; none if it cannot be read."""
    try:
        return sorted(entry.name for entry in directory.iterdir())
    except OSError:
        return []


def _is_photo(name: str) -> bool:
    return PurePosixPath(name).suffix.casefold() in SUFFIXES and not NO_PHOTO.search(name)


def _holds_photos(directory: Path) -> bool:
    return any(map(_is_photo, _entries(directory)))


def match_photos(
    folder: Path, steps: Sequence[LoadStep], *, calibration: Path | None, log_name: str, settings: IntakeSettings
) -> FoundPhotos:
    """Find the photo of each step.

    Raises `InputError` ``folder/no-photos`` if there is none at all, ``log/photos-ambiguous`` if the log names none and
    the number of photos does not fit the steps.
    """
    present = list_photos(folder, without=calibration, settings=settings)
    findings: list[Finding] = []
    if not any(step.image for step in steps):
        steps, noted = _by_order(folder, steps, present, log_name, settings)
        findings += noted
    paths: dict[str, Path] = {}
    hashes: dict[str, str] = {}
    used: dict[str, int] = {}
    matched = []
    for step in steps:
        name, noted = _present_name(folder, step, present, log_name, settings) if step.image else (None, [])
        findings += noted
        if name is None:
            matched.append(step)
            continue
        if name in used:
            findings.append(doubtful("photo/doubled", step=used[name], other=step.step, image=repr(name)))
        used[name] = step.step
        path, digest, trouble = checked_photo(folder, name, settings)
        findings += trouble
        if path is not None:
            paths[name], hashes[name] = path, digest
        matched.append(replace(step, image=name))
    if not paths:
        key = "folder/no-photos.unusable" if findings else "folder/no-photos.unusable-all"
        raise no_photos(folder, settings, why=Message(key, last=findings[-1].said if findings else ""))
    other = [name for name in _of_other_kinds(folder, calibration, settings) if name not in used]
    if other:
        findings.append(doubtful("photo/other-kind", names=_some(other)))
    unused = [name for name in present if name not in used]
    if unused:
        findings.append(inferred("photo/unused", count=len(unused), names=_some(unused)))
    return FoundPhotos(paths, hashes, tuple(matched), (*findings, *_same_contents(hashes)))


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")


def _by_order(
    folder: Path, steps: Sequence[LoadStep], present: Sequence[str], log_name: str, settings: IntakeSettings
) -> tuple[list[LoadStep], list[Finding]]:
    """Photos for steps of a log that names none: by the step numbers in their names, or one for each in order."""
    if not present:
        raise no_photos(folder, settings)
    numbers = [_last_number(name) for name in present]
    at = {step.step: place for place, step in enumerate(steps)}
    if None not in numbers and len(set(numbers)) == len(numbers) and set(numbers) <= at.keys():
        chosen = {at[number]: name for number, name in zip(numbers, present, strict=True) if number is not None}
        key = "photo/inferred.numbers"
    elif len(present) == len(steps):
        chosen, key = dict(enumerate(present)), "photo/inferred"
    else:
        told = Message("log/photos-ambiguous", photos=len(present), steps=len(steps))
        raise InputError(told, path=folder / log_name)
    assigned = [replace(step, image=chosen.get(place)) for place, step in enumerate(steps)]
    pairs = [f"{step.step}: {step.image}" for step in assigned[:3]]
    level = inferred if len(chosen) == len(steps) else doubtful
    return assigned, [level(key, file=log_name, count=len(chosen), pairs=pairs), *_misnumbered(assigned)]


def _misnumbered(steps: Sequence[LoadStep]) -> Iterator[Finding]:
    """A photo that has the number of another step in its name, unless all photos count from another number on."""
    numbers = {step.step: _last_number(step.image or "") for step in steps}
    apart = {None if number is None else number - step for step, number in numbers.items()}
    wrong = [step for step in steps if numbers[step.step] in numbers.keys() - {step.step}]
    if len(apart) > 1 and wrong and wrong[0].image is not None:
        yield doubtful("photo/number", image=wrong[0].image, step=wrong[0].step)


def _last_number(name: str) -> int | None:
    found = re.findall(r"\d{1,9}", PurePosixPath(name).stem)
    return int(found[-1]) if found else None


def _present_name(
    folder: Path, step: LoadStep, present: Sequence[str], log_name: str, settings: IntakeSettings
) -> tuple[str | None, list[Finding]]:
    """Name of the existing file meant by a step; None, with a finding, if there is none."""
    written = step.image or ""
    name = str(PurePosixPath(written.replace("\\", "/")))
    place = {"file": log_name, "line": step.line, "image": shown(written)}
    path = inside(folder, name, allow_outside=settings.allow_outside)
    if path is None:
        return None, [doubtful("photo/outside.named", **place)]
    exists = os.path.isfile(path)  # noqa: PTH113  # pathlib raises for a name of more than 255 bytes
    beside = [other for other in present if PurePosixPath(other).name == name]
    if not exists and len(beside) == 1:
        return beside[0], []  # the name alone, as people write it: there is nothing else that it could mean
    alike = [other for other in present if _loose(other) == _loose(name)]
    alike = alike or [other for other in present if _loose(other, whole=False) == _loose(name, whole=False)]
    converted = len(alike) == 1 and PurePosixPath(name).suffix.casefold() in OTHER_SUFFIXES
    if not converted and (exists or name in present):  # no ordinary file is refused with its reason later
        return name, []
    if len(alike) == 1:
        return alike[0], [inferred("photo/name", taken=alike[0], **place)]
    return None, [doubtful("photo/missing", step=step.step, **place)]


def _loose(name: str, *, whole: bool = True) -> str:
    """A name without capitals, folder and (with ``whole=False``) suffix, however its accents are put together."""
    path = PurePosixPath(unicodedata.normalize("NFC", name.casefold()))
    return path.name if whole or path.suffix not in (*SUFFIXES, *OTHER_SUFFIXES) else path.stem


def checked_photo(folder: Path, name: str, settings: IntakeSettings) -> tuple[Path | None, str, list[Finding]]:
    """Path and hash of a photo; a file that cannot be read is a finding, and the rest of the specimen is measured."""
    path = inside(folder, name, allow_outside=settings.allow_outside)
    if path is None:
        return None, "", [doubtful("photo/outside", image=name)]
    try:
        check_file(path, limit=settings.photo_max_bytes, setting="photo_max_bytes")
        return path, sha256(path), []
    except InputError as error:
        said = Message("photos.one", image=name, said=error.said)
        return None, "", [Finding(f"photo/{error.code.partition('/')[2]}", "warning", said)]


EMPTY = hashlib.sha256().hexdigest()
"""Of a file without contents."""


def _same_contents(hashes: Mapping[str, str]) -> list[Finding]:
    """A warning for each picture that is there under several names."""
    names: dict[str, list[str]] = {}
    for name, digest in hashes.items():
        names.setdefault(digest, []).append(name)
    names.pop(EMPTY, None)  # is told for each of them
    return [doubtful("photo/doubled.same", names=_some(same)) for same in names.values() if len(same) > 1]

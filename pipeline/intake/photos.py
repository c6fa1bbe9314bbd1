"""The photos of a specimen folder: which files they are, in which order, and which belongs to which step.

Thumbnails, system files and the calibration folder are left out. Names sort as people count: ``bild_2`` before
``bild_10``.
"""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from pipeline.errors import InputError
from pipeline.intake.access import check_file, inside, read_begin, sha256
from pipeline.intake.noted import doubtful, inferred
from pipeline.intake.tomltable import shown
from pipeline.records import Finding, LoadStep
from pipeline.settings.intake import IntakeSettings

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
FOLDERS = ("images", "bilder", "fotos", "photos", "pictures", "aufnahmen")
# Pictures of telephones and cameras that have to be converted first.
OTHER_SUFFIXES = (".heic", ".heif", ".avif", ".webp", ".gif", ".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf")
# First bytes of png, jpg, bmp and tif in either order of bytes.
SIGNATURES = (b"\x89PNG", b"\xff\xd8\xff", b"BM", b"II*\0", b"MM\0*")
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

    Raises
    ------
    InputError
        ``folder/too-many-photos``.
    """
    names = [
        str(PurePosixPath(place) / entry)
        for place in _places(folder, settings, without)
        for entry in _entries(folder / place)
        if _is_photo(entry)
    ]
    if len(names) > settings.photos_max:
        raise InputError(
            f"holds {len(names)} photos, the limit is {settings.photos_max}",
            path=folder,
            code="folder/too-many-photos",
            remedy="split it or raise intake.photos_max",
        )
    return tuple(sorted(names, key=natural_key))


def no_photos(
    folder: Path, told: str, settings: IntakeSettings, *, remedy: str = "put the photos into its folder images"
) -> InputError:
    """The error for a folder without a photo; pictures that only need to be converted are named."""
    other = [PurePosixPath(name).name for name in _of_other_kinds(folder, None, settings)]
    if other:
        told = f"{told}, only pictures of other kinds: {_some(other)}"
        remedy = "convert them to png or jpg at full size"
    below = [f"{place}/{entry}" for place in _named(folder, settings) for entry in _entries(folder / place)]
    aside = [entry for entry in _entries(folder) if entry.casefold() not in FOLDERS]
    aside = [entry for entry in (*aside, *below) if any(map(_is_photo, _entries(folder / entry)))]
    if aside:
        remedy = f"move the photos from {_some(aside)} into its folder images"
    return InputError(told, path=folder, code="folder/no-photos", remedy=remedy)


def _named(folder: Path, settings: IntakeSettings) -> list[str]:
    """Folders named after photos that do not lead out of the specimen's."""
    named = [entry for entry in _entries(folder) if entry.casefold() in FOLDERS]
    return [place for place in named if inside(folder, place, allow_outside=settings.allow_outside) is not None]


def _places(folder: Path, settings: IntakeSettings, without: Path | None) -> list[str]:
    """Where photos may lie, the folder of calibration photos left out.

    Beside ``specimen.toml``; in folders named after photos, and where one of these holds no photo itself, in the only
    folder within it that does, as cameras make it.
    """

    def calibrates(place: str) -> bool:
        return without is not None and os.path.realpath(folder / place) == os.path.realpath(without)

    places = [""]
    for place in _named(folder, settings):
        within = [f"{place}/{entry}" for entry in _entries(folder / place) if not NO_PHOTO.search(entry)]
        within = [
            deeper
            for deeper in within
            if any(map(_is_photo, _entries(folder / deeper)))
            and inside(folder, deeper, allow_outside=settings.allow_outside) is not None
            and not calibrates(deeper)
        ]
        alone = len(within) == 1 and not any(map(_is_photo, _entries(folder / place)))
        places.append(within[0] if alone else place)
    return [place for place in places if not calibrates(place)]


def _of_other_kinds(folder: Path, without: Path | None, settings: IntakeSettings) -> list[str]:
    """Pictures of kinds that are not read, and of which no photo of the same name is there."""
    names = [
        PurePosixPath(place) / entry
        for place in _places(folder, settings, without)
        for entry in _entries(folder / place)
        if not NO_PHOTO.search(entry)
    ]
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


def match_photos(
    folder: Path, steps: Sequence[LoadStep], *, calibration: Path | None, log_name: str, settings: IntakeSettings
) -> FoundPhotos:
    """Find the photo of each step.

    Raises
    ------
    InputError
        ``folder/no-photos`` if there is none at all, ``log/photos-ambiguous`` if the log names none and the number of
        photos does not fit the steps.
    """
    present = list_photos(folder, without=calibration, settings=settings)
    other = _of_other_kinds(folder, calibration, settings)
    findings = [_other_kinds(other)] if other and present else []
    if not any(step.image for step in steps):
        steps, noted = _by_order(folder, steps, present, log_name, settings)
        findings += noted
    paths: dict[str, Path] = {}
    hashes: dict[str, str] = {}
    used: dict[str, int] = {}
    matched = []
    for step in steps:
        if step.image is None:
            matched.append(step)
            continue
        name, noted = _present_name(folder, step, present, log_name, settings)
        findings += noted
        if name is not None and name in used:
            findings.append(
                doubtful("photo/doubled", f"steps {used[name]} and {step.step} name the same photo {name!r}")
            )
        if name is not None:
            used[name] = step.step
            path, digest, trouble = checked_photo(folder, name, settings)
            findings += trouble
            if path is not None:
                paths[name], hashes[name] = path, digest
        matched.append(step if name is None else replace(step, image=name))
    if not paths:
        told = "has no photo that can be used" + (f" ({findings[-1].message})" if findings else "")
        raise no_photos(
            folder, told, settings, remedy="put the photos into its folder images, as named in the force log"
        )
    unused = [name for name in present if name not in used]
    if unused:
        findings.append(
            inferred("photo/unused", f"{len(unused)} photos belong to no step and were not measured: {_some(unused)}")
        )
    return FoundPhotos(paths, hashes, tuple(matched), (*findings, *_same_contents(hashes)))


def _other_kinds(names: Sequence[str]) -> Finding:
    message = (
        f"pictures of a kind that is not read were not measured: {_some(names)}; "
        "convert them to png or jpg at full size"
    )
    return doubtful("photo/other-kind", message)


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")


def _by_order(
    folder: Path, steps: Sequence[LoadStep], present: Sequence[str], log_name: str, settings: IntakeSettings
) -> tuple[list[LoadStep], list[Finding]]:
    """Photos for steps of a log that names none: by the step numbers in their names, or one for each in order."""
    if not present:
        raise no_photos(folder, "has no photos", settings)
    numbers = [_last_number(name) for name in present]
    at = {step.step: place for place, step in enumerate(steps)}
    if None not in numbers and len(set(numbers)) == len(numbers) and set(numbers) <= at.keys():
        chosen = {at[number]: name for number, name in zip(numbers, present, strict=True) if number is not None}
        how = "by the step numbers in their names"
    elif len(present) == len(steps):
        chosen, how = dict(enumerate(present)), "in the natural order of their names"
    else:
        raise InputError(
            f"names no photos, and {len(present)} photos cannot be told to {len(steps)} steps",
            path=folder / log_name,
            code="log/photos-ambiguous",
            remedy="add a column image with the name of the photo in one row of each step",
        )
    assigned = [replace(step, image=chosen.get(place)) for place, step in enumerate(steps)]
    pairs = ", ".join(f"{step.step}: {step.image}" for step in assigned[:3])
    message = f"{log_name} names no photos; {len(chosen)} photos were given to the steps {how} ({pairs}, ...)"
    whole = len(chosen) == len(steps)
    return assigned, [(inferred if whole else doubtful)("photo/inferred", message), *_misnumbered(assigned)]


def _misnumbered(steps: Sequence[LoadStep]) -> Iterator[Finding]:
    """A photo that has the number of another step in its name, unless all photos count from another number on."""
    numbers = {step.step: _last_number(step.image or "") for step in steps}
    apart = {None if number is None else number - step for step, number in numbers.items()}
    wrong = [step for step in steps if numbers[step.step] in numbers.keys() - {step.step}]
    if len(apart) > 1 and wrong and wrong[0].image is not None:
        message = (
            f"{wrong[0].image} was given to step {wrong[0].step}, but its name has the number of another step; "
            "add a column image with the name of the photo of each step"
        )
        yield doubtful("photo/number", message)


def _last_number(name: str) -> int | None:
    found = re.findall(r"\d{1,9}", PurePosixPath(name).stem)
    return int(found[-1]) if found else None


def _present_name(
    folder: Path, step: LoadStep, present: Sequence[str], log_name: str, settings: IntakeSettings
) -> tuple[str | None, list[Finding]]:
    """Name of the existing file meant by a step; None, with a finding, if there is none."""
    written = step.image or ""
    name = str(PurePosixPath(written.replace("\\", "/")))
    place = f"{log_name}, line {step.line}"
    path = inside(folder, name, allow_outside=settings.allow_outside)
    if path is None:
        told = f"{place}: photo {shown(written)} leads out of the folder and was not read"
        return None, [doubtful("photo/outside", told)]
    beside = [other for other in present if PurePosixPath(other).name == name]
    if not _exists(path) and len(beside) == 1:
        return beside[0], []  # the name alone, as people write it: there is nothing else that it could mean
    if _exists(path) or name in present:  # what is there but no ordinary file is refused with its reason later
        return name, []
    alike = [other for other in present if _loose(other) == _loose(name)]
    alike = alike or [other for other in present if _loose(other, whole=False) == _loose(name, whole=False)]
    if len(alike) == 1:
        return alike[0], [inferred("photo/name", f"{place}: photo {shown(written)} was taken to be {alike[0]}")]
    return None, [
        doubtful(
            "photo/missing",
            f"{place}: photo {shown(written)} of step {step.step} does not exist; the step keeps its force only",
        )
    ]


def _exists(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:
        return False


def _loose(name: str, *, whole: bool = True) -> str:
    """A name without capitals, folder and (with ``whole=False``) suffix, however its accents are put together."""
    path = PurePosixPath(unicodedata.normalize("NFC", name.casefold()))
    return path.name if whole or path.suffix not in SUFFIXES else path.stem


def checked_photo(folder: Path, name: str, settings: IntakeSettings) -> tuple[Path | None, str, list[Finding]]:
    """Path and hash of a photo; a file that cannot be read is a finding, and the rest of the specimen is measured."""
    path = inside(folder, name, allow_outside=settings.allow_outside)
    if path is None:
        return None, "", [doubtful("photo/outside", f"{name} leads out of the folder and was not read")]
    try:
        check_file(path, limit=settings.photo_max_bytes, setting="photo_max_bytes")
        begin = read_begin(path, 8)
        # The stage that decodes it says so, too; here it is said before anything is measured.
        told = [] if begin.startswith(SIGNATURES) else [_no_picture(name, begin)]
        return path, sha256(path), told
    except InputError as error:
        return None, "", [doubtful(f"photo/{error.code.partition('/')[2]}", f"{name}: {error.message}; {error.remedy}")]


def _no_picture(name: str, begin: bytes) -> Finding:
    if not begin:
        return doubtful("photo/no-picture", f"{name}: the file is empty; copy it again from the camera")
    again = "convert it to png or jpg at full size" if begin[4:8] == b"ftyp" else "copy it again from the camera"
    return doubtful("photo/no-picture", f"{name}: the file is no png, jpg, bmp or tif; {again}")


def _same_contents(hashes: Mapping[str, str]) -> list[Finding]:
    """A warning for each picture that is there under several names."""
    names: dict[str, list[str]] = {}
    for name, digest in hashes.items():
        names.setdefault(digest, []).append(name)
    return [
        doubtful("photo/doubled", f"{_some(more)} and {first} are the same picture")
        for first, *more in names.values()
        if more
    ]

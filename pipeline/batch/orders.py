"""What a batch is to do: specimen folders -> orders, each with the name of its result and everything a worker needs.

A result is named after the specimen's id. Where two specimens share an id, in whatever capitals, the folder's name
is added, and the names of the folders above it as far as needed, and where even these do not tell two apart, or make
the name longer than a file system takes, a digest of the whole path: nothing is overwritten and names stay the same
when the batch runs again.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline import __version__
from pipeline.batch.store import OWN_FILES
from pipeline.intake.specimenfile import folder_name, plain_name, read_specimen_file
from pipeline.records import Specimen
from pipeline.settings import Settings

LONGEST_NAME = 200
"""Bytes of a result's name: file systems take 255, and notes are named after results, with something added."""
DIGITS = 12
"""Of a digest in a name; of a million results two share one with a chance of 1 in 500."""


@dataclass(frozen=True)
class Order:
    """One specimen to measure: its folder (absolute), the name of its result, and how."""

    folder: Path
    name: str
    out: Path
    settings: Settings
    version: str
    command: str


def make_orders(folders: Sequence[Path], out: Path, settings: Settings, *, options: str) -> list[Order]:
    """Orders for a batch, in the order of the folders.

    The command in a result names the specimen from anywhere, and no folder of results: the same bytes go into any.

    ``options`` are those of the command line that change results, for the command each result gives to reproduce it.
    """
    version = code_version()
    where = out.absolute()
    return [
        Order(
            folder=folder.absolute(),
            name=name,
            out=where,
            settings=settings,
            version=version,
            command=" ".join(filter(None, ("cablebend run", quoted(folder.absolute()), "-o OUT", options))),
        )
        for folder, name in zip(folders, result_names(folders, settings), strict=True)
    ]


def quoted(path: Path | str) -> str:
    """A path as a shell takes it and nothing more: a folder named ``$(command)`` by a stranger runs no command."""
    return shlex.quote(str(path).encode("utf-8", "replace").decode("utf-8"))


def result_names(folders: Sequence[Path], settings: Settings) -> list[str]:
    """A different name for each result, the specimen's id where that is enough."""
    parts = [(_id(folder, settings), *map(plain_name, reversed(folder.absolute().parts[1:]))) for folder in folders]
    names = [tuple(part[:1]) for part in parts]
    longest = max((len(part) for part in parts), default=1)
    for depth in range(2, longest + 1):
        count = Counter(_key(name) for name in names)
        names = [
            part[:depth] if count[_key(name)] > 1 or _key(name) in OWN_FILES else name
            for name, part in zip(names, parts, strict=True)
        ]
    count = Counter(_key(name) for name in names)
    whole = ["--".join(name) for name in names]
    return [
        _digested(told, folder) if count[_key(name)] > 1 or len(told.encode()) > LONGEST_NAME else told
        for name, told, folder in zip(names, whole, folders, strict=True)
    ]


def _key(name: tuple[str, ...]) -> str:
    return "--".join(name).casefold()


def _digested(name: str, folder: Path) -> str:
    """The beginning of a name, and a digest of the whole path."""
    digest = hashlib.sha256(os.fsencode(folder.absolute())).hexdigest()[:DIGITS]
    begin = name.encode()[: LONGEST_NAME - DIGITS - 2].decode(errors="ignore")
    return f"{begin}--{digest}"


def _id(folder: Path, settings: Settings) -> str:
    """Id of a specimen, or its folder's name where the id cannot be read: what measures it says why."""
    try:
        return read_specimen_file(folder, settings.intake).id
    except Exception:  # before any work is handed out: whatever breaks here would cost the batch
        return folder_name(folder)


def fingerprint(specimen: Specimen, order: Order) -> str:
    """Digest of everything a result depends on: contents of the files, what was inferred, settings, program."""
    settings = order.settings.model_dump(mode="json", exclude={"batch": True, "report": {"language"}})
    told = [[finding.code, finding.message] for finding in specimen.findings]
    parts = [dict(sorted(specimen.hashes.items())), told, specimen.id, settings, order.version]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


@functools.cache
def code_version() -> str:
    """Version of the program: that of the distribution, and a digest of its source, so that a changed copy counts."""
    digest = hashlib.sha256()
    root = Path(__file__).resolve().parents[2]
    messages = (root / "pipeline" / "messages").glob("*.toml")
    for path in sorted((*(root / "rod").rglob("*.py"), *(root / "pipeline").rglob("*.py"), *messages)):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return f"{__version__}+{digest.hexdigest()[:12]}"

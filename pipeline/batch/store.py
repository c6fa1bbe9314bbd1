"""The folder of results: one folder a specimen, put in place whole or not at all.

A specimen's files are written into a staging folder beside the others and renamed into place once they are on the disk,
so a reader, a second command or the next one after a power cut never sees half a result. Where there is an earlier
result, one rename cannot replace it: the new one first becomes ``ready``, which is a promise on the disk, and only then
does the old one go. A run that ends in between leaves the promise to the next, which keeps it before anything else.
``entry.json`` in each folder says in a few lines what is there and from which inputs (its fingerprint): the index and
the next run read it instead of ``result.json``. One run at a time writes into a folder; the lock is the operating
system's and dies with its process.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import locket

from pipeline.errors import InputError
from pipeline.intake.photos import natural_key
from pipeline.messages import Message, by_system
from pipeline.report.files import synced, write_atomic

ENTRY = "entry.json"
WORK = ".cablebend"  # staging, ready, attempts and lock
OWN_FILES = ("index.html", "summary.csv", "result.schema.json", "cablebend.log")


@dataclass(frozen=True)
class Store:
    """A folder of results."""

    out: Path

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the folder for one run; what an earlier, killed run left ready is put in place, half done is removed.

        Raises `InputError` ``out/busy`` if another run holds it, ``out/unwritable`` if it cannot be written.
        """
        with contextlib.ExitStack() as held:
            try:
                self._work("ready").mkdir(parents=True, exist_ok=True)
                held.enter_context(locket.lock_file(str(self.out / WORK / "lock"), timeout=0))
                self._resume()
            except locket.LockError as error:
                raise InputError(Message("out/busy"), path=self.out) from error
            except OSError as error:
                raise self.unwritable(error) from error
            yield

    def _resume(self) -> None:
        """Put in place what is ready, then begin with empty folders of work."""
        for ready in self._work("ready").iterdir():
            if not self._foreign(self.out / ready.name):
                self._put(ready)
        for name in ("staging", "attempts"):
            shutil.rmtree(self._work(name), ignore_errors=True)
            self._work(name).mkdir(parents=True, exist_ok=True)
        for folder in (self.out / WORK, self.out):
            synced(folder)
        with contextlib.suppress(PermissionError):  # a folder that may be entered, not read
            synced(self.out.parent)

    def unwritable(self, error: OSError) -> InputError:
        """The error for an output folder that refuses to be written."""
        return InputError(Message("out/unwritable", why=by_system(error)), path=self.out)

    def _work(self, name: str) -> Path:
        return self.out / WORK / name

    @contextlib.contextmanager
    def staging(self) -> Iterator[Path]:
        """An empty folder that is gone afterwards unless `install` moved it."""
        folder = self._work("staging") / uuid.uuid4().hex
        folder.mkdir(parents=True)
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _foreign(self, place: Path) -> bool:
        """Whether a place holds something that is no result."""
        return os.path.lexists(place) and not (place / ENTRY).is_file()

    def place(self, name: str) -> Path:
        """Where a result goes.

        Raises `InputError` ``out/foreign-folder`` if the place holds something that is no result: it is left alone.
        """
        place = self.out / name
        if self._foreign(place):
            raise InputError(Message("out/foreign-folder"), path=place)
        return place

    def install(self, staged: Path, name: str) -> None:
        """Put a finished folder into its place; an earlier result there is replaced. Raises as `place` does."""
        place = self.place(name)
        for path in (*staged.rglob("*"), staged):
            synced(path)
        if place.exists():
            ready = self._work("ready") / name
            staged.rename(ready)
            synced(ready.parent)
            self._put(ready)
        else:
            staged.rename(place)
            synced(self.out)

    def _put(self, ready: Path) -> None:
        """Move what is ready into its place, and what was there before away."""
        place, old = self.out / ready.name, self._work("staging") / uuid.uuid4().hex
        if place.exists():
            old.parent.mkdir(exist_ok=True)
            place.rename(old)
        ready.rename(place)
        synced(self.out)
        shutil.rmtree(old, ignore_errors=True)

    def entry(self, name: str) -> dict[str, Any] | None:
        """What is stored under a name; None if nothing readable is."""
        try:
            entry = json.loads((self.out / name / ENTRY).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return entry if isinstance(entry, dict) else None

    def forget_row(self, name: str) -> None:
        """Take the row of the index out of an entry: its result is not what it was."""
        entry = self.entry(name)
        if entry is not None and entry.pop("row", None) is not None:
            write_entry(entry, self.out / name)

    def names(self) -> list[str]:
        """Names of all stored specimens in natural order."""
        found = (place.name for place in self.out.iterdir() if (place / ENTRY).is_file())
        return sorted(found, key=natural_key)

    def begin(self, name: str) -> int:
        """Note that a specimen is about to be measured; how often that was noted before in this run."""
        note = self._work("attempts") / name
        before = len(note.read_bytes()) if note.exists() else 0
        note.parent.mkdir(parents=True, exist_ok=True)
        note.write_bytes(b"." * (before + 1))
        return before

    def overdue(self, name: str) -> Path:
        """Note that tells why a worker ended itself: the time was over."""
        return self._work("attempts") / f"{name}.overdue"

    def end(self, name: str) -> None:
        """Remove the notes of attempts at a specimen that came to an end."""
        (self._work("attempts") / name).unlink(missing_ok=True)
        self.overdue(name).unlink(missing_ok=True)


def write_entry(entry: dict[str, Any], folder: Path) -> None:
    """Write ``entry.json`` into a folder, at once or not at all: one that is in place already may be read meanwhile."""
    write_atomic(folder / ENTRY, json.dumps(entry, sort_keys=True) + "\n")

"""A process that dies before the n-th thing it does to files, or whose machine loses power there.

`run_until` runs a function in a child and counts what it does to files: opening for writing, every write, sync, rename,
removal, new folder, change of mode. Before the n-th the child is ``killed``; of a write half comes through. With
``power`` the disk keeps no more than POSIX promises: content that was not synced is gone, names that were not synced
with their folder too, and renames are undone; ``reordered`` keeps of these renames the last that can do without the
others. (Removals that were not synced stay: to undo them would only help.)
"""

import builtins
import contextlib
import io
import os
import shutil
from collections.abc import Callable
from pathlib import Path

CUT = 77
RENAMES, REMOVALS = ("rename", "replace"), ("unlink", "remove", "rmdir")


def run_until(n: int, how: str, root: Path, action: Callable[[], None]) -> int | None:
    """How many operations an action needs in a child process; None if it was cut off before the n-th, from 1.

    Power is lost after an action that came to its end, too.
    """
    there, here = os.pipe()
    child = os.fork()
    if child == 0:
        disk = _Disk(n, how, root)
        with disk.watched():
            action()
            if how != "killed":
                disk.lose()
        os.write(here, str(disk.count).encode())
        os._exit(0)
    os.close(here)
    with os.fdopen(there) as pipe:
        told = pipe.read()
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert code in (0, CUT), f"the action failed before operation {n}"
    return int(told) if code == 0 else None


class _File:
    """A file whose writes are counted."""

    def __init__(self, file, disk):
        self.file, self.disk, self.flushed = file, disk, True

    def __getattr__(self, name):
        return getattr(self.file, name)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.file.close()
        self.flushed = True

    def write(self, data):
        self.disk.step(lambda: (self.file.write(data[: len(data) // 2]), self.file.flush()))
        self.disk.unsynced.add(_inode(self.file.fileno()))
        self.flushed = False
        return self.file.write(data)

    def flush(self):
        self.file.flush()
        self.flushed = True


class _Disk:
    """What was done to files, and what of it would be left."""

    def __init__(self, n, how, root):
        self.n, self.how, self.root, self.count = n, how, root, 0
        self.real = {name: getattr(os, name) for name in (*RENAMES, *REMOVALS, "fsync", "mkdir", "chmod", "open")}
        self.real_open = io.open
        self.files = {}  # by descriptor
        self.unsynced = set()  # inodes with content that is not on the disk
        self.unlisted = {}  # inode -> inode of the folder that does not list it on the disk
        self.renamed = []  # source, destination, what was there, inodes of both folders: not on the disk either

    def step(self, torn=lambda: None):
        self.count += 1
        if self.count == self.n:
            torn()
            if self.how != "killed":
                self.lose()
            os._exit(CUT)

    @contextlib.contextmanager
    def watched(self):
        """Count in this process, until it ends."""
        for name in RENAMES:
            setattr(os, name, self.rename)
        for name in (*REMOVALS, "chmod"):
            setattr(os, name, self.counted(name))
        os.fsync, os.mkdir, os.open = self.fsync, self.mkdir, self.open_descriptor
        io.open = builtins.open = self.open_file
        yield

    def counted(self, name):
        def do(*arguments, **options):
            self.step()
            return self.real[name](*arguments, **options)

        return do

    def rename(self, source, destination):
        self.step()
        source, destination = Path(source), Path(destination)
        before = destination.read_bytes() if destination.is_file() else None
        self.real["replace"](source, destination)
        inode = _inode(destination)
        if inode in self.unlisted:
            self.unlisted[inode] = _inode(destination.parent)
        self.renamed.append((source, destination, before, {_inode(source.parent), _inode(destination.parent)}))

    def mkdir(self, path, *arguments, **options):
        if not Path(path).exists():  # else the system will say so, and nothing is done
            self.step()
        self.real["mkdir"](path, *arguments, **options)
        self.listed_nowhere(path)

    def listed_nowhere(self, path):
        """A new file or folder; its inode may have been another's before."""
        self.unlisted[_inode(path)] = _inode(Path(path).parent)
        self.unsynced.discard(_inode(path))

    def fsync(self, descriptor):
        """Nothing is asked of the real disk."""
        self.step()
        inode = _inode(descriptor)
        if descriptor not in self.files or self.files[descriptor].flushed:
            self.unsynced.discard(inode)
        self.unlisted = {name: folder for name, folder in self.unlisted.items() if folder != inode}
        self.renamed = [entry for entry in self.renamed if inode not in entry[3]]

    def open_descriptor(self, path, flags, *arguments, **options):
        new = bool(flags & os.O_CREAT) and not Path(path).exists()
        if new:
            self.step()
        descriptor = self.real["open"](path, flags, *arguments, **options)
        if new:
            self.listed_nowhere(path)
        return descriptor

    def open_file(self, file, mode="r", *arguments, **options):
        if not set(mode) & set("wax+") or (not isinstance(file, int) and self.root not in Path(file).parents):
            return self.real_open(file, mode, *arguments, **options)
        new = not isinstance(file, int) and not Path(file).exists()
        if not isinstance(file, int):
            self.step()
        opened = _File(self.real_open(file, mode, *arguments, **options), self)
        self.files[opened.fileno()] = opened
        if new:
            self.listed_nowhere(file)
        return opened

    def lose(self):
        """Leave on the disk what was synced."""
        if self.how == "reordered":
            made = {destination for _, destination, *_ in self.renamed}
            kept = [entry for entry in self.renamed if entry[0] not in made][-1:]
            self.renamed = [entry for entry in self.renamed if entry not in kept]
            for _, destination, *_ in kept:  # so its folder lists it
                self.unlisted.pop(_inode(destination), None)
        for source, destination, before, _ in reversed(self.renamed):
            if destination.exists() and not source.exists() and source.parent.exists():
                self.real["replace"](destination, source)
                if before is not None:
                    with self.real_open(destination, "wb") as file:
                        file.write(before)
                    self.unlisted.pop(_inode(destination), None)  # a new inode, maybe once another's
                    self.unsynced.discard(_inode(destination))
        for name in REMOVALS:
            setattr(os, name, self.real[name])
        for path in sorted(self.root.rglob("*"), reverse=True):  # what is in a folder before the folder
            inode = _inode(path)
            if inode in self.unlisted:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
            elif inode in self.unsynced:
                os.truncate(path, 0)


def _inode(of):
    status = os.fstat(of) if isinstance(of, int) else Path(of).stat()
    return status.st_dev, status.st_ino

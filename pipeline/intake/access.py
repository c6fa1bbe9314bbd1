"""Reading files of a folder that may come from strangers: file name -> bytes, within limits and within the folder.

A specimen folder is the border: a name that leads out of it, by ``..``, by an absolute path or by a link, is not
followed unless the settings allow it. Special files (pipes, devices) are never opened: reading them may not end.
Paths are as given by the caller; nothing is executed or unpickled.
"""

from __future__ import annotations

import hashlib
import os
import stat
from pathlib import Path

from pipeline.errors import InputError
from pipeline.messages import Message, by_system

LONGEST_PATH = 1000
"""Characters of a path written in a file; each folder in it is looked up, and no system opens one of a few thousand."""


def inside(folder: Path, name: str, *, allow_outside: bool) -> Path | None:
    r"""Path of a name written in a file of the folder, or None if it leads out of the folder.

    Parameters
    ----------
    folder : Path
        The specimen folder; a link to it is fine, links below it are followed to see where they end.
    name : str
        Relative path with ``/`` or ``\``.
    allow_outside : bool
        Give the path even if it leads out.
    """
    if "\0" in name or len(name) > LONGEST_PATH:
        return None
    path = folder / name.replace("\\", "/")
    if allow_outside:
        return path
    border, target = os.path.realpath(folder), os.path.realpath(path)
    return path if target == border or target.startswith(border.rstrip(os.sep) + os.sep) else None


def is_folder(path: Path) -> bool:
    """Whether a path is a folder; one that cannot be looked at is none."""
    return os.path.isdir(path)  # noqa: PTH112  # pathlib raises for a name of more than 255 bytes or a locked folder


def read_bytes(path: Path, *, limit: int, setting: str) -> bytes:
    """Contents of a regular file of at most ``limit`` bytes.

    Raises `InputError` ``file/unreadable``, ``file/not-a-file``, ``file/too-large``.
    """
    check_file(path, limit=limit, setting=setting)
    try:
        with path.open("rb") as stream:
            return stream.read(limit)
    except OSError as error:
        raise unreadable(path, error) from error


def check_file(path: Path, *, limit: int, setting: str) -> None:
    """Refuse what is no regular file of at most ``limit`` bytes; see `read_bytes` for the codes."""
    try:
        status = path.stat()
    except OSError as error:
        raise unreadable(path, error) from error
    if not stat.S_ISREG(status.st_mode):
        raise InputError(Message("file/not-a-file"), path=path)
    if status.st_size > limit:
        raise InputError(Message("file/too-large", bytes=status.st_size, limit=limit, setting=setting), path=path)


def sha256(path: Path) -> str:
    """SHA-256 of a file, read in pieces; raises `InputError` ``file/unreadable``."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise unreadable(path, error) from error


def outside(path: Path, name: str, line: int | None = None) -> InputError:
    """The error for a name that leads out of the specimen folder."""
    return InputError(Message("file/outside", name=repr(name)), path=path, line=line)


def unreadable(path: Path, error: OSError) -> InputError:
    """The error for a file the operating system does not hand over."""
    return InputError(Message("file/unreadable", why=by_system(error)), path=path)

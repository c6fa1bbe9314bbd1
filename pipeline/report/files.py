"""Writing so that a reader never meets half a file, not even after a power cut.

The text goes beside its place and is moved there once it is complete and on the disk.
"""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path


def write_atomic(path: Path, content: str | bytes | Iterable[str]) -> Path:
    """Write a file at once or not at all, and return its path; two writers leave one of their files, never a mixture.

    Parameters
    ----------
    path : Path
        Its folder is made if it does not exist.
    content : str, bytes or iterable of str
        Text, whole or in pieces, is written as UTF-8 with the line ends it has.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    pieces = (content,) if isinstance(content, str | bytes) else content
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    beside = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.writelines(piece.encode("utf-8") if isinstance(piece, str) else piece for piece in pieces)
            file.flush()
            os.fsync(file.fileno())
        # mkstemp makes files for the owner alone; a report is read by others as any file of this user is
        mask = os.umask(0)
        os.umask(mask)
        beside.chmod(0o666 & ~mask)
        beside.replace(path)
        synced(path.parent)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    return path


def synced(path: Path) -> None:
    """Wait until a file's content, or a folder's list of names, is on the disk."""
    if os.name == "nt":
        return  # Windows syncs only what is open for writing, and opens no folders
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # file systems of networks and devices that cannot
            raise
    finally:
        os.close(handle)

"""Writing so that a reader never meets half a file: the text goes beside its place and is moved there when complete."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from pathlib import Path


def write_atomic(path: Path, content: str | bytes | Iterable[str]) -> Path:
    """Write a file at once or not at all; two writers leave one of their two files, never a mixture.

    Parameters
    ----------
    path : Path
        Its folder is made if it does not exist.
    content : str, bytes or iterable of str
        Text, whole or in pieces, is written as UTF-8 with the line ends it has.

    Returns
    -------
    Path
        The path given.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    pieces = (content,) if isinstance(content, str | bytes) else content
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    beside = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.writelines(piece.encode("utf-8") if isinstance(piece, str) else piece for piece in pieces)
        # mkstemp makes files for the owner alone; a report is read by others as any file of this user is
        mask = os.umask(0)
        os.umask(mask)
        beside.chmod(0o666 & ~mask)
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    return path

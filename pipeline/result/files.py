"""``result.json`` written, read back, and its schema."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from pipeline.errors import InputError
from pipeline.result.whole import Result

LARGEST_BYTES = 256_000_000
"""Of a ``result.json``: a photo takes 150 kB, and a test has tens of steps."""


def to_json(result: Result) -> str:
    """Text of ``result.json``: contract names, no NaN, one line per top-level entry not guaranteed."""
    return result.model_dump_json(by_alias=True, indent=1)


def from_json(text: str) -> Result:
    """Read ``result.json`` back; raises ``pydantic.ValidationError`` for anything that is not one."""
    return Result.model_validate_json(text)


def read_result(path: Path | str) -> Result:
    """Read ``result.json``, or the one in a folder.

    Raises
    ------
    InputError
        ``result/unreadable`` if it cannot be read or is none.
    """
    file = Path(path) / "result.json" if Path(path).is_dir() else Path(path)
    try:
        if file.stat().st_size > LARGEST_BYTES:
            raise ValueError(f"larger than {LARGEST_BYTES / 1e6:.0f} MB")
        return from_json(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError, MemoryError) as error:
        raise InputError(
            f"is no readable result ({_told(error)})",
            path=file,
            code="result/unreadable",
            remedy="give a result.json that `cablebend run` wrote, or its folder",
        ) from error


def _told(error: Exception) -> str:
    """What is wrong with a file, in a few words: of a file of another kind, or with a wrong value, where."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    if not isinstance(error, ValidationError) or error.errors()[0]["type"] == "json_invalid":
        return str(error) if type(error) is ValueError else type(error).__name__
    first = error.errors(include_url=False, include_input=False)[0]
    return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"[:200]


def schema() -> dict[str, Any]:
    """JSON schema of ``result.json``, published as ``result.schema.json``."""
    return Result.model_json_schema(by_alias=True)

"""``result.json`` written, read back, and its schema."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from pipeline.errors import InputError
from pipeline.messages import Message, by_system
from pipeline.result.whole import SCHEMA, Result

LARGEST_BYTES = 256_000_000
"""Of a ``result.json``: a photo takes 150 kB, and a test has tens of steps."""
FAMILY = "cablebend/result/"
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def to_json(result: Result) -> str:
    """Text of ``result.json``, with the names of the contract, and null where nothing is known."""
    return result.model_dump_json(by_alias=True, indent=1)


def from_json(text: str) -> Result:
    """Read ``result.json`` back; raises ``ValueError`` for anything that is none, or that names no schema."""
    result = Result.model_validate_json(text)
    if "schema_" not in result.model_fields_set:
        raise ValueError("it names no schema")
    for cause in [] if result.diagnosis is None else result.diagnosis.causes:
        if cause.name == "plastic_set":
            # ``at`` once was the number of the form, which the label says, and is how soon the set slows down
            cause.forms[:] = [f if "at" in f.tuned else f.model_copy(update={"at": 0.0}) for f in cause.forms]
    return result


def read_result(path: Path | str) -> Result:
    """Read ``result.json``, or the one in a folder.

    Raises `InputError` ``result/unreadable`` if it cannot be read or is none, ``result/version`` if another version
    wrote it.
    """
    file = Path(path) / "result.json" if Path(path).is_dir() else Path(path)
    try:
        if file.stat().st_size > LARGEST_BYTES:
            raise ValueError(f"larger than {LARGEST_BYTES / 1e6:.0f} MB")
        return from_json(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError, MemoryError) as error:
        other = _other_version(error)
        if other:
            raise InputError(Message("result/version", other=other, own=SCHEMA), path=file) from error
        raise InputError(Message("result/unreadable", why=_told(error)), path=file) from error


def _other_version(error: Exception) -> str:
    """The schema that a result of another version names; empty if that is not what is wrong."""
    wrong = error.errors() if isinstance(error, ValidationError) else []
    named = next((one["input"] for one in wrong if one["loc"] == ("schema",)), None)
    return named if isinstance(named, str) and named.startswith(FAMILY) else ""


def _told(error: Exception) -> str | Message:
    """What is wrong with a file, in a few words: of a file of another kind, or with a wrong value, where."""
    if isinstance(error, OSError):
        return by_system(error)
    if not isinstance(error, ValidationError) or error.errors()[0]["type"] == "json_invalid":
        return str(error) if type(error) is ValueError else type(error).__name__
    first = error.errors(include_url=False, include_input=False)[0]
    return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"[:200]


def schema() -> dict[str, Any]:
    """JSON schema of ``result.json``, published as ``result.schema.json``; further fields may stand beside those."""
    document = Result.model_json_schema(by_alias=True)
    required = ["schema", *document["required"]]  # has a default for whoever makes a result, none for who reads one
    return {"$schema": DIALECT, "$id": f"urn:{SCHEMA.replace('/', ':')}", **document, "required": required}

"""``result.json`` written, read back, and its schema.

Version 1 kept the number of a plastic set's form in ``at``, and its name as the label; version 2 keeps in ``at`` how
soon the set slows down. A result of version 1 is read by the labels of its forms, and refused where one is not known.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from pipeline.errors import InputError
from pipeline.messages import Message, catalogue, word
from pipeline.result.diagnosed import CauseForm
from pipeline.result.whole import SCHEMA, Result

LARGEST_BYTES = 256_000_000
"""Of a ``result.json``: a photo takes 150 kB, and a test has tens of steps."""


FAMILY = "cablebend/result/"
EARLIER = FAMILY + "1"
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def to_json(result: Result) -> str:
    """Text of ``result.json``, with the names of the contract, and null where nothing is known."""
    return result.model_dump_json(by_alias=True, indent=1)


def from_json(text: str) -> Result:
    """Read ``result.json`` back, also one of version 1.

    Raises
    ------
    ValueError
        For anything that is none, or that names no schema.
    InputError
        ``result/version`` if another version wrote it, in terms that are not known here.
    """
    try:
        result = Result.model_validate_json(text)
    except ValidationError as error:
        other = _other_version(error)
        if not other:
            raise
        if other != EARLIER:
            raise InputError(Message("result/version", other=other, own=SCHEMA)) from error
        result = _of_earlier(Result.model_validate({**json.loads(text), "schema": SCHEMA}))
    if "schema_" not in result.model_fields_set:
        raise ValueError("it names no schema")
    return result


def read_result(path: Path | str) -> Result:
    """Read ``result.json``, or the one in a folder.

    Raises
    ------
    InputError
        ``result/unreadable`` if it cannot be read or is none, ``result/version`` if another version wrote it.
    """
    file = Path(path) / "result.json" if Path(path).is_dir() else Path(path)
    try:
        if file.stat().st_size > LARGEST_BYTES:
            raise ValueError(f"larger than {LARGEST_BYTES / 1e6:.0f} MB")
        return from_json(file.read_text(encoding="utf-8"))
    except InputError as error:
        raise InputError(error.said, path=file) from error
    except (OSError, ValueError, RecursionError, MemoryError) as error:
        raise InputError(Message("result/unreadable", why=_told(error)), path=file) from error


def _of_earlier(result: Result) -> Result:
    """A result of version 1 in the terms of this one; raises `InputError` where it has a form nobody knows."""
    if result.diagnosis is None:
        return result
    causes = [
        cause.model_copy(update={"forms": [_form_of_earlier(cause.name, form) for form in cause.forms]})
        for cause in result.diagnosis.causes
    ]
    return result.model_copy(update={"diagnosis": result.diagnosis.model_copy(update={"causes": causes})})


def _form_of_earlier(cause: str, form: CauseForm) -> CauseForm:
    """A form of version 1 in the terms of this one; a plastic set has none without a label."""
    known = f"form.{cause}.{form.label}" in catalogue("en")
    if not known and (form.label or cause == "plastic_set"):
        raise InputError(Message("result/version.form", other=EARLIER, cause=word(cause), form=form.label))
    return form.model_copy(update={"at": 0.0}) if cause == "plastic_set" and "at" not in form.tuned else form


def _other_version(error: ValidationError) -> str:
    """The schema that a result of another version names; empty if that is not what is wrong."""
    named = next((one["input"] for one in error.errors() if one["loc"] == ("schema",)), None)
    return named if isinstance(named, str) and named.startswith(FAMILY) else ""


def _told(error: Exception) -> str:
    """What is wrong with a file, in a few words: of a file of another kind, or with a wrong value, where."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    if not isinstance(error, ValidationError) or error.errors()[0]["type"] == "json_invalid":
        return str(error) if type(error) is ValueError else type(error).__name__
    first = error.errors(include_url=False, include_input=False)[0]
    return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"[:200]


def schema() -> dict[str, Any]:
    """JSON schema of ``result.json``, published as ``result.schema.json``; further fields may stand beside those."""
    document = Result.model_json_schema(by_alias=True)
    required = ["schema", *document["required"]]  # has a default for whoever makes a result, none for who reads one
    return {"$schema": DIALECT, "$id": f"urn:{SCHEMA.replace('/', ':')}", **document, "required": required}

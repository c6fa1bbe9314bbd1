"""Settings from a TOML file and from ``--set section.key=value``; an unknown name is told with a near one."""

from __future__ import annotations

import json
import textwrap
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pipeline.errors import InputError
from pipeline.intake.tomltable import TomlFile, nearest, read_toml, shown
from pipeline.messages import Message, free_text
from pipeline.settings import Settings

SETTINGS_MAX_BYTES = 10_000_000  # a settings file is written by its user; the limit only stops a wrong file early
LARGEST = 2**63  # integers of TOML end there; of 5,000 digits, given in hexadecimal, Python writes none into a result


def read_settings(file: Path | None, assignments: Sequence[str]) -> Settings:
    """Settings from a file, changed by assignments.

    Raises `InputError` ``settings/unknown-key``, ``settings/wrong-value``, ``settings/assignment``, and those of
    `read_toml`.
    """
    tables: dict[str, Any] = {}
    source: TomlFile | None = None
    if file is not None:
        source = read_toml(file, limit=SETTINGS_MAX_BYTES)
        tables = source.tables
        _check_tables(tables, Settings, (), source)
    for assignment in assignments:
        _assign(tables, assignment)
    try:
        return Settings.model_validate(tables)
    except ValidationError as error:
        first = error.errors()[0]
        place = [str(part) for part in first["loc"]]
        why = free_text(f"{first['msg'][:1].lower()}{first['msg'][1:]}")
        raise _wrong_value(place, first["input"], why, source) from error


def _wrong_value(place: Sequence[str], value: Any, why: Message, source: TomlFile | None) -> InputError:
    """The error for a setting that cannot have this value."""
    told = {"name": ".".join(place), "value": shown(value), "why": why, "default": _default(place)}
    return _error(Message("settings/wrong-value", **told), source, place)


def _error(said: Message, source: TomlFile | None, place: Sequence[str]) -> InputError:
    """The error for a setting, at its line if a file has it."""
    *above, name = place
    return InputError(said) if source is None else source.error(said, table=".".join(above), key=name)


def _default(place: Sequence[str]) -> str:
    """Default of a setting as TOML, for a message."""
    value: Any = Settings()
    for name in place:
        value = getattr(value, name, value)  # a place inside a list ends at the list
    return "a table" if isinstance(value, BaseModel) else _toml(value)


def _check_tables(
    values: dict[str, Any], model: type[BaseModel], above: tuple[str, ...], source: TomlFile | None
) -> None:
    """Refuse names that are no settings, and integers that are none of TOML, at any depth."""
    for name, value in values.items():
        if name not in model.model_fields:
            near = nearest(name, tuple(model.model_fields))
            key = "settings/unknown-key" if near else "settings/unknown-key.far"
            said = Message(key, name=".".join((*above, name)), near=".".join((*above, near or "")))
            raise _error(said, source, (*above, name))
        if isinstance(value, int) and abs(value) > LARGEST:
            raise _wrong_value((*above, name), value, Message("settings/wrong-value.larger"), source)
        inner = model.model_fields[name].annotation
        if isinstance(value, dict) and isinstance(inner, type) and issubclass(inner, BaseModel):
            _check_tables(value, inner, (*above, name), source)


def _assign(tables: dict[str, Any], assignment: str) -> None:
    """Change one value in the tables."""
    name, equals, text = assignment.partition("=")
    keys = [key.strip() for key in name.split(".")]
    if not equals or len(keys) < 2 or not all(keys):
        raise InputError(Message("settings/assignment", given=repr(assignment)))
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except ValueError:
        value = text.strip()
    change: dict[str, Any] = {keys[-1]: value}
    for key in reversed(keys[:-1]):
        change = {key: change}
    _check_tables(change, Settings, (), None)
    inner = tables
    for key in keys[:-1]:
        inner[key] = inner = inner[key] if isinstance(inner.get(key), dict) else {}
    inner[keys[-1]] = value


def commented_settings(settings: Settings) -> str:
    """All settings as TOML: every value with its unit and the reason for it, as comments."""
    lines = [
        "# Settings of cablebend with their defaults. Keep the lines you change; what is not given has its default."
    ]
    _describe(settings, (), lines)
    return "\n".join(lines)


def _describe(model: BaseModel, above: tuple[str, ...], lines: list[str]) -> None:
    """Append one table: plain values first, as TOML wants it, then the tables inside."""
    inner = []
    if above:
        lines += ["", f"[{'.'.join(above)}]"]
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        if isinstance(value, BaseModel):
            inner.append((name, value))
            continue
        lines += textwrap.wrap(field.description or "", 110, initial_indent="# ", subsequent_indent="# ")
        lines.append(f"# {name} = ..." if value is None else f"{name} = {_toml(value)}")
    for name, value in inner:
        _describe(value, (*above, name), lines)


def _toml(value: Any) -> str:
    """A value as TOML; JSON writes numbers, texts, flags and lists alike."""
    return json.dumps(value, ensure_ascii=False)

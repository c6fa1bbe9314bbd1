"""``[[photos]]`` of ``specimen.toml`` -> `PhotoHints` by photo: what a person says where the program does not see it.

A photo that is left out leaves its step with its force. Lines about a photo that is no longer there are passed over, so
that a bad photo can simply be deleted.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pipeline.intake.tomltable import Check, TomlFile, checked_table, flag, number, path_text, require
from pipeline.messages import Message
from pipeline.records import Finding, LoadStep, PhotoHints, inferred

Point = tuple[float, float]
MOST_POINTS = 10_000


def read_hints(source: TomlFile) -> dict[str, PhotoHints]:
    """Hints by the photo's name relative to the folder.

    Raises `InputError` ``toml/unknown-key``, ``toml/wrong-value``, ``toml/missing-key``.
    """
    tables = source.tables.get("photos", [])
    if not isinstance(tables, list) or any(not isinstance(table, dict) for table in tables):
        raise source.error(Message("toml/wrong-value.photos"), table="", key="photos")
    hints: dict[str, PhotoHints] = {}
    for table in tables:
        values = checked_table(replace(source, tables={"photos": table}), "photos", CHECKS)
        if "image" not in values:
            raise source.error(Message("toml/missing-key.image"), table="photos")
        name = values.pop("image")
        hints[name] = PhotoHints(**values)
    return hints


def obeyed(
    steps: tuple[LoadStep, ...], hints: dict[str, PhotoHints]
) -> tuple[tuple[LoadStep, ...], tuple[Finding, ...]]:
    """Steps without the photos that hints leave out, and findings about the hints."""
    there = {step.image for step in steps}
    without = {name for name, hint in hints.items() if not hint.use and name in there}
    findings = [
        *(inferred("photo/left-out", image=name) for name in sorted(without)),
        *(inferred("photo/hint-unused", image=name) for name in sorted(hints.keys() - there)),
    ]
    kept = tuple(replace(step, image=None) if step.image in without else step for step in steps)
    return kept, tuple(findings)


def points(least: int, wanted: str, *, most: int = MOST_POINTS) -> Check:
    """At least so many different points, and no more than ``most``."""

    def check(value: Any) -> tuple[Point, ...]:
        require(isinstance(value, list) and least <= len(value) <= most, wanted)
        require(all(isinstance(point, list) and len(point) == 2 for point in value), wanted)
        found = tuple((number(point[0]), number(point[1])) for point in value)
        plausible = len(set(found)) >= least and max(abs(x) for point in found for x in point) <= 1e6
        require(plausible, "wanted.points", least=least, wanted=Message(wanted))
        return found

    return check


def _region(value: Any) -> tuple[float, float, float, float]:
    require(isinstance(value, list) and len(value) == 4, "wanted.region")
    u0, v0, u1, v1 = map(number, value)
    require(u0 < u1 and v0 < v1, "wanted.region")
    return u0, v0, u1, v1


def _polygons(value: Any) -> tuple[tuple[Point, ...], ...]:
    require(isinstance(value, list), "wanted.polygons")
    return tuple(map(points(3, "wanted.polygons"), value))


CHECKS: dict[str, Check] = {
    "image": path_text,
    "use": flag,
    "ends_px": points(2, "wanted.ends", most=2),
    "path_px": points(2, "wanted.clicks"),
    "region_px": _region,
    "exclude_px": _polygons,
}

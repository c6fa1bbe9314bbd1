"""The force log: a text file as testing machines and people write it -> load steps.

bytes -> text (`dialect`) -> columns and units (`columns`) -> samples in SI units (`samples`) -> holds with the force at
the moment of the photo (`holds`, `holdforce`). Forces are positive in compression, displacements toward the other
bearing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

from pipeline.errors import InputError
from pipeline.intake.access import read_bytes
from pipeline.intake.columns import Columns, find_columns
from pipeline.intake.dialect import decode
from pipeline.intake.holds import load_steps
from pipeline.intake.response import check_response
from pipeline.intake.samples import read_samples
from pipeline.intake.specimenfile import LogSpec
from pipeline.messages import Message
from pipeline.records import Finding, LoadStep, inferred
from pipeline.settings.intake import IntakeSettings


@dataclass(frozen=True)
class ForceLog:
    """A force log, read: its steps in the order of the test, and what a reader must know."""

    steps: tuple[LoadStep, ...]
    findings: tuple[Finding, ...]


def read_force_log(path: Path, spec: LogSpec, settings: IntakeSettings, length: float = math.inf) -> ForceLog:
    """Read a force log; ``spec`` is what the user says about it in ``specimen.toml``.

    Parameters
    ----------
    length : m
        Of the cable. No displacement is larger, which tells a fraction from a thousand where nothing else does.

    Raises
    ------
    InputError
        Codes ``file/...`` and ``log/...``: not readable, empty, no columns of force and displacement, a cell that is no
        number, a notation that can be read in two ways, a force that stands still.
    """
    data = read_bytes(path, limit=settings.log_max_bytes, setting="log_max_bytes")
    try:
        log = _read(data, spec, settings, length)
    except InputError as error:  # which file it is about is said here, once
        raise InputError(error.said, path=path, line=error.line) from error
    placed = (replace(one, said=Message(one.said.key, file=path.name, **one.said.values)) for one in log.findings)
    return replace(log, findings=tuple(placed))


def _read(data: bytes, spec: LogSpec, settings: IntakeSettings, length: float) -> ForceLog:
    text, encoding = decode(data, spec.encoding)
    columns, rows = find_columns(text, spec)
    samples, columns = read_samples(rows, columns, spec, length=length)
    steps, findings = load_steps(samples, spec, settings)
    check_response(steps)
    return ForceLog(steps, (*_reading(columns, encoding), *samples.findings, *findings))


def _reading(columns: Columns, encoding: str) -> list[Finding]:
    """What was inferred about the notation."""
    findings = []
    if encoding == "cp1252":
        findings.append(inferred("log/encoding-inferred"))
    if columns.skipped_lines:
        findings.append(inferred("log/metadata", line=columns.header_line))
    assumed = {role: unit.name for role, unit in columns.units.items() if unit.assumed}
    if assumed:
        taken = [Message("log/unit-assumed.role", role=role, unit=name) for role, name in assumed.items()]
        findings.append(inferred("log/unit-assumed", taken=taken))
    return findings

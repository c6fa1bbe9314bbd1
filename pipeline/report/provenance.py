"""Where the numbers come from: specimen and scale as given, how the fit went, versions, inputs, settings, command."""

from __future__ import annotations

import json
from typing import Any

from pipeline.report.figures import force_unit
from pipeline.report.words import Words
from pipeline.result import Result

# Shown in their own places, not in the list of plain facts.
APART = ("clock", "command", "inputs_sha256", "settings")

UNITS = {"scale": "-", "parallax": "-", "lens": "-", "tilt_along": "1/m", "tilt_across": "1/m"}
"""What is fitted besides the law as a share of itself; all else of that kind is in m."""


def provenance_rows(result: Result, words: Words) -> dict[str, Any]:
    """Command, plain facts, input hashes and settings of a result as the page shows them.

    Entries without a word for them are listed by their own names. ``clock`` is apart, for it is all that differs when
    the same input is measured again: report.pdf leaves it out.
    """
    source = result.provenance
    plain = {key: value for key, value in source.items() if key not in APART}
    facts, clock = (
        [(words.known(f"fact_{key}", key), _text(value)) for key, value in entries.items()]
        for entries in (plain, source.get("clock", {}))
    )
    return {
        "command": _text(source.get("command", "")),
        "facts": facts,
        "clock": clock,
        "inputs": list(source.get("inputs_sha256", {}).items()),
        "settings": json.dumps(source["settings"], indent=1, ensure_ascii=False) if "settings" in source else "",
    }


def _text(value: Any) -> str:
    """A fact as text; several facts of one kind, such as the versions of libraries, in one line."""
    if isinstance(value, dict):
        return ", ".join(f"{name} {_text(entry)}" for name, entry in value.items())
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def specimen_rows(result: Result, words: Words) -> list[tuple[str, str]]:
    """What was given: lengths, rig, free text, and the scale of the photos with its source."""
    part = result.specimen
    rows = [
        (words(name), f"{words.number(1e3 * value, 6)} mm ({words('given')})")
        for name, value in (("length", part.length_m), ("diameter", part.diameter_m))
        if value is not None
    ]
    if part.moving_bearing in ("left", "right"):
        rows.append((words("moving"), words(part.moving_bearing)))
    if result.scale is not None:
        scale = words.measured(result.scale.px_per_mm, result.scale.px_per_mm * result.scale.std_relative)
        rows.append((words("scale"), f"{scale} px/mm {words('scale_from', source=words.said(result.scale.said))}"))
    return rows + list(part.description.items())


def fit_rows(result: Result, words: Words) -> list[tuple[str, str]]:
    """How the simulation was fitted and how well it explains the data."""
    part = result.inverse
    if part is None:
        return []
    without = f" ({words('fit_without')})" if result.answer.method == "extended" else ""
    rows = [(words("fit_outcome"), (words.said(part.said).sentence if part.advice else part.outcome) + without)]
    if part.misfit is not None:
        misfit, force = part.misfit, force_unit(result, words)
        length = words.unit("m", misfit.shape_rmse_m)
        dof = misfit.degrees_of_freedom
        expected = words("expected", std=words.number((2.0 * dof) ** 0.5, 2))
        rows += [
            (words("fit_chi2"), f"{words.number(misfit.chi2, 4)} / {words.number(dof, 4)} ({expected})"),
            (words("fit_rmse"), f"{force.plain(misfit.force_rmse_N)}, {length.plain(misfit.shape_rmse_m)}"),
        ]
    return rows


def nuisance_rows(result: Result, words: Words) -> list[tuple[str, str]]:
    """What was fitted besides stiffness and pre-curvature."""
    rows = []
    for name, (value, std) in (result.inverse.nuisance if result.inverse else {}).items():
        unit = words.unit(UNITS.get(name, "m"), value, std)
        rows.append((words.known(f"nuisance_{name}", name), unit.text(value, std)))
    return rows

"""Where the numbers come from: specimen and scale as given, how the fit went, versions, inputs, settings, command."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from pipeline.report.figures import force_unit
from pipeline.report.words import Words
from pipeline.result import Result
from pipeline.units import suited

# Shown in their own places, not in the list of plain facts.
APART = ("command", "inputs", "inputs_sha256", "settings")


@dataclass(frozen=True)
class Provenance:
    """Command, plain facts, input hashes and settings of a result."""

    command: str
    facts: list[tuple[str, str]]
    inputs: list[tuple[str, str]]
    settings: str


def provenance_rows(result: Result) -> Provenance:
    """Provenance as the page shows it; unknown entries are listed as facts."""
    source = result.provenance
    facts: list[tuple[str, str]] = []
    for key, value in source.items():
        if key in APART:
            continue
        if isinstance(value, dict):
            facts += [(f"{key}: {name}", _text(entry)) for name, entry in value.items()]
        else:
            facts.append((key, _text(value)))
    inputs = source.get("inputs_sha256", source.get("inputs"))
    return Provenance(
        command=_text(source.get("command", "")),
        facts=facts,
        inputs=[(str(n), _text(h)) for n, h in inputs.items()] if isinstance(inputs, dict) else [],
        settings=json.dumps(source["settings"], indent=1, ensure_ascii=False) if "settings" in source else "",
    )


def _text(value: Any) -> str:
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
        rows.append((words("scale"), f"{scale} px/mm {words('scale_from', source=words.said(result.scale.source))}"))
    return rows + list(part.description.items())


def fit_rows(result: Result, words: Words) -> list[tuple[str, str]]:
    """How the simulation was fitted and how well it explains the data."""
    part = result.inverse
    if part is None:
        return []
    rows = [
        (words("fit_outcome"), words.said(part.advice or part.outcome).text),
        (words("fit_iterations"), f"{part.iterations} ({words('exact')})"),
    ]
    if part.knots_chosen_by:
        rows.append((words("fit_knots"), words.said(part.knots_chosen_by).text))
    if part.misfit is not None:
        misfit, force = part.misfit, force_unit(result, words)
        length = suited([misfit.shape_rmse_m], "m", decimal=words.decimal)
        dof = misfit.degrees_of_freedom
        rows += [
            (
                words("fit_chi2"),
                f"{words.number(misfit.chi2, 4)} / {words.number(dof, 4)} "
                f"({words('expected', std=words.number((2.0 * dof) ** 0.5, 2))})",
            ),
            (words("fit_rmse"), f"{force.plain(misfit.force_rmse_N)}, {length.plain(misfit.shape_rmse_m)}"),
        ]
    return rows


def nuisance_rows(result: Result, words: Words) -> list[tuple[str, str]]:
    """What was fitted besides stiffness and pre-curvature, in SI units: scale, length, place of the bearing axes."""
    nuisance = result.inverse.nuisance if result.inverse else {}
    return [(name.replace("_", " "), words.measured(value, std)) for name, (value, std) in nuisance.items()]

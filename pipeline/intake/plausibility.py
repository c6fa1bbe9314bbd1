"""Whether lengths, forces and scale fit together: a unit wrong by a thousand shows before anything is measured.

The check of the force: a bent cable between pins pushes with about its buckling load, so ``P L^2 / pi^2`` estimates EI
(Euler), and divided by ``I = pi d^4 / 64`` of a full round section a modulus that hardly any cable leaves: rubber alone
is the lower end, strands of metal that stick together the upper. Nothing leaves the wider range in which the finding is
an error: above, the cable would be stiffer than a bar of steel; below, softer than the finest copper wires of that
diameter lying loose, each bending for itself, ``E = share E_copper (d_wire / d)^2``. Symbols: P force, L length, d
diameter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pipeline.messages import Message
from pipeline.records import Finding, LoadStep, doubtful
from pipeline.settings.intake import IntakeSettings

THIN_PX = 4.0
"""Diameter times the scale given: a thinner cable has no two edges to measure, and the scale was probably
written as mm per px."""

SLENDER = 5.0
"""Length over diameter; below, a cable is no rod in bending and a unit is probably wrong."""

STEEL_MPA = 210_000.0
"""Modulus of steel: nothing that a cable is made of in bulk has more."""

BENT = 1.5
"""P L^2 / pi^2 over EI at most: 1.1 for a bend of a tenth of the length, 1.5 where it is pushed against its bow."""

LOOSE_MPA_MM2 = 3.0
"""Modulus times square of the diameter of loose copper wires (120 GPa), 0.01 mm thick, on a quarter of the section."""

READINGS = {
    1e9: "MN-for-mN",
    1e6: "MN-for-N",
    1e3: "mN-as-N",
    102.0: "grams-as-N",
    9.81: "N-as-kgf",
    1.0 / 9.81: "kgf-as-N",
    1e-3: "kN-as-N",
    1e-6: "kN-as-mN",
}
"""What a force that is so many times too large may be."""


def size_findings(
    length_m: float,
    diameter_m: float,
    steps: Sequence[LoadStep],
    *,
    scale_px_per_m: float | None = None,
    settings: IntakeSettings,
) -> tuple[Finding, ...]:
    """Warnings, with the figures, about sizes that do not fit together."""
    findings = []
    width = None if scale_px_per_m is None else scale_px_per_m * diameter_m
    if width is not None and width < THIN_PX:
        findings.append(doubtful("size/scale", width_px=width))
    slenderness = length_m / diameter_m
    if slenderness < SLENDER:
        findings.append(doubtful("size/slenderness", slenderness=slenderness, least=SLENDER))
    largest = max(step.displacement_m for step in steps)
    share = largest / length_m
    if share >= 1.0 or 0.0 < share < 1e-3:
        findings.append(doubtful("size/displacement", largest_m=largest, share=share, length_m=length_m))
    return (*findings, *_force_size(length_m, diameter_m, steps, settings))


def _force_size(
    length_m: float, diameter_m: float, steps: Sequence[LoadStep], settings: IntakeSettings
) -> tuple[Finding, ...]:
    """The size check P L^2 / (pi^2 EI) on the steps that are bent."""
    furthest = max(step.displacement_m for step in steps)
    bent = [abs(step.force_N) for step in steps if step.displacement_m > 0.2 * furthest or furthest <= 0.0]
    force = float(np.median(bent))
    stiffness = force * length_m**2 / math.pi**2
    modulus_mpa = stiffness / (math.pi * diameter_m**4 / 64.0) * 1e-6
    usual = settings.modulus_range_mpa
    if usual[0] <= modulus_mpa <= usual[1]:
        return ()
    loose = LOOSE_MPA_MM2 / (diameter_m * 1e3) ** 2
    bound = "steel" if modulus_mpa > BENT * STEEL_MPA else "wires" if modulus_mpa < loose else "cables"
    said = Message(
        "size/force",
        reading=_too_large(modulus_mpa, usual),
        force_N=force,
        length_m=length_m,
        stiffness_Nm2=stiffness,
        modulus_MPa=float(f"{modulus_mpa:.3g}"),
        diameter_m=diameter_m,
        bound=Message(f"size/force.{bound}", steel_MPa=STEEL_MPA, loose_MPa=loose, low_MPa=usual[0], high_MPa=usual[1]),
    )
    return (Finding("size/force", "warning" if bound == "cables" else "error", said),)


def _too_large(modulus_mpa: float, usual: tuple[float, float]) -> Message:
    """By which factor the forces may be off, if a mistaken unit brings the modulus back among those of cables."""
    stiff = modulus_mpa > usual[1]
    key, power = ("size/force.too-large", 1.0) if stiff else ("size/force.too-small", -1.0)
    readings = [
        Message(key, times=factor**power, reading=reading)
        for factor, reading in READINGS.items()
        if (factor > 1.0) == stiff and usual[0] <= modulus_mpa / factor <= usual[1]
    ]
    return Message("size/force.unit", readings=readings) if readings else Message("size/force.misfit")

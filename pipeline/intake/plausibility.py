"""Does the size of things fit? Units off by a thousand show before anything is measured.

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

from pipeline.intake.noted import doubtful
from pipeline.records import Finding, LoadStep
from pipeline.rounding import plain
from pipeline.settings.intake import IntakeSettings
from pipeline.units import quantity

STEEL_MPA = 210_000.0
"""Modulus of steel: nothing that a cable is made of in bulk has more."""

BENT = 1.5
"""P L^2 / pi^2 over EI at most: 1.1 for a bend of a tenth of the length, 1.5 where it is pushed against its bow."""

LOOSE_MPA_MM2 = 3.0
"""Modulus times square of the diameter of loose copper wires (120 GPa), 0.01 mm thick, on a quarter of the section."""

READINGS = {
    1e9: "MN written for mN",
    1e6: "MN written for N",
    1e3: "mN taken for N, or N for kN",
    102.0: "grams taken for N",
    9.81: "N taken for kgf",
    1.0 / 9.81: "kgf taken for N",
    1e-3: "kN taken for N, or N for mN",
    1e-6: "kN taken for mN",
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
    if width is not None and width < settings.cable_width_min_px:
        message = (
            f"at the scale given the cable is {width:.2g} px wide on the photos, too thin to be measured: "
            "scale_px_per_mm counts px per mm, not mm per px"
        )
        findings.append(doubtful("size/scale", message))
    slenderness = length_m / diameter_m
    if slenderness < settings.slenderness_min:
        message = f"length_mm / diameter_mm is {slenderness:.3g}; below {settings.slenderness_min:g} a cable does not"
        findings.append(doubtful("size/slenderness", f"{message} bend as a rod, check both for their unit"))
    largest = max(step.displacement_m for step in steps)
    share = largest / length_m
    if share >= 1.0 or 0.0 < share < 1e-3:
        message = (
            f"the largest displacement is {largest * 1e3:.4g} mm, {share:.3g} of the length {length_m * 1e3:.4g} mm"
        )
        findings.append(doubtful("size/displacement", f"{message}: check the unit of the displacement"))
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
    asked = plain(float(f"{modulus_mpa:.3g}"))
    reached = (
        f"a force of {quantity(force, 'N')} on a cable of {length_m * 1e3:.4g} mm asks for EI = P L^2/pi^2 = "
        f"{quantity(stiffness, 'N m²')}, that is a modulus of {asked} MPa for {diameter_m * 1e3:.3g} mm "
        "diameter"
    )
    loose = LOOSE_MPA_MM2 / (diameter_m * 1e3) ** 2
    if modulus_mpa > BENT * STEEL_MPA:
        bound = f"a bar of steel has {STEEL_MPA:.0f} MPa, and no cable more"
    elif modulus_mpa < loose:
        bound = f"the finest wires lying loose have {plain(loose, 1)} MPa, and no cable less"
    else:
        bound = f"cables have {usual[0]:g} to {usual[1]:g} MPa"
    message = (
        f"{_too_large(modulus_mpa, usual)}: {reached}; {bound}: check the unit of the force (mN, N, kN), length_mm and "
        "diameter_mm"
    )
    impossible = not loose <= modulus_mpa <= BENT * STEEL_MPA
    return (Finding("size/force", "error", message) if impossible else doubtful("size/force", message),)


def _too_large(modulus_mpa: float, usual: tuple[float, float]) -> str:
    """By which factor the forces may be off, if a mistaken unit brings the modulus back among those of cables."""
    stiff = modulus_mpa > usual[1]
    readings = [
        (f"{factor:.10g} times too large" if stiff else f"{1.0 / factor:.10g} times too small") + f" ({said})"
        for factor, said in READINGS.items()
        if (factor > 1.0) == stiff and usual[0] <= modulus_mpa / factor <= usual[1]
    ]
    if not readings:
        return "the forces do not fit the size of the cable"
    return f"the forces seem to be {' or '.join(readings)}"

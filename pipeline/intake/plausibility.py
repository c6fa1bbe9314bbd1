"""Does the size of things fit? Units off by a thousand show before anything is measured.

The check of the force: a bent cable between pins pushes with about its buckling load, so ``P L^2 / pi^2`` estimates EI
(Euler), and divided by ``I = pi d^4 / 64`` of a full round section a modulus that no cable leaves: rubber alone is the
lower end, strands of metal that stick together the upper. Symbols: P force, L length, d diameter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pipeline.intake.noted import doubtful
from pipeline.records import Finding, LoadStep
from pipeline.settings.intake import IntakeSettings
from pipeline.units import quantity


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
    low, high = settings.modulus_range_mpa
    if low <= modulus_mpa <= high:
        return ()
    message = (
        f"a force of {quantity(force, 'N')} on a cable of {length_m * 1e3:.4g} mm asks for EI = P L^2/pi^2 = "
        f"{quantity(stiffness, 'N m²')}, that is a modulus of {modulus_mpa:.3g} MPa for {diameter_m * 1e3:.3g} mm "
        f"diameter; cables have {low:g} to {high:g} MPa: check the unit of the force (mN, N, kN), length_mm and "
        "diameter_mm"
    )
    return (doubtful("size/force", message),)

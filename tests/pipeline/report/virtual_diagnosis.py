"""Diagnoses as the diagnosis room would leave them, one for each verdict of the contract."""

from __future__ import annotations

import numpy as np

from pipeline.result import (
    BlindSpot,
    CausePart,
    CauseRow,
    DiagnosisPart,
    GainPart,
    LeftoverPart,
    NextExperiment,
    ResidualMap,
)
from tests.pipeline.report.virtual_result import LENGTH, STEPS, curve_of

CAUSES = {
    "hysteresis": (14.2, 0.0034, 0.0003, "N m", 0.031),
    "bearing_friction": (12.9, 0.0041, 0.0004, "N m", 0.024),
    "plastic_set": (3.1, 0.02, 0.007, "1/m per 1/m", 0.006),
    "rig_compliance": (-0.8, -2e-5, 3e-5, "m/N", -0.002),
    "scale_error": (0.4, 0.0002, 0.0004, "-", 0.0),
    "force_gain": (0.0, 0.0, 1.0, "-", None),
}


def causes_of(verdict):
    """The causes a verdict names."""
    names = {
        "named": [("hysteresis", ["hysteresis"], 0.96)],
        "class": [("hysteresis", ["hysteresis", "bearing_friction"], 0.57)],
        "two_causes": [("hysteresis", ["hysteresis"], 0.9), ("plastic_set", ["plastic_set"], 0.8)],
    }.get(verdict, [])
    return [
        CausePart(name=n, **{"class": c}, probability=p, estimate=CAUSES[n][1], std=CAUSES[n][2], unit=CAUSES[n][3])
        for n, c, p in names
    ]


def diagnosis_of(verdict, photos):
    """A diagnosis with the parts its verdict has."""
    s = np.linspace(0.0, LENGTH, 81)
    wave = 4.0 * np.sin(np.pi * s / LENGTH)
    found = verdict in ("named", "class", "two_causes")

    def residuals(size):
        rows = [(size * (wave if photo.step < 4 else -wave)).tolist() for photo in photos]
        return ResidualMap(
            s_m=s.tolist(),
            steps=[photo.step for photo in photos],
            branches=[STEPS[photo.step][1] for photo in photos],
            shape_sigma=rows,
            shape_m=[
                [3e-6 * sigma for sigma in row] for row in rows
            ],  # a cell averages what the photo shows point by point
            force_sigma=[6.0 * size] * len(photos),
        ).model_dump()

    return DiagnosisPart(
        verdict=verdict,
        headline=f"The verdict is {verdict}: hysteresis between the wires bends <the> answer.",
        causes=causes_of(verdict),
        table=[
            CauseRow(
                name=name,
                z=z,
                p_adjusted=1e-6 if z > 5 else 0.8,
                estimate=estimate,
                std=std,
                unit=unit,
                minimal_detectable=3 * std,
                surviving_fraction=0.4,
                nearest_twin="bearing_friction",
                twin_cosine=0.91,
                delta_chi2=z * z,
                heldout_excess_removed=0.9 if z > 5 else None,
                stiffness_shift=shift,
            )
            for name, (z, estimate, std, unit, shift) in CAUSES.items()
        ],
        gain=GainPart(
            heldout_excess_removed=0.94, ci95=(0.88, 0.98), force_rmse_N=(0.051, 0.004), shape_rmse_m=(1.1e-4, 1.2e-5)
        )
        if found
        else None,
        blind_spots=[BlindSpot(name="force_gain", stiffness_bias_at_plausible_size=0.011, settled_by="dead weights")],
        next_experiment=NextExperiment(what="turn the cable end for end", separates=["hysteresis", "bearing_friction"])
        if verdict != "adequate"
        else None,
        extended=curve_of(0.005) if found else None,
        leftover=LeftoverPart(
            message="A hump at mid-span on all photos.", s_m=s.tolist(), shape_m=(1e-6 * wave).tolist()
        )
        if verdict == "unexplained"
        else None,
        residuals_before=residuals(1.0),
        residuals_after=residuals(0.1) if found else None,
        twins={"hysteresis": {"bearing_friction": 0.97, "plastic_set": -0.4}, "bearing_friction": {"plastic_set": 0.3}},
    )

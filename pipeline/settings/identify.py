"""Settings of the room ``identify``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class IdentifySettings(BaseModel):
    """Thresholds of ``identify``: both ways to the characteristic and their comparison."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    length_std_relative: float = Field(
        5e-4, gt=0, description="relative; a steel rule read to 0.1 mm on a cable of 200 mm"
    )
    force_std_floor_relative: float = Field(
        2e-4, gt=0, description="of the largest force; a load cell of the best class, however quiet its samples are"
    )
    displacement_std_m: float = Field(
        2e-5, gt=0, description="m; a spindle with a dial gauge, against the chord on the photos"
    )
    axis_std_m: float = Field(
        5e-5,
        ge=0,
        description="m; of each coordinate of a bearing axis, common to all photos: a cover's shadow pulls its rim by "
        "a fifth of a pixel on every photo alike, and covers are glued or screwed on to a twentieth of a mm",
    )
    camera_foot_std_m: float = Field(
        0.05,
        ge=0,
        description="m; of the point below the camera about the picture's middle: 3 degrees off plumb at a metre, or a "
        "photo that was cut",
    )
    agreement_level: float = Field(0.05, gt=0, lt=1, description="level of the test whether both ways agree")
    pre_curvature_sigma: float = Field(
        3.5, gt=0, description="standard deviations; K0 from photo, balance and inverse: three pairs, one false in 700"
    )
    chord_sigma: float = Field(
        4.0,
        gt=0,
        description="standard deviations; chord against displacement: a false one in 2,000 tests of eight steps",
    )
    nuisance_sigma: float = Field(
        3.5, gt=0, description="standard deviations; fitted length or scale against what was told"
    )
    misfit_level: float = Field(
        1e-4,
        gt=0,
        lt=1,
        description="probability; below it residuals count as beyond noise: rare even over many photos",
    )
    force_zero_sigma: float = Field(
        4.0, gt=0, description="standard deviations; force of the force-free step against 0"
    )
    branch_level: float = Field(
        0.01, gt=0, lt=1, description="level of the test whether loading and unloading show the same characteristic"
    )

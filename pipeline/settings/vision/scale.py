"""Settings of scale and plane of the photos: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class CalibrationSettings(StageSettings):
    """Scale and plane of the photos."""

    given_scale_std: float = Field(
        0.001, gt=0, description="relative; a scale bar read on a photo: one pixel in a thousand"
    )
    length_scale_std: float = Field(
        0.005, gt=0, description="relative; 1 mm on 200 mm: how well the length between the axes is known"
    )
    max_scale_std: float = Field(
        0.01, gt=0, description="relative; a source of scale worse than that is no better than the cable's length"
    )
    corner_step_px: float = Field(1e-3, gt=0, description="px; a tenth of what noise leaves at best")
    usual_lens: float = Field(
        0.02, gt=0, description="relative; standard deviation of k1 at half the diagonal among lenses nobody corrected"
    )
    max_border_std: float = Field(
        0.002,
        gt=0,
        description="relative, scale at the border against the middle; curvature is off by half of it, 0.1 %",
    )
    usual_distance_m: float = Field(
        0.8,
        gt=0,
        description="m; camera above the cable where nobody says; twice the standard deviations that follow from it"
        " reach a bench stand of 0.4 m",
    )
    check_sigmas: float = Field(3.0, gt=0, description="sigmas; one false finding in 400 checks")

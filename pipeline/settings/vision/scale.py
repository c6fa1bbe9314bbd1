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
    usual_distance_m: float = Field(
        0.8,
        gt=0,
        description="m; camera above the cable where nobody says; twice the standard deviations that follow from it"
        " reach a bench stand of 0.4 m",
    )

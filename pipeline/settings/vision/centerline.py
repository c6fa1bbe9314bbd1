"""Settings of the sub-pixel measurement of the centerline: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class CurveSettings(StageSettings):
    """Centerline, and what forbids a measurement."""

    points: int = Field(201, ge=20, description="points of the centerline: 1 mm for a cable of 0.2 m")
    max_band_percent: float = Field(
        30.0,
        gt=0,
        description="per cent of the range of curvature; a photo whose 95 % band is wider on either side tells no law",
    )

"""Settings of the room ``vision``: unit in the name, reason in the description; one part a stage."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from pipeline.settings.vision_curve import CurveSettings
from pipeline.settings.vision_stages import (
    BearingSettings,
    CalibrationSettings,
    PhotoSettings,
    PreviewSettings,
    SegmentationSettings,
    SeriesSettings,
)


class VisionSettings(BaseModel):
    """Thresholds of ``vision``, by stage: photo, calibration, segmentation, bearings, series, preview."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    photo: PhotoSettings = Field(default_factory=PhotoSettings)
    calibration: CalibrationSettings = Field(default_factory=CalibrationSettings)
    segmentation: SegmentationSettings = Field(default_factory=SegmentationSettings)
    bearings: BearingSettings = Field(default_factory=BearingSettings)
    curve: CurveSettings = Field(default_factory=CurveSettings)
    series: SeriesSettings = Field(default_factory=SeriesSettings)
    preview: PreviewSettings = Field(default_factory=PreviewSettings)

"""Settings of the room ``vision``: unit in the name, reason in the description; one part a stage."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.centerline import CurveSettings
from pipeline.settings.vision.photo import PhotoSettings, PreviewSettings
from pipeline.settings.vision.scale import CalibrationSettings
from pipeline.settings.vision.series import SeriesSettings
from pipeline.settings.vision.stage import StageSettings


class VisionSettings(StageSettings):
    """Thresholds of ``vision``, by stage: photo, calibration, curve, series, preview."""

    photo: PhotoSettings = Field(default_factory=PhotoSettings)
    calibration: CalibrationSettings = Field(default_factory=CalibrationSettings)
    curve: CurveSettings = Field(default_factory=CurveSettings)
    series: SeriesSettings = Field(default_factory=SeriesSettings)
    preview: PreviewSettings = Field(default_factory=PreviewSettings)

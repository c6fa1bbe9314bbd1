"""What a user may set, with unit, default and the reason for the default; one file a room.

A room gets its own part only. ``Settings()`` holds the defaults; unknown keys are refused.
"""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.batch import BatchSettings
from pipeline.settings.diagnosis import DiagnosisSettings
from pipeline.settings.identify import IdentifySettings
from pipeline.settings.intake import IntakeSettings
from pipeline.settings.part import SettingsPart
from pipeline.settings.report import ReportSettings
from pipeline.settings.vision import VisionSettings

__all__ = [
    "BatchSettings",
    "DiagnosisSettings",
    "IdentifySettings",
    "IntakeSettings",
    "ReportSettings",
    "Settings",
    "VisionSettings",
]


class Settings(SettingsPart):
    """All settings, by room."""

    intake: IntakeSettings = Field(default_factory=IntakeSettings)
    vision: VisionSettings = Field(default_factory=VisionSettings)
    identify: IdentifySettings = Field(default_factory=IdentifySettings)
    diagnosis: DiagnosisSettings = Field(default_factory=DiagnosisSettings)
    report: ReportSettings = Field(default_factory=ReportSettings)
    batch: BatchSettings = Field(default_factory=BatchSettings)

"""Settings of the room ``diagnosis``: unit in the name or the description, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.part import SettingsPart


class DiagnosisSettings(SettingsPart):
    """Thresholds of ``diagnosis``."""

    # detection
    false_alarm: float = Field(0.01, description="probability of naming anything on a specimen without effect")
    power: float = Field(0.9, description="probability at which the minimal detectable effect is stated")
    seed: int = Field(20240229, description="of every simulated distribution, so that a report repeats to the digit")

    # naming
    twin_cosine: float = Field(0.95, description="|cos| above which two causes that remove as much are one class")
    powerless: float = Field(
        0.34, description="share of the causes; `underpowered` if fewer would have shown at a plausible size"
    )
    separated: float = Field(4.0, description="sigma; two explanations this far apart are told apart")

    # blind spots
    harm: float = Field(0.005, description="relative change of f_EI from which an invisible cause is worth a warning")

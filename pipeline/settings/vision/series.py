"""Settings of a specimen's photos together: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class SeriesSettings(StageSettings):
    """Photos of one specimen together."""

    max_fixed_shift_m: float = Field(
        2e-4, gt=0, description="m; the fixed bearing may rock by its play; more means that camera or frame moved"
    )
    max_length_spread: float = Field(
        0.005, gt=0, description="relative; a cable's length is constant, tracing repeats within a tenth of this"
    )
    max_length_deviation: float = Field(
        0.01, gt=0, description="relative; length_mm is measured to about half a percent and so is the scale"
    )

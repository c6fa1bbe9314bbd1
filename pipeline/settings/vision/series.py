"""Settings of a specimen's photos together: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class SeriesSettings(StageSettings):
    """Photos of one specimen together."""

    min_travel_m: float = Field(
        2e-4, gt=0, description="m; below it rounding of the log and play of the bearings hide which bearing moves"
    )
    max_fixed_shift_m: float = Field(
        2e-4, gt=0, description="m; the fixed bearing may rock by its play; more means that camera or frame moved"
    )
    least_steady: int = Field(
        3, ge=3, description="photos; of two that differ nothing tells which one shows the fixed bearing in its place"
    )
    steady_share: float = Field(
        0.6, gt=0.5, le=1, description="of the photos; so many show the fixed bearing in one place, or the camera moved"
    )
    other_side_widths: float = Field(
        0.5, gt=0, description="widths; a bow that anyone sees: a smaller one to the other side is a straight cable"
    )
    max_length_spread: float = Field(
        0.005, gt=0, description="relative; a cable's length is constant, tracing repeats within a tenth of this"
    )
    cropped_length: float = Field(
        0.03,
        gt=0,
        description="relative; of the cable's length in px on a photo of another size: it is found within a third of"
        " that, and nobody scales a photo by less",
    )
    max_length_deviation: float = Field(
        0.01, gt=0, description="relative; length_mm is measured to about half a percent and so is the scale"
    )

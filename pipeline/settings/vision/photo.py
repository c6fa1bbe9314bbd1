"""Settings of reading photos and of the pictures shown of them: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class PhotoSettings(StageSettings):
    """Loading of photos."""

    max_megapixels: float = Field(
        120.0, gt=0, description="Mpx; a larger photo is refused before decoding: 12 bytes a pixel would pass 1.5 GB"
    )
    min_side_px: int = Field(32, ge=1, description="px; a smaller picture shows no cable of five widths and its ground")


class PreviewSettings(StageSettings):
    """Pictures for people."""

    long_side_px: int = Field(1200, ge=200, description="px; as wide as a report's column on a dense screen")
    jpeg_quality: int = Field(80, ge=10, le=100, description="percent; about 80 kB a photo without visible blocks")

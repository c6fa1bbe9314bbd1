"""Settings of the room ``vision``: unit in the name, reason in the description; one part a stage."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.part import SettingsPart


class PhotoSettings(SettingsPart):
    """Loading of photos."""

    max_megapixels: float = Field(
        120.0, gt=0, description="Mpx; a larger photo is refused before decoding: 12 bytes a pixel would pass 1.5 GB"
    )
    min_side_px: int = Field(32, ge=1, description="px; a smaller picture shows no cable of five widths and its ground")


class CalibrationSettings(SettingsPart):
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


class CurveSettings(SettingsPart):
    """Centerline, and what forbids a measurement."""

    points: int = Field(201, ge=20, description="points of the centerline: 1 mm for a cable of 0.2 m")
    max_band_percent: float = Field(
        30.0,
        gt=0,
        description="per cent of the range of curvature; a photo whose 95 % band is wider on either side tells no law",
    )


class SeriesSettings(SettingsPart):
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


class PreviewSettings(SettingsPart):
    """Pictures for people."""

    long_side_px: int = Field(1200, ge=200, description="px; as wide as a report's column on a dense screen")
    jpeg_quality: int = Field(80, ge=10, le=100, description="percent; about 80 kB a photo without visible blocks")


class VisionSettings(SettingsPart):
    """Thresholds of ``vision``, by stage: photo, calibration, curve, series, preview."""

    photo: PhotoSettings = Field(default_factory=PhotoSettings)
    calibration: CalibrationSettings = Field(default_factory=CalibrationSettings)
    curve: CurveSettings = Field(default_factory=CurveSettings)
    series: SeriesSettings = Field(default_factory=SeriesSettings)
    preview: PreviewSettings = Field(default_factory=PreviewSettings)

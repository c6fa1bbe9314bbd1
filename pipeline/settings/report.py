"""Settings of the room ``report``: unit in the name, reason in the description."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pipeline.settings.part import SettingsPart


class ReportSettings(SettingsPart):
    """What the report shows and how."""

    language: Literal["en", "de"] = Field("en", description="language and number format of report and index")
    band_coverage: float = Field(
        0.95, gt=0.0, lt=1.0, description="share of normal errors inside the drawn bands; 95 % is what readers expect"
    )
    equivalent_range_per_m: tuple[float, float] | None = Field(
        None, description="1/m; curvature range of the equivalent constant EI; none: the whole visited range"
    )
    photos_in_pdf: int = Field(
        6, ge=0, description="photos drawn in report.pdf; six fill one page at a size where the line can be judged"
    )

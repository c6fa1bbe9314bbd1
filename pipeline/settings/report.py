"""Settings of the room ``report``: unit in the name, reason in the description."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class ReportSettings(BaseModel):
    """What the report shows and how."""

    model_config = ConfigDict(frozen=True, extra="forbid")

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
    map_columns: int = Field(
        120, ge=10, description="columns of a residual map along s; at 440 px a column is 3 px, finer is not seen"
    )
    map_limit_sigma: float = Field(
        5.0, gt=0.0, description="colour scale of residual maps ends here; beyond 5 sigma the size no longer matters"
    )
    residual_noise_sigma: float = Field(
        2.0, gt=0.0, description="residuals inside this band are called noise in figures; 95 % of normal errors"
    )
    misfit_sigma: float = Field(
        3.0,
        gt=0.0,
        description="chi-square beyond expectation by this many standard deviations is misfit; 1 in 700 by chance",
    )
    index_curve_points: int = Field(
        24,
        ge=4,
        description="points of a characteristic kept in the index; a natural spline of 3 to 6 knots needs no more",
    )
    pooled_types_drawn: int = Field(
        24, ge=0, description="pooled cable types with a figure in the index; more would make it slow to open"
    )
    pooled_p_value: float = Field(
        0.05, gt=0.0, lt=1.0, description="repeat specimens differ below this p value; the usual one in twenty"
    )

"""Settings of the room ``compare``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class CompareSettings(BaseModel):
    """Thresholds of ``compare``: when two results are called different, and what makes that doubtful."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    level: float = Field(
        0.05, gt=0, lt=1, description="level of both tests together (f_EI and K0): one false difference in twenty"
    )
    least_overlap: float = Field(
        0.5, gt=0, le=1, description="share of the larger visited range; below it most of a curve is not compared"
    )
    length_relative: float = Field(
        0.02,
        gt=0,
        description="lengths that differ by more are another set-up: covers and rigid ends then weigh differently",
    )

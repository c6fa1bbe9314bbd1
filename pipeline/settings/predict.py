"""Settings of the room ``predict``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class PredictSettings(BaseModel):
    """Thresholds of ``predict``: how a new experiment is simulated and where the identified model ends."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    elements: int = Field(
        400, ge=20, description="of the simulated rod; its height is within 1e-6 of the length, a fifth of a good band"
    )
    range_slack: float = Field(
        0.01,
        ge=0,
        description="share of the visited range by which a curvature may lie outside it: a repeated step may come "
        "out sharper by the noise of its photo, and f_EI does not change on that distance",
    )

"""Settings of the room ``report``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class ReportSettings(BaseModel):
    """Thresholds of ``report``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

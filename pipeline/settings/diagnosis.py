"""Settings of the room ``diagnosis``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class DiagnosisSettings(BaseModel):
    """Thresholds of ``diagnosis``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

"""Settings of the room ``intake``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class IntakeSettings(BaseModel):
    """Thresholds of ``intake``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

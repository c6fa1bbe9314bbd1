"""Settings of the room ``batch``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class BatchSettings(BaseModel):
    """Thresholds of ``batch``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

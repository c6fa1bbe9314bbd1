"""Settings of the room ``vision``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class VisionSettings(BaseModel):
    """Thresholds of ``vision``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

"""Settings of the room ``identify``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class IdentifySettings(BaseModel):
    """Thresholds of ``identify``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

"""What the settings of all stages of ``vision`` have in common."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class StageSettings(BaseModel):
    """Base of the stages: frozen, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")

"""Settings of the room ``batch``: how many specimens at a time, and how long one may take."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.part import SettingsPart


class BatchSettings(SettingsPart):
    """Limits of ``batch``; none of them changes a result."""

    workers: int = Field(0, ge=0, description="processes on this machine; 0: one a core, each with one thread")
    in_process: bool = Field(
        False, description="measure in this process, one after the other and without timeout: for debugging"
    )
    timeout_s: float = Field(
        900.0,
        gt=0,
        description="s for one specimen; fifteen times what a full diagnosis of six photos takes",
    )
    reports: bool = Field(
        True,
        description="draw report.html and report.pdf of every specimen, about half of its time on three photos; "
        "without, the same run with them draws what is missing and measures nothing again",
    )
    memory_per_worker_gb: float = Field(
        0.0, ge=0, description="GB after which a worker is stopped and its specimen reported; 0: memory / workers"
    )

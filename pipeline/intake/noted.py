"""Two kinds of findings of the intake: what was inferred, and what contradicts."""

from __future__ import annotations

from pipeline.records import Finding


def inferred(code: str, message: str) -> Finding:
    """Something the files do not say and that was concluded from them."""
    return Finding(code, "info", message)


def doubtful(code: str, message: str) -> Finding:
    """A contradiction or a loss: measured all the same, but a person should look."""
    return Finding(code, "warning", message)

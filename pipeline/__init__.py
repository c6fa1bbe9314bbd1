"""From a folder of photos and forces to a report of the bending stiffness characteristic.

``from pipeline import measure`` loads what measuring needs when it is asked for; ``import pipeline`` loads nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.result import Result, read_result
    from pipeline.run import measure, write
    from pipeline.settings import Settings

__version__ = "0.1.0"
__all__ = ["Result", "Settings", "__version__", "measure", "read_result", "write"]

# name -> module that holds it
OFFERED = {
    "Result": "pipeline.result",
    "Settings": "pipeline.settings",
    "measure": "pipeline.run",
    "read_result": "pipeline.result",
    "write": "pipeline.run",
}


def __getattr__(name: str) -> Any:
    """A name of the package, loaded now."""
    if name not in OFFERED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(OFFERED[name]), name)


def __dir__() -> list[str]:
    """Names to complete."""
    return sorted(__all__)

"""Bending stiffness of cables from photos and forces: everything a notebook or a program of your own needs.

``measure(folder)`` gives a result, ``result.answer`` the curve that counts, with its band and K0; the functions below
predict, compare, export and draw. `estimate` and `balance` are the two ways on data of your own; ``rod`` and all that
it exports, `bend` above all, are the mechanics alone. A name is loaded when it is first used. SI units; the unit stands
in every name.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import rod
from pipeline import __version__

if TYPE_CHECKING:
    from pipeline.compare import compare
    from pipeline.diagnosis.plans.design import Plan, design
    from pipeline.errors import InputError
    from pipeline.predict import predict
    from pipeline.report.exports import export
    from pipeline.report.frames import (
        causes_frame,
        centerlines_frame,
        characteristic_frame,
        forces_frame,
        photos_frame,
        simulation_frame,
    )
    from pipeline.report.plots import plot_characteristic, plot_forces, plot_photo, plot_residuals
    from pipeline.result import Answer, Result, read_result
    from pipeline.run import measure, write
    from pipeline.settings import Settings
    from pipeline.vision.single import trace_photo
    from rod import *  # noqa: F403  # all that it exports
    from rod.balance import balance
    from rod.inverse import estimate

__all__ = [
    "Answer",
    "InputError",
    "Plan",
    "Result",
    "Settings",
    "__version__",
    "balance",
    "causes_frame",
    "centerlines_frame",
    "characteristic_frame",
    "compare",
    "design",
    "estimate",
    "export",
    "forces_frame",
    "measure",
    "photos_frame",
    "plot_characteristic",
    "plot_forces",
    "plot_photo",
    "plot_residuals",
    "predict",
    "read_result",
    "rod",
    "simulation_frame",
    "trace_photo",
    "write",
]
__all__ += rod.__all__

ROOMS = {
    "pipeline.compare": ("compare",),
    "pipeline.diagnosis.plans.design": ("Plan", "design"),
    "pipeline.errors": ("InputError",),
    "pipeline.predict": ("predict",),
    "pipeline.report.exports": ("export",),
    "pipeline.report.frames": (
        *("causes_frame", "centerlines_frame", "characteristic_frame"),
        *("forces_frame", "photos_frame", "simulation_frame"),
    ),
    "pipeline.report.plots": ("plot_characteristic", "plot_forces", "plot_photo", "plot_residuals"),
    "pipeline.result": ("Answer", "Result", "read_result"),
    "pipeline.run": ("measure", "write"),
    "pipeline.settings": ("Settings",),
    "pipeline.vision.single": ("trace_photo",),
    "rod": tuple(rod.__all__),
    "rod.balance": ("balance",),
    "rod.inverse": ("estimate",),
}
"""Module -> public names that it holds."""


def __getattr__(name: str) -> Any:
    """A public name, loaded now."""
    for module, names in ROOMS.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Names to complete."""
    return sorted(__all__)

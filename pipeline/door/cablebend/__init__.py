"""Bending stiffness of cables from photos and forces: everything a notebook or a program of your own needs.

``measure(folder)`` gives a result, ``result.answer`` the curve that counts, with its band and K0; the functions below
predict, compare, export and draw. `estimate` and `balance` are the two ways on data of your own; ``rod`` and all that
it exports, `bend` above all, are the mechanics alone. A name is loaded when it is first used. SI units; the unit stands
in every name.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import rod as rod
from pipeline import __version__ as __version__

if TYPE_CHECKING:
    from pipeline.compare import compare as compare
    from pipeline.diagnosis.plans.design import Plan as Plan
    from pipeline.diagnosis.plans.design import design as design
    from pipeline.errors import InputError as InputError
    from pipeline.predict import predict as predict
    from pipeline.report.exports import export as export
    from pipeline.report.frames import causes_frame as causes_frame
    from pipeline.report.frames import centerlines_frame as centerlines_frame
    from pipeline.report.frames import characteristic_frame as characteristic_frame
    from pipeline.report.frames import forces_frame as forces_frame
    from pipeline.report.frames import photos_frame as photos_frame
    from pipeline.report.frames import simulation_frame as simulation_frame
    from pipeline.report.plots import plot_characteristic as plot_characteristic
    from pipeline.report.plots import plot_forces as plot_forces
    from pipeline.report.plots import plot_photo as plot_photo
    from pipeline.report.plots import plot_residuals as plot_residuals
    from pipeline.result import Answer as Answer
    from pipeline.result import Result as Result
    from pipeline.result import read_result as read_result
    from pipeline.run import measure as measure
    from pipeline.run import write as write
    from pipeline.settings import Settings as Settings
    from pipeline.vision.single import trace_photo as trace_photo
    from rod import *  # noqa: F403  # all that it exports
    from rod.balance import balance as balance
    from rod.inverse import estimate as estimate

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

__all__ = ["__version__", "rod", *(name for names in ROOMS.values() for name in names)]


def __getattr__(name: str) -> Any:
    """A public name, loaded now."""
    for module, names in ROOMS.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Names to complete."""
    return sorted(__all__)

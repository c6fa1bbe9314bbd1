"""The answer as input of simulation programs: Abaqus, CalculiX, MuJoCo, PyElastica, or a plain table.

A program that takes a moment-curvature curve gets the curve (`beam_table`); one that takes a single stiffness gets the
equivalent EI of a range of curvature, with its error and with what a constant hides. SI units throughout.

A bending test knows nothing of stretching, torsion and mass. Where a program demands them, the stiffnesses are those
of a solid round bar of the same EI and diameter, the density is that of water, and the file says so. So it does where
it bends the cable to the side on which no photo showed it.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from pipeline.messages import Message
from pipeline.report.curves import equivalent
from pipeline.report.page import TEMPLATES
from pipeline.result import Result, Visited
from pipeline.rounding import plain, rounded

DENSITY = 1000.0
"""Of water, kg/m^3: a number of the right size in a place that must not be empty."""

ELEMENTS = 30
"""Of a cable in a file that holds its nodes; a kink of a thirtieth of a bow is not seen."""

STRAIGHT = 2.0
"""Standard deviations of K0 within which a cable is straight at rest, and so bends alike to both sides."""


def beam_table(curve: Visited, *, both_sides: bool | None = None) -> pd.DataFrame:
    """The moment curve of a cable as a beam element wants it: moment over the bend away from rest, from zero on.

    Parameters
    ----------
    both_sides : bool, optional
        Whether to add the other side, taken to be alike; by default where the cable is straight at rest, because then
        nothing tells one side from the other.

    Returns
    -------
    pandas.DataFrame
        Columns bend_per_m (K - K0, increasing), moment_Nm, moment_std_Nm, and measured: 0 for the side to which the
        cable was not bent.
    """
    if both_sides is None:
        both_sides = abs(curve.pre_curvature) <= STRAIGHT * curve.pre_curvature_std
    bend = curve.kappa - curve.pre_curvature
    # a first point hardly away from rest would make a first segment of any slope
    kept = bend > 0.5 * float(np.min(np.diff(bend)))
    columns = (np.concatenate([[0.0], values[kept]]) for values in (bend, curve.moment, curve.moment_std))
    table = pd.DataFrame(dict(zip(BEAM, (*columns, 1), strict=True)))
    if not both_sides:
        return table
    other = table[:0:-1] * np.array([-1.0, -1.0, 1.0, 0.0])
    return pd.concat([other, table], ignore_index=True).astype({"measured": int})


BEAM = ("bend_per_m", "moment_Nm", "moment_std_Nm", "measured")


NOT_MEASURED = (
    "not measured, put in your own: stretching and torsion (those of a solid bar of this EI), density (water)"
)
OTHER_SIDE = "bent to the other side the cable is taken to be alike; no photo showed that"
FORMATS = ("table", "abaqus", "calculix", "mujoco", "pyelastica")
"""Each is a template ``export.NAME``."""


def export(result: Result, form: str, *, bounds: tuple[float, float] | None = None) -> str:
    """Text of a file for a simulation program.

    Parameters
    ----------
    form : str
        One of `FORMATS`.
    bounds : (low, high) in 1/m, optional
        Curvatures over which a constant EI is to stand for the characteristic; all that were visited by default.

    Raises
    ------
    ValueError
        For an unknown format, a result without a usable answer or without length and diameter, or a range that was
        not visited.
    """
    if form not in FORMATS:
        raise ValueError(Message("misuse.no-format", name=repr(form), known=FORMATS))
    answer, name = result.answer, result.specimen.id
    length, diameter = result.specimen.length_m, result.specimen.diameter_m
    if answer.curve is None or not answer.usable:
        raise ValueError(Message("comparison.unusable", name=name, reason=answer.said))
    if length is None or diameter is None:
        raise ValueError(Message("misuse.no-sizes", name=name))
    curve, constant = answer.curve, equivalent(answer.curve, bounds)
    if constant is None:
        raise ValueError(Message("misuse.not-visited", name=name, low=curve.kappa[0], high=curve.kappa[-1]))
    head = (
        f"cable {name}, measured by cablebend ({answer.method}: {answer.reason}); SI units",
        f"EI = {rounded(constant.stiffness, constant.std)} N m^2 for curvatures of {plain(constant.low)} to "
        f"{plain(constant.high)} 1/m; the measured tangent departs from that by up to "
        f"{plain(100.0 * constant.departure, 2)} %",
        f"K0 = {rounded(curve.pre_curvature, curve.pre_curvature_std)} 1/m, the curvature at rest",
    )
    table, inertia = beam_table(curve, both_sides=True), np.pi * diameter**4 / 64.0
    template = _engine().get_template(f"export.{form}")
    return template.render(
        head=[_one_line(line) for line in head],
        not_measured=NOT_MEASURED,
        other_side=OTHER_SIDE,
        curve=list(zip(table.bend_per_m, table.moment_Nm, strict=True)),
        nodes=_arc(length, curve.pre_curvature),
        elements=ELEMENTS,
        length=length,
        radius=diameter / 2.0,
        area=np.pi * diameter**2 / 4.0,
        inertia=inertia,
        stiffness=constant.stiffness,
        modulus=constant.stiffness / inertia,
        density=DENSITY,
        K0=curve.pre_curvature,
    )


def _one_line(text: str) -> str:
    """Text that ends no comment: a name may hold anything."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).replace("--", "- -").split())


def _arc(length: float, K0: float) -> list[tuple[float, float]]:
    """Nodes (x, z) of the cable at rest, m."""
    s = np.linspace(0.0, length, ELEMENTS + 1)
    # sin(K0 s) / K0 and (1 - cos(K0 s)) / K0, right for a straight cable too
    x, z = s * np.sinc(K0 * s / np.pi), 0.5 * K0 * (s * np.sinc(0.5 * K0 * s / np.pi)) ** 2
    return list(zip(x.tolist(), z.tolist(), strict=True))


@cache
def _engine() -> Environment:
    """Template engine of files for programs: every float as `_number` writes it, everything else as it is."""
    return Environment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        finalize=lambda value: _number(value) if isinstance(value, float) else value,
    )


def _number(value: float) -> str:
    """A number for a program: nine digits, always with a decimal point or a power."""
    text = f"{value:.9g}"
    return text if any(sign in text for sign in ".en") else f"{text}.0"

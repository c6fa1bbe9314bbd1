"""The answer as input of simulation programs: Abaqus, CalculiX, MuJoCo, PyElastica, or a plain table.

A program that takes a moment-curvature curve gets the curve (`beam_table`); one that takes a single stiffness gets the
equivalent EI of a range of curvature, with its error and with what a constant hides. SI units throughout.

A bending test knows nothing of stretching, torsion and mass. Where a program demands them, the stiffnesses are those
of a solid round bar of the same EI and diameter, the density is that of water, and the file says so. So it does where
it bends the cable to the side on which no photo showed it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.messages import Message
from pipeline.records import Array
from pipeline.report.curves import Equivalent, equivalent
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
    curve : Visited
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


@dataclass(frozen=True, eq=False)
class Cable:
    """What the writers need of a result; SI units."""

    curve: Visited
    constant: Equivalent
    length: float
    diameter: float
    head: tuple[str, ...]

    @property
    def area(self) -> float:
        """Area of the round section, m^2."""
        return float(np.pi * self.diameter**2 / 4.0)

    @property
    def inertia(self) -> float:
        """Second moment of area of the round section."""
        return float(np.pi * self.diameter**4 / 64.0)

    @property
    def modulus(self) -> float:
        """Young's modulus of a solid round bar of the equivalent EI."""
        return self.constant.stiffness / self.inertia


NOT_MEASURED = (
    "not measured, put in your own: stretching and torsion (those of a solid bar of this EI), density (water)"
)
OTHER_SIDE = "bent to the other side the cable is taken to be alike; no photo showed that"


def export(result: Result, form: str, *, bounds: tuple[float, float] | None = None) -> str:
    """Text of a file for a simulation program.

    Parameters
    ----------
    result : Result
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
    return FORMATS[form](_cable(result, bounds))


def _cable(result: Result, bounds: tuple[float, float] | None) -> Cable:
    """Everything a writer needs; `ValueError` says what is missing."""
    answer, name = result.answer, result.specimen.id
    length, diameter = result.specimen.length_m, result.specimen.diameter_m
    if answer.curve is None or not answer.usable:
        raise ValueError(Message("comparison.unusable", name=name, reason=answer.said))
    if length is None or diameter is None:
        raise ValueError(Message("misuse.no-sizes", name=name))
    curve, constant = answer.curve, equivalent(answer.curve, bounds)
    if constant is None:
        raise ValueError(Message("misuse.not-visited", name=name, low=curve.kappa[0], high=curve.kappa[-1]))
    between = f"{plain(constant.low)} to {plain(constant.high)} 1/m"
    head = (
        f"cable {name}, measured by cablebend ({answer.method}: {answer.reason}); SI units",
        f"EI = {rounded(constant.stiffness, constant.std)} N m^2 for curvatures of {between}; the measured tangent "
        f"departs from that by up to {plain(100.0 * constant.departure, 2)} %",
        f"K0 = {rounded(curve.pre_curvature, curve.pre_curvature_std)} 1/m, the curvature at rest",
    )
    return Cable(curve, constant, length, diameter, tuple(_one_line(line) for line in head))


def _one_line(text: str) -> str:
    """Text that ends no comment: a name may hold anything."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).replace("--", "- -").split())


def _table(cable: Cable) -> str:
    """Bend from rest and moment, both sides, in two columns."""
    table = beam_table(cable.curve, both_sides=True)
    rows = (f"{_n(k)}\t{_n(m)}" for k, m in zip(table.bend_per_m, table.moment_Nm, strict=True))
    return _lines("# ", (*cable.head, OTHER_SIDE), "bend_per_m\tmoment_Nm", *rows)


def _abaqus(cable: Cable) -> str:
    """A general beam section with a nonlinear, elastic moment-curvature curve, for a beam drawn in its rest shape."""
    table = beam_table(cable.curve, both_sides=True)
    rows = [f"{_n(m)}, {_n(k)}" for k, m in zip(table.bend_per_m, table.moment_Nm, strict=True)]
    bar, inertia = cable.modulus * cable.area, _n(cable.inertia)
    return _lines(
        "** ",
        (*cable.head, NOT_MEASURED, OTHER_SIDE, "put the nodes on an arc of curvature K0: the moment there is zero"),
        f"*BEAM GENERAL SECTION, SECTION=NONLINEAR GENERAL, ELSET=CABLE, DENSITY={_n(DENSITY)}",
        f"{_n(cable.area)}, {inertia}, 0.0, {inertia}, {_n(2.0 * cable.inertia)}",
        "",
        *("*AXIAL, LINEAR", _n(bar)),
        *("*M1, ELASTIC", *rows),
        *("*M2, ELASTIC", *rows),
        *("*TORQUE, LINEAR", _n(cable.constant.stiffness)),
    )


def _calculix(cable: Cable) -> str:
    """A general section of the beam element U1, which is linear."""
    inertia = _n(cable.inertia)
    return _lines(
        "** ",
        (*cable.head, NOT_MEASURED, "U1 is a linear beam for small rotations; put the nodes on an arc of curvature K0"),
        *("*MATERIAL, NAME=CABLE", "*ELASTIC", f"{_n(cable.modulus)}, 0.0", "*DENSITY", _n(DENSITY)),
        "*BEAM SECTION, ELSET=CABLE, MATERIAL=CABLE, SECTION=GENERAL",
        f"{_n(cable.area)}, {inertia}, 0.0, {inertia}, 0.9",  # 0.9: shear coefficient of a circle, hardly matters
        "0.0, 0.0, 1.0",
    )


def _mujoco(cable: Cable) -> str:
    """A one-dimensional flex of MuJoCo 4, pinned at its first edge, at rest on an arc of curvature K0."""
    x, z = _arc(cable)
    points = " ".join(f"{_n(a)} 0 {_n(b)}" for a, b in zip(x, z, strict=True))
    edges = " ".join(f"{i} {i + 1}" for i in range(ELEMENTS))
    mass = DENSITY * cable.area * cable.length
    return _lines(
        "",
        ("<!--", *cable.head, NOT_MEASURED, "-->"),
        '<mujoco model="cable">',
        # edges are held by a soft constraint: as soft as MuJoCo has it by default the arc opens three times too far
        '  <option integrator="discrete" timestep="0.0005"/>',
        "  <worldbody>",
        f'    <flexcomp name="cable" dim="1" type="direct" radius="{_n(cable.diameter / 2.0)}" mass="{_n(mass)}"',
        f'        point="{points}"',
        f'        element="{edges}">',
        '      <pin id="0 1"/>',
        '      <edge equality="true" solref="0.001 1" solimp="0.9999 0.9999 0.001"/>',
        f'      <elasticity young="{_n(cable.modulus)}" poisson="0" damping="0.05"/>',
        '      <contact selfcollide="none"/>',
        "    </flexcomp>",
        "  </worldbody>",
        "</mujoco>",
    )


def _arc(cable: Cable) -> tuple[Array, Array]:
    """Nodes of the cable at rest, m."""
    s, K0 = np.linspace(0.0, cable.length, ELEMENTS + 1), cable.curve.pre_curvature
    # sin(K0 s) / K0 and (1 - cos(K0 s)) / K0, right for a straight cable too
    return s * np.sinc(K0 * s / np.pi), 0.5 * K0 * (s * np.sinc(0.5 * K0 * s / np.pi)) ** 2


def _pyelastica(cable: Cable) -> str:
    """A Python module with the rod; it stands straight and wants to bend to K0."""
    return _lines(
        "# ",
        (*cable.head, NOT_MEASURED),
        "import numpy as np",
        "from elastica import CosseratRod",
        "",
        f"LENGTH_M = {_n(cable.length)}",
        f"RADIUS_M = {_n(cable.diameter / 2.0)}",
        f"EI_NM2 = {_n(cable.constant.stiffness)}",
        f"K0_PER_M = {_n(cable.curve.pre_curvature)}",
        f"DENSITY_KG_PER_M3 = {_n(DENSITY)}",
        "",
        "",
        f"def cable(elements={ELEMENTS}):",
        '    """The cable along x, straight but at rest when bent to K0 about its first director."""',
        "    young = EI_NM2 / (np.pi * RADIUS_M**4 / 4.0)",
        "    rod = CosseratRod.straight_rod(",
        "        elements, np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]),",
        "        LENGTH_M, RADIUS_M, DENSITY_KG_PER_M3, youngs_modulus=young, shear_modulus=young / 2.0,",
        "    )",
        "    rod.rest_kappa[0, :] = K0_PER_M",
        "    return rod",
    )


def _lines(comment: str, head: tuple[str, ...], *body: str) -> str:
    return "\n".join((*(f"{comment}{line}" for line in head), *body, ""))


def _n(value: float) -> str:
    """A number for a program: nine digits, always with a decimal point or a power."""
    text = f"{value:.9g}"
    return text if any(sign in text for sign in ".en") else f"{text}.0"


FORMATS: dict[str, Callable[[Cable], str]] = {
    "table": _table,
    "abaqus": _abaqus,
    "calculix": _calculix,
    "mujoco": _mujoco,
    "pyelastica": _pyelastica,
}
"""Writers by the name of their format."""

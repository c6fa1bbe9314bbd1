"""Mechanics of a planar Cosserat rod in a bending test: numpy and scipy only, no files, photos, plots or clocks.

Symbols, the same in every module, SI units throughout:

    x, y       m       chord frame: origin at the left bearing axis, x to the right one, y toward the bow
    s, L       m       arc length from the left axis; length of the cable from axis to axis
    theta      rad     tangent angle from x toward y; alpha where it belongs to an edge of the discrete rod
    K (kappa)  1/m     curvature, K = -dtheta/ds, positive in the direction of the bow
    K0         1/m     pre-curvature: K of the cable at rest
    P          N       force along the chord, positive in compression
    m          N m     bending moment; between moment-free bearings m = P y (Eq. (13))
    f_EI       N m^2   bending stiffness characteristic, read as tangent dm/dK unless a name says secant
    d          m       displacement of the pushed bearing, positive where the bearings approach

Three examples. A column under its own weight, in units of EI/L^3: Greenhill (1881) says that it buckles at 7.837.

>>> from rod import CLAMP, FREE, bend
>>> column = {"left": CLAMP, "right": FREE, "tip": (0.0, 0.0)}
>>> [bool(bend(1.0, 1.0, load=(-q, 0.0), **column).y[-1] > 1e-3) for q in (7.82, 7.85)]
[False, True]

A pinned cable of 200 mm whose moment is an own function of the bend, or a table of it, pushed together by 5 mm:

>>> import numpy as np
>>> def moment(bend_per_m):
...     return 2e-3 * bend_per_m + 0.012 * np.tanh(bend_per_m / 4.0)
>>> own = bend(0.2, moment, displacement=5e-3, pre_curvature=2.0)
>>> rows = [(D, moment(D)) for D in np.linspace(0.0, 20.0, 81)]
>>> table = bend(0.2, rows, displacement=5e-3, pre_curvature=2.0)
>>> print(own.outcome.name, f"{own.force:.3f} N, {table.force:.3f} N")
CONVERGED 0.634 N, 0.634 N

The inverse problem on own arrays (displacements, forces, curvatures at the joints), as the paper states it:

>>> from rod import BendingTest, Characteristic, Virtual, fit_characteristic, simulate
>>> knots, steps = [0.0, 5.0, 10.0], np.array([5e-3, 10e-3, 15e-3])
>>> cable = BendingTest(0.2, Characteristic.from_ordinates(knots, [5e-3, 3e-3, 2e-3]), 2.0)
>>> bent = simulate(cable, steps)
>>> data = Virtual(0.2, steps, np.array([b.force for b in bent]), np.array([b.kappa for b in bent]))
>>> fit = fit_characteristic(data, knots, reading="tangent")
>>> print(fit.converged, np.round(1e3 * fit.characteristic.ordinates, 3), round(fit.pre_curvature, 3))
True [5. 3. 2.] 2.0

An equilibrium says in ``outcome`` how far to trust it, and ``outcome.advice`` what to do. Exported here: what these
examples use, laws (`StickSlip`, `as_law`, with wires that rub `InternalFriction`), supports (`Support`, `BEARING`),
`solve` with `Hold` for single rods.

Where to read on: `characteristic` (what f_EI is), `bending_test` (the experiment simulated), `inverse` and `balance`
(the two ways from a measured test to f_EI), `path` (stability, jumps), `paper` (the source paper's own numbers).

Source: *Identification of Nonlinear Elastic Bending Behavior for Cable Simulation*; modules cite its equations as
"Eq. (n) of the paper" and say where they depart from it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rod.bending_test import BendingTest, bend, simulate
    from rod.characteristic import Characteristic
    from rod.equilibrium import Equilibrium, Outcome, solve
    from rod.laws import StickSlip, as_law
    from rod.paper_fit import Virtual
    from rod.paper_fit import paper_fit as fit_characteristic
    from rod.reduction import Hold
    from rod.section import InternalFriction
    from rod.support import BEARING, CLAMP, FREE, Support

__all__ = ["BEARING", "CLAMP", "FREE", "BendingTest", "Characteristic", "Equilibrium", "Hold", "InternalFriction"]
__all__ += ["Outcome", "StickSlip", "Support", "Virtual", "as_law", "bend", "fit_characteristic", "simulate", "solve"]

_MODULES = {
    "rod.bending_test": ("BendingTest", "bend", "simulate"),
    "rod.characteristic": ("Characteristic",),
    "rod.equilibrium": ("Equilibrium", "Outcome", "solve"),
    "rod.laws": ("StickSlip", "as_law"),
    "rod.paper_fit": ("Virtual", "paper_fit"),
    "rod.reduction": ("Hold",),
    "rod.section": ("InternalFriction",),
    "rod.support": ("BEARING", "CLAMP", "FREE", "Support"),
}


def __getattr__(name: str) -> Any:
    """Load a name when it is first used: scipy takes half a second that one who needs a record alone can spare."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    at_home = {"fit_characteristic": "paper_fit"}.get(name, name)
    module = next(module for module, names in _MODULES.items() if at_home in names)
    globals()[name] = value = getattr(import_module(module), at_home)
    return value


def __dir__() -> list[str]:
    """Names to complete."""
    return __all__

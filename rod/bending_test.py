"""The experiment: from a cable, its supports and a list of displacement steps to the equilibria of all steps.

A cable lies between two bearings; one is pushed toward the other in steps, forth and perhaps back, and at each step the
force at the right bearing is read. `BendingTest` says once what the cable and the rig are, `simulate` runs the steps in
order and carries the memory of friction and set from one to the next.

What is imposed at a step, one of three:

* ``displacements`` d (m): the axes are commanded to the distance zero - (d + displacement_offset); the rig yields, so
  the chord reaching the cable is longer by what the rig yields under P;
* ``chords`` (m): the distance of the axes as measured, e.g. on the photo; offset and compliance do not enter;
* ``forces`` P (N): the bearing is loaded, not moved.

The zero of displacement is the chord of the mounted, force-free cable without load (``natural``) or under its load
(``loaded``), or the cable's length, or given.

Signs and units: chord frame, SI; P positive in compression; d positive where the bearings approach.

Source: Secs. 3.1 and 3.2 of the paper; `table_1` is its virtual experiment.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rod.array import Array
from rod.characteristic import Characteristic, MomentCurve, Reading
from rod.discretisation import Along, Rod, joint_values
from rod.equilibrium import Branch, Equilibrium, solve
from rod.laws import Function, as_law
from rod.reduction import Hold
from rod.section import InternalFriction, Section
from rod.support import BEARING, Support

Control = Literal["displacements", "chords", "forces"]
Zero = Literal["natural", "loaded", "length"]

#: Table 1 of the paper: length (m), pre-curvature (1/m), step (m), knots (1/m) and ordinates (N m^2).
TABLE_1 = {"length": 0.2, "pre_curvature": 2.0, "step": 5e-3}
TABLE_1_KNOTS, TABLE_1_ORDINATES = (0.0, 5.0, 10.0), (5e-3, 3e-3, 2e-3)


@dataclass(frozen=True, eq=False)
class BendingTest:
    """A cable on a rig. Everything but length and characteristic has the value of the ideal test by default.

    Attributes
    ----------
    length : m
        Between the bearing axes, rigid pieces included.
    characteristic : MomentCurve
        `Characteristic`, a law in closed form, or a number, function or table as of `rod.laws.as_law`.
    pre_curvature : 1/m
        K0: a number, (elements + 1,) values at the joints, or a function of the relative position 0..1 along the free
        cable.
    stiffness_profile : same kinds, or None
        EI(s) relative: a factor on the moment of the characteristic.
    left, right : Support
        Springs, Coulomb moments, rigid pieces, clamps; see `rod.support`.
    load : (2,) N/m
        Distributed dead load along x and y of the chord frame.
    friction_by_step : (steps, 2) N m or None
        Added to the Coulomb moments of the left and the right bearing step by step; the last ones stay.
    moments_by_step : (steps, 2) N m or None
        Added to the moments applied to the left and the right end step by step; the last ones stay.
    forces_by_step : (steps, elements + 1, 2) N or None
        Dead forces along x and y on the joints step by step; the last ones stay.
    compliance, stiffening : m/N, 1/N
        Of the rig, see `rod.reduction.Hold`.
    friction : InternalFriction or None
    plastic_rate : 1/m per 1/m
        Growth of K0 with the largest curvature reached.
    law_stays : bool
        Whether the law stays at its curvature while K0 grows; else it moves along (see `rod.section`).
    set_threshold : 1/m
        Bend from rest beyond which K0 grows.
    set_saturation : m
        How fast that growth falls with the bend (see `rod.section`).
    grown : (steps, elements + 1) 1/m or None
        Growth of K0 at the joints that is given step by step; the last one stays.
    slid : tuple of m
        Cable that has slid out from between the axes at each step; as much as at the last one from then on.
    zero : "natural", "loaded", "length" or m
        Distance of the axes at displacement zero.
    displacement_offset : m
        Error of the zero: added to every displacement.
    elements : int or (n,)
        Number of equal elements, or relative element lengths.
    axial_stiffness, shear_stiffness : N or None
        EA and GA; None for stiff without influence (`rod.discretisation.RIGIDITY`).
    """

    length: float
    characteristic: MomentCurve
    pre_curvature: Along = 0.0
    stiffness_profile: Along | None = None
    left: Support = BEARING
    right: Support = BEARING
    load: tuple[float, float] = (0.0, 0.0)
    friction_by_step: Array | None = None
    moments_by_step: Array | None = None
    forces_by_step: Array | None = None
    compliance: float = 0.0
    stiffening: float = 0.0
    friction: InternalFriction | None = None
    plastic_rate: float = 0.0
    law_stays: bool = False
    set_threshold: float = 0.0
    set_saturation: float = 0.0
    grown: Array | None = None
    slid: tuple[float, ...] = ()
    zero: Zero | float = "natural"
    displacement_offset: float = 0.0
    elements: int | Array = 100
    axial_stiffness: float | None = None
    shear_stiffness: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "characteristic", as_law(self.characteristic, length=self.length))
        for side, end in (("left", self.left), ("right", self.right)):
            if not isinstance(end, Support):
                raise ValueError(f"{side}={end!r} is no support: give BEARING, CLAMP, FREE (right end) or Support()")
        if not isinstance(self.friction, InternalFriction | None):
            raise ValueError(f"friction={self.friction!r}: give InternalFriction(half_width, stick_curvature)")
        if isinstance(self.zero, str) and self.zero not in get_args(Zero):
            raise ValueError(f"zero={self.zero!r}: one of {', '.join(get_args(Zero))}, or a distance in m")

    @cached_property
    def rod(self) -> Rod:
        """The discrete rod of this test."""
        n = self.elements
        relative = np.ones(max(n, 0)) if isinstance(n, int | np.integer) else np.asarray(n, float)
        elements = relative / relative.sum()
        K0 = joint_values(self.pre_curvature, elements, name="pre_curvature")
        given = self.stiffness_profile
        profile = None if given is None else joint_values(given, elements, name="stiffness_profile")
        grows = self.plastic_rate, self.law_stays, self.set_threshold, self.set_saturation, self.grown
        section = Section(self.characteristic, K0, profile, self.friction, *grows)
        return Rod(
            self.length, elements, section, self.left, self.right, self.load, self.axial_stiffness, self.shear_stiffness
        )

    def rod_at(self, step: int) -> Rod:
        """The rod of a step, where bearings, forces or length differ from step to step."""
        ends: tuple[Support, ...] = (self.left, self.right)
        changes: dict[str, Any] = {}
        if self.slid:
            changes["length"] = self.length - self.slid[min(step, len(self.slid) - 1)]
        if (forces := at_step(self.forces_by_step, step)) is not None:
            changes["forces"] = forces
        if (more := at_step(self.friction_by_step, step)) is not None:
            rubbing = (max(end.friction_moment + by, 0.0) for end, by in zip(ends, more.tolist(), strict=True))
            ends = tuple(replace(end, friction_moment=by) for end, by in zip(ends, rubbing, strict=True))
        if (more := at_step(self.moments_by_step, step)) is not None:
            ends = tuple(replace(end, moment=end.moment + by) for end, by in zip(ends, more.tolist(), strict=True))
        if ends != (self.left, self.right):
            changes |= dict(zip(("left", "right"), ends, strict=True))
        return replace(self.rod, **changes) if changes else self.rod

    @cached_property
    def free(self) -> Equilibrium:
        """The mounted cable under its load and the first of given forces, free to slide: none at the right bearing."""
        return solve(self.rod_at(0), self.hold("forces", 0.0))

    @property
    def zero_chord(self) -> float:
        """Distance of the axes at displacement zero, m."""
        if self.zero == "natural":
            return self.rod.mounted.chord
        if self.zero == "loaded":
            return self.free.chord
        return self.length if self.zero == "length" else float(self.zero)

    @cached_property
    def kind(self) -> tuple[object, ...]:
        """What two tests have in common of which one can become the other little by little."""
        left, right, friction = self.left, self.right, self.friction
        ends = left.kind, right.kind, left.angle is None, right.angle is None
        rubbing = () if friction is None else (friction.stick.size, *friction.smooth)
        by_step = self.grown, self.friction_by_step, self.moments_by_step, self.forces_by_step
        given = *(values is None for values in by_step), self.slid, rubbing
        elements = tuple(np.atleast_1d(self.elements).tolist())
        return *ends, *given, elements, self.law_stays, self.axial_stiffness, self.shear_stiffness, self.zero

    @cached_property
    def numbers(self) -> dict[str, float]:
        """Everything that is one number of the test and not in its rod's geometry, by the name of its cause."""
        found = {"displacement_offset": self.displacement_offset, "rig_compliance": self.compliance}
        found["rig_stiffening"] = self.stiffening
        found |= {"load_x": self.load[0], "load_y": self.load[1], "length": self.length}
        found |= {"plastic_set": self.plastic_rate, "set_threshold": self.set_threshold}
        found["set_saturation"] = self.set_saturation
        for side, end in (("left", self.left), ("right", self.right)):
            found |= {f"end_moment_{side}": end.moment, f"clamp_angle_{side}": end.angle or 0.0}
            found |= {f"bearing_stiffness_{side}": end.stiffness, f"bearing_friction_{side}": end.friction_moment}
            found |= {f"bearing_hardening_{side}": end.hardening, f"stick_angle_{side}": end.stick_angle}
        return found

    def hold(self, control: Control, value: float) -> Hold:
        """What is imposed at a step."""
        if control == "displacements":
            chord = self.zero_chord - (value + self.displacement_offset)
            return Hold(chord=chord, compliance=self.compliance, stiffening=self.stiffening, from_zero=True)
        return Hold(chord=value) if control == "chords" else Hold(force=value)


def at_step(given: Array | None, step: int) -> Array | None:
    """What is given step by step (steps, ...), at a step; the last one stays. None where nothing is given."""
    return None if given is None else np.asarray(given[min(step, len(given) - 1)])


def bend(
    length: float,
    law: MomentCurve | float | Function | ArrayLike,
    *,
    displacement: float | None = None,
    chord: float | None = None,
    force: float | None = None,
    tip: tuple[float, float] | None = None,
    branch: Branch = "natural",
    start: Equilibrium | None = None,
    **cable: Any,
) -> Equilibrium:
    """Equilibrium of one cable under one load, in one call.

    Parameters
    ----------
    length : m
    law : as of `rod.laws.as_law`
        EI as a number, moment as a function of the bend, a table of both, or a moment curve.
    displacement, chord, force, tip : m, m, N, (2,) N
        Exactly one: by how much the bearings approach, their distance, P between them, or the force on a free end.
    branch : {"natural", "opposite", "up", "down", "jump"}
    start : Equilibrium or None
    **cable
        Everything else of `BendingTest`: ``pre_curvature``, ``left``, ``right``, ``load``, ``elements`` ...

    Raises
    ------
    ValueError
        If not exactly one of displacement, chord, force and tip is given, or a tip force without a free end.
    """
    given = {"displacements": displacement, "chords": chord, "forces": force}
    controls = [(name, value) for name, value in given.items() if value is not None]
    if len(controls) + (tip is not None) != 1:
        raise ValueError("give exactly one of displacement, chord, force and tip")
    test = BendingTest(length, as_law(law, length=length), **cable)
    if (tip is not None) != (test.right.kind == "free"):
        raise ValueError("tip is the force on a free end: give it with right=FREE, and only there")
    if tip is not None:
        return solve(test.rod, Hold(tip=tip), start=start, branch=branch)
    control: dict[str, Any] = {name: [value] for name, value in controls}
    return simulate(test, **control, branch=branch, starts=None if start is None else [start])[0]


def simulate(
    test: BendingTest,
    displacements: ArrayLike | None = None,
    *,
    chords: ArrayLike | None = None,
    forces: ArrayLike | None = None,
    branch: Branch = "natural",
    starts: Sequence[Equilibrium | None] | None = None,
    patient: bool = True,
) -> tuple[Equilibrium, ...]:
    """Equilibria of all steps, in order; friction and set remember the steps before.

    Parameters
    ----------
    test : BendingTest
    displacements, chords : (steps,) m, forces : (steps,) N
        Exactly one of them; see the module.
    branch : {"natural", "opposite", "up", "down"}
        Side of the bow, see `rod.equilibrium`.
    starts : (steps,) of Equilibrium or None
        Warm starts, for example the equilibria of a nearby test. By default each step starts from the one before.
    patient : bool
        See `rod.equilibrium.solve`.

    Returns
    -------
    tuple of Equilibrium
        One per step; look at ``outcome``.

    Raises
    ------
    ValueError
        If not exactly one of the controls is given, or ``starts`` has another length.
    """
    given: dict[Control, ArrayLike | None] = {"displacements": displacements, "chords": chords, "forces": forces}
    controls = [control for control, values in given.items() if values is not None]
    if len(controls) != 1:
        raise ValueError("give exactly one of displacements, chords and forces")
    control = controls[0]
    values = np.atleast_1d(np.asarray(given[control], float))
    if values.ndim != 1:
        raise ValueError(f"{control} are one number a step; `bend` takes one, `simulate` those of all steps")
    if starts is not None and len(starts) != values.size:
        raise ValueError(f"{len(starts)} starts for {values.size} steps")
    memory, last, steps = test.rod.virgin, None, []
    for index, value in enumerate(values):
        start = last if starts is None else starts[index]
        rod, hold = test.rod_at(memory.step), test.hold(control, float(value))
        here = solve(rod, hold, memory=memory, start=start, branch=branch, patient=patient)
        memory, last = here.after, here if here.good else None
        steps.append(here)
    return tuple(steps)


def table_1(reading: Reading, *, elements: int = 100) -> BendingTest:
    """The virtual experiment of Sec. 3.2, with f_EI of Table 1 in the given reading; steps of ``TABLE_1["step"]``."""
    law = Characteristic.from_ordinates(TABLE_1_KNOTS, TABLE_1_ORDINATES, reading=reading)
    return BendingTest(TABLE_1["length"], law, TABLE_1["pre_curvature"], elements=elements)

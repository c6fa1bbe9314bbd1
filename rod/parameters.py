"""Parameters of a bending test by name, as directions in which rod and rig change.

From a list of parameters to `Directions`: how much every ingredient of the discrete rod (pre-curvature at the joints,
edge lengths, ordinates, ...) changes per unit of each parameter. `rod.sensitivity` turns directions into derivatives.

A parameter is a name, or a pair of a name and a basis along the cable:

=======================  ======================================================================  =============
name                     what changes                                                            unit
=======================  ======================================================================  =============
``ordinates``            every control point or coefficient of the law, one column each            N m^2, -
``pre_curvature``        K0, uniformly; or a basis of K0(s)                                      1/m
``stiffness_profile``    EI(s) relative, uniformly; or a basis                                   -
``chord``                imposed distance of the axes, of each step                              m
``force``                imposed force, of each step under force control                         N
``displacement_offset``  zero of the displacement                                                m
``rig_compliance``       yielding of the frame                                                   m/N
``length``               cable length                                                            m
``rigid_ends``           stiff piece at both ends; ``rigid_left``, ``rigid_right`` one each      m
``bearing_stiffness``    rotational spring in both bearings; ``.._left``, ``.._right`` one each  N m/rad
``bearing_friction``     Coulomb moment in both bearings; ``.._left``, ``.._right`` one each     N m
``end_moment_left``      applied end moments; ``end_moment_right``                               N m
``clamp_angle_left``     angle of a clamp or spring given by value; ``clamp_angle_right``        rad
``load_x``, ``load_y``   distributed dead load                                                   N/m
``hysteresis``           half width of the internal friction                                     N m
``stick_curvature``      its curvature change to slip                                            1/m
``plastic_set``          growth of K0 with the largest curvature                                 1/m per 1/m
``set_threshold``        bend from rest beyond which K0 grows                                    1/m
=======================  ======================================================================  =============

A basis is (elements + 1,) or (elements + 1, q) values at the joints, a function of the relative position 0..1, or a
sequence of functions; it gives q columns. Derivatives at the value zero of a cause are meaningful: friction needs a
test with ``InternalFriction(0.0, stick_curvature)``, everything else is there by default.

What is none of these is told by example: `Toward` takes a test to another that differs a little, in as many of these
ways at once as it likes, in single elements of the friction, the angle over which a bearing sticks, or the form of the
law.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from rod.bending_test import BendingTest
from rod.characteristic import Array, MomentCurve, parametric

Basis = ArrayLike | Callable[[Array], ArrayLike] | Sequence[Callable[[Array], ArrayLike]]


@dataclass(frozen=True, eq=False)
class Toward:
    """The parameter that changes whatever differs between two tests, when it grows by ``step``, which is short.

    The first is the test that is moved, or one like it in all that differs.
    """

    test: BendingTest
    other: BendingTest
    step: float


Parameter = str | tuple[str, Basis] | Toward


@dataclass(frozen=True, eq=False)
class Directions:
    """Change of the ingredients per unit of each of q parameters; n joints, n + 1 edges, p control points, e elements.

    Attributes
    ----------
    names : (q,)
    pre_curvature, profile : (q, n)
    ordinates : (q, p)
    edges : (q, n + 1)
        Edge lengths, rigid pieces first and last.
    slip, stick : (q, e)
        Moments of the friction elements, N m, and their curvature changes to slip, 1/m.
    scalars : dict of (q,)
        Everything that is one number, under the names of the table; ``stick_angle_left`` and ``.._right`` beside.
    laws : list of (column, MomentCurve, MomentCurve, step)
        From which law to which the characteristic goes when that parameter grows by the step.
    grown, friction_by_step : dict of column -> (steps, n), (steps,)
        Of the set, and of the friction of both bearings, that are given step by step.
    """

    names: tuple[str, ...]
    pre_curvature: Array
    profile: Array
    ordinates: Array
    edges: Array
    slip: Array
    stick: Array
    scalars: dict[str, Array] = field(default_factory=dict)
    laws: list[tuple[int, MomentCurve, MomentCurve, float]] = field(default_factory=list)
    grown: dict[int, Array] = field(default_factory=dict)
    friction_by_step: dict[int, Array] = field(default_factory=dict)

    def scalar(self, name: str) -> Array:
        """Change of one number per parameter, (q,); zeros if it is none of them."""
        return self.scalars.get(name, self.none)

    def given(self, changes: dict[int, Array], step: int) -> Array:
        """Change at a step (q, ...) of what is given step by step; (q,) zeros if nothing is."""
        if not changes:
            return self.none
        every = np.zeros((len(self.names), *next(iter(changes.values())).shape[1:]))
        for column, by_step in changes.items():
            every[column] = by_step[min(step, len(by_step) - 1)]
        return every

    @cached_property
    def none(self) -> Array:
        """Zeros, (q,)."""
        return np.zeros(len(self.names))

    @cached_property
    def geometric(self) -> bool:
        """Whether any edge changes its length."""
        return bool(self.edges.any())

    @cached_property
    def weights(self) -> Array:
        """Change of the joint weights with the edges, (q, n)."""
        inner = 0.5 * self.edges
        inner[:, [0, -1]] = 0.0
        return np.asarray(inner[:, 1:] + inner[:, :-1])

    @cached_property
    def vertices(self) -> Array:
        """Change of the arc lengths of all vertices with the edges, (q, n + 2)."""
        vertices = np.zeros((len(self.names), self.edges.shape[1] + 1))
        np.add.accumulate(self.edges, axis=1, out=vertices[:, 1:])
        return vertices

    @cached_property
    def lawful(self) -> bool:
        """Whether any control point changes."""
        return bool(self.ordinates.any())

    @cached_property
    def profiled(self) -> bool:
        """Whether the stiffness profile changes."""
        return bool(self.profile.any())

    def has(self, *names: str) -> bool:
        """Whether one of these numbers is a parameter."""
        return any(name in self.scalars for name in names)

    def moved(self, name: str, columns: slice | int, by: float) -> None:
        """Put the change of one number into columns."""
        self.scalars.setdefault(name, np.zeros(len(self.names)))[columns] = by


#: Names that stand for the same change at both ends, and names of one number.
_BOTH_ENDS = ("bearing_stiffness", "bearing_friction")
_SCALARS = (
    "chord",
    "force",
    "displacement_offset",
    "rig_compliance",
    "length",
    "end_moment_left",
    "end_moment_right",
    "clamp_angle_left",
    "clamp_angle_right",
    "load_x",
    "load_y",
    "hysteresis",
    "stick_curvature",
    "plastic_set",
    "set_threshold",
    *(f"{name}_{side}" for name in _BOTH_ENDS for side in ("left", "right")),
)
_GEOMETRY = {"length": (0.0, 0.0, 1.0), "rigid_ends": (1.0, 1.0, 0.0), "rigid_left": (1.0, 0.0, 0.0)}
_GEOMETRY["rigid_right"] = (0.0, 1.0, 0.0)
NAMES = ("ordinates", "pre_curvature", "stiffness_profile", *_GEOMETRY, *_BOTH_ENDS, *_SCALARS)


def directions(test: BendingTest, parameters: Sequence[Parameter]) -> Directions:
    """Directions of the ``parameters`` at ``test``.

    Raises
    ------
    ValueError
        For an unknown name, a basis of the wrong shape or where none belongs, ordinates of a law that has none,
        friction parameters of a test without friction, or a test to go toward that is of another kind.
    """
    blocks = [_block(test, parameter) for parameter in parameters]
    names = tuple(name for block in blocks for name in block[0])
    q, joints = len(names), test.rod.section.pre_curvature.size
    law, friction = test.characteristic, test.friction
    p = law.parameters if parametric(law) else 0
    e = 0 if friction is None else friction.stick.size
    pre_curvature, profile, ordinates, edges, slip, stick = (
        np.zeros((q, size)) for size in (joints, joints, p, joints + 1, e, e)
    )
    made = Directions(names, pre_curvature, profile, ordinates, edges, slip, stick)
    fields = {"pre_curvature": made.pre_curvature, "stiffness_profile": made.profile, "ordinates": made.ordinates}
    column = 0
    for parameter, (labels, name, basis) in zip(parameters, blocks, strict=True):
        columns = slice(column, column + len(labels))
        column += len(labels)
        if isinstance(parameter, Toward):
            _go_toward(parameter, made, columns.start)
            continue
        if friction is not None and name == "hysteresis":
            made.slip[columns] = friction.own[:, 0] / friction.elements
        if friction is not None and name == "stick_curvature":
            made.stick[columns] = (friction.own * friction.stick)[:, 0] / friction.stick_curvature
        if basis is not None:
            fields[name][columns] = basis.T
            continue
        if name in _GEOMETRY:
            left, right, length = _GEOMETRY[name]
            made.edges[columns, 0], made.edges[columns, -1] = left, right
            made.edges[columns, 1:-1] = test.rod.elements * (length - left - right)
        for scalar in (f"{name}_left", f"{name}_right") if name in _BOTH_ENDS else (name,):
            if scalar in _SCALARS:
                made.moved(scalar, columns, 1.0)
    return made


def comparable(test: BendingTest, other: BendingTest) -> bool:
    """Whether a test can go `Toward` another: the same elements, supports and zero, friction of as many elements."""
    elements = [0 if t.friction is None else t.friction.stick.size for t in (test, other)]
    same = [(t.left.kind, t.right.kind, t.zero, t.law_stays, t.rod.elements.size) for t in (test, other)]
    given = [(t.grown is None, t.friction_by_step is None) for t in (test, other)]
    stiffness = [(t.axial_stiffness, t.shear_stiffness, t.left.angle, t.right.angle) for t in (test, other)]
    return elements[0] == elements[1] and same[0] == same[1] and given[0] == given[1] and stiffness[0] == stiffness[1]


def _go_toward(toward: Toward, made: Directions, column: int) -> None:
    """The changes of everything from one test to another, put into a column."""
    step, test, other = toward.step, toward.test, toward.other
    here, there = test.rod, other.rod
    if here is not there:
        made.pre_curvature[column] = (there.section.pre_curvature - here.section.pre_curvature) / step
        made.edges[column] = (there.edges - here.edges) / step
        profiles = [1.0 if p is None else p for p in (here.section.profile, there.section.profile)]
        made.profile[column] = (profiles[1] - profiles[0]) / step
    if other.characteristic is not test.characteristic:
        made.laws.append((column, test.characteristic, other.characteristic, step))
    if test.friction is not None and other.friction is not None:
        made.slip[column] = (other.friction.slip - test.friction.slip)[:, 0] / step
        made.stick[column] = (other.friction.stick - test.friction.stick)[:, 0] / step
    by_step = (
        (made.grown, test.grown, other.grown),
        (made.friction_by_step, test.friction_by_step, other.friction_by_step),
    )
    for changes, old, new in by_step:
        if old is not None and new is not None:
            changes[column] = (new - old) / step
    before, after = _numbers(test), _numbers(other)
    for name, value in before.items():
        if after[name] != value:
            made.moved(name, column, (after[name] - value) / step)


def _numbers(test: BendingTest) -> dict[str, float]:
    """Everything that is one number of a test and not in its rod's geometry."""
    numbers = {
        "displacement_offset": test.displacement_offset,
        "rig_compliance": test.compliance,
        "length": test.length,
        "load_x": test.load[0],
        "load_y": test.load[1],
        "plastic_set": test.plastic_rate,
        "set_threshold": test.set_threshold,
    }
    for side, support in (("left", test.left), ("right", test.right)):
        numbers |= {
            f"end_moment_{side}": support.moment,
            f"bearing_stiffness_{side}": support.stiffness,
            f"bearing_friction_{side}": support.friction_moment,
            f"stick_angle_{side}": support.stick_angle,
        }
    return numbers


def _block(test: BendingTest, parameter: Parameter) -> tuple[tuple[str, ...], str, Array | None]:
    """Column names, name and basis (rows, columns) of one parameter; None for a plain number."""
    if isinstance(parameter, Toward):
        if not (comparable(test, parameter.test) and comparable(test, parameter.other)):
            raise ValueError("the test to go toward has other elements, supports, friction or zero")
        return ("toward",), "toward", None
    name, given = (parameter, None) if isinstance(parameter, str) else parameter
    if name not in NAMES:
        raise ValueError(f"unknown parameter {name!r}; known are {', '.join(NAMES)}")
    if name in ("hysteresis", "stick_curvature") and test.friction is None:
        raise ValueError(f"{name} needs a test with internal friction; InternalFriction(0.0, ...) will do")
    if name in ("pre_curvature", "stiffness_profile"):
        joints = test.rod.section.pre_curvature.size
        if given is None:
            return (name,), name, np.ones((joints, 1))
        basis = _basis(given, test.rod.elements)
        if basis.shape[0] != joints:
            raise ValueError(f"basis of {name} has {basis.shape[0]} rows; one per joint is needed, {joints}")
        return tuple(f"{name}[{i}]" for i in range(basis.shape[1])), name, basis
    if given is not None:
        raise ValueError(f"{name} takes no basis")
    if name == "ordinates":
        if not parametric(test.characteristic):
            raise ValueError("only a law with parameters has ordinates")
        p = test.characteristic.parameters
        return tuple(f"ordinates[{i}]" for i in range(p)), name, np.eye(p)
    return (name,), name, None


def _basis(given: Basis, elements: Array) -> Array:
    """Basis values at the joints, (n, q)."""
    position = np.concatenate(([0.0], np.cumsum(elements)))
    if callable(given):
        given = [given]
    if isinstance(given, Sequence) and given and callable(given[0]):
        columns = [np.broadcast_to(np.asarray(f(position), float), position.shape) for f in given if callable(f)]
        return np.column_stack(columns)
    values = np.asarray(given, float)
    return values[:, None] if values.ndim == 1 else values

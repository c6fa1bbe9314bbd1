"""Parameters of a bending test, as directions in which rod and rig change.

From a list of parameters to `Directions`: how much every ingredient of the discrete rod (pre-curvature at the joints,
edge lengths, ordinates, ...) changes per unit of each parameter. `rod.sensitivity` turns directions into derivatives.

A parameter has a name, or is told by example:

=========================  ==========================================================================  =======
parameter                  what changes                                                                unit
=========================  ==========================================================================  =======
``ordinates``              every control point or coefficient of the law, one column each              N m^2, -
``pre_curvature``          K0, uniformly                                                               1/m
``stiffness_profile``      EI(s) relative, uniformly                                                   -
a pair of these and phi    the same along the cable, by (elements + 1,) values phi at the joints       as above
``length``                 cable length                                                                m
``displacement_offset``    zero of the displacement                                                    m
``chord``, ``force``       imposed distance of the axes, or imposed force, of each step                m, N
`Toward` another test      whatever differs: springs, friction, moments and rigid pieces of the ends,  that of
                           loads, friction and set of the cable, a yielding frame, the law itself      its step
=========================  ==========================================================================  =======

Derivatives at the value zero of a cause are meaningful: friction needs a test with ``InternalFriction(0.0,
stick_curvature)``, everything else is there by default.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rod.array import Array
from rod.bending_test import BendingTest
from rod.characteristic import MomentCurve, parametric


@dataclass(frozen=True, eq=False)
class Toward:
    """The parameter that changes whatever differs between two tests, when it grows by ``step``, which is short.

    The first is the test that is moved, or one like it in all that differs.
    """

    test: BendingTest
    other: BendingTest
    step: float


Parameter = str | tuple[str, Array] | Toward


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
        Everything that is one number, under its name in the table or in `BendingTest.numbers`.
    laws : list of (column, MomentCurve, MomentCurve, step)
        From which law to which the characteristic goes when that parameter grows by the step.
    grown : dict of column -> (steps, n)
        Of the set that is given step by step.
    friction_by_step, moments_by_step : dict of column -> (steps, 2)
        Of friction of the bearings and moments at the ends that are given step by step.
    forces_by_step : dict of column -> (steps, n, 2)
        Of forces on the joints that are given step by step.
    """

    names: tuple[str, ...]
    pre_curvature: Array
    profile: Array
    ordinates: Array
    edges: Array
    slip: Array
    stick: Array
    scalars: dict[str, Array] = field(init=False, default_factory=dict)
    laws: list[tuple[int, MomentCurve, MomentCurve, float]] = field(init=False, default_factory=list)
    grown: dict[int, Array] = field(init=False, default_factory=dict)
    friction_by_step: dict[int, Array] = field(init=False, default_factory=dict)
    moments_by_step: dict[int, Array] = field(init=False, default_factory=dict)
    forces_by_step: dict[int, Array] = field(init=False, default_factory=dict)

    def scalar(self, name: str) -> Array:
        """Change of one number per parameter, (q,); zeros if it is none of them."""
        return self.scalars.get(name, self.none)

    def given(self, changes: dict[int, Array], step: int, side: int | None = None) -> Array:
        """Change at a step (q, ...) of what is given step by step, or of one side; (q,) zeros if nothing is."""
        if not changes:
            return self.none
        if side is not None:
            changes = {column: by_step[:, side] for column, by_step in changes.items()}
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
        inner[:, :: inner.shape[1] - 1] = 0.0
        return np.asarray(inner[:, 1:] + inner[:, :-1])

    @cached_property
    def vertices(self) -> Array:
        """Change of the arc lengths of all vertices with the edges, (q, n + 2)."""
        vertices = np.zeros((len(self.names), self.edges.shape[1] + 1))
        np.add.accumulate(self.edges, axis=1, out=vertices[:, 1:])
        return vertices

    def has(self, *names: str) -> bool:
        """Whether one of these numbers is a parameter."""
        return any(name in self.scalars for name in names)

    def moved(self, name: str, column: int, by: float) -> None:
        """Put the change of one number into a column."""
        self.scalars.setdefault(name, np.zeros(len(self.names)))[column] = by


#: Names of what is one number, and of what may vary along the cable with the record that holds it.
_SCALARS = ("chord", "force", "displacement_offset", "length")
_ALONG = {"pre_curvature": "pre_curvature", "stiffness_profile": "profile"}
NAMES = ("ordinates", *_ALONG, *_SCALARS)


def directions(test: BendingTest, parameters: Sequence[Parameter]) -> Directions:
    """Directions of the ``parameters`` at ``test``.

    Raises `ValueError` for an unknown name, values of the wrong shape or where none belong, ordinates of a law that has
    none, or a test to go toward that is of another kind.
    """
    names = tuple(name for parameter in parameters for name in _columns(test, parameter))
    joints, friction, law = test.rod.section.pre_curvature.size, test.friction, test.characteristic
    e, p = 0 if friction is None else friction.stick.size, law.parameters if parametric(law) else 0
    made = Directions(names, *(np.zeros((len(names), size)) for size in (joints, joints, p, joints + 1, e, e)))
    column = 0
    for parameter in parameters:
        name, basis = parameter if isinstance(parameter, tuple) else (parameter, 1.0)
        if isinstance(name, Toward):
            _go_toward(name, made, column)
        elif name == "ordinates":
            made.ordinates[column : column + p] = np.eye(p)
            column += p - 1
        elif name in _ALONG:
            getattr(made, _ALONG[name])[column] = basis
        else:
            made.moved(name, column, 1.0)
            if name == "length":
                made.edges[column, 1:-1] = test.rod.elements
        column += 1
    return made


def comparable(test: BendingTest, other: BendingTest) -> bool:
    """Whether a test can go `Toward` another: the same elements, supports and zero, friction of as many elements."""
    return test.kind == other.kind


def _go_toward(toward: Toward, made: Directions, column: int) -> None:
    """The changes of everything from one test to another, put into a column."""
    step, test, other = toward.step, toward.test, toward.other
    # only what was given anew is looked at: a rod costs as much as all the rest
    if other.pre_curvature is not test.pre_curvature:
        made.pre_curvature[column] = (other.rod.section.pre_curvature - test.rod.section.pre_curvature) / step
    if other.stiffness_profile is not test.stiffness_profile:
        before, after = (1.0 if p is None else p for p in (test.rod.section.profile, other.rod.section.profile))
        made.profile[column] = (after - before) / step
    lengths = [(t.length, t.left.rigid_length, t.right.rigid_length) for t in (test, other)]
    if lengths[0] != lengths[1]:
        made.edges[column] = (other.rod.edges - test.rod.edges) / step
    if other.characteristic is not test.characteristic:
        made.laws.append((column, test.characteristic, other.characteristic, step))
    if test.friction is not None and other.friction is not None:
        made.slip[column] = (other.friction.slip - test.friction.slip)[:, 0] / step
        made.stick[column] = (other.friction.stick - test.friction.stick)[:, 0] / step
    for name in ("grown", "forces_by_step", "friction_by_step", "moments_by_step"):
        before, after = getattr(test, name), getattr(other, name)
        if before is not None and after is not before:
            getattr(made, name)[column] = (after - before) / step
    for name, old in test.numbers.items():
        if (new := other.numbers[name]) != old:
            made.moved(name, column, (new - old) / step)


def _columns(test: BendingTest, parameter: Parameter) -> list[str]:
    """Names of the columns of one parameter, once it is known to be one."""
    if isinstance(parameter, Toward):
        if not (comparable(test, parameter.test) and comparable(test, parameter.other)):
            raise ValueError("the test to go toward has other elements, supports, friction or zero")
        return ["toward"]
    name, basis = (parameter, None) if isinstance(parameter, str) else parameter
    if name not in NAMES:
        raise ValueError(f"unknown parameter {name!r}; known are {', '.join(NAMES)}, and Toward another test")
    joints = test.rod.section.pre_curvature.size
    if basis is not None and (name not in _ALONG or np.shape(basis) != (joints,)):
        raise ValueError(f"{name} along the cable: only {', '.join(_ALONG)} vary, by one value per joint, ({joints},)")
    if name != "ordinates":
        return [name]
    if not parametric(test.characteristic):
        raise ValueError("only a law with parameters has ordinates")
    return [f"ordinates[{i}]" for i in range(test.characteristic.parameters)]

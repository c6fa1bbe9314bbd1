"""The virtual bending test: cable, protocol and hidden effects in, the bent cable of every step out. SI units.

The cable's own law is stick-slip, f_EI = EI1 + (EI0 - EI1) / cosh^2((K - K0) / kc) (tangent reading): no spline, so
that a spline fitted to its data is never exactly right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

from pipeline.messages import Message, ended
from pipeline.records import Array, Branch
from pipeline.simulate.effects import Readings, Setup, Values, check_geometry, hide
from pipeline.vision.render import Camera
from rod.bending_test import BendingTest, simulate
from rod.laws import StickSlip

ProtocolName = Literal["three", "loading", "unloading"]

ELEMENTS = 400  # of the rod: 16 times closer to the continuum than the fit's 100, far below the noise of any photo


@dataclass(frozen=True)
class Experiment:
    """A cable, what is done to it, and what is hidden.

    Attributes
    ----------
    id : str
    length_m, diameter_m : float
    EI0, EI1 : N m^2
        Stiffness at rest and far from it.
    kc : 1/m
    K0 : 1/m
    displacements_m : tuple of float
        Of the moving bearing from the mounted position, step by step; see `protocol`.
    effects : mapping
        Hidden causes by name, one value or several; see `pipeline.simulate.effects`.
    moving : str
        Bearing that is pushed.
    force_noise : float
        Standard deviation of one force sample, relative to the largest force.
    hold_s, period_s : float
        Time from one hold's begin to its photo, and to the next hold.
    samples : int
        Force samples a hold, the last with the photo.
    seed : int
    """

    id: str = "virtual"
    length_m: float = 0.181
    diameter_m: float = 0.0046
    EI0: float = 0.018
    EI1: float = 0.0075
    kc: float = 4.5
    K0: float = 2.0
    displacements_m: tuple[float, ...] = (0.0, 0.0023, 0.0046, 0.0069, 0.0092, 0.0115, 0.0138)
    effects: Mapping[str, float | Values] = field(default_factory=dict)
    moving: Literal["left", "right"] = "left"
    force_noise: float = 0.003
    hold_s: float = 20.0
    period_s: float = 60.0
    samples: int = 8
    seed: int = 0

    def __post_init__(self) -> None:
        if not (self.length_m > self.diameter_m > 0 and self.EI0 > 0 and self.EI1 > 0 and self.kc > 0):
            raise ValueError(Message("misuse.no-cable"))
        if not self.displacements_m or self.samples < 1 or not self.period_s >= self.hold_s > 0:
            raise ValueError(Message("misuse.no-experiment"))
        check_geometry(self.length_m, self.K0, self.effects)

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Branch of every step: a first displacement of zero is ``mounted``, less than before is ``unloading``."""
        first: Branch = "mounted" if self.displacements_m[0] == 0.0 else "loading"
        rest: list[Branch] = ["unloading" if b < a else "loading" for a, b in pairwise(self.displacements_m)]
        return (first, *rest)

    def setup(self, camera: Camera) -> Setup:
        """Cable, rig, instruments and camera with the effects in them."""
        law = StickSlip(self.EI0, self.EI1, self.kc)
        test = BendingTest(self.length_m, law, self.K0, elements=ELEMENTS)
        return hide(Setup(test, Readings(), camera), self.effects)


@dataclass(frozen=True)
class State:
    """The bent cable of one step, by whatever solver.

    Attributes
    ----------
    force : N
        Reaction at the right bearing, compression positive.
    chord : m
    s, x, y, theta, kappa, moment : (n,)
        From axis to axis in the chord frame.
    """

    force: float
    chord: float
    s: Array
    x: Array
    y: Array
    theta: Array
    kappa: Array
    moment: Array


def protocol(name: ProtocolName, steps: int, step_m: float) -> tuple[float, ...]:
    """Displacements of a usual test.

    Parameters
    ----------
    name : str
        ``three``: loading steps only, as in the paper; ``loading``: mounted, then loading; ``unloading``: mounted,
        loading, and back through the same steps.
    steps : int
        Loading steps.
    step_m : float
    """
    up = tuple(step_m * k for k in range(1, steps + 1))
    known = {"three": up, "loading": (0.0, *up), "unloading": (0.0, *up, *up[-2::-1])}
    if name not in known or steps < 1 or not step_m > 0:
        raise ValueError(f"protocol {name!r} with {steps} steps of {step_m} m: known are {', '.join(known)}")
    return known[name]


def bend(experiment: Experiment) -> tuple[State, ...]:
    """Bend the cable through all steps with the discrete rod.

    Raises `ValueError` if a step has no equilibrium, with the solver's advice.
    """
    test = experiment.setup(Camera()).test
    states = []
    for number, e in enumerate(simulate(test, experiment.displacements_m)):
        if not e.good:
            raise ValueError(Message("misuse.no-equilibrium", step=number, said=ended(e.outcome)))
        states.append(State(float(e.force), float(e.chord), e.s, e.x, e.y, e.theta, e.kappa, e.moment))
    return tuple(states)

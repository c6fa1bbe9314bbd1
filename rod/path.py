"""The path of equilibria from the force-free cable (or another start) to what is asked for, and where it ends.

Everything imposed grows with one number, the share: 0 is the mounted cable without force, 1 what is asked for. Loads
and force grow in proportion, and what else the start has in residuals (chord, end moments, turned clamps) fades so.
The path is followed by pseudo-arc-length continuation: a step along its tangent, then Newton's method with the share as
an unknown and the step's plane as a condition, so a path that turns back in the share is followed all the same.

At every state the negative eigenvalues of the stiffness are counted (`System.excess_negatives`). The first state that
has one lies behind a critical point, which is located between the two states. Where the ends of a cable under a force
meet, nothing but springs and loads keeps it from turning round them, and a long step may lead to where it is stable
again: the state just behind is tried, too. The critical point is

* a turning point (limit point), if the share is largest there: the cable jumps;
* a bifurcation, if the path goes on unstable. Along the mode of vanishing stiffness another path branches off. If it is
  stable (a bar that buckles) it is followed further; if not, the cable jumps.

So the straight bar under any force, support, load and weight needs no start of its own.

States and directions are arrays (n + 5,): edge angles, rad, reaction, N, and share.

Source: Riks 1979, Crisfield 1981 (arc length); Keller 1977 (switching of branches).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from rod.array import Array
from rod.newton import (
    BEYOND_NUMBERS,
    PATH_STEPS,
    RESIDUAL_TOLERANCE,
    STEP_LIMIT,
    STEP_TOLERANCE,
    Outcome,
    Start,
    Trial,
    softest,
)
from rod.reduction import Balance, System

#: Longest and shortest step along the path, root mean square of the turns of the edges, rad.
LONGEST, SHORTEST = 0.5, 1e-5
#: Steps shorter than this are no use where the moment falls ahead: the bend localises in one joint.
FALLING = 1e-2
#: How far a state may lie beside the tangent, relative to the step: a path bends, but another path is farther away.
OFF = 0.6
#: Largest turn of an edge by which a path is followed at once to an imposed chord, rad. At 2.405, the zero of J0, the
#: ends of a straight cable meet.
LEAP = 2.4
#: Reactions below this times EI/L^2 count absolutely, larger ones relative to themselves; Euler's load is 9.87.
REACTION = 20.0
#: Turn of the first state on a new branch, rad (root mean square).
BRANCHING = 0.01
#: Halvings of a step to locate a critical point or where ends meet, and the stiffness, over EI/L, of a critical point.
LOCATING, CRITICAL = 24, 1e-3


class Point(NamedTuple):
    """A state on the path, (n + 5,), with its residuals."""

    state: Array
    balance: Balance

    @property
    def start(self) -> Start:
        """Edge angles and reaction."""
        return Start(self.state[:-3], self.state[-3:-1])

    @property
    def share(self) -> float:
        """Share of what is imposed."""
        return float(self.state[-1])


class Ramp:
    """A load or displacement that grows from nothing (share 0) to all of it (1), and steps along its equilibria.

    ``steps`` counts Newton steps. From ``None``, the mounted cable, loads and supports grow; from a start they stand,
    and its residuals fade.
    """

    def __init__(self, system: System, start: Start | None) -> None:
        self.system, self.fresh, self.steps = system, start is None, 0
        angles, R = start or Start(system.rod.mounted.angles, np.zeros(2))
        self.pull = system.hold.reaction(R) - R
        self.residual = system.under(float(not self.fresh)).balance(angles, R)
        self.begin = self.at(np.r_[angles, R, 0.0])
        self.along_share = np.r_[np.zeros(angles.size + 2), 1.0]
        self.half = np.r_[np.zeros(angles.size), 0.5 * self.pull, 0.5]

    def at(self, state: Array) -> Point:
        """The state with its residuals."""
        share, fade = float(state[-1]), 1.0 - float(state[-1])
        here = self.system.under(share if self.fresh else 1.0).balance(state[:-3], state[-3:-1])
        gradient, gap = here.gradient - fade * self.residual.gradient, here.gap - fade * self.residual.gap
        return Point(state, here._replace(gradient=gradient, gap=gap))

    def solve(self, point: Point) -> tuple[Array, Array]:
        """Newton's step at a fixed share, and what the state changes by per share."""
        forth = self.half
        # residuals are at most quadratic in the share: their derivative is a central difference of any width
        ahead, behind, here = self.at(point.state + forth).balance, self.at(point.state - forth).balance, point.balance
        turning, gap_turning = self.system.clamps_turning(here, self.residual.gradient)
        rate, gap_rate = ahead.gradient - behind.gradient + turning, ahead.gap - behind.gap + gap_turning
        angles, R = self.system.solve(
            here, -np.column_stack((here.gradient, rate)), -np.column_stack((here.gap, gap_rate))
        )
        self.steps += 1
        moved = np.concatenate((angles.T, R.T, ((0.0,), (1.0,))), axis=1)
        moved[1, -3:-1] += self.pull
        return moved[0], moved[1]

    def product(self, a: Array, b: Array, near: Array) -> float:
        """Inner product of two directions near a state."""
        unit = REACTION * self.system.force_scale + float(np.hypot(*near[-3:-1]))
        turns = self.system.mass @ (a[:-3] * b[:-3])
        return float(turns + a[-3:-1] @ b[-3:-1] / unit**2 + 1e-4 * a[-1] * b[-1])

    def tangent(self, point: Point, last: Array | None = None) -> Array:
        """Direction of the path, of length 1, onward from ``last`` (None: toward larger shares)."""
        way = self.solve(point)[1]
        way /= np.sqrt(self.product(way, way, point.state))
        return way if last is None or self.product(way, last, point.state) >= 0.0 else -way

    def corrected(self, state: Array, normal: Array) -> Point | None:
        """Newton's method on the plane through ``state`` across ``normal``; None if it fails."""
        point = self.at(state)
        for _ in range(8):
            step, rate = self.solve(point)
            along = self.product(rate, normal, state)
            if not np.isfinite(along) or along == 0.0:
                return None
            move = step - self.product(step, normal, state) / along * rate
            largest = float(np.abs(move[:-3]).max())
            point = self.at(point.state + STEP_LIMIT / max(largest, STEP_LIMIT) * move)
            if not self.system.misfit(point.balance) < BEYOND_NUMBERS:
                return None
            if largest <= STEP_TOLERANCE and self.system.misfit(point.balance) <= RESIDUAL_TOLERANCE:
                return point
        return None

    def reached(self, here: Point, goal: Array, normal: Array) -> Point | None:
        """The state on the plane through ``goal`` if it is on the same path: near, and no moment falls in between."""
        there = self.corrected(goal, normal)
        if there is None or there.share > 1.0:
            return None
        planned, off, mass = (goal - here.state)[:-3], (there.state - goal)[:-3], self.system.mass
        near = mass @ off**2 < OFF**2 * (mass @ planned**2) + STEP_TOLERANCE**2
        between = self.system.section(0.5 * (here.balance.K + there.balance.K))[1]
        return there if near and np.all(between > 0.0) else None

    def negatives(self, point: Point) -> int:
        """Number of directions in which the state is unstable."""
        return self.system.excess_negatives(point.balance)

    def met(self, here: Point, there: Point, way: Array) -> Point:
        """Where the ends met on the way from ``here``, the state just behind if that is unstable; else ``there``."""

        def passed(point: Point) -> bool:
            one, other = (self.system.rod.edges @ at.balance.edge.direction[1] for at in (here, point))
            return bool(one * other < 0.0)

        behind, low, span = there, 0.0, there.state - here.state
        for halving in range(1, LOCATING + 1) if passed(there) else ():
            middle = self.corrected(here.state + (low + 0.5**halving) * span, way)
            if middle is None:
                return there
            low, behind = (low, middle) if passed(middle) else (low + 0.5**halving, behind)
        return behind if self.negatives(behind) else there

    def falls(self, here: Point, way: Array) -> bool:
        """Whether the moment falls with curvature in some joint within a long step ahead."""
        return bool(np.any(self.at(here.state + LONGEST * way).balance.tangent <= 0.0))

    def ended(self, here: Point, way: Array, outcome: Outcome) -> Trial:
        """The last stable state and how the path ends: where the moment falls ahead all else follows from that."""
        falls = outcome is not Outcome.CONVERGED and self.falls(here, way)
        return Trial(*here.start, here.balance, self.steps, Outcome.LIMIT_POINT if falls else outcome)


def followed(system: System, start: Start | None = None, *, side: int = 1, most: int = PATH_STEPS) -> Trial:
    """The path from the mounted cable or a start to what is asked for; ``side`` is taken where a straight bar buckles.

    The trial is CONVERGED at the whole share, otherwise the last stable state with the reason why the path ends there,
    if it does within ``most`` Newton steps.
    """
    ramp = Ramp(system, start)
    here, length, leaps = ramp.begin, LONGEST, True
    way = ramp.tangent(here)
    while ramp.steps < most and way[-1] > 0.0 and length > (FALLING if ramp.falls(here, way) else SHORTEST):
        there = _leap(ramp, here, way) if leaps else None
        leaps = False
        if there is None:
            whole = (1.0 - here.share) / way[-1]
            last, length = whole <= length, min(length, whole)
            goal = here.state + length * way
            goal[-1] = 1.0 if last else goal[-1]
            there = ramp.reached(here, goal, ramp.along_share if last else way)
        if there is None:
            length *= 0.5
            continue
        there = ramp.met(here, there, way)
        if ramp.negatives(there):
            critical = _critical(ramp, here, there, way)
            if critical is None:  # no critical point between: they are on different paths
                length *= 0.5
                continue
            here, mode = critical
            branch = _branched(ramp, here, way, mode, side)
            if branch is None:
                turned = ramp.tangent(there, way)[-1] < 0.0
                return ramp.ended(here, way, Outcome.TURNING_POINT if turned else Outcome.BIFURCATION)
            there, leaps = branch, True
        if there.share == 1.0:
            return ramp.ended(there, way, Outcome.CONVERGED)
        way, here, length = ramp.tangent(there, there.state - here.state), there, min(LONGEST, 2.0 * length)
    return ramp.ended(here, way, Outcome.STALLED if way[-1] > 0.0 else Outcome.TURNING_POINT)


def _leap(ramp: Ramp, here: Point, way: Array) -> Point | None:
    """At once to the chord asked for: as far along the tangent's turns as the chord needs, then Newton's method.

    Along the turns themselves the chord changes as it does when the cable bends more; along the tangent of the share it
    would soon be far off, and the reaction farther. None if that is not the same path.
    """
    rod, goal, begin, turns = ramp.system.rod, ramp.system.hold.chord, here.start.angles, way[:-3]
    largest = float(np.abs(turns).max())
    if goal is None or largest < 1e-9:
        return None

    def beyond(by: float) -> float:
        return float(rod.edges @ np.cos(begin + by * turns)) - goal

    if beyond(0.0) * beyond(LEAP / largest) >= 0.0:
        return None
    angles = begin + brentq(beyond, 0.0, LEAP / largest, rtol=1e-4) * turns
    still = ramp.system.balance(angles, np.zeros(2))
    R = np.linalg.lstsq(still.border.T, -still.gradient, rcond=None)[0]
    there = ramp.reached(here, np.r_[angles, R, 1.0], ramp.along_share)
    return None if there is None or ramp.negatives(there) else there


def _critical(ramp: Ramp, here: Point, there: Point, way: Array) -> tuple[Point, Array] | None:
    """The last stable state before the critical point on the way from a stable to an unstable state, and its mode.

    None if no stiffness vanishes in between.
    """
    low, stable, span = 0.0, here, there.state - here.state
    for halving in range(1, LOCATING + 1):
        middle = ramp.corrected(here.state + (low + 0.5**halving) * span, way)
        if middle is None:
            break
        if ramp.negatives(middle) == 0:
            low, stable = low + 0.5**halving, middle
    stiffness, mode = softest(ramp.system, stable.balance)
    return (stable, mode) if stiffness < CRITICAL else None


def _branched(ramp: Ramp, here: Point, way: Array, mode: Array, side: int) -> Point | None:
    """The first state on the branch that leaves a bifurcation, on the side asked for; None if it is not stable."""
    angles = here.start.angles
    rod = ramp.system.rod
    lift = rod.bow(angles + 1e-3 * mode) - rod.bow(angles - 1e-3 * mode)
    own = float(ramp.system.mass @ (way[:-3] * mode))
    sign = -1.0 if (own if abs(own) > 1e-9 else side * lift) < 0.0 else 1.0
    aside = BRANCHING * np.r_[sign * mode, np.zeros(3)]
    there = ramp.corrected(here.state + aside, aside)
    if there is not None and there.share > max(here.share, 1.0):
        # the share grows with the square of the turn; a critical point may lie beyond 1 by what locates it
        part = np.sqrt(max(1.0 - here.share, 0.0) / (there.share - here.share))
        goal = here.state + part * aside + 2.0 * (1.0 - here.share) * ramp.half
        goal[-1] = 1.0
        there = ramp.corrected(goal, ramp.along_share)
    return there if there is not None and there.share >= here.share and not ramp.negatives(there) else None

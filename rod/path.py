"""The path of equilibria from the force-free cable (or a warm start) to what is asked for, and where it ends.

Everything imposed grows with one number, the share: 0 is the mounted cable without force, 1 what is asked for. Chord,
force, loads, end moments and turned clamps grow in proportion; what else a start has in residuals fades in proportion.
The path is followed by pseudo-arc-length continuation: a step along its tangent, then Newton's method with the share as
an unknown and the step's plane as a condition, so a path that turns back in the share is followed all the same.

At every state the negative eigenvalues of the stiffness are counted (`System.excess_negatives`). The first state that
has one lies behind a critical point, which is located between the two states. It is

* a turning point (limit point), if the share is largest there: the cable jumps;
* a bifurcation, if the path goes on unstable. Along the mode of vanishing stiffness another path branches off. If it is
  stable (a bar that buckles) it is followed further; if not, the cable jumps.

So the straight bar under any force, support, load and weight needs no start of its own.

Units: rad, N, m; lengths along the path count turns of the edges (root mean square, rad), and the reaction relative to
its own size.

Source: Riks 1979, Crisfield 1981 (arc length); Keller 1977 (switching of branches).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from rod.branch import bow
from rod.characteristic import Array
from rod.newton import RESIDUAL_TOLERANCE, STEP_TOLERANCE, Outcome, Start, Trial, newton, softest
from rod.reduction import Balance, System

#: Longest and shortest step along the path, and the largest turn of an edge in one step, rad.
LONGEST, SHORTEST, TURN_LIMIT = 0.5, 1e-5, 0.8
#: Steps shorter than this are no use where the moment falls: the bend localises in one joint.
FALLING = 1e-2
#: How far a state may lie beside the tangent, relative to the step: a path bends, but another path is farther away.
OFF = 0.8
#: Largest turn of an edge by which a path is followed at once to an imposed chord, rad. At 2.405, the zero of J0, the
#: ends of a straight cable meet.
LEAP = 2.4
#: A path gives up after so many Newton steps; a shallow arch (K0 L = 0.002) needs 100.
PATH_STEPS = 600
#: Reactions below this times EI/L^2 count absolutely, larger ones relative to themselves; Euler's load is 9.87.
REACTION = 20.0
#: Turn of the first state on a new branch, rad (root mean square), tried one after the other.
BRANCHING = (0.1, 0.03, 0.01, 0.003)
#: A critical point is located until the softest stiffness has fallen to this, relative to EI/L.
CRITICAL, LOCATING = 1e-6, 30


class Move(NamedTuple):
    """A small change of a state: edge angles (n + 2,) rad, reaction (2,) N, share."""

    angles: Array
    R: Array
    share: float


class Point(NamedTuple):
    """A state on the path with its residuals."""

    angles: Array
    R: Array
    share: float
    balance: Balance


class Critical(NamedTuple):
    """Where the path loses its stability: last stable state, its direction, softest mode (n + 2,), and what it is."""

    point: Point
    way: Move
    mode: Array
    outcome: Outcome


class Ramp:
    """What is imposed as it grows with the share, and the geometry of the path.

    From ``None``, the mounted cable, loads and supports grow; from a start they stand, and its residuals fade.
    """

    def __init__(self, system: System, start: Start | None) -> None:
        self.system = system
        self.fresh = start is None
        angles, R = (system.rod.mounted.angles, np.zeros(2)) if start is None else start
        self.origin = R
        goal = system.hold.reaction(R)
        self.pull = goal - R
        self.residual = system.balance(angles, R, 0.0 if self.fresh else 1.0)
        self.begin = Point(angles, R, 0.0, self.balance(angles, R, 0.0))
        self.mass = system.rod.edges / system.rod.length

    def balance(self, angles: Array, R: Array, share: float) -> Balance:
        """Residuals at ``share``."""
        here = self.system.balance(angles, R, share if self.fresh else 1.0)
        fade = 1.0 - share
        return here._replace(
            gradient=here.gradient - fade * self.residual.gradient, gap=here.gap - fade * self.residual.gap
        )

    def rate(self, point: Point) -> tuple[Array, Array]:
        """Derivative of gradient and gap by the share: residuals are at most quadratic in it, so differences do."""
        angles, R, share, here = point
        ahead = self.balance(angles, R + 0.5 * self.pull, share + 0.5)
        behind = self.balance(angles, R - 0.5 * self.pull, share - 0.5)
        gradient, gap = ahead.gradient - behind.gradient, ahead.gap - behind.gap
        if not self.fresh:
            return gradient, gap
        by_clamps, gap_by_clamps = self.system.clamps_turning(angles, R, here.tangent)
        return gradient + by_clamps, gap + gap_by_clamps

    def solve(self, point: Point) -> tuple[Move, Move]:
        """Newton's step at a fixed share, and what the state changes by per share."""
        rate, gap_rate = self.rate(point)
        here = point.balance
        angles, R = self.system.solve(
            here, -np.column_stack((here.gradient, rate)), -np.column_stack((here.gap, gap_rate))
        )
        return Move(angles[:, 0], R[:, 0], 0.0), Move(angles[:, 1], R[:, 1] + self.pull, 1.0)

    def moved(self, point: Point, way: Move, by: float = 1.0) -> Point:
        """The state ``by`` times ``way`` further."""
        angles, R, share = point.angles + by * way.angles, point.R + by * way.R, point.share + by * way.share
        return Point(angles, R, share, self.balance(angles, R, share))

    def product(self, a: Move, b: Move, R: Array) -> float:
        """Inner product of two moves near a state of reaction ``R``."""
        unit = REACTION * self.system.force_scale + 0.5 * float(np.hypot(*R))
        return float(self.mass @ (a.angles * b.angles) + a.R @ b.R / unit**2 + 1e-4 * a.share * b.share)

    def unit(self, way: Move, R: Array) -> Move:
        """The move scaled to length 1."""
        size = 1.0 / np.sqrt(self.product(way, way, R))
        return Move(size * way.angles, size * way.R, size * way.share)

    def tangent(self, point: Point, last: Move | None) -> Move:
        """Direction of the path, onward from ``last`` (None: toward larger shares)."""
        way = self.unit(self.solve(point)[1], point.R)
        onward = 1.0 if last is None or self.product(way, last, point.R) >= 0.0 else -1.0
        return Move(onward * way.angles, onward * way.R, onward * way.share)

    def corrected(self, guess: Point, normal: Move) -> tuple[Point | None, int]:
        """Newton's method on the plane through ``guess`` across ``normal``; None if it fails, and the steps taken."""
        point, system = guess, self.system
        for count in range(1, 9):
            step, rate = self.solve(point)
            along = self.product(rate, normal, guess.R)
            if not np.isfinite(along) or along == 0.0:
                return None, count
            dshare = -self.product(step, normal, guess.R) / along
            turn = step.angles + dshare * rate.angles
            largest = float(np.abs(turn).max())
            if not largest < 2.0 * TURN_LIMIT:
                return None, count
            point = self.moved(point, Move(turn, step.R + dshare * rate.R, dshare))
            if largest <= STEP_TOLERANCE and system.misfit(point.balance) <= RESIDUAL_TOLERANCE:
                return point, count
        return None, count

    def negatives(self, point: Point) -> int:
        """Number of directions in which the state is unstable."""
        return self.system.excess_negatives(point.balance)


def followed(system: System, start: Start | None = None, *, side: int = 1) -> Trial:
    """The path from the mounted cable or a start to what is asked for; ``side`` is taken where a straight bar buckles.

    The trial is CONVERGED at the whole share, otherwise the last stable state with the reason why the path ends there.
    """
    ramp = Ramp(system, start)
    here, way, steps, longest = ramp.begin, ramp.tangent(ramp.begin, None), 1, LONGEST
    fresh = True
    while steps < PATH_STEPS and longest > SHORTEST and way.share > 0.0:
        there, used = _leap(ramp, here, way) if fresh else (None, 0)
        if there is not None:
            return _ended(there, steps + used, Outcome.CONVERGED)
        steps, fresh = steps + used, False
        whole = (1.0 - here.share) / way.share
        there, used = _next(ramp, here, way, min(longest, whole), last=whole <= longest)
        steps += used
        if there is None or there.share > 1.0:
            longest = 0.5 * min(longest, whole)
            if longest < FALLING and _reason(ramp.moved(here, way, longest), Outcome.STALLED) is Outcome.LIMIT_POINT:
                break
            continue
        if ramp.negatives(there):
            critical, used = _critical(ramp, here, way, there)
            if critical is None:  # no critical point between: they are on different paths
                longest, steps = 0.5 * min(longest, whole), steps + used
                continue
            branch, more = _branched(ramp, critical, side)
            steps += used + more
            if branch is None:
                return _ended(critical.point, steps, critical.outcome)
            there, here, fresh = branch, critical.point, True
        if there.share >= 1.0:
            return _ended(there, steps, Outcome.CONVERGED)
        last = Move(there.angles - here.angles, there.R - here.R, there.share - here.share)
        here, way, longest = there, ramp.tangent(there, last), min(LONGEST, 2.0 * longest)
        steps += 1
    ahead = ramp.moved(here, way, min(LONGEST, (1.0 - here.share) / way.share) if way.share > 0.0 else 0.0)
    return _ended(here, steps, _reason(ahead, Outcome.STALLED if way.share > 0.0 else Outcome.TURNING_POINT))


def _reason(ahead: Point, outcome: Outcome) -> Outcome:
    """Why a path ends: where the moment falls ahead that is the reason, and all else follows from it."""
    return Outcome.LIMIT_POINT if np.any(ahead.balance.tangent <= 0.0) else outcome


def _ended(point: Point, steps: int, outcome: Outcome) -> Trial:
    return Trial(point.angles, point.R, point.balance, steps, outcome)


def _next(ramp: Ramp, here: Point, way: Move, length: float, *, last: bool) -> tuple[Point | None, int]:
    """The state ``length`` along the path, or at the whole share; None if it is not near enough to be the same path."""
    guess = ramp.moved(here, way, length)
    if not last:
        there, used = ramp.corrected(guess, way)
        return (there if there is not None and _near(ramp, here, guess, there) else None), used
    trial = newton(ramp.system, Start(guess.angles, guess.R), most=8)
    there = Point(trial.angles, trial.R, 1.0, trial.balance)
    return (there if trial.found and _near(ramp, here, guess, there) else None), trial.steps


def _near(ramp: Ramp, here: Point, guess: Point, there: Point) -> bool:
    """Whether a state lies so near its guess along the tangent that it is on the same path."""
    planned, off = guess.angles - here.angles, there.angles - guess.angles
    turn = float(np.abs(there.angles - here.angles).max())
    allowed = OFF if turn < TURN_LIMIT else 0.5 * OFF
    return bool(ramp.mass @ (off * off) < allowed**2 * (ramp.mass @ (planned * planned)) + 0.01**2)


def _leap(ramp: Ramp, here: Point, way: Move) -> tuple[Point | None, int]:
    """At once to the chord asked for: as far along the tangent's turns as the chord needs, then Newton's method.

    Along the turns themselves the chord changes as it does when the cable bends more; along the tangent of the share it
    would soon be far off, and the reaction farther. None if that is not the same path.
    """
    system, h = ramp.system, ramp.system.rod.edges
    largest = float(np.abs(way.angles).max())
    goal = system.hold.chord
    if goal is None or largest < 1e-9:
        return None, 0

    def beyond(by: float) -> float:
        return float(h @ np.cos(here.angles + by * way.angles)) - goal

    far = LEAP / largest
    if beyond(0.0) * beyond(far) >= 0.0:
        return None, 0
    angles = np.asarray(here.angles + brentq(beyond, 0.0, far, rtol=1e-4) * way.angles, float)
    still = system.balance(angles, np.zeros(2))
    R = np.linalg.lstsq(still.border.T / system.rod.length, -still.gradient / system.rod.length, rcond=None)[0]
    trial = newton(system, Start(angles, np.asarray(R, float)), most=8)
    there = Point(trial.angles, trial.R, 1.0, trial.balance)
    guess = here._replace(angles=angles)
    good = trial.found and _near(ramp, here, guess, there) and not ramp.negatives(there)
    return (there if good else None), trial.steps


def _critical(ramp: Ramp, here: Point, way: Move, there: Point) -> tuple[Critical | None, int]:
    """The critical point between a stable state and an unstable one, by false position on the softest stiffness.

    None if the softest stiffness does not vanish in between.
    """
    low, steps = here, 0
    span = Move(there.angles - here.angles, there.R - here.R, there.share - here.share)
    low_at, high_at = 0.0, 1.0
    low_value, mode = softest(ramp.system, low.balance)
    high_value: float | None = softest(ramp.system, there.balance)[0] if ramp.negatives(there) == 1 else None
    high, normal = there, ramp.unit(way, here.R)
    for _ in range(LOCATING):
        if low_value <= CRITICAL:
            break
        at = 0.5 * (low_at + high_at)
        if high_value is not None and high_value < 0.0:
            share = low_value / (low_value - high_value)
            at = low_at + (high_at - low_at) * min(0.99, max(0.01, share))
        middle, used = ramp.corrected(ramp.moved(here, span, at), normal)
        steps += used
        if middle is None:
            break
        if (negatives := ramp.negatives(middle)) == 0:
            low, low_at = middle, at
            low_value, mode = softest(ramp.system, low.balance, mode)
        else:
            high, high_at = middle, at
            high_value = softest(ramp.system, high.balance, mode)[0] if negatives == 1 else None
    if low_value > 1e3 * CRITICAL:
        return None, steps
    turned = ramp.tangent(high, way).share < 0.0
    reason = _reason(there, Outcome.TURNING_POINT if turned else Outcome.BIFURCATION)
    return Critical(low, way, mode, reason), steps


def _branched(ramp: Ramp, critical: Critical, side: int) -> tuple[Point | None, int]:
    """The first state on the branch that leaves a bifurcation, on the side asked for; None if it is not stable."""
    here, steps = critical.point, 0
    rod = ramp.system.rod
    lift = bow(rod, here.angles + 1e-3 * critical.mode) - bow(rod, here.angles - 1e-3 * critical.mode)
    own = float(ramp.mass @ (ramp.tangent(here, critical.way).angles * critical.mode))
    sign = -1.0 if (own if abs(own) > 1e-3 else side * lift) < -1e-9 else 1.0
    for size in BRANCHING:
        way = Move(sign * critical.mode, np.zeros(2), 0.0)
        there, used = ramp.corrected(ramp.moved(here, way, size), way)
        steps += used
        if there is None or np.abs(there.angles - here.angles).max() > TURN_LIMIT:
            continue
        if ramp.negatives(there) or there.share < here.share:
            continue
        if there.share <= 1.0:
            return there, steps
        part = np.sqrt((1.0 - here.share) / (there.share - here.share))  # the share grows with the square of the turn
        guess = ramp.moved(here, way, float(part) * size)
        trial = newton(ramp.system, Start(guess.angles, guess.R), most=8)
        there = Point(trial.angles, trial.R, 1.0, trial.balance)
        steps += trial.steps
        if trial.found and not ramp.negatives(there):
            return there, steps
    return None, steps

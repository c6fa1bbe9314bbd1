"""Equilibrium of the discrete rod: from rod and imposed end to the shape of least energy, its reactions and an outcome.

Newton's method on the reduced system of `rod.reduction`, quadratic, with proof of the minimum by inertia. Where a whole
step is too far, the residual of the start is taken back bit by bit (Newton homotopy; for a changed chord that is the
path of displacement), halving where Newton fails or the branch would be lost.

Branches: a cable on two bearings can bow to either side. ``natural`` is the side on which it comes from the force-free
shape (for a straight cable: up), ``opposite`` the other one, ``up`` (toward +y) and ``down`` are absolute. A fit whose
K0 may change sign wants ``up``, the side the photo shows.

The result says in `Outcome` how far to trust it. Nothing raises for a shape that does not exist: that is nature's
refusal and a value.

Signs and units: chord frame, m, rad, 1/m, N; P positive in compression; K = -dtheta/ds positive toward +y.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq

from rod.characteristic import Array
from rod.discretisation import Rod
from rod.reduction import Balance, Hold, System
from rod.section import Memory

Branch = Literal["natural", "opposite", "up", "down"]

#: Newton stops when a whole step turns no edge by more than this, rad: the error left is of the order of its square.
STEP_TOLERANCE = 1e-7
#: Largest residual accepted, relative to EI/L (moments) and L (gaps): rounding of 3200 elements stays below it.
RESIDUAL_TOLERANCE = 1e-9
#: Largest turn of an edge in one Newton step, rad; and over one accepted increment without trying shorter ones.
STEP_LIMIT, INCREMENT_LIMIT = 0.8, 1.2
ITERATIONS = 25
#: A path gives up below this share of the way, or after so many Newton steps; a shallow arch (K0 L = 0.002) needs 100.
SMALLEST_INCREMENT, PATH_STEPS = 2.0**-12, 300


class Outcome(Enum):
    """How an equilibrium ended; each member carries its advice."""

    CONVERGED = "a stable equilibrium on the branch asked for"
    LIMIT_POINT = (
        "the moment falls with curvature (dm/dK <= 0) within the visited range, so the bend localises and the shape "
        "means nothing; this usually means that f_EI is too low at high curvature or read as a secant where it is a "
        "tangent; raise the last control points or bend less"
    )
    STALLED = (
        "Newton's method did not converge even in the shortest steps; if the data are sound, start from the result of "
        "a smaller displacement or look for a jump in K0(s) or EI(s)"
    )
    UNSTABLE = (
        "the equilibrium found is not a minimum of energy: the cable would leave it; it has snapped or buckled to "
        "another shape before this displacement"
    )
    WRONG_BRANCH = (
        "only an equilibrium bowed to the other side was found; if the photo shows this side, the sign of K0 or of the "
        "bow is wrong, otherwise ask for the branch 'opposite'"
    )
    UNREACHABLE = (
        "no shape has this chord: it exceeds what length and stiffness allow, or the bearings would meet; check "
        "length, scale and the zero of displacement"
    )

    @property
    def advice(self) -> str:
        """What this means and what to do."""
        return str(self.value)


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Shape, forces and outcome; arrays (n,) at the vertices, in the chord frame.

    The vertices are the joints, and the bearing axes where rigid pieces stand between. If ``outcome`` is not CONVERGED
    the shape is the last one that was in equilibrium (or the unstable one), and ``chord`` says how far it got.

    Attributes
    ----------
    s, x, y : (n,) m
    theta : (n,) rad
    kappa : (n,) 1/m
    moment : (n,) N m
    force : N
        P at the right bearing, compression positive.
    chord : m
        Distance of the axes (x of the right one).
    outcome : Outcome
    right_reaction, left_reaction : (2,) N
        Force of each support on the cable.
    angles : (elements + 2,) rad
        Edge angles, the unknowns; a warm start for the next equilibrium.
    rod : Rod
    hold : Hold
    before, after : Memory
        Memory at the start of the step, and after it.
    iterations : int
        Newton steps, all increments together.
    """

    s: Array
    x: Array
    y: Array
    theta: Array
    kappa: Array
    moment: Array
    force: float
    chord: float
    outcome: Outcome
    right_reaction: Array
    left_reaction: Array
    angles: Array
    rod: Rod
    hold: Hold
    before: Memory
    after: Memory
    iterations: int

    @property
    def good(self) -> bool:
        """Whether the outcome is CONVERGED."""
        return self.outcome is Outcome.CONVERGED


class Start(NamedTuple):
    """A state to start from: edge angles (n + 2,) rad and right reaction (2,) N."""

    angles: Array
    reaction: Array


class Trial(NamedTuple):
    """A state found by Newton's method, its residuals, the steps it took, and how that ended."""

    angles: Array
    R: Array
    balance: Balance
    steps: int
    outcome: Outcome

    @property
    def found(self) -> bool:
        """Whether the state is an equilibrium at all."""
        return self.outcome is Outcome.CONVERGED


def solve(
    rod: Rod,
    hold: Hold,
    *,
    memory: Memory | None = None,
    start: Start | Equilibrium | None = None,
    branch: Branch = "natural",
) -> Equilibrium:
    """Equilibrium of ``rod`` under ``hold``.

    Parameters
    ----------
    rod : Rod
    hold : Hold
        Chord, force along the chord, or free end with tip force.
    memory : Memory or None
        At the start of the step; None for the mounted cable.
    start : Start or Equilibrium or None
        Warm start, of the same number of elements; None to come from the force-free shape.
    branch : {"natural", "opposite", "up", "down"}

    Returns
    -------
    Equilibrium
    """
    system = System(rod, hold, rod.virgin if memory is None else memory)
    if not _admissible(rod, hold):
        return _record(system, _force_free(system)._replace(outcome=Outcome.UNREACHABLE), 0)
    side = bow_side(rod, branch)
    verdicts: list[Trial] = []
    for attempt in _attempts(system, start, side, branch):
        verdicts.append(attempt)
        if attempt.found:
            break
    last = verdicts[-1]
    if not last.found and any(trial.outcome is Outcome.LIMIT_POINT for trial in verdicts):
        last = last._replace(outcome=Outcome.LIMIT_POINT)
    return _record(system, last, sum(trial.steps for trial in verdicts))


def _attempts(system: System, start: Start | Equilibrium | None, side: int, branch: Branch) -> Iterator[Trial]:
    """Ways to the equilibrium, the cheapest first: warm start, bowed guess, path from the force-free shape or guess."""
    if start is not None:
        first = Start(start.angles, start.right_reaction) if isinstance(start, Equilibrium) else start
        yield judged(system, newton(system, first), side)
    bowed = bowed_start(system, side) if side and system.hold.tip is None else None
    if bowed is not None:
        yield judged(system, newton(system, bowed), side)
    straight = not np.any(system.rod.section.pre_curvature)
    if bowed is None or (branch == "natural" and not straight):
        # Every state on this path is a proven minimum: it is the natural branch, to whichever side it bows.
        yield judged(system, followed(system, Start(system.rod.mounted.angles, np.zeros(2))), 0)
    else:
        yield judged(system, followed(system, bowed), side)


def newton(
    system: System, start: Start, *, fade: float = 0.0, residual: Balance | None = None, most: int = ITERATIONS
) -> Trial:
    """Newton's method from ``start``; the residuals are driven to ``fade`` times those of ``residual`` instead of 0."""
    angles, R = start.angles, system.hold.reaction(start.reaction)
    moment_scale, length = system.moment_scale, system.rod.length
    balance = _faded(system.balance(angles, R), residual, fade)
    norm, step = _norm(balance, moment_scale, length), np.inf
    for count in range(1, most + 1):
        dalpha, dR = system.solve(balance, -balance.gradient[:, None], -balance.gap[:, None])
        step = float(np.abs(dalpha).max())
        if not np.isfinite(step):
            return Trial(angles, R, balance, count, Outcome.STALLED)
        share = min(1.0, STEP_LIMIT / step) if step else 1.0
        # Friction makes the residual piecewise linear: a step across a kink may overshoot and is then shortened.
        for _ in range(4):
            angles_new, R_new = angles + share * dalpha[:, 0], R + share * dR[:, 0]
            tried = _faded(system.balance(angles_new, R_new), residual, fade)
            norm_new = _norm(tried, moment_scale, length)
            if norm_new <= 2.0 * norm or norm_new < RESIDUAL_TOLERANCE or step > 0.1:
                break
            share *= 0.5
        angles, R, balance, norm = angles_new, R_new, tried, norm_new
        if not np.isfinite(norm):
            break
        if step <= STEP_TOLERANCE and norm <= RESIDUAL_TOLERANCE:
            return Trial(angles, R, balance, count, Outcome.CONVERGED)
    localised = bool(np.any(balance.tangent <= 0.0))
    return Trial(angles, R, balance, count, Outcome.LIMIT_POINT if localised else Outcome.STALLED)


def followed(system: System, start: Start) -> Trial:
    """Newton homotopy: take the residual of ``start`` back in increments, each one a proven minimum near the last."""
    R = system.hold.reaction(start.reaction)
    begin = system.balance(start.angles, R)
    here = Trial(start.angles, R, begin, 0, Outcome.CONVERGED)
    reached, increment, steps = 0.0, 0.25, 0
    failure = Outcome.STALLED
    while reached < 1.0 and increment >= SMALLEST_INCREMENT and steps < PATH_STEPS:
        goal = min(1.0, reached + increment)
        trial = newton(system, Start(here.angles, here.R), fade=1.0 - goal, residual=begin, most=12)
        steps += trial.steps
        near = float(np.abs(trial.angles - here.angles).max()) < INCREMENT_LIMIT
        if trial.found and near and system.excess_negatives(trial.balance) == 0:
            here, reached, increment = trial, goal, 2.0 * increment
        else:
            failure = trial.outcome if not trial.found else Outcome.UNSTABLE
            increment *= 0.5
    if reached >= 1.0:
        return here._replace(steps=steps)
    if failure is Outcome.STALLED and _turning(system, here.balance, begin):
        failure = Outcome.UNSTABLE
    return here._replace(steps=steps, outcome=failure)


def judged(system: System, trial: Trial, side: int) -> Trial:
    """The trial with its outcome after the checks: falling moment, minimum, side of the bow (0: either)."""
    if not trial.found:
        return trial
    outcome = Outcome.CONVERGED
    K, memory = trial.balance.K, system.memory
    between = system.rod.section.response(memory)(np.r_[K[:1], 0.5 * (K[1:] + K[:-1])])[1]
    if min(float(trial.balance.tangent.min()), float(between.min())) <= 0.0:
        outcome = Outcome.LIMIT_POINT
    elif system.excess_negatives(trial.balance) != 0:
        outcome = Outcome.UNSTABLE
    elif side and side * bow(system.rod, trial.angles) < 0.0:
        outcome = Outcome.WRONG_BRANCH
    return trial._replace(outcome=outcome)


def _turning(system: System, balance: Balance, residual: Balance) -> bool:
    """Whether the path turns back here: the state then changes without bound with what is imposed."""
    rate, _ = system.solve(balance, -residual.gradient[:, None], -residual.gap[:, None])
    return not float(np.abs(rate).max()) < 0.1 / np.sqrt(SMALLEST_INCREMENT)


def _faded(balance: Balance, residual: Balance | None, fade: float) -> Balance:
    if residual is None or fade == 0.0:
        return balance
    return balance._replace(gradient=balance.gradient - fade * residual.gradient, gap=balance.gap - fade * residual.gap)


def _norm(balance: Balance, moment_scale: float, length: float) -> float:
    """Largest residual, relative."""
    g, (gap_x, gap_y) = balance.gradient, balance.gap.tolist()
    return float(max(g.max() / moment_scale, -g.min() / moment_scale, abs(gap_x) / length, abs(gap_y) / length))


# Sides and first guesses ----------------------------------------------------------------------------------------------


def buckling_slope(rod: Rod) -> Array:
    """Slope of Euler's first buckling mode for the supports, per amplitude, on the edges (n + 2,)."""
    h = rod.edges
    position = (np.cumsum(h) - 0.5 * h) / rod.length
    left, right = rod.left.kind == "clamp", rod.right.kind == "clamp"
    if left and right:
        return np.sin(2.0 * np.pi * position)
    if left or right:
        k = 4.493409457909064  # tan k = k, one end clamped and one pinned
        z = position if left else 1.0 - position
        slope = (k * np.sin(k * z) + np.cos(k * z) - 1.0) / k
        return slope if left else -slope
    return np.cos(np.pi * position)


def bow(rod: Rod, angles: Array) -> float:
    """Mean height of a shape over its chord, relative to the length: positive if it bows toward +y."""
    h = rod.edges
    y = np.cumsum(h * np.sin(angles))
    return float(h @ y / rod.length**2)


def bow_side(rod: Rod, branch: Branch) -> int:
    """Side asked for: +1 up, -1 down, 0 if only following the path from the force-free shape can tell."""
    if branch in ("up", "down"):
        return 1 if branch == "up" else -1
    K0 = rod.section.pre_curvature
    low, high = float(K0.min()), float(K0.max())
    if low < 0.0 < high and branch == "natural":
        return 0
    natural = 1 if bow(rod, rod.mounted.angles) >= 0.0 else -1
    return natural if branch == "natural" else -natural


def bowed_start(system: System, side: int) -> Start:
    """Force-free shape plus as much of the buckling mode as the chord needs, with the reaction that fits best."""
    rod, hold = system.rod, system.hold
    rest, mode = rod.mounted.angles, buckling_slope(rod)
    weighted = rod.edges * mode
    straight = -float(weighted @ rest / (weighted @ mode))

    def chord(amplitude: float) -> float:
        turned = rest + amplitude * mode
        return float(np.hypot(rod.edges @ np.cos(turned), rod.edges @ np.sin(turned)))

    if (goal := hold.chord) is not None:
        far = straight + side * 2.4  # J0 has its zero at 2.405: beyond, the ends of a straight cable would meet
        if chord(straight) <= goal:
            amplitude = straight
        elif chord(far) >= goal:
            amplitude = far
        else:
            amplitude = float(brentq(lambda a: chord(a) - goal, min(straight, far), max(straight, far), rtol=1e-6))
    else:
        # Post-buckling of the straight bar, P = P_E (1 + a^2/8): enough to leave the unstable straight shape.
        euler = (np.pi / rod.length) ** 2 * rod.stiffness_scale
        amplitude = straight + side * float(np.sqrt(8.0 * max((hold.force or 0.0) / euler - 1.0, 0.01)))
    turned = rest + amplitude * mode
    turned = turned - np.arctan2(rod.edges @ np.sin(turned), rod.edges @ np.cos(turned))
    still = system.balance(turned, np.zeros(2))
    reaction = np.linalg.lstsq(still.border.T / rod.length, -still.gradient / rod.length, rcond=None)[0]
    return Start(turned, np.asarray(reaction, float))


def _admissible(rod: Rod, hold: Hold) -> bool:
    """Whether the chord asked for can exist: positive, and not beyond the length of a cable that hardly stretches."""
    if hold.chord is None or hold.compliance:
        return True
    return hold.chord > 0.0 and (hold.chord < rod.length or rod.axial_stiffness is not None)


def _force_free(system: System) -> Trial:
    angles, R = system.rod.mounted.angles, system.hold.reaction(np.zeros(2))
    return Trial(angles, R, system.balance(angles, R), 0, Outcome.CONVERGED)


# The record -----------------------------------------------------------------------------------------------------------


def _record(system: System, trial: Trial, steps: int) -> Equilibrium:
    """Shape at the vertices from the edge angles; the bearing axes join in where rigid pieces are."""
    rod, memory, angles, R = system.rod, system.memory, trial.angles, trial.R
    h = rod.edges
    path = np.concatenate(
        (np.zeros((2, 1)), np.cumsum(h * system.directions(system.edge_state(angles, R)), axis=1)), axis=1
    )
    inner = h[1:-1]
    theta = np.empty(h.size - 1)
    theta[1:-1] = (angles[1:-2] * inner[1:] + angles[2:-1] * inner[:-1]) / (inner[:-1] + inner[1:])
    theta[0], theta[-1] = angles[0], angles[-1]
    K, m = trial.balance.K, trial.balance.m
    keep = slice(0 if h[0] else 1, h.size + 1 if h[-1] else h.size)
    load = rod.vertex_load
    return Equilibrium(
        s=np.concatenate(([0.0], np.cumsum(h)))[keep],
        x=path[0, keep],
        y=path[1, keep],
        theta=np.concatenate((angles[:1], theta, angles[-1:]))[keep],
        kappa=np.concatenate(([0.0], K, [0.0]))[keep],
        moment=np.concatenate((m[:1], m, m[-1:]))[keep],
        force=-float(R[0]),
        chord=float(path[0, -1]),
        outcome=trial.outcome,
        right_reaction=R,
        left_reaction=-R if load is None else -R - load.sum(axis=0),
        angles=angles,
        rod=rod,
        hold=system.hold,
        before=memory,
        after=rod.advanced(angles, memory),
        iterations=steps,
    )

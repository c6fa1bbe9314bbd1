"""Newton's method on the reduced system: from a state to start from to an equilibrium, and a verdict on it.

`newton` is the plain method, quadratic. `followed` takes the residual of its start back bit by bit (Newton homotopy;
for a changed chord that is the path of displacement), halving where Newton fails, and accepts only proven minima close
to each other: it stays on its branch. `judged` checks what was found: falling moment, minimum, side of the bow.

Units: rad, N, m; tolerances are relative to EI and length.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np

from rod.branch import Start, bow
from rod.characteristic import Array
from rod.reduction import Balance, System

#: Newton stops when a whole step turns no edge by more than this, rad: the error left is of the order of its square.
STEP_TOLERANCE = 1e-7
#: Largest residual accepted, relative to EI/L (moments) and L (gaps): rounding of 3200 elements stays below it.
RESIDUAL_TOLERANCE = 1e-9
#: Largest turn of an edge in one Newton step, and in one accepted increment of a path, rad.
STEP_LIMIT, INCREMENT_LIMIT = 0.8, 0.8
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


class Trial(NamedTuple):
    """A state found by Newton's method, its residuals, the steps it took, how that ended, and the first step (rad)."""

    angles: Array
    R: Array
    balance: Balance
    steps: int
    outcome: Outcome
    first_step: float = 0.0

    @property
    def found(self) -> bool:
        """Whether the state is an equilibrium at all."""
        return self.outcome is Outcome.CONVERGED


def newton(
    system: System, start: Start, *, fade: float = 0.0, residual: Balance | None = None, most: int = ITERATIONS
) -> Trial:
    """Newton's method from ``start``; the residuals are driven to ``fade`` times those of ``residual`` instead of 0."""
    angles, R = start.angles, system.hold.reaction(start.reaction)
    moment_scale, length = system.moment_scale, system.rod.length
    balance = _faded(system.balance(angles, R), residual, fade)
    norm, first_step = _norm(balance, moment_scale, length), 0.0
    for count in range(1, most + 1):
        dalpha, dR = system.solve(balance, -balance.gradient[:, None], -balance.gap[:, None])
        step = float(np.abs(dalpha).max())
        if not np.isfinite(step):
            return Trial(angles, R, balance, count, Outcome.STALLED)
        first_step = first_step or step
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
            return Trial(angles, R, balance, count, Outcome.CONVERGED, first_step)
    localised = bool(np.any(balance.tangent <= 0.0))
    return Trial(angles, R, balance, count, Outcome.LIMIT_POINT if localised else Outcome.STALLED)


def followed(system: System, start: Start) -> Trial:
    """Newton homotopy: take the residual of ``start`` back in increments, each one a proven minimum near the last."""
    R = system.hold.reaction(start.reaction)
    begin = system.balance(start.angles, R)
    here = Trial(start.angles, R, begin, 0, Outcome.CONVERGED)
    reached, increment, steps = 0.0, 0.25, 0
    failed: Trial | None = None
    while reached < 1.0 and increment >= SMALLEST_INCREMENT and steps < PATH_STEPS:
        goal = min(1.0, reached + increment)
        trial = newton(system, Start(here.angles, here.R), fade=1.0 - goal, residual=begin, most=12)
        steps += trial.steps
        turned = float(np.abs(trial.angles - here.angles).max())
        # The first step is the tangent of the path: who ends far beyond it may have left the branch.
        near = turned < min(INCREMENT_LIMIT, 2.0 * trial.first_step + STEP_TOLERANCE)
        if trial.found and near and system.excess_negatives(trial.balance) == 0:
            here, reached, increment = trial, goal, 2.0 * increment
        else:
            failed = trial
            increment *= 0.5
    if reached >= 1.0 or failed is None:
        return here._replace(steps=steps)
    return here._replace(steps=steps, outcome=_reason(system, start, here, failed, begin, reached))


def _reason(system: System, start: Start, here: Trial, failed: Trial, begin: Balance, reached: float) -> Outcome:
    """Why a path ends at ``here``: the moment falls, the path turns back or loses its minimum, or Newton stalls."""
    if failed.outcome is Outcome.LIMIT_POINT:
        return Outcome.LIMIT_POINT
    if failed.found or system.excess_negatives(failed.balance) != 0:
        return Outcome.UNSTABLE
    # Where a smooth path turns back the state changes without bound: far faster than on the way so far.
    rate, _ = system.solve(here.balance, -begin.gradient[:, None], -begin.gap[:, None])
    usual = float(np.abs(here.angles - start.angles).max()) / reached if reached else np.inf
    return Outcome.STALLED if float(np.abs(rate).max()) < 5.0 * usual else Outcome.UNSTABLE


def judged(system: System, trial: Trial, side: int) -> Trial:
    """The trial with its outcome after the checks: falling moment, minimum, side of the bow (0: either)."""
    if not trial.found:
        return trial
    outcome = Outcome.CONVERGED
    K = trial.balance.K
    between = system.section(np.concatenate((K[:1], 0.5 * (K[1:] + K[:-1]))))[1]
    if min(float(trial.balance.tangent.min()), float(between.min())) <= 0.0:
        outcome = Outcome.LIMIT_POINT
    elif system.excess_negatives(trial.balance) != 0:
        outcome = Outcome.UNSTABLE
    elif side and side * bow(system.rod, trial.angles) < -1e-12:  # a straight cable bows to either side by rounding
        outcome = Outcome.WRONG_BRANCH
    return trial._replace(outcome=outcome)


def _faded(balance: Balance, residual: Balance | None, fade: float) -> Balance:
    if residual is None or fade == 0.0:
        return balance
    return balance._replace(gradient=balance.gradient - fade * residual.gradient, gap=balance.gap - fade * residual.gap)


def _norm(balance: Balance, moment_scale: float, length: float) -> float:
    """Largest residual, relative."""
    g, (gap_x, gap_y) = balance.gradient, balance.gap.tolist()
    return float(max(g.max() / moment_scale, -g.min() / moment_scale, abs(gap_x) / length, abs(gap_y) / length))

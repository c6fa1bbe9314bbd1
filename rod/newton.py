"""Newton's method on the reduced system: from a state near an equilibrium to the equilibrium, and a verdict on it.

`newton` is the plain method, quadratic. `descended` goes downhill in energy from a state that is no minimum to the one
where the cable comes to rest. `judged` checks what was found: falling moment, minimum, side of the bow.

Units: rad, N, m; tolerances are relative to EI and length.
"""

from __future__ import annotations

from enum import Enum
from math import isfinite
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import idamax

from rod.array import Array
from rod.reduction import Balance, System

#: Newton stops when a whole step turns no edge by more than this, rad: the error left is of the order of its square.
STEP_TOLERANCE = 1e-6
#: Largest residual accepted, relative to EI/L (moments) and L (gaps): rounding of 3200 elements stays below it.
RESIDUAL_TOLERANCE = 1e-9
#: Largest turn of an edge in one Newton step, rad.
STEP_LIMIT = 0.8
ITERATIONS = 25
#: Residual, relative as above, of a state that is none: a trial law may rise so steeply that numbers overflow next.
BEYOND_NUMBERS = 1e100
#: Largest turn of an edge in a step downhill, rad.
DESCENT_LIMIT = 0.3
#: Steps after which a path, or the way down to rest, is given up; a nearly straight bar (K0 L = 2e-8) needs 270.
PATH_STEPS = 600
#: How far beside an unstable equilibrium the way down begins or goes on, rad (root mean square).
TILT = 1e-2


class Outcome(Enum):
    """How an equilibrium ended; each member carries its advice."""

    CONVERGED = "a stable equilibrium on the branch asked for"
    LIMIT_POINT = (
        "the moment falls with curvature (dm/dK <= 0) within the visited range, so the bend localises and the shape "
        "means nothing; this usually means that f_EI is too low at high curvature or read as a secant where it is a "
        "tangent; raise the last control points or bend less"
    )
    TURNING_POINT = (
        "the equilibria from the force-free shape on end at a limit point before what was asked for, where the cable "
        "jumps; the shape is the last stable one; ask for less, control the displacement instead of the force, or ask "
        "for the branch 'jump' to see where the cable comes to rest"
    )
    BIFURCATION = (
        "the equilibria from the force-free shape on lose their stability at a bifurcation and no stable ones branch "
        "off, so the cable jumps sideways; the shape is the last stable one; ask for less, or for the branch 'jump' to "
        "see where the cable comes to rest"
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


class Start(NamedTuple):
    """A state to start from: edge angles (n + 2,) rad and right reaction (2,) N."""

    angles: Array
    reaction: Array


class Trial(NamedTuple):
    """A state, its residuals, the steps of Newton's method that led there, and how that ended.

    ``negatives``: directions in which it is unstable, if counted on the way: on the Hessian of the last step, which
    turned no edge by more than the tolerance.
    """

    angles: Array
    R: Array
    balance: Balance
    steps: int
    outcome: Outcome
    negatives: int | None = None

    @property
    def found(self) -> bool:
        """Whether the state is an equilibrium at all."""
        return self.outcome is Outcome.CONVERGED


def newton(system: System, start: Start) -> Trial:
    """Newton's method from ``start``, with steps shortened where they turn an edge too far."""
    angles, R = start.angles, system.hold.reaction(start.reaction)
    balance = system.balance(angles, R)
    norm = system.misfit(balance)
    for count in range(1, ITERATIONS + 1):
        if not norm < BEYOND_NUMBERS:
            return Trial(angles, R, balance, count, Outcome.STALLED)
        here = system.eliminated(balance, -balance.gradient[:, None], -balance.gap[:, None])
        dalpha, dR = system.solution(here)
        step = abs(float(dalpha[idamax(dalpha[:, 0]), 0]))
        if not isfinite(step):
            return Trial(angles, R, balance, count, Outcome.STALLED)
        share = min(1.0, STEP_LIMIT / step) if step else 1.0
        # Friction makes the residual piecewise linear: a step across a kink may overshoot and is then shortened.
        for _ in range(4):
            angles_new, R_new = angles + share * dalpha[:, 0], R + share * dR[:, 0]
            tried = system.balance(angles_new, R_new)
            norm_new = system.misfit(tried)
            if norm_new <= 2.0 * norm or norm_new < RESIDUAL_TOLERANCE or step > 0.1:
                break
            share *= 0.5
        angles, R, balance, norm = angles_new, R_new, tried, norm_new
        if step <= STEP_TOLERANCE and norm <= RESIDUAL_TOLERANCE:
            return Trial(angles, R, balance, count, Outcome.CONVERGED, system.negatives(here))
    return Trial(angles, R, balance, count, Outcome.STALLED)


def tilted(system: System, trial: Trial, mode: Array | None = None) -> list[Start]:
    """Where to go downhill from an unstable equilibrium: beside it along its softest mode, to either side.

    ``mode`` picks one of several that are equally soft, the one most like it.
    """
    mode = softest(system, trial.balance, mode)[1]
    return [Start(trial.angles + sign * TILT * mode, trial.R) for sign in (1.0, -1.0)]


def descended(system: System, start: Start) -> Trial:
    """Downhill in energy from ``start`` to a minimum: gradient flow in implicit steps that end as Newton's method.

    The Hessian is shifted until it is positive on all motions that the supports allow; the larger the shift, the
    shorter the step along the flow. Near a minimum no shift is needed and a step is Newton's.
    """
    angles, R = start.angles, system.hold.reaction(start.reaction)
    mass = system.moment_scale * system.mass
    shift = 1.0
    for count in range(1, PATH_STEPS + 1):
        balance = system.balance(angles, R)
        shifted = balance._replace(diagonal=balance.diagonal + shift * mass)
        here = system.eliminated(shifted, -balance.gradient[:, None], -balance.gap[:, None])
        dalpha, dR = system.solution(here)
        step = float(np.abs(dalpha).max()) if system.negatives(here) == 0 else np.inf
        if not step <= DESCENT_LIMIT:
            shift = 4.0 * max(shift, 0.1)
            continue
        angles, R = angles + dalpha[:, 0], R + dR[:, 0]
        if step <= STEP_TOLERANCE:  # at rest: at a minimum, or on a saddle, where a symmetric cable would stay for long
            if system.excess_negatives(balance) == 0:
                trial = newton(system, Start(angles, R))
                return trial._replace(steps=trial.steps + count)
            angles = angles + TILT * softest(system, balance)[1]
        shift *= 0.25
    return Trial(*start, system.balance(*start), PATH_STEPS, Outcome.STALLED)


def softest(system: System, balance: Balance, mode: Array | None = None) -> tuple[float, Array]:
    """Smallest stiffness in absolute value, relative to EI/L, and its mode (n + 2,), by inverse iteration.

    The mode has the root mean square 1 rad over the length.
    """
    mass = system.mass
    mode = np.random.default_rng(0).standard_normal(mass.size) if mode is None else mode
    stiffness = np.inf
    for _ in range(12):
        turn = system.solve(balance, (system.moment_scale * mass * mode)[:, None], np.zeros((2, 1)))[0][:, 0]
        before, stiffness = stiffness, float(mass @ (mode * mode) / (mass @ (mode * turn)))
        mode = turn / np.sqrt(mass @ (turn * turn))
        if abs(stiffness - before) <= 1e-4 * abs(stiffness):
            break
    return stiffness, np.asarray(mode)


def judged(system: System, trial: Trial, side: int) -> Trial:
    """The trial with its outcome after the checks: falling moment, minimum, side of the bow (0: either)."""
    if not trial.found:
        return trial
    outcome = Outcome.CONVERGED
    K, negatives = trial.balance.K, trial.negatives
    middle = K.copy()
    middle[1:] = 0.5 * (K[1:] + K[:-1])
    between = system.section(middle)[1]
    if min(float(trial.balance.tangent.min()), float(between.min())) <= 0.0:
        outcome = Outcome.LIMIT_POINT
    elif (system.excess_negatives(trial.balance) if negatives is None else negatives) != 0:
        outcome = Outcome.UNSTABLE
    elif side and side * system.rod.bow(trial.angles) < -1e-12:  # a straight cable bows to either side by rounding
        outcome = Outcome.WRONG_BRANCH
    return trial._replace(outcome=outcome)

"""Derivatives of equilibria: from a simulated test and a list of parameters to what changes per unit of each.

Implicit function theorem: the residuals of the reduced system (`rod.reduction`) vanish, so d(alpha, R)/dp follows from
one more solve with the matrix of Newton's last step and a right-hand side per parameter; shape, curvature and force
are explicit in (alpha, R, p). The memory of friction, plastic set and bearings depends on the parameters through all
steps before; its derivative is carried along the path. Exact to rounding (away from the kinks of friction).

EA and GA are held; by default they scale with the stiffness (`rod.discretisation.RIGIDITY`), whose derivative, below
1e-7 of the result, is left out.

Signs and units as in `rod.equilibrium`; parameters and their units in `rod.parameters`. Derivatives are taken at fixed
vertices; where vertices move along the cable (``length``, rigid pieces), ``s`` is their speed, and the derivative at
fixed arc length is ``x - s cos(theta)`` and so on.

Source: none in the paper; its Sec. 4 leaves the Jacobian of the fit to finite differences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rod.array import Array
from rod.bending_test import BendingTest
from rod.characteristic import parametric
from rod.equilibrium import Equilibrium
from rod.parameters import Directions, Parameter, directions
from rod.reduction import Balance, EdgeState, System
from rod.section import InternalFriction, Read, growth


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of one step with respect to q parameters, at its n vertices.

    Attributes
    ----------
    s, x, y : (n, q) m per unit
    theta : (n, q) rad per unit
    kappa : (n, q) 1/m per unit
    moment : (n, q) N m per unit
    force : (q,) N per unit
    chord : (q,) m per unit
    """

    s: Array
    x: Array
    y: Array
    theta: Array
    kappa: Array
    moment: Array
    force: Array
    chord: Array


class _Past(NamedTuple):
    """Derivative of the memory at the start of a step: relaxed (e, q, n), last and reached (q, n), both angles (q,).

    Of the mounted cable they are (1, q, n), (q, n) and (q, 1).
    """

    relaxed: Array
    last: Array
    reached: Array
    left: Array
    right: Array


class _Rest(NamedTuple):
    """Derivative, (q,), of the angles of the mounted cable's ends, and of the chord at displacement zero."""

    left: Array
    right: Array
    zero: Array


class _Explicit(NamedTuple):
    """Change at fixed angles and reaction.

    Moment at fixed curvature (q, n), curvature by the weights (q, n), end moments (q,) each, load beyond each edge
    (2, q, n + 1) or None, imposed position (q,), imposed force (q,).
    """

    moment: Array
    curvature: Array
    ends: tuple[Array, Array]
    load: Array | None
    position: Array
    reaction: Array


def derivatives(
    test: BendingTest, steps: Sequence[Equilibrium], parameters: Sequence[Parameter]
) -> tuple[Derivatives, ...]:
    """Derivatives of all steps of a simulated test.

    Parameters
    ----------
    test : BendingTest
    steps : (k,) of Equilibrium
        As `simulate` returned them for this test, from the first step on.
    parameters : sequence of names, or (name, basis)
        See `rod.parameters`; or ``Toward`` another test.

    Returns
    -------
    tuple of Derivatives
        One per step.

    Raises
    ------
    ValueError
        If a step is not in equilibrium, or for a parameter that does not exist.
    """
    moves = directions(test, parameters)
    rest = _mounted(test, moves)
    start = moves.pre_curvature[None], moves.pre_curvature, moves.scalar("set_threshold")[:, None]
    past = _Past(*start, rest.left, rest.right)
    if test.zero == "loaded":
        rest = rest._replace(zero=_step(test, test.free, moves, rest, past)[0].chord)
    found = []
    for number, step in enumerate(steps):
        if not step.good:
            raise ValueError(f"step {number} is no equilibrium ({step.outcome.name}); it has no derivatives")
        made, past = _step(test, step, moves, rest, past)
        found.append(made)
    return tuple(found)


# Layout: inside, parameters come first and joints or edges last, (q, n): every operation runs along contiguous memory,
# which is twice as fast. The record shows (n, q).


def _mounted(test: BendingTest, moves: Directions) -> _Rest:
    """Derivative of the force-free shape in its chord frame; as if it were without load."""
    rod, h = test.rod, test.rod.edges
    cos, sin = np.cos(rod.mounted.angles), np.sin(rod.mounted.angles)
    turn = rod.weights * moves.pre_curvature
    if moves.geometric:
        turn += moves.weights * rod.section.pre_curvature

    def moved(reach: Array, by_length: Array) -> Array:
        """Of the right end: each joint turns all edges beyond it."""
        by_turn = turn @ reach[:0:-1].cumsum()[::-1]
        return np.asarray(by_turn + moves.edges @ by_length if moves.geometric else by_turn)

    zero = moves.scalar("length") if test.zero == "length" else moves.none
    if test.zero == "natural":
        zero = moved(h * sin, cos)
    held = any(end.kind == "clamp" or not end.turns_freely for end in (rod.left, rod.right))
    if not held and test.friction_by_step is None:
        return _Rest(moves.none, moves.none, zero)
    left = moved(-h * cos, sin) / -rod.mounted.chord  # the chord frame turns with the right end
    return _Rest(left, left - turn.sum(axis=1), zero)


def _step(
    test: BendingTest, step: Equilibrium, moves: Directions, rest: _Rest, past: _Past
) -> tuple[Derivatives, _Past]:
    """Derivatives of one step, and of the memory after it."""
    rod, system, balance = step.rod, step.system, step.balance
    edge, border = balance.edge, system.border(balance.edge)
    given = _explicit(test, step, balance, moves, rest, past)
    gradient, gap, extent = _residuals(system, step, balance, edge, given, moves)
    _clamps(system, balance, border, gradient, gap, moves, rest)
    solved, dR = system.solve(balance, -gradient.T, -gap)
    dangles = solved.T
    dR[0] += given.reaction
    dK = (dangles[:, :-1] - dangles[:, 1:]) * rod.inverse_weights + given.curvature
    extent -= border[:, None, :] * dangles
    extent += system.softened(edge, dR[:, :, None])
    moment = balance.tangent * dK + given.moment
    x, y, theta, kappa, moment = rod.at_vertices(extent, dangles, dK, moment).transpose(0, 2, 1)
    made = Derivatives(moves.vertices[:, rod.shown].T, x, y, theta, kappa, moment, -dR[0], x[-1])
    return made, _advanced(step, balance, moves, past, dangles, dK)


def _explicit(
    test: BendingTest, step: Equilibrium, balance: Balance, moves: Directions, rest: _Rest, past: _Past
) -> _Explicit:
    """Everything that changes at fixed angles and reaction."""
    rod, hold = step.rod, step.hold
    position = moves.scalar("chord") if hold.chord is not None else moves.none
    if hold.from_zero:
        *_, compliance, stiffening = hold.yielded(float(step.right_reaction[0]))
        yields = compliance * moves.scalar("rig_compliance") + stiffening * moves.scalar("rig_stiffening")
        position = position + rest.zero - moves.scalar("displacement_offset") - yields
    reaction = -moves.scalar("force") if hold.force is not None else moves.none
    load = None
    if rod.vertex_load is not None or moves.has("load_x", "load_y") or moves.forces_by_step:
        load = _load_beyond(step, moves)
    curvature = np.zeros_like(moves.pre_curvature)
    if moves.geometric:
        curvature = -balance.K * rod.inverse_weights * moves.weights
    ends = (
        _end_moment(step, moves, rest.left, past.left, side="left"),
        _end_moment(step, moves, rest.right, past.right, side="right"),
    )
    return _Explicit(_moment(step, balance.K, moves, past), curvature, ends, load, position, reaction)


def _load_beyond(step: Equilibrium, moves: Directions) -> Array:
    """Change of the dead load to the right of each edge, (2, q, n + 1) N."""
    change = np.multiply.outer((moves.scalar("load_x"), moves.scalar("load_y")), step.rod.length_beyond)
    if moves.forces_by_step:
        forces = moves.given(moves.forces_by_step, step.before.step)[:, ::-1].cumsum(axis=1)[:, ::-1]
        change[:, :, :-1] += forces.transpose(2, 0, 1)
    if any(step.rod.load) and moves.geometric:
        after = np.cumsum(moves.edges[:, ::-1], axis=1)[:, ::-1] - moves.edges
        change += np.multiply.outer(step.rod.load, 0.5 * moves.edges + after)
    return np.asarray(change)


def _moment(step: Equilibrium, K: Array, moves: Directions, past: _Past) -> Array:
    """Change of the moment at fixed curvature, (q, n)."""
    section, memory = step.rod.section, step.before
    law, K0, move = section.law, section.rest, moves.pre_curvature
    reads: tuple[Read, ...] = (Read(1.0, K),)
    set_move = moves.none[:, None]
    if section.sets or moves.has("plastic_set"):
        K0 = section.pre_curvature
        excess = np.maximum(memory.reached, K - K0) - section.set_threshold
        grown = np.where(np.greater(K - K0, memory.reached), -move, past.reached)
        grown = grown - moves.scalar("set_threshold")[:, None]
        g, by_excess, by_saturation = growth(excess, section.set_saturation)
        grown = by_excess * grown + by_saturation * moves.scalar("set_saturation")[:, None]
        set_move = section.plastic_rate * grown + moves.scalar("plastic_set")[:, None] * g
        if moves.grown:
            set_move = set_move + moves.given(moves.grown, memory.step)
        reads = section.read(K, section.set_at(K, memory))
    parts = []
    for read in reads:
        by_read = law.moment_by_pre_curvature(read.at, K0) * move
        if read.by_set:
            by_read = by_read + law.tangent(read.at, K0) * (read.by_set * set_move + read.by_rest * move)
        if moves.ordinates.any() and parametric(law):
            by_read = by_read + moves.ordinates @ law.moment_by_parameters(read.at, K0).T
        for column, before, after, by in moves.laws:
            by_read[column] += (after.moment(read.at, K0) - before.moment(read.at, K0)) / by
        if section.profile is not None:
            by_read = section.profile * by_read
        if moves.profile.any():
            by_read = by_read + law.moment(read.at, K0) * moves.profile
        parts.append(by_read if read.share == 1.0 else read.share * by_read)
    if section.friction is not None:
        parts.append(_friction_moment(section.friction, K, step, moves, past))
    return sum(parts[1:], parts[0])


def _friction_moment(friction: InternalFriction, K: Array, step: Equilibrium, moves: Directions, past: _Past) -> Array:
    """Change of the moment of the friction elements at fixed curvature, (q, n)."""
    share = _share_by_memory(friction, K, step, moves, past)
    stiffness = (friction.slip / friction.stick)[:, :, None]
    return np.asarray(moves.slip @ friction.share(K, step.before)[0] + (stiffness * share).sum(axis=0))


def _share_by_memory(friction: InternalFriction, K: Array, step: Equilibrium, moves: Directions, past: _Past) -> Array:
    """Change of what the elements carry at fixed curvature, of their slip moment and times c_e, (e, q, n) 1/m."""
    by_relaxed, by_last, by_stick = (by[:, None, :] for by in friction.by_memory(K, step.before))
    return np.asarray(by_relaxed * past.relaxed + by_last * past.last + by_stick * moves.stick.T[:, :, None])


def _end_moment(step: Equilibrium, moves: Directions, rest: Array, slip: Array, *, side: str) -> Array:
    """Change of the moment against turning at one end, at fixed angle, (q,)."""
    left = side == "left"
    support = step.rod.left if left else step.rod.right
    angle = float(step.angles[0 if left else -1])
    at_rest = step.rod.rest_angles[0 if left else 1]
    u = (angle - (step.before.left_angle if left else step.before.right_angle)) / support.stick_angle
    number = 0 if left else 1
    moment = moves.scalar(f"end_moment_{side}") + moves.given(moves.moments_by_step, step.before.step, number)
    moment = moment * (-1.0 if left else 1.0)
    _, slope, by_stiffness, by_hardening = support.spring(angle - at_rest)
    moment = moment + moves.scalar(f"bearing_stiffness_{side}") * by_stiffness
    moment = moment + moves.scalar(f"bearing_hardening_{side}") * by_hardening
    friction = moves.scalar(f"bearing_friction_{side}") + moves.given(moves.friction_by_step, step.before.step, number)
    moment = moment + friction * min(1.0, max(-1.0, u))
    if slope:
        rest = moves.scalar(f"clamp_angle_{side}") if support.angle is not None else rest
        moment = moment - slope * rest
    if support.friction_moment and -1.0 < u < 1.0:
        slow = slip + u * moves.scalar(f"stick_angle_{side}")
        moment = moment - support.friction_moment / support.stick_angle * slow
    return np.asarray(moment)


def _residuals(
    system: System, step: Equilibrium, balance: Balance, edge: EdgeState, given: _Explicit, moves: Directions
) -> tuple[Array, Array, Array]:
    """Change of gradient (q, n + 1), gap (2, q) and extent of the edges (2, q, n + 1), angles and reaction fixed."""
    moment = balance.tangent * given.curvature + given.moment
    gradient = -system.turning(edge)[1] * moves.edges
    gradient[:, :-1] += moment
    gradient[:, 1:] -= moment
    gradient[:, 0] += given.ends[0]
    gradient[:, -1] += given.ends[1]
    extent = system.directions(edge)[:, None, :] * moves.edges
    if given.load is not None:
        gradient += balance.border[0] * given.load[0] + balance.border[1] * given.load[1]
        extent += system.softened(edge, given.load)
    gap = -(extent @ np.ones(extent.shape[2]))  # a third of the time of a sum
    gap[0] += given.position
    if step.hold.force is not None:
        gradient += given.reaction[:, None] * balance.border[0]
        gap -= balance.softness[:, :1] * given.reaction
    return gradient, gap, extent


def _clamps(
    system: System, balance: Balance, border: Array, gradient: Array, gap: Array, moves: Directions, rest: _Rest
) -> None:
    """A clamped angle follows its clamp; what that does to the neighbour and to the gap is explicit."""
    rod = system.rod
    sides = ((0, 1, rod.left, rest.left, "clamp_angle_left"), (-1, -2, rod.right, rest.right, "clamp_angle_right"))
    for end, near, support, mounted, name in sides:
        if support.kind == "clamp":
            angle = mounted if support.angle is None else moves.scalar(name)
            gradient[:, end] = -system.moment_scale * angle
            gradient[:, near] -= balance.tangent[end] / rod.weights[end] * angle
            gap += border[:, end][:, None] * angle


def _advanced(step: Equilibrium, balance: Balance, moves: Directions, past: _Past, dangles: Array, dK: Array) -> _Past:
    """Derivative of the memory after the step, of those parts of it that steps to come depend on."""
    section, memory, K = step.rod.section, step.before, balance.K
    reached = past.reached
    if section.plastic_rate:
        virgin = np.greater(K - section.pre_curvature, memory.reached)
        reached = np.where(virgin, dK - moves.pre_curvature, past.reached)
    relaxed = past.relaxed
    if (friction := section.friction) is not None:
        q, by_K = (value[:, None, :] for value in friction.share(K, memory))
        carried = by_K * dK + _share_by_memory(friction, K, step, moves, past)
        relaxed = dK - q * moves.stick.T[:, :, None] - carried
    slips = []
    for end, support, slip, before, side in (
        (0, step.rod.left, memory.left_angle, past.left, "left"),
        (-1, step.rod.right, memory.right_angle, past.right, "right"),
    ):
        turned = float(step.angles[end]) - slip
        if support.friction_moment and abs(turned) >= support.stick_angle:
            before = dangles[:, end] - np.sign(turned) * moves.scalar(f"stick_angle_{side}")
        slips.append(before)
    return _Past(relaxed, dK, reached, *slips)

"""Derivatives of equilibria: from a simulated test and a list of parameters to what changes per unit of each.

Implicit function theorem: the residuals of the reduced system (`rod.reduction`) vanish, so d(alpha, R)/dp follows from
one more solve with the matrix of Newton's last step and a right-hand side per parameter; shape, curvature and force
are explicit in (alpha, R, p). The memory of friction, plastic set and bearings depends on the parameters through all
steps before; its derivative is carried along the path. Exact to rounding (away from the kinks of friction).

The default EA and GA scale with the stiffness (`rod.discretisation.RIGIDITY`); their derivative, below 1e-7 of the
result, is left out.

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

from rod.bending_test import BendingTest
from rod.characteristic import Array, Characteristic
from rod.equilibrium import Equilibrium
from rod.parameters import Directions, Parameter, directions
from rod.reduction import Balance, EdgeState, System


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of one step with respect to q parameters, at its n vertices.

    Attributes
    ----------
    names : (q,)
    s, x, y : (n, q) m per unit
    theta : (n, q) rad per unit
    kappa : (n, q) 1/m per unit
    moment : (n, q) N m per unit
    force : (q,) N per unit
    chord : (q,) m per unit
    """

    names: tuple[str, ...]
    s: Array
    x: Array
    y: Array
    theta: Array
    kappa: Array
    moment: Array
    force: Array
    chord: Array


class _Past(NamedTuple):
    """Derivative of the memory at the start of a step: relaxed (e, n, q), reached (n, q), left and right angle (q,)."""

    relaxed: Array
    reached: Array
    left: Array
    right: Array


class _Rest(NamedTuple):
    """Derivative of the mounted shape: edge angles (n + 1, q) and chord (q,)."""

    angles: Array
    chord: Array


class _Explicit(NamedTuple):
    """Change at fixed angles and reaction.

    Moment at fixed curvature (n, q), weights (n, q), end moments (q,) each, load beyond each edge (2, n + 1, q) or
    None, imposed position (q,), imposed force (q,).
    """

    moment: Array
    weights: Array
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
        See `rod.parameters`.

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
    elements = 0 if test.friction is None else test.friction.stick.size
    past = _Past(
        np.repeat(moves.pre_curvature[None], elements, axis=0),
        np.zeros_like(moves.pre_curvature),
        rest.angles[0],
        rest.angles[-1],
    )
    found = []
    for number, step in enumerate(steps):
        if not step.good:
            raise ValueError(f"step {number} is no equilibrium ({step.outcome.name}); it has no derivatives")
        made, past = _step(test, step, moves, rest, past)
        found.append(made)
    return tuple(found)


def _mounted(test: BendingTest, moves: Directions) -> _Rest:
    """Derivative of the force-free shape in its chord frame."""
    rod = test.rod
    angles, h = rod.mounted.angles[:, None], rod.edges[:, None]
    turn = rod.weights[:, None] * moves.pre_curvature + _weights(moves) * rod.section.pre_curvature[:, None]
    relative = -np.concatenate((np.zeros((1, turn.shape[1])), np.cumsum(turn, axis=0)))
    along = (moves.edges * np.cos(angles) - h * np.sin(angles) * relative).sum(axis=0)
    across = (moves.edges * np.sin(angles) + h * np.cos(angles) * relative).sum(axis=0)
    return _Rest(relative - across / rod.mounted.chord, along)


def _weights(moves: Directions) -> Array:
    """Change of the joint weights with the edges, (n, q)."""
    inner = moves.edges[1:-1]
    none = np.zeros((1, inner.shape[1]))
    return 0.5 * (np.concatenate((none, inner)) + np.concatenate((inner, none)))


def _step(
    test: BendingTest, step: Equilibrium, moves: Directions, rest: _Rest, past: _Past
) -> tuple[Derivatives, _Past]:
    """Derivatives of one step, and of the memory after it."""
    rod, R = step.rod, step.right_reaction
    system = System(rod, step.hold, step.before)
    balance = system.balance(step.angles, R)
    edge = system.edge_state(step.angles, R)
    given = _explicit(test, step, balance, moves, rest, past)
    stretched = -balance.K[:, None] * given.weights / rod.weights[:, None]
    gradient, gap, extent = _residuals(system, step, balance, edge, given, moves, stretched)
    _clamps(system, balance, edge, gradient, gap, moves, rest)
    dangles, dR = system.solve(balance, -gradient, -gap)
    dR[0] += given.reaction
    dK = (dangles[:-1] - dangles[1:]) / rod.weights[:, None] + stretched
    extent -= system.border(edge)[:, :, None] * dangles
    extent += system.softened(edge, dR[:, None, :])
    path = np.cumsum(extent, axis=1)
    made = _derivatives(step, moves, dangles, dK, balance.tangent[:, None] * dK + given.moment, path, dR)
    return made, _advanced(test, step, balance, moves, past, dangles, dK)


def _explicit(
    test: BendingTest, step: Equilibrium, balance: Balance, moves: Directions, rest: _Rest, past: _Past
) -> _Explicit:
    """Everything that changes at fixed angles and reaction."""
    rod, hold = step.rod, step.hold
    position = moves.scalar("chord").copy() if hold.chord is not None else moves.scalar("none")
    if hold.from_zero:
        position = position - moves.scalar("displacement_offset")
        if test.zero == "natural":
            position = position + rest.chord
        elif test.zero == "length":
            position = position + moves.scalar("length")
        position = position - moves.scalar("rig_compliance") * step.right_reaction[0]
    reaction = -moves.scalar("force") if hold.force is not None else moves.scalar("none")
    load = None
    if rod.vertex_load is not None or moves.has("load_x", "load_y"):
        load = np.stack([_load_beyond(step, moves, axis) for axis in (0, 1)])
    moment = _moment(test, step, balance.K, moves, past)
    ends = (
        _end_moment(step, moves, rest.angles[0], past.left, side="left"),
        _end_moment(step, moves, rest.angles[-1], past.right, side="right"),
    )
    return _Explicit(moment, _weights(moves), ends, load, position, reaction)


def _load_beyond(step: Equilibrium, moves: Directions, axis: int) -> Array:
    """Change of the dead load to the right of each edge, one component, (n + 1, q) N."""
    h, load = step.rod.edges, step.rod.load[axis]
    share = 0.5 * h + (step.rod.length - np.cumsum(h))
    change = share[:, None] * moves.scalar("load_y" if axis else "load_x")
    if load and np.any(moves.edges):
        after = np.cumsum(moves.edges[::-1], axis=0)[::-1] - moves.edges
        change += load * (0.5 * moves.edges + after)
    return change


def _moment(test: BendingTest, step: Equilibrium, K: Array, moves: Directions, past: _Past) -> Array:
    """Change of the moment at fixed curvature, (n, q)."""
    section, memory = step.rod.section, step.before
    law, rest, move = section.law, section.rest(), moves.pre_curvature
    if section.plastic_rate or moves.has("plastic_set"):
        K0 = section.pre_curvature
        excess = np.maximum(memory.reached, K - K0)
        grown = np.where(np.greater(K - K0, memory.reached)[:, None], -move, past.reached)
        rest = K0 + section.plastic_rate * excess
        move = move + section.plastic_rate * grown + excess[:, None] * moves.scalar("plastic_set")
    moment = np.broadcast_to(law.moment_by_pre_curvature(K, rest), K.shape)[:, None] * move
    if isinstance(law, Characteristic) and np.any(moves.ordinates):
        moment += law.moment_by_ordinates(K, rest) @ moves.ordinates
    if section.profile is not None:
        moment *= section.profile[:, None]
    if np.any(moves.profile):
        moment += law.moment(K, rest)[:, None] * moves.profile
    friction = section.friction
    if friction is not None:
        stick = friction.stick
        u = (K - memory.relaxed) / stick
        sticking = (np.abs(u) < 1.0)[:, :, None]
        slow = past.relaxed / stick[:, :, None]
        slow = slow + (friction.own * u)[:, :, None] * (moves.scalar("stick_curvature") / friction.stick_curvature)
        moment = moment - (friction.slip[:, :, None] * np.where(sticking, slow, 0.0)).sum(axis=0)
        built = (friction.own * np.clip(u, -1.0, 1.0)).sum(axis=0) / friction.elements
        moment = moment + built[:, None] * moves.scalar("hysteresis")
    return np.asarray(moment)


def _end_moment(step: Equilibrium, moves: Directions, rest: Array, slip: Array, *, side: str) -> Array:
    """Change of the moment against turning at one end, at fixed angle, (q,)."""
    left = side == "left"
    support = step.rod.left if left else step.rod.right
    angle = float(step.angles[0 if left else -1])
    at_rest = step.rod.rest_angles[0 if left else 1]
    u = (angle - (step.before.left_angle if left else step.before.right_angle)) / support.stick_angle
    rest = moves.scalar(f"clamp_angle_{side}") if support.angle is not None else rest
    moment = moves.scalar(f"bearing_stiffness_{side}") * (angle - at_rest) - support.stiffness * rest
    moment = moment + moves.scalar(f"bearing_friction_{side}") * min(1.0, max(-1.0, u))
    if -1.0 < u < 1.0:
        moment = moment - support.friction_moment / support.stick_angle * slip
    return np.asarray(moment + moves.scalar(f"end_moment_{side}") * (-1.0 if left else 1.0))


def _residuals(
    system: System,
    step: Equilibrium,
    balance: Balance,
    edge: EdgeState,
    given: _Explicit,
    moves: Directions,
    stretched: Array,
) -> tuple[Array, Array, Array]:
    """Change of gradient (n + 1, q), gap (2, q) and extent of the edges (2, n + 1, q), angles and reaction fixed."""
    extent = system.directions(edge)[:, :, None] * moves.edges
    moment = balance.tangent[:, None] * stretched + given.moment
    gradient = -system.turning(edge)[:, None] * moves.edges
    gradient[:-1] += moment
    gradient[1:] -= moment
    gradient[0] += given.ends[0]
    gradient[-1] += given.ends[1]
    if given.load is not None:
        gradient += (balance.border[:, :, None] * given.load).sum(axis=0)
        extent += system.softened(edge, given.load)
    if moves.has("axial_flexibility", "shear_flexibility"):
        axial, shear = moves.scalar("axial_flexibility"), moves.scalar("shear_flexibility")
        along, across = (step.rod.edges * edge.along)[:, None] * axial, (step.rod.edges * edge.across)[:, None] * shear
        cos, sin = edge.cos[:, None], edge.sin[:, None]
        gradient -= edge.across[:, None] * along - edge.along[:, None] * across
        extent += np.stack((cos * along - sin * across, sin * along + cos * across))
    gap = -extent.sum(axis=1)
    gap[0] += given.position
    if step.hold.force is not None:
        gradient += balance.border[0][:, None] * given.reaction
        gap -= balance.softness[:, :1] * given.reaction
    return gradient, gap, extent


def _clamps(
    system: System,
    balance: Balance,
    edge: EdgeState,
    gradient: Array,
    gap: Array,
    moves: Directions,
    rest: _Rest,
) -> None:
    """A clamped angle follows its clamp; what that does to the neighbour and to the gap is explicit."""
    rod = system.rod
    for end, near, support, name in ((0, 1, rod.left, "clamp_angle_left"), (-1, -2, rod.right, "clamp_angle_right")):
        if support.kind == "clamp":
            angle = rest.angles[end] if support.angle is None else moves.scalar(name)
            gradient[end] = -system.moment_scale * angle
            gradient[near] -= balance.tangent[end] / rod.weights[end] * angle
            gap += system.border(edge)[:, end][:, None] * angle


def _derivatives(
    step: Equilibrium, moves: Directions, dangles: Array, dK: Array, dm: Array, path: Array, dR: Array
) -> Derivatives:
    """The record at the vertices that the equilibrium shows."""
    h = step.rod.edges
    inner = h[1:-1, None]
    theta = np.concatenate((dangles[:1], dangles[:1], dangles[1:-2], dangles[-1:], dangles[-1:]))
    theta[2:-2] = (dangles[1:-2] * inner[1:] + dangles[2:-1] * inner[:-1]) / (inner[:-1] + inner[1:])
    none = np.zeros((1, len(moves.names)))
    keep = slice(0 if h[0] else 1, h.size + 1 if h[-1] else h.size)
    return Derivatives(
        names=moves.names,
        s=np.concatenate((none, np.cumsum(moves.edges, axis=0)))[keep],
        x=np.concatenate((none, path[0]))[keep],
        y=np.concatenate((none, path[1]))[keep],
        theta=theta[keep],
        kappa=np.concatenate((none, dK, none))[keep],
        moment=np.concatenate((dm[:1], dm, dm[-1:]))[keep],
        force=-dR[0],
        chord=path[0, -1],
    )


def _advanced(
    test: BendingTest, step: Equilibrium, balance: Balance, moves: Directions, past: _Past, dangles: Array, dK: Array
) -> _Past:
    """Derivative of the memory after the step."""
    section, memory, K = step.rod.section, step.before, balance.K
    reached = past.reached
    if section.plastic_rate or moves.has("plastic_set"):
        virgin = (K - section.pre_curvature > memory.reached)[:, None]
        reached = np.where(virgin, dK - moves.pre_curvature, past.reached)
    relaxed = past.relaxed
    if section.friction is not None:
        stick = section.friction.stick
        u = ((K - memory.relaxed) / stick)[:, :, None]
        growth = section.friction.own * stick / section.friction.stick_curvature
        slid = growth[:, :, None] * moves.scalar("stick_curvature")
        relaxed = np.where(np.abs(u) < 1.0, past.relaxed, dK[None] - np.sign(u) * slid)
    ends = []
    for end, support, slip, move in (
        (0, step.rod.left, memory.left_angle, past.left),
        (-1, step.rod.right, memory.right_angle, past.right),
    ):
        sticking = abs(float(step.angles[end]) - slip) < support.stick_angle
        ends.append(move if sticking else dangles[end])
    return _Past(relaxed, reached, ends[0], ends[1])

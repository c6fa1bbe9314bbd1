"""Equilibrium of the discrete rod: from rod and imposed end to the shape of least energy, its reactions and an outcome.

Newton's method on the reduced system of `rod.reduction` from a warm start, with proof of the minimum by inertia;
otherwise along the path of equilibria from the force-free shape (`rod.path`). Which side the cable bows to is chosen by
``branch``: ``natural`` is the side on which it comes from the force-free shape (a straight cable that buckles: up),
``opposite`` the other one, ``up`` (toward +y) and ``down`` are absolute. ``jump`` is natural too, and goes on where the
equilibria from the force-free shape on end: to where the cable comes to rest. A fit whose K0 may change sign wants
``up``, the side the photo shows.

The result says in `Outcome` how far to trust it. Nothing raises for a shape that does not exist: that is nature's
refusal and a value.

Signs and units: chord frame, m, rad, 1/m, N; P positive in compression; K = -dtheta/ds positive toward +y.

Source: Secs. 2.1 and 2.2 of the paper ("equilibria are minima of Eq. (4) under the given boundary positions").
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import isclose
from typing import Literal, get_args

import numpy as np

from rod.array import Array
from rod.discretisation import Rod
from rod.newton import PATH_STEPS, STEP_LIMIT, Outcome, Start, Trial, descended, judged, newton, tilted
from rod.path import followed
from rod.reduction import Balance, Hold, System
from rod.section import Memory, Section

__all__ = ["Branch", "Equilibrium", "Outcome", "solve"]

Branch = Literal["natural", "opposite", "up", "down", "jump"]

BRANCHES = get_args(Branch)

#: Newton steps on a path that is not followed patiently: enough for one that leads to a chord at once.
HASTY = 30


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
    system : System
        Of the rod, what was imposed and the memory before; with their ``balance`` at this state.
    after : Memory
        Memory after the step.
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
    system: System
    balance: Balance
    after: Memory
    iterations: int

    def __repr__(self) -> str:
        return f"<Equilibrium {self.outcome.name}: force {self.force:.6g} N, chord {self.chord:.6g} m>"

    @property
    def rod(self) -> Rod:
        """The discrete rod."""
        return self.system.rod

    @property
    def hold(self) -> Hold:
        """What was imposed."""
        return self.system.hold

    @property
    def before(self) -> Memory:
        """Memory at the start of the step."""
        return self.system.memory

    @property
    def good(self) -> bool:
        """Whether the outcome is CONVERGED."""
        return self.outcome is Outcome.CONVERGED


def solve(
    rod: Rod,
    hold: Hold,
    *,
    memory: Memory | None = None,
    start: Equilibrium | None = None,
    branch: Branch = "natural",
    patient: bool = True,
) -> Equilibrium:
    """Equilibrium of ``rod`` under ``hold``.

    Parameters
    ----------
    rod : Rod
    hold : Hold
        Chord, force along the chord, or free end with tip force.
    memory : Memory or None
        At the start of the step; None for the mounted cable.
    start : Equilibrium or None
        Warm start, of the same number of elements; None to come from the force-free shape. It saves time and chooses no
        shape, but for the branch ``jump``: where it may lead to one of more energy, that path is followed, so that no
        CONVERGED result of a start has more energy than the one without (tests try random stable shapes as starts).
    branch : {"natural", "opposite", "up", "down", "jump"}
        Side of the bow, see the module.
    patient : bool
        Else the shape that a start leads to is taken, as trials beside a known equilibrium may, and no path is followed
        to its end where a cable lacks one, which costs fifty equilibria.

    Raises
    ------
    ValueError
        For another branch, or a start with another number of elements.
    """
    if branch not in BRANCHES:
        raise ValueError(f"branch {branch!r}: one of {', '.join(BRANCHES)}")
    if start is not None and start.angles.shape != rod.edges.shape:
        raise ValueError(f"the start has {start.angles.size - 2} elements and the rod {rod.elements.size}")
    system = System(rod, hold, rod.virgin if memory is None else memory)
    if not _admissible(rod, hold):
        angles, R = rod.mounted.angles, hold.reaction(np.zeros(2))
        return _record(system, Trial(angles, R, system.balance(angles, R), 0, Outcome.UNREACHABLE), 0)
    first = None if start is None else Start(start.angles, start.right_reaction)
    verdicts: list[Trial] = []
    for attempt in _attempts(system, first, branch, patient=patient):
        verdicts.append(attempt)
        if attempt.found:
            break
    falling = [trial for trial in verdicts if trial.outcome is Outcome.LIMIT_POINT]
    last = verdicts[-1] if verdicts[-1].found or not falling else falling[-1]
    return _record(system, last, sum(trial.steps for trial in verdicts))


def _attempts(system: System, first: Start | None, branch: Branch, *, patient: bool) -> Iterator[Trial]:
    """Ways to the equilibrium: the path from the force-free shape and the warm start, the path from that, others."""
    rod, most = system.rod, PATH_STEPS if patient else HASTY
    side = bow_side(rod, branch)
    # A cable that has jumped keeps the side it came to.
    kept = side if side or first is None else int(np.sign(rod.bow(first.angles)))
    trusted = branch == "jump" or not patient or _leads(rod, side)
    warm = None if first is None else _near(system, first)
    if warm and _wound(system, warm, swung=branch != "jump"):
        first = warm = None
    if warm and trusted:
        yield judged(system, warm, kept)
    lost = judged(system, followed(system, side=side or 1, most=most), side if branch != "natural" else 0)
    yield lost
    if branch == "natural" and lost.outcome in (Outcome.TURNING_POINT, Outcome.BIFURCATION):
        return
    if warm and not trusted:
        yield judged(system, warm, kept)
    if lost.outcome is Outcome.LIMIT_POINT:
        # A joint on the falling part of its law, the end joint at rest say, tips over to a rising part if there is.
        if patient and warm and warm.found and warm.negatives:
            for beside in tilted(system, warm, rod.length_beyond - 0.5 * rod.length):
                yield judged(system, descended(system, beside), kept)
        return
    if not patient:
        return
    if first is not None:
        continued = followed(system, first, side=side or 1)
        if not _wound(system, continued):
            yield judged(system, continued, kept)
    if branch != "natural":
        yield from _elsewhere(system, lost, side)


def _elsewhere(system: System, lost: Trial, side: int) -> Iterator[Trial]:
    """Equilibria to which no path leads: on the side of a straight cable, and where the lost one comes to rest."""
    if side:
        yield judged(system, _from_straight(system, side), side)
    for beside in tilted(system, lost):
        yield judged(system, descended(system, beside), side)


def bow_side(rod: Rod, branch: Branch) -> int:
    """Side asked for: +1 up, -1 down, 0 if only following the path from the force-free shape can tell."""
    if branch in ("up", "down"):
        return 1 if branch == "up" else -1
    side, certain = rod.leaning
    if branch == "opposite":
        return -side
    return side if certain and branch != "jump" else 0


def _leads(rod: Rod, side: int) -> bool:
    """Whether a start on this side of a cable is where the path from its force-free shape leads, and saves the path.

    On the other side, in a coil, and where the path alone can tell the side (0), there are stable shapes of far more
    energy than the one its force-free shape leads to, and a start may be such.
    """
    leaning, certain = rod.leaning
    coiled = abs(float(rod.mounted.angles[0] - rod.mounted.angles[-1])) >= np.pi
    return side != 0 and not coiled and not (certain and side == -leaning)


def _near(system: System, first: Start) -> Trial:
    """Newton's method from a start, if it ends as near as one step may lead: farther off is perhaps another branch."""
    warm = newton(system, first)
    return warm if np.abs(warm.angles - first.angles).max() <= STEP_LIMIT else warm._replace(outcome=Outcome.STALLED)


def _wound(system: System, trial: Trial, *, swung: bool = True) -> bool:
    """Whether a start led to a cable that is wound up, or (``swung``) has swung round to the other side.

    Wound up, an edge has turned by more than half a turn from the force-free shape: in a loop, or against the spring of
    a bearing, it holds far more energy. Under a force a cable swings round where its ends meet, and comes to rest at
    another energy. Where the path from the force-free shape does lead that far it costs a little more and ends at
    the same.
    """
    if not trial.found:
        return False
    turned = np.abs(trial.angles - system.rod.mounted.angles).max()
    return bool(turned > np.pi or (swung and system.rod.edges @ trial.balance.edge.direction[1] <= 0.0))


def _from_straight(system: System, side: int) -> Trial:
    """The path from a straight cable without load that bows to the side asked for: its bend and loads fade in."""
    rod, hold = system.rod, system.hold
    section = Section(rod.section.law, np.zeros_like(rod.section.pre_curvature), rod.section.profile)
    straight = replace(rod, section=section, load=(0.0, 0.0))
    bowed = followed(System(straight, replace(hold, from_zero=False), straight.virgin), side=side)
    trial = followed(system, Start(bowed.angles, bowed.R), side=side)
    return trial._replace(steps=trial.steps + bowed.steps)


def _admissible(rod: Rod, hold: Hold) -> bool:
    """Whether the chord asked for can exist: positive, and not beyond the length of a cable that hardly stretches."""
    if hold.chord is None or hold.compliance:
        return True
    mounted = isclose(hold.chord, rod.mounted.chord, rel_tol=1e-12)
    return hold.chord > 0.0 and (hold.chord < rod.length or mounted or rod.axial_stiffness is not None)


def _record(system: System, trial: Trial, steps: int) -> Equilibrium:
    """The equilibrium with its shape at the vertices."""
    rod, angles, R, balance = system.rod, trial.angles, trial.R, trial.balance
    extent = rod.edges * system.directions(balance.edge)
    x, y, theta, kappa, moment = rod.at_vertices(extent, angles, balance.K, balance.m)
    load = rod.vertex_load
    return Equilibrium(
        s=rod.arc_lengths[rod.shown],
        x=x,
        y=y,
        theta=theta,
        kappa=kappa,
        moment=moment,
        force=-float(R[0]),
        chord=float(x[-1]),
        outcome=trial.outcome,
        right_reaction=R,
        left_reaction=-R if load is None else -R - load.sum(axis=0),
        angles=angles,
        system=system,
        balance=balance,
        after=rod.advanced(angles, balance.K, system.memory),
        iterations=steps,
    )

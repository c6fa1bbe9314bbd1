"""Running a model: from cable, rig and observers to a prediction, and to how it moves with the base parameters.

The mounted cable lies as it was made, or as its photo shows it where a wrong zero presses it; every other step is bowed
to the side the photos show (``up``), also where a fit tries a pre-curvature of the other sign. Derivatives with respect
to control points, K0 and length come from `rod.sensitivity`; they are carried through the observers by a short
difference, which costs no simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rod.array import Array
from rod.equilibrium import Branch, Equilibrium, solve
from rod.inverse.prediction import Facts, Model, Prediction
from rod.newton import Outcome
from rod.parameters import Parameter
from rod.sensitivity import Derivatives, derivatives


@dataclass(frozen=True, eq=False)
class Run:
    """A model that was run.

    Attributes
    ----------
    model : Model
    steps : tuple of Equilibrium
        Of all steps; the failed one alone where there is one.
    bare : Prediction or None
        Before any observer; None if a step has no equilibrium.
    prediction : Prediction or None
        As observed.
    failed : Outcome or None
        Of the first step that has no equilibrium.
    """

    model: Model
    steps: tuple[Equilibrium, ...]
    bare: Prediction | None
    prediction: Prediction | None
    failed: Outcome | None = None


def run(model: Model, facts: Facts, *, near: Run | None = None, patient: bool = True) -> Run:
    """Simulate all steps and observe them.

    Parameters
    ----------
    model : Model
    facts : Facts
    near : Run or None
        A run of a similar model: warm start, and no new simulation at all where only the observers differ.
    patient : bool
        Whether an equilibrium that is not found near those of ``near`` is sought along paths, see `rod.equilibrium`.
    """
    if near is not None and near.model.bending is model.bending and near.model.shift is model.shift:
        steps, bare = near.steps, near.bare
    else:
        steps, bare = _simulated(model, facts, near, patient=patient), None
    failed = next((step for step in steps if not step.good), None)
    if failed is not None:
        return Run(model, steps, None, None, failed.outcome)
    bare = bare or _bare(steps, facts)
    return Run(model, steps, bare, observed(bare, model, facts))


def observed(bare: Prediction, model: Model, facts: Facts) -> Prediction:
    """The prediction as load cell and camera show it, in the chord frame of what is taken for the axes."""
    for observer in model.observers:
        bare = observer(bare, facts)
    by_log = np.isfinite(facts.chord_by_log)
    if not by_log.any():
        return bare
    off = np.where(by_log, facts.chord_by_log - bare.chord, 0.0)
    # x is counted from the left axis
    return replace(bare, chord=bare.chord + off, x=bare.x + off[..., None] * (facts.moving == "left"))


def _bare(steps: tuple[Equilibrium, ...], facts: Facts) -> Prediction:
    force = np.array([step.force for step in steps])
    return Prediction(
        force=force,
        samples=tuple(np.full(len(times), P) for times, P in zip(facts.hold_times, force, strict=True)),
        chord=np.array([step.chord for step in steps]),
        s=steps[0].s,
        x=np.array([step.x for step in steps]),
        y=np.array([step.y for step in steps]),
        theta=np.array([step.theta for step in steps]),
    )


def _groups(model: Model, facts: Facts) -> list[tuple[list[int], Branch, bool]]:
    """Steps that are simulated together: their indices, the side to which they are bowed, and whether they are free.

    A mounted cable at displacement zero is free of force, also the straight one, whose chord cannot be imposed, and
    also under a load in the plane if displacement is counted from there; else, and with a wrong zero, its chord is
    imposed like any other. Unless it is pulled apart it may bow to the side away from its own bend, as its photo shows.
    """
    displacement = facts.displacement + model.shift
    mounted = [i for i, branch in enumerate(facts.branch) if branch == "mounted"]
    at_rest = model.bending.load == (0.0, 0.0) or model.bending.zero == "loaded"
    free = [i for i in mounted if displacement[i] == 0.0 and at_rest]
    pulled = [i for i in mounted if i not in free and displacement[i] < 0.0]
    pressed = [i for i in mounted if i not in free and displacement[i] >= 0.0]
    groups: list[tuple[list[int], Branch, bool]] = [
        (free, "natural", True),
        (pulled, "natural", False),
        (pressed, facts.rest_side, False),
        ([*facts.pushed], "up", False),
    ]
    return [group for group in groups if group[0]]


def freedom(model: Model, facts: Facts) -> list[tuple[list[int], bool]]:
    """Which steps are simulated together, and whether they are free of force."""
    return [(index, free) for index, _, free in _groups(model, facts)]


def _simulated(model: Model, facts: Facts, near: Run | None, *, patient: bool) -> tuple[Equilibrium, ...]:
    """Equilibria of all steps in their order; those up to the first failure where a step has none.

    The search for an equilibrium that does not exist costs a hundred that do, so the first failure ends it.
    """
    displacement = facts.displacement + model.shift
    count = model.bending.rod.edges.size
    usable = near is not None and len(near.steps) == len(displacement) and len(near.steps[0].angles) == count
    found: dict[int, Equilibrium] = {}
    if model.bending.zero == "loaded" and not model.bending.free.good:
        return (model.bending.free,)
    for index, side, free in _groups(model, facts):
        memory, last = model.bending.rod.virgin, None
        for i in index:
            start = near.steps[i] if near is not None and usable and near.steps[i].good else last
            memory = replace(memory, step=i)
            hold = model.bending.hold("forces", 0.0) if free else model.bending.hold("displacements", displacement[i])
            here = solve(model.bending.rod_at(i), hold, memory=memory, start=start, branch=side, patient=patient)
            if not here.good:
                return (here,)
            memory, last = here.after, here
            found[i] = here
    return tuple(found[i] for i in range(len(facts.branch)))


def base_derivatives(here: Run, facts: Facts, names: Sequence[Parameter]) -> tuple[Derivatives, ...]:
    """Derivatives of every step of a run with respect to parameters of `rod.parameters`."""
    found: dict[int, Derivatives] = {}
    for index, *_ in _groups(here.model, facts):
        steps = tuple(here.steps[i] for i in index)
        found.update(zip(index, derivatives(here.model.bending, steps, names), strict=True))
    return tuple(found[i] for i in range(len(facts.branch)))


def moved(bare: Prediction, by: tuple[Derivatives, ...], columns: Sequence[int], amounts: Array) -> Prediction:
    """Variations of the bare prediction: moved along each of the columns (k,) of the derivatives by its amount (k,).

    Vertices may move along the cable.
    """
    at, steps = list(columns), range(len(by))

    def change(name: str, of: Sequence[int] = steps) -> Array:
        """(k, steps, ...) of an array of the prediction."""
        slopes = np.array([getattr(by[i], name)[..., at] for i in of])
        return np.moveaxis(slopes * amounts, -1, 0)

    force = change("force")
    return replace(
        bare,
        force=bare.force + force,
        samples=tuple(samples + force[:, i, None] for i, samples in enumerate(bare.samples)),
        chord=bare.chord + change("chord"),
        s=bare.s + change("s", of=[0])[:, 0],
        x=bare.x + change("x"),
        y=bare.y + change("y"),
        theta=bare.theta + change("theta"),
    )

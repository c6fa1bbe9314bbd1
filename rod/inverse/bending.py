"""What bends the cable, in closed form: from the numbers of a model's vector to directions of cable and rig.

Unknowns of the law, K0, length and the displacements are parameters of `rod.parameters`, profiles along the cable
bases of them. Every other number of a cause (friction between the wires and its slip, friction and springs of the
bearings, stiff ends, loads, a yielding frame, a set) is told by what it changes in the test when it moves by a
millionth of its range (`rod.parameters.Toward`): a cause says in `apply` what it does, and nowhere how fast.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from rod.array import Array
from rod.inverse.cause import Profile
from rod.inverse.extension import Extension
from rod.inverse.prediction import Facts, Model, end_for_end
from rod.inverse.simulation import Run, base_derivatives, freedom
from rod.parameters import Parameter, Toward, comparable
from rod.sensitivity import Derivatives

SHORT = 1e-3
"""Of the step of a difference quotient: what is compared is what goes into a simulation, which is right to rounding."""


@dataclass(eq=False)
class Bends:
    """Numbers that bend the cable, and what each of them does.

    Attributes
    ----------
    size : int
        Of the vector.
    travel : (steps, size) m
        Change of the displacement of every step per unit of each number.
    at : list of int
        Positions in the vector, one for each column of what `combined` gives.
    names : list of Parameter
    rows : list of (size,)
        How much of each column of these parameters a unit of every number is.
    """

    size: int
    travel: Array
    at: list[int] = field(default_factory=list)
    names: list[Parameter] = field(default_factory=list)
    rows: list[Array] = field(default_factory=list)

    def by(self, name: Parameter, j: int, share: float = 1.0) -> None:
        """Number ``j`` is ``share`` of a parameter of its own."""
        row = np.zeros(self.size)
        row[j] = share
        self.names.append(name)
        self.rows.append(row)
        self.at.append(j)


def plainly(extension: Extension, vector: Array, model: Model, *, since: int = 0) -> list[Model]:
    """Models at a vector (p,), one after each term from ``since`` on, without profiles along the cable.

    No other cause touches these. The first is the given ``model``, that before term ``since``.
    """
    models = [model]
    for k, at in list(enumerate(extension.amounts_at))[since:]:
        if not isinstance(extension.terms[k].cause, Profile):
            term = extension.formed(vector, k)
            model = term.cause.apply(model, float(vector[at]), term.variant, extension.facts)
        models.append(model)
    return models


def bending_numbers(extension: Extension, vector: Array, base_model: Model, here: Model) -> tuple[Bends, list[int]]:
    """All numbers that bend the cable, and positions of those among them that have no closed form here.

    Parameters
    ----------
    extension : Extension
    vector : (p,)
    base_model, here : Model
        Of the extension at the vector, without and with its terms.
    """
    bends = Bends(len(vector), np.zeros((len(extension.facts.branch), len(vector))))
    _of_base(bends, extension, vector, here)
    plain, simulated = plainly(extension, vector, base_model), []
    for k, at in enumerate(extension.amounts_at):
        term = extension.formed(vector, k)
        numbers = range(at, at + term.size)
        if isinstance(term.cause, Profile):
            _of_profile(bends, extension, vector, k, term.cause, here)
            continue
        if plain[k + 1].bending is plain[k].bending and plain[k + 1].shift is plain[k].shift:
            continue
        simulated += [j for j in numbers if not _of_number(bends, extension, vector, plain, k, j)]
    return bends, simulated


def combined(here: Run, facts: Facts, bends: Bends) -> tuple[Derivatives, ...]:
    """Derivatives of every step of a run with respect to the numbers ``bends.at``, in their order."""
    change = np.array(bends.rows)[:, bends.at]
    every = base_derivatives(here, facts, [*bends.names, "displacement_offset"])
    travel = bends.travel[:, bends.at]
    return tuple(_combined(d, np.vstack([change, travel[step]])) for step, d in enumerate(every))


def _of_base(bends: Bends, extension: Extension, vector: Array, here: Model) -> None:
    """Unknowns of the law, K0, errors of displacements and length.

    The rod knows the parameters of its law, K0 and the length; the vector has a relative error of the length. The error
    of a step's displacement moves that step alone.
    """
    base, bending = extension.base, here.bending
    share = base.law.by(vector[: base.law.size])
    bends.names.append("ordinates")
    bends.rows.extend(np.hstack([share, np.zeros((len(share), bends.size - share.shape[1]))]))
    bends.at.extend(range(share.shape[1]))
    if (bend := base.pre_curvature_index) is not None:
        bends.by("pre_curvature", bend)
    for j, step in enumerate(base.moved, start=base.moved_at.start):
        bends.travel[step, j] = 1.0
        bends.at.append(j)
    for j in base.rig_at[:1].tolist():
        bends.travel[list(base.pushed), j] = 1.0
        bends.at.append(j)
    for j in base.lengths_at.tolist():
        bends.by("length", j, -bending.length / (1.0 + float(vector[j])))


def _of_profile(bends: Bends, extension: Extension, vector: Array, k: int, cause: Profile, here: Model) -> None:
    """Amount, place and width of a form along the cable."""
    term, at = extension.formed(vector, k), extension.amounts_at[k]
    cable = end_for_end(here) if extension.turned else here
    name, phi = cause.along_cable(term.variant, cable)
    moves = [phi]
    for tuned in term.variant.tuned:
        step = 1e-3 * SHORT * term.variant.scale(tuned)
        beside = term.variant.moved({tuned: term.variant.number(tuned) + step})
        moves.append(float(vector[at]) * (cause.along_cable(beside, cable)[1] - phi) / step)
    for i, move in enumerate(moves):
        bends.by((name, move[::-1] if extension.turned else move), at + i)


def _of_number(bends: Bends, extension: Extension, vector: Array, models: list[Model], k: int, j: int) -> bool:
    """What number ``j``, of term ``k``, changes; False where it changes the kind of the model.

    ``models`` is as of `plainly`, with all terms. What a cause adds to what its other terms make may be added last.
    """
    plain, term, step = models[-1], extension.terms[k], SHORT * float(extension.steps[j])
    trial, last = vector.copy(), extension.terms_of(term.cause)[-1]
    trial[j] += step
    if term.cause.adds:
        more = term.cause.apply(models[last + 1], step, term.variant, extension.facts)
        there = plainly(extension, vector, more, since=last + 1)[-1]
    else:
        there = plainly(extension, trial, models[k], since=k)[-1]
    known = comparable(plain.bending, there.bending)
    if not known or freedom(plain, extension.facts) != freedom(there, extension.facts):
        return False
    bends.travel[:, j] = (there.shift - plain.shift) / step
    if there.bending is plain.bending:
        bends.at.append(j)
    else:
        bends.by(Toward(plain.bending, there.bending, step), j)
    return True


def _combined(d: Derivatives, change: Array) -> Derivatives:
    """Derivatives with respect to combinations (columns of ``change``) of the parameters."""
    return Derivatives(*(getattr(d, one.name) @ change for one in fields(Derivatives)))

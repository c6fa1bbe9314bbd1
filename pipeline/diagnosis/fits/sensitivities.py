"""Residual of a model against an observation, and how it moves with every parameter: the rows and columns of a fit.

Rows: the whitened data in the order of `observation.Row`, then one row per piece of prior knowledge. Columns: control
points of the law, K0 and length by the implicit function theorem (`rod.sensitivity`), what only the camera changes by
the observers alone; amount, place and width of a profile along the cable and amounts of further control points by that
theorem too, all other numbers of causes by difference quotients with warm starts.

Sign: residual = data - model, so the Jacobian here is that of the model, ``d residual = - jacobian d vector``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.law import LAW
from pipeline.diagnosis.causes.profile import along_cable, is_profile
from pipeline.diagnosis.fits.base import Base
from pipeline.diagnosis.fits.extension import STEP, Extension, Term
from pipeline.diagnosis.observations.observation import Observation, residual
from pipeline.diagnosis.observations.prediction import Model, Prediction, end_for_end
from pipeline.diagnosis.observations.simulation import Run, base_derivatives, moved, observed, run
from rod.characteristic import Characteristic
from rod.sensitivity import Derivatives

Array = NDArray[np.float64]


def whole_residual(
    observation: Observation, prediction: Prediction | None, vector: Array, prior: Array
) -> Array | None:
    """Residual (N,) with the rows of prior knowledge at the end; None where the model has no equilibrium."""
    if prediction is None:
        return None
    return np.asarray(np.r_[residual(observation, prediction), -prior @ vector])


def sensitivities(observation: Observation, extension: Extension, vector: Array, base_model: Model, here: Run) -> Array:
    """Jacobian (N, p) of the model, prior rows included.

    A quotient that runs into a model without equilibrium is taken to the other side; a column of zeros is left where
    neither side has one.

    Parameters
    ----------
    observation : Observation
    extension : Extension
    vector : (p,)
    base_model : Model
        That of ``extension`` at the vector.
    here : Run
        Of the model at the vector, with a prediction.
    """
    prior = extension.prior
    at_here = whole_residual(observation, here.prediction, vector, prior)
    assert at_here is not None and here.bare is not None
    columns = _base_columns(observation, extension, vector, here, at_here)
    bent = _bent(observation, extension, vector, base_model, here)
    first = len(columns)
    for j, step in enumerate(extension.steps[first:], start=first):
        if j in bent:
            columns.append(bent[j])
            continue
        column = np.zeros_like(at_here)
        for signed in (step, -step):
            trial = vector.copy()
            trial[j] += signed
            if not extension.admissible(trial):
                continue
            there = run(extension.model(trial, of=base_model), extension.facts, near=here)
            value = whole_residual(observation, there.prediction, trial, prior)
            if value is not None:
                column = (at_here - value) / signed
                break
        columns.append(column)
    return np.column_stack(columns)


def _bent(
    observation: Observation, extension: Extension, vector: Array, base_model: Model, here: Run
) -> dict[int, Array]:
    """Columns of all numbers of terms that have a closed derivative, by their position in the vector."""
    known = _ways(extension, vector, base_model, here.model)
    if not known:
        return {}
    law = here.model.bending.characteristic
    ordinates = len(law.knots) if isinstance(law, Characteristic) else 0
    own = [j for j, (name, _) in known.items() if name == "ordinates"]
    bases = [way for way in known.values() if way[0] != "ordinates"]
    change = np.zeros((ordinates * bool(own) + len(bases), len(known)))
    row = len(change) - len(bases)
    for column, (name, along) in enumerate(known.values()):
        if name == "ordinates":
            change[:ordinates, column] = along
        else:
            change[row, column], row = 1.0, row + 1
    every = base_derivatives(here, extension.facts, [*(("ordinates",) if own else ()), *bases])
    by = tuple(_combined(d, change) for d in every)
    table = _shown(observation, extension, vector, here, by, extension.steps[list(known)])
    table[observation.rows.count :] = extension.prior[:, list(known)]
    return dict(zip(known, table.T, strict=True))


def _ways(extension: Extension, vector: Array, base_model: Model, here: Model) -> dict[int, tuple[str, Array]]:
    """What numbers of terms move, by their position, where that is known in closed form; all others are left out.

    A parameter of `rod.parameters`, and the change of its basis per unit of the number.
    """
    cable = end_for_end(here) if extension.turned else here
    ways: dict[int, tuple[str, Array]] = {}
    for k, at in enumerate(extension.amounts_at):
        term = extension.formed(vector, k)
        if is_profile(term.cause):
            name, phi = along_cable(term.cause, term.variant, cable)
            moves = [phi]
            for tuned in term.variant.tuned:
                step = SHORT * term.variant.scale(tuned)
                beside = term.variant.moved({tuned: getattr(term.variant, tuned) + step})
                moves.append(float(vector[at]) * (along_cable(term.cause, beside, cable)[1] - phi) / step)
            ways |= {at + i: (name, move[::-1] if extension.turned else move) for i, move in enumerate(moves)}
        elif term.cause.name == LAW and (moved_law := _ordinates(extension, vector, base_model, here, at)) is not None:
            ways[at] = "ordinates", moved_law
    return ways


SHORT = 1e-6
"""Of the range of a place or width: forms are closed, and a quotient of two is right to as much."""


def _ordinates(extension: Extension, vector: Array, base_model: Model, here: Model, at: int) -> Array | None:
    """Change of all control points (p,) of the law with the amount of one that a term has put into it, N m^2 per unit.

    They are linear in it; None where other control points are used at another amount.
    """
    trial = vector.copy()
    trial[at] += extension.steps[at]
    old, new = here.bending.characteristic, extension.model(trial, of=base_model).bending.characteristic
    if not isinstance(old, Characteristic) or not isinstance(new, Characteristic):
        return None
    if not np.array_equal(old.knots, new.knots):
        return None
    return np.asarray((new.ordinates - old.ordinates) / extension.steps[at])


def profile_columns(
    observation: Observation, extension: Extension, vector: Array, here: Run, terms: Sequence[Term]
) -> Array:
    """Columns (N, terms) of the amounts of profiles along the cable, whether or not they are in the model.

    Rows of prior knowledge are zero: what is known of a term beforehand has a row where it is in the model.

    Parameters
    ----------
    observation : Observation
    extension : Extension
    vector : (p,)
    here : Run
        Of the model at the vector, with a prediction.
    terms : sequence of Term
        Of causes of `causes.profile`.
    """
    if not terms:
        return np.zeros((len(extension.prior) + observation.rows.count, 0))
    facts = extension.facts
    cable = end_for_end(here.model) if extension.turned else here.model
    given = [along_cable(term.cause, term.variant, cable) for term in terms]
    by = base_derivatives(here, facts, [(name, phi[::-1] if extension.turned else phi) for name, phi in given])
    return _shown(observation, extension, vector, here, by, [STEP * term.cause.plausible(facts) for term in terms])


def _shown(
    observation: Observation,
    extension: Extension,
    vector: Array,
    here: Run,
    by: tuple[Derivatives, ...],
    steps: Sequence[float] | Array,
) -> Array:
    """Columns (N, k) of derivatives of the rod as load cell and camera show them, by short steps (k,) along each."""
    at_here = whole_residual(observation, here.prediction, vector, extension.prior)
    assert at_here is not None and here.bare is not None
    table = np.zeros((len(at_here), len(steps)))
    for k, step in enumerate(steps):
        shown = observed(moved(here.bare, by, k, float(step)), here.model, extension.facts)
        there = whole_residual(observation, shown, vector, extension.prior)
        assert there is not None
        table[:, k] = (at_here - there) / step
    return table


def _base_columns(
    observation: Observation, extension: Extension, vector: Array, here: Run, at_here: Array
) -> list[Array]:
    """Columns of the base parameters, in their order."""
    base, facts, model, bare = extension.base, extension.facts, here.model, here.bare
    assert bare is not None
    bent = [name for name in base.names if name not in base.observed]
    by = _bending_derivatives(extension, vector, here, bent)
    columns = []
    for j, (name, step) in enumerate(zip(base.names, extension.steps, strict=False)):
        trial = vector.copy()
        trial[j] += step
        if name in base.observed:
            shown = observed(bare, replace(model, observers=(base.observer(trial), *model.observers[1:])), facts)
        else:
            shown = observed(moved(bare, by, bent.index(name), float(step)), model, facts)
        value = whole_residual(observation, shown, trial, extension.prior)
        assert value is not None
        columns.append((at_here - value) / step)
    return columns


def _bending_derivatives(extension: Extension, vector: Array, here: Run, bent: list[str]) -> tuple[Derivatives, ...]:
    """Derivatives of every step with respect to the base parameters that bend the cable (``bent``, in their order).

    The rod knows ordinates of its law in N m^2, K0 and the length; the vector has logarithms of ordinates and a
    relative error of the length.
    """
    base, bending = extension.base, here.model.bending
    offset = ("displacement_offset",) if base.moved else ()
    names = ("ordinates", *(() if base.straight else ("pre_curvature",)), *offset, "length")
    law = bending.characteristic
    # where a cause has put further control points into the law, a base ordinate moves them along the base spline
    share = base.law_directions(vector, law.knots if isinstance(law, Characteristic) else base.knots)
    count = len(share)
    change = np.zeros((count + len(names) - 1, len(bent)))
    change[:count, : share.shape[1]] = share
    if (bend := base.pre_curvature_index) is not None:
        change[count, bend] = 1.0
    change[-1, -1] = -bending.length / (1.0 + vector[len(base.names) - 1])
    every = base_derivatives(here, extension.facts, names)
    return tuple(_combined(d, _with_own(change, base, step)) for step, d in enumerate(every))


def _with_own(change: Array, base: Base, step: int) -> Array:
    """The combinations for one step: the error of its displacement moves that step alone.

    It comes before the length in both orders, and the offset of all displacements is what a single one does there.
    """
    if step not in base.moved:
        return change
    own = change.copy()
    own[-2, base.moved.index(step) - len(base.moved) - 1] = 1.0
    return own


def _combined(d: Derivatives, change: Array) -> Derivatives:
    """Derivatives with respect to combinations (columns of ``change``) of the parameters."""
    return Derivatives(
        tuple(str(i) for i in range(change.shape[1])),
        *(getattr(d, name) @ change for name in ("s", "x", "y", "theta", "kappa", "moment", "force", "chord")),
    )

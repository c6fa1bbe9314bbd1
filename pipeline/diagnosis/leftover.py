"""What no cause explains: a smooth, generic test of the residual, and where the leftover sits.

The whitened residual (base model and accepted causes projected out) is tested against fields that are smooth along the
cable, each with every pattern over the steps: polynomials of the load level first, with the same and with the opposite
sign on the two branches, then whatever changes from step to step as no level does. Forces and chords follow the same
patterns. The fields are ordered from coarse to fine and the misfit is summed in growing groups, and over forces and
chords alone; the smallest of the groups' p-values decides, and its distribution under "nothing is wrong" is simulated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from pipeline.diagnosis.observation import Observation
from pipeline.diagnosis.prediction import Facts
from pipeline.diagnosis.score import span

Array = NDArray[np.float64]
GROUPS = (8, 24)
"""Sizes of the nested groups beside that of all fields: a lone bump and a diffuse misfit are both found within a factor
1.3 in size; more groups cost more by their number than they gain."""
ALONE = (0, 1)
"""Kinds of rows (`observation.Row`) that are groups of their own: a load cell and a drive err apart from the shapes."""


@dataclass(frozen=True)
class Leftover:
    """Test of what is left.

    Attributes
    ----------
    p_value : float
        Of the smallest group p-value, by simulation.
    chi2, size : float, int
        Misfit along the group that decided, and its number of fields.
    field : (N,)
        The part of the residual along that group.
    """

    p_value: float
    chi2: float
    size: int
    field: Array

    @property
    def excess(self) -> float:
        """Chi-square beyond what noise would give, not negative."""
        return max(0.0, self.chi2 - self.size)


def smooth_fields(observation: Observation, facts: Facts, *, rows: int) -> Array:
    """Generic fields (rows, k), coarse to fine; ``rows`` counts the prior rows too, which stay zero."""
    ramps = _patterns(facts)
    kind, step = observation.rows.kind, observation.rows.step
    photo = {p.step: p for p in observation.photos}
    fields: list[tuple[float, Array]] = []
    for order, ramp in enumerate(ramps):
        force = np.zeros(rows)
        at = np.flatnonzero(kind == 0)
        force[at] = ramp[step[at]] / observation.force_std[step[at]]
        fields.append((order - 0.5, force))
        for degree in range(2, 10):
            shape = np.zeros(rows)
            for index, data in photo.items():
                if degree < data.basis.shape[1]:
                    own = np.flatnonzero((kind > 0) & (step == index))
                    shape[own] = ramp[index] * (data.whiten[:, 1:] @ data.basis[:, degree])
            fields.append((order + 0.7 * (degree - 2), shape))
        chord = np.zeros(rows)
        for index, data in photo.items():
            own = np.flatnonzero((kind > 0) & (step == index))
            chord[own] = ramp[index] * data.whiten[:, 0]
        fields.append((order + 0.2, chord))
    fields.sort(key=lambda pair: pair[0])
    return np.column_stack([field for _, field in fields])


def _patterns(facts: Facts) -> Array:
    """Orthonormal patterns (steps, steps) over the steps as rows, slow to fast."""
    level = facts.displacement / max(facts.travel, 1e-30)
    back = np.array([-1.0 if branch == "unloading" else 1.0 for branch in facts.branch])
    powers = [level**power * side for power in range(len(level)) for side in (np.ones_like(level), back)]
    return _ordered_basis(np.column_stack([*powers, np.eye(len(level))])).T


def test_leftover(
    residual: Array,
    jacobian: Array,
    fields: Array,
    *,
    draws: int,
    rng: np.random.Generator,
    kind: NDArray[np.int_] | None = None,
) -> Leftover:
    """Test the residual against the fields after projecting the Jacobian out.

    Parameters
    ----------
    residual : (N,)
        Whitened, with prior rows.
    jacobian : (N, p)
    fields : (N, k)
        Coarse to fine, as of `smooth_fields`.
    draws : int
    rng : Generator
    kind : (n,) int or None
        Kinds of the first rows, as of `observation.Row`; the rest is prior knowledge.
    """
    fitted = span(jacobian)
    kept = fields - fitted @ (fitted.T @ fields)
    # Gram-Schmidt in the order coarse to fine; fields that the fit or coarser ones can imitate drop out
    seen = np.linalg.norm(kept, axis=0) > 1e-3 * np.maximum(np.linalg.norm(fields, axis=0), 1e-300)
    basis = _ordered_basis(kept[:, seen])
    component = basis.T @ residual
    groups = _groups(basis, np.zeros(0, dtype=int) if kind is None else kind)
    p_values = _group_p(component[None, :], groups)[0]
    deciding = int(np.argmin(p_values))
    null = np.min(_group_p(rng.standard_normal((draws, basis.shape[1])), groups), axis=1)
    smaller = float(np.sum(null <= p_values[deciding]))
    p_value = (smaller + 1.0) / (draws + 1.0)
    if smaller < 20.0:  # beyond the draws: Bonferroni over the groups, which is on the safe side
        p_value = min(p_value, len(groups) * float(p_values[deciding]))
    own = groups[deciding]
    return Leftover(p_value, float(np.sum(component[own] ** 2)), len(own), basis[:, own] @ component[own])


def _groups(basis: Array, kind: NDArray[np.int_]) -> list[NDArray[np.int_]]:
    """Groups of columns of the basis: the coarsest ones, all, and those that lie mostly in one kind of rows."""
    count = basis.shape[1]
    nested = [np.arange(size) for size in (*(size for size in GROUPS if size < count), count)]
    share = [np.sum(basis[: len(kind)][kind == alone] ** 2, axis=0) for alone in ALONE]
    own = [np.flatnonzero(part > 0.5) for part in share]
    return [*nested, *(group for group in own if 0 < len(group) < count)]


def _ordered_basis(columns: Array) -> Array:
    """Orthonormal columns of the same span, in the same order; what earlier columns can imitate drops out."""
    kept = np.zeros((len(columns), 0))
    for column in (columns / np.linalg.norm(columns, axis=0)).T:
        rest = column - kept @ (kept.T @ column)
        rest -= kept @ (kept.T @ rest)  # once more: what is left may be a thousandth of what went in
        if np.linalg.norm(rest) > 1e-3:
            kept = np.column_stack([kept, rest / np.linalg.norm(rest)])
    return kept


def _group_p(component: Array, groups: list[NDArray[np.int_]]) -> Array:
    square = component**2
    return np.column_stack([stats.chi2.sf(np.sum(square[:, own], axis=1), len(own)) for own in groups])

"""What no cause explains: a smooth, generic test of the residual, and where the leftover sits.

The whitened residual (base model and accepted causes projected out) is tested against fields that are smooth along the
cable, each with every pattern over the steps: polynomials of the load level first, with the same and with the opposite
sign on the two branches, then whatever changes from step to step as no level does. Forces and chords follow the same
patterns. The fields are ordered from coarse to fine and the misfit is summed in growing groups, and over forces and
chords alone. Beside the sums stands the strongest single pattern, one shape along the cable that comes and goes in any
way from step to step: the largest singular value of the table photos x shape functions. Whatever one thing is wrong has
such a trace, and noise spread over the whole table hardly adds to it. The smallest p-value decides; its distribution
under "nothing is wrong" is simulated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, stats

from pipeline.diagnosis.observation import Observation, Row
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
        Misfit along the group or pattern that decided, and what noise puts there (a group: its number of fields).
    field : (N,)
        The part of the residual along it.
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
    rows: Row | None = None,
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
    rows : Row or None
        Where the first rows come from; the rest is prior knowledge.
    """
    fitted = span(jacobian)
    kept = fields - fitted @ (fitted.T @ fields)
    # Gram-Schmidt in the order coarse to fine; fields that the fit or coarser ones can imitate drop out
    seen = np.linalg.norm(kept, axis=0) > 1e-3 * np.maximum(np.linalg.norm(fields, axis=0), 1e-300)
    basis = _ordered_basis(kept[:, seen])
    component = basis.T @ residual
    groups = _groups(basis, np.zeros(0, dtype=int) if rows is None else rows.kind)
    table = _photo_table(rows)
    clean = (residual - fitted @ (fitted.T @ residual))[table]
    null_component, null_table = _drawn(fitted, basis, table, draws=draws, rng=rng)
    heights = _height(null_table)
    p_values = np.r_[_group_p(component[None, :], groups)[0], _rank_p(_height(clean[None]), heights)]
    null = np.minimum(np.min(_group_p(null_component, groups), axis=1), _rank_p(heights, heights))
    deciding = int(np.argmin(p_values))
    smaller = float(np.sum(null <= p_values[deciding]))
    p_value = (smaller + 1.0) / (draws + 1.0)
    if smaller < 20.0:  # beyond the draws: Bonferroni over the groups, which is on the safe side
        p_value = min(p_value, len(p_values) * float(p_values[deciding]))
    if deciding < len(groups):
        own = groups[deciding]
        return Leftover(p_value, float(np.sum(component[own] ** 2)), len(own), basis[:, own] @ component[own])
    left, weight, right = np.linalg.svd(clean, full_matrices=False)
    field = np.zeros(len(residual))
    field[table] = weight[0] * np.outer(left[:, 0], right[0])
    return Leftover(p_value, float(weight[0] ** 2), round(float(np.mean(heights**2))), field)


def _photo_table(rows: Row | None) -> NDArray[np.int_]:
    """Rows (photos, functions) of the residual: chord and shape of every photo, coarse to fine."""
    if rows is None:
        return np.zeros((0, 0), dtype=int)
    of_photo = [np.flatnonzero((rows.kind > 0) & (rows.step == step)) for step in np.unique(rows.step[rows.kind > 0])]
    common = min((len(own) for own in of_photo), default=0)
    return np.array([own[:common] for own in of_photo], dtype=int).reshape(len(of_photo), common)


def _drawn(
    fitted: Array, basis: Array, table: NDArray[np.int_], *, draws: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Draws of pure noise after the fit: components (draws, k) along the basis, and tables (draws, photos, functions).

    Noise is drawn for the rows of the table; all other rows act through few sums, which are drawn as such.
    """
    inside = np.zeros(len(basis), dtype=bool)
    inside[table.ravel()] = True
    sums = np.hstack([fitted, basis])
    triangle = linalg.qr(sums[~inside], mode="r")[0][: sums.shape[1]]
    noise = rng.standard_normal((draws, table.size))
    total = noise @ sums[table.ravel()] + rng.standard_normal((draws, len(triangle))) @ triangle
    along, component = total[:, : fitted.shape[1]], total[:, fitted.shape[1] :]
    return component, (noise - along @ fitted[table.ravel()].T).reshape(draws, *table.shape)


def _height(tables: Array) -> Array:
    """Largest singular value (n,) of tables (n, photos, functions); 0 where there are none."""
    if not tables[0].size:
        return np.zeros(len(tables))
    turned = tables.transpose(0, 2, 1)
    square = tables @ turned if tables.shape[1] < tables.shape[2] else turned @ tables
    return np.sqrt(np.maximum(np.linalg.eigvalsh(square)[:, -1], 0.0))


def _rank_p(heights: Array, null: Array) -> Array:
    """p-values of heights among those of noise."""
    below = np.searchsorted(np.sort(null), heights, side="left")
    return np.asarray((len(null) - below + 1.0) / (len(null) + 1.0))


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

"""What no cause explains: a smooth, generic test of the residual, and where the leftover sits.

The whitened residual (base model and accepted causes projected out) is tested against fields that are smooth along the
cable and over the load level, with the same and with the opposite sign on the two branches, and against polynomials of
the force over the load level. The fields are ordered from coarse to fine and the misfit is summed in growing groups;
the smallest of the groups' p-values decides, and its distribution under "nothing is wrong" is simulated.
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
GROUPS = (3, 8, 20, 48)
"""Sizes of the nested groups: a lone bump and a diffuse misfit are both found within a factor 1.3 in size."""


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
    level = facts.displacement / max(facts.travel, 1e-30)
    back = np.array([-1.0 if branch == "unloading" else 1.0 for branch in facts.branch])
    ramps = [np.ones_like(level), level, back, back * level, level**2, back * level**2]
    if np.all(back > 0.0):
        ramps = [ramps[0], ramps[1], ramps[4]]
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


def test_leftover(residual: Array, jacobian: Array, fields: Array, *, draws: int, rng: np.random.Generator) -> Leftover:
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
    """
    fitted = span(jacobian)
    kept = fields - fitted @ (fitted.T @ fields)
    # Gram-Schmidt in the order coarse to fine; fields that the fit or coarser ones can imitate drop out
    seen = np.linalg.norm(kept, axis=0) > 1e-3 * np.maximum(np.linalg.norm(fields, axis=0), 1e-300)
    basis = _ordered_basis(kept[:, seen])
    component = basis.T @ residual
    sizes = [size for size in GROUPS if size < basis.shape[1]] + [basis.shape[1]]
    p_values = _group_p(component[None, :], sizes)[0]
    deciding = int(np.argmin(p_values))
    null = np.min(_group_p(rng.standard_normal((draws, basis.shape[1])), sizes), axis=1)
    smaller = float(np.sum(null <= p_values[deciding]))
    p_value = (smaller + 1.0) / (draws + 1.0)
    if smaller < 20.0:  # beyond the draws: Bonferroni over the nested groups, which is on the safe side
        p_value = min(p_value, len(sizes) * float(p_values[deciding]))
    size = sizes[deciding]
    return Leftover(p_value, float(np.sum(component[:size] ** 2)), size, basis[:, :size] @ component[:size])


def _ordered_basis(columns: Array) -> Array:
    scaled = columns / np.linalg.norm(columns, axis=0)
    left, triangle = np.linalg.qr(scaled)
    return np.asarray(left[:, np.abs(np.diag(triangle)) > 1e-4])


def _group_p(component: Array, sizes: list[int]) -> Array:
    running = np.cumsum(component**2, axis=1)
    return np.column_stack([stats.chi2.sf(running[:, size - 1], size) for size in sizes])

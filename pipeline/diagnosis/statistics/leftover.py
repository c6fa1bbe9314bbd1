"""What no cause explains: a smooth, generic test of the residual, and where the leftover sits.

The whitened residual, beside base model and accepted causes, is tested along the fields of `smooth_fields`. The misfit
is summed over growing groups of them, coarse to fine, and over forces and chords alone. Beside the sums stands the
strongest single pattern of the photos (`photo_table`): whatever one thing is wrong has such a trace. The statistic that
noise makes as large least often decides; its distribution under "nothing is wrong" is simulated.

How large the noise is is itself known only so well, and a sum over many rows would take a noise that is a tenth larger
for a misfit. So every draw of the simulation has its own level of the forces (few samples of a hold set it), of the
photos (extrapolated from what is fast along the cable) and of the bearing axes (as the photos state it, unchecked).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.observations.observation import KINDS, Observation, Row
from pipeline.diagnosis.statistics.photo_table import PhotoTable
from pipeline.diagnosis.statistics.score import span
from pipeline.diagnosis.statistics.smooth_fields import basis_beside

Array = NDArray[np.float64]

GROUPS = (8, 24)
"""Sizes of the nested groups beside that of all fields: a lone bump and a diffuse misfit are both found within a factor
1.3 in size; more groups cost more by their number than they gain."""

ALONE = ("force", "chord")
"""Kinds of rows that are groups of their own: a load cell and a drive err apart from the shapes."""

RARE = 0.999
"""Quantile of noise by which sums of different size are compared: about where the smallest of six decides."""

FEWER, COMMON = 2000, 0.2
"""So many draws tell what noise does one time in five to 0.01; only what is rarer is worth all of them."""


@dataclass(frozen=True)
class Leftover:
    """Test of what is left.

    Attributes
    ----------
    p_value : float
        Of the most surprising group or pattern, by simulation; not below one over the draws.
    chi2, size : float, int
        Misfit along the group or pattern that decided, and what noise puts there on average.
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


def leftover_of(
    residual: Array,
    jacobian: Array,
    fields: Array,
    observation: Observation,
    *,
    axis_doubt: float,
    draws: int,
    rng: np.random.Generator,
) -> Leftover:
    """Test the residual against the fields after projecting the Jacobian out.

    Parameters
    ----------
    residual : (N,)
        Whitened, with prior rows.
    jacobian : (N, p)
    fields : (N, k)
        Coarse to fine, as of `smooth_fields.smooth_fields`.
    observation : Observation
        Where the first rows come from, and how well their noise is known; the rest is prior knowledge.
    axis_doubt : float
        Standard deviation of the logarithm of the variance stated for the bearing axes.
    draws : int
    rng : Generator
    """
    fitted = span(jacobian)
    basis = basis_beside(fitted, fields)
    groups = _groups(basis, observation.rows)
    photos = PhotoTable.of(observation)

    def statistics(components: Array, tables: Array) -> Array:
        """Sums of the groups, then heights of the patterns: (n, statistics)."""
        sums = [np.sum(components[:, own] ** 2, axis=1) for own in groups]
        return np.column_stack([*sums, *photos.heights(tables, doubt=observation.photo_noise.doubt)])

    component, table = basis.T @ residual, (residual - fitted @ (fitted.T @ residual))[photos.rows]
    found = statistics(component[None], table[None])[0]
    for count in sorted({min(FEWER, draws), draws}):
        null = statistics(*_drawn(fitted, basis, photos, observation, axis_doubt=axis_doubt, draws=count, rng=rng))
        deciding, p_value = _most_surprising(found, null)
        if p_value > COMMON:
            break
    field = np.zeros(len(residual))
    if deciding < len(groups):
        field = basis[:, groups[deciding]] @ component[groups[deciding]]
    else:
        part = photos.parts[deciding - len(groups)]
        field[part.rows] = part.strongest(table)
    return Leftover(p_value, float(found[deciding]), round(float(null[:, deciding].mean())), field)


def _groups(basis: Array, rows: Row) -> list[NDArray[np.int_]]:
    """Groups of columns of the basis: the coarsest ones, all, and those that lie mostly in one kind of rows."""
    count = basis.shape[1]
    nested = [np.arange(size) for size in (*(size for size in GROUPS if size < count), count)]
    share = [np.sum(basis[: rows.count][rows.kind == KINDS.index(kind)] ** 2, axis=0) for kind in ALONE]
    own = [np.flatnonzero(part > 0.5) for part in share]
    return [*nested, *(group for group in own if 0 < len(group) < count)]


def _most_surprising(found: Array, null: Array) -> tuple[int, float]:
    """Which statistic (k,) stands out most from noise (draws, k), and how often noise has any that does so much.

    Statistics of different size and scatter are compared by how far they lie from usual to rare.
    """
    usual, rare = null.mean(axis=0), np.quantile(null, RARE, axis=0)
    surprise = (found - usual) / (rare - usual)
    deciding = int(np.argmax(surprise))
    above = float(np.sum(((null - usual) / (rare - usual)).max(axis=1) >= surprise[deciding]))
    return deciding, (above + 1.0) / (len(null) + 1.0)


def _drawn(
    fitted: Array,
    basis: Array,
    photos: PhotoTable,
    observation: Observation,
    *,
    axis_doubt: float,
    draws: int,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Draws of pure noise after the fit: components (draws, k) along the basis, and tables (draws, photos, functions).

    Noise is drawn for the rows of the table; all other rows act through few sums, which are drawn as such. The levels
    are drawn anew each time; those of the forces as the scatter of their samples leaves them.
    """
    sums = np.hstack([fitted, basis])
    noise = rng.standard_normal((draws, *photos.rows.shape))
    noise *= _levels(observation.photo_noise.doubt, draws, rng)[:, None, None]
    noise += (_levels(axis_doubt, draws, rng)[:, None, None] - 1.0) * photos.along_axes(noise)
    flat = noise.reshape(draws, -1)
    total = flat @ sums[photos.rows.ravel()]
    levels = observation.estimated(len(sums))
    other = np.ones(len(sums), dtype=bool)
    other[photos.rows.ravel()] = False
    for rows, _ in levels:
        other &= ~rows
    for rows, doubt in (*((rows, np.sqrt(2.0 / freedom)) for rows, freedom in levels), (other, 0.0)):
        if np.any(rows):
            own = rng.standard_normal((draws, int(rows.sum()))) @ sums[rows]
            total += _levels(doubt, draws, rng)[:, None] * own
    along, component = total[:, : fitted.shape[1]], total[:, fitted.shape[1] :]
    return component, (flat - along @ fitted[photos.rows.ravel()].T).reshape(noise.shape)


def _levels(doubt: float, draws: int, rng: np.random.Generator) -> Array:
    """True over assumed standard deviation (draws,) of a noise whose log variance is known to ``doubt``."""
    if doubt <= 0.0:
        return np.ones(draws)
    freedom = 2.0 / doubt**2
    return np.sqrt(freedom / rng.chisquare(freedom, draws))

"""What no cause explains: a smooth, generic test of the residual, and where the leftover sits.

The whitened residual (base model and accepted causes projected out) is tested against fields that are smooth along the
cable, each with every pattern over the steps: polynomials of the load level first, with the same and with the opposite
sign on the two branches, then whatever changes from step to step as no level does. Forces and chords follow the same
patterns. The fields are ordered from coarse to fine and the misfit is summed in growing groups, and over forces and
chords alone. Beside the sums stands the strongest single pattern, one shape along the cable that comes and goes in any
way from step to step: the largest singular value of the table photos x shape functions. Whatever one thing is wrong has
such a trace, and noise spread over the whole table hardly adds to it. The one that noise makes least often decides; its
distribution under "nothing is wrong" is simulated.

How large the noise is is itself known only so well, and a sum over many rows would take a noise that is a tenth larger
for a misfit. So every draw of the simulation has its own level of the forces (few samples of a hold set it), of the
photos (extrapolated from what is fast along the cable) and of the bearing axes (as the photos state it, unchecked). The
strongest pattern is looked for beside what errors of the axes can do to a photo.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from pipeline.diagnosis.observations.noise import by_axes
from pipeline.diagnosis.observations.observation import Observation
from pipeline.diagnosis.observations.prediction import Facts
from pipeline.diagnosis.statistics.score import span

Array = NDArray[np.float64]
GROUPS = (8, 24)
"""Sizes of the nested groups beside that of all fields: a lone bump and a diffuse misfit are both found within a factor
1.3 in size; more groups cost more by their number than they gain."""
FUNCTIONS = 11
"""Chord and polynomials up to degree 9 of every photo, as in `smooth_fields`: the part of the table where most
leftovers have their pattern, with half the noise of the whole one."""
ALONE = (0, 1)
"""Kinds of rows (`observation.Row`) that are groups of their own: a load cell and a drive err apart from the shapes."""
RARE = 0.999
"""Quantile of noise by which sums of different size are compared: about where the smallest of six decides."""


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
        Coarse to fine, as of `smooth_fields`.
    observation : Observation
        Where the first rows come from, and how well their noise is known; the rest is prior knowledge.
    axis_doubt : float
        Standard deviation of the logarithm of the variance stated for the bearing axes.
    draws : int
    rng : Generator
    """
    fitted = span(jacobian)
    kept = fields - fitted @ (fitted.T @ fields)
    # Gram-Schmidt in the order coarse to fine; fields that the fit or coarser ones can imitate drop out
    seen = np.linalg.norm(kept, axis=0) > 1e-3 * np.maximum(np.linalg.norm(fields, axis=0), 1e-300)
    basis = _ordered_basis(kept[:, seen])
    groups = _groups(basis, observation.rows.kind)
    table = _Table.of(observation)

    def statistics(component: Array, tables: Array) -> Array:
        sums = [np.sum(component[:, own] ** 2, axis=1) for own in groups]
        return np.column_stack([*sums, *table.heights(tables, doubt=observation.photo_noise.doubt)])

    null = statistics(*_drawn(fitted, basis, table, observation, axis_doubt=axis_doubt, draws=draws, rng=rng))
    component, clean = basis.T @ residual, (residual - fitted @ (fitted.T @ residual))[table.rows]
    found = statistics(component[None], clean[None])[0]
    usual, rare = null.mean(axis=0), np.quantile(null, RARE, axis=0)
    surprise = (found - usual) / (rare - usual)
    deciding = int(np.argmax(surprise))
    above = float(np.sum(((null - usual) / (rare - usual)).max(axis=1) >= surprise[deciding]))
    field = np.zeros(len(residual))
    if deciding < len(groups):
        field = basis[:, groups[deciding]] @ component[groups[deciding]]
    else:
        own_table = table.parts[deciding - len(groups)]
        left, weight, right = np.linalg.svd(own_table.beside_axes(clean[None])[0], full_matrices=False)
        field[own_table.rows] = weight[0] * np.outer(left[:, 0], right[0])
    return Leftover((above + 1.0) / (draws + 1.0), float(found[deciding]), round(float(usual[deciding])), field)


@dataclass(frozen=True, eq=False)
class _Table:
    """The photos' rows of the residual as a table, and what errors of the bearing axes do to each photo.

    Attributes
    ----------
    rows : (photos, functions) int
        Chord and shape of every photo, coarse to fine.
    axes : (photos, functions, 3)
        Orthonormal directions of the axes' errors.
    """

    rows: NDArray[np.int_]
    axes: Array

    @classmethod
    def of(cls, observation: Observation) -> _Table:
        """The table of an observation; photos cut to what all of them have."""
        kind, step = observation.rows.kind, observation.rows.step
        own = [np.flatnonzero((kind > 0) & (step == photo.step)) for photo in observation.photos]
        common = min((len(rows) for rows in own), default=0)
        rows = np.array([r[:common] for r in own], dtype=int).reshape(len(own), common)
        moved = [photo.whiten[:common] @ by_axes(photo.sections, photo.chord) for photo in observation.photos]
        return cls(rows, _orthonormal(np.array(moved).reshape(len(own), common, -1 if common else 0)))

    @property
    def parts(self) -> list[_Table]:
        """The whole table, and the coarse functions of it; none without photos."""
        coarse = _Table(self.rows[:, :FUNCTIONS], _orthonormal(self.axes[:, :FUNCTIONS]))
        return [self, coarse] if self.rows.size else []

    def heights(self, tables: Array, *, doubt: float) -> list[Array]:
        """Square of the largest singular value (n,) of tables (n, photos, functions) and of their coarse functions.

        In units of their noise: what is left of a table without its strongest pattern shows the level of its noise
        about as well as that is known beforehand (log variance to ``doubt``), and both together halve the doubt.
        """
        squares = [_squares(part.beside_axes(tables)) for part in self.parts]
        known = 2.0 / max(doubt, 1e-6) ** 2
        free = (self.rows.shape[0] - 1) * (self.rows.shape[1] - self.axes.shape[2] - 1)
        return [own[:, -1] * (known + free) / (known + squares[0][:, :-1].sum(axis=1)) for own in squares]

    def along_axes(self, tables: Array) -> Array:
        """The part of tables (n, photos, functions) that errors of the axes can make."""
        share = np.matmul(tables[:, :, : self.rows.shape[1]].transpose(1, 0, 2), self.axes)
        return np.asarray(np.matmul(share, self.axes.transpose(0, 2, 1)).transpose(1, 0, 2))

    def beside_axes(self, tables: Array) -> Array:
        """What is left of tables (n, photos, functions) without that part."""
        return np.asarray(tables[:, :, : self.rows.shape[1]] - self.along_axes(tables))


def _orthonormal(columns: Array) -> Array:
    """Orthonormal columns (photos, functions, k) of the same span, photo by photo."""
    return np.asarray(np.linalg.qr(columns)[0]) if columns.size else columns


def _drawn(
    fitted: Array,
    basis: Array,
    table: _Table,
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
    noise = rng.standard_normal((draws, *table.rows.shape))
    noise *= _levels(observation.photo_noise.doubt, draws, rng)[:, None, None]
    noise += (_levels(axis_doubt, draws, rng)[:, None, None] - 1.0) * table.along_axes(noise)
    flat = noise.reshape(draws, -1)
    total = flat @ sums[table.rows.ravel()]
    force = np.r_[observation.rows.kind == 0, np.zeros(len(sums) - len(observation.rows.kind), dtype=bool)]
    other = ~force
    other[table.rows.ravel()] = False
    freedom = observation.force_freedom
    for rows, doubt in ((force, np.sqrt(2.0 / freedom) if freedom else 0.0), (other, 0.0)):
        if np.any(rows):
            triangle = linalg.qr(sums[rows], mode="r")[0][: sums.shape[1]]
            total += _levels(doubt, draws, rng)[:, None] * (rng.standard_normal((draws, len(triangle))) @ triangle)
    along, component = total[:, : fitted.shape[1]], total[:, fitted.shape[1] :]
    return component, (flat - along @ fitted[table.rows.ravel()].T).reshape(noise.shape)


def _levels(doubt: float, draws: int, rng: np.random.Generator) -> Array:
    """True over assumed standard deviation (draws,) of a noise whose log variance is known to ``doubt``."""
    if doubt <= 0.0:
        return np.ones(draws)
    freedom = 2.0 / doubt**2
    return np.sqrt(freedom / rng.chisquare(freedom, draws))


def _squares(tables: Array) -> Array:
    """Squares (n, k) of the singular values of tables (n, photos, functions), rising."""
    turned = tables.transpose(0, 2, 1)
    square = tables @ turned if tables.shape[1] < tables.shape[2] else turned @ tables
    return np.asarray(np.maximum(np.linalg.eigvalsh(square), 0.0))


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

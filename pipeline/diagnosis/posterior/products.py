"""Sums over whitened rows for every error model: what an evidence needs of the data.

For the notation see `pipeline.diagnosis.posterior.error_grid`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.fits.workbench import SCATTER
from pipeline.records import Array

AS_RIGS_ARE, WORSE, EXACT = (0.0, 1.0), 3.0, 0.1
SCATTERS = {0.0: 0.6, SCATTER: 0.2, 5.0 * SCATTER: 0.2}
MOVED = {
    (scatter, rig): chance * share
    for scatter, chance in SCATTERS.items()
    for rig, share in ((1.0, 0.75), (WORSE, 0.25))
}
MOVED |= {AS_RIGS_ARE: MOVED[AS_RIGS_ARE] - EXACT, (0.0, 0.0): EXACT}
"""Scatter of the displacements (m), and how far the rig is off, in its standard deviations, all of it together: as rigs
are, or one of the worse; with probabilities beforehand. One that is exact in all but one thing is rarer than one that
nobody aligned. One exact in all is a simulation; where no photo at rest tells the zero, it is this number that decides
how well K0 is known."""

ASTRAY, ITS_SHARE = (20.0 * SCATTER, 100.0 * SCATTER), 0.25
"""Scatter of displacements, m, that no log has, and its probability among the four kinds of something else."""


class Spread(NamedTuple):
    """Orthonormal directions ``turn`` (d, n) of rows along which something else adds the variances ``size`` (d,).

    ``shared`` (d,): those that an error common to the samples of a hold adds to as well.
    """

    turn: Array
    size: Array
    shared: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Products:
    """Sums over whitened rows for every error model.

    Attributes
    ----------
    own : (G, o, o)
        ``M' C^-1 M`` of the own columns; prior knowledge and, last, the displacements in it.
    cross : (G, o, k)
        Of own and added columns.
    square : (G, k)
        Of each added column.
    log_det : (G,)
        Of C.
    log_prior : (G,)
        Probability of the error model, given whether there is something else.
    rest : (G,) bool
        Whether there is something else.
    scales : (G, m + r)
        Sizes of errors of the displacements (m) and of the rig.
    sizes : (G, 5)
        Positions of the error model: in `SLOW`, among the kinds, in `HOLD`, ``shapes`` and `FORCES`.
    """

    own: Array
    cross: Array
    square: Array
    log_det: Array
    log_prior: Array
    rest: NDArray[np.bool_]
    scales: Array
    sizes: NDArray[np.int_]


@dataclass(frozen=True, eq=False)
class Models:
    """All error models of a test: those without errors of displacements and rig, and these at each of their sizes.

    Attributes
    ----------
    fixed : Products
        With displacements and rig as they are said to be; these are its last own columns.
    of : (G,) int
        Positions among these.
    scales, log_prior, rest :
        See `Products`.
    """

    fixed: Products
    of: NDArray[np.int_]
    scales: Array
    log_prior: Array
    rest: NDArray[np.bool_]

    def at(self, kept: NDArray[np.int_]) -> Products:
        """Sums for some of them."""
        fixed, of, scales = self.fixed, self.of[kept], self.scales[kept]
        own, cross = fixed.own[of], fixed.cross[of]
        beside = np.arange(own.shape[1] - scales.shape[1], own.shape[1])
        own[:, beside] *= scales[:, :, None]
        own[:, :, beside] *= scales[:, None, :]
        own[:, beside, beside] += 1.0
        cross[:, beside] *= scales[:, :, None]
        rest, log_prior = self.rest[kept], self.log_prior[kept]
        return Products(own, cross, fixed.square[of], fixed.log_det[of], log_prior, rest, scales, fixed.sizes[of])


def along(spread: Spread, rows: Array, common: Array, sizes: Array, own: int) -> tuple[Array, Array]:
    """What other variances along some directions change: sums (c, a, T) and log-determinants (c, a)."""
    wide = 1.0 + common[:, None, None] ** 2 * spread.shared + sizes[None, :, None] ** 2 * spread.size
    turned = spread.turn @ rows
    change = (1.0 / wide - 1.0).reshape(len(common) * len(sizes), len(spread.size))
    mine, added = turned[:, :own], turned[:, own:]
    pairs = (np.einsum("ni,nj->nij", mine, other).reshape(len(turned), own * other.shape[1]) for other in (mine, added))
    found = change @ np.hstack([*pairs, added**2])
    return found.reshape(*wide.shape[:-1], -1), np.log(wide).sum(axis=-1)


def sums(rows: Array, own: int) -> Array:
    """Sums (T,) over rows (n, c): own by own columns, own by added ones, added ones squared; flat."""
    both = rows[:, :own].T @ rows
    return np.concatenate([both[:, :own].ravel(), both[:, own:].ravel(), np.sum(rows[:, own:] ** 2, axis=0)])


def with_rig(fixed: Products, displacements: int, rig: int) -> Models:
    """Error models with displacements that scatter, and a rig that is off, by each of `MOVED`, in units of it.

    Something else is among a rig as rigs are; or it is the displacements that are astray.
    """
    plain, rest = np.flatnonzero(~fixed.rest), np.flatnonzero(fixed.rest)
    astray = [(size, AS_RIGS_ARE[1]) for size in ASTRAY] if displacements and rest.size else []
    other = 1.0 - ITS_SHARE * bool(astray)
    models = [(size, chance, plain) for size, chance in MOVED.items()]
    models += [((scatter, AS_RIGS_ARE[1]), other * chance, rest) for scatter, chance in SCATTERS.items() if rest.size]
    models += [(size, ITS_SHARE / len(astray), plain) for size in astray]
    which = np.repeat(np.arange(len(models)), [len(rows) for *_, rows in models])
    of = np.concatenate([rows for *_, rows in models])
    scales = np.repeat(np.array([size for size, *_ in models]), (displacements, rig), axis=1)[which]
    log_prior = fixed.log_prior[of] + np.log([chance for _, chance, _ in models])[which]
    return Models(fixed, of, scales, log_prior, which >= len(MOVED))

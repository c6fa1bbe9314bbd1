"""How wrong the data may be: a grid of error models, and the products that each of them makes of whitened rows.

A fit whitens its rows by the noise that is likeliest beforehand. What is known less well is integrated over here:

    slow      slow errors of a photo and errors of its bearing axes, times 0.3, 1 or 3
    waves     errors along the cable, rough ones as below, of each photo and as large ones alike on all photos: none,
              faint, or as the scatter of a section
    hold      an error that all samples of a hold share, of 0 or 1 standard deviation of their mean, and more of both
              as far as few samples leave the level of their noise open
    moved     scatter of the displacements beyond the log's, 0, 10 or 50 um
    rig       zeros of displacement and force, length and lean of the camera exact, as rigs have them, or worse;
              beside something else always as rigs have them
    shapes    something else in the shapes, a share of the length across the cable
    forces    something else in the forces, a share of the largest

"Something else" is what no cause makes, of one of these kinds, coefficients normal:

    smooth    sum_k c_k sin(k pi s / L) / k^2, k to 12; over the steps sum_o t_o / (1 + o), t_o cosines of order o
    rough     the same with 1 / k, at each step for itself, as the forces
    pattern   one wave sin(k pi s / L), or one bump at a place, or one bearing whose axis is elsewhere along or across
              the chord (a cover that slips), as large as it likes at each step; or the course of the force in one hold
    log       displacements off by more than any log scatters: photos taken before the drive stands still, say

In whitened rows the covariance is

    C = 1 + (slow^2 - 1) E + shapes^2 D       in the photos (E: slow errors and axes),
    C = 1 + hold^2 + forces^2 D'              for the means of the holds, and for the course in the one;

and displacements, known to ``moved``, are further unknowns, as is what every rig is off by
(`rod.inverse.base.RIG`), too little to be named. Along the eigenvectors of D all other sizes cost a sum. Notation of
the products: G grid points, o own columns, k added ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, ndtr

from pipeline.diagnosis.posterior.products import Models, Products, Spread, along, sums, with_rig
from pipeline.records import Array
from rod.inverse.common_errors import shared_light
from rod.inverse.noise import by_axes, slow_errors
from rod.inverse.observation import Observation, PhotoData
from rod.inverse.prediction import Facts

Forms = Callable[[Array], Array]

SLOW = {1.0: 0.6, 0.3: 0.2, 3.0: 0.2}
HOLD = {0.0: 0.7, 1.0: 0.3}
"""Sizes and their probabilities beforehand: as stated is usual, more is not rare. Forces that are off by several
standard deviations of a hold are something else: no band of f_EI may take them for noise unseen; by how much few
samples may belie their noise is no matter of belief, see `hold_sizes`."""

SHAPES = (0.0, *np.geomspace(1e-6, 1e-2, 7))
"""Of the cable's length: from below what any photo shows to a bow that is another experiment."""

WAVES = {0.0: 0.7, 0.3: 0.15, 1.0: 0.15}
"""Waves of a photo, in what single sections scatter, with probabilities beforehand: light, ground and print that no
photo tells from the cable move its midline by a few hundredths of a pixel, and by as much at most. What is printed on a
cable, or lies in its sheath, does so on all photos alike: in ten specimens drawn by strangers half as much as what is
of each photo, in two as much."""

FORCES = (0.0, *np.geomspace(1e-3, 0.3, 5))
"""Of the largest force."""

BENDS = 12
"""Half waves along the cable: finer ones are no cable's at these weights."""

PLACES, WIDTH = np.linspace(0.08, 0.92, 8), 0.06
"""Of the length: middles of bumps and their standard deviation, so that neighbours overlap at half their height."""

COURSE = 3
"""Mean, slope and bend of a force in a hold: a lag of the reading or a cable that settles is no more to ten samples."""

SEEN = 0.03
"""Standard deviations: directions in which the largest something else adds less are left as they are."""


class Kind(NamedTuple):
    """A kind of something else: ``shapes`` for the first of `SLOW`, ``holds``, and pairs of positions in the sizes.

    ``noise``: it is none, but noise of the photos.
    """

    shapes: tuple[Spread, ...]
    holds: Spread
    pairs: NDArray[np.int_]
    chance: float
    noise: bool = False


@dataclass(frozen=True, eq=False)
class ErrorGrid:
    """All error models of a test.

    Attributes
    ----------
    photos, forces : (n,) int
        Rows.
    roots : (slow, n, n)
        Whitening of photo rows for each of `SLOW`.
    log_det : (slow,)
        Of the covariance that takes away.
    kinds : tuple of Kind
        Those of noise alone come first.
    shapes : (a,)
        Sizes of what is in the shapes, in the cable's length: `SHAPES`, then those of `WAVES`.
    hold : mapping of size -> probability
    """

    photos: NDArray[np.int_]
    forces: NDArray[np.int_]
    roots: tuple[Array, ...]
    log_det: Array
    kinds: tuple[Kind, ...]
    shapes: Array
    hold: Mapping[float, float]

    @property
    def plain(self) -> ErrorGrid:
        """Without something else."""
        return replace(self, kinds=tuple(kind for kind in self.kinds if kind.noise))

    def models(self, columns: Array, known: Array, displacements: Array, rig: Array, added: Array) -> Models:
        """Error models for own columns (N, o), with rows ``known`` (m, o) of prior knowledge, and those added (N, k).

        ``displacements`` (N, m): sensitivities to displacements that may scatter, per m, and ``rig`` (N, r); both may
        be none.
        """
        beside = np.hstack([displacements, rig])
        whole = np.hstack([columns, beside, added])
        extra, count = beside.shape[1], added.shape[1]
        own, force = columns.shape[1] + extra, whole[self.forces]
        prior = np.zeros((own, own))
        prior[: own - extra, : own - extra] = known.T @ known
        fixed = sums(force, own)
        fixed[: own * own] += prior.ravel()
        tables, log_det, log_prior, sizes = [], [], [], []
        for slow, root, det, chance in zip(range(len(SLOW)), self.roots, self.log_det, SLOW.values(), strict=True):
            photo = root @ whole[self.photos]
            by_slow = fixed + sums(photo, own)
            for number, kind in enumerate(self.kinds):
                if slow >= len(kind.shapes):
                    continue
                a, b = kind.pairs.T
                shape, shape_det = along(kind.shapes[slow], photo, np.zeros(1), self.shapes, own)
                held, held_det = along(kind.holds, force, np.array([*self.hold]), np.array(FORCES), own)
                tables.append((held[:, b] + shape[:, a] + by_slow).reshape(-1, fixed.size))
                log_det.append((held_det[:, b] + shape_det[:, a] + det).ravel())
                share = (chance if len(kind.shapes) > 1 else 1.0) * kind.chance / len(a)
                log_prior.append(np.repeat(np.log(np.array([*self.hold.values()]) * share), len(a)))
                held = np.repeat(np.arange(len(self.hold)), len(a))
                where = np.column_stack([held, np.tile(kind.pairs, (len(self.hold), 1))])
                sizes.append(np.hstack([np.tile([slow, number], (len(where), 1)), where]))
        table, positions = np.concatenate(tables), np.concatenate(sizes)
        found = Products(
            own=table[:, : own * own].reshape(len(table), own, own),
            cross=table[:, own * own : own * (own + count)].reshape(len(table), own, count),
            square=table[:, own * (own + count) :],
            log_det=np.concatenate(log_det),
            log_prior=np.concatenate(log_prior),
            rest=np.array([not kind.noise for kind in self.kinds])[positions[:, 1]],
            scales=np.ones((len(table), extra)),
            sizes=positions,
        )
        return with_rig(found, displacements.shape[1], rig.shape[1])

    def something_else(self, position: NDArray[np.int_], rows: Array) -> Array:
        """What is likeliest of whitened rows (N,) to be something else, as large as an error model (5,) says."""
        slow, number, hold, shape, force = position
        kind, found = self.kinds[number], np.zeros(len(rows))
        own, held = kind.shapes[slow], kind.holds
        in_photos = self.shapes[shape] ** 2 * own.size
        along = in_photos / (1.0 + in_photos) * (own.turn @ (self.roots[slow] @ rows[self.photos]))
        found[self.photos] = np.linalg.solve(self.roots[slow], own.turn.T @ along)
        in_forces = FORCES[force] ** 2 * held.size
        means = in_forces / (1.0 + [*self.hold][hold] ** 2 * held.shared + in_forces) * (held.turn @ rows[self.forces])
        found[self.forces] = held.turn.T @ means
        return found


def error_grid(observation: Observation, facts: Facts) -> ErrorGrid:
    """The error models of an observation."""
    rows, count = observation.rows, len(facts.branch)
    forces, photos = np.flatnonzero(rows.force), np.flatnonzero(~rows.force)
    share, along = np.linalg.eigh(_slow_errors(observation, photos))
    share = np.clip(share, 0.0, 1.0 - 1e-9)
    wide = [1.0 + (slow**2 - 1.0) * share for slow in SLOW]
    roots = tuple(along / np.sqrt(one) @ along.T for one in wide)
    every = np.array([(a, b) for a in range(len(SHAPES)) for b in range(len(FORCES))])
    none = Spread(np.zeros((0, len(photos))), np.zeros(0), np.zeros(0, bool))
    over_steps = (_smooth_over_steps(count), np.eye(count))
    held = [_of_holds(observation, facts, forces, smooth) for smooth in over_steps]
    by_power = []
    for smooth, power in zip(over_steps, (2, 1), strict=True):
        shown = _shown(observation, facts, photos, partial(_waves, power=power))
        by_power.append(tuple(_of_photos(observation, photos, root, shown, smooth) for root in roots))
    rough = _shown(observation, facts, photos, partial(_waves, power=1))
    noisy = tuple(_of_photos(observation, photos, root, rough, np.eye(count) + 1.0) for root in roots)
    kinds = [Kind((none,) * len(SLOW), held[1], every[:1], 1.0, noise=True)]
    seen = [np.median(photo.sections.section_std) for photo in observation.photos]
    waves = np.array([*WAVES][1:]) * (np.median(seen) if seen else 0.0) / facts.length
    if seen:
        own = np.array([(a, 0) for a in range(len(SHAPES), len(SHAPES) + len(waves))])
        kinds = [kinds[0]._replace(chance=WAVES[0.0]), Kind(noisy, held[1], own, 1.0 - WAVES[0.0], noise=True)]
    kinds += [Kind(shapes, holds, every[1:], 1.0 / 3.0) for shapes, holds in zip(by_power, held, strict=True)]
    bumps = _shown(observation, facts, photos, lambda u: np.exp(-0.5 * (np.subtract.outer(u, PLACES) / WIDTH) ** 2))
    single = _shown(observation, facts, photos, partial(_waves, power=0))
    axes = facts.length * _rows(observation, photos, lambda photo: by_axes(photo.sections, photo.chord))
    alone = every[(every[:, 1] == 0) & (every[:, 0] > 0)]
    patterns, single_step = np.hstack([single, bumps, axes]).T, np.eye(count)
    chance = 1.0 / 3.0 / (len(patterns) + count)
    for pattern in patterns:
        spread = _of_photos(observation, photos, roots[0], pattern[:, None], over_steps[1])
        kinds.append(Kind((spread,), held[1], alone, chance))
    for one in single_step:
        spread = _of_holds(observation, facts, forces, np.outer(one, one), COURSE)
        kinds.append(Kind((none,), spread, every[(every[:, 0] == 0) & (every[:, 1] > 0)], chance))
    log_det = np.array([np.sum(np.log(one)) for one in wide])
    shapes = np.append(SHAPES, waves)
    return ErrorGrid(photos, forces, roots, log_det, tuple(kinds), shapes, hold_sizes(observation))


def hold_sizes(observation: Observation) -> dict[float, float]:
    """Errors that the samples of a hold share, in standard deviations of their mean, and their probabilities.

    The level of the noise is as its f samples tell, or one standard deviation higher: f / chi^2 in its square.
    """
    own = observation.force_own
    freedom = float(np.mean(own)) if own else float(observation.force_freedom)
    higher = freedom / float(chdtri(freedom, float(ndtr(1.0)))) if freedom else 1.0
    (none, as_told), (size, off) = HOLD.items()
    found = {none: 0.5 * as_told, float(np.sqrt((1.0 + size**2) * higher - 1.0)): off}
    more = float(np.sqrt(higher - 1.0))  # none, where the level is stated
    return found | {more: found.get(more, 0.0) + 0.5 * as_told}


def _waves(u: Array, *, power: int) -> Array:
    """Half waves (n, k) at shares u (n,) of the length, weighed by a power of their number."""
    order = np.arange(1, BENDS + 1)
    return np.asarray(np.sin(np.pi * np.outer(u, order)) / order**power)


def _smooth_over_steps(count: int) -> Array:
    """Covariance (count, count) of what comes and goes smoothly over the steps, of mean variance 1."""
    order, at = np.arange(count), np.pi * (np.arange(count) + 0.5) / count
    waves = np.cos(np.outer(at, order)) / (1.0 + order)
    covariance = waves @ waves.T
    return np.asarray(covariance / np.mean(np.diag(covariance)))


def _of_holds(
    observation: Observation, facts: Facts, forces: NDArray[np.int_], over_steps: Array, course: int = 1
) -> Spread:
    """Means of the holds, or so many orders of their courses in time, and what an error of the largest force adds."""
    held = [i for i in range(len(facts.branch)) if len(observation.forces[i])]
    step, courses = observation.rows.step[forces], np.zeros((course, len(held), len(forces)))
    for k, i in enumerate(held):
        since = facts.hold_times[i] - facts.hold_times[i][0]
        order = min(course, len(np.unique(since)))
        powers = np.vander(2.0 * since / max(since[-1], 1e-300) - 1.0, order, increasing=True)
        courses[:order, k, step == i] = np.linalg.qr(powers)[0].T
    shown = facts.force_scale * np.sqrt([len(observation.forces[i]) for i in held]) / observation.force_std[held]
    size, turn = np.linalg.eigh(np.outer(shown, shown) * over_steps[np.ix_(held, held)])
    shared = np.arange(course * len(held)) < len(held)
    return Spread((turn.T @ courses).reshape(-1, len(forces)), np.tile(np.maximum(size, 0.0), course), shared)


def _shown(observation: Observation, facts: Facts, photos: NDArray[np.int_], forms: Forms) -> Array:
    """Whitened photo rows (n, j) of forms across the cable, each as large as the cable is long."""
    return _rows(
        observation, photos, lambda p: np.pad(facts.length * forms(p.sections.s / facts.length), ((1, 0), (0, 0)))
    )


def _rows(observation: Observation, photos: NDArray[np.int_], of: Callable[[PhotoData], Array]) -> Array:
    """Whitened photo rows (n, j) of what is to be whitened ``of`` each photo, (1 + k, j): of its chord and sections."""
    step, own = observation.rows.step[photos], [(p.step, p.whiten @ of(p)) for p in observation.photos]
    shown = np.zeros((len(photos), own[0][1].shape[1] if own else 0))
    for at, rows in own:
        shown[step == at] = rows
    return shown


def _of_photos(
    observation: Observation, photos: NDArray[np.int_], root: Array, shown: Array, over_steps: Array
) -> Spread:
    """Directions of photo rows, whitened by ``root``, along which forms ``shown`` (n, j) lie, and their variances."""
    values, orders = np.linalg.eigh(over_steps)
    at_step = (orders * np.sqrt(np.maximum(values, 0.0)))[observation.rows.step[photos]]
    factor = (at_step[:, :, None] * shown[:, None, :]).reshape(len(photos), values.size * shown.shape[1])
    if observation.common is not None:
        factor = observation.common.whitened(factor)
    turn, size, _ = np.linalg.svd(root @ factor, full_matrices=False)
    seen = size * SHAPES[-1] > SEEN
    return Spread(turn.T[seen], size[seen] ** 2, np.zeros(np.count_nonzero(seen), dtype=bool))


def _slow_errors(observation: Observation, photos: NDArray[np.int_]) -> Array:
    """Share (n, n) of the variance of whitened photo rows that slow errors and the bearing axes have."""
    step, share = observation.rows.step[photos], np.zeros((len(photos), len(photos)))
    for photo in observation.photos:
        own = np.flatnonzero(step == photo.step)
        sections = photo.whiten[:, 1:]
        axes = photo.stated_chord_std / np.sqrt(2.0) * photo.whiten @ by_axes(photo.sections, photo.chord)
        share[np.ix_(own, own)] = sections @ slow_errors(photo.sections) @ sections.T + axes @ axes.T
    if observation.common is None:
        return share
    share += shared_light([photo.sections for photo in observation.photos], [p.whiten for p in observation.photos])
    return observation.common.whitened(observation.common.whitened(share).T)

"""How a cable passes its bearing axes, told by all photos of a series together.

Where a cover was found is not quite where the cable passes: covers lie above the cable and are seen too far out, a lid
sits beside its axis, a cable has play in its bearing. On one photo all of that must be allowed for at its usual size.
But a camera that stands still sees the same parallax and the same lids on all photos, and how far the seen part of
each cable, continued, passes beside its axes tells both, and how much play is left:

``miss_i = C_i z + play_i + e_i``

with ``z ~ N(0, diag(a^2, b^2))``, ``play_i ~ N(0, (b tau)^2 I)`` and ``e_i ~ N(0, S_i)``: ``miss_i`` (2,) are the
distances of both axes from the curve along its normals, ``z`` what all photos share (parallax, lids) in units of its
usual size, ``tau`` the usual play, ``S_i`` what the fit of the curve and the circles leave open. A rig made well has
both lids on their axes and little play: ``b`` is one size for both, ``a`` that of the parallax. ``z`` is integrated out
exactly, the sizes over a grid with even weights of their logarithms, from 1 down.

What a photo is told comes from the *others*: its own misses are used once, when its curve is tied to the axes. Two
photos tell little, six tell both to 0.01 or 0.02 mm. Nothing is assumed of the bending at the axis, and a miss that
differs from photo to photo stays play. A photo that disagrees with the others (something else was taken for its cover,
the camera was pushed) is not held to what they tell: its own difference then counts as uncertainty.

Lengths in m. Source: Gelman et al. (2013), Bayesian Data Analysis, ch. 5 (variance of a group of effects by their
marginal likelihood).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.records import Array

_PARALLAX = 3  # the first so many of what photos share: covers seen too far out; the others are lids beside their axes


@dataclass(frozen=True)
class AxisSight:
    """How far beside its axes the cable of one photo passes, continued as a bow.

    Attributes
    ----------
    miss : (2,) m
        Distances of the left and the right axis from the curve, along its normals.
    covariance : (2, 2) m^2
        By the fit of the curve without the axes, and by the circles.
    places, normals : (2, 2) m, -
        Axes, and normals of the curve beside them, on the plane that all photos of the camera share.
    parallax_std : relative
        As in `pipeline.records.Traces`.
    play : m
        Usual size of what differs from photo to photo, and of a lid beside its axis.
    """

    miss: Array
    covariance: Array
    places: Array
    normals: Array
    parallax_std: float
    play: float


@dataclass(frozen=True)
class AxesTold:
    """Expected misses ``(2,)`` m of a photo, and their covariance ``(2, 2)`` without its circles' own errors."""

    shift: Array
    covariance: Array


def told_alone(sight: AxisSight) -> AxesTold:
    """Expected misses of a photo of which no other photo tells."""
    common = _common(sight, sight.places.mean(axis=0))[:, :_PARALLAX]
    return AxesTold(np.zeros(2), sight.play**2 * np.eye(2) + common @ common.T)


def told_by_others(sights: Sequence[AxisSight]) -> list[AxesTold]:
    """Expected misses of each photo by all other photos of the series.

    Parameters
    ----------
    sights : sequence of AxisSight
        Photos of one camera position.
    """
    if len(sights) < 2:
        return [told_alone(sight) for sight in sights]
    middle = np.mean([sight.places for sight in sights], axis=(0, 1))
    commons = [_common(sight, middle) for sight in sights]
    # Parallax halved thrice: a camera twice as far and covers a quarter as high; play and lid of a tenth of a
    # millimetre six times: a micrometre, below any photo's noise.
    sizes = np.array([(0.5**far, 0.5**near) for far in range(4) for near in range(7)])
    terms = [_terms(sight, common, sizes[:, 1]) for sight, common in zip(sights, commons, strict=True)]
    total = [np.sum(parts, axis=0) for parts in zip(*terms, strict=True)]
    others = [[all_of - own for all_of, own in zip(total, mine, strict=True)] for mine in terms]
    return [_expected(sight, common, sizes, *rest) for sight, common, rest in zip(sights, commons, others, strict=True)]


def _common(sight: AxisSight, middle: Array) -> Array:
    """Slopes ``(2, 7)`` m of the misses by what all photos share, in units of its usual size.

    Covers are seen too far out by a share of their way from the camera's foot. That lies from the middle of the axes
    by a quarter of their distance, and a camera that looks askew moves both alike: two more unknowns. Then the lids.
    """
    common = np.zeros((2, _PARALLAX + 4))
    common[:, 0] = sight.parallax_std * ((sight.places - middle) * sight.normals).sum(axis=1)
    apart = float(np.hypot(*(sight.places[1] - sight.places[0])))
    common[:, 1:_PARALLAX] = 0.25 * sight.parallax_std * apart * sight.normals
    common[0, _PARALLAX : _PARALLAX + 2] = sight.play * sight.normals[0]
    common[1, _PARALLAX + 2 :] = sight.play * sight.normals[1]
    return common


def _terms(sight: AxisSight, common: Array, near: Array) -> tuple[Array, Array, Array]:
    """What a photo adds to the log likelihood, and to gradient and information of z at its usual size, for each play.

    ``near`` (g,) is the play in units of its usual size.
    """
    precision = np.linalg.inv(sight.covariance + (near[:, None, None] * sight.play) ** 2 * np.eye(2))
    weighted = common.T @ precision
    likelihood = 0.5 * np.linalg.slogdet(precision)[1] - 0.5 * sight.miss @ (precision @ sight.miss).T
    return likelihood, weighted @ sight.miss, weighted @ common


def _expected(
    sight: AxisSight, common: Array, sizes: Array, likelihood: Array, gradient: Array, information: Array
) -> AxesTold:
    """Moments of a photo's misses over z and the sizes, by the sums of `_terms` over the other photos."""
    count = common.shape[1]
    unit = sizes[:, np.where(np.arange(count) < _PARALLAX, 0, 1)]
    gradient, information = unit * gradient, unit[:, :, None] * information * unit[:, None, :]
    spread = np.linalg.inv(np.eye(count) + information)
    middle = (spread @ gradient[..., None])[..., 0]
    log = likelihood + 0.5 * np.linalg.slogdet(spread)[1] + 0.5 * (gradient * middle).sum(axis=1)
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    slopes = common * unit[:, None, :]
    shifts = (slopes @ middle[..., None])[..., 0]
    shift = weight @ shifts
    each = slopes @ spread @ slopes.transpose(0, 2, 1)
    each += (sizes[:, 1, None, None] * sight.play) ** 2 * np.eye(2)
    off = shifts - shift
    covariance = np.einsum("k,kij->ij", weight, each) + (off.T * weight) @ off
    apart = sight.miss - shift
    if apart @ np.linalg.solve(covariance + sight.covariance, apart) > 9.2:  # once in a hundred
        covariance = covariance + np.diag(apart**2)
    return AxesTold(shift, covariance)

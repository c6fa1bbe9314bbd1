"""Where the bearing stood in a hold, from the samples of the displacement: place and standard deviation of each hold.

An encoder scatters from sample to sample, a drive moves slowly or not at all. What changes from one sample to the next
is therefore noise, and the mean of a hold that stands still is better than the one sample at the photo; where the hold
wanders besides, only the samples at the photo say where the bearing stood. Symbols: ``sigma`` the standard deviation of
one sample, common to all holds.

Source: for normal noise the median of |x_(i+1) - x_i| is 0.6745 sqrt(2) sigma, whatever moves slowly or jumps seldom
(Rousseeuw & Croux, Alternatives to the Median Absolute Deviation, J. Am. Stat. Assoc. 88 (1993), 1273).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array

MEDIAN_OF_NORMAL = 0.6745
"""Median of the absolute value of a standard normal number."""

REACH = 3.0
"""Standard deviations: a sample further from the middle of its hold is left out of the mean, as of a bearing that was
still on its way (of noise alone one in 370)."""

MOVED = 5.0
"""Standard deviations: a photo whose sample lies further from the middle of its hold was taken elsewhere."""

LEAST_CHANGES = 8
"""From sample to sample, over all holds; fewer tell the scatter of the displacement worse than to a third."""

WANDER = 1.5
"""Times the scatter from sample to sample: a hold whose samples lie wider about their median moves, and only the sample
at the photo says where the bearing stood."""


@dataclass(frozen=True)
class HoldPlaces:
    """Displacement of each hold (m), its standard deviation (m, None where the log tells none), and sigma (m)."""

    place: tuple[float, ...]
    std: tuple[float | None, ...]
    sigma: float


def hold_places(holds: Sequence[Array], at_photo: Sequence[NDArray[np.bool_]]) -> HoldPlaces:
    """Displacements at the times of the photos.

    Parameters
    ----------
    holds : sequence of (n,) m
        Samples of each hold; at least one.
    at_photo : sequence of (n,) bool
        Those that name the photo; none if the log does not say which.

    Returns
    -------
    HoldPlaces
        Without a deviation (``sigma`` 0) where the samples repeat to the digit or are too few to tell.
    """
    own = [float(np.median(hold[photo] if photo.any() else hold)) for hold, photo in zip(holds, at_photo, strict=True)]
    changes = np.concatenate([np.abs(np.diff(hold)) for hold in holds])
    if changes.size < LEAST_CHANGES or (middle := float(np.median(changes))) <= 0.0:
        return HoldPlaces(tuple(own), (None,) * len(own), 0.0)
    sigma = middle / (MEDIAN_OF_NORMAL * math.sqrt(2.0))
    still = _stand_still(holds, sigma)
    found = (_place(*hold, sigma, still=still) for hold in zip(holds, at_photo, own, strict=True))
    place, std = zip(*found, strict=True)
    return HoldPlaces(place, std, sigma)


def _stand_still(holds: Sequence[Array], sigma: float) -> bool:
    """Whether the samples lie about the median of their hold no wider than they scatter from one to the next."""
    long = [hold for hold in holds if hold.size > 2]
    apart = np.concatenate([np.abs(hold - np.median(hold)) for hold in long]) if long else np.zeros(0)
    return apart.size == 0 or float(np.median(apart)) < WANDER * MEDIAN_OF_NORMAL * sigma


def _place(hold: Array, photo: NDArray[np.bool_], own: float, sigma: float, *, still: bool) -> tuple[float, float]:
    """Mean of the samples that belong together, and its standard deviation."""
    if not still:
        return own, sigma / math.sqrt(max(int(np.count_nonzero(photo)), 1))
    middle = float(np.median(hold))
    centre = middle if abs(own - middle) <= MOVED * sigma else own  # moved within the step: where the photo was taken
    near = hold[np.abs(hold - centre) <= REACH * sigma]
    return (float(np.mean(near)), sigma / math.sqrt(near.size)) if near.size else (centre, sigma)

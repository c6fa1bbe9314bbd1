"""Which strip is the cable: levels and widths tried until one reading of the photo makes sense.

The first reading, everything that differs from the ground at Otsu's level, serves most photos. Other levels are tried
only where it finds nothing long enough.
All lengths in cells of the reduced photo.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from pipeline.vision.median import SURE_SIGMAS
from pipeline.vision.search.backdrop import CELLS_ACROSS, Image, Standout, averaged
from pipeline.vision.search.crosscut import cut_across
from pipeline.vision.search.strips import (
    MIN_PIECE_WIDTHS,
    THICK_WIDTHS,
    Mask,
    Strip,
    find_strips,
    join_strips,
    ridge_widths,
    strip_mask,
    thick_part,
)

MIN_PARTNER_WIDTHS = 8.0  # widths; an end that meets a strip shorter than that meets a bolt or a letter
_MAX_JUDGED_PICTURES = 4  # readings with a long strip that are judged; what four of them refuse is not the cable
_BAND_WIDTHS = 3.2  # widths; cable and hard shadow together, by a lamp 25 degrees above the table


@dataclass(frozen=True)
class Reading:
    """Strips found in one mask, longest first; ``mask`` and ``thick`` are 0/1 pictures, ``level`` in ground sigmas."""

    strips: tuple[Strip, ...]
    mask: Mask
    thick: Mask
    width: float
    level: float

    @property
    def longest(self) -> float:
        """Length of the longest strip, 0 without any."""
        return self.strips[0].length if self.strips else 0.0


@dataclass(frozen=True)
class Wanted:
    """What the cable must look like, in cells: ``width`` if known, least length, greatest length if known."""

    width: float | None
    least_length: float
    most_length: float = np.inf


def read_photo(standout: Standout, wanted: Wanted) -> Iterator[tuple[Reading, ...]]:
    """Readings with a strip that is long enough, one tuple for each level, the likeliest first.

    Then those with the cable in a wider band. Where none has one, the reading with the longest strip comes alone.
    """
    nothing = np.zeros((1, 1), np.uint8)
    best, given = Reading((), nothing, nothing, wanted.width or 0.0, 0.0), 0
    for picture, level in _pictures(standout, wanted):
        readings = list(_readings(picture, level, wanted))
        long = tuple(reading for reading in readings if reading.longest >= wanted.least_length)
        if long:
            given += 1
            yield long
        if given >= _MAX_JUDGED_PICTURES:
            break
        best = max([best, *readings], key=lambda reading: reading.longest)
    if wanted.width is not None:
        for reading in islice(_banded(standout, wanted, wanted.width), _MAX_JUDGED_PICTURES):
            given += 1
            yield (reading,)
    if not given:
        yield (best,)


def _pictures(standout: Standout, wanted: Wanted) -> Iterator[tuple[Image, float]]:
    """What stands out, and a level: the likeliest first.

    As it is, then its mean over a disc: the speckles of a ground average there, a cable does not, and no strip gets
    thick by the disc.
    """
    yield from ((standout.distance, level) for level in _levels(standout))
    calmer = averaged(standout, round((THICK_WIDTHS - 1.0) * (wanted.width or CELLS_ACROSS)) | 1)
    yield from ((calmer.distance, level) for level in _levels(calmer))


def _levels(standout: Standout) -> list[float]:
    """Levels in ground sigmas, the likeliest first."""
    otsu, *higher = standout.levels
    # texture may push Otsu's level up or down; below three sigmas noise makes strips
    others = (*higher, *(factor * otsu for factor in (0.5, 2.0, 0.25)))
    return [otsu, *(level for level in others if level > SURE_SIGMAS)]


def _readings(picture: Image, level: float, wanted: Wanted) -> Iterator[Reading]:
    above = picture > level
    if above.mean() > 0.5:  # that is ground, not cable
        return
    widths = [(wanted.width, np.inf)] if wanted.width is not None else _guess_widths(above)
    largest = 0.0
    for width, length in widths:
        if width * length < largest:
            continue  # the largest strip will speak for the photo; these are all smaller together
        reading = _read(above, width, level, wanted)
        if reading.longest >= wanted.least_length:
            largest = max(largest, reading.longest * reading.width)
        yield reading


def _banded(standout: Standout, wanted: Wanted, width: float) -> Iterator[Reading]:
    """Readings with the cable as part of a wider band: a hard shadow has widened it."""
    for level in _levels(standout):
        mask = strip_mask(standout.distance > level, width)
        thick = thick_part(mask, _BAND_WIDTHS * width)
        bands = find_strips(mask, thick, width, most=_BAND_WIDTHS)
        within = [strip for strip in (_cable_within(standout, band, width) for band in bands) if strip is not None]
        strips = [strip for strip in within if wanted.least_length <= strip.length <= wanted.most_length]
        if strips:
            strips.sort(key=lambda strip: -strip.length)
            yield Reading(tuple(strips), mask, thick, width, level)


def _read(above: NDArray[np.bool_], width: float, level: float, wanted: Wanted) -> Reading:
    mask = strip_mask(above, width)
    thick = thick_part(mask, THICK_WIDTHS * width)
    strips = [s for s in find_strips(mask, thick, width) if s.length <= wanted.most_length]
    strips = [strip for strip in join_strips(strips, width) if strip.length <= wanted.most_length] or strips
    if wanted.width is None and strips:
        width = strips[0].width
    return Reading(tuple(strips), mask, thick, width, level)


def _guess_widths(above: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Widths and lengths of strips in the mask as it is, and once gaps of a highlight's size are closed.

    Those that may be largest in area come first.
    """
    mask = above.astype(np.uint8)
    widths = ridge_widths(mask)
    closed = ridge_widths(strip_mask(above, widths[0][0])) if widths else []
    new = [guess for guess in closed if all(abs(np.log(guess[0] / known)) > 0.2 for known, _ in widths)]
    return sorted(widths + new, key=lambda guess: -guess[0] * guess[1])


def _cable_within(standout: Standout, band: Strip, width: float) -> Strip | None:
    """The cable's strip in a band; None where most sections show no pair of edges."""
    # a skeleton runs into a corner of the band over its last half width
    corner = round(0.5 * band.width)
    path = band.path[corner : len(band.path) - corner]
    if len(path) < MIN_PIECE_WIDTHS * width:
        return None
    cut = cut_across(standout, path, width, known=True, search=0.5 * (_BAND_WIDTHS - 1.0))
    if len(cut.seen_widths) < 0.5 * len(cut.width):
        return None
    return replace(band, path=cut.path, width=cut.usual_width)

"""What stands still in a series is not the cable: the ground that all photos share, and photos without it.

Slots as wide as the cable, a second cable that lies there, a printed grid: on one photo nothing tells them from it. The
camera stands still and the cable is pushed, so the median of the photos shows the ground alone, wherever the cable is
on less than half of them. What stands out of that median is the cable, its shadow or the rig, each of one colour.
Nearer to the bearings the cable lies on most photos: there the ground is what those show that do not show its colour.
Lamps flicker: photo and ground are held against each other with a gain for each colour.

A photo without its ground shows how much of each pixel is cable: the difference from the ground along the step from
there to the cable's colour, over that step. So a grey cable is the same over a black slot and over bright metal, and
nothing is seen where it looks as the ground does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from pipeline.records import Array
from pipeline.vision.median import medians, scatter
from pipeline.vision.photo import Photo, reduce_area, values_at
from pipeline.vision.search.backdrop import MIN_GROUND_STD, ROWS, bands, choose_reduction, reduced, stand_out

_ALIKE = 0.5  # of the step from ground to cable; a pixel nearer to the cable's colour than that is taken for it
_FAINT = 5.0  # standard deviations of noise; a step from ground to cable of so many is weighed half
_COLOURS = 3  # groups of colours that move: cable, shadow and rig
_SAMPLE = 20000  # colours; more tell their groups no better
_BLACK = 1.0 / 256.0  # of full range; added before a ratio is taken
_CODES = 65535.0  # levels of 16 bit


@dataclass(frozen=True)
class Ground:
    """What stands still in a series.

    Attributes
    ----------
    picture : Photo
        16 bit, as the first photo is lit.
    colour : (c,)
        Of what moved, in that light; 0 black to 1 white.
    """

    picture: Photo
    colour: Array

    @classmethod
    def of(cls, photos: Sequence[Photo], colour: Array) -> Ground:
        """The ground of photos of one size, of which some show another colour (c,) of the cable in each place.

        Where all photos show the cable's colour, as a black slot below a black cable, they show the ground.
        """
        usual = np.median(_values(photos[0], slice(0, None, ROWS)).reshape(-1, len(colour)), axis=0)
        return cls(_median(photos, colour, _ALIKE * float(np.linalg.norm(colour - usual))), colour)

    def without(self, photo: Photo) -> Photo:
        """How much of each pixel is cable: middle grey is none, white twice as much as all, as in a highlight."""
        gains, every = _gains(self.picture, photo), slice(0, None, max(1, len(photo.pixels) // ROWS))
        off = _values(photo, every) - _lit(self.picture, every, gains)
        noise = [max(scatter(each, 0.0), MIN_GROUND_STD) for each in np.moveaxis(off, -1, 0)]
        faint = (_FAINT * float(np.hypot.reduce(noise))) ** 2
        share = np.empty(photo.pixels.shape[:2], np.uint16)
        for rows in bands(photo):
            ground = _lit(self.picture, rows, gains)
            step = np.asarray(self.colour * gains, np.float32) - ground
            along = ((_values(photo, rows) - ground) * step).sum(axis=2)
            share[rows] = _coded(0.5 + 0.25 * along / ((step**2).sum(axis=2) + faint))
        return Photo(photo.name, share, 16, photo)


def moved_colours(photos: Sequence[Photo]) -> Array:
    """Colours (k, c) of what stands out of the median of photos, as the first is lit: cable, shadow, rig."""
    ground = _median(photos)
    moved = np.concatenate([_moved(photo, ground) for photo in photos])
    sample = moved[:: max(1, len(moved) // _SAMPLE)]
    few = np.unique(sample, axis=0)  # of an even picture
    if len(few) <= _COLOURS:
        return few
    return np.asarray(kmeans2(sample, _COLOURS, minit="++", missing="raise", seed=0)[0])


def colour_along(cables: Sequence[tuple[Photo, Array]], like: Photo) -> Array:
    """Colour (c,) along the middles (n, 2) px of cables, as the photo ``like`` is lit."""
    return medians(np.concatenate([values_at(photo, path) * _gains(photo, like) for photo, path in cables]), axis=0)


def _median(photos: Sequence[Photo], colour: Array | None = None, near: float = 0.0) -> Photo:
    """Median of photos as the first is lit, where some of them are not ``near`` a colour (c,), of those."""
    first, gains = photos[0], [_gains(photo, photos[0]) for photo in photos]
    picture = np.empty((*first.pixels.shape[:2], first.channels), np.uint16)
    for rows in bands(first):
        lit = np.stack([_lit(photo, rows, gain) for photo, gain in zip(photos, gains, strict=True)], axis=-1)
        known = np.full(lit.shape[:2], len(photos))
        if colour is not None:
            hidden = np.linalg.norm(lit - np.asarray(colour, np.float32)[:, None], axis=2) < near
            hidden &= ~hidden.all(axis=-1, keepdims=True)
            known -= hidden.sum(axis=-1)
            lit[np.broadcast_to(hidden[:, :, None], lit.shape)] = np.inf
        lit.sort(axis=-1)  # what is hidden comes last
        middle = np.stack([known - 1, known], axis=-1)[:, :, None] // 2
        picture[rows] = _coded(np.take_along_axis(lit, middle, axis=-1).mean(axis=-1))
    return Photo(first.name, picture.reshape(first.pixels.shape), 16)


def _moved(photo: Photo, ground: Photo) -> Array:
    """Colours (n, c) of what stands out of the ground on a photo, in the light of the ground."""
    gains, reduction = _gains(ground, photo), choose_reduction(photo.size, None)
    coded = [_coded(0.5 + 0.5 * (_values(photo, rows) - _lit(ground, rows, gains))) for rows in bands(photo)]
    standout = stand_out(Photo(photo.name, np.concatenate(coded).reshape(photo.pixels.shape), 16), reduction)
    away = standout.distance > standout.levels[0]
    return np.asarray(reduced(photo, reduction).picture[away] * _gains(photo, ground))


def _values(photo: Photo, rows: slice) -> NDArray[np.float32]:
    """Rows of a photo ``(r, w, c)``, 0 black to 1 white."""
    part = photo.pixels[rows].astype(np.float32) / np.float32(photo.full_scale)
    return part.reshape(*part.shape[:2], photo.channels)


def _lit(photo: Photo, rows: slice, gains: Array) -> NDArray[np.float32]:
    """Rows of a photo with gains (c,)."""
    return np.asarray(_values(photo, rows) * gains, np.float32)


def _coded(values: NDArray[np.floating]) -> NDArray[np.uint16]:
    return np.asarray(np.rint(np.clip(values, 0.0, 1.0) * _CODES), np.uint16)


def _gains(photo: Photo, other: Photo) -> Array:
    """Gain (c,) of each colour that makes most of a photo as bright as another."""
    size = min(photo.size[0], 160), min(photo.size[1], 160)
    this, that = (reduce_area(one.pixels, size).reshape(-1, one.channels) / one.full_scale for one in (photo, other))
    return medians((that + _BLACK) / (this + _BLACK), axis=0)

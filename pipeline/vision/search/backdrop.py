"""A photo to a small picture of what stands out of the ground, whatever its colour and polarity.

The photo is reduced by averaging, the slowly varying ground (light fall-off, vignetting) is a robust surface of second
order per channel, and what is left is measured in standard deviations of the ground's own texture and noise, colours
together: a grey cable on grey metal and a red cable on green cloth give the same kind of picture.

A striped wire is two strips, and the one that stands out more passes for a cable. Fisher's discriminant between ground
and cable, with the scatter of the cable's own colours in it, is the direction of colour along which its stripes are
alike; a shadow beside it, which is the ground's colour but darker, mostly fades in it.

Units: grey values are fractions of full range; pixels of the reduced photo are called cells. The centre of cell
(i, j) is the photo pixel ``reduction * (i, j) + (reduction - 1) / 2``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array
from pipeline.vision.median import MAD_TO_STD, medians, robust_fit
from pipeline.vision.photo import Photo, reduce_area

Image = NDArray[np.float32]
CELLS_ACROSS = 8.0  # cells across a cable of known diameter in the reduced photo: a highlight of a fifth is still one
MIN_GROUND_STD = 0.002  # of full range; half a level of 8 bits: no ground is calmer than its rounding
_UNEVEN = 0.3  # of the step to the ground; cables of one colour with gloss, print and shade scatter by less
_STIFF = 0.01  # of the squared step, added to every colour's variance: colours that hardly differ are not chased
_CORE = 0.45  # of the depth around; cells of a mask nearer to its rim than that are mixed with the ground
_SHADE_COSINE, _DARKEST_SHADE = 0.97, 0.5  # of the ground's colour; a lamp leaves half of the light in a shadow
ROWS = 128  # px; worked on at a time: large photos shall not be held as single precision
_LEAST_CABLE = 0.25  # of what stands out; with less, its colours are those of shadow or of other things


@dataclass(frozen=True)
class Standout:
    """What stands out of the ground, at reduced resolution.

    Attributes
    ----------
    reduction : int
        Photo pixels per cell.
    offset_px : (u, v) px
        Photo pixel of the window's first pixel.
    residual : (h, w, c) float32
        Grey value minus ground.
    covariance : (c, c)
        Of the ground's residual: texture and noise at this resolution.
    picture : (h, w, c) float32
        The reduced photo.
    """

    reduction: int
    offset_px: tuple[int, int]
    residual: Image
    covariance: Array
    picture: Image

    @classmethod
    def of(cls, picture: Image, offset_px: tuple[int, int], reduction: int = 1) -> Standout:
        """A picture ``(h, w, c)`` taken as it is, without a ground."""
        return cls(reduction, offset_px, picture, np.eye(picture.shape[2]), picture)

    @cached_property
    def distance(self) -> Image:
        """Picture ``(h, w)``: colour distance from the ground in standard deviations of the ground."""
        whitener = np.linalg.cholesky(np.linalg.inv(self.covariance)).T
        white = cv2.transform(self.residual, whitener.astype(np.float32)) if len(whitener) > 1 else None
        if white is None:
            return np.abs(self.residual[..., 0]) * np.float32(whitener[0, 0])
        return np.asarray(np.sqrt(np.einsum("ijc,ijc->ij", white, white)), np.float32)

    @cached_property
    def levels(self) -> list[float]:
        """Levels of that distance above which something stands out: Otsu's, then those that split what is above it.

        Ground, shadow and cable are three classes. Levels are sought on the square root: noise and strong things get a
        like share of the range.
        """
        top = float(self.distance.max()) + 1e-9
        coded = (255.0 * np.sqrt(self.distance / np.float32(top))).astype(np.uint8)
        levels: list[float] = []
        for _ in range(3):
            code, _ = cv2.threshold(coded, 0, 255, cv2.THRESH_OTSU)
            levels.append(max(float((code + 0.5) / 255.0) ** 2 * top, 1e-9))
            coded = coded[coded > code]
            if coded.size < 2:
                break
        return levels

    def to_cells(self, uv: Array) -> Array:
        """Cells (n, 2) of photo pixels (n, 2), ``(u, v)``."""
        return (np.asarray(uv) - self.offset_px - (self.reduction - 1) / 2.0) / self.reduction

    def to_pixels(self, cells: Array) -> Array:
        """Photo pixels (n, 2) of cells (n, 2), ``(u, v)``."""
        return np.asarray(cells) * self.reduction + (self.reduction - 1) / 2.0 + self.offset_px


def choose_reduction(size: tuple[int, int], diameter_px: float | None) -> int:
    """Photo pixels per cell: a few cells across the cable if its diameter is known, a set picture size if not."""
    if diameter_px is None:
        return max(1, round(max(size) / 1000.0))  # a skeleton of so many cells takes 20 ms
    return max(1, int(diameter_px / CELLS_ACROSS))


def reduced(photo: Photo, reduction: int, window: tuple[int, int, int, int] | None = None) -> Standout:
    """The photo (or the ``window`` u0, v0, u1, v1 of it) reduced by averaging, taken as it is."""
    width, height = photo.size
    u0, v0, u1, v1 = window if window is not None else (0, 0, width, height)
    columns, rows = (u1 - u0) // reduction, (v1 - v0) // reduction
    part = photo.pixels[v0 : v0 + rows * reduction, u0 : u0 + columns * reduction]
    # Averages of 8 bits are kept in 8 bits: the rounding, 0.3 levels, is less than half of ``min_ground_std``.
    small = reduce_area(part, (columns, rows)).astype(np.float32)
    small *= np.float32(1.0 / photo.full_scale)
    return Standout.of(small[..., None] if small.ndim == 2 else small, (u0, v0), reduction)


def stand_out(photo: Photo, reduction: int, *, window: tuple[int, int, int, int] | None = None) -> Standout:
    """The photo (or the ``window`` u0, v0, u1, v1 of it) reduced, and the ground taken away."""
    small = reduced(photo, reduction, window)
    residual = _above_ground(small.picture)
    return replace(small, residual=residual, covariance=_covariance(residual))


def averaged(standout: Standout, size: int) -> Standout:
    """What stands out as the mean over a disc of ``size`` cells, against the ground's scatter of such means."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)).astype(np.float32)
    means = np.asarray(cv2.filter2D(standout.residual, -1, disc / disc.sum()), np.float32)
    residual = means.reshape(standout.residual.shape)
    return replace(standout, residual=residual, covariance=_covariance(residual))


def _above_ground(small: Image) -> Image:
    """The picture without a robust second-order surface of each channel."""
    height, width, channels = small.shape
    coarse_size = (min(width, 48), min(height, 48))
    coarse = cv2.resize(small, coarse_size, interpolation=cv2.INTER_AREA).reshape(-1, channels)
    x, y = np.meshgrid(_centred(coarse_size[0]), _centred(coarse_size[1]))
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1).reshape(-1, 6)
    u, v = np.vander(_centred(width), 3, increasing=True), np.vander(_centred(height), 3, increasing=True)
    by_row = np.empty((3, width, channels), np.float32)  # of each power of v
    for channel in range(channels):
        c = robust_fit(terms, coarse[:, channel].astype(np.float64))  # cable and objects are outliers of the ground
        by_row[..., channel] = np.array([[c[0], c[1], c[3]], [c[2], c[4], 0.0], [c[5], 0.0, 0.0]]) @ u.T
    # one matrix product for all channels: the surface in one pass over the picture, not six
    surface: Image = (v.astype(np.float32) @ by_row.reshape(3, -1)).reshape(small.shape)
    np.subtract(small, surface, out=surface)
    return surface


def _centred(count: int) -> Array:
    return np.asarray((np.arange(count) + 0.5) / count * 2.0 - 1.0)


def _covariance(residual: Image) -> Array:
    """Covariance of the ground's colours, without cable and objects."""
    # some ten thousand cells tell a standard deviation to one percent
    stride = max(1, int(np.sqrt(residual.shape[0] * residual.shape[1] / 3e4)))
    sample = residual[::stride, ::stride].reshape(-1, residual.shape[2]).T.copy()  # each channel in one piece
    off = np.abs(sample)
    spread = MAD_TO_STD * medians(off, axis=1) + MIN_GROUND_STD
    calm = sample[:, (off < 3.0 * spread[:, None]).all(axis=0)]
    enough = calm.shape[1] > len(calm) + 1
    covariance = np.atleast_2d(np.cov(calm, dtype=np.float64)) if enough else 0.0
    return covariance + MIN_GROUND_STD**2 * np.eye(len(sample))


def in_one_colour(photo: Photo, standout: Standout) -> Photo | None:
    """The photo as grey values along that direction; None where what stands out is of one brightness as it is."""
    cable, shadow = (standout.residual[part].astype(np.float64) for part in _cable_and_shadow(standout))
    channels, count = cable.shape[1], len(cable) + len(shadow)
    if channels == 1 or len(cable) < max(4 * channels, _LEAST_CABLE * count):
        return None
    core = np.concatenate([cable, shadow])
    seen = core @ np.linalg.solve(standout.covariance, np.median(core, axis=0))
    if np.std(seen) < _UNEVEN * np.median(seen):
        return None
    return _along(photo, cable, standout.covariance + shadow.T @ shadow / (len(shadow) + 1.0))


def _cable_and_shadow(standout: Standout) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Cells ``(h, w)`` in the middle of what stands out, and those of them whose colour is the ground's, dimmed."""
    mask = (standout.distance > standout.levels[0]).astype(np.uint8)
    depth = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    middle = (depth >= _CORE * cv2.dilate(depth, np.ones((9, 9), np.uint8))) & (mask > 0)
    ground = standout.picture - standout.residual
    less, light = -(standout.residual * ground).sum(axis=2), np.linalg.norm(ground, axis=2)
    sizes = np.linalg.norm(standout.residual, axis=2)
    shadow = (less > _SHADE_COSINE * sizes * light) & (sizes < _DARKEST_SHADE * light)
    return middle & ~shadow, middle & shadow


def bands(photo: Photo) -> Iterator[slice]:
    """The rows of a photo, some at a time."""
    return (slice(first, first + ROWS) for first in range(0, photo.size[1], ROWS))


def _along(photo: Photo, core: Array, ground: Array) -> Photo:
    """Grey values by the discriminant of colours ``(n, c)`` less the ground's, of a covariance ``(c, c)``."""
    step = np.median(core, axis=0)
    scatter = ground + np.cov(core.T) + _STIFF * (step @ step) * np.eye(len(step))
    weights = np.linalg.solve(scatter, step)
    weights *= np.sign(weights.sum()) / np.abs(weights).sum()
    darkest = float(np.minimum(weights, 0.0).sum())
    scaled = (65535.0 / photo.full_scale * weights).astype(np.float32)[None]
    grey = np.empty(photo.pixels.shape[:2], np.uint16)
    for rows in bands(photo):
        grey[rows] = np.rint(cv2.transform(photo.pixels[rows].astype(np.float32), scaled) - 65535.0 * darkest)
    return Photo(photo.name, grey, 16, photo)

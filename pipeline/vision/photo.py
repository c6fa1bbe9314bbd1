"""A file to a `Photo`: the one loader for photos and calibration pictures.

png, jpg, bmp and tif; 8 to 16 bit (12 bit stored in 16 too); grey, colour, alpha; any path. The photo is turned as its
EXIF orientation says, so pixel (0, 0) is the top-left pixel of what a person sees. Broken, empty, truncated or enormous
files come back as `pipeline.records.Rejected` with one sentence; dimensions are read before anything is decoded.

Colour channels stay in the order of OpenCV (blue, green, red); values stay integers as stored.
"""

from __future__ import annotations

import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import ImageOps

from pipeline.messages import Message, by_system
from pipeline.records import Rejected
from pipeline.settings.vision import PhotoSettings
from pipeline.vision.photo_file import BROKEN, is_sound, is_whole, opened, read_header

Pixels = NDArray[np.uint8 | np.uint16]


@dataclass(frozen=True)
class Photo:
    """A photo as displayed.

    Attributes
    ----------
    name : str
        For reports: relative to the specimen folder.
    pixels : (h, w) or (h, w, 3), uint8 or uint16
        Grey, or blue, green, red.
    bit_depth : int
        Bits that are used: 8, 10, 12, 14 or 16.
    taken : Photo or None
        The photo in all its colours, where this is one of them alone.
    """

    name: str
    pixels: Pixels
    bit_depth: int
    taken: Photo | None = None

    @property
    def full_scale(self) -> float:
        """Largest value a pixel can have."""
        return float(2**self.bit_depth - 1)

    @property
    def channels(self) -> int:
        """1 or 3."""
        return 1 if self.pixels.ndim == 2 else self.pixels.shape[2]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in px."""
        return self.pixels.shape[1], self.pixels.shape[0]


@dataclass(frozen=True)
class Closeup:
    """Window of a photo as one grey value, in which the cable is dark, and the photo pixel of its corner."""

    grey: NDArray[np.float32]
    origin_px: tuple[int, int]


def load_photo(path: Path, settings: PhotoSettings, *, name: str | None = None) -> Photo | Rejected:
    """Read one photo.

    Parameters
    ----------
    name : str, optional
        Name in reports; the file's name if not given.

    Returns
    -------
    Photo or Rejected
        Codes ``photo/missing``, ``photo/empty``, ``photo/too-large``, ``photo/too-small``, ``photo/unreadable``,
        ``photo/truncated``.
    """
    name = path.name if name is None else name
    try:
        if not stat.S_ISREG(path.stat().st_mode):  # opening a pipe would wait for whoever writes into it
            return Rejected(name, Message("photo/missing.no-file"))
        # OpenCV opens paths in the system's code page on Windows; bytes work everywhere.
        data = path.read_bytes()
    except OSError as error:
        return Rejected(name, Message("photo/missing.closed", why=by_system(error)))
    return decode_photo(data, settings, name=name)


def decode_photo(data: bytes, settings: PhotoSettings, *, name: str) -> Photo | Rejected:
    """Decode the bytes of a photo; see `load_photo`."""
    if not data:
        return Rejected(name, Message("photo/empty"))
    header = read_header(data)
    if header is None:  # HEIC and its like are boxes, the first of which tells the type of the file
        return Rejected(name, Message("photo/unreadable.convert" if data[4:8] == b"ftyp" else "photo/unreadable"))
    megapixels = header.width * header.height / 1e6
    if megapixels > settings.max_megapixels:
        said = Message("photo/too-large.pixels", megapixels=megapixels, limit=settings.max_megapixels)
        return Rejected(name, said)
    side = min(header.width, header.height)
    if side < settings.min_side_px:
        return Rejected(name, Message("photo/too-small", side_px=side, limit_px=settings.min_side_px))
    if not is_whole(data, header):
        return Rejected(name, Message("photo/truncated"))
    pixels = _decode(data) if is_sound(data, header.kind) else None
    if pixels is None:
        return Rejected(name, Message("photo/unreadable.damaged", kind=header.kind))
    return Photo(name=name, pixels=pixels, bit_depth=_bit_depth(pixels))


def reduce_area(pixels: Pixels, size: tuple[int, int]) -> Pixels:
    """Reduce a picture to ``size`` (width, height) by averaging.

    Halving by whole pixels is five times faster than one reduction by any factor, and the same mean.
    """
    while (
        pixels.shape[1] >= 2 * size[0]
        and pixels.shape[0] >= 2 * size[1]
        and not (pixels.shape[0] % 2 or pixels.shape[1] % 2)
    ):
        pixels = _mean_over(pixels, (pixels.shape[1] // 2, pixels.shape[0] // 2))
    return pixels if pixels.shape[1::-1] == size else _mean_over(pixels, size)


def sampled(picture: NDArray[Any], points: NDArray[np.floating]) -> NDArray[np.float32]:
    """Values ``(..., c)`` of a picture at points ``(..., 2)``, linear between pixels; its border goes on."""
    u, v = (np.ascontiguousarray(points[..., k], np.float32) for k in (0, 1))
    return np.asarray(cv2.remap(picture, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)


def straightened(
    picture: NDArray[Any], path: NDArray[np.floating], across: NDArray[np.floating], offsets: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Values ``(n, m, c)`` of a picture at ``offsets`` (m,) from points (n, 2) along unit vectors (n, 2)."""
    points = path[:, None] + offsets[:, None] * across[:, None]
    return sampled(picture, points).reshape(len(path), len(offsets), -1)


def values_at(photo: Photo, points: NDArray[np.floating]) -> NDArray[np.float32]:
    """Values ``(..., c)`` of a photo at points ``(..., 2)`` px as `sampled`, 0 black to 1 white."""
    # each coordinate by itself: along pairs a minimum takes ten times as long
    first, last = ([extreme(points[..., k]) for k in (0, 1)] for extreme in (np.min, np.max))
    low = np.clip(np.floor(first).astype(int) - 1, 0, np.subtract(photo.size, 1))
    high = np.clip(np.ceil(last).astype(int) + 2, low + 1, photo.size)
    part = photo.pixels[low[1] : high[1], low[0] : high[0]].astype(np.float32) / np.float32(photo.full_scale)
    return sampled(part, points - low).reshape(*points.shape[:-1], -1)


def levels(photo: Photo) -> tuple[float, float]:
    """Darkest and brightest of the broad parts of a picture, some sixty along its long side; 0 black, 1 white."""
    factor = max(1.0, max(photo.size) / 64.0)
    broad = reduce_area(photo.pixels, (max(1, int(photo.size[0] / factor)), max(1, int(photo.size[1] / factor))))
    return float(broad.min()) / photo.full_scale, float(broad.max()) / photo.full_scale


def _mean_over(pixels: Pixels, size: tuple[int, int]) -> Pixels:
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), pixels.dtype)


def _decode(data: bytes) -> Pixels | None:
    try:
        # turned by its orientation, without alpha
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
    except cv2.error:
        picture = None
    if picture is None:
        return _decode_by_pillow(data)
    if picture.dtype not in (np.uint8, np.uint16):
        return None
    return np.ascontiguousarray(picture)


def _decode_by_pillow(data: bytes) -> Pixels | None:
    """Variants that OpenCV does not know (4-bit tif, odd palettes)."""
    try:
        image = opened(data)
        if image is None:
            return None
        with image:
            turned = ImageOps.exif_transpose(image)
            if turned.mode in ("I;16", "I;16B", "I;16L"):
                return np.asarray(turned).astype(np.uint16)
            if turned.mode in ("1", "L", "LA"):
                return np.asarray(turned.convert("L"))
            if turned.mode in ("P", "RGB", "RGBA", "CMYK", "YCbCr"):
                return np.ascontiguousarray(np.asarray(turned.convert("RGB"))[..., ::-1])
    except BROKEN:
        return None
    return None


def _bit_depth(pixels: Pixels) -> int:
    """Bits in use: cameras store 10 to 14 bits in 16-bit files without saying so."""
    if pixels.dtype == np.uint8:
        return 8
    peak = int(pixels.max())
    return next((bits for bits in (8, 10, 12, 14) if peak < 2**bits), 16)

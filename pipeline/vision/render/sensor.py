"""From brightness to a picture file: blur of lens and motion, noise, tone, bits, channels, compression.

Noise has the two parts of every sensor: a constant one, and shot noise whose variance grows with the brightness.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]
Pixels = NDArray[np.uint8] | NDArray[np.uint16]


@dataclass(frozen=True)
class Sensor:
    """What happens behind the lens.

    Attributes
    ----------
    blur_px : float
        Standard deviation of the (Gaussian) lens blur.
    motion_px, motion_rad : float
        Length and direction of a motion blur.
    sharpen : float
        Unsharp masking by the camera's firmware, 0 for none; over a radius of ``1.5`` px.
    noise : float
        Standard deviation of the constant noise, of the full range.
    shot_noise : float
        Standard deviation of the shot noise at full brightness, of the full range.
    gamma : float
        Tone curve: value = brightness^(1/gamma).
    bit_depth : 8, 12 or 16
        12 is stored in 16 bits, so that a viewer shows it black.
    mode : str
        ``grey``, ``colour`` or ``alpha`` (colour with an opaque fourth channel).
    """

    blur_px: float = 0.8
    motion_px: float = 0.0
    motion_rad: float = 0.0
    sharpen: float = 0.0
    noise: float = 0.01
    shot_noise: float = 0.0
    gamma: float = 1.0
    bit_depth: int = 8
    mode: str = "grey"

    def __post_init__(self) -> None:
        if self.bit_depth not in (8, 12, 16):
            raise ValueError(f"bit depth {self.bit_depth} is none of 8, 12, 16")
        if self.mode not in ("grey", "colour", "alpha"):
            raise ValueError(f"mode {self.mode!r} is none of grey, colour, alpha")

    @property
    def channels(self) -> int:
        """Colour channels that are computed."""
        return 1 if self.mode == "grey" else 3


def expose(sensor: Sensor, brightness: Image, rng: np.random.Generator) -> Pixels:
    """Picture (h, w) or (h, w, 3 or 4; RGB) of a brightness (h, w, channels)."""
    picture = brightness
    if sensor.blur_px:
        picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), sensor.blur_px), np.float32)
    if sensor.motion_px:
        picture = np.asarray(cv2.filter2D(picture, -1, _streak(sensor.motion_px, sensor.motion_rad)), np.float32)
    picture = np.maximum(picture.reshape(brightness.shape), np.float32(0.0))
    if sensor.noise or sensor.shot_noise:
        shot = np.float32(sensor.shot_noise**2) * picture if sensor.shot_noise else np.float32(0.0)
        noise = rng.standard_normal(picture.shape, dtype=np.float32)
        picture += np.sqrt(np.float32(sensor.noise**2) + shot) * noise
    if sensor.gamma != 1.0:
        picture = np.maximum(picture, 0.0) ** np.float32(1.0 / sensor.gamma)
    if sensor.sharpen:
        soft = cv2.GaussianBlur(picture, (0, 0), 1.5).reshape(picture.shape)
        picture = picture + np.float32(sensor.sharpen) * (picture - soft)
    top = 2**sensor.bit_depth - 1
    counts = picture * top
    np.clip(np.rint(counts, out=counts), 0, top, out=counts)
    pixels: Pixels = counts.astype(np.uint8) if sensor.bit_depth == 8 else counts.astype(np.uint16)
    if sensor.mode == "grey":
        return pixels[:, :, 0]
    if sensor.mode == "alpha":
        opaque = np.full_like(pixels[:, :, :1], np.iinfo(pixels.dtype).max)
        return np.concatenate([pixels, opaque], axis=2)
    return pixels


def _streak(length_px: float, angle_rad: float) -> Image:
    half = int(np.ceil(length_px / 2)) + 1
    at = np.linspace(-length_px / 2, length_px / 2, 16 * half + 1)
    kernel, _, _ = np.histogram2d(
        at * np.sin(angle_rad), at * np.cos(angle_rad), bins=2 * half + 1, range=[[-half - 0.5, half + 0.5]] * 2
    )
    return np.asarray(kernel / kernel.sum(), np.float32)


def encode(pixels: Pixels, suffix: str, *, jpeg_quality: int = 95) -> bytes:
    """Bytes of a picture file of the kind ``suffix`` (``.png``, ``.jpg``, ``.bmp``, ``.tif``).

    Raises
    ------
    ValueError
        If the format cannot hold the picture (16 bit or alpha in JPEG or BMP).
    """
    suffix = suffix.lower()
    narrow = suffix in (".jpg", ".jpeg", ".bmp")
    if narrow and (pixels.dtype != np.uint8 or (pixels.ndim == 3 and pixels.shape[2] == 4)):
        raise ValueError(f"{suffix} holds neither 16 bit nor alpha")
    swapped = pixels
    if pixels.ndim == 3:
        swapped = pixels[:, :, [2, 1, 0]] if pixels.shape[2] == 3 else pixels[:, :, [2, 1, 0, 3]]
    options = [cv2.IMWRITE_JPEG_QUALITY, jpeg_quality] if suffix in (".jpg", ".jpeg") else []
    # PNG as OpenCV does it, by runs: any level asked for takes twice as long, and noise takes a tenth more room
    done, data = cv2.imencode(suffix, np.ascontiguousarray(swapped), options)
    if not done:
        raise ValueError(f"no encoder for {suffix}")
    return data.tobytes()


def write_picture(path: Path, pixels: Pixels, *, jpeg_quality: int = 95) -> None:
    """Write a picture file; the kind follows the suffix. See `encode`."""
    path.write_bytes(encode(pixels, path.suffix, jpeg_quality=jpeg_quality))

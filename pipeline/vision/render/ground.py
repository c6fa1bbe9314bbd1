"""Grounds a cable is photographed on: plain, brushed metal, or of any texture.

A ground is a picture of reflectances around its colour, made in pixels from a seed; it knows no camera.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.vision.render.sheath import Colour, ink

Image = NDArray[np.float32]
Rng = np.random.Generator
Texture = Callable[["Ground", int, int, Rng], Image]
"""Relative departure (h, w) from the ground's colour, of unit standard deviation."""


@dataclass(frozen=True)
class Ground:
    """What the cable lies on.

    Attributes
    ----------
    kind : str or callable
        ``plain``, ``brushed``, or what paints another texture.
    colour : (r, g, b)
    contrast : float
        Relative standard deviation of the texture (depth of the lines on squared paper).
    grain_px : float
        Size of the texture's finest part.
    angle_rad : float
        Direction of the grain, from u toward v.
    """

    kind: str | Texture = "plain"
    colour: Colour = (0.78, 0.78, 0.78)
    contrast: float = 0.0
    grain_px: float = 2.0
    angle_rad: float = 0.0

    def __post_init__(self) -> None:
        if isinstance(self.kind, str) and self.kind not in KINDS:
            raise ValueError(f"ground {self.kind!r} is none of {', '.join(KINDS)}")


def paint(ground: Ground, width: int, height: int, channels: int, rng: Rng) -> Image:
    """Reflectance (height, width, channels) of the ground."""
    colour = ink(ground.colour, channels).astype(np.float32)
    picture = np.empty((height, width, channels), np.float32)
    picture[:] = colour
    if ground.contrast:
        texture = KINDS[ground.kind] if isinstance(ground.kind, str) else ground.kind
        picture *= (1.0 + np.float32(ground.contrast) * texture(ground, width, height, rng))[:, :, None]
    return picture


def _plain(ground: Ground, width: int, height: int, rng: Rng) -> Image:
    return unit(noise(width, height, 60 * ground.grain_px, 60 * ground.grain_px, rng))


def _brushed(ground: Ground, width: int, height: int, rng: Rng) -> Image:
    fine = unit(streaks(ground, width, height, 25 * ground.grain_px, 0.5 * ground.grain_px, rng))
    broad = unit(streaks(ground, width, height, 60 * ground.grain_px, 3.0 * ground.grain_px, rng))
    return unit(fine + 0.5 * broad)


KINDS: dict[str, Texture] = {
    "plain": _plain,
    "brushed": _brushed,
}


def noise(width: int, height: int, along: float, across: float, rng: Rng) -> Image:
    """White noise smoothed to these standard deviations in px; wide ones are drawn on a coarser grid and enlarged."""
    fx, fy = max(1, int(along / 4)), max(1, int(across / 4))
    w, h = width // fx + 3, height // fy + 3
    small = cv2.GaussianBlur(
        rng.standard_normal((h, w), dtype=np.float32), (0, 0), sigmaX=along / fx, sigmaY=across / fy
    )
    if fx == 1 and fy == 1:
        return np.asarray(small[:height, :width], np.float32)
    return np.asarray(cv2.resize(small, (w * fx, h * fy), interpolation=cv2.INTER_CUBIC), np.float32)[:height, :width]


def streaks(ground: Ground, width: int, height: int, along: float, across: float, rng: Rng) -> Image:
    """Streaks in the direction of the grain."""
    if ground.angle_rad == 0.0:
        return noise(width, height, along, across, rng)
    side = int(np.hypot(width, height)) + 2
    flat = noise(side, side, along, across, rng)
    turn = cv2.getRotationMatrix2D((side / 2, side / 2), -np.degrees(ground.angle_rad), 1.0)
    turn[:, 2] -= np.array([(side - width) / 2, (side - height) / 2])
    turned = cv2.warpAffine(flat, turn, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(turned, np.float32)


def unit(texture: Image) -> Image:
    """The texture about zero, of unit standard deviation."""
    return np.asarray((texture - texture.mean()) / max(float(texture.std()), 1e-9), np.float32)

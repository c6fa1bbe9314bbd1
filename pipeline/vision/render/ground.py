"""Grounds a cable is photographed on: plain, brushed metal, cloth, wood, stone, squared paper.

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


@dataclass(frozen=True)
class Ground:
    """What the cable lies on.

    Attributes
    ----------
    kind : str
        ``plain``, ``brushed``, ``cloth``, ``wood``, ``stone`` or ``squared``.
    colour : (r, g, b)
    contrast : float
        Relative standard deviation of the texture (depth of the lines on squared paper).
    grain_px : float
        Size of the texture's finest part.
    angle_rad : float
        Direction of the grain, from u toward v.
    """

    kind: str = "plain"
    colour: Colour = (0.78, 0.78, 0.78)
    contrast: float = 0.0
    grain_px: float = 2.0
    angle_rad: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"ground {self.kind!r} is none of {', '.join(KINDS)}")


def paint(ground: Ground, width: int, height: int, channels: int, rng: Rng) -> Image:
    """Reflectance (height, width, channels) of the ground."""
    colour = ink(ground.colour, channels).astype(np.float32)
    picture = np.empty((height, width, channels), np.float32)
    picture[:] = colour
    if ground.contrast:
        picture *= (1.0 + np.float32(ground.contrast) * KINDS[ground.kind](ground, width, height, rng))[:, :, None]
    return picture


def _plain(ground: Ground, width: int, height: int, rng: Rng) -> Image:
    return _unit(_noise(width, height, 60 * ground.grain_px, 60 * ground.grain_px, rng))


def _brushed(ground: Ground, width: int, height: int, rng: Rng) -> Image:
    fine = _unit(_along(ground, width, height, 25 * ground.grain_px, 0.5 * ground.grain_px, rng))
    broad = _unit(_along(ground, width, height, 60 * ground.grain_px, 3.0 * ground.grain_px, rng))
    return _unit(fine + 0.5 * broad)


def _cloth(ground: Ground, width: int, height: int, rng: Rng) -> Image:
    u, v = _turned(ground, width, height)
    period = 2.0 * max(ground.grain_px, 1.5)
    weave = np.cos(2 * np.pi * u / period) * np.cos(2 * np.pi * v / period)
    folds = _unit(_noise(width, height, 150.0, 50.0, rng))
    threads = _unit(_along(ground, width, height, 15 * ground.grain_px, ground.grain_px, rng))
    return _unit(weave + 0.5 * folds + 0.2 * threads)


def _wood(ground: Ground, width: int, height: int, rng: Rng) -> Image:
    _, v = _turned(ground, width, height)
    bend = 60 * ground.grain_px * _unit(_along(ground, width, height, 300.0, 60.0, rng))
    rings = np.sin((v + bend) / (4.0 * ground.grain_px))
    pores = _unit(_along(ground, width, height, 20 * ground.grain_px, 0.5 * ground.grain_px, rng))
    return _unit(np.abs(rings) + 0.3 * pores)


def _stone(ground: Ground, width: int, height: int, rng: Rng) -> Image:
    speckle = np.abs(_unit(_noise(width, height, ground.grain_px, ground.grain_px, rng)))
    clouds = _unit(_noise(width, height, 30 * ground.grain_px, 30 * ground.grain_px, rng))
    return _unit(speckle + 0.4 * clouds)


def _squared(ground: Ground, width: int, height: int, rng: Rng) -> Image:
    u, v = _turned(ground, width, height)
    period = 25.0 * ground.grain_px
    lines = np.zeros((height, width), np.float32)
    for axis in (u, v):
        for every, depth in ((1.0, 0.5), (5.0, 1.0)):
            off = np.abs((axis / (every * period) + 0.5) % 1.0 - 0.5) * every * period
            lines = np.maximum(lines, depth * np.clip(1.0 + 0.4 * ground.grain_px - off, 0.0, 1.0))
    return -lines


KINDS: dict[str, Callable[[Ground, int, int, Rng], Image]] = {
    "plain": _plain,
    "brushed": _brushed,
    "cloth": _cloth,
    "wood": _wood,
    "stone": _stone,
    "squared": _squared,
}


def _turned(ground: Ground, width: int, height: int) -> tuple[Image, Image]:
    c, s = np.float32(np.cos(ground.angle_rad)), np.float32(np.sin(ground.angle_rad))
    u, v = np.arange(width, dtype=np.float32)[None, :], np.arange(height, dtype=np.float32)[:, None]
    return c * u + s * v, c * v - s * u


def _noise(width: int, height: int, along: float, across: float, rng: Rng) -> Image:
    """White noise smoothed to these standard deviations in px; wide ones are drawn on a coarser grid and enlarged."""
    fx, fy = max(1, int(along / 4)), max(1, int(across / 4))
    w, h = width // fx + 3, height // fy + 3
    small = cv2.GaussianBlur(
        rng.standard_normal((h, w), dtype=np.float32), (0, 0), sigmaX=along / fx, sigmaY=across / fy
    )
    if fx == 1 and fy == 1:
        return np.asarray(small[:height, :width], np.float32)
    return np.asarray(cv2.resize(small, (w * fx, h * fy), interpolation=cv2.INTER_CUBIC), np.float32)[:height, :width]


def _along(ground: Ground, width: int, height: int, along: float, across: float, rng: Rng) -> Image:
    """Streaks in the direction of the grain."""
    if ground.angle_rad == 0.0:
        return _noise(width, height, along, across, rng)
    side = int(np.hypot(width, height)) + 2
    flat = _noise(side, side, along, across, rng)
    turn = cv2.getRotationMatrix2D((side / 2, side / 2), -np.degrees(ground.angle_rad), 1.0)
    turn[:, 2] -= np.array([(side - width) / 2, (side - height) / 2])
    turned = cv2.warpAffine(flat, turn, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(turned, np.float32)


def _unit(texture: Image) -> Image:
    return np.asarray((texture - texture.mean()) / max(float(texture.std()), 1e-9), np.float32)

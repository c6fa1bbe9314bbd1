"""A second, simple renderer that shares nothing with the program's: what holds on its photos is not fitted to those.

Signed distance of every fine sample to the densely drawn cable, Lambert's law with a broad highlight on a cylinder, the
shadow a shifted and blurred mask, noise before demosaicing, tone curve, sharpening and JPEG as a camera does them.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from pipeline.vision.render import Curve, Picture

Array = NDArray[np.float64]
_FINE = 5  # samples across a pixel: leaves 1/30 px of one edge sample, nothing over a window of hundreds


@dataclass(frozen=True)
class Look:
    """How a photo looks: lengths in px, brightness in fractions of full range, the lamp a unit vector."""

    radius: float
    sheath: Array
    ground: Array
    lamp: Array
    ambient: float
    specular: float
    exponent: float
    shadow: float
    softness: float
    texture: float
    grain: float
    letters: bool
    blur: float
    noise: float
    gamma: float
    sharpen: float
    bayer: bool
    jpeg: int


def random_look(rng: np.random.Generator) -> Look:
    """Any usual photo of a dark cable on a brighter ground."""
    around, up = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.6, 0.5 * np.pi)
    return Look(
        radius=rng.uniform(10.0, 20.0),
        sheath=rng.uniform(0.05, 0.3, 3),
        ground=rng.uniform(0.55, 0.9, 3),
        lamp=np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)]),
        ambient=rng.uniform(0.3, 0.7),
        specular=rng.uniform(0.0, 0.3),
        exponent=rng.uniform(4.0, 30.0),
        shadow=rng.uniform(0.0, 0.5),
        softness=rng.uniform(0.2, 1.5),
        texture=rng.choice([0.0, 0.03]),
        grain=rng.uniform(1.0, 4.0),
        letters=bool(rng.random() < 0.3),
        blur=rng.uniform(0.6, 1.3),
        noise=rng.uniform(0.004, 0.03),
        gamma=rng.choice([1.0, 2.2]),
        sharpen=rng.choice([0.0, 0.6]),
        bayer=bool(rng.random() < 0.5),
        jpeg=int(rng.choice([0, 80, 92])),
    )


def photograph(curve: Curve, look: Look, diameter_m: float, rng: np.random.Generator) -> Picture:
    """Photo of a cable with open ends 3 mm beyond the bearing axes, the picture hardly larger than the bow."""
    scale = 2.0 * look.radius / diameter_m
    size = (int(scale * (curve.y.max() + 0.04)), int(scale * (curve.chord + 0.025)))
    u = (curve.x - 0.5 * curve.chord) * scale + 0.5 * size[1]
    v = (curve.y - 0.5 * curve.y.max()) * scale + 0.5 * size[0]
    axis = CubicSpline(curve.s * scale, np.column_stack([u, v]))
    s, t, normal, mask = _distances(axis, curve.s[-1] * scale, look.radius, size, 0.003 * scale)
    cover, shade = _cylinder(s, t, normal, look)
    coverage = np.zeros(size)
    coverage[mask] = cover
    shift = np.column_stack([np.eye(2), -look.radius / look.lamp[2] * look.lamp[:2]])
    dim = 1.0 - look.shadow * gaussian_filter(cv2.warpAffine(coverage, shift, size[::-1]), look.softness * look.radius)
    grain = gaussian_filter(rng.standard_normal(size), look.grain)
    dim *= (look.ambient + (1.0 - look.ambient) * look.lamp[2]) * (1.0 - coverage)
    picture = (look.ground + (look.texture * grain / grain.std())[..., None]) * dim[..., None]
    picture[mask] += shade
    ends = [(float(u[k]), float(v[k])) for k in (0, -1)]
    return Picture(_developed(picture, look, rng), curve, u, v, ends[0], ends[1])


def _distances(
    axis: CubicSpline, length: float, radius: float, size: tuple[int, int], beyond: float
) -> tuple[Array, Array, Array, tuple[NDArray[np.intp], ...]]:
    """Arc length, distance from the axis and normal at the pixels near the cable, and these pixels."""
    dense = np.linspace(0.0, length, int(2.0 * length))
    near = np.zeros(size, np.uint8)
    drawn = np.rint(np.vstack([axis(-beyond), axis(dense), axis(length + beyond)])).astype(np.int32)
    cv2.polylines(near, [drawn[:, None]], False, 1, int(2.0 * radius + 8.0))
    mask = np.nonzero(near)
    points = np.column_stack(mask[::-1]).astype(float)
    s = dense[cKDTree(axis(dense)).query(points)[1]]
    for _ in range(4):  # Newton's steps to the foot
        s = np.clip(s + ((points - axis(s)) * axis(s, 1)).sum(axis=1), -beyond, length + beyond)
    tangent, away = axis(s, 1), points - axis(s)
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    return s, (away * normal).sum(axis=1), normal, mask


def _cylinder(s: Array, t: Array, normal: Array, look: Look) -> tuple[Array, Array]:
    """Share of each pixel that the sheath covers, and its brightness there; a pixel's edge is straight."""
    cover, shade = np.zeros(len(s)), np.zeros((len(s), 3))
    half = (look.lamp + np.array([0.0, 0.0, 1.0])) / np.sqrt(2.0 + 2.0 * look.lamp[2])
    written = np.zeros((int(2.0 * look.radius), int(s.max()) + 2), np.uint8)
    for at in range(int(8.0 * look.radius), written.shape[1], int(22.0 * look.radius)) if look.letters else ():
        height = 1.2 * look.radius
        corner = (at, int(look.radius + 0.5 * height))
        cv2.putText(written, "NYM-J 3x1,5", corner, cv2.FONT_HERSHEY_SIMPLEX, height / 22.0, 255, 2, cv2.LINE_AA)
    for du in (np.arange(_FINE) + 0.5) / _FINE - 0.5:
        for dv in (np.arange(_FINE) + 0.5) / _FINE - 0.5:
            off = t + normal @ np.array([du, dv])
            along = s + normal @ np.array([-dv, du])
            across = np.clip(off / look.radius, -1.0, 1.0)
            facing = np.column_stack([across[:, None] * normal, np.sqrt(1.0 - across**2)])
            ink = map_coordinates(written, [off + look.radius, along], float, 1)[:, None] / 255.0
            lit = look.ambient + (1.0 - look.ambient) * np.maximum(facing @ look.lamp, 0.0)[:, None]
            glint = look.specular * np.maximum(facing @ half, 0.0)[:, None] ** look.exponent
            inside = np.abs(off) < look.radius
            cover += inside / _FINE**2
            shade += inside[:, None] * ((look.sheath + ink * (0.85 - look.sheath)) * lit + glint) / _FINE**2
    return cover, shade


def _developed(picture: Array, look: Look, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Blur, mosaic, noise, tone curve, sharpening, compression."""
    seen = gaussian_filter(picture, (look.blur, look.blur, 0.0))
    seen = np.clip(seen + look.noise * rng.standard_normal(seen.shape), 0.0, 1.0)
    if look.bayer:
        raw = seen[..., 1].copy()
        raw[0::2, 0::2], raw[1::2, 1::2] = seen[0::2, 0::2, 0], seen[1::2, 1::2, 2]
        seen = cv2.cvtColor(np.rint(65535.0 * raw).astype(np.uint16), cv2.COLOR_BayerBG2RGB) / 65535.0
    seen = seen ** (1.0 / look.gamma)
    seen = seen + look.sharpen * (seen - gaussian_filter(seen, (1.5, 1.5, 0.0)))
    pixels = np.clip(np.rint(255.0 * seen), 0.0, 255.0).astype(np.uint8)
    written = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, look.jpeg])[1] if look.jpeg else None
    return pixels if written is None else np.asarray(cv2.imdecode(written, cv2.IMREAD_UNCHANGED))

"""Light on the rendered cable and table: a cylinder's diffuse and glossy shading, soft shadows, fall-off.

Directions are given in picture axes: ``azimuth_rad`` is where the light comes from, from u toward v; ``elevation_rad``
above the table (pi/2: from straight above, the even light of a ring lamp or a light tent). Intensities are relative to
a white matt sheet that lies flat.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, pi, sin, sqrt, tan

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Image = NDArray[np.float32]


@dataclass(frozen=True)
class Light:
    """One distant lamp and the sky.

    Attributes
    ----------
    azimuth_rad, elevation_rad : float
        Direction the lamp shines from.
    ambient : float
        Share of light from everywhere, 0 to 1.
    shadow : float
        Darkness of the full cast shadow, 0 (none) to 1.
    softness : float
        Standard deviation of the shadow's border in units of the height of what casts it (cable: its diameter).
    gradient : (float, float)
        Relative change of the table's brightness from the left to the right border and from top to bottom.
    vignette : float
        Relative loss of brightness in the corners.
    strength : float
        Brightness of a white sheet, 1 is the sensor's full range.
    """

    azimuth_rad: float = -pi / 2
    elevation_rad: float = pi / 2
    ambient: float = 0.6
    shadow: float = 0.0
    softness: float = 0.35
    gradient: tuple[float, float] = (0.0, 0.0)
    vignette: float = 0.0
    strength: float = 1.0

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector toward the lamp: u, v, up."""
        flat = cos(self.elevation_rad)
        return flat * cos(self.azimuth_rad), flat * sin(self.azimuth_rad), sin(self.elevation_rad)

    def shadow_shift(self, height_px: float) -> tuple[float, float]:
        """Where the shadow of something ``height_px`` above the table falls, px in u and v."""
        reach = height_px / tan(max(self.elevation_rad, 0.1))
        return -reach * cos(self.azimuth_rad), -reach * sin(self.azimuth_rad)


EVEN = Light()
DIRECTIONAL = Light(elevation_rad=0.95, ambient=0.45, shadow=0.35)


def cylinder(
    light: Light, across: Array, normal_u: Array, normal_v: Array, *, gloss: float, shininess: float
) -> tuple[Array, Array]:
    """Diffuse and glossy brightness on a cylinder that lies flat.

    Parameters
    ----------
    light : Light
    across : (n,)
        Signed distance from the axis in radii, -1 to 1.
    normal_u, normal_v : (n,)
        Unit vector in the picture toward positive ``across``.
    gloss, shininess : float
        Strength and exponent of the highlight (Blinn's half vector; the eye is straight above).

    Returns
    -------
    diffuse, glossy : (n,)
        Factor on the sheath's colour, and light added on top of it.
    """
    lu, lv, lz = light.direction
    across = np.clip(across, -1.0, 1.0)
    up = np.sqrt(1.0 - across**2)
    slanted = across * (normal_u * lu + normal_v * lv)
    lambert = np.maximum(slanted + up * lz, 0.0)
    # Ambient light reaches the flank from half the sky only; a white sheet gets ambient + (1 - ambient) * lz.
    diffuse = light.strength * (light.ambient * (0.5 + 0.5 * up) + (1.0 - light.ambient) * lambert)
    if gloss == 0.0:  # a power takes as long as all else together
        return diffuse, np.zeros_like(diffuse)
    half = sqrt(2.0 + 2.0 * lz)
    return diffuse, light.strength * (gloss * np.maximum((slanted + up * (1.0 + lz)) / half, 0.0) ** shininess)


def sheet(light: Light, width: int, height: int) -> Image:
    """Brightness (height, width) of a white sheet on the table, without shadows."""
    u = np.linspace(-0.5, 0.5, width, dtype=np.float32)[None, :]
    v = np.linspace(-0.5, 0.5, height, dtype=np.float32)[:, None]
    base = light.strength * (light.ambient + (1.0 - light.ambient) * light.direction[2])
    bright = 1.0 + light.gradient[0] * u + light.gradient[1] * v
    if light.vignette:
        far = np.float32(width**2 + height**2)
        bright = bright * (1.0 - 4.0 * light.vignette * ((u * width) ** 2 + (v * height) ** 2) / far)
    return np.broadcast_to(np.float32(base) * bright, (height, width)).astype(np.float32)


def cast_shadow(light: Light, coverage: Image, height_px: float) -> Image:
    """Factor (h, w) on the table's brightness: shadow of ``coverage`` (h, w; 0 to 1), ``height_px`` above it."""
    du, dv = light.shadow_shift(height_px)
    h, w = coverage.shape
    moved = cv2.warpAffine(coverage, np.array([[1.0, 0.0, du], [0.0, 1.0, dv]]), (w, h), flags=cv2.INTER_LINEAR)
    border = max(light.softness * 2.0 * height_px, 0.5)
    # A wide blur needs no fine grid: at a quarter of its width the picture is band-limited to 1e-4.
    coarse = max(1, int(border / 4))
    small = cv2.resize(moved, (ceil(w / coarse), ceil(h / coarse)), interpolation=cv2.INTER_AREA)
    soft = cv2.resize(cv2.GaussianBlur(small, (0, 0), border / coarse), (w, h), interpolation=cv2.INTER_LINEAR)
    return (1.0 - light.shadow * soft).astype(np.float32)

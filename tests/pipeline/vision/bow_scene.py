"""A bow on a photo with known truth: equilibria of an exact quadrature, drawn by the renderer, traced from a poor path.

The rough path is the truth led astray by slow waves and scatter of a pixel or two, as the search for the cable leaves
it, so that these tests judge the sub-pixel measurement alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipeline.records import Centerline, Rejected
from pipeline.settings.vision import VisionSettings
from pipeline.vision.centerline.measurement import centerline_of, follow_cable
from pipeline.vision.render import Camera, Curve, Picture, Scene, Sensor, Strand, render
from pipeline.vision.render.lighting import EVEN, Light
from pipeline.vision.render.sheath import Sheath
from pipeline.vision.rough import Bearing, RoughCable
from pipeline.vision.scale.plane import PlaneMap
from pipeline.vision.search.ends import led_to_axes
from rod.characteristic import Characteristic
from tests.rod.elastica import natural_chord, uniform_equilibrium

LENGTH, DIAMETER, COVER = 0.181, 0.0046, 0.006
Array = NDArray[np.float64]


def bow(rng: np.random.Generator) -> Curve:
    """Equilibrium of a pre-curved stick-slip cable pushed by a random way."""
    K0, EI, share, knee = rng.uniform(0.3, 3.0), rng.uniform(8e-3, 2e-2), rng.uniform(0.3, 0.7), rng.uniform(3.0, 8.0)
    excess = np.linspace(-30.0, 30.0, 241)
    law = Characteristic.from_ordinates(
        excess, EI * (share + (1.0 - share) / np.cosh(excess / knee) ** 2), reading="tangent", abscissa="excess"
    )
    chord = natural_chord(LENGTH, K0) - rng.uniform(0.003, 0.02)
    shape = uniform_equilibrium(law, length=LENGTH, chord=chord, pre_curvature=K0, points=1001)
    return Curve(shape.s, shape.x, shape.y, shape.theta, shape.kappa)


def directional(rng: np.random.Generator) -> Light:
    """Lamp from the side with shadow and fall-off."""
    return Light(
        azimuth_rad=rng.uniform(0.0, 2.0 * np.pi),
        elevation_rad=rng.uniform(0.6, 1.2),
        ambient=rng.uniform(0.3, 0.6),
        shadow=rng.uniform(0.2, 0.5),
        softness=rng.uniform(0.15, 0.6),
        gradient=(rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2)),
    )


def bow_scene(
    rng: np.random.Generator,
    *,
    light: Light = EVEN,
    px_per_mm: float = 12.0,
    noise: float = 0.02,
    blur: float = 1.0,
    sheath: Sheath | None = None,
    camera: dict[str, Any] | None = None,
    **scene: Any,
) -> Scene:
    """Scene of a random bow, the picture hardly larger than the bow."""
    curve = bow(rng)
    view = Camera(
        width=int(px_per_mm * (LENGTH * 1e3 + 23.0)),
        height=int(px_per_mm * (curve.y.max() * 1e3 + 40.0)),
        px_per_m=px_per_mm * 1e3,
        look_at_m=(0.5 * curve.chord, 0.5 * curve.y.max()),
        roll_rad=rng.uniform(-0.05, 0.05),
        mirrored=bool(rng.random() < 0.3),
    )
    return Scene(
        cable=Strand(curve, diameter_m=DIAMETER, sheath=sheath or Sheath()),
        camera=replace(view, **(camera or {})),
        light=light,
        sensor=Sensor(blur_px=blur, noise=noise),
        seed=int(rng.integers(1 << 30)),
        **scene,
    )


def jpeg(pixels: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Picture after JPEG compression."""
    return np.asarray(cv2.imdecode(cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], -1))


def led_astray(picture: Picture, rng: np.random.Generator, *, spacing: float, amount: float) -> Array:
    """True path from left to right, with slow waves and scatter of about ``amount`` px."""
    path = np.column_stack([picture.u_px, picture.v_px])
    if path[0, 0] > path[-1, 0]:
        path = path[::-1]
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T))]
    spline, s = CubicSpline(along, path), np.linspace(0.0, along[-1], int(along[-1] / spacing))
    tangent = spline(s, 1)
    waves = sum(np.sin(4.0 * np.pi * k * s / along[-1] + rng.uniform(0.0, 2.0 * np.pi)) for k in (1, 2, 3, 4))
    off = amount * (0.5 * waves + 0.3 * rng.standard_normal(len(s)))
    return np.asarray(spline(s) + off[:, None] * np.column_stack([-tangent[:, 1], tangent[:, 0]]))


def rough_cable(
    scene: Scene, picture: Picture, rng: np.random.Generator, *, pixels: NDArray[Any] | None = None, dark: bool = True
) -> RoughCable:
    """What a search for the cable would hand over."""
    scale = scene.camera.px_per_m
    half, cover = 0.5 * DIAMETER * scale, COVER * scale
    path = led_astray(picture, rng, spacing=0.5 * half, amount=min(1.5, 0.06 * half))
    ends = [picture.left_px, picture.right_px]
    if ends[0][0] > ends[1][0]:
        ends.reverse()
    left, right = (Bearing(end, 0.03, cover, 0.1) for end in ends)
    places = np.linspace(0.0, len(path) - 1.0, 4 * len(path))  # as close as the cells of a search
    dense = np.column_stack([np.interp(places, np.arange(len(path)), each) for each in path.T])
    path, visible = led_to_axes(dense, (left, right), 2.1 * half)
    assert visible is not None
    shown = picture.pixels if pixels is None else pixels
    return RoughCable(
        image="photo.png",
        path_px=path,
        visible=visible,
        left=left,
        right=right,
        half_width_px=1.05 * half,
        grey=shown.astype(np.float32) / np.float32(np.iinfo(shown.dtype).max),
        origin_px=(0, 0),
        dark=dark,
        contrast=0.6,
    )


def measure_centerline(
    rough: RoughCable, *, plane: PlaneMap, diameter_m: float | None, settings: VisionSettings
) -> Centerline | Rejected:
    """Centerline of a cable on a single photo, or why there is none."""
    followed = follow_cable(rough, plane=plane, diameter_m=diameter_m)
    return followed if isinstance(followed, Rejected) else centerline_of(followed, settings)


def trace(
    scene: Scene,
    rng: np.random.Generator,
    *,
    quality: int | None = None,
    dark: bool = True,
    plane: PlaneMap | None = None,
    settings: VisionSettings | None = None,
) -> tuple[Picture, Centerline]:
    """Draw a scene and measure it; must not be refused."""
    picture = render(scene)
    pixels = None if quality is None else jpeg(picture.pixels, quality)
    found = measure_centerline(
        rough_cable(scene, picture, rng, pixels=pixels, dark=dark),
        plane=plane or PlaneMap.from_scale(scene.camera.px_per_m),
        diameter_m=DIAMETER,
        settings=settings or VisionSettings(),
    )
    assert not isinstance(found, Rejected), found.reason
    return picture, found


@dataclass(frozen=True)
class Errors:
    """Errors of a centerline against the truth, at its points.

    ``normal`` in px, ``kappa`` in 1/m, standard deviations by the program; ``inner`` leaves out the last 10 mm.
    """

    normal: Array
    normal_std: Array
    kappa: Array
    kappa_std: Array
    kappa_max: float
    inner: NDArray[np.bool_]
    seen: NDArray[np.bool_]

    def interior(self) -> float:
        """Rms error of kappa in the interior, % of kappa_max."""
        return 100.0 * float(np.sqrt(np.mean(self.kappa[self.inner] ** 2))) / self.kappa_max

    def ends(self) -> float:
        """Rms error of kappa in the last 10 mm, % of kappa_max."""
        return 100.0 * float(np.sqrt(np.mean(self.kappa[~self.inner] ** 2))) / self.kappa_max

    def position(self) -> float:
        """Rms distance of the seen midline from the true one, px."""
        return float(np.sqrt(np.mean(self.normal[self.seen] ** 2)))

    def covered(self) -> Array:
        """Points whose true kappa lies in the 95 % band, 0 or 1."""
        return (np.abs(self.kappa) < 1.96 * self.kappa_std).astype(float)


def errors(picture: Picture, found: Centerline, px_per_m: float) -> Errors:
    """Errors of a centerline against the scene it was measured on."""
    path, kappa = np.column_stack([picture.u_px, picture.v_px]), picture.curve.kappa
    if path[0, 0] > path[-1, 0]:
        path, kappa = path[::-1], kappa[::-1]
    s = found.shape.s * (LENGTH / found.shape.s[-1])
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T))]
    spline, points = CubicSpline(along, path), np.column_stack([found.u_px, found.v_px])
    at = s / LENGTH * along[-1]
    for _ in range(3):
        at = at + np.einsum("ij,ij->i", spline(at, 1), points - spline(at))
    tangent, away = spline(at, 1), points - spline(at)
    return Errors(
        normal=tangent[:, 0] * away[:, 1] - tangent[:, 1] * away[:, 0],
        normal_std=found.position_std * px_per_m,
        kappa=found.shape.kappa - CubicSpline(picture.curve.s, kappa)(s),
        kappa_std=found.kappa_std,
        kappa_max=float(kappa.max()),
        inner=(s > 0.01) & (s < LENGTH - 0.01),
        seen=found.shape.seen,
    )


def traced_errors(count: int, make: Any, *, seed: int, **options: Any) -> list[Errors]:
    """Errors on ``count`` scenes ``make(rng)``."""
    out = []
    for index in range(count):
        rng = np.random.default_rng([seed, index])
        scene = make(rng)
        out.append(errors(*trace(scene, rng, **options), scene.camera.px_per_m))
    return out


def rms(values: list[float]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))

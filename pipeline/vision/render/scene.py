"""Photos of a bending test drawn by the project itself: a described scene in, a picture and its exact truth out.

A `Scene` says everything: the cable's curve in metres (chord frame) and where it lies, sheath, light, ground, covers,
other objects, camera, sensor, seed. `render` draws it; the same scene gives the same picture. The truth (centerline and
bearing axes in pixels) comes from the scene's own curve through the scene's own camera, never from tracing.

Pixel (0, 0) is the centre of the top-left pixel. Edges are exact to 1e-3 px (see `pipeline.vision.render.strand`);
brightness is linear until the sensor's tone curve. Not modelled: the shift of a thick cable's outline seen from the
side (radius^2 X / distance^2, 0.03 px for a cable of 4.6 mm, 90 mm off the middle, from 400 mm) and light between
objects.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import sqrt
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.vision.render.clutter import ChessBoard, Cover, board_layer, cover_layers
from pipeline.vision.render.ground import Ground, paint
from pipeline.vision.render.lens import Camera
from pipeline.vision.render.lighting import EVEN, Light, cast_shadow, sheet
from pipeline.vision.render.sensor import Pixels, Sensor, expose
from pipeline.vision.render.strand import Curve, Layer, Strand, strand_layer

__all__ = ["Picture", "Scene", "render", "render_board"]

Array = NDArray[np.float64]
Image = NDArray[np.float32]


class Thing(Protocol):
    """An object below the cable."""

    def layers(self, camera: Camera, light: Light, channels: int) -> list[Layer]:
        """What it puts on the picture."""


@dataclass(frozen=True)
class Scene:
    """A photo to be taken.

    Attributes
    ----------
    cable : Strand
    camera : Camera
    covers : (Cover or None, Cover or None)
        On the axis at s = 0 and at s = L.
    light : Light
    ground : Ground
    others : tuple of Strand
        Cables that are not measured; they lie below the cable.
    things : tuple of Thing
        Objects below the cable.
    sensor : Sensor
    seed : int
        Of the noise.
    ground_seed : int
        Of the ground's texture: the photos of one rig have one.
    """

    cable: Strand
    camera: Camera = field(default_factory=Camera)
    covers: tuple[Cover | None, Cover | None] = field(default_factory=lambda: (Cover(), Cover()))
    light: Light = EVEN
    ground: Ground = field(default_factory=Ground)
    others: tuple[Strand, ...] = ()
    things: tuple[Thing, ...] = ()
    sensor: Sensor = field(default_factory=Sensor)
    seed: int = 0
    ground_seed: int = 0


@dataclass(frozen=True)
class Picture:
    """A rendered photo and its truth.

    Attributes
    ----------
    pixels : (h, w) or (h, w, 3 or 4) uint8 or uint16, RGB
    curve : Curve
        The cable's centerline in the chord frame.
    u_px, v_px : (n,) px
        The same points on the picture.
    left_px, right_px : (u, v) px
        Bearing axes, at s = 0 and s = L.
    """

    pixels: Pixels
    curve: Curve
    u_px: Array
    v_px: Array
    left_px: tuple[float, float]
    right_px: tuple[float, float]


def render(scene: Scene) -> Picture:
    """Draw a scene."""
    camera, channels = scene.camera, scene.sensor.channels
    layers = [layer for thing in scene.things for layer in thing.layers(camera, scene.light, channels)]
    draw: dict[str, Any] = {
        "camera": camera,
        "light": scene.light,
        "channels": channels,
        "blur_px": _before_pixels(scene.sensor),
    }
    layers += [strand_layer(strand, **draw) for strand in (*scene.others, scene.cable)]
    for cover, end in zip(scene.covers, _ends(scene.cable), strict=True):
        if cover is not None:
            layers += cover_layers(cover, end, **draw)
    pixels = _photograph(scene, layers)
    u, v = camera.project(*scene.cable.on_table(scene.cable.curve.x, scene.cable.curve.y))
    return Picture(pixels, scene.cable.curve, u, v, (float(u[0]), float(v[0])), (float(u[-1]), float(v[-1])))


def render_board(scene: Scene, board: ChessBoard) -> Pixels:
    """Calibration photo by the scene's camera: the board instead of cable, covers and objects."""
    blur = _before_pixels(scene.sensor)
    return _photograph(scene, [board_layer(board, scene.camera, scene.light, scene.sensor.channels, blur_px=blur)])


def _ends(cable: Strand) -> tuple[tuple[float, float], tuple[float, float]]:
    X, Y = cable.on_table(cable.curve.x[[0, -1]], cable.curve.y[[0, -1]])
    return (float(X[0]), float(Y[0])), (float(X[1]), float(Y[1]))


def _photograph(scene: Scene, layers: list[Layer]) -> Pixels:
    camera, channels = scene.camera, scene.sensor.channels
    picture = paint(scene.ground, camera.width, camera.height, channels, np.random.default_rng([scene.ground_seed, 1]))
    bright = sheet(scene.light, camera.width, camera.height)
    if scene.light.shadow:
        # The shadow's own thickness is taken from the cable for all: covers lie as high as the cable's upper side.
        high = scene.cable.diameter_m * camera.px_per_m
        bright *= cast_shadow(scene.light, _coverage(layers, camera), 0.5 * high)
    picture *= bright[:, :, None]
    flat = picture.reshape(-1, channels)
    for layer in layers:
        alpha = layer.alpha[:, None]
        flat[layer.index] = flat[layer.index] * (1.0 - alpha) + alpha * layer.colour
    rest = sqrt(scene.sensor.blur_px**2 - _before_pixels(scene.sensor) ** 2)
    return expose(replace(scene.sensor, blur_px=rest), picture, np.random.default_rng([scene.seed, 2]))


def _before_pixels(sensor: Sensor) -> float:
    """Part of the lens blur that acts on edges before the pixels sample them.

    At 0.6 px the sampled edges keep exp(-2 pi^2 0.6^2) = 1e-3 of the first alias; the rest blurs the sampled picture.
    """
    return min(sensor.blur_px, 0.6)


def _coverage(layers: list[Layer], camera: Camera) -> Image:
    mask = np.zeros(camera.height * camera.width, np.float32)
    for layer in layers:
        mask[layer.index] = np.maximum(mask[layer.index], layer.alpha)
    return mask.reshape(camera.height, camera.width)

"""What else lies in the picture: discs over the bearings; and the chessboard of a calibration.

All places are table metres, so that lens and tilt act on them as on the cable.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isinf, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from pipeline.vision.render.lens import Camera
from pipeline.vision.render.lighting import Light
from pipeline.vision.render.sheath import Colour, ink
from pipeline.vision.render.strand import Layer, disc_cover

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cover:
    """Round cover on a bearing axis.

    Attributes
    ----------
    diameter_m : float
    colour : (r, g, b)
    dot_m : float
        Diameter of the dot (screw, pin) on the axis; 0 for none.
    dot_colour : (r, g, b)
    sheen : float
        Relative change of brightness across the disc, toward the lamp.
    rim : float
        Darkness of a rim of a tenth of the radius, 0 for none.
    slot : bool
        A cross slot in the dot.
    """

    diameter_m: float = 0.012
    colour: Colour = (0.55, 0.55, 0.55)
    dot_m: float = 0.0025
    dot_colour: Colour = (0.05, 0.05, 0.05)
    sheen: float = 0.2
    rim: float = 0.0
    slot: bool = False


def cover_layers(
    cover: Cover, place_m: tuple[float, float], camera: Camera, light: Light, channels: int, *, blur_px: float = 0.0
) -> list[Layer]:
    """Layers of a bearing's cover: the disc, then its dot."""
    index, alpha, away = disc_cover(camera, place_m, 0.5 * cover.diameter_m, blur_px=blur_px)
    level = light.strength * (light.ambient + (1 - light.ambient) * light.direction[2])
    radius = 0.5 * cover.diameter_m * camera.px_per_m
    toward = (away[0] * np.cos(light.azimuth_rad) + away[1] * np.sin(light.azimuth_rad)) / radius
    shade = level * (1.0 + 0.5 * cover.sheen * toward)
    shade *= np.where(np.hypot(*away) > 0.9 * radius, 1.0 - cover.rim, 1.0)
    layers = [Layer(index, alpha, shade[:, None] * ink(cover.colour, channels))]
    if cover.dot_m:
        index, alpha, away = disc_cover(camera, place_m, 0.5 * cover.dot_m, blur_px=blur_px)
        colour = np.broadcast_to(level * ink(cover.dot_colour, channels), (index.size, channels)).copy()
        if cover.slot:
            slot = np.min(np.abs(away), axis=0) < 0.08 * cover.dot_m * camera.px_per_m
            colour[slot] *= 0.4
        layers.append(Layer(index, alpha, colour))
    return layers


@dataclass(frozen=True)
class ChessBoard:
    """Chessboard for the calibration, lying on the table or held at a tilt.

    Attributes
    ----------
    columns, rows : int
        Inner corners.
    square_m : float
    place_m : (X, Y) m
        Middle of the inner corners on the table.
    rotation : (3,) rad
        Rotation vector in table axes, third component about the table's normal; tilts need a finite camera distance.
    height_m : float
        Of its middle above the cable axis (on the table: minus half a diameter).
    """

    columns: int = 13
    rows: int = 7
    square_m: float = 0.010
    place_m: tuple[float, float] = (0.09, 0.03)
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    height_m: float = 0.0

    def homography(self, camera: Camera) -> Array:
        """Matrix (3, 3) from board metres (from its middle) to undistorted pixels from the picture's middle."""
        turn = cv2.Rodrigues(np.asarray(self.rotation, dtype=float))[0]
        if isinf(camera.distance_m) and np.hypot(*self.rotation[:2]) > 0:
            raise ValueError("a tilted board needs a finite camera distance")
        base = camera.homography(0.0)
        # homography(h) is linear in h: its derivative is the column by which heights enter.
        lift = camera.homography(1.0)[:, 2] - base[:, 2]
        spatial = np.column_stack([base[:, 0], base[:, 1], lift, base[:, 2]])
        pose = np.vstack([np.column_stack([turn[:, :2], [*self.place_m, self.height_m]]), [0.0, 0.0, 1.0]])
        return np.asarray(spatial @ pose)

    def corners(self, camera: Camera) -> Array:
        """Exact pixels (rows * columns, 2) of the inner corners, row by row."""
        a, b = np.meshgrid(np.arange(self.columns) - (self.columns - 1) / 2, np.arange(self.rows) - (self.rows - 1) / 2)
        points = np.stack([a.ravel() * self.square_m, b.ravel() * self.square_m, np.ones(a.size)])
        U, V, W = self.homography(camera) @ points
        return np.column_stack(camera.distort(U / W, V / W))


def board_layer(board: ChessBoard, camera: Camera, light: Light, channels: int, *, blur_px: float = 0.0) -> Layer:
    """Layer of a printed chessboard with a white border of one square, its edges blurred by a lens of ``blur_px``.

    Lens and pixel act as a Gaussian that is the same in all directions, so the blurred board is the product of two
    blurred square waves, exactly where the board is locally flat; a pixel counts with its variance 1/12.
    """
    back = np.asarray(np.linalg.inv(board.homography(camera)), np.float64)
    v, u = (a.ravel() for a in np.indices((camera.height, camera.width), dtype=np.float64))
    a, b = _on_board(back, camera, u, v)
    sigma = sqrt(blur_px**2 + 1.0 / 12.0) / camera.px_per_m
    half = 0.5 * board.square_m * np.array([board.columns + 3, board.rows + 3])
    sheet = np.prod([ndtr((h - np.abs(p)) / sigma) for h, p in zip(half, (a, b), strict=True)], axis=0)
    inner = np.prod([ndtr((h - board.square_m - np.abs(p)) / sigma) for h, p in zip(half, (a, b), strict=True)], axis=0)
    waves = [_wave(p, board.square_m, count, sigma) for p, count in ((a, board.columns), (b, board.rows))]
    white = 1.0 - inner * (0.5 - 0.5 * waves[0] * waves[1])
    level = light.strength * (light.ambient + (1 - light.ambient) * light.direction[2])
    seen = sheet > 1e-7
    shade = level * (0.06 + 0.84 * white[seen])
    return Layer(np.flatnonzero(seen), sheet[seen], np.broadcast_to(shade[:, None], (shade.size, channels)))


def _on_board(back: Array, camera: Camera, u: Array, v: Array) -> tuple[Array, Array]:
    du, dv = camera.undistort(u, v)
    a, b, w = (row[0] * du + row[1] * dv + row[2] for row in back)
    return a / w, b / w


def _wave(at: Array, square: float, corners: int, sigma: float) -> Array:
    """Square wave of +-1 that changes sign at the corners' lines, blurred by ``sigma``."""
    line = at / square + 0.5 * (corners - 1)
    near = np.clip(np.rint(line), 0, corners - 1)  # the outer border is drawn by the sheet, not by a sign
    return np.asarray((2.0 * ndtr((line - near) * square / sigma) - 1.0) * np.where(near % 2 == 0, 1.0, -1.0))

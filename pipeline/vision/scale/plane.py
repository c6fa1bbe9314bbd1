"""Pixels of the photo to metres on the plane of the cable axis, and back: points are carried, never pictures.

``pixel (u, v) -> undistorted pixel (lens) -> plane (x, y) in m (homography, at the height of the cable axis)``

A line is measured in the chord frame of its photo: origin at the left bearing axis, x through the right one, y to the
side on which the cable lies. Camera roll, a height difference of the bearings and a mirrored photo all end there.

Plane axes: right-handed as the pixel axes are (``x`` roughly along ``u``, ``y`` roughly along ``v``, downward on the
photo), origin anywhere: only differences matter, the chord frame follows from the bearing axes.
A plain scale is the trivial case, and a photo without any scale has one "metre" per pixel.

Lens model: Brown-Conrady with the coefficients of OpenCV (k1, k2, p1, p2, k3); ``(u, v) = K distort(K^-1 (u', v'))``.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.records import Array
from pipeline.vision.rough import RoughCable


@dataclass(frozen=True)
class Lens:
    """Camera matrix and distortion coefficients in the order of OpenCV (k1, k2, p1, p2, k3)."""

    camera: Array
    distortion: Array

    def distort(self, uv: Array) -> Array:
        """Photo pixels ``(n, 2)`` of the pixels a camera without distortion would have shown."""
        rays = np.column_stack([uv, np.ones(len(uv))]) @ np.linalg.inv(self.camera).T
        shown, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), self.camera, self.distortion)
        return np.asarray(shown, np.float64).reshape(-1, 2)

    def undistort(self, uv: Array) -> Array:
        """Inverse of `distort` (n, 2), by fixed-point steps.

        Each step leaves about three times the relative distortion of the error: at 5 % twenty steps reach rounding.
        """
        until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-9)  # px
        shown = np.asarray(uv, dtype=np.float64).reshape(-1, 1, 2)
        ideal = cv2.undistortImagePoints(shown, self.camera, self.distortion, None, until)
        return np.asarray(ideal, np.float64).reshape(-1, 2)


def project(matrix: Array, points: Array) -> Array:
    """Points ``(n, 2)`` carried by a homography ``(3, 3)``."""
    image = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    return np.asarray(image[:, :2] / image[:, 2:])


@dataclass(frozen=True)
class PlaneMap:
    """Map between photo pixels and metres on the plane of the cable axis.

    Attributes
    ----------
    homography : (3, 3)
        From undistorted pixels to the plane in m.
    """

    homography: Array
    lens: Lens | None = None

    @classmethod
    def from_scale(cls, px_per_m: float) -> PlaneMap:
        """Map of a camera looking straight down: one scale everywhere, origin at pixel (0, 0)."""
        return cls(np.diag([1.0 / px_per_m, 1.0 / px_per_m, 1.0]))

    def to_plane(self, uv: Array) -> Array:
        """Points ``(n, 2)`` in m of photo pixels ``(n, 2)``."""
        uv = np.asarray(uv, dtype=np.float64).reshape(-1, 2)
        return project(self.homography, uv if self.lens is None else self.lens.undistort(uv))

    def to_pixels(self, xy: Array) -> Array:
        """Photo pixels ``(n, 2)`` of points ``(n, 2)`` in m; inverse of `to_plane`."""
        back = np.asarray(np.linalg.inv(self.homography), np.float64)
        uv = project(back, np.asarray(xy, dtype=np.float64).reshape(-1, 2))
        return uv if self.lens is None else self.lens.distort(uv)

    def jacobian(self, uv: Array) -> Array:
        """Derivative ``(n, 2, 2)`` of the plane point with respect to the pixel, m/px, by central differences.

        The map is smooth over hundreds of pixels, so a step of one pixel leaves a relative error below 1e-6.
        """
        uv = np.asarray(uv, dtype=np.float64).reshape(-1, 2)
        steps = np.vstack([np.eye(2), -np.eye(2)])[:, None]
        forward_u, forward_v, back_u, back_v = self.to_plane((uv + steps).reshape(-1, 2)).reshape(4, -1, 2)
        return np.stack([forward_u - back_u, forward_v - back_v], axis=-1) / 2.0

    def local_scale(self, uv: Array) -> Array:
        """Scale ``(n,)`` in px/m at photo pixels: inverse square root of the area of a pixel."""
        return np.asarray(1.0 / np.sqrt(np.abs(np.linalg.det(self.jacobian(uv)))))


@dataclass(frozen=True)
class ChordFrame:
    """Pixels of the photo to the chord frame in m, and back.

    Attributes
    ----------
    origin : (2,) m
        Left bearing axis on the plane.
    rotation : (2, 2)
        Rows: unit vectors of x and y on the plane.
    chord, axis_std : m
        Distance of the axes; standard deviation of each axis' coordinates.
    mirrored : bool
        True if y points up on the photo.
    axis_parallax_std : relative
        As in `pipeline.records.Traces`; no part of ``axis_std``.
    marked : bool
        Covers or a person mark both axes; else they are where the cable is seen to end.
    """

    plane: PlaneMap
    origin: Array
    rotation: Array
    chord: float
    axis_std: float
    mirrored: bool
    axis_parallax_std: float = 0.0
    marked: bool = True

    @property
    def axes(self) -> Array:
        """Left and right bearing axis in the frame, ``(2, 2)``."""
        return np.array([[0.0, 0.0], [self.chord, 0.0]])

    def to_frame(self, uv: Array) -> Array:
        """Chord frame ``(n, 2)`` in m of pixels ``(n, 2)``."""
        return np.asarray((self.plane.to_plane(uv) - self.origin) @ self.rotation.T)

    def to_pixels(self, xy: Array) -> Array:
        """Pixels ``(n, 2)`` of points ``(n, 2)`` of the chord frame."""
        return self.plane.to_pixels(xy @ self.rotation + self.origin)


def chord_frame(rough: RoughCable, plane: PlaneMap, axis_parallax_std: float = 0.0) -> ChordFrame:
    """Chord frame of a photo by its bearing axes and the side on which its cable lies."""
    pixels = np.array([rough.left.center_px, rough.right.center_px])
    left, right = plane.to_plane(pixels)
    chord = float(np.hypot(*(right - left)))
    along = (right - left) / chord
    across = np.array([-along[1], along[0]])
    bow = float(np.mean((plane.to_plane(rough.seen_px) - left) @ across))
    toward = across if bow >= 0.0 else -across
    std = np.hypot(rough.left.std_px, rough.right.std_px) / np.sqrt(2.0)
    return ChordFrame(
        plane=plane,
        origin=left,
        rotation=np.stack([along, toward]),
        chord=chord,
        axis_std=float(std / np.median(plane.local_scale(pixels))),
        mirrored=bool(toward[1] < 0.0),
        axis_parallax_std=axis_parallax_std,
        marked={rough.left.kind, rough.right.kind} <= {"cover", "given"},
    )

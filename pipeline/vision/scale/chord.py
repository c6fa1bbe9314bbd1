"""The chord frame of one photo: pixels to metres with the bearing axes as the only reference.

Origin at the left bearing axis, x through the right one, y to the side on which the cable lies. Camera roll, a height
difference of the bearings, a mirrored photo and a bow up or down all end here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.records import Array
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.plane import PlaneMap


@dataclass(frozen=True)
class ChordFrame:
    """Pixels of the photo to the chord frame in m, and back.

    Attributes
    ----------
    plane : PlaneMap
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
    first, last = rough.visible
    bow = float(np.mean((plane.to_plane(rough.path_px[first : last + 1]) - left) @ across))
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

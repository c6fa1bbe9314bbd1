"""What the photos of a series tell of each other's bearings: one stands still, the other goes where the log says.

``given axes, travel -> axes on a photo`` before it is searched; ``all photos -> the fixed axis, photos on which another
thing was taken for its cover`` after all were. The photos are of one camera position; px.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array, Side
from pipeline.vision.bearings.covers import PixelPair
from pipeline.vision.rough import Bearing, RoughCable
from pipeline.vision.scale.plane import PlaneMap

_SIDES: tuple[Side, Side] = ("left", "right")
_LEAST_STEADY = 3  # photos; of two that differ nothing tells which one shows the fixed bearing in its place
_ASTRAY = 4.0  # standard deviations; a cover that stands still is found so far away on one photo in 3,000
_STEADY_SHARE = 0.6  # of the photos; so many show the fixed bearing in one place, or the camera moved


def moved_axes(axes: PixelPair, moving: Side, travel: float, plane: PlaneMap) -> PixelPair:
    """Left and right axis, px, after the moving bearing went ``travel`` (m) toward the fixed one, in their plane.

    A lens or a tilt shows a millimetre longer in one place than in another.
    """
    ends = plane.to_plane(np.array(axes, float))
    side = 0 if moving == "left" else 1
    toward = ends[1 - side] - ends[side]
    ends[side] += travel * toward / np.hypot(*toward)
    (u, v), fixed = plane.to_pixels(ends)[side], axes[1 - side]
    moved = float(u), float(v)
    return (moved, fixed) if side == 0 else (fixed, moved)


@dataclass(frozen=True)
class Fixed:
    """The fixed bearing over the photos of a series.

    Attributes
    ----------
    side : str
        Of the photos.
    cover : Bearing
        As most photos show it.
    play_px : px
        How far it may move.
    astray : tuple of int
        Photos on which something else was taken for it.
    """

    side: Side
    cover: Bearing
    play_px: float
    astray: tuple[int, ...]

    def taken(self, cable: RoughCable) -> Bearing:
        """What was taken for it on a photo."""
        return cable.axes[_SIDES.index(self.side)]

    def apart_px(self, cable: RoughCable) -> float:
        """Distance of what was taken for it from where it stands."""
        return float(np.hypot(*np.subtract(self.taken(cable).center_px, self.cover.center_px)))

    def is_shown_by(self, cable: RoughCable) -> bool:
        """Whether a photo shows it where it stands, but for its play and to its error."""
        return bool(self.apart_px(cable) <= np.hypot(self.play_px, _ASTRAY * self.taken(cable).std_px))

    def doubted(self, cable: RoughCable) -> RoughCable:
        """The cable with a cover on its side that may be another thing's."""
        axis = replace(self.taken(cable), sure=False)
        return replace(cable, left=axis) if self.side == "left" else replace(cable, right=axis)


def fixed_cover(found: Sequence[RoughCable], play_px: float) -> Fixed | None:
    """The cover that stands still on most photos, but for its play and to its error; None where none does."""
    if len(found) < _LEAST_STEADY:
        return None
    steady = _is_steady(found, play_px)
    side = int(np.argmax(steady.sum(axis=0)))
    still = [cable.axes[side] for cable, there in zip(found, steady[:, side], strict=True) if there]
    group = [axis for axis in still if axis.kind == "cover"]
    if len(group) < max(_LEAST_STEADY - 1, _STEADY_SHARE * len(found)):
        return None
    middle = np.median([axis.center_px for axis in group], axis=0)
    surest = min(group, key=lambda axis: axis.std_px)
    cover = replace(surest, center_px=(float(middle[0]), float(middle[1])))
    return Fixed(_SIDES[side], cover, play_px, tuple(int(k) for k in np.flatnonzero(~steady[:, side])))


def wandering_px(found: Sequence[RoughCable], play_px: float) -> tuple[Side, float, float]:
    """Which axis is fixed, what it wanders beyond its play and errors, rms of a coordinate, and how far it went.

    Zero if it stands still.
    """
    if len(found) < 2:
        return "left", 0.0, 0.0
    went = np.hypot(*np.ptp(_places(found), axis=0).T)
    side = int(np.argmin(went))
    given = any(cable.left.kind == "given" for cable in found)
    if given or _is_steady(found, play_px)[:, side].all():
        return _SIDES[side], 0.0, 0.0
    return _SIDES[side], float(np.sqrt(np.mean(np.var(_places(found)[:, side], axis=0)))), float(went[side])


def _places(found: Sequence[RoughCable]) -> Array:
    """Left and right axis ``(n, 2, 2)`` px."""
    return np.array([[axis.center_px for axis in cable.axes] for cable in found])


def _is_steady(found: Sequence[RoughCable], play_px: float) -> NDArray[np.bool_]:
    """Whether the left and the right axis ``(n, 2)`` lie where most photos show them, but for play and errors."""
    places, std = _places(found), np.array([[axis.std_px for axis in cable.axes] for cable in found])
    off = np.linalg.norm(places - np.median(places, axis=0), axis=2)
    return np.asarray(off <= np.hypot(play_px, _ASTRAY * std))

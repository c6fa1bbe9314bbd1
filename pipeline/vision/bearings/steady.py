"""What the photos of a series tell of each other's bearings: one stands still, the other goes where the log says.

``near photo, travel -> covers to be expected`` before a photo is searched; ``all photos -> the fixed axis -> photos on
which another thing was taken for its cover`` after all were. The photos are of one camera position; px.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.records import Array, Side
from pipeline.vision.rough import Bearing, RoughCable
from pipeline.vision.scale.plane import PlaneMap

Pair = tuple[tuple[float, float], tuple[float, float]]

_LEAST_STEADY = 3  # photos; of two that differ nothing tells which one shows the fixed bearing in its place
_ASTRAY = 4.0  # standard deviations; a cover that stands still is found so far away on one photo in 3,000
_STEADY_SHARE = 0.6  # of the photos; so many show the fixed bearing in one place, or the camera moved


def moved_axes(axes: Pair, moving: Side, travel: float, plane: PlaneMap) -> Pair:
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


def expected_covers(near: RoughCable, moving: Side, travel: float, plane: PlaneMap | None) -> tuple[Bearing, ...]:
    """Covers of a photo taken ``travel`` (m) of the moving bearing after the photo ``near``.

    Both where they were, for the log may name the other bearing, and the moving one where the travel puts it (nowhere
    if that is NaN, or without a plane).
    """
    covers = (near.left, near.right)
    if plane is None or not np.isfinite(travel):
        return covers
    places = moved_axes((near.left.center_px, near.right.center_px), moving, travel, plane)
    side = 0 if moving == "left" else 1
    return (*covers, replace(covers[side], center_px=places[side]))


@dataclass(frozen=True)
class Fixed:
    """The fixed bearing over the photos of a series.

    Attributes
    ----------
    side : str
        Of the photos.
    cover : Bearing
        As most photos show it.
    astray : tuple of int
        Photos on which something else was taken for it.
    """

    side: Side
    cover: Bearing
    astray: tuple[int, ...]


def fixed_cover(found: Sequence[RoughCable], play_px: float) -> Fixed | None:
    """The cover that stands still on most photos, but for its play and to its error; None where none does."""
    if len(found) < _LEAST_STEADY:
        return None
    steady = np.stack([_off_middle(found, side) <= _reach(found, side, play_px) for side in _SIDES])
    side = int(np.argmax(steady.sum(axis=1)))
    still = [_axis(cable, _SIDES[side]) for cable, there in zip(found, steady[side], strict=True) if there]
    group = [axis for axis in still if axis.kind == "cover"]
    if len(group) < max(_LEAST_STEADY - 1, _STEADY_SHARE * len(found)):
        return None
    middle = np.median([axis.center_px for axis in group], axis=0)
    surest = min(group, key=lambda axis: axis.std_px)
    cover = replace(surest, center_px=(float(middle[0]), float(middle[1])))
    return Fixed(_SIDES[side], cover, tuple(int(k) for k in np.flatnonzero(~steady[side])))


def wandering_px(found: Sequence[RoughCable], play_px: float) -> tuple[Side, float, float]:
    """Which axis is fixed, what it wanders beyond its play and errors, rms of a coordinate, and how far it went.

    Zero if it stands still.
    """
    if len(found) < 2:
        return "left", 0.0, 0.0
    went = [float(np.hypot(*np.ptp(_places(found, side), axis=0))) for side in _SIDES]
    side = _SIDES[int(np.argmin(went))]
    given = any(cable.left.kind == "given" for cable in found)
    if given or (_off_middle(found, side) <= _reach(found, side, play_px)).all():
        return side, 0.0, 0.0
    return side, float(np.sqrt(np.mean(np.var(_places(found, side), axis=0)))), min(went)


def apart_px(cable: RoughCable, fixed: Fixed) -> float:
    """Distance of what was taken for the fixed cover from where it stands."""
    return float(np.hypot(*np.subtract(_axis(cable, fixed.side).center_px, fixed.cover.center_px)))


def stands_still(cable: RoughCable, fixed: Fixed, play_px: float) -> bool:
    """Whether a photo shows the fixed cover where it stands, but for its play and to its error."""
    return bool(apart_px(cable, fixed) <= _reach([cable], fixed.side, play_px)[0])


def is_sure(cable: RoughCable, side: Side) -> bool:
    """True if nothing else can have been taken for the cover: it stands where it was found."""
    return _axis(cable, side).sure


def doubted(cable: RoughCable, side: Side) -> RoughCable:
    """The cable with a cover on one side that may be another thing's."""
    axis = replace(_axis(cable, side), sure=False)
    return replace(cable, left=axis) if side == "left" else replace(cable, right=axis)


_SIDES: tuple[Side, Side] = ("left", "right")


def _axis(cable: RoughCable, side: Side) -> Bearing:
    return cable.left if side == "left" else cable.right


def _places(found: Sequence[RoughCable], side: Side) -> Array:
    """Axes ``(n, 2)`` px."""
    return np.array([_axis(cable, side).center_px for cable in found])


def _reach(found: Sequence[RoughCable], side: Side, play_px: float) -> Array:
    """How far from its place each photo may show an axis that stands still."""
    return np.hypot(play_px, _ASTRAY * np.array([_axis(cable, side).std_px for cable in found]))


def _off_middle(found: Sequence[RoughCable], side: Side) -> Array:
    """Distance of each photo's axis from the median of all."""
    places = _places(found, side)
    return np.asarray(np.hypot(*(places - np.median(places, axis=0)).T))

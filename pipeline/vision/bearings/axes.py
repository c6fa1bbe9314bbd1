"""The two bearing axes on a photo: round covers, pixels given by the user, or the visible ends of the cable.

Left and right are those of the photo as displayed: the left axis has the smaller ``u``. Where the chord stands
within ``VERTICAL_DEG`` of the vertical (camera turned by 90 degrees), the upper axis is called left on a
single photo; over a series the bearing that moves decides (`pipeline.vision.series`).
Units: px.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.records import Array
from pipeline.vision.bearings.covers import find_again, find_cover
from pipeline.vision.bearings.rim import RADIUS_STD, Circle, Radius
from pipeline.vision.photo import Photo
from pipeline.vision.rough import AxisKind, Bearing
from pipeline.vision.search.ends import CableEnd

PixelPair = tuple[tuple[float, float], tuple[float, float]]

VERTICAL_DEG = 10.0  # degrees; a chord nearer to the vertical has no left end that a person would agree on
_GIVEN_STD_PX = 1.0  # px; how well a person reads an axis off a screen
_RADIUS_STD_BY_CABLE = 0.05  # relative; where only the cable's width on the photo tells the scale
_SAME_END = 0.1  # radii of a cover, rad and relative; strips that end so near and alike show one cover or none
_END_STD_WIDTHS = 0.1  # widths; a cut or clamped end is found to about a tenth of the cable's width


@dataclass(frozen=True)
class BearingHints:
    """What is known about the bearings before the photo is looked at.

    Attributes
    ----------
    cover_px : px or None
        Diameter of the round covers, from their size and the scale.
    cover_widths : float or None
        Their diameter in diameters of the cable, where the scale is not known.
    given_px : pair of (u, v) or None
        Axes by the user.
    seen : tuple of Bearing
        Covers of a neighbouring photo, where they are to be expected on this one.
    sought : list
        Where strips end on this photo, and the cover found there or not.
    """

    cover_px: float | None = None
    cover_widths: float | None = None
    given_px: PixelPair | None = None
    seen: tuple[Bearing, ...] = ()
    sought: list[tuple[Array, Circle | None]] = field(default_factory=list, compare=False)

    def cover_radius(self, width_px: float) -> float | None:
        """Expected radius of a cover in px; None if there are no covers."""
        if self.cover_px is not None:
            return 0.5 * self.cover_px
        return None if self.cover_widths is None else 0.5 * self.cover_widths * width_px


def find_bearings(
    photo: Photo, ends: tuple[CableEnd, CableEnd], width_px: float, hints: BearingHints
) -> tuple[Bearing | None, Bearing | None]:
    """Axes at the two ends of the cable, in the order of ``ends``; None from the first cover on that is not found."""
    if hints.given_px is not None:
        return _assign_given(ends, hints.given_px)
    radius = hints.cover_radius(width_px)
    if radius is None:
        return _visible_end(ends[0], width_px), _visible_end(ends[1], width_px)
    std = RADIUS_STD if hints.cover_px is not None else _RADIUS_STD_BY_CABLE
    expected = Radius(radius, std)
    axes: list[Bearing | None] = [None, None]
    for k, end in enumerate(ends):
        circle = find_again(photo, end, hints.seen, expected)
        # strips of all readings of a photo end at a few places: each is searched once
        known = np.concatenate([end.place / radius, end.outward, np.log([radius, width_px])])
        alike = [found for other, found in hints.sought if np.abs(known - other).max() < _SAME_END]
        if circle is None and not alike:
            alike = [find_cover(photo, end, expected, width_px)]
            hints.sought.append((known, alike[0]))
        circle = circle or alike[0]
        if circle is None:
            break  # one is not enough, whatever the other would be
        axes[k] = circle.as_bearing()
    return axes[0], axes[1]


def _assign_given(ends: tuple[CableEnd, CableEnd], given: PixelPair) -> tuple[Bearing, Bearing]:
    a, b = np.array(given[0], float), np.array(given[1], float)
    straight = np.hypot(*(a - ends[0].place)) + np.hypot(*(b - ends[1].place))
    crossed = np.hypot(*(b - ends[0].place)) + np.hypot(*(a - ends[1].place))
    first, second = (a, b) if straight <= crossed else (b, a)
    bearings = [Bearing((float(p[0]), float(p[1])), _GIVEN_STD_PX, kind="given") for p in (first, second)]
    return bearings[0], bearings[1]


def _visible_end(end: CableEnd, width_px: float) -> Bearing:
    kind: AxisKind = "clamp" if end.at_object else "end"
    std = _END_STD_WIDTHS * width_px
    return Bearing((float(end.place[0]), float(end.place[1])), std, kind=kind)


def left_first(first: Array, second: Array) -> bool:
    """True if ``first`` (u, v) is the left axis by the convention of this module."""
    du, dv = np.asarray(second, float) - np.asarray(first, float)
    if abs(du) <= np.tan(np.radians(VERTICAL_DEG)) * abs(dv):
        return bool(dv > 0)
    return bool(du > 0)

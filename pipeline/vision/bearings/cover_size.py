"""Round bearing covers whose diameter nobody gave: found by what the ends of the cable vanish under.

``photos with a cable from visible end to visible end -> circles of 1.4 to 6 diameters of it at both ends -> radius``

White bands, letters and shadows hide the last of a cable, so it is lost on the rim of its cover or ahead of it. One
radius must serve both ends of several photos, all round: then it is what the user would have given as
``bearing_marker_mm``, and each photo is searched again with it. At one end at least the cable must be lost so near that
the circle is no dot or screw, which lies farther ahead.

A cover with a raised edge, a bevel or a groove shows several circles about one axis; its rim is the largest.
Units: px.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from pipeline.records import Array
from pipeline.vision.bearings.covers import find_rim
from pipeline.vision.bearings.rim import SAME_RADIUS, SEARCH_RADII, SURE_RIM, Circle, Radius
from pipeline.vision.median import median
from pipeline.vision.photo import Photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.search.ends import CableEnd
from pipeline.vision.search.strips import end_direction

_COVER_RADII_WIDTHS = (0.62, 3.2)
"""Widths of the cable; range of radii searched where no size is given: covers of 1.4 to 6 diameters, and the mask may
be a tenth wider or narrower than the cable; a smaller one shows too little of its rim.
"""
_LOST_CABLE_REACH = 3.1  # radii from where a cable is lost to the centre of its cover: as far as that is searched
_LOST_BEFORE_RIM = 1.9
"""Radii; the same at one end at least: letters up to the rim hide 0.9 of it, a dot of half the cover's size lies two of
its own radii ahead.
"""


class _LostEnd(NamedTuple):
    """Where a cable is lost on a photo, and the circles of all sizes that are seen nearly all round there."""

    place: Array
    circles: list[Circle]

    def as_large(self, radius: float) -> Circle | None:
        """The circle most nearly of some radius; None if there is none about as large near enough."""
        near = [circle for circle in self.circles if self.ahead(circle) <= _LOST_CABLE_REACH]
        found = min(near, key=lambda circle: abs(circle.radius - radius), default=None)
        return None if found is None or abs(found.radius - radius) > SAME_RADIUS * radius else found

    def ahead(self, circle: Circle) -> float:
        """Distance of a circle's centre from the end of the cable, in radii."""
        return float(np.hypot(*(np.array(circle.center) - self.place)) / circle.radius)


def cover_radius(seen: Iterable[tuple[Photo, RoughCable]]) -> float | None:
    """Radius of the covers under which the cable's ends vanish.

    Parameters
    ----------
    seen : iterable of (Photo, RoughCable)
        Photos of one camera position with the cable from visible end to visible end; two tell as much as all.

    Returns
    -------
    px or None
        None unless one radius fits both ends on every photo: that of the largest circle that is seen at all ends.
    """
    ends = [
        _LostEnd(end.place, _circles(photo, end, 2.0 * cable.half_width_px))
        for photo, cable in seen
        for end in visible_ends(cable)
    ]
    for first in sorted(ends[0].circles if ends else [], key=lambda circle: -circle.radius):
        alike = [(end, end.as_large(first.radius)) for end in ends]
        found = [(end.ahead(circle), circle.radius) for end, circle in alike if circle is not None]
        if len(found) == len(ends) and min(found)[0] <= _LOST_BEFORE_RIM:
            return median([radius for _, radius in found])
    return None


def visible_ends(cable: RoughCable) -> tuple[CableEnd, CableEnd]:
    """The first and the last point in which the cable is seen, with the direction in which it goes on."""
    body, width = cable.seen_px, 2.0 * cable.half_width_px
    return CableEnd(body[0], end_direction(body[::-1], width)), CableEnd(body[-1], end_direction(body, width))


def _circles(photo: Photo, end: CableEnd, width_px: float) -> list[Circle]:
    """Circles of all sizes about the end of a cable, covers for sure: seen nearly all round, and of a sure radius."""
    low, high = _COVER_RADII_WIDTHS
    # Each try covers the radii within half a step: neighbours are as far apart as a rim is searched along its rays.
    steps = int(np.ceil(np.log(high / low) / np.log(1.0 + SEARCH_RADII)))
    sizes = np.geomspace(low, high, steps + 1) * width_px
    found = (find_rim(photo, end, Radius(float(size), 0.5 * SEARCH_RADII), width_px) for size in sizes)
    return [one for one in found if one and one.rim >= SURE_RIM and one.radius_std <= SAME_RADIUS * one.radius]

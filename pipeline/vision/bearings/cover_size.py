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
from dataclasses import dataclass
from functools import cached_property

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
_ON_RIM = 1.4  # radii from where a cable is lost to the centre of its cover: led straight on by a width at most
_LOST_BEFORE_RIM = 1.9
"""The same at one end, where others lie farther; letters up to the rim hide 0.9 of it, a dot of half the cover's size
lies two of its own radii ahead.
"""
_LOST_CABLE_REACH = 3.1  # radii; at the others: as far as it is searched


def cover_radius(seen: Iterable[tuple[Photo, RoughCable]]) -> float | None:
    """Radius of the covers under which the cable's ends vanish.

    Parameters
    ----------
    seen : iterable of (Photo, RoughCable)
        Photos of one camera position with the cable from visible end to visible end; two tell as much as all.

    Returns
    -------
    px or None
        None unless one radius fits both ends on every photo.
    """
    ends = [_LostEnd(photo, end, 2.0 * cable.half_width_px) for photo, cable in seen for end in visible_ends(cable)]
    if not ends:
        return None
    return _largest(ends, _ON_RIM, _ON_RIM) or _largest(ends, _LOST_CABLE_REACH, _LOST_BEFORE_RIM)


def _largest(ends: list[_LostEnd], most: float, nearest: float) -> float | None:
    """Radius of the largest circle that is seen at all ends, nearly all round, wherever each was lost before it.

    Each was lost ``most`` radii from its centre at most, and one of them ``nearest``. It is sought in all sizes at the
    first end, in those that this tells at the others.
    """
    for first in sorted(ends[0].circles, key=lambda circle: -circle.radius):
        found: list[Circle] = []
        for end in ends:
            circle = end.as_large(first.radius) if found else first
            if circle is None or end.ahead(circle) > most:
                break
            found.append(circle)
        if len(found) == len(ends) and min(map(_LostEnd.ahead, ends, found)) <= nearest:
            return median([circle.radius for circle in found])
    return None


def visible_ends(cable: RoughCable) -> tuple[CableEnd, CableEnd]:
    """The first and the last point in which the cable is seen, with the direction in which it goes on."""
    first, last = cable.visible
    body, width = cable.path_px[first : last + 1], 2.0 * cable.half_width_px
    return CableEnd(body[0], end_direction(body[::-1], width)), CableEnd(body[-1], end_direction(body, width))


@dataclass
class _LostEnd:
    """Where a cable of some width is lost on a photo, and what is round there."""

    photo: Photo
    end: CableEnd
    width_px: float

    @cached_property
    def circles(self) -> list[Circle]:
        """Circles of all sizes seen nearly all round."""
        return [circle for circle in map(self.near, self.sizes()) if circle is not None]

    def as_large(self, radius: float) -> Circle | None:
        """The first circle about as large as another end's."""
        sizes = sorted(self.sizes(), key=lambda size: abs(size - radius))[:3]
        circles = (circle for circle in map(self.near, sizes) if circle is not None)
        return next((circle for circle in circles if abs(circle.radius - radius) <= SAME_RADIUS * radius), None)

    def ahead(self, circle: Circle) -> float:
        """Distance of a circle's centre from the end of the cable, in radii."""
        return float(np.hypot(*(np.array(circle.center) - self.end.place)) / circle.radius)

    def near(self, radius: float) -> Circle | None:
        """Circle of about some radius that is a cover for sure."""
        expected = Radius(radius, 0.5 * SEARCH_RADII)
        circle = find_rim(self.photo, self.end, expected, self.width_px)
        sure = circle is not None and circle.rim >= SURE_RIM and circle.radius_std <= SAME_RADIUS * circle.radius
        return circle if sure else None

    def sizes(self) -> Array:
        """Radii tried."""
        low, high = _COVER_RADII_WIDTHS
        # Each try covers the radii within half a step: neighbours are as far apart as a rim is searched along its rays.
        steps = int(np.ceil(np.log(high / low) / np.log(1.0 + SEARCH_RADII)))
        return np.asarray(np.geomspace(low, high, steps + 1) * self.width_px, np.float64)

"""The two bearing axes on a photo: round covers, pixels given by the user, or the visible ends of the cable.

Covers are circles of about known radius near the ends of the cable, found to a few hundredths of a pixel:

``window -> colour gradient -> best centres for one radius (ring operator) -> circle (rim)``

Any look serves, brighter or darker than ground and cable, with or without a dot, as long as part of the rim shows:
the centre is sought by the mean step around the rim and the circle is fitted with a robust loss, so the sector where
the cable leaves and sectors without contrast do not count. A cover of exactly the ground's look is found by its dot.

Left and right are those of the photo as displayed: the left axis has the smaller ``u``. Where the chord stands within
``VERTICAL_DEG`` of the vertical (camera turned by 90 degrees), the upper axis is called left on a single photo; over a
series the bearing that moves decides (`pipeline.vision.series`).
Units: px of the photo as displayed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array
from pipeline.vision.bearings.cut import cover_by_cut
from pipeline.vision.bearings.rim import MIN_RIM, RADIUS_STD, SURE_RIM, Circle, Radius, fit_circle
from pipeline.vision.bearings.rings import MARK_CELLS, SAME_AXIS_RADII, find_marks, with_rings
from pipeline.vision.median import median
from pipeline.vision.photo import Photo
from pipeline.vision.rough import AxisKind, Bearing
from pipeline.vision.search.backdrop import Standout, reduced
from pipeline.vision.search.ends import CableEnd

_RING_WIDTH = 0.05  # radii; std of the ring that seeks centres: as well as the radius is known
_MARK_RADII = 0.95  # radii of a cover; largest dot, screw, bevel or bright middle that marks the axis of one not seen
_ASIDE_STD_RADII = 0.25  # radii; how far aside of the visible cable's direction the centre lies: bend under the cover
_REACH_RADII = 4.1
"""Radii; how far from where the cable's mask ends the centre of its cover may lie: a stub beyond it, or letters before
it, are as long as a diameter.
"""
_UNDER_RADII = 1.2  # radii from the centre of a cover; an end that is nearer is under it or meets its rim
_EDGE_OVER_TEXTURE = 3.0  # ratio to the median gradient in the window; stronger edges count no more than this

PixelPair = tuple[tuple[float, float], tuple[float, float]]

VERTICAL_DEG = 10.0  # degrees; a chord nearer to the vertical has no left end that a person would agree on


def find_cover(photo: Photo, end: CableEnd, radius: Radius, width_px: float) -> Circle | None:
    """The cover at the end of a cable.

    Parameters
    ----------
    end : CableEnd
        Where the cable's mask ends: at the rim, or beyond it where cover and cable look alike.
    radius : Radius
        Expected radius. One that comes out otherwise tells of a shadow taken for the rim and widens the std.
    width_px : px
        Of the cable.

    Returns
    -------
    Circle or None
        None if no circle shows at least ``MIN_RIM`` of its rim.
    """
    found = find_rim(photo, end, radius, width_px)
    if found is not None and found.rim >= SURE_RIM:
        return with_rings(photo, found, radius)
    cut = cover_by_cut(photo, end, radius, width_px)
    if cut is not None and found is None:
        found = fit_circle(photo, np.array(cut.center), radius)
        found = found if found is not None and found.rim >= MIN_RIM else None
    known = [one for one in (_by_marks(photo, end, radius, found), cut) if one is not None]
    return min(known, key=lambda circle: circle.std, default=None)


def find_rim(photo: Photo, end: CableEnd, radius: Radius, width_px: float) -> Circle | None:
    """As `find_cover`, by the rim alone: the first that is seen all round, else the largest part of one."""
    low = np.maximum(np.floor(end.place - _REACH_RADII * radius.px).astype(int), 0)
    high = np.minimum(np.ceil(end.place + _REACH_RADII * radius.px).astype(int) + 1, photo.size)
    if (high - low < radius.px).any():
        return None
    # reduced so that the circle keeps 16 to 32 cells
    window = reduced(photo, max(1, int(radius.px / 16.0)), (int(low[0]), int(low[1]), int(high[0]), int(high[1])))
    along, aside = _along_cable(window, end)
    fall = np.maximum(np.abs(along) / radius.px - 1.4, 0.0) / 0.3
    prior = np.exp(-0.5 * (aside / (_ASIDE_STD_RADII * radius.px)) ** 2 - 0.5 * fall**2)
    anywhere = np.exp(-0.5 * (aside / (2.0 * _ASIDE_STD_RADII * radius.px)) ** 2)
    beside = np.abs(aside) < 0.8 * width_px
    # Mostly the mask ends at the rim and all behind it is cable.
    # Where a block or a shadow hides the last of the cable, its mask ends early, and where an arm looks like the cable
    # it runs on beyond the cover: a whole rim farther on or farther back is the cover's.
    # Focus lost, or 3 % noise, leaves a rim blurred by 2.5 px; neighbouring directions share more then, so chance gives
    # more of one: focus lost left 0.6, a moved camera, whose rim is doubled, 0.45.
    partial: Circle | None = None
    tries = (
        (along < 0.0, prior, 1.0, MIN_RIM),
        (along < 0.0, prior, 2.5, 0.5),
        (along < -np.inf, anywhere, 1.0, np.inf),
    )
    for blind, where, softness, least in tries:
        if softness > 1.0 and partial is not None:
            continue  # beside a sharp rim, what is soft and round is the shadow
        votes = _votes(window, radius.px / window.reduction, blind & beside) * where
        found = _best_circle(photo, radius, window, votes, softness)
        if found is not None and found.rim >= SURE_RIM:
            return found
        if found is not None and found.rim >= max(least, 0.0 if partial is None else partial.rim + 0.02):
            partial = found
    return partial


def _best_circle(
    photo: Photo, radius: Radius, window: Standout, votes: NDArray[np.float32], softness: float
) -> Circle | None:
    """The circle with the most of its rim seen among the centres of the window with the most votes."""
    best: Circle | None = None
    for _ in range(3):  # the rim decides among the best voted
        v, u = np.unravel_index(int(np.argmax(votes)), votes.shape)
        circle = fit_circle(photo, window.to_pixels(np.array([u, v], float)), radius, softness=softness)
        if circle is not None and (best is None or circle.rim > best.rim + 0.02):
            best = circle
        if best is not None and best.rim > SURE_RIM:
            break
        cv2.circle(votes, (int(u), int(v)), max(2, round(0.3 * radius.px / window.reduction)), 0.0, cv2.FILLED)
    return best


def _by_marks(photo: Photo, end: CableEnd, radius: Radius, partial: Circle | None) -> Circle | None:
    """Cover whose rim shows in parts or not at all, by the dot, screw or bevel on its axis.

    The border of a hard shadow passes for a part of a rim, a screw beside the axis for a mark of it: where both of one
    centre are seen, that is the cover. A mark alone, near where the cable's end tells, is the axis of a cover of the
    ground's own look.
    """
    reach, spread = _MARK_RADII * radius.px, _ASIDE_STD_RADII * radius.px
    # An end led astray by a shadow lies twice as far from where it should be.
    across = np.arange(-3.0 * spread, 3.0 * spread, reach / MARK_CELLS)
    grid = np.stack(np.meshgrid(across, across), axis=-1).reshape(-1, 2)
    expected = end.place + radius.px * end.outward
    marks = find_marks(photo, expected + grid[np.hypot(*grid.T) <= 3.0 * spread], reach)
    both: list[Circle] = []
    for mark in marks:
        rim = fit_circle(photo, np.array(mark.center), radius)
        if rim is not None and rim.rim >= MIN_RIM:
            off = np.hypot(*np.subtract(rim.center, mark.center))
            both += [rim] if off < SAME_AXIS_RADII * radius.px else []
    rims = both if both or partial is None else [partial]
    if rims:
        return with_rings(photo, max(rims, key=lambda circle: circle.rim), radius)
    near = [mark for mark in marks if np.hypot(*(np.array(mark.center) - expected)) < 1.5 * spread]
    return replace(near[0], radius=radius.px, radius_std=0.1 * radius.px) if near else None


def _along_cable(window: Standout, end: CableEnd) -> tuple[Array, Array]:
    """Distance (px) of each cell beyond the end of the cable and aside of its axis."""
    v, u = np.mgrid[: window.picture.shape[0], : window.picture.shape[1]]
    du, dv = np.moveaxis(window.to_pixels(np.stack([u, v], axis=-1)) - end.place, -1, 0)
    return du * end.outward[0] + dv * end.outward[1], dv * end.outward[0] - du * end.outward[1]


def _votes(window: Standout, radius: float, blind: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Change of the mean grey value across a circle around each cell, colours together.

    That is the gradient correlated with a ring of radial directions (Daugman's operator): a faint rim adds up all
    round where texture cancels. Strong edges are clipped, and the cable's own, which are straight and would heap up
    beside it, are left out (``blind``).
    """
    blurred = cv2.GaussianBlur(window.picture, (0, 0), max(0.7, 0.04 * radius))
    gu = np.atleast_3d(cv2.Sobel(blurred, cv2.CV_32F, 1, 0))
    gv = np.atleast_3d(cv2.Sobel(blurred, cv2.CV_32F, 0, 1))
    strength = np.sqrt((gu**2 + gv**2).sum(axis=2))
    gain = 1.0 / np.maximum(strength, _EDGE_OVER_TEXTURE * median(strength) + 1e-6)
    gain[blind] = 0.0
    half = int(np.ceil(1.25 * radius))
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(np.float32)
    distance = np.hypot(x, y) + np.float32(1e-6)
    ring = np.exp(-0.5 * ((distance - radius) / max(0.7, _RING_WIDTH * radius)) ** 2)
    ring /= distance * ring.sum()
    votes = np.zeros(strength.shape, np.float32)
    for channel in range(gu.shape[2]):
        across = cv2.filter2D(gu[..., channel] * gain, -1, ring * x, borderType=cv2.BORDER_CONSTANT)
        across += cv2.filter2D(gv[..., channel] * gain, -1, ring * y, borderType=cv2.BORDER_CONSTANT)
        votes += np.abs(across)
    return votes


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
        Axes on a neighbouring photo.
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
    # without a scale only the cable's width on the photo tells it
    expected = Radius(radius, RADIUS_STD if hints.cover_px is not None else 0.05)
    axes: list[Bearing | None] = [None, None]
    for k, end in enumerate(ends):
        # strips of all readings of a photo end at a few places: each is searched once, and those that end as near and
        # alike as a tenth (radii, rad and relative) show one cover or none
        known = np.concatenate([end.place / radius, end.outward, np.log([radius, width_px])])
        alike = [found for other, found in hints.sought if np.abs(known - other).max() < 0.1]
        # nor do two covers overlap: an end within one of that size that is surely seen is under that one
        as_large = (found for other, found in hints.sought if abs(known[4] - other[4]) < 0.1)
        sure = (found for found in as_large if found is not None and found.sure)
        alike += [one for one in sure if np.hypot(*(end.place - one.center)) < _UNDER_RADII * radius]
        if not alike:
            alike = [find_cover(photo, end, expected, width_px)]
            hints.sought.append((known, alike[0]))
        circle = alike[0]
        if circle is None or not circle.sure:
            circle = _where_seen(photo, end, hints.seen, expected) or circle
        if circle is None:
            break  # one is not enough, whatever the other would be
        axes[k] = circle.as_bearing()
    return axes[0], axes[1]


def _where_seen(photo: Photo, end: CableEnd, seen: tuple[Bearing, ...], expected: Radius) -> Circle | None:
    """The cover of a neighbouring photo, all round in its place, near an end that was led astray beyond it."""
    for cover in seen:
        # the stub beyond a cover or a shadow beside it lead an end astray by two radii
        if np.hypot(*np.subtract(cover.center_px, end.place)) <= 2.5 * expected.px:
            circle = fit_circle(photo, np.array(cover.center_px), expected)
            if circle is not None and circle.rim >= SURE_RIM:
                return with_rings(photo, circle, expected)
    return None


def _assign_given(ends: tuple[CableEnd, CableEnd], given: PixelPair) -> tuple[Bearing, Bearing]:
    a, b = np.array(given[0], float), np.array(given[1], float)
    straight = np.hypot(*(a - ends[0].place)) + np.hypot(*(b - ends[1].place))
    crossed = np.hypot(*(b - ends[0].place)) + np.hypot(*(a - ends[1].place))
    first, second = (a, b) if straight <= crossed else (b, a)
    # a person reads an axis off a screen to a pixel
    bearings = [Bearing((float(p[0]), float(p[1])), 1.0, kind="given") for p in (first, second)]
    return bearings[0], bearings[1]


def _visible_end(end: CableEnd, width_px: float) -> Bearing:
    kind: AxisKind = "clamp" if end.at_object else "end"
    std = 0.1 * width_px  # a cut or clamped end is found to about that
    return Bearing((float(end.place[0]), float(end.place[1])), std, kind=kind)


def left_first(first: Array, second: Array) -> bool:
    """True if ``first`` (u, v) is the left axis by the convention of this module."""
    du, dv = np.asarray(second, float) - np.asarray(first, float)
    if abs(du) <= np.tan(np.radians(VERTICAL_DEG)) * abs(dv):
        return bool(dv > 0)
    return bool(du > 0)

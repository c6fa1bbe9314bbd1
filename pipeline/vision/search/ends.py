"""The two ends of what is seen of the cable, and the way from there to the bearing axes.

A skeleton runs into a corner of the mask over its last half width, so ends are led straight on from before that: to the
cover's rim, to the larger object that hides the rest, or to where the cable stops. A free end is then placed to a
fraction of a pixel where the grey value along the cable's middle falls to half its step.
Photo pixels, unless cells (of the reduced photo) are said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.stats import theilslopes

from pipeline.records import Array
from pipeline.vision.median import median, scatter
from pipeline.vision.photo import Photo, sampled
from pipeline.vision.polyline import arc_lengths
from pipeline.vision.rough import Bearing
from pipeline.vision.search.backdrop import Standout
from pipeline.vision.search.candidates import Reading
from pipeline.vision.search.crosscut import SEEN_SHARE
from pipeline.vision.search.strips import end_direction

_COVER_MARGIN_WIDTHS = 0.1  # widths; the blurred rim of a cover spoils the edges so far beyond its circle
TRIMMED_WIDTHS = 0.8  # widths; so much of a skeleton's end runs into a corner of the mask and is replaced
_BORDER_CELLS, _BORDER_WIDTHS = 2.0, 0.25  # cells and widths; so near the border an end is no end of the cable
_CENTRED_WIDTHS = 0.04  # widths; how far aside of the cable's middle the search ends its path
_ASIDE_WIDTHS = 1.3  # widths; from the cable's middle to the ground beside its end
_EDGE_STD_PX = 0.25  # px; what halo, JPEG and grid move an edge, on all rows alike


@dataclass(frozen=True)
class CableEnd:
    """One visible end of the cable: place and outward direction in px, and whether a larger object hides the rest."""

    place: Array
    outward: Array
    at_object: bool = False


def find_end(path: Array, reading: Reading, standout: Standout) -> CableEnd:
    """The end at the last point of a path (cells): straight on through the mask until it stops or an object begins."""
    width = reading.width
    trimmed = TRIMMED_WIDTHS * width
    body, outward = straight_body(path, width, trimmed)
    place, at_object = body[-1], False
    for step in np.arange(0.0, trimmed + 2.0 * width, 0.5):
        here = body[-1] + step * outward
        u, v = np.rint(here).astype(int)
        inside = 0 <= v < reading.mask.shape[0] and 0 <= u < reading.mask.shape[1]
        at_object = inside and bool(reading.thick[v, u])
        if not inside or at_object or not reading.mask[v, u]:
            break
        place = here
    return CableEnd(standout.to_pixels(place), outward, at_object)


def straight_body(path: Array, width: float, trimmed: float) -> tuple[Array, Array]:
    """The path (n, 2) without the piece at its end that runs into a corner, and the direction (2,) in which it ends."""
    s = arc_lengths(path)
    count = int(np.searchsorted(s, s[-1] - trimmed))
    body = path[: max(3, count)]
    return body, end_direction(body, width)


def at_border(place: Sequence[float] | Array, photo: Photo, reduction: int, width_px: float) -> bool:
    """True if an end ``(u, v)`` of a strip is where the picture ends: a mask and what is led straight on reach it."""
    u, v = place
    reach = max(_BORDER_CELLS * reduction, _BORDER_WIDTHS * width_px)
    return bool(min(u, v, photo.size[0] - 1 - u, photo.size[1] - 1 - v) < reach)


def settle_end(axis: Bearing, path: Array, closeup: Standout, width: float) -> tuple[Bearing, Array]:
    """Put an axis that is a visible end where the refined path ends; a free end to a fraction of a pixel.

    The last sections of a path feel the end and are replaced by an arc that continues the path. Where the grey stays
    the cable's there is no end: it vanishes there, or goes on.

    Parameters
    ----------
    axis : Bearing
        Returned as it is unless its kind is ``end`` or ``clamp``.
    path : (k, 2) px
        Refined path; its last point is the end.
    closeup : Standout
        At full resolution.
    width : px
    """
    if axis.kind not in ("end", "clamp"):
        return axis, path
    body, outward = straight_body(path, width, 1.5 * TRIMMED_WIDTHS * width)
    reach = max(float((path[-1] - body[-1]) @ outward), 1.0)
    path = led_on(body, reach, width)
    settled = replace(axis, center_px=(float(path[-1][0]), float(path[-1][1])))
    if axis.kind == "clamp":
        return settled, path
    across = np.array([-outward[1], outward[0]])
    along = np.arange(-1.5 * width, 1.5 * width + 0.125, 0.25)
    rows = np.append(np.linspace(-0.25, 0.25, 9), (-_ASIDE_WIDTHS, _ASIDE_WIDTHS)) * width
    points = closeup.to_cells(path[-1]) + along[None, :, None] * outward + rows[:, None, None] * across
    profiles = sampled(closeup.picture[..., 0], points)
    aside = median(profiles[-2:, along < -0.6 * width])
    places = [_half_level(profile, along, width, aside) for profile in profiles[:-2]]
    known = np.array([(row, place) for row, place in zip(rows[:-2], places, strict=True) if place is not None])
    if len(known) < 5:
        return replace(settled, kind="clamp"), path
    # a slanting cut is a straight line across, and ends the cable where the middle crosses it
    slant, middle = (float(part) for part in theilslopes(known[:, 1], known[:, 0])[:2])
    # rows a quarter width apart share their blur
    uneven = scatter(known[:, 1] - middle - slant * known[:, 0], 0.0) / 2.0
    std = float(np.linalg.norm([uneven, np.hypot(1.0, slant) * _CENTRED_WIDTHS * width, _EDGE_STD_PX]))
    path = led_on(body, max(reach + middle, 1.0), width)
    return replace(settled, center_px=(float(path[-1][0]), float(path[-1][1])), std_px=std), path


def onto_curve(axis: Bearing, place: Array, width: float) -> Bearing:
    """A visible end (u, v) px on the measured middle of the cable: how far aside the search had put it is known now."""
    std = float(np.sqrt(max(axis.std_px**2 - (_CENTRED_WIDTHS * width) ** 2, _EDGE_STD_PX**2)))
    return replace(axis, center_px=(float(place[0]), float(place[1])), std_px=std)


def led_on(body: Array, reach: float, width: float, *, base: float = 4.0) -> Array:
    """Continue a path (n, 2) by the arc along its last ``base`` widths, ``reach`` onward, in its unit.

    Its angles tell the arc roughly, for a noisy path; a parabola aside of that is nearest to its points.
    """
    s = arc_lengths(body)
    near = min(int(np.searchsorted(s, s[-1] - base * width)), len(body) - 3)
    last, s = body[near:], s[near:]
    angle = np.unwrap(np.arctan2(*np.diff(last, axis=0).T[::-1]))
    turn = Polynomial.fit(0.5 * (s[1:] + s[:-1]), angle, 1)
    s = np.append(s, s[-1] + np.linspace(0.0, reach, max(2, round(reach) + 1))[1:])
    steps = np.diff(s)[:, None] * _direction(turn(0.5 * (s[1:] + s[:-1])))
    arc = last[0] + np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    across = _direction(turn(s) + 0.5 * np.pi)
    off = ((last - arc[: len(last)]) * across[: len(last)]).sum(axis=1)
    arc += Polynomial.fit(s[: len(last)], off, 2)(s)[:, None] * across
    return np.vstack([body, arc[len(last) :]])


def _direction(angle: Array) -> Array:
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _half_level(profile: Array, along: Array, width: float, aside: float) -> float | None:
    """Where the grey leaves the cable's for the ground's; None without a step like that to the ground ``aside``."""
    cable, ground = median(profile[along < -0.6 * width]), median(profile[along > 0.6 * width])
    if (cable - ground) * np.sign(cable - aside) <= SEEN_SHARE * abs(cable - aside):
        return None
    relief = (profile - ground) / (cable - ground)
    fallen = np.flatnonzero((relief < 0.5) & (along > -0.6 * width))
    if not len(fallen) or relief[i := int(fallen[0]) - 1] < 0.5:
        return None
    share = (relief[i] - 0.5) / (relief[i] - relief[i + 1])
    return float(along[i] + share * (along[i + 1] - along[i]))


def without_specks(seen: NDArray[np.bool_]) -> slice:
    """Range of a path from its first to its last seen point, without specks at the ends: a screw on a cover.

    What is no longer than the gap that parts it from the rest is none of that.
    """
    first, last = 0, len(seen)
    for direction in (1, -1):
        runs = runs_of(seen[::direction])
        while len(runs) > 1:
            (start, stop), (following, _) = runs[0], runs[1]
            if stop - start >= following - stop:
                break
            runs = runs[1:]
        edge = runs[0][0] if runs else 0
        first, last = (edge, last) if direction == 1 else (first, len(seen) - edge)
    return slice(first, max(last, first + 3))


def runs_of(seen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and stop of each run of True."""
    steps = np.diff(np.concatenate([[0], seen.astype(int), [0]]))
    return list(zip(np.flatnonzero(steps == 1).tolist(), np.flatnonzero(steps == -1).tolist(), strict=True))


def led_to_axes(
    path: Array, axes: tuple[Bearing, Bearing], width: float, *, trimmed: float = 0.0
) -> tuple[Array, tuple[int, int] | None]:
    """What of a path (n, 2) px lies between its axes and outside of their covers, led on to the axes.

    The shadow of a cover lies beside the cable just where that begins, and a mask takes both for one. So the last two
    diameters before a cover, a quarter of what is seen at most, are laid on the curve that leads from farther in to the
    axis, through which the cable passes: a cubic, straight at the axis, where the cable bears no moment. To an axis
    without a cover the way is straight, from ``trimmed`` before the path's end.

    Returns
    -------
    path : (k, 2)
        From axis to axis.
    body : (first, last) or None
        What of it is the path's own, both included; None if less than five points are.
    """
    start, stop = (int(np.argmin(np.hypot(*(path - axis.center_px).T))) for axis in axes)
    usable = outside_covers(path, axes, width)
    usable[:start] = usable[stop + 1 :] = False
    indices = np.flatnonzero(usable)
    if len(indices) < 5:
        return path, None
    path = path[indices[0] : indices[-1] + 1]
    leads = []
    for axis in reversed(axes):
        path, lead = _led_on_to(path[::-1], axis, width, trimmed)
        leads.append(lead)
    tail, head = leads
    return np.vstack([head, path, tail[::-1]]), (len(head), len(head) + len(path) - 1)


def outside_covers(path: Array, axes: tuple[Bearing, Bearing], width: float) -> NDArray[np.bool_]:
    """Points ``(n,)`` of a path, px, at which covers do not spoil the edges of a cable so wide."""
    margin = _COVER_MARGIN_WIDTHS * width
    radii = [-1.0 if axis.radius_px is None else axis.radius_px + margin for axis in axes]
    away = [np.hypot(*(path - axis.center_px).T) > radius for axis, radius in zip(axes, radii, strict=True)]
    return np.asarray(np.all(away, axis=0))


def _led_on_to(path: Array, axis: Bearing, width: float, trimmed: float) -> tuple[Array, Array]:
    """A path that begins near an axis, laid on the curve from there, and the points from the axis to it without it."""
    s = arc_lengths(path)
    led = min(2.0 * width, 0.25 * float(s[-1]))
    near = (s >= led) & (s < 2.0 * led)
    covered = axis.radius_px is not None and np.count_nonzero(near) >= 4
    if not covered:
        path, led = path[min(int(np.searchsorted(s, trimmed)), len(path) - 3) :], 0.0
        s = arc_lengths(path)
    ahead = float(np.hypot(*(path[0] - axis.center_px)))
    if ahead < 1e-6:
        return path, np.empty((0, 2))
    there, slope = path[0], (path[0] - axis.center_px) / ahead
    if covered:
        there, slope = np.polynomial.polynomial.polyfit(s[near] - led, path[near], 2)[:2]
    ends = np.array([axis.center_px, there])
    bridge = CubicSpline([0.0, ahead + led], ends, bc_type=((2, np.zeros(2)), (1, slope)))
    count = max(1, int(ahead / median(np.diff(s))))
    lead = bridge(np.concatenate([np.arange(count) * (ahead / count), ahead + s[s < led]]))
    return np.vstack([lead[count:], path[len(lead) - count :]]), lead[:count]

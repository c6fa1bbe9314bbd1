"""Following the cable: rough path, path within a fraction of a pixel of the midline, sections measured on it."""

from __future__ import annotations

import numpy as np

from pipeline.messages import Message
from pipeline.records import Array, Rejected
from pipeline.vision.centerline.curvature import Frame, PlaneCurve, make_frame, normals
from pipeline.vision.centerline.curve_fit import CurveFit, fit_curve, follow_points, initial_curve
from pipeline.vision.centerline.edges import SEARCH_RADII, Found, in_picture, search_edges, where_alike
from pipeline.vision.centerline.midline import (
    EDGE_WINDOW_BLURS,
    LEAST_SECTIONS,
    WIDTH_FLOOR,
    Sections,
    free_of_covers,
    measure_sections,
)
from pipeline.vision.median import median, scatter
from pipeline.vision.polyline import arc_lengths
from pipeline.vision.rough import WIDTH_OFF, RoughCable
from pipeline.vision.search.closeup import edge_spreads

_BLOCK = 1.5  # half widths before what hides a cable up to a given axis: its border may lie aslant by 45 degrees or so
_COVER_CHECK_RADII = 0.6
"""Of the radius; a section counts where it is free of covers that far out on both sides: inside the edges' windows."""
_LEAST_SEEN_RADII = 10.0  # of the radius; a shorter seen piece is no measurement
_SOFTER = 1.5  # ratio; edges so much softer than they were taken for reach beyond their windows by a tail of 5 %


def fit_along(points: Array, std: Array, *, s: Array, length: float, diameter: float) -> CurveFit:
    """Curve from axis to axis through points along it: the penalty decides, not the knots.

    Parameters
    ----------
    points, std : (n, 2), (n,)
    s : (n,)
        About the arc lengths of the points from the left axis.
    length, diameter : float
        From axis to axis, and of the cable; one unit with the points.
    """
    # A cable cannot bend more sharply than over its own width; errors longer than two cannot be told from a bend.
    start = initial_curve(points, s, _frame(length, 1.5 * diameter))
    return fit_curve(points, std, start=start, s=s, longest=2.0 * diameter)


def _frame(length: float, spacing: float) -> Frame:
    # Fewer intervals bias kappa at mid-span above 0.05 %; with more a gap among the points makes a bad start.
    return make_frame(length, intervals=int(np.clip(length / spacing, 16, 120)))


def follow(rough: RoughCable, *, half_width: float, known: bool, blur: float | None = None) -> Sections | Rejected:
    """Sections of the cable, laid on a path in px that follows its midline.

    Parameters
    ----------
    half_width : px
        Expected half width of the cable.
    known : bool
        True if it is that of the diameter, False if it is that of the mask.
    blur : px
        Standard deviation of the edges' spread; measured if not given.
    """
    closeup = rough.closeup
    first, last = rough.visible
    along = arc_lengths(rough.path_px)
    if along[last] - along[first] < _LEAST_SEEN_RADII * half_width:
        return _lost(rough, 0.0)  # too few points to start a curve from
    thin = max(1, round(0.5 * half_width / (along[-1] / (len(along) - 1))))
    points, s = rough.path_px[first : last + 1 : thin], along[first : last + 1 : thin]
    frame = _frame(float(along[-1]), 10.0 * half_width)
    path = follow_points(points, start=initial_curve(points, s, frame), s=s)
    covers = _covers(rough, blur or 0.0)
    margin = [_BLOCK * half_width * (b.kind == "given" and b.radius_px is None) for b in rough.axes]
    span = _span(path, (float(along[first]) + margin[0], float(along[last]) - margin[1]), covers, half_width)
    if span is None:
        return _lost(rough, 0.0)
    alike = where_alike(closeup, path, span=span, half_width=half_width)
    if alike is not None:
        path = follow_points(alike, start=path, s=np.linspace(*span, len(alike)))
    tolerance = WIDTH_OFF * (1.0 if known else 2.0)  # a mask's width is known half as well
    for _ in range(3):  # a path half a width astray is back after two
        found = search_edges(closeup, path, span=span, half_width=half_width, tolerance=tolerance)
        width = found.edges[:, 1] - found.edges[:, 0]
        middle = median(width[found.usable]) if found.usable.any() else np.nan
        off = np.abs(width - middle)
        usable = found.usable & (off < SEARCH_RADII * half_width)
        if np.count_nonzero(usable) < LEAST_SECTIONS:
            return _lost(rough, float(np.mean(usable)))
        # a path far astray leads to other edges, which are only by chance as far apart as the cable's
        sure = usable & (off < max(4.0 * scatter(width[usable]), WIDTH_FLOOR))
        where, angle = path.at(found.s)
        edges = where[:, None] + found.edges[..., None] * normals(angle)[:, None]
        path = follow_points(edges.mean(axis=1)[sure], start=path, s=found.s[sure])
        if np.array_equal(sure, usable):
            break
    diameter, half_width = 2.0 * half_width, 0.5 * middle
    where, angle = path.at(found.s)
    if blur is None:
        blur = median(edge_spreads(rough.grey, where - closeup.origin_px, normals(angle), middle))
    found = Found(found.s, ((edges - where[:, None]) * normals(angle)[:, None]).sum(axis=2), usable)
    covers = _covers(rough, blur)
    # Sections closer than 0.6 diameters tell the same of kappa; on a short cable fewer would average over bends, on a
    # long one more take time.
    count = round((span[1] - span[0]) / (0.6 * diameter))
    count = min(max(count, 240), 1000, int(span[1] - span[0]))
    s = span[0] + (np.arange(count) + 0.5) * (span[1] - span[0]) / count
    s = s[
        free_of_covers(path, s, _COVER_CHECK_RADII * half_width, covers)
        & in_picture(closeup, path, s, 1.2 * half_width + 3.0 * blur + 4.0)
    ]
    if len(s) < LEAST_SECTIONS:
        return _lost(rough, 0.0)
    stated = diameter if known else None
    sections = measure_sections(closeup, path, s, half_width=half_width, diameter=stated, blur=blur, found=found)
    if sections is None:
        return _lost(rough, 0.0)
    softest = min(sections.softest, half_width / EDGE_WINDOW_BLURS)  # from there on one edge's window holds the other
    if softest > _SOFTER * blur:
        return follow(rough, half_width=0.5 * diameter, known=known, blur=softest)
    return sections


def _covers(rough: RoughCable, blur: float) -> Array:
    """Discs that hide the cable, larger by twice the blur and the errors of the circle: none of their edge is read."""
    discs = [
        (*b.center_px, b.radius_px + 2.0 * blur + 3.0 * b.std_px + 3.0 * (b.radius_std_px or 0.0) + 1.0)
        for b in rough.axes
        if b.radius_px
    ]
    return np.reshape(discs, (-1, 3))


def _span(path: PlaneCurve, seen: tuple[float, float], covers: Array, half_width: float) -> tuple[float, float] | None:
    """Range of s in which the cable is seen and neither edge is hidden."""
    s = np.arange(seen[0], seen[1], 1.0)
    free = s[free_of_covers(path, s, _COVER_CHECK_RADII * half_width, covers)]
    enough = len(free) > _LEAST_SEEN_RADII * half_width
    return (float(free[0]), float(free[-1])) if enough else None


def _lost(rough: RoughCable, share: float) -> Rejected:
    return Rejected(rough.image, Message("photo/contrast.lost", measured_share=share))

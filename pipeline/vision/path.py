"""Following the cable: rough path, path within a fraction of a pixel of the midline, sections measured on it."""

from __future__ import annotations

import numpy as np

from pipeline.records import Rejected
from pipeline.settings.vision_curve import CurveSettings
from pipeline.vision.curvature import Frame, PlaneCurve, fit_curve, initial_curve, make_frame
from pipeline.vision.edges import Ground, in_picture, search_edges
from pipeline.vision.midline import Cover, Sections, free_of_covers, measure_sections
from pipeline.vision.rough import Bearing, RoughCable


def knots_along(length: float, diameter: float, settings: CurveSettings) -> Frame:
    """Knots over a cable from axis to axis, lengths in any one unit."""
    wanted = round(length / (settings.knot_spacing_diameters * diameter))
    intervals = int(np.clip(wanted, settings.min_intervals, settings.max_intervals))
    return make_frame(0.0, length, intervals=intervals, order=settings.penalty_order)


def follow(
    rough: RoughCable, *, half_width: float, known: bool, settings: CurveSettings
) -> tuple[Sections, PlaneCurve] | Rejected:
    """Sections of the cable and the path in px they were measured on.

    Parameters
    ----------
    half_width : px
        Expected half width of the cable.
    known : bool
        True if it is that of the diameter, False if it is that of the mask.
    """
    ground = Ground(rough.grey if rough.dark else -rough.grey, rough.origin_px)
    first, last = rough.visible
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(rough.path_px, axis=0).T))]
    frame = knots_along(float(along[-1]), 2.0 * half_width, settings)
    points, s = rough.path_px[first : last + 1], along[first : last + 1]
    spacing = float(np.median(np.diff(s)))
    path = fit_curve(
        points,
        np.full(len(points), 0.1 * half_width),
        start=initial_curve(points, s, frame),
        s=s,
        order=settings.penalty_order,
        longest=spacing,
        correlation_length=2.0 * spacing,
        iterations=3,
    ).curve
    covers = tuple(_cover(bearing, rough.blur_px) for bearing in (rough.left, rough.right) if bearing.radius_px)
    span = _span(path, (float(s[0]), float(s[-1])), covers, half_width)
    if span is None:
        return _lost(rough, 0.0)
    tolerance = settings.width_tolerance * (1.0 if known else 2.0)
    found = search_edges(ground, path, span=span, half_width=half_width, tolerance=tolerance, settings=settings)
    width = found.edges[:, 1] - found.edges[:, 0]
    middle = float(np.median(width[found.usable])) if found.usable.any() else np.nan
    usable = found.usable & (np.abs(width - middle) < settings.search_radii * half_width)
    if np.count_nonzero(usable) < 12:
        return _lost(rough, float(np.mean(usable)))
    diameter, half_width = 2.0 * half_width, 0.5 * middle
    where, angle = path.at(found.s)
    points = where + found.edges.mean(axis=1)[:, None] * np.column_stack([-np.sin(angle), np.cos(angle)])
    spacing = float(np.median(np.diff(found.s)))
    path = fit_curve(
        points[usable],
        np.full(np.count_nonzero(usable), 0.3),
        start=path,
        s=found.s[usable],
        order=settings.penalty_order,
        longest=spacing,
        correlation_length=spacing,
        iterations=3,
    ).curve
    count = min(settings.sections, int(span[1] - span[0]))
    s = span[0] + (np.arange(count) + 0.5) * (span[1] - span[0]) / count
    s = s[free_of_covers(path, s, 0.6 * half_width, covers) & in_picture(ground, path, s, 1.5 * half_width + 4.0)]
    if len(s) < 20:
        return _lost(rough, 0.0)
    sections = measure_sections(
        ground,
        path,
        s,
        half_width=half_width,
        diameter=diameter if known else None,
        blur=rough.blur_px,
        settings=settings,
    )
    return _lost(rough, 0.0) if sections is None else (sections, path)


def _cover(bearing: Bearing, blur: float) -> Cover:
    # Twice the blur and the errors of the circle, so that no pixel of the cover's edge reaches a section.
    margin = 2.0 * blur + 3.0 * bearing.std_px + 3.0 * (bearing.radius_std_px or 0.0) + 1.0
    return Cover(bearing.center_px, float(bearing.radius_px or 0.0) + margin)


def _span(
    path: PlaneCurve, seen: tuple[float, float], covers: tuple[Cover, ...], half_width: float
) -> tuple[float, float] | None:
    """Range of s in which the cable is seen and neither edge is hidden."""
    s = np.arange(seen[0], seen[1], 1.0)
    free = s[free_of_covers(path, s, 0.6 * half_width, covers)] if len(s) else s
    return (float(free[0]), float(free[-1])) if len(free) > 10.0 * half_width else None


def _lost(rough: RoughCable, share: float) -> Rejected:
    return Rejected(
        rough.image,
        "photo/contrast",
        f"both edges of the cable were found on {share:.0%} of its length only",
        figure={"measured_share": share},
    )

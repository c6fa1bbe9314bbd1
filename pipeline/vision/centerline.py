"""From a cable found to a pixel to its centerline with true error bars: edges, midline, curvature spline, chord frame.

rough path -> smooth path (px) -> edges searched on blocks -> path to a fraction of a pixel -> two edges per section ->
midline -> metres on the plane -> curvature spline from axis to axis -> `Centerline` in the chord frame.

Chord frame: origin at the left bearing axis, x to the right axis, y toward the bow, ``dx/ds = cos theta``,
``dy/ds = sin theta``. Curvature is positive in the direction of the bow, ``kappa = -d theta / ds``, whether the photo
is mirrored or not.

Under the bearing covers nothing is seen; there the curve is continued by the spline's penalty, its uncertainty grows
and the points are marked as not seen. That the cable passes through the bearing axis is not used: a cable sits in its
bearing with some play, and the curvature at the ends would follow that play. The distance is a figure of quality.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.records import Array, Centerline, Finding, Rejected
from pipeline.settings.vision import VisionSettings
from pipeline.settings.vision_curve import CurveSettings
from pipeline.vision.curvature import CurveFit
from pipeline.vision.midline import Sections
from pipeline.vision.path import fit_along, follow
from pipeline.vision.plane import PlaneMap
from pipeline.vision.rough import RoughCable
from rod.measurement import MeasuredShape


def measure_centerline(
    rough: RoughCable, *, plane: PlaneMap, diameter_m: float | None, settings: VisionSettings
) -> Centerline | Rejected:
    """Centerline of the cable in the chord frame, or why there is none.

    Parameters
    ----------
    rough : RoughCable
        The cable to about a pixel, and the picture around it.
    plane : PlaneMap
        Pixels to metres on the plane of the cable axis.
    diameter_m : m or None
        Of the cable, in the unit of the plane; a check on the measured width.
    """
    options = settings.curve
    half_width = rough.half_width_px
    if diameter_m is not None:
        scale = float(np.median(plane.local_scale(rough.path_px[:: max(1, len(rough.path_px) // 9)])))
        half_width = 0.5 * diameter_m * scale
    found = follow(rough, half_width=half_width, known=diameter_m is not None, settings=options)
    if isinstance(found, Rejected):
        return found
    sections, _ = found
    chord = chord_frame(plane, rough)
    width = np.hypot(*(chord.to_frame(sections.second) - chord.to_frame(sections.first)).T)
    refused = _refusal(rough, sections, width, diameter_m, options)
    if refused is not None:
        return refused
    fit = _fit(sections, chord, width, options)
    return _assemble(rough, sections, chord, width, fit, diameter_m, options)


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
    """

    plane: PlaneMap
    origin: Array
    rotation: Array
    chord: float
    axis_std: float
    mirrored: bool

    def to_frame(self, uv: Array) -> Array:
        """Chord frame ``(n, 2)`` in m of pixels ``(n, 2)``."""
        return np.asarray((self.plane.to_plane(uv) - self.origin) @ self.rotation.T)

    def to_pixels(self, xy: Array) -> Array:
        """Pixels ``(n, 2)`` of points ``(n, 2)`` of the chord frame."""
        return self.plane.to_pixels(xy @ self.rotation + self.origin)


def chord_frame(plane: PlaneMap, rough: RoughCable) -> ChordFrame:
    """Chord frame of the photo: y to the side on which the cable lies."""
    axes = np.array([rough.left.center_px, rough.right.center_px])
    left, right = plane.to_plane(axes)
    chord = float(np.hypot(*(right - left)))
    along = (right - left) / chord
    across = np.array([-along[1], along[0]])  # downward on the photo for a path from left to right
    first, last = rough.visible
    bow = float(np.mean((plane.to_plane(rough.path_px[first : last + 1]) - left) @ across))
    up = bow < 0.0
    rotation = np.stack([along, -across if up else across])
    axis_std = float(
        np.hypot(rough.left.std_px, rough.right.std_px) / np.sqrt(2.0) / np.median(plane.local_scale(axes))
    )
    return ChordFrame(plane, left, rotation, chord, axis_std, bool((rotation[1, 1]) < 0.0))


def _refusal(
    rough: RoughCable, sections: Sections, width: Array, diameter: float | None, options: CurveSettings
) -> Rejected | None:
    """What the figures forbid."""
    radius = 0.5 * float(np.median(sections.width))
    middle = float(np.median(width))
    scatter = 1.4826 * float(np.median(np.abs(width - middle))) / middle
    ratio = sections.contrast / max(sections.noise, 1e-9)
    figure = {
        "contrast_to_noise": ratio,
        "blur_px": sections.blur,
        "width_scatter": scatter,
        "measured_share": sections.share,
    }
    if diameter is not None:
        figure["width_over_diameter"] = middle / diameter

    def rejected(code: str, reason: str) -> Rejected:
        return Rejected(rough.image, code, reason, figure=figure)

    if ratio < options.min_contrast_to_noise:
        return rejected(
            "photo/contrast",
            f"contrast of the cable's edges is {ratio:.1f} times the noise, too little to place"
            f" an edge (at least {options.min_contrast_to_noise:g})",
        )
    if sections.blur > options.max_blur_radii * radius:
        return rejected(
            "photo/blur",
            f"the edges are blurred over {sections.blur:.1f} px (standard deviation) on a cable"
            f" {2 * radius:.0f} px wide",
        )
    if diameter is not None and abs(middle / diameter - 1.0) > options.max_width_error:
        return rejected(
            "photo/width",
            f"what was traced is {middle / diameter:.0%} as wide as the cable: the cable is split"
            " along a highlight or shadow, or scale or diameter are wrong",
        )
    if scatter > options.max_width_scatter:
        return rejected(
            "photo/width", f"the width of what was traced varies by {scatter:.0%} along it; a cable's does not"
        )
    if sections.share < options.min_measured_share:
        return rejected(
            "photo/contrast", f"both edges of the cable were found on {sections.share:.0%} of its length only"
        )
    return None


def _fit(sections: Sections, chord: ChordFrame, width: Array, options: CurveSettings) -> CurveFit:
    """Curvature spline through the midline in the chord frame, ``s = 0`` near the left axis."""
    points = 0.5 * (chord.to_frame(sections.first) + chord.to_frame(sections.second))
    metres = np.median(width / sections.width)
    s = np.r_[0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    ends = np.array([[0.0, 0.0], [chord.chord, 0.0]])
    gap = np.hypot(*(points[0] - ends[0])), np.hypot(*(points[-1] - ends[1]))
    s += gap[0]
    # Sections without noise (drawn pictures) must not count as infinitely certain.
    std = np.maximum(sections.std, 1e-3) * metres
    return fit_along(
        points,
        std,
        guide=points,
        s=s,
        length=float(s[-1] + gap[1]),
        diameter=float(np.median(width)),
        settings=options,
    )


def _assemble(
    rough: RoughCable,
    sections: Sections,
    chord: ChordFrame,
    width: Array,
    fit: CurveFit,
    diameter: float | None,
    options: CurveSettings,
) -> Centerline:
    ends = np.array([[0.0, 0.0], [chord.chord, 0.0]])
    feet = fit.curve.foot(ends, np.array([0.0, fit.curve.frame.knots[-1]]))
    misses = np.hypot(*(fit.curve.at(feet)[0] - ends).T)
    s = np.linspace(feet[0], feet[1], max(options.points, 2 * fit.curve.frame.size))
    where, theta = fit.curve.at(s)
    bases = fit.curve.bases(s)
    covariance, systematic = _covariance(fit, sections, chord, width)
    uv = chord.to_pixels(where)
    normal, turn, bend = bases
    used = fit.weight > 0.0
    section_s = fit.s[used] - feet[0]
    spacing = float(np.median(np.diff(fit.s)))
    seen = (s >= fit.s[0] - spacing) & (s <= fit.s[-1] + spacing)
    metres = width / sections.width
    shape = MeasuredShape(
        s=s - feet[0],
        x=where[:, 0],
        y=where[:, 1],
        theta=theta,
        kappa=-fit.curve.curvature(s),
        seen=seen,
        basis_normal=normal,
        basis_theta=turn,
        basis_kappa=-bend,
        covariance=covariance,
        section_s=section_s,
        section_x=fit.points[used, 0],
        section_y=fit.points[used, 1],
        section_std=fit.smooth.sigma * np.maximum(sections.std, 1e-3)[used] * metres[used],
        correlation_length=fit.smooth.correlation_length,
        systematic_std=systematic[0],
        systematic_length=systematic[1],
    )
    length = float(s[-1] - s[0])
    middle = float(np.median(width))
    sway = normal[-1] * 0.0
    radius = 0.5 * middle
    findings = tuple(rough.findings)
    if misses.max() > options.axis_distance_radii * radius:
        findings += (
            Finding(
                "photo/bearing", "warning", f"the centerline passes {1e3 * misses.max():.2f} mm beside a bearing axis"
            ),
        )
    quality = {
        **rough.quality,
        "contrast_to_noise": sections.contrast / max(sections.noise, 1e-9),
        "noise": sections.noise,
        "blur_px": sections.blur,
        "edge_asymmetry": sections.asymmetry,
        "section_std_px": float(np.median(sections.std) * fit.smooth.sigma),
        "noise_scale": fit.smooth.sigma,
        "correlation_px": fit.smooth.correlation_length / float(np.median(metres)),
        "systematic_px": sections.systematic_std,
        "measured_share": sections.share,
        "rejected_sections": float(np.mean(~used)),
        "effective_parameters": fit.smooth.freedom,
        "axis_distance_px": float(misses.max() / np.median(metres)),
        "width_scatter": float(1.4826 * np.median(np.abs(width - middle)) / middle),
    }
    if diameter is not None:
        quality["width_over_diameter"] = middle / diameter
    return Centerline(
        image=rough.image,
        shape=shape,
        u_px=uv[:, 0],
        v_px=uv[:, 1],
        kappa_std=_std(bend, covariance),
        position_std=_std(normal, covariance),
        chord_m=chord.chord,
        chord_std_m=float(np.sqrt(2.0)) * chord.axis_std,
        traced_length_m=length,
        traced_length_std_m=float(np.hypot(np.sqrt(2.0) * chord.axis_std, np.sqrt(sway @ covariance @ sway))),
        left_px=rough.left.center_px,
        right_px=rough.right.center_px,
        axis_std_px=float(np.hypot(rough.left.std_px, rough.right.std_px) / np.sqrt(2.0)),
        width_m=middle,
        width_std_m=quality["width_scatter"] * middle,
        mirrored=chord.mirrored,
        quality=quality,
        findings=findings,
    )


def _std(basis: Array, covariance: Array) -> Array:
    return np.asarray(np.sqrt(np.maximum(((basis @ covariance) * basis).sum(axis=1), 0.0)))


def _covariance(
    fit: CurveFit, sections: Sections, chord: ChordFrame, width: Array
) -> tuple[Array, tuple[float, float]]:
    """Covariance of q with the light's slow error and the axes' errors; std and length of the light's, m."""
    std = sections.systematic_std * float(np.median(width / sections.width))
    length = 0.25 * float(fit.s[-1] - fit.s[0])
    used = fit.weight > 0.0
    s = fit.s[used]
    # A light's error follows the direction of the cable, a smooth function of s: Gaussian correlation.
    light = std**2 * np.exp(-0.5 * ((s[:, None] - s[None, :]) / length) ** 2)
    gain = fit.smooth.gain
    covariance = fit.smooth.covariance + gain @ light @ gain.T
    # Errors of the axes shift and turn the chord frame against the curve: exactly q's first two directions.
    covariance[0, 0] += chord.axis_std**2
    covariance[1, 1] += 2.0 * (chord.axis_std / chord.chord) ** 2
    return covariance, (std, length)

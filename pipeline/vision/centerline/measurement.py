"""From a cable found to a pixel to its centerline with true error bars: edges, midline, curvature spline, chord frame.

rough path -> smooth path (px) -> edges searched on blocks -> path to a fraction of a pixel -> two edges per section ->
midline -> metres on the plane -> curvature spline from axis to axis -> `Centerline` in the chord frame.

Chord frame: origin at the left bearing axis, x to the right axis, y toward the bow, ``dx/ds = cos theta``,
``dy/ds = sin theta``. Curvature is positive in the direction of the bow, ``kappa = -d theta / ds``, whether the photo
is mirrored or not.

Under the bearing covers nothing is seen; there the curve is continued to the axes as far as they are known
(`pipeline.vision.centerline.continuation`), its uncertainty grows and the points are marked as not seen. What a series
tells of its axes comes in between: `follow_cable` on each photo, then `centerline_of` what was followed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.messages import Message
from pipeline.records import Array, Centerline, Rejected
from pipeline.settings.vision import VisionSettings
from pipeline.vision.centerline.axes_of_series import AxesTold, AxisSight, told_alone
from pipeline.vision.centerline.continuation import continue_to_axes, sight_of_axes
from pipeline.vision.centerline.curve_fit import CurveFit, length_std, slow_errors, std_along
from pipeline.vision.centerline.ground_waves import HalfWidths, Waves, edge_waves, seen_waves
from pipeline.vision.centerline.midline import Sections
from pipeline.vision.centerline.path import fit_along, follow
from pipeline.vision.centerline.refusal import (
    aside_of_both,
    beside_axis,
    feet_of_axes,
    middle_width,
    refusal,
    refusal_of_band,
)
from pipeline.vision.median import median, scatter
from pipeline.vision.polyline import arc_lengths
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.plane import ChordFrame, PlaneMap, chord_frame
from pipeline.vision.search.ends import onto_curve
from rod.measurement import MeasuredShape

LIGHT_LENGTH_SHARE = 0.35
"""Of the seen length; correlation length of the light's error: it follows the cable's direction, which turns once from
end to end; over 135 scenes 0.35 was likelier than 0.25 and 0.5.
"""
_ONE_SIDED = 0.29
"""Of the width between rims beyond the diameter, the midline's standard deviation: any share of it may lie at one side.
"""
_LEAST_STD_PX = 1e-3  # of a section: drawn pictures without noise must not count as infinitely certain


@dataclass(frozen=True)
class Followed:
    """A cable fitted where its photo shows it, not yet tied to its axes.

    Attributes
    ----------
    width : (n,) m
        Of the cable on the sections.
    fit : CurveFit
        In the chord frame.
    covariance : (p, p)
        Of its parameters, the light's errors included.
    light : (std m, length m)
        Of the light's slow error.
    diameter_m : m or None
    """

    rough: RoughCable
    chord: ChordFrame
    sections: Sections
    width: Array
    fit: CurveFit
    covariance: Array
    light: tuple[float, float]
    diameter_m: float | None

    def sight(self) -> AxisSight | None:
        """How the cable passes its axes; None where that cannot be told to others, see `sight_of_axes`."""
        return sight_of_axes(self.fit, self.covariance, self.chord, width=middle_width(self.width)[0])

    def half_widths(self) -> HalfWidths:
        """Half the width along the sections that live on both edges: errors of the midline without its bend."""
        # at a balance of 0.8 one edge has four times the other's variance
        used = (self.fit.weight > 0.0) & (self.sections.balance > 0.8)
        half = 0.5 * (self.sections.balance * (self.width - median(self.width)))[used]
        if self.sections.waves:
            half *= min(1.0, scatter(self.fit.residual[used], 0.0) / scatter(half, 0.0))
        return HalfWidths(self.fit.s[used], half, self.fit.point_std[used], self.fit.smooth.correlation_length)

    def on_midline(self) -> RoughCable:
        """The cable as it was found, its path on the fitted curve where it is seen."""
        first, last = self.rough.visible
        path, points = self.rough.path_px.copy(), self.chord.to_frame(self.rough.path_px[first : last + 1])
        s = self.fit.curve.foot(points, float(np.hypot(*(points[0] - self.chord.axes[0]))) + arc_lengths(points))
        path[first : last + 1] = self.chord.to_pixels(self.fit.curve.at(s)[0])
        return replace(self.rough, path_px=path)

    def loosened(self, left: float, right: float) -> Followed:
        """The cable with axes whose standard deviations (px) are so large at least."""
        one, other = self.rough.axes
        one, other = replace(one, std_px=max(one.std_px, left)), replace(other, std_px=max(other.std_px, right))
        rough = replace(self.rough, left=one, right=other)
        return replace(self, rough=rough, chord=chord_frame(rough, self.chord.plane, self.chord.axis_parallax_std))

    def axis_std(self, fit: CurveFit, feet: Array) -> float:
        """Std (m) of the axes across the chord; ``feet`` are their arc lengths on the curve.

        A visible end lies on the curve: what is open is where along it, and that moves it across the chord by the
        slope of the curve there.
        """
        if self.chord.marked:
            return self.chord.axis_std
        return self.chord.axis_std * float(np.sqrt(np.mean(np.sin(fit.curve.at(feet)[1]) ** 2)))


def follow_cable(
    rough: RoughCable, *, plane: PlaneMap, diameter_m: float | None, axis_parallax_std: float = 0.0
) -> Followed | Rejected:
    """The cable fitted where it is seen, or why it cannot be.

    Parameters
    ----------
    rough : RoughCable
        The cable to about a pixel, and the picture around it.
    plane : PlaneMap
        Pixels to metres on the plane of the cable axis.
    diameter_m : m or None
        Of the cable, in the unit of the plane; a check on the measured width.
    axis_parallax_std : relative
        As in `pipeline.records.Traces`.
    """
    cable = _in_its_colours(rough, plane, diameter_m, axis_parallax_std)
    if isinstance(cable, Rejected) and rough.rival is not None:
        other = follow_cable(rough.rival, plane=plane, diameter_m=diameter_m, axis_parallax_std=axis_parallax_std)
        return cable if isinstance(other, Rejected) else other
    return cable


def _in_its_colours(
    rough: RoughCable, plane: PlaneMap, diameter_m: float | None, axis_parallax_std: float, *, moved: bool = False
) -> Followed | Rejected:
    half_width = rough.half_width_px
    if diameter_m is not None:
        scale = median(plane.local_scale(rough.path_px[:: max(1, len(rough.path_px) // 9)]))
        half_width = 0.5 * diameter_m * scale
    sections = follow(rough, half_width=half_width, known=diameter_m is not None)
    if isinstance(sections, Rejected):
        return sections
    if rough.by_rims:
        wider = _ONE_SIDED * abs(sections.caliper - 2.0 * half_width)
        sections = replace(sections, systematic_std=float(np.hypot(sections.systematic_std, wider)))
    chord = chord_frame(rough, plane, axis_parallax_std)
    width = np.hypot(*(chord.to_frame(sections.second) - chord.to_frame(sections.first)).T)
    fit = _fit(sections, chord, width)
    feet, misses = feet_of_axes(fit, chord)
    # a corner of its mask lies half a width aside of the cable at most
    if not chord.marked and misses.max() < 0.5 * middle_width(width)[0]:
        rough = _with_ends(rough, chord.to_pixels(fit.curve.at(feet)[0]))
        chord = chord_frame(rough, plane, axis_parallax_std)
        fit = _fit(sections, chord, width)
    aside = None if moved else aside_of_both(rough, fit, chord, middle_width(width)[0])
    if aside is not None:  # a flank, or a shadow as wide: the cable runs where its axes are
        share = np.linspace(0.0, 1.0, len(rough.path_px))[:, None]
        beside = replace(rough, path_px=rough.path_px + (1.0 - share) * aside[0] + share * aside[1])
        cable = _in_its_colours(beside, plane, diameter_m, axis_parallax_std, moved=True)
        if isinstance(cable, Followed):
            return cable
    refused = refusal(rough, sections, fit, chord, width, diameter_m)
    if refused is not None:
        return refused
    metres = median(width / sections.width)
    light = sections.systematic_std * metres, LIGHT_LENGTH_SHARE * float(fit.s[-1] - fit.s[0])
    covariance = fit.smooth.covariance + slow_errors(fit, *light)
    return _doubted(Followed(rough, chord, sections, width, fit, covariance, light, diameter_m))


def _doubted(cable: Followed) -> Followed:
    """The cable with covers that are not surely its own as unsure as they lie beside it, beyond what is expected.

    A scalloped rim, or the arc in which a thin cable is cut off, tells a centre with less scatter than error; the cable
    that passes it is another reading of it.
    """
    sight = cable.sight()
    if sight is None:
        return cable
    expected = np.diag(sight.covariance + told_alone(sight).covariance)
    beyond = np.sqrt(np.maximum(sight.miss**2 - expected, 0.0)) / median(cable.width / cable.sections.width)
    doubted = [axis.kind == "cover" and not axis.sure for axis in cable.rough.axes]
    left, right = np.hypot([axis.std_px for axis in cable.rough.axes], np.where(doubted, beyond, 0.0)).tolist()
    return cable.loosened(left, right)


def _with_ends(rough: RoughCable, ends_px: Array) -> RoughCable:
    """The cable with its visible ends (2, 2) px on its curve: the search put them into corners of a mask."""
    width = 2.0 * rough.half_width_px
    left, right = (onto_curve(axis, end, width) for axis, end in zip(rough.axes, ends_px, strict=True))
    return replace(rough, left=left, right=right)


def _fit(sections: Sections, chord: ChordFrame, width: Array) -> CurveFit:
    """Curvature spline through the midline in the chord frame, ``s = 0`` near the left axis."""
    points = 0.5 * (chord.to_frame(sections.first) + chord.to_frame(sections.second))
    before, after = np.hypot(*(points[[0, -1]] - chord.axes).T)
    s = before + arc_lengths(points)
    std = np.maximum(sections.std, _LEAST_STD_PX) * width / sections.width
    return fit_along(points, std, s=s, length=float(s[-1] + after), diameter=median(width))


def waves_of(cables: Sequence[Followed | Rejected]) -> Waves:
    """The waves that ground and camera make in the midlines of all photos of a series."""
    followed = [cable for cable in cables if isinstance(cable, Followed)]
    metres = max((median(cable.width / cable.sections.width) for cable in followed), default=0.0)
    return edge_waves([cable.half_widths() for cable in followed], metres_per_px=metres)


def centerline_of(
    followed: Followed,
    settings: VisionSettings,
    told: AxesTold | None = None,
    waves: Waves | None = None,
) -> Centerline | Rejected:
    """Record of a followed cable, from foot to foot of the bearing axes; or that its band is of no use.

    Parameters
    ----------
    told : AxesTold, optional
        What the other photos of its series tell of how the cable passes the axes.
    waves : Waves, optional
        That ground and sheath make in its midline, told by all photos of its series; else by its own widths, see
        `pipeline.vision.centerline.ground_waves`.
    """
    rough, sections, chord, width = followed.rough, followed.sections, followed.chord, followed.width
    middle, scatter = middle_width(width)
    misses = feet_of_axes(followed.fit, chord)[1]
    metres = median(width / sections.width)
    waves = seen_waves([followed.half_widths()]) if waves is None else waves
    errors = slow_errors(followed.fit, float(np.hypot(waves.own, waves.common)), waves.length)
    fit, covariance = continue_to_axes(followed.fit, followed.covariance + errors, chord, width=middle, told=told)
    feet, left = feet_of_axes(fit, chord)
    if left.max() > middle:
        return Rejected(rough.image, Message("photo/bearing.missed", diameters=min(float(left.max()) / middle, 99.0)))
    s = np.linspace(feet[0], feet[1], max(settings.curve.points, 2 * fit.curve.frame.size))
    shape = _shape(
        fit, s, _with_axes(covariance, followed.axis_std(fit, feet), chord.chord), followed.light, waves, width=middle
    )
    kappa_std = std_along(shape.basis_kappa, shape.covariance)
    useless = refusal_of_band(
        rough.image,
        shape.kappa[shape.seen],
        kappa_std[shape.seen],
        length=float(s[-1] - s[0]),
        most_percent=settings.curve.max_band_percent,
    )
    if useless is not None:
        return useless
    own_std = length_std(fit, s, shape.basis_normal, covariance)
    uv = chord.to_pixels(np.column_stack([shape.x, shape.y]))
    quality = _quality(sections, fit, metres)
    if followed.diameter_m is not None:
        quality["width_over_diameter"] = middle / followed.diameter_m
    return Centerline(
        image=rough.image,
        shape=shape,
        u_px=uv[:, 0],
        v_px=uv[:, 1],
        kappa_std=kappa_std,
        position_std=std_along(shape.basis_normal, shape.covariance),
        chord_m=chord.chord,
        chord_std_m=float(np.sqrt(2.0)) * chord.axis_std,
        traced_length_m=float(s[-1] - s[0]),
        traced_length_std_m=float(np.hypot(np.sqrt(2.0) * chord.axis_std, own_std)),
        left_px=rough.left.center_px,
        right_px=rough.right.center_px,
        axis_std_px=float(np.hypot(rough.left.std_px, rough.right.std_px) / np.sqrt(2.0)),
        width_m=middle,
        width_std_m=scatter * middle,
        mirrored=chord.mirrored,
        quality=quality,
        findings=rough.findings + beside_axis(float(misses.max()), middle),
    )


def _with_axes(covariance: Array, axis_std: float, chord: float) -> Array:
    """Covariance of q with the errors of the axes.

    They shift and turn the chord frame against the curve: exactly q's first two directions.
    """
    whole = covariance.copy()
    whole[0, 0] += axis_std**2
    whole[1, 1] += 2.0 * (axis_std / chord) ** 2
    return whole


def _shape(
    fit: CurveFit, s: Array, covariance: Array, light: tuple[float, float], waves: Waves, *, width: float
) -> MeasuredShape:
    """What is measured at arc lengths ``s`` (n,), from the first on; slow errors of light and ground, m."""
    where, theta = fit.curve.at(s)
    normal, turn, bend = fit.curve.bases(s)
    used = fit.weight > 0.0
    # s is seen where a section was measured so near, or their usual distance: letters and specks are shorter
    reach = max(median(np.diff(fit.s)), 0.5 * width)
    return MeasuredShape(
        s=s - s[0],
        x=where[:, 0],
        y=where[:, 1],
        theta=theta,
        kappa=-fit.curve.curvature(s),
        seen=np.abs(np.subtract.outer(s, fit.s[used])).min(axis=1) <= reach,
        basis_normal=normal,
        basis_theta=turn,
        basis_kappa=-bend,
        covariance=covariance,
        section_s=fit.s[used] - s[0],
        section_x=fit.points[used, 0],
        section_y=fit.points[used, 1],
        section_std=fit.point_std[used],
        correlation_length=fit.smooth.correlation_length,
        systematic_std=light[0],
        systematic_length=light[1],
        wave_std=waves.own,
        wave_length=waves.length,
        common_std=waves.common,
    )


def _quality(sections: Sections, fit: CurveFit, metres: float) -> dict[str, float]:
    return {
        "contrast_to_noise": sections.contrast / max(sections.noise, 1e-9),
        "blur_px": sections.blur,
        "section_std_px": median(fit.std) / metres * fit.smooth.sigma,
        "systematic_px": sections.systematic_std,
    }

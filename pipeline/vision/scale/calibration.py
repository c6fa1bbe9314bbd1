"""Where the scale comes from, how sure it is, and how it checks out against everything else that is known.

``camera of specimen.toml -> Calibration (plane map, scale)``; without any: the found bearings and covers give it.
Sources, the first that is given: a number of px/mm; photos of a board in the plane of the cable
(`pipeline.vision.scale.board`); the travel of the moving bearing against the displacement log; the diameter of the
covers; the length of the cable.

Standard deviations are relative and common to all photos of the specimen. SI units; scales in px/m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.messages import Message
from pipeline.records import Array, Centerline, Finding, Scale, Specimen, inferred
from pipeline.settings.vision import CalibrationSettings
from pipeline.vision.median import SURE_SIGMAS
from pipeline.vision.polyline import step_lengths
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.plane import PlaneMap

_MAX_SCALE_STD = 0.01  # relative; a source of scale worse than that is no better than the cable's length
_COVER_DIAMETER_STD = 0.004  # relative; 0.05 mm on 12 mm: how well a turned cover is known and its rim is lit
_COVER_HEIGHT_M = 1e-3  # m; top of a cover or marker above the cable's upper side: a lid and its screw
_CHECK_FLOOR = 0.005  # relative; smaller deviations change the stiffness by less than one percent


@dataclass(frozen=True)
class Calibration:
    """Map from photo pixels to the plane of the cable axis, and what is known about its scale.

    Attributes
    ----------
    scale : Scale
        In the middle of the picture; its standard deviation is all of it.
    uniform_std : relative
        Part of that standard deviation which is the same everywhere: what ``aside`` does not hold.
    aside : tuple of PlaneMap
        Maps one standard deviation away along each principal direction of a fitted plane's covariance.
    """

    plane: PlaneMap
    scale: Scale
    findings: tuple[Finding, ...] = ()
    uniform_std: float = 0.0
    aside: tuple[PlaneMap, ...] = ()


def from_number(px_per_m: float, settings: CalibrationSettings) -> Calibration:
    """Scale as given in specimen.toml."""
    scale = Scale(px_per_m, settings.given_scale_std, Message("scale.number"))
    return Calibration(PlaneMap.from_scale(px_per_m), scale, uniform_std=scale.std_relative)


def from_found(
    specimen: Specimen, found: list[RoughCable], displacements: Array, settings: CalibrationSettings
) -> Calibration | None:
    """Scale without any given: the best of the travel by the log, the covers' diameter and the cable's length.

    Parameters
    ----------
    found : list of RoughCable
        At least one.
    displacements : (n,) m
        By the log, of the same photos; NaN where unknown.

    Returns
    -------
    Calibration or None
        None without any photo.
    """
    pixels = PlaneMap.from_scale(1.0)
    by_length = _by_length(pixels, found, specimen, settings)
    if by_length is None:
        return None
    others = (_by_travel(pixels, found, displacements, specimen, settings), _by_covers(found, specimen, settings))
    precise = [scale for scale in others if scale is not None and scale.std_relative < _MAX_SCALE_STD]
    scale = min(precise, key=lambda estimate: estimate.std_relative, default=by_length)
    finding = inferred("scale/source", px_per_mm=scale.px_per_m / 1e3, source=scale.source)
    return Calibration(PlaneMap.from_scale(scale.px_per_m), scale, (finding,), scale.std_relative)


def axis_parallax_std(specimen: Specimen, found: list[RoughCable], settings: CalibrationSettings) -> float:
    """By which part of its way from the camera's foot what marks the axes may be seen too far out.

    A point by h above the plane of the scale is seen farther out by h / distance; how high the covers of this rig are
    nobody says. The cable's own end and axes that the user pointed at have no cover.
    """
    if all(axis.kind in ("end", "given") for cable in found for axis in cable.axes):
        return 0.0
    height = 0.5 * specimen.diameter_m + _COVER_HEIGHT_M
    return height / (specimen.camera.distance_m or settings.usual_distance_m)


def _by_travel(
    plane: PlaneMap, found: list[RoughCable], displacements: Array, specimen: Specimen, settings: CalibrationSettings
) -> Scale | None:
    """Regression of the chord on the displacement: each metre of travel shortens it by one.

    With chords on a plane, in units of its scale. None without travel, and of axes that a person gave: those on
    later photos are where log and scale put them.
    """
    if any(axis.kind == "given" for cable in found for axis in cable.axes):
        return None
    known = np.isfinite(displacements)
    travel = displacements[known] - displacements[known].mean() if known.any() else displacements
    if known.sum() < 2 or not np.ptp(travel) > 0:
        return None
    axes = np.array([[cable.left.center_px, cable.right.center_px] for cable in found])[known]
    left, right = plane.to_plane(axes).reshape(-1, 2, 2).transpose(1, 0, 2)
    chords = np.hypot(*(right - left).T)
    slope = -float(travel @ (chords - chords.mean())) / float(travel @ travel)
    if slope <= 0:
        return None
    axis_std = np.array([np.hypot(cable.left.std_px, cable.right.std_px) for cable in found])[known]
    residual = chords - chords.mean() + slope * travel
    free = len(chords) - 2
    spread = float(np.median(axis_std) / np.median(plane.local_scale(axes)))
    spread = max(spread, float(np.sqrt(residual @ residual / free)) if free > 0 else 0.0)
    parallax_std = axis_parallax_std(specimen, found, settings)
    std_relative = float(np.hypot(spread / float(np.sqrt(travel @ travel)) / slope, parallax_std))
    return Scale(slope, std_relative, Message("scale.travel"))


def _by_covers(found: list[RoughCable], specimen: Specimen, settings: CalibrationSettings) -> Scale | None:
    covers = [axis for cable in found for axis in cable.axes if axis.radius_px is not None]
    if specimen.rig.marker_diameter_m is None or not covers:
        return None
    radii = np.array([cover.radius_px for cover in covers])
    # what light does to the rims is common to all photos: it does not show in their scatter
    rims = float(np.median(np.array([cover.radius_std_px or 0.0 for cover in covers]) / radii))
    scatter = float(np.std(radii) / np.mean(radii))
    parallax_std = axis_parallax_std(specimen, found, settings)
    std = math.hypot(_COVER_DIAMETER_STD, parallax_std, scatter, rims)
    return Scale(2.0 * float(np.median(radii)) / specimen.rig.marker_diameter_m, std, Message("scale.covers"))


def in_plane_of_cable(
    planes: list[Calibration],
    specimen: Specimen,
    found: list[RoughCable],
    displacements: Array,
    settings: CalibrationSettings,
) -> Calibration:
    """Of the planes that a board was shown in, the one in which travel and length come out nearest to what is known.

    Where others do nearly as well, what they differ by is in the scale's standard deviation.
    """
    misfits = []
    for one in planes:
        travel = _by_travel(one.plane, found, displacements, specimen, settings)
        seen = (travel, _by_length(one.plane, found, specimen, settings))
        misfits.append(sum(((s.px_per_m - 1.0) / _std(s, one.scale)) ** 2 for s in seen if s is not None))
    chance = np.exp(-0.5 * (np.array(misfits) - min(misfits)))
    best = planes[int(np.argmax(chance))]
    apart = np.array([one.scale.px_per_m / best.scale.px_per_m - 1.0 for one in planes])
    spread = float(np.sqrt(chance @ apart**2 / chance.sum()))
    scale = replace(best.scale, std_relative=math.hypot(best.scale.std_relative, spread))
    return replace(best, scale=scale, uniform_std=math.hypot(best.uniform_std, spread))


def check_scale(
    specimen: Specimen,
    calibration: Calibration,
    found: list[RoughCable],
    displacements: Array,
    settings: CalibrationSettings,
) -> tuple[Finding, ...]:
    """Hold the scale against travel of the moving bearing, covers' diameter and cable; what fails is a finding.

    The rim that is seen of a domed or chamfered cover lies within the diameter that was measured on it. Where travel or
    cable could tell such a difference and confirm the scale, it is the covers that are otherwise, not the scale.
    """
    found_by = calibration.scale
    travel = _by_travel(calibration.plane, found, displacements, specimen, settings)
    covers = _by_covers(found, specimen, settings)
    if covers is not None:  # in units of the scale used
        axes = np.array([axis.center_px for cable in found for axis in cable.axes])
        covers = replace(covers, px_per_m=covers.px_per_m / float(np.median(calibration.plane.local_scale(axes))))
    findings = []
    if covers is not None and covers.source != found_by.source and _off(covers, found_by):
        witnesses = [
            witness
            for witness in (travel, _by_length(calibration.plane, found, specimen, settings))
            if witness is not None
            and witness.source != found_by.source
            and abs(covers.px_per_m - 1.0) > SURE_SIGMAS * _std(witness, found_by)
        ]
        confirmed = witnesses and not any(_off(witness, found_by) for witness in witnesses)
        if confirmed:
            both = {"used": found_by.source, "other": witnesses[0].source}
            findings.append(inferred("scale/covers", width=covers.px_per_m, **both))
        else:
            findings.append(Finding("scale/covers", "warning", _away(covers, found_by)))
    if travel is not None and travel.source != found_by.source and _off(travel, found_by):
        findings.append(Finding("scale/displacement", "warning", _away(travel, found_by)))
    return tuple(findings)


def _std(other: Scale, used: Scale) -> float:
    return math.hypot(other.std_relative, used.std_relative)


def _off(other: Scale, used: Scale) -> bool:
    """True if a scale in units of the one used differs from it by more than both allow."""
    return abs(other.px_per_m - 1.0) > max(SURE_SIGMAS * _std(other, used), _CHECK_FLOOR)


def _away(other: Scale, used: Scale) -> Message:
    off, std = other.px_per_m - 1.0, _std(other, used)
    return Message("scale.away", other=other.source, off=off, std=std, used=used.source)


def _by_length(
    plane: PlaneMap, found: list[RoughCable], specimen: Specimen, settings: CalibrationSettings
) -> Scale | None:
    """Scale by the length of the cable on a plane, in units of its scale; None without any cable."""
    if not found:
        return None
    length = float(np.median([step_lengths(plane.to_plane(cable.path_px)).sum() for cable in found]))
    return Scale(length / specimen.length_m, settings.length_scale_std, Message("scale.length"))


def with_doubt_of_plane(line: Centerline, calibration: Calibration) -> Centerline:
    """Add the errors of scale and plane, the same on all photos, to the band of a curvature.

    A scale too large by a share d makes every curvature too large by d. Maps one standard deviation aside bend the path
    by an amount of their own: ``var += (std_uniform kappa)^2 + sum_i (kappa(map_i) - kappa(map))^2``.

    Parameters
    ----------
    line : Centerline
        ``kappa_std`` by what its own photo tells.
    calibration : Calibration
        With which it was measured.
    """
    uv = np.column_stack([line.u_px, line.v_px])
    kappa = _curvature(uv, line.shape.s, calibration.plane)
    variance = (calibration.uniform_std * line.shape.kappa) ** 2
    for aside in calibration.aside:
        variance += (_curvature(uv, line.shape.s, aside) - kappa) ** 2
    return replace(line, kappa_std=np.sqrt(line.kappa_std**2 + variance))


def _curvature(uv: Array, s: Array, plane: PlaneMap) -> Array:
    """Curvature ``(n,)`` on the plane of a smooth path of pixels ``(n, 2)`` given at ``s``."""
    path = CubicSpline(s, plane.to_plane(uv))
    (dx, dy), (ddx, ddy) = path(s, 1).T, path(s, 2).T
    return np.asarray((dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3)

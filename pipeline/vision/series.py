"""All photos of a specimen to centerlines on one scale: what one photo tells is used on the next.

``steps of the log -> photos -> cable and bearings on each (searched near the neighbour photo's first) -> moving and
fixed bearing, scale -> centerlines in the chord frame -> cross-checks as findings``

A photo that cannot be measured is a `pipeline.records.Rejected` in its place; the others are measured.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np

from pipeline.records import Array, Centerline, Finding, LoadStep, Preview, Rejected, Scale, Specimen, Traces
from pipeline.settings.vision import VisionSettings
from pipeline.settings.vision.series import SeriesSettings
from pipeline.vision.bearings.axes import BearingHints, PixelPair
from pipeline.vision.bearings.cover_size import cover_radius
from pipeline.vision.centerline.measurement import measure_centerline
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo, load_photo
from pipeline.vision.preview import reduce_photo, with_strip
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.board import calibrate_by_board
from pipeline.vision.scale.calibration import Calibration, check_scale, from_found, from_number
from pipeline.vision.scale.plane import PlaneMap
from pipeline.vision.segmentation import find_cable

Found = TypeVar("Found")


@dataclass(frozen=True)
class _Shot:
    """One photo of the series: its step, and the cable found on it or the reason why not."""

    step: LoadStep
    found: RoughCable | Rejected
    preview: Preview | None


def trace_photo(
    path: Path, *, diameter_px: float | None = None, settings: VisionSettings | None = None
) -> Centerline | Rejected:
    """Trace the cable on a single photo, without a specimen and without a scale.

    Parameters
    ----------
    path : Path
    diameter_px : px, optional
        Diameter of the cable; measured on the photo if not given.
    settings : VisionSettings, optional

    Returns
    -------
    Centerline or Rejected
        From visible end to visible end. Lengths are in px wherever the record says m.
    """
    settings = VisionSettings() if settings is None else settings
    photo = load_photo(Path(path), settings.photo)
    if isinstance(photo, Rejected):
        return photo
    preview = reduce_photo(photo, settings.preview)
    rough = find_cable(photo, settings, cable=Cable(diameter_px=diameter_px))
    return _measure(rough, PlaneMap.from_scale(1.0), diameter_px, preview, settings)


def trace_series(specimen: Specimen, settings: VisionSettings) -> Traces:
    """Trace every photo of a specimen.

    Parameters
    ----------
    specimen : Specimen
    settings : VisionSettings

    Returns
    -------
    Traces
        One outcome per photo of the log that exists, in the order of the steps.

    Raises
    ------
    InputError
        The calibration photos cannot be used.
    """
    calibration = _given_calibration(specimen, settings)
    shots, cover_findings = _find_all_and_covers(specimen, calibration, settings)
    found = [shot.found for shot in shots if isinstance(shot.found, RoughCable)]
    displacements = np.array([shot.step.displacement_m for shot in shots if isinstance(shot.found, RoughCable)])
    if calibration is None:
        calibration = from_found(specimen, found, displacements, settings.calibration)
    if calibration is None:
        photos = tuple(replace(shot.found, preview=shot.preview) for shot in shots if isinstance(shot.found, Rejected))
        return Traces(photos, Scale(1.0, 1.0, "none: no photo could be measured"))
    named, side_findings = _name_sides(
        specimen, _as_sure_as_steady(shots, calibration, settings.series), found, calibration, settings
    )
    lines = tuple(_line(shot, calibration.plane, specimen.diameter_m, settings) for shot in named)
    pairs = zip(named, lines, strict=True)
    lines = tuple(_without_hidden_ends(shot.found, line, specimen, calibration, settings) for shot, line in pairs)
    found = [shot.found for shot in named if isinstance(shot.found, RoughCable)]
    findings = (
        *calibration.findings,
        *cover_findings,
        *side_findings,
        *check_scale(specimen, calibration, found, displacements, settings.calibration),
        *_check_lengths(specimen, lines, settings.series),
    )
    return Traces(lines, calibration.scale, findings)


def _given_calibration(specimen: Specimen, settings: VisionSettings) -> Calibration | None:
    camera = specimen.camera
    if camera.scale_px_per_m is not None:
        return from_number(camera.scale_px_per_m, settings.calibration)
    if camera.calibration is not None and camera.board is not None:
        return calibrate_by_board(camera, specimen.diameter_m, settings)
    return None


def _find_all_and_covers(
    specimen: Specimen, calibration: Calibration | None, settings: VisionSettings
) -> tuple[list[_Shot], tuple[Finding, ...]]:
    """Find the cable on all photos, and where its visible ends cannot be the axes, the covers that hide them."""
    shots = _find_all(specimen, calibration, settings)
    found = [shot for shot in shots if isinstance(shot.found, RoughCable)]
    if specimen.rig.marker_diameter_m is not None or specimen.rig.bearings_px is not None or not found:
        return shots, ()
    if calibration is not None:
        lengths = [shot.found.length_px for shot in found if isinstance(shot.found, RoughCable)]
        ratio = float(np.median(lengths)) / (calibration.scale.px_per_m * specimen.length_m)
        if abs(ratio - 1.0) <= settings.series.max_length_deviation:
            return shots, ()
    ends = [found[0], found[-1]] if len(found) > 1 else found
    radius = cover_radius(_with_photos(specimen, ends, settings), settings.bearings)
    if radius is None:
        return shots if calibration is not None else [_with_axes_shown(shot) for shot in shots], ()
    text = (
        f"bearing_marker_mm is not given; round covers {2 * radius:.0f} px across are seen where the cable ends, their "
        "centres are taken for the bearing axes."
    )
    again = _find_all(specimen, calibration, settings, cover_px=2.0 * radius)
    return again, (Finding("rig/covers-found", "info", text),)


def _with_axes_shown(shot: _Shot) -> _Shot:
    """Refuse a cable that vanishes under something: without a scale its length cannot show where the axis is."""
    cable = shot.found
    if isinstance(cable, Rejected):
        return shot
    clamps = [axis.center_px for axis in (cable.left, cable.right) if axis.kind == "clamp"]
    if not clamps:
        return shot
    reason = (
        f"{cable.image}: the cable vanishes under something at ({clamps[0][0]:.0f}, {clamps[0][1]:.0f}) px that is no "
        "round cover, and without a scale nothing tells where the bearing axis is; give scale_px_per_mm, "
        "bearing_marker_mm or bearings_px."
    )
    return replace(shot, found=Rejected(cable.image, "photo/bearing", reason))


def _with_photos(
    specimen: Specimen, shots: list[_Shot], settings: VisionSettings
) -> Iterator[tuple[Photo, RoughCable]]:
    """The photos once more: they are not kept, a series of them would not fit into memory."""
    for shot in shots:
        photo = load_photo(specimen.images[str(shot.step.image)], settings.photo, name=str(shot.step.image))
        if isinstance(photo, Photo) and isinstance(shot.found, RoughCable):
            yield photo, shot.found


def _find_all(
    specimen: Specimen, calibration: Calibration | None, settings: VisionSettings, *, cover_px: float | None = None
) -> list[_Shot]:
    """Find the cable on all photos; ``cover_px`` is the diameter of covers seen on them (px)."""
    shots: list[_Shot] = []
    near: RoughCable | None = None
    first: LoadStep | None = None
    for step in specimen.steps:
        path = None if step.image is None else specimen.images.get(step.image)
        if step.image is None or path is None:
            continue
        first = step if first is None else first
        photo = load_photo(path, settings.photo, name=step.image)
        if isinstance(photo, Rejected):
            shots.append(_Shot(step, photo, None))
            continue
        cable = _expected(specimen, calibration, step.displacement_m - first.displacement_m)
        if cover_px is not None:
            cable = replace(cable, bearings=BearingHints(cover_px=cover_px))
        found = _guarded(photo.name, partial(find_cable, photo, settings, cable=cable, near=near))
        near = found if isinstance(found, RoughCable) else near
        shots.append(_Shot(step, found, reduce_photo(photo, settings.preview)))
    return shots


def _expected(specimen: Specimen, calibration: Calibration | None, travel: float) -> Cable:
    """What is known of the cable on a photo taken ``travel`` (m) of the moving bearing after the first photo."""
    rig = specimen.rig
    if calibration is None:
        widths = None if rig.marker_diameter_m is None else rig.marker_diameter_m / specimen.diameter_m
        # Without a scale the travel in px is unknown: the user's axes hold for the first photo only.
        given = rig.bearings_px if travel == 0.0 and widths is None else None
        return Cable(bearings=BearingHints(cover_widths=widths, given_px=given))
    scale = calibration.scale.px_per_m
    cover = None if rig.marker_diameter_m is None else rig.marker_diameter_m * scale
    given = None
    if rig.bearings_px is not None and cover is None:
        given = _moved(rig.bearings_px, rig.moving_bearing, travel * scale)
    return Cable(specimen.diameter_m * scale, specimen.length_m * scale, BearingHints(cover_px=cover, given_px=given))


def _moved(axes: PixelPair, moving: str, travel_px: float) -> PixelPair:
    """The user's axes after the moving bearing went along the chord toward the fixed one."""
    left, right = np.array(axes[0], float), np.array(axes[1], float)
    along = (right - left) / np.hypot(*(right - left))
    if moving == "left":
        left = left + travel_px * along
    else:
        right = right - travel_px * along
    return (float(left[0]), float(left[1])), (float(right[0]), float(right[1]))


def _guarded(image: str, work: Callable[[], Found]) -> Found | Rejected:
    """The outcome of work on one photo; numbers nobody foresaw cost that photo, not the specimen."""
    try:
        return work()
    except (ArithmeticError, LookupError, ValueError, cv2.error) as error:
        told = " ".join(str(error).split())[:200]
        reason = f"{image}: the tracing failed ({type(error).__name__}: {told}); please report it."
        return Rejected(image, "photo/program-error", reason)


def _line(shot: _Shot, plane: PlaneMap, diameter_m: float, settings: VisionSettings) -> Centerline | Rejected:
    work = partial(_measure, shot.found, plane, diameter_m, shot.preview, settings)
    line = _guarded(shot.found.image, work)
    # the picture is shown also where the work on it broke
    return replace(line, preview=shot.preview) if line.preview is None else line


def _measure(
    rough: RoughCable | Rejected,
    plane: PlaneMap,
    diameter_m: float | None,
    preview: Preview | None,
    settings: VisionSettings,
) -> Centerline | Rejected:
    outcome = (
        rough
        if isinstance(rough, Rejected)
        else measure_centerline(rough, plane=plane, diameter_m=diameter_m, settings=settings)
    )
    if preview is None:
        return outcome
    if isinstance(outcome, Centerline) and isinstance(rough, RoughCable):
        preview = with_strip(preview, outcome, rough, settings.preview)
    return replace(outcome, preview=preview)


def _name_sides(
    specimen: Specimen,
    shots: list[_Shot],
    found: list[RoughCable],
    calibration: Calibration,
    settings: VisionSettings,
) -> tuple[list[_Shot], tuple[Finding, ...]]:
    """Which axis moves over the series; where the chord stands upright, that decides which one is called left."""
    axes = np.array([[cable.left.center_px, cable.right.center_px] for cable in found])
    if len(found) < 2:
        return shots, ()
    steps = np.hypot(*np.ptp(axes, axis=0).T)  # (2,) px: how far the left and the right axis went
    least = settings.series.min_travel_m * float(calibration.scale.px_per_m)
    if steps.max() < max(least, 4.0 * max(cable.left.std_px for cable in found)):
        return shots, ()
    moving = "left" if steps[0] > steps[1] else "right"
    findings = []
    if moving != specimen.rig.moving_bearing:
        du, dv = np.abs(np.median(axes[:, 1] - axes[:, 0], axis=0))
        if du <= np.tan(np.radians(settings.bearings.vertical_deg)) * dv:
            flipped = [_Shot(s.step, _reversed(s.found), s.preview) for s in shots]
            return flipped, _fixed_moved(steps, moving, calibration, settings.series)
        text = (
            f"The {moving} bearing moves on the photos, specimen.toml says moving_bearing = "
            f'"{specimen.rig.moving_bearing}"; the camera may be turned by 180 degrees or the photos mirrored.'
        )
        findings.append(Finding("rig/moving-bearing", "warning", text))
    return shots, (*findings, *_fixed_moved(steps, moving, calibration, settings.series))


def _as_sure_as_steady(shots: list[_Shot], calibration: Calibration, settings: SeriesSettings) -> list[_Shot]:
    """Axes no surer than the fixed one stands still: what it wanders beyond its play is what finding axes errs here."""
    found = [shot.found for shot in shots if isinstance(shot.found, RoughCable)]
    axes = np.array([[cable.left.center_px, cable.right.center_px] for cable in found])
    if len(found) < 2 or any(cable.left.kind == "given" for cable in found):
        return shots
    steps = np.hypot(*np.ptp(axes, axis=0).T)
    if float(steps.min()) <= settings.max_fixed_shift_m * calibration.scale.px_per_m:
        return shots
    wandering = float(np.sqrt(np.mean(np.var(axes[:, int(np.argmin(steps))], axis=0))))

    def wider(cable: RoughCable | Rejected) -> RoughCable | Rejected:
        if isinstance(cable, Rejected):
            return cable
        left, right = (replace(axis, std_px=max(axis.std_px, wandering)) for axis in (cable.left, cable.right))
        return replace(cable, left=left, right=right)

    return [replace(shot, found=wider(shot.found)) for shot in shots]


def _fixed_moved(steps: Array, moving: str, calibration: Calibration, settings: SeriesSettings) -> tuple[Finding, ...]:
    shift = float(steps.min()) / calibration.scale.px_per_m
    if shift <= settings.max_fixed_shift_m:
        return ()
    other = "right" if moving == "left" else "left"
    text = f"The fixed ({other}) bearing wanders by {1e3 * shift:.2f} mm over the photos; camera or frame moved."
    return (Finding("photo/camera-moved", "warning", text),)


def _reversed(found: RoughCable | Rejected) -> RoughCable | Rejected:
    """The same cable named from its other end."""
    if isinstance(found, Rejected):
        return found
    last = len(found.path_px) - 1
    return replace(
        found,
        path_px=found.path_px[::-1].copy(),
        visible=(last - found.visible[1], last - found.visible[0]),
        left=found.right,
        right=found.left,
    )


def _without_hidden_ends(
    found: RoughCable | Rejected,
    line: Centerline | Rejected,
    specimen: Specimen,
    calibration: Calibration,
    settings: VisionSettings,
) -> Centerline | Rejected:
    """Refuse a line from visible end to visible end that is not as long as the cable: bearings hide its ends."""
    if isinstance(found, Rejected) or isinstance(line, Rejected) or found.left.kind not in ("end", "clamp"):
        return line
    ratio = line.traced_length_m / specimen.length_m
    allowed = max(settings.series.max_length_deviation, 3.0 * calibration.scale.std_relative)
    if abs(ratio - 1.0) <= allowed:
        return line
    reason = (
        f"from visible end to visible end the cable is {1e3 * line.traced_length_m:.2f} mm long, "
        f"{100 * (ratio - 1):+.2f} % from length_mm; "
        "something hides the bearing axes: give bearing_marker_mm or bearings_px"
    )
    return Rejected(line.image, "photo/bearing", reason, line.preview, {"length_ratio": ratio})


def _check_lengths(
    specimen: Specimen, lines: tuple[Centerline | Rejected, ...], settings: SeriesSettings
) -> tuple[Finding, ...]:
    """The cable's length does not change: the best free check of scale, bearings and tracing together."""
    traced = [line for line in lines if isinstance(line, Centerline)]
    if not traced:
        return ()
    lengths = np.array([line.traced_length_m for line in traced])
    findings = []
    spread = float(np.ptp(lengths) / np.mean(lengths))
    if spread > settings.max_length_spread:
        worst = traced[int(np.argmax(np.abs(lengths - np.median(lengths))))].image
        text = f"The traced length varies by {100 * spread:.2f} % over the photos, most on {worst}."
        findings.append(Finding("photo/length-varies", "warning", text))
    ratio = float(np.median(lengths)) / specimen.length_m
    if abs(ratio - 1.0) > settings.max_length_deviation:
        text = (
            f"The traced length is {1e3 * float(np.median(lengths)):.2f} mm, {100 * (ratio - 1):+.2f} % from length_mm "
            f"= {1e3 * specimen.length_m:.2f}; the scale or the length is wrong."
        )
        findings.append(Finding("scale/length", "warning", text))
    return tuple(findings)

"""All photos of a specimen to centerlines on one scale: what one photo tells is used on the next.

``steps of the log -> photos -> cable and bearings on each (searched near the neighbour photo's first) -> moving and
fixed bearing, scale -> centerlines in the chord frame -> cross-checks as findings``

A photo that cannot be measured is a `pipeline.records.Rejected` in its place; the others are measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from pipeline.messages import Message
from pipeline.records import (
    Array,
    Centerline,
    Finding,
    Level,
    Rejected,
    Scale,
    Specimen,
    Traces,
    doubtful,
    said_once,
)
from pipeline.settings.vision import SeriesSettings, VisionSettings
from pipeline.vision.bearings.covers import VERTICAL_DEG
from pipeline.vision.bearings.steady import wandering_px
from pipeline.vision.centerline.axes_of_series import told_by_others
from pipeline.vision.centerline.measurement import Followed, follow_cable, waves_of
from pipeline.vision.centerline.side import on_one_side
from pipeline.vision.guard import guarded, jointly
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.board import calibrate_by_board
from pipeline.vision.scale.calibration import (
    Calibration,
    axis_parallax_std,
    check_scale,
    from_found,
    from_number,
    in_plane_of_cable,
    with_doubt_of_plane,
)
from pipeline.vision.series_search import Shot
from pipeline.vision.shots import find_cables, of_one_size, with_fixed_cover
from pipeline.vision.single import shown
from pipeline.vision.stated_width import with_width_seen

Line = Centerline | Rejected

_NO_SCALE = Scale(1.0, 1.0, Message("scale.none"))
_MIN_TRAVEL_M = 2e-4  # m; below it rounding of the log and play of the bearings hide which bearing moves


def trace_series(specimen: Specimen, settings: VisionSettings) -> Traces:
    """Trace every photo of a specimen.

    Returns
    -------
    Traces
        One outcome per photo of the log that exists, in the order of the steps.

    Raises
    ------
    InputError
        The calibration photos cannot be used.
    """
    traces = _traces(specimen, settings)
    return with_width_seen(specimen, traces, settings, _traces)


def _traces(specimen: Specimen, settings: VisionSettings, known: Sequence[Calibration] = ()) -> Traces:
    """All photos with the diameter as stated, by a calibration that is known or the given one."""
    planes = list(known) or given_calibration(specimen, settings)
    shots, covers = find_cables(specimen, next(iter(planes), None), settings)

    def together(outcomes: Sequence[RoughCable | Rejected]) -> Traces:
        some = [replace(shot, found=found) for shot, found in zip(shots, outcomes, strict=True)]
        return _measured(specimen, some, planes, settings)

    names = [shot.found.image for shot in shots]
    traces = jointly(names, [shot.found for shot in shots], together)
    if isinstance(traces, Rejected):
        traces = Traces(tuple(Rejected(name, traces.said) for name in names), _NO_SCALE)
    pairs = zip(shots, traces.photos, strict=True)
    photos = tuple(replace(photo, preview=shot.preview) if photo.preview is None else photo for shot, photo in pairs)
    return replace(traces, photos=photos, findings=tuple(dict.fromkeys((*covers, *traces.findings))))


def _measured(specimen: Specimen, shots: list[Shot], planes: list[Calibration], settings: VisionSettings) -> Traces:
    """The cables found on all photos measured together; ``planes`` are those of the calibration given."""
    shots, size_findings = of_one_size(shots)
    calibration = next(iter(planes), None)
    if calibration is None or len(planes) > 1:
        calibration = _by_what_is_seen(specimen, shots, planes, settings)
        if calibration is not None and planes and calibration.plane is not planes[0].plane:
            return _traces(specimen, settings, [calibration])  # where axes that a person gave move to, hangs on it
    if calibration is None:
        return Traces(tuple(shot.found for shot in shots if isinstance(shot.found, Rejected)), _NO_SCALE)
    shots = with_fixed_cover(specimen, shots, calibration, settings)
    parallax_std = axis_parallax_std(specimen, _told_by(shots)[0], settings.calibration)
    shots, cables, side_findings = _followed(specimen, shots, calibration, parallax_std, settings)
    measured = [
        _without_hidden_ends(shot.found, line, specimen, calibration, settings)
        for shot, line in zip(shots, _tied(shots, cables, settings), strict=True)
    ]
    lines, bow_findings = on_one_side(tuple(measured), specimen.diameter_m)
    lines = tuple(_doubted(line, calibration) for line in lines)
    found, displacements = _told_by(shots, lines)
    findings = (
        *(*calibration.findings, *size_findings, *side_findings, *bow_findings),
        *check_scale(specimen, calibration, found, displacements, settings.calibration),
        *_check_lengths(specimen, lines, settings.series),
    )
    return Traces(lines, calibration.scale, findings, parallax_std)


def _by_what_is_seen(
    specimen: Specimen, shots: list[Shot], planes: list[Calibration], settings: VisionSettings
) -> Calibration | None:
    """The calibration by bearings and cable, or which of the planes of a board is theirs."""
    found, displacements = _told_by(shots)
    if planes:
        return in_plane_of_cable(planes, specimen, found, displacements, settings.calibration)
    return from_found(specimen, found, displacements, settings.calibration)


def given_calibration(specimen: Specimen, settings: VisionSettings) -> list[Calibration]:
    """The scale that specimen.toml gives, as a number or by a board, which may show several planes; empty if none."""
    camera = specimen.camera
    if camera.scale_px_per_m is not None:
        return [from_number(camera.scale_px_per_m, settings.calibration)]
    if camera.calibration is not None and camera.board is not None:
        return calibrate_by_board(camera, specimen.diameter_m, settings)
    return []


def _told_by(
    shots: Sequence[Shot], outcomes: Sequence[Followed | Line] | None = None
) -> tuple[list[RoughCable], Array]:
    """Cables and displacements of the photos that were not refused."""
    pairs = zip(shots, [shot.found for shot in shots] if outcomes is None else outcomes, strict=True)
    kept = [(shot.found, shot.step) for shot, outcome in pairs if not isinstance(outcome, Rejected)]
    found = [cable for cable, _ in kept if isinstance(cable, RoughCable)]
    return found, np.array([step.displacement_m for _, step in kept])


def _followed(
    specimen: Specimen, shots: list[Shot], calibration: Calibration, parallax_std: float, settings: VisionSettings
) -> tuple[list[Shot], Sequence[Followed | Rejected], tuple[Finding, ...]]:
    """The cables followed on all photos; those that can be tell the sides of all."""

    def follow(found: RoughCable | Rejected) -> Followed | Rejected:
        if isinstance(found, Rejected):
            return found
        plane, diameter = calibration.plane, specimen.diameter_m
        work = partial(follow_cable, found, plane=plane, diameter_m=diameter, axis_parallax_std=parallax_std)
        return guarded(found.image, work)

    cables = [follow(shot.found) for shot in shots]
    found, _ = _told_by(shots, cables)
    turned, findings = _name_sides(specimen, found, calibration)
    fixed, wandering, shift = wandering_px(found, settings.series.max_fixed_shift_m * calibration.scale.px_per_m)
    if turned:
        shots = [
            shot if isinstance(shot.found, Rejected) else replace(shot, found=_reversed(shot.found)) for shot in shots
        ]
        pairs = zip(shots, cables, strict=True)
        cables = [cable if isinstance(cable, Rejected) else follow(shot.found) for shot, cable in pairs]
    if wandering > 0.0:
        moved = doubtful("photo/camera-moved", side=fixed, shift_m=shift / calibration.scale.px_per_m)
        findings = (*findings, moved)
        cables = [cable if isinstance(cable, Rejected) else cable.loosened(wandering, wandering) for cable in cables]
    return shots, cables, findings


def _tied(shots: list[Shot], cables: Sequence[Followed | Rejected], settings: VisionSettings) -> list[Line]:
    """Centerlines, each tied to its axes by what the other photos tell of how a cable passes them."""
    sights = [None if isinstance(cable, Rejected) else cable.sight() for cable in cables]
    told = iter(told_by_others([sight for sight in sights if sight is not None]))
    axes = [None if sight is None else next(told) for sight in sights]
    waves = waves_of(cables)
    return [
        guarded(shot.found.image, partial(shown, cable, shot.preview, settings, by_others, waves))
        for shot, cable, by_others in zip(shots, cables, axes, strict=True)
    ]


def _doubted(line: Line, calibration: Calibration) -> Line:
    """Add what its plane leaves open to the band of a centerline; refuse it where that is not finite."""
    if isinstance(line, Rejected):
        return line
    doubted = guarded(line.image, partial(with_doubt_of_plane, line, calibration))
    return replace(doubted, preview=line.preview)


def _name_sides(
    specimen: Specimen, found: list[RoughCable], calibration: Calibration
) -> tuple[bool, tuple[Finding, ...]]:
    """Which axis moves over the series; where the chord stands upright, that decides which one is called left.

    Returns whether all cables are to be named from their other ends.
    """
    if len(found) < 2:
        return False, ()
    axes = np.array([[axis.center_px for axis in cable.axes] for cable in found])
    steps = np.hypot(*np.ptp(axes, axis=0).T)  # (2,) px: how far the left and the right axis went
    least = _MIN_TRAVEL_M * float(calibration.scale.px_per_m)
    moving = "left" if steps[0] > steps[1] else "right"
    small = steps.max() < max(least, 4.0 * max(cable.left.std_px for cable in found))
    if small or moving == specimen.rig.moving_bearing:
        return False, ()
    du, dv = np.abs(np.median(axes[:, 1] - axes[:, 0], axis=0))
    if du <= np.tan(np.radians(VERTICAL_DEG)) * dv:
        return True, ()
    return False, (doubtful("rig/moving-bearing", moving=moving, stated=specimen.rig.moving_bearing),)


def _reversed(found: RoughCable) -> RoughCable:
    """The same cable named from its other end."""
    last = len(found.path_px) - 1
    return replace(
        found,
        path_px=found.path_px[::-1].copy(),
        visible=(last - found.visible[1], last - found.visible[0]),
        left=found.right,
        right=found.left,
        rival=None if found.rival is None else _reversed(found.rival),
    )


def _without_hidden_ends(
    found: RoughCable | Rejected, line: Line, specimen: Specimen, calibration: Calibration, settings: VisionSettings
) -> Line:
    """Refuse a line from visible end to visible end that is not as long as the cable: bearings hide its ends."""
    if isinstance(found, Rejected) or isinstance(line, Rejected) or found.left.kind not in ("end", "clamp"):
        return line
    ratio = line.traced_length_m / specimen.length_m
    allowed = max(settings.series.max_length_deviation, 3.0 * calibration.scale.std_relative)
    if abs(ratio - 1.0) <= allowed:
        return line
    said = Message("photo/bearing.hidden-ends", length_m=line.traced_length_m, change=ratio - 1.0)
    return Rejected(line.image, said, line.preview)


def _check_lengths(specimen: Specimen, lines: Sequence[Line], settings: SeriesSettings) -> tuple[Finding, ...]:
    """The cable's length does not change: the best free check of scale, bearings and tracing together."""
    traced = [line for line in lines if isinstance(line, Centerline)]
    if not traced:
        return ()
    lengths = np.array([line.traced_length_m for line in traced])
    findings = []
    spread = float(np.ptp(lengths) / np.mean(lengths))
    if spread > settings.max_length_spread:
        worst = traced[int(np.argmax(np.abs(lengths - np.median(lengths))))].image
        findings.append(doubtful("photo/length-varies", spread=spread, image=worst))
    length, stated = float(np.median(lengths)), specimen.length_m
    if abs(length / stated - 1.0) > settings.max_length_deviation:
        findings.append(doubtful("scale/length", length_m=length, change=length / stated - 1.0, stated_mm=1e3 * stated))
    return tuple(findings)


def look_at_photos(specimen: Specimen, settings: VisionSettings) -> tuple[Finding, ...]:
    """What is wrong with the photos of a specimen; a photo that a run would refuse is a warning, all of them an error.

    Raises
    ------
    InputError
        The calibration photos cannot be used.
    """
    shots, covers = find_cables(specimen, next(iter(given_calibration(specimen, settings)), None), settings)
    shots, sizes = of_one_size(shots)
    refused = [shot.found for shot in shots if isinstance(shot.found, Rejected)]
    level: Level = "error" if len(refused) == len(shots) else "warning"
    return (*covers, *sizes, *said_once((one.image, replace(one.finding, level=level)) for one in refused))

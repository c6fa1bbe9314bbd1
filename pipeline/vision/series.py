"""All photos of a specimen to centerlines on one scale: what one photo tells is used on the next.

``steps of the log -> photos -> cable and bearings on each (searched near the neighbour photo's first) -> moving and
fixed bearing, scale -> centerlines in the chord frame -> cross-checks as findings``

A photo that cannot be measured is a `pipeline.records.Rejected` in its place; the others are measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeVar

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
from pipeline.settings.vision import VisionSettings
from pipeline.settings.vision.series import SeriesSettings
from pipeline.vision.bearings.covers import VERTICAL_DEG
from pipeline.vision.bearings.steady import at_least, wandering_px
from pipeline.vision.centerline.axes_of_series import AxesTold, AxisSight, told_by_others
from pipeline.vision.centerline.lay import without_lay
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
from pipeline.vision.scale.plane import chord_frame
from pipeline.vision.shots import Shot, find_cables, of_one_size, with_fixed_cover
from pipeline.vision.single import shown
from pipeline.vision.stated_width import with_width_seen

Line = Centerline | Rejected
Told = TypeVar("Told")

_UNTOLD = doubtful("photo/program-error.series")
_MIN_TRAVEL_M = 2e-4  # m; below it rounding of the log and play of the bearings hide which bearing moves


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
    traces = _traces(specimen, settings)
    return with_width_seen(specimen, traces, settings, _traces)


def _traces(specimen: Specimen, settings: VisionSettings, known: Sequence[Calibration] = ()) -> Traces:
    """All photos with the diameter as stated, by a calibration that is known or the given one."""
    planes = list(known) or given_calibration(specimen, settings)
    calibration = next(iter(planes), None)
    shots, cover_findings = find_cables(specimen, calibration, settings)
    shots, sized = _together(shots, lambda some: of_one_size(some))
    shots, size_findings = sized or (shots, (_UNTOLD,))
    if calibration is None or len(planes) > 1:
        shots, told = _together(shots, lambda some: (_by_what_is_seen(specimen, some, planes, settings),))
        calibration = _by_what_is_seen(specimen, shots, planes, settings) if told is None else told[0]
        if calibration is not None and planes and calibration.plane is not planes[0].plane:
            return _traces(specimen, settings, [calibration])  # where axes that a person gave move to, hangs on it
    if calibration is None:
        photos = tuple(replace(shot.found, preview=shot.preview) for shot in shots if isinstance(shot.found, Rejected))
        return Traces(photos, Scale(1.0, 1.0, Message("scale.none")))
    shots, settled = _together(shots, lambda some: with_fixed_cover(specimen, some, calibration, settings))
    shots = shots if settled is None else settled
    found, _ = _told_by(shots, [shot.found for shot in shots])
    parallax_std = axis_parallax_std(specimen, found, settings.calibration)
    shots, lines, side_findings = _measure_all(specimen, shots, calibration, parallax_std, settings)
    pairs = list(zip(shots, lines, strict=True))
    lines = tuple(_without_hidden_ends(shot.found, line, specimen, calibration, settings) for shot, line in pairs)
    lines, bow_findings = _alike(shots, lines, specimen)
    lines = tuple(_doubted(line, calibration) for line in lines)
    lines, check_findings = _checked(specimen, shots, lines, calibration, settings)
    untold = () if settled is not None else (_UNTOLD,)
    findings = (*cover_findings, *size_findings, *untold, *side_findings, *bow_findings, *check_findings)
    findings = (*calibration.findings, *dict.fromkeys(findings))
    return Traces(_with_pictures(shots, lines), calibration.scale, findings, parallax_std)


def _together(shots: list[Shot], work: Callable[[list[Shot]], Told]) -> tuple[list[Shot], Told | None]:
    """Work on all photos together; the one on which it breaks is refused. None where that heals nothing."""

    def without(outcomes: Sequence[RoughCable | Rejected]) -> list[Shot]:
        return [replace(shot, found=found) for shot, found in zip(shots, outcomes, strict=True)]

    names, given = [shot.found.image for shot in shots], [shot.found for shot in shots]
    outcomes, told = jointly(names, given, lambda some: work(without(some)))
    return without(outcomes), told


def _by_what_is_seen(
    specimen: Specimen, shots: list[Shot], planes: list[Calibration], settings: VisionSettings
) -> Calibration | None:
    """The calibration by bearings and cable, or which of the planes of a board is theirs."""
    found, displacements = _told_by(shots, [shot.found for shot in shots])
    if planes:
        return in_plane_of_cable(planes, specimen, found, displacements, settings.calibration)
    return from_found(specimen, found, displacements, settings.calibration)


def _alike(
    shots: Sequence[Shot], lines: tuple[Line, ...], specimen: Specimen
) -> tuple[tuple[Line, ...], tuple[Finding, ...]]:
    """Centerlines with one positive side; a photo that breaks it is refused.

    Lines that break it whichever of them is left out stay as they are, and a finding says so.
    """
    side = partial(on_one_side, diameter_m=specimen.diameter_m)
    lines, turned = jointly([shot.found.image for shot in shots], lines, side)
    return (lines, (_UNTOLD,)) if turned is None else turned


def _checked(
    specimen: Specimen,
    shots: Sequence[Shot],
    lines: tuple[Line, ...],
    calibration: Calibration,
    settings: VisionSettings,
) -> tuple[tuple[Line, ...], tuple[Finding, ...]]:
    """Scale and lengths of all photos held against what else is known; a photo that breaks that is refused."""

    def check(some: tuple[Line, ...]) -> tuple[Finding, ...]:
        found, displacements = _told_by(shots, some)
        return (
            *check_scale(specimen, calibration, found, displacements, settings.calibration),
            *_check_lengths(specimen, some, settings.series),
        )

    lines, findings = jointly([shot.found.image for shot in shots], lines, check)
    return lines, (_UNTOLD,) if findings is None else findings


def _with_pictures(shots: Sequence[Shot], lines: tuple[Line, ...]) -> tuple[Line, ...]:
    """The picture is shown also where the work on it broke."""
    pairs = zip(shots, lines, strict=True)
    return tuple(replace(line, preview=shot.preview) if line.preview is None else line for shot, line in pairs)


def given_calibration(specimen: Specimen, settings: VisionSettings) -> list[Calibration]:
    """The scale that specimen.toml gives, as a number or by a board, which may show several planes; empty if none."""
    camera = specimen.camera
    if camera.scale_px_per_m is not None:
        return [from_number(camera.scale_px_per_m, settings.calibration)]
    if camera.calibration is not None and camera.board is not None:
        return calibrate_by_board(camera, specimen.diameter_m, settings)
    return []


def _told_by(
    shots: Sequence[Shot], outcomes: Sequence[RoughCable | Followed | Centerline | Rejected]
) -> tuple[list[RoughCable], Array]:
    """Cables and displacements of the photos that were not refused: what was may show something else."""
    pairs = zip(shots, outcomes, strict=True)
    kept = [(shot.found, shot.step) for shot, outcome in pairs if not isinstance(outcome, Rejected)]
    found = [cable for cable, _ in kept if isinstance(cable, RoughCable)]
    return found, np.array([step.displacement_m for _, step in kept])


def _measure_all(
    specimen: Specimen, shots: list[Shot], calibration: Calibration, parallax_std: float, settings: VisionSettings
) -> tuple[list[Shot], tuple[Centerline | Rejected, ...], tuple[Finding, ...]]:
    """Measure all photos: the cables that can be followed tell the sides and the axes of all."""

    def follow(found: RoughCable | Rejected) -> Followed | Rejected:
        if isinstance(found, Rejected):
            return found
        plane, diameter = calibration.plane, specimen.diameter_m
        work = partial(follow_cable, found, plane=plane, diameter_m=diameter, axis_parallax_std=parallax_std)
        return guarded(found.image, work)

    def sides(cables: Sequence[Followed | Rejected]) -> tuple[bool, tuple[Finding, ...], float]:
        found, _ = _told_by(shots, cables)
        turned, findings = _name_sides(specimen, found, calibration)
        fixed, wandering, shift = wandering_px(found, settings.series.max_fixed_shift_m * calibration.scale.px_per_m)
        if wandering > 0.0:
            moved = doubtful("photo/camera-moved", side=fixed, shift_m=shift / calibration.scale.px_per_m)
            findings = (*findings, moved)
        return turned, findings, wandering

    cables, told = jointly([shot.found.image for shot in shots], [follow(shot.found) for shot in shots], sides)
    turned, findings, wandering = told or (False, (_UNTOLD,), 0.0)
    if turned:
        shots = [replace(shot, found=_reversed(shot.found)) for shot in shots]
        pairs = zip(shots, cables, strict=True)
        cables = tuple(c if isinstance(c, Rejected) else follow(shot.found) for shot, c in pairs)
    if wandering > 0.0:
        cables = tuple(c if isinstance(c, Rejected) else _loosened(c, wandering) for c in cables)
    lay = partial(without_lay, diameter_m=specimen.diameter_m)
    cables, even = jointly([shot.found.image for shot in shots], cables, lay)
    return shots, _tied(shots, even or cables, settings), findings if even else (*findings, _UNTOLD)


def _loosened(cable: Followed, std_px: float) -> Followed:
    """The cable with axes no surer than ``std_px``."""
    rough = at_least(cable.rough, std_px)
    chord = chord_frame(rough, cable.chord.plane, cable.chord.axis_parallax_std)
    return replace(cable, rough=rough, chord=chord)


def _tied(
    shots: list[Shot], cables: Sequence[Followed | Rejected], settings: VisionSettings
) -> tuple[Centerline | Rejected, ...]:
    """Centerlines of the cables, each tied to its axes by what the others tell of how a cable passes them."""
    sights = [cable if isinstance(cable, Rejected) else guarded(cable.rough.image, cable.sight) for cable in cables]
    images = [shot.found.image for shot in shots]
    # a photo on which that breaks is measured by itself
    _, told = jointly(images, sights, _told)
    _, waves = jointly(images, cables, partial(waves_of))
    return tuple(
        guarded(shot.found.image, partial(shown, cable, shot.preview, settings, axes, waves))
        for shot, cable, axes in zip(shots, cables, told or [None] * len(shots), strict=True)
    )


def _told(sights: Sequence[AxisSight | Rejected | None]) -> list[AxesTold | None]:
    """What the other photos tell of each that was not refused."""
    told = iter(told_by_others([sight for sight in sights if isinstance(sight, AxisSight)]))
    return [next(told) if isinstance(sight, AxisSight) else None for sight in sights]


def _doubted(line: Centerline | Rejected, calibration: Calibration) -> Centerline | Rejected:
    """The line with what its plane leaves open; a plane that is not finite there costs that photo."""
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
    axes = np.array([[cable.left.center_px, cable.right.center_px] for cable in found])
    if len(found) < 2:
        return False, ()
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
    said = Message("photo/bearing.hidden-ends", length_m=line.traced_length_m, change=ratio - 1.0)
    return Rejected(line.image, said, line.preview)


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

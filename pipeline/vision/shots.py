"""The cable and its bearings on every photo of a specimen: what one photo tells is used on the next.

``photo, what the neighbour photo shows -> cable and covers`` - and where the photos disagree about the bearing that
stands still, those in the minority are searched again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pipeline.messages import Message
from pipeline.records import Finding, LoadStep, Preview, Rejected, Specimen, doubtful, inferred
from pipeline.settings.vision import VisionSettings
from pipeline.vision.bearings.cover_size import cover_radius
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.bearings.rim import SAME_RADIUS
from pipeline.vision.bearings.steady import (
    apart_px,
    doubted,
    expected_covers,
    fixed_cover,
    is_sure,
    moved_axes,
    stands_still,
)
from pipeline.vision.guard import guarded
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo, load_photo
from pipeline.vision.preview import reduce_photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.calibration import Calibration, from_number
from pipeline.vision.segmentation import find_cable


@dataclass(frozen=True)
class Shot:
    """One photo of the series: its step, the cable found on it or the reason why not, and its size if it has one."""

    step: LoadStep
    found: RoughCable | Rejected
    preview: Preview | None
    size: tuple[int, int] | None = None


def find_cables(
    specimen: Specimen, calibration: Calibration | None, settings: VisionSettings
) -> tuple[list[Shot], tuple[Finding, ...]]:
    """Find the cable on all photos, and where its visible ends cannot be the axes, the covers that hide them."""
    if calibration is None and specimen.rig.bearings_px is not None and specimen.rig.marker_diameter_m is None:
        calibration = _scale_between_given_axes(specimen, settings)
    shots = _once_more(specimen, calibration, _find_all(specimen, calibration, settings), settings)
    found = [shot for shot in shots if isinstance(shot.found, RoughCable)]
    if specimen.rig.marker_diameter_m is not None or specimen.rig.bearings_px is not None or not found:
        return shots, ()
    most = settings.series.max_length_deviation
    if calibration is not None:
        # Ends lost here and there under covers leave the right length on the median too, not on each photo.
        stated = calibration.scale.px_per_m * specimen.length_m
        if _count_alike(found, most, stated) == len(found):
            return shots, ()
    ends = [found[0], found[-1]] if len(found) > 1 else found
    radius = guarded("", lambda: cover_radius(_with_photos(specimen, ends, settings)))
    radius = None if isinstance(radius, Rejected) else radius  # where the search breaks on a photo, it tells none
    again = [] if radius is None else _find_all(specimen, calibration, settings, cover_px=2.0 * radius)
    if radius is None or _count_alike(again, most) < _count_alike(shots, most):
        return shots if calibration is not None else [_with_axes_shown(shot) for shot in shots], ()
    return again, (inferred("rig/covers-found", diameter_px=2.0 * radius),)


def _scale_between_given_axes(specimen: Specimen, settings: VisionSettings) -> Calibration | None:
    """The scale by the cable's length on the first photo, for which axes are given: it tells where they go from there.

    None where no cable is found on it.
    """
    first = next(step for step in specimen.steps if step.image in specimen.images)
    found = _find_all(replace(specimen, steps=(first,)), None, settings)[0].found
    if isinstance(found, Rejected):
        return None
    return from_number(found.length_px / specimen.length_m, settings.calibration)


def _count_alike(shots: list[Shot], most: float, length_px: float | None = None) -> int:
    """Number of photos whose cable has a length, or that of the median photo, to a relative deviation."""
    lengths = np.array([shot.found.length_px for shot in shots if isinstance(shot.found, RoughCable)])
    usual = float(np.median(lengths)) if length_px is None and len(lengths) else length_px
    return 0 if usual is None else int(np.count_nonzero(np.abs(lengths / usual - 1.0) <= most))


def _once_more(
    specimen: Specimen, calibration: Calibration | None, shots: list[Shot], settings: VisionSettings
) -> list[Shot]:
    """Photos on which no cable was found: searched again with what the others tell that they were not told.

    Those before the first cable had no neighbour. Without a scale the covers are expected in widths of the cable, and
    any width passes for the cable's; where its shaded side is as dark as the ground it seems narrower on some photos
    than on others. Its covers do not.
    """
    there = [k for k, shot in enumerate(shots) if isinstance(shot.found, RoughCable)]
    if not there:
        return shots
    known = _scale_of_covers(specimen, shots, settings) if calibration is None else calibration
    last = there[0] if known is calibration else len(shots)  # none before it had a neighbour, all after it had one
    first = shots[0].step.displacement_m  # axes that are given hold for the first photo
    return [
        replace(
            shot, found=_find_as_on(specimen, shot, shots[min(there, key=lambda i: abs(i - k))], known, settings, first)
        )
        if isinstance(shot.found, Rejected) and shot.preview is not None and k < last
        else shot
        for k, shot in enumerate(shots)
    ]


def _scale_of_covers(specimen: Specimen, shots: list[Shot], settings: VisionSettings) -> Calibration | None:
    """The scale by covers that are seen all round and alike on all photos; None if there are none, or of no size."""
    sure = [s.found for s in shots if isinstance(s.found, RoughCable) and s.found.left.sure and s.found.right.sure]
    radii = [axis.radius_px for cable in sure for axis in (cable.left, cable.right) if axis.radius_px is not None]
    diameter = specimen.rig.marker_diameter_m
    if diameter is None or not radii or np.ptp(radii) > 2.0 * SAME_RADIUS * np.median(radii):
        return None
    return from_number(2.0 * float(np.median(radii)) / diameter, settings.calibration)


def _find_as_on(
    specimen: Specimen,
    shot: Shot,
    near: Shot,
    calibration: Calibration | None,
    settings: VisionSettings,
    first: float,
) -> RoughCable | Rejected:
    """The cable on a photo once more, with a neighbour photo known; else why it was refused before.

    ``first`` (m) is the displacement of the first photo.
    """
    if isinstance(near.found, Rejected):
        return shot.found
    cable = _expected(specimen, calibration, shot.step.displacement_m - first)
    cable = _near(specimen, cable, near.found, shot.step.displacement_m - near.step.displacement_m, calibration)
    again = _find_again(specimen, shot, cable, settings, near=near.found)
    return again if isinstance(again, RoughCable) else shot.found


def _near(specimen: Specimen, cable: Cable, near: RoughCable, travel: float, calibration: Calibration | None) -> Cable:
    """What is known of the cable, with the covers that a neighbour photo, ``travel`` (m) before, lets expect."""
    plane = None if calibration is None else calibration.plane
    seen = expected_covers(near, specimen.rig.moving_bearing, travel, plane)
    return replace(cable, bearings=replace(cable.bearings, seen=seen))


def _find_again(
    specimen: Specimen, shot: Shot, cable: Cable, settings: VisionSettings, *, near: RoughCable | None = None
) -> RoughCable | Rejected:
    """The cable on a photo that was searched before."""
    photo = _loaded(specimen, shot.step, settings)
    return photo if isinstance(photo, Rejected) else _find(specimen, photo, cable, near)


def _loaded(specimen: Specimen, step: LoadStep, settings: VisionSettings) -> Photo | Rejected:
    name = str(step.image)
    return guarded(name, partial(load_photo, specimen.images[name], settings.photo, name=name))


def _find(specimen: Specimen, photo: Photo, cable: Cable, near: RoughCable | None) -> RoughCable | Rejected:
    hints = specimen.hints.get(photo.name)
    return guarded(photo.name, partial(find_cable, photo, cable=cable, near=near, hints=hints))


def _with_axes_shown(shot: Shot) -> Shot:
    """Refuse a cable that vanishes under something: without a scale its length cannot show where the axis is."""
    cable = shot.found
    if isinstance(cable, Rejected):
        return shot
    clamps = [axis.center_px for axis in (cable.left, cable.right) if axis.kind == "clamp"]
    if not clamps:
        return shot
    u, v = clamps[0]
    return replace(shot, found=Rejected(cable.image, Message("photo/bearing.vanishes", u_px=u, v_px=v)))


def _with_photos(specimen: Specimen, shots: list[Shot], settings: VisionSettings) -> Iterator[tuple[Photo, RoughCable]]:
    """The photos once more: they are not kept, a series of them would not fit into memory."""
    for shot in shots:
        photo = _loaded(specimen, shot.step, settings)
        if isinstance(photo, Photo) and isinstance(shot.found, RoughCable):
            yield photo, shot.found


def _find_all(
    specimen: Specimen, calibration: Calibration | None, settings: VisionSettings, *, cover_px: float | None = None
) -> list[Shot]:
    """Find the cable on all photos; ``cover_px`` is the diameter of covers seen on them (px)."""
    shots: list[Shot] = []
    near: RoughCable | None = None
    first: LoadStep | None = None
    last = specimen.steps[0]
    for step in specimen.steps:
        if step.image is None or step.image not in specimen.images:
            continue
        first = step if first is None else first
        photo = _loaded(specimen, step, settings)
        if isinstance(photo, Rejected):
            shots.append(Shot(step, photo, None))
            continue
        cable = _expected(specimen, calibration, step.displacement_m - first.displacement_m)
        if cover_px is not None:
            cable = replace(cable, bearings=BearingHints(cover_px=cover_px))
        if near is not None:
            cable = _near(specimen, cable, near, step.displacement_m - last.displacement_m, calibration)
        found = _find(specimen, photo, cable, near)
        if isinstance(found, RoughCable):
            near, last = found, step
        shown = guarded(photo.name, partial(reduce_photo, photo, settings.preview))
        shots.append(Shot(step, found, None if isinstance(shown, Rejected) else shown, photo.size))
    return shots


def _expected(specimen: Specimen, calibration: Calibration | None, travel: float) -> Cable:
    """What is known of the cable on a photo taken ``travel`` (m) of the moving bearing after the first photo."""
    rig = specimen.rig
    if calibration is None:
        widths = None if rig.marker_diameter_m is None else rig.marker_diameter_m / specimen.diameter_m
        # Without a scale the travel in px is unknown: the user's axes hold for the first photo only.
        given = rig.bearings_px if travel == 0.0 and widths is None else None
        hints = BearingHints(cover_widths=widths, given_px=given)
        return Cable(bearings=hints, slenderness=specimen.length_m / specimen.diameter_m)
    scale = calibration.scale.px_per_m
    cover = None if rig.marker_diameter_m is None else rig.marker_diameter_m * scale
    given = None
    if rig.bearings_px is not None and cover is None:
        given = moved_axes(rig.bearings_px, rig.moving_bearing, travel, calibration.plane)
    return Cable(specimen.diameter_m * scale, specimen.length_m * scale, BearingHints(cover_px=cover, given_px=given))


def with_fixed_cover(
    specimen: Specimen, shots: list[Shot], calibration: Calibration, settings: VisionSettings
) -> list[Shot]:
    """Photos on which something else was taken for the fixed bearing's cover: searched again where it stands.

    A photo that shows it in neither place is refused, unless what was found is a cover all round: the camera moved, or
    it is the cover of another thing, which the cable passes beside.
    """
    there = [k for k, shot in enumerate(shots) if isinstance(shot.found, RoughCable)]
    found = [shot.found for shot in shots if isinstance(shot.found, RoughCable)]
    play = settings.series.max_fixed_shift_m * calibration.scale.px_per_m
    fixed = fixed_cover(found, play)
    if fixed is None:
        return shots
    scale = calibration.scale.px_per_m
    diameter = None if fixed.cover.radius_px is None else 2.0 * fixed.cover.radius_px
    hints = BearingHints(cover_px=diameter, seen=(fixed.cover,))
    expected = Cable(specimen.diameter_m * scale, specimen.length_m * scale, hints)
    settled = list(shots)
    for k, cable in ((there[i], found[i]) for i in fixed.astray):
        again = _find_again(specimen, shots[k], expected, settings)
        if isinstance(again, RoughCable) and stands_still(again, fixed, play):
            settled[k] = replace(shots[k], found=again)
        elif not is_sure(cable, fixed.side):
            apart = apart_px(cable, fixed) / scale
            said = Message("photo/bearing.astray", side=fixed.side, apart_m=apart)
            settled[k] = replace(shots[k], found=Rejected(cable.image, said))
        else:
            settled[k] = replace(shots[k], found=doubted(cable, fixed.side))
    return settled


_CROPPED_LENGTH = 0.03
"""Relative; of the cable's length in px on a photo of another size: it is found within a third of that, and nobody
scales a photo by less.
"""


def of_one_size(shots: list[Shot]) -> tuple[list[Shot], tuple[Finding, ...]]:
    """Refuse photos of another size than most that were not merely cropped, and those turned by a quarter.

    A photo that was cropped shows the cable as long, in px, as the others do. One that was scaled has a scale of its
    own. On one that was turned by a quarter left and right are told by what was up and down: its bearings may change
    places, and everything along the cable with them.

    Parameters
    ----------
    shots : list of Shot

    Returns
    -------
    list of Shot
        Where no size is that of more than half of the photos, or none of those shows the cable, none is refused for
        its size.
    tuple of Finding
        ``photo/size`` of each photo that was cropped; of all, where they have no usual size.
    """
    shots = _without_turned(shots)
    sizes = [tuple(sorted(shot.size)) for shot in shots if shot.size is not None]
    usual, count = Counter(sizes).most_common(1)[0] if sizes else ((), 0)
    lengths = [
        shot.found.length_px
        for shot in shots
        if shot.size is not None and tuple(sorted(shot.size)) == usual and isinstance(shot.found, RoughCable)
    ]
    if sizes and 2 * count <= len(sizes):
        each = [f"{shot.found.image} {shot.size[0]} x {shot.size[1]} px" for shot in shots if shot.size is not None]
        return shots, (doubtful("photo/size.several", sizes=each),)
    if not lengths:
        return shots, ()
    settled, findings = [], []
    for shot in shots:
        if shot.size is None or tuple(sorted(shot.size)) == usual:
            settled.append(shot)
            continue
        name = shot.found.image
        both = {"size": f"{shot.size[0]} x {shot.size[1]} px", "most": f"{usual[1]} x {usual[0]} px"}
        ratio = shot.found.length_px / float(np.median(lengths)) if isinstance(shot.found, RoughCable) else np.nan
        if abs(ratio - 1.0) <= _CROPPED_LENGTH:
            findings.append(inferred("photo/size.cropped", image=name, **both))
            settled.append(shot)
            continue
        settled.append(replace(shot, found=Rejected(name, Message("photo/size", **both))))
    return settled, tuple(findings)


def _without_turned(shots: list[Shot]) -> list[Shot]:
    """Refuse photos on which the line between the bearings runs across that of most others."""
    steep = [_is_steep(shot.found) if isinstance(shot.found, RoughCable) else None for shot in shots]
    counted = Counter(way for way in steep if way is not None)
    usual, count = counted.most_common(1)[0] if counted else (None, 0)
    if 2 * count <= counted.total():
        return shots
    return [
        shot if way in (usual, None) else replace(shot, found=Rejected(shot.found.image, Message("photo/turned")))
        for shot, way in zip(shots, steep, strict=True)
    ]


def _is_steep(cable: RoughCable) -> bool:
    (u0, v0), (u1, v1) = cable.left.center_px, cable.right.center_px
    return abs(v1 - v0) > abs(u1 - u0)

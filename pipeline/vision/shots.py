"""The cable and its bearings on every photo of a specimen: what one photo tells is used on the next.

``photo, what the neighbour photo shows -> cable and covers`` - and where the photos disagree about the bearing that
stands still, those in the minority are searched again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from pipeline.messages import Message
from pipeline.records import Finding, Rejected, Specimen, doubtful, inferred
from pipeline.settings.vision import VisionSettings
from pipeline.vision.bearings.cover_size import cover_radius
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.bearings.rim import SAME_RADIUS
from pipeline.vision.bearings.steady import fixed_cover
from pipeline.vision.guard import guarded
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.calibration import Calibration, from_number
from pipeline.vision.series_search import Search, Shot, count_alike
from pipeline.vision.what_moves import found_moving


def find_cables(
    specimen: Specimen, calibration: Calibration | None, settings: VisionSettings
) -> tuple[list[Shot], tuple[Finding, ...]]:
    """Find the cable on all photos, and where its visible ends cannot be the axes, the covers that hide them."""
    rig = specimen.rig
    search = Search(specimen, settings, calibration)
    if calibration is None and rig.bearings_px is not None and rig.marker_diameter_m is None:
        # The cable's length on the first photo, for which the axes are given, tells where they go from there.
        first = search.load(search.steps[0])
        cable = first if isinstance(first, Rejected) else search.find(first, search.steps[0], None)
        if isinstance(cable, RoughCable):
            known = from_number(cable.length_px / specimen.length_m, settings.calibration)
            search = replace(search, calibration=known)
    shots = _once_more(search, search.find_all())
    moved = guarded("", partial(found_moving, search, shots))  # where it breaks on a photo, the rest stays found
    shots, old = shots if isinstance(moved, Rejected) else moved, shots
    count = sum(new is not shot for new, shot in zip(shots, old, strict=True))
    rims = sum(isinstance(shot.found, RoughCable) and shot.found.by_rims for shot in shots)
    how = ("photo/still-ground", count), ("photo/rims", rims)
    told = tuple(inferred(code, count=number) for code, number in how if number)
    found = [shot for shot in shots if isinstance(shot.found, RoughCable)]
    if rig.marker_diameter_m is not None or rig.bearings_px is not None or not found:
        return shots, told
    most = settings.series.max_length_deviation
    if calibration is not None:
        # Ends lost here and there under covers leave the right length on the median too, not on each photo.
        stated = calibration.scale.px_per_m * specimen.length_m
        if count_alike(found, most, stated) == len(found):
            return shots, told
    ends = [found[0], found[-1]] if len(found) > 1 else found
    radius = guarded("", lambda: cover_radius(_with_photos(search, ends)))
    if radius is not None and not isinstance(radius, Rejected):  # where the search breaks on a photo, it tells none
        again = replace(search, cover_px=2.0 * radius).find_all()
        if count_alike(again, most) >= count_alike(shots, most):
            return again, (inferred("rig/covers-found", diameter_px=2.0 * radius),)
    return shots if calibration is not None else [_with_axes_shown(shot) for shot in shots], told


def _once_more(search: Search, shots: list[Shot]) -> list[Shot]:
    """Search photos without a cable again, with what the other photos have told since.

    Those before the first cable had no neighbour. Without a scale the covers are expected in widths of the cable, and
    any width passes for the cable's; where its shaded side is as dark as the ground it seems narrower on some photos
    than on others. Its covers do not.
    """
    there = {k: shot.found for k, shot in enumerate(shots) if isinstance(shot.found, RoughCable)}
    if not there:
        return shots
    last = min(there)  # all after it had a neighbour
    if search.calibration is None:
        search = replace(search, calibration=_scale_of_covers(search, shots))
        last = last if search.calibration is None else len(shots)
    settled = list(shots)
    for k, shot in enumerate(shots[:last]):
        photo = search.load(shot.step) if isinstance(shot.found, Rejected) and shot.preview is not None else None
        if isinstance(photo, Photo):
            again = search.find(photo, shot.step, there[min(there, key=lambda i: abs(i - k))])
            settled[k] = replace(shot, found=again) if isinstance(again, RoughCable) else shot
    return settled


def _scale_of_covers(search: Search, shots: list[Shot]) -> Calibration | None:
    """The scale by covers that are seen all round and alike on all photos; None if there are none, or of no size."""
    sure = [s.found for s in shots if isinstance(s.found, RoughCable) and s.found.left.sure and s.found.right.sure]
    radii = [axis.radius_px for cable in sure for axis in cable.axes if axis.radius_px is not None]
    diameter = search.specimen.rig.marker_diameter_m
    if diameter is None or not radii or np.ptp(radii) > 2.0 * SAME_RADIUS * np.median(radii):
        return None
    return from_number(2.0 * float(np.median(radii)) / diameter, search.settings.calibration)


def _with_axes_shown(shot: Shot) -> Shot:
    """Refuse a cable that vanishes under something: without a scale its length cannot show where the axis is."""
    axes = () if isinstance(shot.found, Rejected) else shot.found.axes
    clamp = next((axis.center_px for axis in axes if axis.kind == "clamp"), None)
    if clamp is None:
        return shot
    said = Message("photo/bearing.vanishes", u_px=clamp[0], v_px=clamp[1])
    return replace(shot, found=Rejected(shot.found.image, said))


def _with_photos(search: Search, shots: list[Shot]) -> Iterator[tuple[Photo, RoughCable]]:
    """The photos once more: they are not kept, a series of them would not fit into memory."""
    for shot in shots:
        photo = search.load(shot.step)
        if isinstance(photo, Photo) and isinstance(shot.found, RoughCable):
            yield photo, shot.found


def with_fixed_cover(
    specimen: Specimen, shots: list[Shot], calibration: Calibration, settings: VisionSettings
) -> list[Shot]:
    """Photos on which something else was taken for the fixed bearing's cover: searched again where it stands.

    A photo that shows it in neither place is refused, unless what was found is a cover all round: the camera moved, or
    it is the cover of another thing, which the cable passes beside.
    """
    there = [k for k, shot in enumerate(shots) if isinstance(shot.found, RoughCable)]
    found = [shot.found for shot in shots if isinstance(shot.found, RoughCable)]
    scale = calibration.scale.px_per_m
    fixed = fixed_cover(found, settings.series.max_fixed_shift_m * scale)
    if fixed is None:
        return shots
    diameter = None if fixed.cover.radius_px is None else 2.0 * fixed.cover.radius_px
    hints = BearingHints(cover_px=diameter)
    expected = Cable(specimen.diameter_m * scale, specimen.length_m * scale, hints)
    search, settled = Search(specimen, settings, calibration), list(shots)
    for k, cable in ((there[i], found[i]) for i in fixed.astray):
        photo = search.load(shots[k].step)
        again = photo if isinstance(photo, Rejected) else search.find_as(photo, expected)
        if isinstance(again, RoughCable) and fixed.is_shown_by(again):
            settled[k] = replace(shots[k], found=again)
        elif not fixed.taken(cable).sure:  # all that is sure stands where it was found
            said = Message("photo/bearing.astray", side=fixed.side, apart_m=fixed.apart_px(cable) / scale)
            settled[k] = replace(shots[k], found=Rejected(cable.image, said))
        else:
            settled[k] = replace(shots[k], found=fixed.doubted(cable))
    return settled


def of_one_size(shots: list[Shot]) -> tuple[list[Shot], tuple[Finding, ...]]:
    """Refuse photos of another size than most that were not merely cropped, and those turned by a quarter.

    A photo that was cropped shows the cable as long, in px, as the others do. One that was scaled has a scale of its
    own. On one that was turned by a quarter left and right are told by what was up and down: its bearings may change
    places, and everything along the cable with them.

    Returns
    -------
    list of Shot
        Where no size is that of more than half of the photos, or none of those shows the cable, none is refused for
        its size.
    tuple of Finding
        ``photo/size`` of each photo that was cropped; of all, where they have no usual size.
    """
    shots = _without_turned(shots)
    sizes = [shot.sides for shot in shots if shot.sides is not None]
    usual, count = Counter(sizes).most_common(1)[0] if sizes else ((), 0)
    lengths = [shot.found.length_px for shot in shots if shot.sides == usual and isinstance(shot.found, RoughCable)]
    if sizes and 2 * count <= len(sizes):
        each = [f"{shot.found.image} {shot.size[0]} x {shot.size[1]} px" for shot in shots if shot.size is not None]
        return shots, (doubtful("photo/size.several", sizes=each),)
    if not lengths:
        return shots, ()
    settled, findings = list(shots), []
    for k, shot in enumerate(shots):
        if shot.size is None or shot.sides == usual:
            continue
        name = shot.found.image
        both = {"size": f"{shot.size[0]} x {shot.size[1]} px", "most": f"{usual[1]} x {usual[0]} px"}
        ratio = shot.found.length_px / float(np.median(lengths)) if isinstance(shot.found, RoughCable) else np.nan
        # a length is found within a third of that, and nobody scales a photo by less
        if abs(ratio - 1.0) <= 0.03:
            findings.append(inferred("photo/size.cropped", image=name, **both))
        else:
            settled[k] = replace(shot, found=Rejected(name, Message("photo/size", **both)))
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

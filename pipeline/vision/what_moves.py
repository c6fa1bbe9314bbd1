"""A series searched without its ground, where a photo shows no cable or one of another length."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from pipeline.records import Rejected
from pipeline.vision.photo import Photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.segmentation import lies_on
from pipeline.vision.series_search import Search, Shot, count_alike
from pipeline.vision.still_ground import Ground, colour_along, moved_colours


def found_moving(search: Search, shots: list[Shot]) -> list[Shot]:
    """The photos of a series with the cables found without what stands still in it.

    Twice: by the colour of what moves in which the farthest photo shows the likeliest cable, then by that of the cables
    found. A cable that was seen as long on the same course before stays as it was found, if it was surely one, or as
    likely; one between two sure covers, as long as a known scale says, is not sought again.
    """
    usable = {k: shot.size for k, shot in enumerate(shots) if shot.size is not None and not _is_spoilt(shot)}
    alike = [k for k, size in usable.items() if size in dict(Counter(usable.values()).most_common(1))]
    most = search.settings.series.max_length_deviation
    doubted = count_alike([shots[k] for k in alike], most) < len(alike)
    if not doubted or len(alike) < 3:  # of two nobody knows which shows the ground
        return shots
    # seven held at once tell the ground to half of a photo's noise
    chosen = sorted({alike[i] for i in np.linspace(0, len(alike) - 1, 7).astype(int)})
    photos = {k: photo for k in chosen if isinstance(photo := search.load(shots[k].step), Photo)}
    held, sought = list(photos.values()), {k: shots[k] for k in alike if not _is_sure(search, shots[k])}
    farthest = max(photos, key=lambda k: abs(shots[k].step.displacement_m - shots[0].step.displacement_m))
    grounds = [Ground.of(held, colour) for colour in moved_colours(held)]
    tried = [(_searched(search, {farthest: shots[farthest]}, photos, ground).values(), ground) for ground in grounds]
    likely = [(cable.evidence.value, k) for k, (cables, _) in enumerate(tried) for cable in cables]
    if not likely:
        return shots
    found = _searched(search, sought, photos, grounds[max(likely)[1]])
    middles = [(photo, found[k].seen_px) for k, photo in photos.items() if k in found]
    if middles:
        for k, cable in _searched(search, sought, photos, Ground.of(held, colour_along(middles, held[0]))).items():
            found[k] = max(cable, found.get(k, cable), key=lambda one: one.evidence.value)
    settled = list(shots)
    for k, cable in found.items():
        before = shots[k].found
        if not _as_well(before, cable, most):
            rival = before if isinstance(before, RoughCable) else None
            settled[k] = replace(shots[k], found=replace(cable, rival=rival))
    return settled


def _searched(
    search: Search, shots: dict[int, Shot], photos: dict[int, Photo], ground: Ground
) -> dict[int, RoughCable]:
    """The cables found on photos without the ground; those that are held are not loaded again."""
    cables: dict[int, RoughCable] = {}
    near: RoughCable | None = None
    for k, shot in shots.items():
        photo = photos.get(k) or search.load(shot.step)
        found = photo if isinstance(photo, Rejected) else search.find(ground.without(photo), shot.step, near)
        if isinstance(found, RoughCable):
            cables[k] = near = found
    return cables


def _is_sure(search: Search, shot: Shot) -> bool:
    """True if the cable was seen between two sure covers and is as long as a known scale says."""
    if search.calibration is None or isinstance(shot.found, Rejected):
        return False
    length_px = search.calibration.scale.px_per_m * search.specimen.length_m
    as_long = count_alike([shot], search.settings.series.max_length_deviation, length_px)
    return bool(as_long and shot.found.left.sure and shot.found.right.sure)


def _is_spoilt(shot: Shot) -> bool:
    """True for a photo that shows nothing, or nothing sharp, whatever lies on the ground."""
    return isinstance(shot.found, Rejected) and shot.found.code in ("photo/blank", "photo/blur")


def _as_well(old: RoughCable | Rejected, new: RoughCable, most: float) -> bool:
    """True if it was seen before, as long to a relative deviation, and surely or as likely as now."""
    if isinstance(old, Rejected) or not lies_on(old, [new.path_px]):
        return False
    sure = old.evidence.clear or old.evidence.value >= new.evidence.value
    return sure and abs(new.length_px / old.length_px - 1.0) <= most

"""A photo to the one cable in it, to about a pixel - or the reason why not, with the figure that shows it.

``photo -> what stands out (backdrop) -> strips of constant width (strips) -> the cable among them (candidates) ->
cross-cuts (crosscut) -> bearing axes (bearings) -> RoughCable``

The cable is the longest strip of the right width; known bearings decide between candidates. Refused with a code:
``photo/nothing``, ``photo/contrast``, ``photo/two-candidates``, ``photo/crossing``, ``photo/leaves-frame``,
``photo/width`` (a mask split along a highlight, or another thing), ``photo/blur``, ``photo/bearing``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.records import Rejected
from pipeline.settings.vision import VisionSettings
from pipeline.settings.vision_stages import SegmentationSettings
from pipeline.vision.backdrop import Standout, choose_reduction, stand_out
from pipeline.vision.bearings import BearingHints, find_bearings, left_first
from pipeline.vision.candidates import Reading, Wanted, approaches_itself, branches, read_photo
from pipeline.vision.closeup import take_closeup
from pipeline.vision.crosscut import CrossCut, cut_across
from pipeline.vision.ends import CableEnd, at_border, between_axes, find_end, lead_to_axes, settle_end
from pipeline.vision.photo import Photo
from pipeline.vision.rough import Bearing, RoughCable
from pipeline.vision.strips import Strip

Window = tuple[int, int, int, int]


@dataclass(frozen=True)
class Cable:
    """What is known of the cable and its bearings before the photo is looked at; lengths in px, None if unknown."""

    diameter_px: float | None = None
    length_px: float | None = None
    bearings: BearingHints = field(default_factory=BearingHints)


def find_cable(
    photo: Photo, settings: VisionSettings, *, cable: Cable | None = None, near: RoughCable | None = None
) -> RoughCable | Rejected:
    """Find the cable.

    Parameters
    ----------
    photo : Photo
    settings : VisionSettings
    cable : Cable, optional
        What is known of it.
    near : RoughCable, optional
        The cable on a neighbouring photo of the series: only its surroundings are searched first.

    Returns
    -------
    RoughCable or Rejected
    """
    cable = Cable() if cable is None else cable
    if near is not None:
        found = _find_in(photo, settings, cable, _surroundings(near, photo, settings.segmentation))
        if isinstance(found, RoughCable):
            return found
    return _find_in(photo, settings, cable, None)


def _find_in(photo: Photo, settings: VisionSettings, cable: Cable, window: Window | None) -> RoughCable | Rejected:
    stage = settings.segmentation
    reduction = choose_reduction(photo.size, cable.diameter_px, stage)
    standout = stand_out(photo, reduction, stage, window=window)
    wanted = _wanted(standout, cable, stage)
    reading = read_photo(standout, wanted, stage)
    if reading.longest < wanted.least_length:
        return _nothing(photo, standout, reading)
    least = max(wanted.least_length, stage.rival_share * reading.longest)
    rivals = [strip for strip in reading.strips if strip.length >= least]
    outcomes = [_judge(photo, standout, reading, strip, cable, settings) for strip in rivals]
    accepted = [outcome for outcome in outcomes if isinstance(outcome, RoughCable)]
    if len(accepted) > 1:
        return _refused(
            photo,
            "photo/two-candidates",
            f"{len(accepted)} strips could be the cable ({rivals[0].length * reduction:.0f} px and "
            f"{rivals[1].length * reduction:.0f} px long); leave one cable in the picture",
            candidates=float(len(accepted)),
        )
    return accepted[0] if accepted else outcomes[0]


def _wanted(standout: Standout, cable: Cable, stage: SegmentationSettings) -> Wanted:
    width = None if cable.diameter_px is None else cable.diameter_px / standout.reduction
    if cable.length_px is None:
        least, most = stage.min_length_share * max(standout.residual.shape[:2]), np.inf
    else:
        length = cable.length_px / standout.reduction
        least, most = stage.visible_share * length, stage.max_length_ratio * length
    return Wanted(width, least, most, across_objects=cable.bearings.cover_radius(1.0) is None)


def _refused(photo: Photo, code: str, reason: str, **figure: float) -> Rejected:
    return Rejected(image=photo.name, code=code, reason=f"{photo.name}: {reason}.", figure=figure)


def _too_faint(photo: Photo, ratio: float, stage: SegmentationSettings) -> Rejected:
    return _refused(
        photo,
        "photo/contrast",
        f"the cable stands out of the ground by only {ratio:.1f} times its noise and texture, "
        f"{stage.min_contrast_to_noise:.0f} are needed; a ground of another brightness or colour helps",
        contrast_to_noise=ratio,
    )


def _nothing(photo: Photo, standout: Standout, reading: Reading) -> Rejected:
    """Say whether nothing is there or too little of it stands out."""
    longest = reading.longest * standout.reduction
    return _refused(
        photo,
        "photo/contrast",
        f"no strip of the cable's width stands out of the ground over a sufficient length: at {reading.level:.1f} "
        f"times its noise the longest piece is {longest:.0f} px; a ground of another brightness or colour helps",
        contrast_to_noise=reading.level,
        longest_px=longest,
    )


def _judge(
    photo: Photo, standout: Standout, reading: Reading, strip: Strip, cable: Cable, settings: VisionSettings
) -> RoughCable | Rejected:
    """One strip: is it the cable? The checks run from what misleads most to what misleads least."""
    stage = settings.segmentation
    cut = cut_across(standout, strip.path, reading.width, stage)
    if cut.contrast < stage.min_contrast_to_noise * cut.texture:
        return _too_faint(photo, cut.contrast / cut.texture, stage)
    if branches(strip, reading, stage) or approaches_itself(strip.path, reading.width):
        place = standout.to_pixels(strip.path[len(strip.path) // 2])
        return _refused(
            photo,
            "photo/crossing",
            "the cable crosses or touches itself or another strip, so its course is ambiguous",
            branch_px=strip.branch * standout.reduction,
            u_px=float(place[0]),
            v_px=float(place[1]),
        )
    axes = _axes(photo, standout, reading, strip, cable, settings)
    if isinstance(axes, Rejected):
        return axes
    path = lead_to_axes(standout, strip.path, reading.width, axes, settings.bearings)
    cut = cut_across(standout, path, reading.width, stage)
    refusal = _check_width(photo, cut, standout.reduction, cable, stage)
    return refusal if refusal is not None else _assemble(photo, standout, cut, axes, settings)


def _axes(
    photo: Photo, standout: Standout, reading: Reading, strip: Strip, cable: Cable, settings: VisionSettings
) -> tuple[Bearing, Bearing] | Rejected:
    """The bearing axes in the order of the strip's path."""
    width = reading.width * standout.reduction
    cover = cable.bearings.cover_radius(width)
    paths = (strip.path[::-1], strip.path)
    ends = tuple(find_end(path, reading, standout, cover, settings.bearings) for path in paths)
    hidden = cover is not None or cable.bearings.given_px is not None
    leaving = [end for end in ends if at_border(end, photo, width)]
    if leaving and not hidden:
        return _leaves(photo, leaving[0])
    first, second = find_bearings(photo, ends, width, cable.bearings, settings.bearings)
    if first is not None and second is not None:
        return first, second
    if leaving:
        return _leaves(photo, leaving[0])
    place = ends[0 if first is None else 1].place
    return _refused(
        photo,
        "photo/bearing",
        f"no round cover of the given diameter is seen at the cable's end near ({place[0]:.0f}, {place[1]:.0f}) px",
        u_px=float(place[0]),
        v_px=float(place[1]),
    )


def _leaves(photo: Photo, end: CableEnd) -> Rejected:
    return _refused(
        photo,
        "photo/leaves-frame",
        f"the cable leaves the picture at ({end.place[0]:.0f}, {end.place[1]:.0f}) px",
        u_px=float(end.place[0]),
        v_px=float(end.place[1]),
    )


def _check_width(
    photo: Photo, cut: CrossCut, reduction: int, cable: Cable, stage: SegmentationSettings
) -> Rejected | None:
    """Refuse a strip whose width is not the cable's, or not constant."""
    widths = cut.width[np.isfinite(cut.width)] * reduction
    if len(widths) < 0.5 * len(cut.width):
        share = len(widths) / len(cut.width)
        return _refused(
            photo,
            "photo/width",
            f"both edges of the cable are seen on only {100 * share:.0f} % of its length",
            share=share,
        )
    median = float(np.median(widths))
    low, high = stage.accepted_width_ratio
    if cable.diameter_px is not None and not low <= median / cable.diameter_px <= high:
        return _refused(
            photo,
            "photo/width",
            f"the strip is {median:.1f} px wide, the cable should be {cable.diameter_px:.1f} px; "
            "a highlight may split it, or the scale or diameter is wrong",
            width_px=median,
            diameter_px=cable.diameter_px,
        )
    scatter = 1.4826 * float(np.median(np.abs(widths - median))) / median
    if scatter > stage.max_width_scatter:
        return _refused(
            photo,
            "photo/width",
            f"the strip's width varies by {100 * scatter:.0f} %, a cable's does not",
            width_scatter=scatter,
        )
    return None


def _assemble(
    photo: Photo, standout: Standout, cut: CrossCut, axes: tuple[Bearing, Bearing], settings: VisionSettings
) -> RoughCable | Rejected:
    stage = settings.segmentation
    path = standout.to_pixels(cut.path)
    seen = cut.step > stage.seen_share * cut.contrast
    if not left_first(np.array(axes[0].center_px), np.array(axes[1].center_px), settings.bearings):
        path, seen, axes = path[::-1], seen[::-1], axes[::-1]
    width = float(np.nanmedian(cut.width)) * standout.reduction
    closeup = take_closeup(photo, path, width, cut.weights, stage)
    axes = (
        settle_end(axes[0], path[::-1], closeup, width, settings.bearings),
        settle_end(axes[1], path, closeup, width, settings.bearings),
    )
    path, visible = between_axes(path, seen, axes, settings.bearings.cover_margin_widths * width)
    if visible is None:
        return _refused(photo, "photo/bearing", "nothing of the cable is seen between the bearing axes")
    ratio = cut.contrast / max(float(np.hypot(cut.texture, closeup.noise)), 1e-9)
    if ratio < stage.min_contrast_to_noise:
        return _too_faint(photo, ratio, stage)
    if closeup.blur_px > stage.max_blur_widths * width:
        return _refused(
            photo,
            "photo/blur",
            f"the edges are spread by {closeup.blur_px:.1f} px on a cable of {width:.1f} px; focus the camera",
            blur_px=closeup.blur_px,
            width_px=width,
        )
    finite = cut.width[np.isfinite(cut.width)]
    scatter = 1.4826 * float(np.median(np.abs(finite - np.median(finite)))) / float(np.median(finite))
    return RoughCable(
        image=photo.name,
        path_px=path,
        visible=visible,
        left=axes[0],
        right=axes[1],
        half_width_px=0.5 * width,
        grey=closeup.grey,
        origin_px=closeup.origin_px,
        dark=cut.dark,
        contrast=cut.contrast,
        noise=closeup.noise,
        blur_px=closeup.blur_px,
        weights=tuple(float(weight) for weight in cut.weights),
        quality={"contrast_to_noise": ratio, "width_scatter": scatter},
    )


def _surroundings(near: RoughCable, photo: Photo, stage: SegmentationSettings) -> Window:
    """Where the cable can be one step later: its box on the neighbour photo and a share of its size around."""
    low, high = near.path_px.min(axis=0), near.path_px.max(axis=0)
    margin = stage.search_margin_share * float((high - low).max()) + 4.0 * near.half_width_px
    u0, v0 = np.maximum(np.floor(low - margin).astype(int), 0)
    u1, v1 = np.minimum(np.ceil(high + margin).astype(int) + 1, photo.size)
    return int(u0), int(v0), int(u1), int(v1)

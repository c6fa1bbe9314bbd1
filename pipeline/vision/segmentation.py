"""A photo to the one cable in it, to about a pixel - or the reason why not, with the figure that shows it.

``photo -> what stands out (backdrop) -> strips of constant width (strips) -> the cable among them (candidates) ->
judged one by one (judgement) -> RoughCable``

The cable is the longest strip of the right width; known bearings decide between candidates. Refused with a code:
``photo/nothing``, ``photo/blank``, ``photo/contrast``, ``photo/two-candidates``, ``photo/crossing``,
``photo/leaves-frame``, ``photo/width`` (a mask split along a highlight, or another thing), ``photo/blur``,
``photo/bearing``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from pipeline.records import Array, Rejected
from pipeline.settings.vision import VisionSettings
from pipeline.settings.vision.photo import PhotoSettings
from pipeline.settings.vision.search import SegmentationSettings
from pipeline.vision.bearings.axes import SoughtCovers
from pipeline.vision.judgement import Cable, judge_strip, refused
from pipeline.vision.median import median
from pipeline.vision.photo import Photo, levels
from pipeline.vision.rough import RoughCable
from pipeline.vision.search.backdrop import Standout, choose_reduction, stand_out
from pipeline.vision.search.candidates import Reading, Wanted, narrowest, read_alone, read_photo

Window = tuple[int, int, int, int]


# Other readings of a photo that shows a crossing may well show one arm of it as a clean strip.
_CONCLUSIVE = ("photo/crossing", "photo/two-candidates")
# What is refused so looks like a cable that is not seen whole: something shorter elsewhere is not the cable either.
_IN_PIECES = ("photo/hidden-end", "photo/two-candidates")


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
    found = _find_near(photo, settings, cable, near)
    if cable.diameter_px is not None or cable.slenderness is None or _is_slender(found, cable.slenderness, settings):
        return found
    # The two flanks of a round sheath, its highlight or the shadow beside it are strips as long as the cable is.
    widths = [2.0 * near.half_width_px] if near is not None else _widths(photo, cable.slenderness, settings)
    for width in widths:
        again = _find_near(photo, settings, replace(cable, diameter_px=width), near)
        if _is_slender(again, cable.slenderness, settings):
            return again
    return found if isinstance(found, Rejected) else _too_thin(photo, found, cable.slenderness)


def _find_near(photo: Photo, settings: VisionSettings, cable: Cable, near: RoughCable | None) -> RoughCable | Rejected:
    """Find the cable where a neighbour photo lets it be expected, then anywhere."""
    cable = replace(cable, bearings=replace(cable.bearings, sought=SoughtCovers()))
    if near is not None:
        found = _find_in(photo, settings, cable, _surroundings(near, photo, settings.segmentation))
        if isinstance(found, RoughCable):
            return found
    return _find_in(photo, settings, cable, None)


def _is_slender(found: RoughCable | Rejected, slenderness: float, settings: VisionSettings) -> bool:
    """True for a cable about as many times as long as wide as it is stated to be."""
    if isinstance(found, Rejected):
        return False
    low, high = settings.segmentation.accepted_slenderness_ratio
    return low <= _slenderness(found) / slenderness <= high


def _slenderness(found: RoughCable) -> float:
    return 0.5 * found.length_px / found.half_width_px


def _too_thin(photo: Photo, found: RoughCable, slenderness: float) -> Rejected:
    text = (
        f"the strip is {_slenderness(found):.0f} times as long as wide, by length_mm and diameter_mm the cable is "
        f"{slenderness:.0f} times; a highlight may split it, or one of the two is wrong"
    )
    return refused(photo, "photo/width", text, seen=_slenderness(found), stated=slenderness)


def _widths(photo: Photo, slenderness: float, settings: VisionSettings) -> list[float]:
    """Widths (px) the cable has by its stated slenderness if the longest strips seen are as long as it is."""
    standout = stand_out(photo, choose_reduction(photo.size, None, settings.segmentation), settings.segmentation)
    wanted = _wanted(standout, Cable(), settings.segmentation)
    for readings in read_photo(standout, wanted, settings.segmentation):
        longest = max(reading.longest for reading in readings)
        if longest >= wanted.least_length:
            return [longest * standout.reduction / slenderness]
    return []


def _find_in(photo: Photo, settings: VisionSettings, cable: Cable, window: Window | None) -> RoughCable | Rejected:
    stage = settings.segmentation
    reduction = choose_reduction(photo.size, cable.diameter_px, stage)
    if cable.diameter_px is None:
        alone = _find_alone(photo, settings, cable, reduction, window)
        if alone is not None:
            return alone
    standout = stand_out(photo, reduction, stage, window=window)
    wanted = _wanted(standout, cable, stage)
    first: Rejected | None = None
    leaving: list[Array] = []
    going_on: list[tuple[Rejected, Array]] = []
    for readings in read_photo(standout, wanted, stage):
        if readings[0].longest < wanted.least_length:
            if first is not None:
                return first
            return _blank(photo, settings.photo) or _nothing(
                photo, standout, readings[0], known=wanted.width is not None
            )
        outcome, path = _weigh(photo, standout, readings, wanted, cable, settings)
        if isinstance(outcome, RoughCable):
            if first is not None and _lies_on(outcome, leaving):
                return first
            more = _more_shown(outcome, going_on, settings)
            return outcome if more is None else more[0]
        if outcome.code in _CONCLUSIVE:
            return outcome
        if outcome.code == "photo/leaves-frame":
            leaving.append(path)
        if outcome.code == "photo/hidden-end":
            going_on.append((outcome, path))
        first = outcome if first is None else first
    if first is None:
        raise ValueError("read_photo always gives a reading")
    return first


def _find_alone(
    photo: Photo, settings: VisionSettings, cable: Cable, reduction: int, window: Window | None
) -> RoughCable | None:
    """A cable of unknown width on fewer cells, if it is all there is to see; what is refused needs a closer look."""
    stage = settings.segmentation
    coarser = stage.first_coarser
    standout = stand_out(photo, coarser * reduction, stage, window=window)
    enough = int(coarser * narrowest(standout, stage) / stage.cells_across)
    if enough < 2:
        return None
    if enough < coarser:
        standout = stand_out(photo, enough * reduction, stage, window=window)
    wanted = _wanted(standout, cable, stage)
    reading = read_alone(standout, wanted, stage)
    if reading is None:
        return None
    found, _ = _weigh(photo, standout, (reading,), wanted, cable, settings)
    return found if isinstance(found, RoughCable) else None


def _weigh(
    photo: Photo,
    standout: Standout,
    readings: tuple[Reading, ...],
    wanted: Wanted,
    cable: Cable,
    settings: VisionSettings,
) -> tuple[RoughCable | Rejected, Array]:
    """Judge the long strips of each reading; the largest strip with a clear verdict speaks for the photo.

    Returns the verdict and the strip's path in px.
    """
    verdicts: list[tuple[float, RoughCable | Rejected, Array]] = []
    for reading in readings:
        least = max(wanted.least_length, settings.segmentation.rival_share * reading.longest)
        rivals = [strip for strip in reading.strips if strip.length >= least]
        outcomes = _whole([judge_strip(photo, standout, reading, strip, cable, settings) for strip in rivals], settings)
        contrasts = [outcome.contrast if isinstance(outcome, RoughCable) else 0.0 for outcome in outcomes]
        # a shadow that lies apart from the cable is as long and fainter
        faintest = settings.segmentation.rival_share * max(contrasts, default=0.0)
        accepted = [k for k, contrast in enumerate(contrasts) if contrast > 0.0 and contrast >= faintest]
        accepted.sort(key=lambda k: -_length(outcomes[k]))  # a piece that was followed farther is more of the cable
        area = reading.longest * reading.width
        chosen = accepted[0] if accepted else 0
        outcome = outcomes[chosen]
        # blur is judged last: a strip refused for it looks like a cable in all else
        blurred = [k for k, verdict in enumerate(outcomes) if _code(verdict) == "photo/blur"]
        alike = _apart(accepted, outcomes) + blurred
        if accepted and len(alike) > 1:
            lengths = [rivals[k].length * standout.reduction for k in alike]
            text = (
                f"{len(alike)} strips could be the cable ({lengths[0]:.0f} px and {lengths[1]:.0f} px long); "
                "leave one cable in the picture"
            )
            outcome = refused(photo, "photo/two-candidates", text, candidates=float(len(alike)))
        if isinstance(outcome, RoughCable):  # it may have been followed farther
            area = 2.0 * outcome.half_width_px * outcome.length_px / standout.reduction**2
        verdicts.append((area, outcome, standout.to_pixels(rivals[chosen].path)))
    clear = [v for v in verdicts if isinstance(v[1], RoughCable) or v[1].code in _CONCLUSIVE]
    _, outcome, path = max(clear or verdicts, key=lambda verdict: verdict[0])
    if isinstance(outcome, RoughCable):
        going_on = [(v[1], v[2]) for v in verdicts if isinstance(v[1], Rejected) and v[1].code in _IN_PIECES]
        outcome, path = _more_shown(outcome, going_on, settings) or (outcome, path)
    return outcome, path


def _code(outcome: RoughCable | Rejected) -> str:
    return outcome.code if isinstance(outcome, Rejected) else ""


def _length(outcome: RoughCable | Rejected) -> float:
    return outcome.length_px if isinstance(outcome, RoughCable) else 0.0


def _more_shown(
    found: RoughCable, going_on: list[tuple[Rejected, Array]], settings: VisionSettings
) -> tuple[Rejected, Array] | None:
    """Refusal and path of a strip that another reading showed to go on: where this one ends, or longer, elsewhere."""
    tree = cKDTree(found.path_px)
    for refusal, path in going_on:
        longer = float(np.hypot(*np.diff(path, axis=0).T).sum()) > found.length_px
        elsewhere = median(tree.query(path)[0]) > found.half_width_px
        at_end = refusal.code == "photo/hidden-end" and _ends_at(found, refusal, settings)
        if at_end or (longer and elsewhere):
            return refusal, path
    return None


def _ends_at(found: RoughCable, refusal: Rejected, settings: VisionSettings) -> bool:
    """True if what was found ends, under no cover, where a strip was seen to go on."""
    stage, width = settings.segmentation, 2.0 * found.half_width_px
    place = np.array([refusal.figure["u_px"], refusal.figure["v_px"]])
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(found.path_px, axis=0).T))]
    distance = np.hypot(*(found.path_px - place).T)
    passed = along[int(np.argmin(distance))]  # a place that was passed is followed beyond
    at_end = min(passed, along[-1] - passed) < stage.beyond_least_widths * width
    return found.left.radius_px is None and at_end and bool(distance[[0, -1]].min() < stage.hidden_widths * width)


def _whole(outcomes: list[RoughCable | Rejected], settings: VisionSettings) -> list[RoughCable | Rejected]:
    """The verdicts, but for a cable that ends where another strip is known to go on: it is the piece beyond."""
    going_on = [o for o in outcomes if isinstance(o, Rejected) and o.code == "photo/hidden-end"]

    def piece_of(found: RoughCable) -> Rejected | None:
        return next((other for other in going_on if _ends_at(found, other, settings)), None)

    return [(piece_of(o) or o) if isinstance(o, RoughCable) else o for o in outcomes]


def _apart(chosen: list[int], outcomes: list[RoughCable | Rejected]) -> list[int]:
    """Those chosen that do not lie on one before: two pieces of one cable are followed to the same whole."""
    kept: list[int] = []
    for k in chosen:
        found = outcomes[k]
        before = [o for o in (outcomes[other] for other in kept) if isinstance(o, RoughCable)]
        if not (isinstance(found, RoughCable) and _lies_on(found, [other.path_px for other in before])):
            kept.append(k)
    return kept


def _lies_on(found: RoughCable, paths: list[Array]) -> bool:
    """True if most of the cable found lies within half a width of one of the paths (px)."""
    first, last = found.visible
    body = found.path_px[first : last + 1]
    return any(median(cKDTree(path).query(body)[0]) < found.half_width_px for path in paths)


def _wanted(standout: Standout, cable: Cable, stage: SegmentationSettings) -> Wanted:
    width = None if cable.diameter_px is None else cable.diameter_px / standout.reduction
    if cable.length_px is None:
        least, most = stage.min_length_share * max(standout.residual.shape[:2]), np.inf
    else:
        length = cable.length_px / standout.reduction
        least, most = stage.visible_share * length, stage.max_length_ratio * length
    return Wanted(width, least, most, across_objects=cable.bearings.cover_radius(1.0) is None)


def _blank(photo: Photo, stage: PhotoSettings) -> Rejected | None:
    """A picture of one level, such as that of a lens cap."""
    darkest, brightest = levels(photo)
    if brightest - darkest > stage.blank_range:
        return None
    text = (
        f"the picture shows nothing: its brightness is {50 * (darkest + brightest):.0f} % everywhere; look after lens "
        "cap, lamp and exposure"
    )
    return refused(photo, "photo/blank", text, brightness=0.5 * (darkest + brightest))


def _nothing(photo: Photo, standout: Standout, reading: Reading, *, known: bool) -> Rejected:
    """Say whether nothing is there or too little of it stands out; ``known`` if the cable's width is."""
    longest, width = reading.longest * standout.reduction, reading.width * standout.reduction
    found = {"contrast_to_noise": reading.level, "longest_px": longest}
    if not known:
        text = (
            f"no strip of the cable's width stands out of the ground over a sufficient length: at {reading.level:.1f} "
            f"times its noise the longest piece is {longest:.0f} px; a ground of another brightness or colour helps"
        )
        return refused(photo, "photo/contrast", text, **found)
    text = (
        f"no strip of the cable's width, {width:.0f} px, stands out of the ground over a sufficient length: at "
        f"{reading.level:.1f} times its noise the longest piece is {longest:.0f} px; if that is not the cable's width, "
        "scale or diameter is wrong, else a ground of another brightness or colour helps"
    )
    return refused(photo, "photo/contrast", text, width_px=width, **found)


def _surroundings(near: RoughCable, photo: Photo, stage: SegmentationSettings) -> Window:
    """Where the cable can be one step later: its box on the neighbour photo and a share of its size around."""
    low, high = near.path_px.min(axis=0), near.path_px.max(axis=0)
    margin = stage.search_margin_share * float((high - low).max()) + 4.0 * near.half_width_px
    u0, v0 = np.maximum(np.floor(low - margin).astype(int), 0)
    u1, v1 = np.minimum(np.ceil(high + margin).astype(int) + 1, photo.size)
    return int(u0), int(v0), int(u1), int(v1)

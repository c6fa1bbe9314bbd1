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
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from pipeline.records import Array, PhotoHints, Rejected, doubtful
from pipeline.vision.by_hand import reading_along, with_hints
from pipeline.vision.evidence import unlike_a_cable
from pipeline.vision.judgement import Cable, judge_strip, refused, refused_at
from pipeline.vision.median import median
from pipeline.vision.photo import Photo, levels
from pipeline.vision.polyline import step_lengths
from pipeline.vision.rough import RoughCable
from pipeline.vision.search.backdrop import Standout, choose_reduction, in_one_colour, stand_out
from pipeline.vision.search.border import border_width
from pipeline.vision.search.candidates import Reading, Wanted, read_photo
from pipeline.vision.search.strips import MIN_PIECE_WIDTHS, WIDTH_RATIO_RANGE

Window = tuple[int, int, int, int]

_WIDER = 1.08  # of the width; a course's strip that is wider by more has other edges
_RIVAL = 0.35  # of the best strip's evidence; on wire piles another cable has more, pieces of one cable less
_OF_A_CABLE = ("photo/crossing", "photo/leaves-frame", "photo/hidden-end")  # why a strip is refused that may be a cable
_MIN_LENGTH_SHARE = 0.2  # share of the photo's long side; a shorter strip is not the subject of the photo
_VISIBLE_SHARE = 0.55  # share of the known length that must be seen; covers hide up to a quarter
_MAX_LENGTH_RATIO = 1.25  # ratio to the known length; longer strips are rails and edges of the table
_RIVAL_SHARE = 0.5  # share of the longest strip's length, and of the best contrast, of another rival
_ACCEPTED_SLENDERNESS_RATIO = (0.6, 1.5)
"""Ratio of length to width as seen and as stated, where no scale is known; covers hide up to a third of a short, thick
cable, and a sheath may be dark at its flanks.
"""
_SEARCH_MARGIN_SHARE = 0.12  # share of the cable's extent; a step moves the bow by less, else all is searched
_BLANK_RANGE = 0.03  # of the full range; a picture whose broad parts differ by less shows nothing


def find_cable(
    photo: Photo, *, cable: Cable | None = None, near: RoughCable | None = None, hints: PhotoHints | None = None
) -> RoughCable | Rejected:
    """Find the cable.

    Parameters
    ----------
    cable : Cable, optional
        What is known of it.
    near : RoughCable, optional
        The cable on a neighbouring photo of the series: only its surroundings are searched first.
    hints : PhotoHints, optional
        What a person says about this photo.
    """
    cable = Cable() if cable is None else cable
    if hints is not None:
        photo, cable = with_hints(photo, cable, hints)
    found = _find_near(photo, cable, near)
    if cable.diameter_px is not None or cable.slenderness is None or _is_slender(found, cable.slenderness):
        return found
    # The two flanks of a round sheath, its highlight or the shadow beside it are strips as long as the cable is.
    width = 2.0 * near.half_width_px if near is not None else _width_of_longest(photo, cable.slenderness)
    if width is not None:
        again = _find_near(photo, replace(cable, diameter_px=width), near)
        if _is_slender(again, cable.slenderness):
            return again
    if isinstance(found, Rejected):
        return found
    return refused(photo, "photo/width.slender", seen=_slenderness(found), stated=cable.slenderness)


def _find_near(photo: Photo, cable: Cable, near: RoughCable | None) -> RoughCable | Rejected:
    """Find the cable where a neighbour photo lets it be expected, then anywhere."""
    seen = () if near is None else near.axes
    cable = replace(cable, bearings=replace(cable.bearings, seen=seen, sought=[]))
    if cable.path_px:
        return _along_clicks(photo, cable)
    if near is not None and cable.region is None:
        found = _find_in(photo, cable, _surroundings(near, photo), near)
        if isinstance(found, RoughCable):
            return found
    return _find_in(photo, cable, cable.region, near)


def _along_clicks(photo: Photo, cable: Cable) -> RoughCable | Rejected:
    """The cable along a person's clicks, of the width that has the most evidence."""
    judged = []
    # an edge is sought as far as a third beside its place
    for width in np.geomspace(4.0, 80.0, 10).tolist() if cable.diameter_px is None else [cable.diameter_px]:
        standout = stand_out(photo, choose_reduction(photo.size, width))
        reading = reading_along(standout, cable.path_px, width)
        outcome = judge_strip(photo, standout, reading, reading.strips[0], cable)
        judged.append(_Judged(outcome, standout.to_pixels(reading.strips[0].path), width))
    return _chosen(photo, judged)


def _is_slender(found: RoughCable | Rejected, slenderness: float) -> bool:
    """True for a cable about as many times as long as wide as it is stated to be."""
    if isinstance(found, Rejected):
        return False
    low, high = _ACCEPTED_SLENDERNESS_RATIO
    return low <= _slenderness(found) / slenderness <= high


def _slenderness(found: RoughCable) -> float:
    return 0.5 * found.length_px / found.half_width_px


def _width_of_longest(photo: Photo, slenderness: float) -> float | None:
    """Width (px) the cable has by its stated slenderness if the longest strip seen is as long as it is."""
    standout = stand_out(photo, choose_reduction(photo.size, None))
    wanted = _wanted(standout, Cable())
    for readings in read_photo(standout, wanted):
        longest = max(reading.longest for reading in readings)
        if longest >= wanted.least_length:
            return longest * standout.reduction / slenderness
    return None


def _find_in(photo: Photo, cable: Cable, window: Window | None, near: RoughCable | None) -> RoughCable | Rejected:
    """The cable in a window; where no width is known, one from border to border of what lies there."""
    seen, found = _found(photo, cable, window, near)
    if isinstance(found, Rejected) or cable.diameter_px is not None:
        return found
    whole = border_width(seen, found)
    if whole is None:
        return found
    seen, again = _found(photo, replace(cable, diameter_px=whole), window, near)
    if isinstance(again, RoughCable) and lies_on(again, [found.path_px]) and border_width(seen, again) is None:
        return again
    return refused(photo, "photo/width.part", width_px=2.0 * found.half_width_px, whole_px=whole)


def _found(
    photo: Photo, cable: Cable, window: Window | None, near: RoughCable | None
) -> tuple[Photo, RoughCable | Rejected]:
    """The cable in a window, in all colours or in one, and the photo in these."""
    reduction = choose_reduction(photo.size, cable.diameter_px)
    standout = stand_out(photo, reduction, window=window)
    wanted = _wanted(standout, cable)
    found, alike = _read(photo, standout, wanted, cable), in_one_colour(photo, standout)
    if alike is None:
        return photo, found
    in_one = _read(alike, stand_out(alike, reduction, window=window), wanted, cable)
    pairs = [(photo, found), (alike, in_one)]
    (seen, chosen), (_, other) = reversed(pairs) if _is_better(in_one, found, cable.diameter_px, near) else pairs
    if isinstance(chosen, RoughCable) and isinstance(other, RoughCable):
        chosen = replace(chosen, rival=other)
    return seen, chosen


def _is_better(
    in_one: RoughCable | Rejected, found: RoughCable | Rejected, diameter: float | None, near: RoughCable | None = None
) -> bool:
    """Whether the cable is seen better in one colour: what is narrower or shorter may be a stripe or a half of it.

    Of a known ``diameter`` (px), the strip that is as wide: with the colour of a shadow beside it, it is wider. Of two
    that are alike the one that is seen as on the photo before, ``near``: light moves the edges of both, and a midline
    that is off by the same on all photos bends no cable.
    """
    if isinstance(in_one, Rejected) or _is_piece(in_one):
        return False  # a piece of the cable may be anything of that colour too
    if isinstance(found, Rejected):
        return True
    longer, wider = in_one.length_px / found.length_px, in_one.half_width_px / found.half_width_px
    if diameter is not None:
        off, off_in_one = (abs(np.log(2.0 * one.half_width_px / diameter)) for one in (found, in_one))
        wider = float(np.exp(off - off_in_one))
    if max(longer, wider) > _WIDER:
        return True
    if diameter is not None and wider * _WIDER <= 1.0:
        return False
    if near is not None:
        return len(near.weights) == 1
    return in_one.evidence.firmness > found.evidence.firmness


def _read(photo: Photo, standout: Standout, wanted: Wanted, cable: Cable) -> RoughCable | Rejected:
    """The strip with the most evidence of the readings up to one that leaves nothing to be looked for."""
    judged: list[_Judged] = []
    for readings in read_photo(standout, wanted):
        if readings[0].longest < wanted.least_length:
            if judged:
                break
            return _blank(photo) or _nothing(photo, standout, readings[0], known=wanted.width is not None)
        for reading in readings:
            judged += _judged(photo, standout, reading, wanted, cable)
        outcome = _chosen(photo, judged)
        if isinstance(outcome, RoughCable) and outcome.evidence.clear and not outcome.goes_on:
            return outcome  # surely the whole cable: no other reading is needed
    outcome = _chosen(photo, judged)
    return (_blank(photo) or outcome) if isinstance(outcome, Rejected) else outcome


class _Judged(NamedTuple):
    """Outcome of a strip, and its path (k, 2) px and area."""

    outcome: RoughCable | Rejected
    path: Array
    area: float


def _judged(photo: Photo, standout: Standout, reading: Reading, wanted: Wanted, cable: Cable) -> list[_Judged]:
    """The long strips of one reading."""
    least = max(wanted.least_length, _RIVAL_SHARE * reading.longest)
    strips = [strip for strip in reading.strips if strip.length >= least]
    outcomes = [judge_strip(photo, standout, reading, strip, cable) for strip in strips]
    pairs = zip(outcomes, strips, strict=True)
    return [_Judged(one, standout.to_pixels(strip.path), strip.length * reading.width) for one, strip in pairs]


def _chosen(photo: Photo, judged: list[_Judged]) -> RoughCable | Rejected:
    """The strip of all readings with the most evidence, or why there is none."""
    likely = [one.outcome for one in judged if isinstance(one.outcome, RoughCable)]
    # a shadow that lies apart from the cable is as long and fainter
    strongest = max((found.contrast for found in likely), default=0.0)
    likely = [found for found in likely if found.contrast >= min(_RIVAL_SHARE * strongest, strongest)]
    likely.sort(key=lambda found: -found.evidence.value)
    refusals = [(one.area, one.outcome, one.path) for one in judged if isinstance(one.outcome, Rejected)]
    if not likely:
        return max(refusals, key=lambda refusal: refusal[0])[1]
    best = _widest_alike(likely)
    for _, refusal, path in refusals:
        # other readings of a photo that shows a crossing, or the cable cut, may show one arm of it as a clean strip
        length, beyond = float(step_lengths(path).sum()), _length_beyond(path, best)
        longer = length > best.length_px and beyond > 2.0 * MIN_PIECE_WIDTHS * best.half_width_px
        if longer and refusal.code in ("photo/crossing", "photo/hidden-end"):
            return refusal
        if refusal.code == "photo/crossing" and _is_piece(best) and beyond < 0.5 * length:
            return refusal  # or a piece that ends where it comes to the crossing
        if refusal.code == "photo/leaves-frame" and lies_on(best, [path]):
            return refusal
    if not best.evidence.enough:
        return Rejected(photo.name, unlike_a_cable(best.evidence))
    if best.evidence.crossed is not None:
        return refused_at(photo, "photo/crossing", best.evidence.crossed)
    other = next((found for found in likely if _is_rival(found, best)), None)
    if other is not None:
        return refused(photo, "photo/two-candidates", one_px=best.length_px, other_px=other.length_px)
    beside = [_length_beyond(path, best) for _, refusal, path in refusals if refusal.code in _OF_A_CABLE]
    if max(beside, default=0.0) <= _RIVAL * best.length_px:
        return best
    taken = doubtful("photo/two-candidates.taken", one_px=best.length_px, other_px=max(beside))
    return replace(best, findings=(*best.findings, taken))


def _widest_alike(likely: list[RoughCable]) -> RoughCable:
    """The likeliest strip, or a wider one on its course that is nearly as likely and stands out as much.

    A highlight or a shaded half is a strip within the cable, and nothing doubles a cable.
    """
    best = likely[0]
    for found in likely[1:]:
        wider = found.half_width_px > _WIDER * best.half_width_px and found.contrast > 0.95 * best.contrast
        if wider and found.evidence.value > 0.85 * best.evidence.value and lies_on(found, [best.path_px]):
            best = found
    return best


def _is_piece(found: RoughCable) -> bool:
    """True if something is said to hide the rest of a cable."""
    return any(finding.code == "photo/hidden-end" for finding in found.findings)


def _is_rival(found: RoughCable, best: RoughCable) -> bool:
    """True for a strip of about the width of the best, elsewhere, that is as surely a cable and about as long."""
    alike = WIDTH_RATIO_RANGE[0] < found.half_width_px / best.half_width_px < WIDTH_RATIO_RANGE[1]
    long = found.evidence.value > _RIVAL * best.evidence.value
    return alike and long and found.evidence.enough and not lies_on(found, [best.path_px])


def _length_beyond(path: Array, best: RoughCable) -> float:
    """Length (px) of what a strip's path has farther than a width from the course of another: flanks lie nearer."""
    away = np.asarray(cKDTree(best.path_px).query(path)[0]) > 2.0 * best.half_width_px
    return float(step_lengths(path)[away[1:]].sum())


def lies_on(found: RoughCable, paths: list[Array]) -> bool:
    """True if most of the cable found lies within half a width of one of the paths (px)."""
    return any(median(cKDTree(path).query(found.seen_px)[0]) < found.half_width_px for path in paths)


def _wanted(standout: Standout, cable: Cable) -> Wanted:
    width = None if cable.diameter_px is None else cable.diameter_px / standout.reduction
    if cable.length_px is None:
        least, most = _MIN_LENGTH_SHARE * max(standout.residual.shape[:2]), np.inf
    else:
        length = cable.length_px / standout.reduction
        least, most = _VISIBLE_SHARE * length, _MAX_LENGTH_RATIO * length
    return Wanted(width, least, most)


def _blank(photo: Photo) -> Rejected | None:
    """A picture of one level, such as that of a lens cap."""
    darkest, brightest = levels(photo)
    if brightest - darkest > _BLANK_RANGE:
        return None
    return refused(photo, "photo/blank", brightness=0.5 * (darkest + brightest))


def _nothing(photo: Photo, standout: Standout, reading: Reading, *, known: bool) -> Rejected:
    """Say whether nothing is there or too little of it stands out; ``known`` if the cable's width is."""
    return refused(
        photo,
        "photo/contrast.nothing-known" if known else "photo/contrast.nothing",
        contrast_to_noise=reading.level,
        longest_px=reading.longest * standout.reduction,
        width_px=reading.width * standout.reduction,
    )


def _surroundings(near: RoughCable, photo: Photo) -> Window:
    """Where the cable can be one step later: its box on the neighbour photo and a share of its size around."""
    low, high = near.path_px.min(axis=0), near.path_px.max(axis=0)
    margin = _SEARCH_MARGIN_SHARE * float((high - low).max()) + 4.0 * near.half_width_px
    u0, v0 = np.maximum(np.floor(low - margin).astype(int), 0)
    u1, v1 = np.minimum(np.ceil(high + margin).astype(int) + 1, photo.size)
    return int(u0), int(v0), int(u1), int(v1)

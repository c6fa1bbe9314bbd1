"""One strip of the photo: is it the cable? Its cross-cuts, its course, its ends and bearings, its figures.

``strip -> contrast -> crossings -> bearing axes -> cross-cuts up to the axes -> width -> RoughCable``

The checks run from what misleads most to what misleads least; each refusal says the figure that shows why.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pipeline.messages import Message
from pipeline.records import Array, Finding, Rejected, doubtful, inferred
from pipeline.vision.bearings.covers import BearingHints, find_bearings, left_first
from pipeline.vision.evidence import weigh
from pipeline.vision.photo import Photo
from pipeline.vision.polyline import step_lengths
from pipeline.vision.rough import Bearing, RoughCable
from pipeline.vision.search.backdrop import Standout
from pipeline.vision.search.beyond import follow, followed_in, more_beyond
from pipeline.vision.search.candidates import Reading
from pipeline.vision.search.closeup import edge_spreads, take_closeup
from pipeline.vision.search.crosscut import CrossCut, crossed_at, cut_across, path_normals
from pipeline.vision.search.ends import (
    TRIMMED_WIDTHS,
    at_border,
    find_end,
    led_to_axes,
    outside_covers,
    settle_end,
    without_specks,
)
from pipeline.vision.search.strips import MIN_PIECE_WIDTHS, Strip

_LEAST_SLENDERNESS = 10.0  # widths; a shorter strip of unknown width is a fold or a thing: no rod bends on ten
_LEAST_BEFORE_COVER = 1.0  # widths; a shorter piece of cable between a band across it and a cover shows no direction
_LEAST_REST = 1.0  # widths; so much that looks like the cable beyond its end is told
_BLURRED = 0.1  # widths; with more blur that, and no missing cover, is why no axis was found
_ACCEPTED_WIDTH_RATIO = (0.65, 1.35)  # ratio of the edges' distance to the diameter; a sheath may be dark at its flanks


@dataclass(frozen=True)
class Cable:
    """What is known of the cable and its bearings before the photo is looked at; lengths in px, None if unknown.

    ``slenderness`` is length over diameter, known without a scale too. ``region`` (u0, v0, u1, v1) and ``path_px`` are
    where a person says it lies.
    """

    diameter_px: float | None = None
    length_px: float | None = None
    bearings: BearingHints = field(default_factory=BearingHints)
    slenderness: float | None = None
    region: tuple[int, int, int, int] | None = None
    path_px: tuple[tuple[float, float], ...] = ()

    @property
    def any_length(self) -> bool:
        """True if nothing tells how long the cable is: a piece of it may be traced as such."""
        return self.length_px is None and self.slenderness is None


def refused(photo: Photo, key: str, **figure: float) -> Rejected:
    """The refusal of a photo: the key of its sentence, and the figures in it."""
    return Rejected(photo.name, Message(key, **figure))


def judge_strip(
    photo: Photo, standout: Standout, reading: Reading, strip: Strip, cable: Cable
) -> RoughCable | Rejected:
    """One strip: is it the cable? One that is a piece of it is followed beyond its ends and judged again.

    So is one that ends before any cover: the cover judges what was followed, so that a short piece is enough.
    """
    outcome = _judge(photo, standout, reading, strip, cable)
    code = outcome.code if isinstance(outcome, Rejected) else "photo/hidden-end" * outcome.goes_on
    if code not in ("photo/hidden-end", "photo/bearing"):
        return outcome
    cut = cut_across(standout, strip.path, reading.width, known=cable.diameter_px is not None)
    least = MIN_PIECE_WIDTHS if code == "photo/hidden-end" else _LEAST_BEFORE_COVER
    path = follow(standout, cut, cut.usual_width, least=least)
    if path is None:
        return outcome
    whole = replace(strip, path=path)
    masks = followed_in(standout, cut, reading, whole)
    followed = _judge(photo, standout, masks, whole, cable)
    return outcome if isinstance(followed, Rejected) else followed


def _judge(photo: Photo, standout: Standout, reading: Reading, strip: Strip, cable: Cable) -> RoughCable | Rejected:
    known = cable.diameter_px is not None
    cut = cut_across(standout, strip.path, reading.width, known=known)
    if not len(cut.seen_widths):
        return refused(photo, "photo/contrast.no-edges")
    crossed = None if cable.path_px else crossed_at(standout, cut)  # a person knows which arm it is
    axes = _axes(photo, standout, reading, strip, cut, cable)
    if isinstance(axes, Rejected):
        if crossed is not None:  # which of its arms leaves the picture nobody can tell
            return refused_at(photo, "photo/crossing", crossed)
        return _unsharp(photo, standout, cut) or axes if axes.code == "photo/bearing" else axes
    passed = _passed(standout.to_pixels(strip.path), axes, reading.width * standout.reduction)
    if passed is not None:
        return refused_at(photo, "photo/bearing.beside-given", passed.center_px)
    path = _up_to_axes(standout, strip.path, axes, reading.width)
    if path is None:
        return refused(photo, "photo/bearing.nothing")
    cut = cut_across(standout, path, reading.width, known=known)
    if not len(cut.seen_widths):
        return refused(photo, "photo/contrast.no-edges")
    refusal = _check_width(photo, cut, standout.reduction, cable)
    if refusal is not None:
        return refusal
    others = [other for other in reading.strips if other is not strip]
    # a screw or a jaw beyond an end is shorter than a piece; where a length is known, that tells of a short rest
    least = _LEAST_REST if cable.any_length else MIN_PIECE_WIDTHS
    more = more_beyond(standout, cut, axes, others, length_px=cable.length_px, least=least)
    if more is not None and not cable.any_length:
        return refused_at(photo, "photo/hidden-end.goes-on", more)
    found = _assemble(photo, standout, cut, axes, cable)
    if isinstance(found, Rejected):
        return found
    told = found.findings
    if more is not None:
        told = (*told, doubtful("photo/hidden-end.partial", u_px=more[0], v_px=more[1]))
    widths = cut.seen_widths * standout.reduction
    share = len(cut.seen_widths) / len(cut.width)
    # a cell's edge is found to a fifth of it
    std, across = 0.3 * standout.reduction, path_normals(found.seen_px)
    evidence = weigh(found.closeup, found.seen_px, across, widths, std=std, share=share, crossed=crossed, known=known)
    return replace(found, goes_on=more is not None, evidence=evidence, findings=told)


def _passed(path: Array, axes: tuple[Bearing, Bearing], width: float) -> Bearing | None:
    """An axis that a person gave and that a path (n, 2) px runs past, more than its width beside: another strip."""
    for axis in axes:
        away = np.hypot(*(path - axis.center_px).T)
        if axis.kind == "given" and width < away.min() < min(away[0], away[-1]) - width:
            return axis
    return None


def _up_to_axes(standout: Standout, path: Array, axes: tuple[Bearing, Bearing], width: float) -> Array | None:
    """The path (cells) led on to the rims of covers and to axes without; None if hardly any of it is between them."""
    width_px = width * standout.reduction
    led, body = led_to_axes(standout.to_pixels(path), axes, width_px, trimmed=TRIMMED_WIDTHS * width_px)
    return None if body is None else standout.to_cells(led[outside_covers(led, axes, width_px)])


def refused_at(photo: Photo, key: str, place: Sequence[float] | Array) -> Rejected:
    """The refusal of a photo for what is seen at a place (u, v) px."""
    return refused(photo, key, u_px=float(place[0]), v_px=float(place[1]))


def _unsharp(photo: Photo, standout: Standout, cut: CrossCut) -> Rejected | None:
    """Say of a photo whose covers were not found that its edges are blurred, where they are."""
    width = cut.usual_width * standout.reduction
    path, across = standout.to_pixels(cut.path), path_normals(cut.path)
    closeup = take_closeup(photo, path, width, cut.weights)
    # a shadow softens one edge, focus and motion both
    softest = float(edge_spreads(closeup.picture[..., 0], closeup.to_cells(path), across, width).min(axis=0).max())
    return refused(photo, "photo/blur", blur_px=softest, width_px=width) if softest > _BLURRED * width else None


def _axes(
    photo: Photo, standout: Standout, reading: Reading, strip: Strip, cut: CrossCut, cable: Cable
) -> tuple[Bearing, Bearing] | Rejected:
    """The bearing axes in the order of the strip's path."""
    width = reading.width * standout.reduction
    if cable.bearings.cover_widths is not None and len(cut.seen_widths):
        width = cut.usual_width * standout.reduction  # the mask is wider by the shadow, covers would be
    cover = cable.bearings.cover_radius(width)
    ends = (find_end(strip.path[::-1], reading, standout), find_end(strip.path, reading, standout))
    leaving = [end.place for end in ends if at_border(end.place, photo, standout.reduction, width)]
    if leaving and cover is None and cable.bearings.given_px is None:
        return refused_at(photo, "photo/leaves-frame", leaving[0])
    # in the colour of the cable a cover of another one may not be seen
    first, second = find_bearings(photo.taken or photo, ends, width, cable.bearings)
    if first is not None and second is not None:
        return first, second
    if leaving:
        return refused_at(photo, "photo/leaves-frame", leaving[0])
    return refused_at(photo, "photo/bearing.no-cover", ends[0 if first is None else 1].place)


def _check_width(photo: Photo, cut: CrossCut, reduction: int, cable: Cable) -> Rejected | None:
    """Refuse a strip whose width is not that of a cable of known diameter, and one too short for a cable."""
    width = cut.usual_width * reduction
    slender = float(step_lengths(cut.path).sum()) / cut.usual_width
    if cable.diameter_px is None and slender < _LEAST_SLENDERNESS:
        return refused(photo, "photo/contrast.short", slenderness=slender)
    low, high = _ACCEPTED_WIDTH_RATIO
    if cable.diameter_px is not None and not low <= width / cable.diameter_px <= high:
        return refused(photo, "photo/width.other", width_px=width, diameter_px=cable.diameter_px)
    return None


def _assemble(
    photo: Photo, standout: Standout, cut: CrossCut, axes: tuple[Bearing, Bearing], cable: Cable
) -> RoughCable | Rejected:
    path = standout.to_pixels(cut.path)
    width = cut.usual_width * standout.reduction
    closeup, axes, path = _settled(photo, path[without_specks(cut.seen)], axes, cut.weights, width)
    path, visible = led_to_axes(path, axes, width)
    if visible is None:
        return refused(photo, "photo/bearing.nothing")
    return RoughCable(
        image=photo.name,
        path_px=path,
        visible=visible,
        left=axes[0],
        right=axes[1],
        half_width_px=0.5 * width,
        grey=closeup.picture[..., 0],
        origin_px=closeup.offset_px,
        dark=cut.dark,
        contrast=cut.contrast,
        weights=tuple(float(weight) for weight in cut.weights),
        findings=tuple(_hidden_end(axis, cable) for axis in axes if axis.kind == "clamp"),
    )


def _settled(
    photo: Photo, path: Array, axes: tuple[Bearing, Bearing], weights: Array, width: float
) -> tuple[Standout, tuple[Bearing, Bearing], Array]:
    """The strip from close by, its axes with the left one first, and its path (n, 2) px between them."""
    if not left_first(np.array(axes[0].center_px), np.array(axes[1].center_px)):
        path, axes = path[::-1], axes[::-1]
    closeup = take_closeup(photo, path, width, weights)
    right, path = settle_end(axes[1], path, closeup, width)
    left, backward = settle_end(axes[0], path[::-1], closeup, width)
    return closeup, (left, right), backward[::-1]


def _hidden_end(axis: Bearing, cable: Cable) -> Finding:
    """Say that the line ends where the light does: what the cable does in front of or behind a thing is not seen.

    A warning where the length is unknown: a known one is held against the line, and tells whether a piece is missing.
    """
    u, v = axis.center_px
    if cable.any_length:
        return doubtful("photo/hidden-end.short", u_px=u, v_px=v)
    return inferred("photo/hidden-end.vanishes", u_px=u, v_px=v)

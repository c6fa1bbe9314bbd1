"""What forbids a measurement once the curve is fitted, and what a person should look at.

One judgement, on what was measured: whether there are two edges along the strip and of one width
(`pipeline.vision.evidence`), whether it is as wide as the cable is said to be, whether it passes its bearing covers,
bends as a cable can, and whether the band of its curvature is of any use. Whatever only makes a photo worse (noise,
blur, an outline that waves, a hidden piece) is in the band and forbids nothing. Each refusal says which figure shows
why.
"""

from __future__ import annotations

import numpy as np

from pipeline.messages import Message
from pipeline.records import Array, Finding, Rejected, doubtful
from pipeline.vision.centerline.curve_fit import CurveFit
from pipeline.vision.centerline.midline import Sections
from pipeline.vision.evidence import unlike_a_cable, weigh
from pipeline.vision.median import median, scatter
from pipeline.vision.rough import WIDTH_OFF, RoughCable
from pipeline.vision.scale.plane import ChordFrame
from pipeline.vision.search.border import soft_beside_sharp

_BESIDE_COVER = 0.5  # radii; flanks, shadows and stripes pass a cover's axis by 0.85 and more, a cable by a tenth
_BESIDE_SHADOW = 3.0  # radii; of the middle of a shadow as wide that begins half a radius beside the cable
_BESIDE_DOUBTED = 1.0  # radii; a cover that is not surely seen may lie elsewhere, but the cable runs over its axis
_LEAST_BETWEEN_RIMS = 0.95  # diameters; a rim's dark line lies at the edge or beyond, nearer ones between highlights
_BEND = 0.5  # curvature times diameter; on a radius of two diameters a cable kinks, a curve led astray bends


def _middle_across(sections: Sections) -> tuple[Array, Array]:
    """Points ``(k, 2)`` px along the midline, and unit vectors across it."""
    across = sections.second - sections.first
    return 0.5 * (sections.first + sections.second), across / (np.hypot(*across.T)[:, None] + 1e-12)


def refusal(
    rough: RoughCable,
    sections: Sections,
    fit: CurveFit,
    chord: ChordFrame,
    width: Array,
    diameter: float | None,
) -> Rejected | None:
    """Why a fitted curve is not the cable's; ``width`` (n,) m of the cable on the sections, ``diameter`` m if known."""
    line, std, share = _middle_across(sections), 2.0 * median(sections.std), sections.share
    evidence = weigh(rough.closeup, *line, sections.width, std=std, share=share, known=diameter is not None)
    middle = middle_width(width)[0]
    scale = middle / median(sections.width)
    whole = scale * sections.caliper
    figure = evidence.figures | ({} if diameter is None else {"width_over_diameter": whole / diameter})
    told = (
        (None if evidence.enough else unlike_a_cable(evidence))
        or _soft(rough, sections)
        or _another_width(whole, diameter, scale * sections.softest, by_rims=rough.by_rims)
        or _beside_cover(rough, fit, chord, middle)
        or _bent(fit, middle)
    )
    return None if told is None else Rejected(rough.image, Message(told.key, **{**figure, **told.values}))


def _soft(rough: RoughCable, sections: Sections) -> Message | None:
    soft = soft_beside_sharp(rough.closeup, *_middle_across(sections), median(sections.width))
    return Message("photo/outline.soft") if soft else None


def _another_width(middle: float, diameter: float | None, blur: float, *, by_rims: bool) -> Message | None:
    if diameter is None:
        return None
    # blur moves edges by a part of itself
    off = abs(middle - diameter) > WIDTH_OFF * diameter + blur or (by_rims and middle < _LEAST_BETWEEN_RIMS * diameter)
    return Message("photo/width.traced") if off else None


def _beside_cover(rough: RoughCable, fit: CurveFit, chord: ChordFrame, middle: float) -> Message | None:
    """A flank or a shadow, which runs beside the cable from end to end; or another thing taken for a cover or an end.

    One cover that is surely seen may be passed beside: not every cable runs through the axis of its bearing.
    """
    axes = rough.axes
    told = [axis.radius_px is not None or axis.kind in ("end", "clamp") for axis in axes]
    radii = feet_of_axes(fit, chord)[1] / (0.5 * middle) * told
    wrong = [radius for radius, axis in zip(radii, axes, strict=True) if radius > _BESIDE_DOUBTED and not axis.sure]
    wrong += [radii.min()] if radii.min() > _BESIDE_COVER else []
    key = "photo/bearing.beside-cover" if chord.marked else "photo/outline.beside-end"
    return Message(key, radii=min(float(max(wrong)), 99.0)) if wrong else None


def _bent(fit: CurveFit, middle: float) -> Message | None:
    """A curve that bends as no cable can over one diameter, where it was seen.

    Over the last pixels before an axis, without data, it may bend as it likes: what ties it to the axis mends that.
    """
    s = np.arange(fit.s.min(), fit.s.max(), 0.1 * middle)  # the feet of a curve that ran wild are in no order
    angle = fit.curve.at(s)[1]
    bend = float(np.abs(angle[10:] - angle[:-10]).max(initial=0.0))
    return None if bend <= _BEND else Message("photo/outline.bend", radius_diameters=1.0 / bend)


def refusal_of_band(image: str, kappa: Array, std: Array, *, length: float, most_percent: float) -> Rejected | None:
    """Refuse a curve whose band is of no use: half of it wider than ``most_percent`` of the range of curvature.

    The range of a nearly straight cable is that of a bend by one radian over its ``length`` (m).
    """
    band, most = 1.96 * median(std) / max(float(np.abs(kappa).max()), 1.0 / length), 0.01 * most_percent
    return None if band <= most else Rejected(image, Message("photo/contrast.band", band=min(band, 9.99), most=most))


def beside_axis(miss: float, width: float) -> tuple[Finding, ...]:
    """Finding about a curve that passes ``miss`` (m) beside an axis, of a cable ``width`` (m) wide."""
    # over 100 rendered rigs right ones missed by a fourth of that at most
    return () if miss <= 0.125 * width else (doubtful("photo/bearing.axis", diameters=miss / width),)


def feet_of_axes(fit: CurveFit, chord: ChordFrame) -> tuple[Array, Array]:
    """Arc lengths of the feet of both bearing axes on the curve, and their distances from it."""
    feet = fit.curve.foot(chord.axes, np.array([0.0, fit.curve.frame.knots[-1]]))
    return feet, np.asarray(np.hypot(*(fit.curve.at(feet)[0] - chord.axes).T))


def aside_of_both(rough: RoughCable, fit: CurveFit, chord: ChordFrame, middle: float) -> Array | None:
    """From the curve to its axes (2, 2) px, where both lie at one side of it, as far as a flank or a shadow runs."""
    if any(axis.kind in ("end", "clamp") for axis in rough.axes):
        return None
    where, angle = fit.curve.at(feet_of_axes(fit, chord)[0])
    x, y = (chord.axes - where).T
    side = (np.cos(angle) * y - np.sin(angle) * x) / (0.5 * middle)
    near, far = np.sort(np.sign(side[0]) * side)
    beside = near > _BESIDE_COVER and far < _BESIDE_SHADOW
    return chord.to_pixels(chord.axes) - chord.to_pixels(where) if beside else None


def middle_width(width: Array) -> tuple[float, float]:
    """Median width, and its robust relative scatter along s."""
    middle = median(width)
    return middle, scatter(width, middle) / middle

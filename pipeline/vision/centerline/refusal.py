"""What forbids a measurement once the curve is fitted, and what a person should look at.

One judgement, on what was measured: whether there are two edges along the strip and of one width
(`pipeline.vision.evidence`), whether it is as wide as the cable is said to be, whether it passes its bearing covers,
bends as a cable can, and whether the band of its curvature is of any use. Whatever only makes a photo worse (noise,
blur, an outline that waves, a hidden piece) is in the band and forbids nothing. Each refusal says which figure shows
why.
"""

from __future__ import annotations

import numpy as np

from pipeline.records import Array, Finding, Rejected
from pipeline.settings.vision.centerline import CurveSettings
from pipeline.vision.centerline.curve_fit import CurveFit
from pipeline.vision.centerline.midline import Sections
from pipeline.vision.evidence import Course, Evidence, unlike_a_cable, weigh
from pipeline.vision.median import median
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.chord import ChordFrame

_WIDTH_OFF = 0.15  # relative; a strip split off along a highlight is 30 % too narrow, scales are known to some percent
_BESIDE_COVER = 0.5  # radii; flanks, shadows and stripes pass a cover's axis by 0.85 and more, a cable by a tenth
_UNEVEN_PX, _UNEVEN = 0.8, 0.025  # px and widths; scatter of middles about a smooth curve: shades on white 0.04 widths
_BEND = 0.5  # curvature times diameter; on a radius of two diameters a cable kinks, a curve led astray bends


def evidence_of(rough: RoughCable, sections: Sections) -> Evidence:
    """How much what was measured looks like a cable."""
    across = sections.second - sections.first
    across = across / (np.hypot(*across.T)[:, None] + 1e-12)
    course = Course(rough.grey, rough.origin_px, rough.dark, 0.5 * (sections.first + sections.second), across)
    return weigh(course, sections.width, std=2.0 * median(sections.std), share=sections.share)


def refusal(
    rough: RoughCable,
    sections: Sections,
    fit: CurveFit,
    chord: ChordFrame,
    width: Array,
    diameter: float | None,
) -> Rejected | None:
    """Why a fitted curve is not the cable's; ``width`` (n,) m of the cable on the sections, ``diameter`` m if known."""
    evidence = evidence_of(rough, sections)
    middle = middle_width(width)[0]
    figure = {"edges_over_noise": evidence.edges, "seen": evidence.seen, "width_unsteady": evidence.unsteady}
    if diameter is not None:
        figure["width_over_diameter"] = middle / diameter
    told = (
        _another_width(middle, diameter)
        or (None if evidence.enough else unlike_a_cable(evidence))
        or _uneven(fit, sections, middle)
        or _beside_cover(rough, fit, chord, middle)
        or _bent(fit, middle)
    )
    return None if told is None else Rejected(rough.image, *told, figure=figure)


Told = tuple[str, str]
"""Code and reason of a refusal."""


def _another_width(middle: float, diameter: float | None) -> Told | None:
    if diameter is None or abs(middle / diameter - 1.0) <= _WIDTH_OFF:
        return None
    return (
        "photo/width",
        f"what was traced is {100.0 * middle / diameter:.0f} % as wide as the cable: the cable is split along a"
        " highlight or shadow, or scale or diameter are wrong",
    )


def _uneven(fit: CurveFit, sections: Sections, middle: float) -> Told | None:
    """Middles that lie about no smooth curve: what was followed are shades, not the edges of a cable."""
    width = median(sections.width)
    scatter = median(fit.point_std[fit.weight > 0.0]) * width / middle
    limit = max(_UNEVEN_PX, _UNEVEN * width)
    if scatter <= limit:
        return None
    return (
        "photo/outline",
        f"the middles of what was traced scatter by {scatter:.1f} px about any smooth curve, those of a cable this wide"
        f" by {limit:.1f} px at most",
    )


def _beside_cover(rough: RoughCable, fit: CurveFit, chord: ChordFrame, middle: float) -> Told | None:
    covers = np.array([bearing.radius_px is not None for bearing in (rough.left, rough.right)])
    share = float((feet_of_axes(fit, chord)[1] / (0.5 * middle) * covers).max())
    if share <= _BESIDE_COVER:
        return None
    return (
        "photo/bearing",
        f"what was traced passes {min(share, 99.0):.1f} cable radii beside the axis of a bearing cover: it is a flank,"
        " a shadow or a stripe of the cable, or the cover is not the bearing's",
    )


def _bent(fit: CurveFit, middle: float) -> Told | None:
    """A curve that bends as no cable can over one diameter, where it was seen.

    Over the last pixels before an axis, without data, it may bend as it likes: what ties it to the axis mends that.
    """
    s = np.arange(fit.s.min(), fit.s.max(), 0.1 * middle)  # the feet of a curve that ran wild are in no order
    angle = fit.curve.at(s)[1]
    bend = float(np.abs(angle[10:] - angle[:-10]).max(initial=0.0))
    if bend <= _BEND:
        return None
    return (
        "photo/outline",
        f"what was traced bends to a radius of {1.0 / bend:.1f} cable diameters, no cable does: near there another edge"
        " was taken for the cable's",
    )


def refusal_of_band(image: str, kappa: Array, std: Array, length: float, options: CurveSettings) -> Rejected | None:
    """Refuse a curve whose band is of no use: half of it wider than a share of the range of curvature.

    The range of a nearly straight cable is that of a bend by one radian over its ``length`` (m).
    """
    usual = 100.0 * 1.96 * median(std) / max(float(np.abs(kappa).max()), 1.0 / length)
    if usual <= options.max_band_percent:
        return None
    text = (
        f"the curvature is known to {min(usual, 999.0):.0f} % of its range only, {options.max_band_percent:.0f} % are"
        " of use; more px/mm, sharper focus and a plainer ground help"
    )
    return Rejected(image, "photo/contrast", text, figure={"band_percent": usual})


def beside_axis(miss: float, width: float, options: CurveSettings) -> tuple[Finding, ...]:
    """Finding about a curve that passes ``miss`` (m) beside an axis, of a cable ``width`` (m) wide."""
    if miss <= 0.5 * options.axis_distance_radii * width:
        return ()
    message = f"the centerline passes {miss / width:.1f} cable diameters beside a bearing axis: is the axis right?"
    return (Finding("photo/bearing", "warning", message),)


def feet_of_axes(fit: CurveFit, chord: ChordFrame) -> tuple[Array, Array]:
    """Arc lengths of the feet of both bearing axes on the curve, and their distances from it."""
    feet = fit.curve.foot(chord.axes, np.array([0.0, fit.curve.frame.knots[-1]]))
    return feet, np.asarray(np.hypot(*(fit.curve.at(feet)[0] - chord.axes).T))


def middle_width(width: Array) -> tuple[float, float]:
    """Median width, and its robust relative scatter along s."""
    middle = median(width)
    return middle, 1.4826 * median(np.abs(width - middle)) / middle

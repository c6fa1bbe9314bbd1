"""What forbids a measurement once the edges of the cable are found, and what a person should look at.

Contrast, blur, width and its constancy, the share of the cable that was seen; and a curve that passes beside the axes
of its bearings. Each refusal says which figure shows why.
"""

from __future__ import annotations

import numpy as np

from pipeline.records import Array, Finding, Rejected
from pipeline.settings.vision.centerline import CurveSettings
from pipeline.vision.centerline.curve_fit import CurveFit
from pipeline.vision.centerline.midline import Sections
from pipeline.vision.median import median
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.chord import ChordFrame


def refusal(
    rough: RoughCable, sections: Sections, width: Array, diameter: float | None, options: CurveSettings
) -> Rejected | None:
    """What the figures of the sections forbid; ``width`` (n,) m of the cable on them, ``diameter`` m if it is known."""
    middle, scatter = middle_width(width)
    figure = {
        "contrast_to_noise": sections.contrast / max(sections.noise, 1e-9),
        "blur_px": sections.blur,
        "width_scatter": scatter,
        "measured_share": sections.share,
    }
    if diameter is not None:
        figure["width_over_diameter"] = middle / diameter

    told = _unclear(rough, sections, scatter, options) or _unlike_a_cable(sections, middle, scatter, diameter, options)
    return None if told is None else Rejected(rough.image, *told, figure=figure)


Told = tuple[str, str]
"""Code and reason of a refusal."""


def _unclear(rough: RoughCable, sections: Sections, scatter: float, options: CurveSettings) -> Told | None:
    """Edges that noise, a pattern or blur leave without a place; ``scatter`` is that of the width, relative."""
    radius = 0.5 * median(sections.width)
    ratio = sections.contrast / max(sections.noise, 1e-9)
    # chance gives no constant width: what then counts as noise is a pattern of the sheath or the ground
    quiet = rough.contrast >= options.min_contrast_to_noise * rough.noise
    constant = scatter < (options.quiet_width_scatter if quiet else options.sure_width_scatter)
    needed = options.patterned_contrast_to_noise if constant else options.min_contrast_to_noise
    if ratio < needed and quiet and scatter >= options.sure_width_scatter:
        # the pixels are quiet enough: what is between them and a clean pair of edges is no noise
        return (
            "photo/outline",
            f"the cable's outline is no pair of smooth edges: the picture beside them is off by"
            f" {100.0 * sections.noise / sections.contrast:.0f} % of their contrast, though its pixels are quiet, and"
            f" the width varies by {100.0 * scatter:.0f} %; twisted pairs, bare strands and a sheath or ground of"
            " strong pattern do that",
        )
    if ratio < needed and quiet and sections.share < options.min_measured_share:
        # the few edges that are left agree in width by chance, or because they were left for that
        return (
            "photo/outline",
            f"the cable's outline is no pair of smooth edges: they were found on {100.0 * sections.share:.0f} % of its"
            " length only, though its pixels are quiet; twisted pairs, bare strands and a sheath or ground of strong"
            " pattern do that",
        )
    if ratio < needed:
        return (
            "photo/contrast",
            f"contrast of the cable's edges is {ratio:.1f} times the noise, too little to place"
            f" an edge (at least {needed:g})",
        )
    if sections.blur > options.max_blur_radii * radius:
        return (
            "photo/blur",
            f"the edges are blurred over {sections.blur:.1f} px (standard deviation) on a cable"
            f" {2 * radius:.0f} px wide",
        )
    return None


def _unlike_a_cable(
    sections: Sections, middle: float, scatter: float, diameter: float | None, options: CurveSettings
) -> Told | None:
    """A width (m) that is not the cable's or not constant, or edges on too little of it."""
    if diameter is not None and abs(middle / diameter - 1.0) > options.max_width_error:
        return (
            "photo/width",
            f"what was traced is {100.0 * middle / diameter:.0f} % as wide as the cable: the cable is split"
            " along a highlight or shadow, or scale or diameter are wrong",
        )
    if scatter > options.max_width_scatter:
        return (
            "photo/width",
            f"the width of what was traced varies by {100.0 * scatter:.0f} % along it; a cable's does not",
        )
    if sections.share < options.min_measured_share:
        return (
            "photo/contrast",
            f"both edges of the cable were found on {100.0 * sections.share:.0f} % of its length only",
        )
    return None


def refusal_beside_axis(
    rough: RoughCable, fit: CurveFit, chord: ChordFrame, width: Array, options: CurveSettings
) -> Rejected | None:
    """Refuse a curve that passes beside the axis of a cover that was found, or far beside the end that was seen."""
    axes = (rough.left, rough.right)
    covers = np.array([bearing.radius_px is not None for bearing in axes])
    ends = np.array([bearing.kind in ("end", "clamp") for bearing in axes])
    shares = feet_of_axes(fit, chord)[1] / (0.5 * middle_width(width)[0])
    if (shares[ends] > options.max_end_distance_radii).any():
        worst = float(shares[ends].max())
        return Rejected(
            rough.image,
            "photo/bearing",
            f"what was traced passes {worst:.2f} cable radii beside the cable's visible end: too little of the cable"
            " between its ends was seen to follow it",
            figure={"axis_distance_radii": worst},
        )
    share = float((shares * covers).max())
    if share <= options.max_axis_distance_radii:
        return None
    return Rejected(
        rough.image,
        "photo/bearing",
        f"what was traced passes {share:.2f} cable radii beside the axis of a bearing cover: it is a flank, a shadow or"
        " a stripe of the cable, or the cover is not the bearing's",
        figure={"axis_distance_radii": share},
    )


def refusal_of_bend(rough: RoughCable, fit: CurveFit, width: Array, options: CurveSettings) -> Rejected | None:
    """Refuse a curve that bends as no cable can over one diameter, where it was seen.

    Over the last pixels before an axis, without data, it may bend as it likes: what ties it to the axis mends that.
    """
    middle = middle_width(width)[0]
    s = np.arange(fit.s.min(), fit.s.max(), 0.1 * middle)  # the feet of a curve that ran wild are in no order
    angle = fit.curve.at(s)[1]
    bend = float(np.abs(angle[10:] - angle[:-10]).max(initial=0.0))
    if bend <= options.max_bend_diameters:
        return None
    return Rejected(
        rough.image,
        "photo/outline",
        f"what was traced bends to a radius of {1.0 / bend:.1f} cable diameters, no cable does: near there another edge"
        " was taken for the cable's",
        figure={"bend_radius_diameters": 1.0 / bend},
    )


def refusal_of_scatter(rough: RoughCable, fit: CurveFit, width: Array, options: CurveSettings) -> Rejected | None:
    """Refuse sections that lie about no smooth curve: what was followed are shades, not the edges of a cable."""
    share = median(fit.point_std[fit.weight > 0.0]) / middle_width(width)[0]
    if share <= options.max_section_scatter:
        return None
    return Rejected(
        rough.image,
        "photo/contrast",
        f"the middles of what was traced scatter by {100.0 * share:.1f} % of its width about any smooth curve: shades"
        " were taken for the edges of the cable",
        figure={"section_scatter": share},
    )


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

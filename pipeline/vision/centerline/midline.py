"""Midline of the cable from its two edges: sections with their errors, the width, and how far the light misleads them.

A section's midpoint is the mean of its edges. An edge that contradicts its neighbours (text, dirt, an object beside the
cable) is replaced by the other one and the local width; a section without any edge is left out, and a stretch of
another width.

Where a narrow shadow lies along one edge, or a flank is as dark as the ground, the place of that edge is open by pixels
and that of the other is not. The width ``W`` of a cable is constant, so each edge tells the midpoint, ``e1 + W/2`` and
``e2 - W/2``: they are weighted by the inverse variances ``v`` of their places, of which half the move between two edge
models and half of what an edge is broader than the other are the measure. ``W`` is measured where both are sure, and
held to the stated diameter as far as that is known. Edges as sure as a cable is round are averaged, whatever ``W``.

What the light does to both edges of a section alike (same direction on the photo) moves the midline slowly along s,
and no averaging removes it. Its size is judged by what is seen on the photo itself:

- how far the midline moves when ramps of shading and shadow are left out of the edge model: by all of that as far as
  they are held, by a fifth as far as they are fitted, for a model that has them is off by what they lack;
- the difference of the two edges' blur: an edge that is broader than the other by more than the lens explains is
  shading or penumbra, and its place is open by half of that;
- measured width against diameter: what is missing is missing at one edge if the two have different contrast, at both
  alike (and harmless) if they have the same. Tone curve, sharpening and shade move an edge by a part of its blur; what
  is off by more is the scale's or the diameter's, which are known to some percent (`_WIDTH_PLAY`). What is missing
  beyond those lies beside the weaker edge, and half of it is the midline's: on a cable of 66 px under a lamp from one
  side, where the border of light and shade was taken for the edge, 2.7 px.

That the measured width changes slowly along s tells nothing of it: a sheath grows thicker and a camera comes nearer,
and the edges of real ones move by a fiftieth of the width, both alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_opening, maximum_filter1d, median_filter

from pipeline.records import Array
from pipeline.vision.centerline.curvature import PlaneCurve, normals
from pipeline.vision.centerline.edge_profile import Profiles, fit_edges, fit_profiles, in_one_light
from pipeline.vision.centerline.edges import Found, edge_pixels
from pipeline.vision.median import MAD_TO_STD, median, medians, quantile, scatter
from pipeline.vision.photo import Closeup

LEAST_SECTIONS = 12  # measured, or found in the search, at all; fewer do not fix a curve that bends both ways
WIDTH_FLOOR = 1.2  # px; widths of a cable of 6 px on webcam photos scatter by 0.3, its halo and shadow add as much
_FITTED = 0.2  # of the way that fitted ramps move an edge; with 0.5 bright cables were stated off by thrice their error
_TOGETHER = 4  # sections; fewer make no stretch of cable
_MEDIAN = 15  # sections of a running median: two to three diameters
_INSIDE_RADII = 0.25
"""Of the radius; part of the sheath used for an edge: leaves out highlight and text, and the farther from the edge, the
more shading bends away from the ramp (0.35 moved the midline by a third more).
"""
_OUTSIDE_RADII = 0.18
"""Of the radius; part of the ground used for an edge: more brings more of the ground's texture (0.45 raised the error
of kappa on brushed metal by half), less only more pixel noise.
"""
EDGE_WINDOW_BLURS = 2.5  # blurs; least part of sheath and ground on each side: beyond it the edge's tail is over
_WIDTH_DEPARTURE = 0.08
"""Relative; a stretch whose width is farther from the usual one is left out: a cable's is constant within 5 %."""
_EDGE_OUTLIER = 6.0  # robust standard deviations from the neighbouring edges; the other edge takes over
_LONGEST_SIDE_PX = 12.0  # px; more sheath or ground than this adds texture, not knowledge of the edge
_WIDTH_PLAY = 0.04
"""Of the width; so much it may be off the expected one throughout: scales and diameters are known to some percent, and
what both edges are off alike leaves the midline in place.
"""
_ROUNDNESS = 0.005
"""Of the width; a sheath is round and even so far: edges whose places are surer than that are averaged, the width of
the cable tells nothing of them.
"""


@dataclass(frozen=True)
class Sections:
    """Measured sections across the cable, in px of the photo.

    Attributes
    ----------
    s : (k,)
        Along the path the sections were laid on.
    first, second : (k, 2)
        Edge points at negative and positive t.
    std : (k,)
        Of the midpoint along the normal, from the scatter of the pixels.
    width : (k,)
        As measured, without smoothing.
    balance : (k,)
        ``2 sqrt(v1 v2) / (v1 + v2)``: 1 where both edges count alike, 0 where only one counts. So much of half the
        width's error is the midpoint's.
    waves : bool
        Both edges go out and in together, as those of twisted wires: the width's waves are not the midline's.
    caliper : px
        Width that a caliper would tell: the median, of wires that wind about each other that of their widest places.
    systematic_std : px
    share : float
        Of the sections asked for, those that were measured.
    contrast, noise, blur : float
        Median step and scatter of pixels, grey; median edge blur, px.
    softest : px
        Blur where it is most, of the sharper edge there: a shadow softens one edge, focus and motion both.
    """

    s: Array
    first: Array
    second: Array
    std: Array
    width: Array
    balance: Array
    waves: bool
    caliper: float
    systematic_std: float
    share: float
    contrast: float
    noise: float
    blur: float
    softest: float


def free_of_covers(curve: PlaneCurve, s: Array, offset: float, covers: Array) -> NDArray[np.bool_]:
    """Mask (n,) of the sections whose points at ``offset`` px from the path on both sides lie outside every cover.

    ``covers`` (k, 3) are discs that hide the cable: centre (u, v) and radius with its margin, px.
    """
    where, angle = curve.at(s)
    aside = offset * normals(angle)
    away = np.linalg.norm(np.stack([where - aside, where + aside])[:, :, None] - covers[:, :2], axis=-1)
    return np.asarray((away > covers[:, 2]).all(axis=(0, 2)))


def measure_sections(
    closeup: Closeup,
    curve: PlaneCurve,
    s: Array,
    *,
    half_width: float,
    diameter: float | None,
    blur: float,
    found: Found | None = None,
) -> Sections | None:
    """Sections at ``s`` of a path that follows the cable within a fraction of a pixel; None if hardly any is left.

    Edges that were ``found`` along the path lead where they wave farther than the windows of the profiles reach.
    """
    inside = min(_INSIDE_RADII * half_width, _LONGEST_SIDE_PX)
    outside = min(_OUTSIDE_RADII * half_width, _LONGEST_SIDE_PX)
    least = EDGE_WINDOW_BLURS * blur + 0.5  # half a pixel for what the path may be off
    window = (max(inside, least), max(outside, least))
    rows = max(1, int(median(np.diff(s))))
    waves = found is not None and found.swing > window[1] - EDGE_WINDOW_BLURS * blur
    outline = found.outline if found is not None and waves else lambda s: np.full((2, len(s)), half_width)
    pixels = edge_pixels(closeup, curve, s, rows=rows, outline=outline, window=window)
    alike, zero, gain = in_one_light(pixels) if waves else (pixels, 0.0, 1.0)
    profiles = fit_profiles(alike, s, blur=max(blur, 0.5))
    edges = fit_edges(pixels, s, profiles, zero=zero, gain=gain)
    place, std = edges.place.T, edges.std.T
    good = np.isfinite(place)
    if good.sum(axis=0).min() < LEAST_SECTIONS:
        return None
    place, std, good = _consistent(place, std, good, together=1.0 if waves else -1.0)
    keep = np.asarray(good.any(axis=1))
    keep[keep] = _of_usual_width(place[keep].sum(axis=1) + 2.0 * half_width)
    keep = _between_pairs(keep, keep & good.all(axis=1))
    if np.count_nonzero(keep) < LEAST_SECTIONS:
        return None
    s, place, std = s[keep], place[keep], std[keep]
    where, angle = curve.at(s)
    across = normals(angle)
    width = place.sum(axis=1) + 2.0 * half_width
    step = edges.step[:, keep]
    # half of what changes between two models that both have some right is the standard deviation of an edge by light,
    # and half of what it is broader than the other one
    broader = profiles.at(s, "blur")
    broader -= broader.min(axis=0)
    doubt = 0.25 * (profiles.at(s, "shift") ** 2 + broader**2) + (_ROUNDNESS * 2.0 * half_width) ** 2
    trust = doubt[::-1] / doubt.sum(axis=0)
    likely, open_by = _cable_width(width, doubt, None if waves else diameter)
    inward = 0.5 * likely - half_width - place.T
    off = trust[0] * inward[0] - trust[1] * inward[1]
    # Both edges are moved alike: their distance stays what was measured.
    aside = off - 0.5 * (place[:, 1] - place[:, 0])
    expected = outline(s)
    first, second = (expected + place.T + [-aside, aside])[..., None]
    width += expected.sum(axis=0) - 2.0 * half_width
    caliper = quantile(width, 0.9) if waves else median(width)
    return Sections(
        s=s,
        first=where - first * across,
        second=where + second * across,
        std=np.hypot(*(trust * std.T)),
        width=width,
        balance=2.0 * np.sqrt(trust[0] * trust[1]),
        waves=waves,
        caliper=caliper,
        systematic_std=_systematic(profiles, s, caliper, doubt, diameter, open_by),
        share=float(np.mean(keep)),
        contrast=median(step),
        noise=median(profiles.noise),
        blur=median(profiles.blur),
        softest=float(profiles.blur.min(axis=0).max()),
    )


def _cable_width(width: Array, doubt: Array, diameter: float | None) -> tuple[float, float]:
    """The cable's width by sections (n,) and by its stated diameter, and the standard deviation of that, px.

    One light falls on all sections, so that their errors ``doubt`` (2, n) do not average out. Where they differ by
    more, some have other edges, as sure as these may seem, and none counts for more than that.
    """
    smooth = _running_median(width)
    variance = doubt.sum(axis=0) + np.mean((smooth - median(smooth)) ** 2)
    stated = 0.0 if diameter is None else (_WIDTH_PLAY * diameter) ** -2.0
    likely = np.average(smooth, weights=1.0 / variance)
    seen = np.mean(1.0 / variance)
    return float((seen * likely + stated * (diameter or 0.0)) / (seen + stated)), float((seen + stated) ** -0.5)


def _of_usual_width(width: Array) -> NDArray[np.bool_]:
    """Sections ``(k,)`` but those of a stretch as wide as the cable is not: its edges there are those of other things.

    A pale sleeve before a pale ground leaves the edges of shadows and shades, 0.3 diameters off.
    """
    middle = median(width)
    off = np.abs(width - middle)
    # An outline may wave; and edges of webcams and JPEG are found to a third of a pixel, whatever the width.
    limit = max(_WIDTH_DEPARTURE * middle, 4.0 * scatter(off, 0.0), WIDTH_FLOOR)
    smooth, own = (np.abs(w - middle) > limit for w in (_running_median(width), width))
    # the running median sees the first and last sections of a stretch as their neighbours outside it
    return np.asarray(~(smooth | (own & maximum_filter1d(smooth, _MEDIAN))))


def _between_pairs(keep: NDArray[np.bool_], both: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The mask ``(k,)`` from the first to the last stretch of sections with both edges.

    Farther in, one edge and the width tell the cable. Beyond, a pin on a block may be as wide as it, and one edge of a
    jaw that hides it may go on where the cable's did.
    """
    shown = np.flatnonzero(binary_opening(both, np.ones(_TOGETHER, dtype=bool)))
    index = np.arange(len(keep))
    return np.asarray(keep & (index >= shown[0]) & (index <= shown[-1])) if len(shown) else keep


def _running_median(values: Array) -> Array:
    return np.asarray(median_filter(values, size=min(_MEDIAN, len(values)), mode="mirror"))


def _consistent(
    place: Array, std: Array, good: NDArray[np.bool_], *, together: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Edges that contradict their neighbours replaced by the other edge and the local width.

    ``together`` is -1 where the width lasts while both edges go to one side, 1 where they go out and in together.
    """
    index = np.arange(len(place))
    filled = np.column_stack([np.interp(index, index[g], p[g]) for p, g in zip(place.T, good.T, strict=True)])
    local = np.column_stack([_running_median(p) for p in filled.T])
    off = np.abs(filled - local)
    limit = _EDGE_OUTLIER * MAD_TO_STD * medians(off, axis=0) + 0.02  # px; a floor for pictures without noise
    good = good & (off < limit)
    out, spread = filled.copy(), std.copy()
    for side, other in ((0, 1), (1, 0)):
        lost = ~good[:, side] & good[:, other]
        out[lost, side] = local[lost, side] + together * (filled - local)[lost, other]
        # the same error again, with the other sign: midpoint moves by all of it
        spread[lost, side] = 2.0 * std[lost, other]
    if together > 0.0:  # where wires cross, the one in front may stand out more, but the outline has a corner
        spread = np.maximum(spread, medians(spread, axis=0))
    return out, spread, good


def _systematic(
    profiles: Profiles, s: Array, width: float, doubt: Array, diameter: float | None, open_by: float
) -> float:
    """Standard deviation, px, of the slow sideways error of the midline; see the module's text.

    Edges count by the shares with which they make the midpoint; ``doubt`` (2, n) are their variances by the light,
    ``open_by`` (px) is the standard deviation of the width.
    """
    trust = doubt[::-1] / doubt.sum(axis=0)
    balance, lead = 2.0 * np.sqrt(trust[0] * trust[1]), trust[1] - trust[0]
    shift, blur = profiles.at(s, "shift"), profiles.at(s, "blur")
    # Both edges count by the width, in which their errors are too: what is constant along s moves the midpoint by
    # half the difference, however they are weighted.
    share = float(np.hypot(profiles.held, _FITTED * (1.0 - profiles.held)))
    common = float(np.average(shift.sum(axis=0), weights=1.0 / doubt.sum(axis=0)))
    by_model = share * np.sqrt(np.mean((trust[1] * shift[1] - trust[0] * shift[0] - 0.5 * common * lead) ** 2))
    by_blur = 0.5 * np.sqrt(np.mean((balance * np.diff(blur, axis=0)[0]) ** 2))
    # Where one edge counts alone, half the error of the cable's width is the midpoint's; ``doubt`` is half the change.
    by_likely = 0.5 * min(2.0 * share, 1.0) * open_by * np.sqrt(np.mean(lead**2))
    one, two = medians(profiles.step, axis=1)
    unequal = float(abs(two - one) / (0.5 * (two + one)))
    missing = 0.0 if diameter is None else abs(width - diameter)
    # What a caliper cannot have been off by is beside the weaker edge: a dark flank that is as dark as the ground.
    lost = max(missing - _WIDTH_PLAY * width, 0.0)
    by_diameter = (0.25 * min(missing, median(profiles.blur)) + 0.5 * lost) * min(unequal, 1.0)
    return float(np.sqrt(by_model**2 + by_blur**2 + by_likely**2 + by_diameter**2))

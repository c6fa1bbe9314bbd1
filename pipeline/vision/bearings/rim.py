"""The rim of a round cover: a circle fitted to the edges on rays from a first guess of its centre.

``rays -> slope of the grey value -> the shift that lays most of one circle on edges -> edges -> robust circle``

A bevel, a groove, a shadow and a printed ring make edges of their own; with all directions together only one circle of
the expected radius has an edge all round. A soft shadow beside the rim pulls the steepest place toward itself by
(slope outside - slope inside) sigma^2 / step, so the slopes on both sides are fitted with the edge.
Units: px of the photo as displayed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, gaussian_filter1d, map_coordinates
from scipy.special import ndtr

from pipeline.records import Array
from pipeline.vision.median import median, medians, quantile, scatter
from pipeline.vision.photo import Photo, values_at
from pipeline.vision.rough import Bearing

RADIUS_STD = 0.01  # relative; of a cover's radius in px where the scale is known: 0.1 mm on 12 mm, and light
SEARCH_RADII = 0.12  # radii; half range along a ray in which the rim is searched around the first guess
NEAR_RADII = 0.045  # radii; half range in which edges are sought at last: a bevel is twice as far away
MIN_RIM = 0.35  # share of the rim with an edge on the circle; chance alone gives a tenth
SURE_RIM = 0.7  # share of the rim; with so much seen no other centre is tried
SAME_RADIUS = 0.04  # relative; covers of one rig are turned alike, light and blur move a rim less
RIM_OVER_TEXTURE = 2.5  # ratio to the median slope of the rays; weaker edges are noise and texture
CENTER_STD_FLOOR_PX = 0.02  # px; light and rounding of the cover move the centre by so much whatever the noise
_LIGHT_REACH_PX = 4.0  # px; half range about an edge in which the light's slopes are fitted with it
_RIM_TOLERANCE = 0.015  # radii; an edge so near to the circle belongs to the rim, chance edges spread ten times wider
_LEAST_TOLERANCE_PX, _MOST_TOLERANCE = 0.75, 0.1  # px, as pixels allow; radii of a small cover, near which chance lies


@dataclass(frozen=True)
class Circle:
    """A fitted circle and how much of its rim was seen.

    ``center`` (u, v), ``radius`` and their standard deviations in px; ``rim`` is the share of directions with an edge
    on the circle; ``marked`` says that rings turned about the same centre are seen.
    """

    center: tuple[float, float]
    radius: float
    std: float
    radius_std: float
    rim: float
    marked: bool = False

    @property
    def sure(self) -> bool:
        """True if nearly all of it or a mark is seen."""
        return self.marked or self.rim >= SURE_RIM

    def as_bearing(self) -> Bearing:
        """The bearing axis under this cover."""
        return Bearing(self.center, self.std, self.radius, self.radius_std, "cover", self.sure)


@dataclass(frozen=True)
class Radius:
    """Expected radius of a cover in px and its relative standard deviation."""

    px: float
    std: float


def fit_circle(
    photo: Photo, center: Array, expected: Radius, *, softness: float = 1.0, on_cover: bool = False
) -> Circle | None:
    """Fit a circle to the edges around a first guess; None if there are too few.

    Strategy: the shift with most of one circle on edges; then radial profiles from there, twice; the edge is the
    centroid of the slope about its steepest place, at last with the slopes of light beside it; Gauss-Newton on the
    radial residuals with Tukey's biweight. The slope is taken over ``softness`` px: sought over its own blur, an edge
    stands out of noise the most. A ring ``on_cover`` is not sought, for its place is known to a pixel; no shadow lies
    beside it, the next ring would pass for one; and nobody knows its radius, so that proves nothing.
    """
    radius = expected.px
    count = int(np.clip(2.0 * np.pi * radius, 90, 160))  # more rays share their pixels and tell little new
    angle = np.arange(count) * (2.0 * np.pi / count)
    ray = np.column_stack([np.cos(angle), np.sin(angle)])
    span = max(4.0, SEARCH_RADII * radius)
    parameters = np.array([*center, radius])
    if not on_cover:
        parameters = _best_shift(photo, parameters, ray, span, softness, expected)
    reach = max(3.0, NEAR_RADII * radius)
    for beside in (False, True):
        slopes = _radial_slopes(photo, parameters, ray, reach, softness, one_sign=on_cover)
        edge, trust, foremost = _radial_edges(slopes, reach, softness)
        if beside and not on_cover:
            edge = _without_light(slopes, edge)
        fitted = _robust_circle(parameters, ray, edge, trust, reach, expected)
        if fitted is None:
            return None
        before, (parameters, covariance) = parameters, fitted
    miss = np.hypot(*(before[:2] + (before[2] + edge)[:, None] * ray - parameters[:2]).T) - parameters[2]
    tolerance = max(min(_LEAST_TOLERANCE_PX, _MOST_TOLERANCE * radius), _RIM_TOLERANCE * radius)
    rim = float(np.mean((np.abs(miss) < tolerance) & foremost))
    off, other = np.hypot(*(parameters[:2] - center)), abs(parameters[2] - radius)
    concentric = other > max(4.0 * expected.std * radius, 1.0)
    if off > 0.5 * radius or (concentric and (rim < SURE_RIM or other > 1.2 * span)):
        return None
    if concentric:
        # A bevel or groove turned on the same axis, seen all round: it tells the centre, the radius it does not.
        std = float(np.hypot(np.sqrt(0.5 * np.trace(covariance[:2, :2])), CENTER_STD_FLOOR_PX))
        return Circle((float(parameters[0]), float(parameters[1])), radius, std, 0.1 * radius, rim)
    # A rim wrongly placed on one side moves the centre by half of what it adds to the radius.
    excess = 0.0 if on_cover else max(abs(parameters[2] - radius) - expected.std * radius, 0.0)
    std = float(np.linalg.norm([np.sqrt(0.5 * np.trace(covariance[:2, :2])), CENTER_STD_FLOOR_PX, 0.5 * excess]))
    # Seen all round, the radius is what it is: that it is not the expected one tells of the scale, not of the rim.
    doubt = 0.0 if rim >= SURE_RIM else excess
    # A bevel as narrow as the blur moves the steepest place all round, by half of it at most on 18 rendered covers, and
    # no scatter tells of it.
    bevel = 0.22 * float(np.sqrt(max(_spread(slopes, edge)[2] ** 2 - softness**2, 0.0)))
    parts = [np.sqrt(covariance[2, 2]), CENTER_STD_FLOOR_PX, doubt, bevel]
    radius_std = float(np.linalg.norm(parts))
    return Circle((float(parameters[0]), float(parameters[1])), float(parameters[2]), std, radius_std, rim)


@dataclass(frozen=True)
class _Slopes:
    """Slope along rays: ``along`` (rays, places) with the sign of the edge positive, ``strength`` of what is sought.

    ``offsets`` (places,) px from the circle the rays started at; ``texture`` is the usual slope where no edge is
    sought; ``seen`` False where a ray leaves the picture.
    """

    offsets: Array
    along: NDArray[np.float32]
    strength: NDArray[np.float32]
    texture: float
    seen: NDArray[np.bool_]


def _radial_slopes(
    photo: Photo, parameters: Array, ray: Array, span: float, softness: float, *, one_sign: bool = False
) -> _Slopes:
    """Slopes about a circle; with ``one_sign`` only edges of the sign that prevails on the circle are sought.

    A thin line turned on a cover has two edges, of opposite signs: without the sign each ray would take either.
    """
    # The outer halves of the rays tell what is no edge: sheen, texture and noise.
    calm = span + 4.0 * (softness - 1.0)  # a soft edge reaches beyond the range in which it is sought
    offsets = np.arange(-calm - span, calm + span + 0.25, 0.5)
    distance = parameters[2] + offsets
    places = distance[:, None] * ray[:, None] + parameters[:2]
    profile = values_at(photo, places)
    # Rays are pooled with their neighbours along the rim: noise falls, and the rim stays where it is.
    pooled = gaussian_filter(
        np.gradient(profile, 0.5, axis=1),
        (1.5 * softness, 2.0 * softness, 0.0),
        mode=("wrap", "reflect", "wrap"),
    )
    slope: NDArray[np.float32] = np.asarray(pooled)
    norm = np.abs(slope[..., 0]) if slope.shape[2] == 1 else np.sqrt(np.einsum("ijc,ijc->ij", slope, slope))
    inner = np.abs(offsets) <= span
    outside = ((places < 1) | (places > np.subtract(photo.size, 2))).any(axis=2)
    if one_sign:
        colour = np.broadcast_to(slope[:, np.abs(offsets) < 0.75].mean(axis=(0, 1)), (len(ray), slope.shape[2]))
    else:
        colour = slope[np.arange(len(ray)), np.argmax(np.where(inner, norm, np.float32(0.0)), axis=1)]
    colour = colour / (np.sqrt((colour**2).sum(axis=1, keepdims=True)) + np.float32(1e-12))
    along = (slope * colour[:, None, :]).sum(axis=2)
    return _Slopes(
        offsets=offsets,
        along=along,
        strength=np.maximum(along, 0.0) if one_sign else norm,
        texture=median(norm[:, np.abs(offsets) > 0.5 * float(offsets[-1] - offsets[0]) - span]),
        seen=~(outside & inner).any(axis=1),
    )


def _best_shift(photo: Photo, parameters: Array, ray: Array, span: float, softness: float, expected: Radius) -> Array:
    """Centre and radius near the first guess for which most of the circle lies on edges, to a twelfth of ``span``."""
    slopes = _radial_slopes(photo, parameters, ray, 1.5 * span, softness)
    step = span / 12.0
    strength = slopes.strength
    peak = np.sort(np.where(slopes.seen[:, None], strength, 0.0).max(axis=1))
    usual = float(peak[len(peak) // 4]) + 1e-12
    # An edge is a place, however steep: beside a rim of little contrast a steeper one on the cover counts no more.
    edges = np.where(_steepest(strength), np.minimum(strength / usual, 1.0), 0.0) * slopes.seen[:, None]
    level = gaussian_filter1d(edges, 2.0 * step, axis=1)
    level, ray = level[::2], ray[::2]  # pooled with its neighbours, every second ray tells what all do
    shifts = np.arange(-12, 13) * step
    wider = np.clip(np.arange(-2, 3) * expected.std * expected.px, -0.5 * span, 0.5 * span)
    # The outer halves of the rays hold every shift.
    aside = (shifts[:, None, None] * ray[:, 0] + shifts[None, :, None] * ray[:, 1]).reshape(-1, len(ray))
    places = np.rint(2.0 * (aside - slopes.offsets[0])).astype(np.intp) + level.shape[1] * np.arange(len(ray))
    even = np.full(len(ray), 1.0 / len(ray), level.dtype)  # a product takes an eighth of the time of a mean
    best, found = -1.0, parameters
    for k, more in enumerate(wider):
        score = (level.take(places + round(2.0 * float(more)), mode="clip") @ even) * (1.0 - 0.03 * abs(k - 2))
        place = int(np.argmax(score))
        if score[place] > best:
            i, j = divmod(place, len(shifts))
            best, found = float(score[place]), parameters + np.array([shifts[i], shifts[j], more])
    return found


def _radial_edges(slopes: _Slopes, span: float, softness: float) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Radius of the edge in each direction relative to the circle, NaN where none stands out, and its weight.

    Of several edges on a ray the one near the circle is taken, since what lies on a cover may be steeper than its rim.
    Third: whether it is the steepest on its ray; only then it proves a rim, for some chance edge is near any circle.

    The variance of an edge falls with the square of its slope; a soft shadow beside a rim of little contrast would
    else pass for the rim.
    """
    offsets, strength = slopes.offsets, slopes.strength
    inner = np.abs(offsets) <= span
    place = np.argmax(
        np.where(inner & _steepest(strength), strength, 0.0) * np.exp(-2.0 * (offsets / span) ** 2), axis=1
    )
    near = _of_one_edge(strength, place, round(5 * softness))
    mass = np.where(near, strength - np.min(np.where(near, strength, np.inf), axis=1)[:, None], 0.0)
    edge = (mass @ offsets) / (mass.sum(axis=1) + 1e-12)
    peak = strength[np.arange(len(strength)), place]
    found = slopes.seen & (peak > RIM_OVER_TEXTURE * slopes.texture)
    usual = quantile(peak[found], 0.75) if found.any() else 1.0
    foremost = place == np.argmax(np.where(inner, strength, 0.0), axis=1)
    return np.where(found, edge, np.nan), np.minimum((peak / usual) ** 2, 1.0), foremost


def _steepest(strength: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Places (rays, places) that are steeper than both neighbours."""
    found = np.zeros(strength.shape, bool)
    found[:, 1:-1] = (strength[:, 1:-1] >= strength[:, :-2]) & (strength[:, 1:-1] > strength[:, 2:])
    return found


def _of_one_edge(strength: NDArray[np.float32], place: NDArray[np.intp], most: int) -> NDArray[np.bool_]:
    """Places (rays, places) within so many of the steepest one of each ray, as far as the slope falls from there."""
    rays, near = np.arange(len(place)), np.zeros(strength.shape, bool)
    near[rays, place] = True
    for way in (-1, 1):
        falling, last = np.ones(len(place), bool), strength[rays, place]
        for k in range(1, most + 1):
            there = np.clip(place + way * k, 0, strength.shape[1] - 1)
            falling &= strength[rays, there] <= last
            last = strength[rays, there]
            near[rays[falling], there[falling]] = True
    return near


def _without_light(slopes: _Slopes, edge: Array) -> Array:
    """Edges freed of the pull of a shadow beside the rim.

    About each edge the slope is ``A G(t - e) + a + b Phi(t)``: the blurred step and the light's slope on both sides;
    linear in A, A e, a and b. Its spread follows from the mean profile of all edges.
    """
    if np.isfinite(edge).sum() < 12:
        return edge
    t, around, sigma = _spread(slopes, edge)
    bell = np.exp(-0.5 * (t / sigma) ** 2)
    design = np.column_stack([bell, t * bell / sigma**2, np.ones_like(t), ndtr(t / sigma)])
    solved = around @ np.linalg.pinv(design).T
    step = solved[:, 0]
    good = np.isfinite(edge) & (step > 0.3 * np.abs(around).max(axis=1))
    shift = np.where(good, solved[:, 1] / np.where(good, step, 1.0), 0.0)
    return np.asarray(edge + np.clip(shift, -sigma, sigma))


def _spread(slopes: _Slopes, edge: Array) -> tuple[Array, Array, float]:
    """Offsets (m,) about the edges, slopes ``(n, m)`` there, and the spread (px) of their median over all edges."""
    found = np.isfinite(edge)
    t = np.arange(-_LIGHT_REACH_PX, _LIGHT_REACH_PX + 0.25, 0.5)
    places = (np.where(found, edge, 0.0)[:, None] + t - slopes.offsets[0]) / 0.5
    rows = np.broadcast_to(np.arange(len(edge))[:, None], places.shape)
    around = np.asarray(map_coordinates(slopes.along, [rows, places], order=1, mode="nearest"), np.float64)
    mean = medians(around[found], axis=0)
    mass = np.clip(mean - np.min(mean), 0.0, None)
    inside = mass > 0.3 * mass.max()
    # Of a Gaussian cut at 0.3 of its height the variance is 0.58 of the whole one's.
    return t, around, float(np.sqrt((mass[inside] @ t[inside] ** 2) / mass[inside].sum() / 0.58))


def _robust_circle(
    parameters: Array, ray: Array, edge: Array, trust: Array, span: float, expected: Radius
) -> tuple[Array, Array] | None:
    found = np.isfinite(edge)
    if found.sum() < 12:
        return None
    u, v = (parameters[:2] + (parameters[2] + edge[found])[:, None] * ray[found]).T
    fit, scale, sure = parameters.copy(), 0.5 * span, trust[found]
    design = np.ones((3, len(u)))
    for step in range(25):
        du, dv = u - fit[0], v - fit[1]
        distance = np.sqrt(du * du + dv * dv)
        residual = distance - fit[2]
        tukey = sure * np.maximum(1.0 - (residual / (4.685 * scale)) ** 2, 0.0) ** 2
        design[0], design[1] = du / distance, dv / distance
        weighted = design * tukey
        normal = weighted @ design.T
        total = float(normal[2, 2])
        # A whole rim has the determinant W^3 / 4 (W the sum of weights), an eighth of it a thousandth of that.
        if total <= 0.0 or np.linalg.det(normal) < 2.5e-4 * total**3:
            return None
        gradient = weighted @ residual
        prior = (scale / (expected.std * expected.px)) ** 2
        normal[2, 2] += prior
        gradient[2] += prior * (expected.px - fit[2])
        change = np.linalg.solve(normal, gradient)
        fit = fit + change
        # The scale may fall by a third a step: a robust fit that trusts its first guess too early keeps its error.
        floor = 0.67 * scale if step < 6 else 0.03
        settled = np.abs(change).max() < 1e-3 and step >= 6
        scale = max(scatter(residual, 0.0), floor)
        if settled:
            break
    spread = float(np.sqrt((tukey * residual**2).sum() / tukey.sum()))
    lag = float((residual[1:] * residual[:-1] * tukey[1:] * tukey[:-1]).sum() / ((tukey * residual) ** 2).sum())
    # Neighbouring directions share noise and texture: an autoregression of lag one inflates the variance so much.
    lag = min(max(lag, 0.0), 0.95)
    inflation = (1.0 + lag) / (1.0 - lag)
    covariance = np.linalg.inv(normal) * spread**2 * inflation
    return fit, covariance

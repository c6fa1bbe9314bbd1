"""Round bearing covers: a circle of about known radius near the end of the cable, to a few hundredths of a pixel.

``window -> colour gradient -> best centres for one radius (ring operator) -> radial edges -> robust circle``

Any look serves, brighter or darker than ground and cable, with or without a dot, as long as part of the rim shows:
the centre is sought by the mean step around the rim and the circle is fitted with a robust loss, so the sector where
the cable leaves and sectors without contrast do not count. A cover of exactly the ground's look is found by its dot.
Units: px of the photo as displayed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from pipeline.records import Array
from pipeline.settings.vision_stages import BearingSettings
from pipeline.vision.ends import CableEnd
from pipeline.vision.photo import Photo
from pipeline.vision.rough import Bearing

_MAD_TO_STD = 1.4826


@dataclass(frozen=True)
class Circle:
    """A fitted circle and how much of its rim was seen.

    ``center`` (u, v), ``radius`` and their standard deviations in px; ``rim`` is the share of directions with an edge
    on the circle.
    """

    center: tuple[float, float]
    radius: float
    std: float
    radius_std: float
    rim: float

    def as_bearing(self) -> Bearing:
        """The bearing axis under this cover."""
        return Bearing(self.center, self.std, self.radius, self.radius_std, "cover")


@dataclass(frozen=True)
class Radius:
    """Expected radius of a cover in px and its relative standard deviation."""

    px: float
    std: float


def find_cover(
    photo: Photo, end: CableEnd, radius: Radius, width_px: float, settings: BearingSettings
) -> Circle | None:
    """The cover at the end of a cable.

    Parameters
    ----------
    photo : Photo
    end : CableEnd
        Where the cable's mask ends: at the rim, or beyond it where cover and cable look alike.
    radius : Radius
        Expected radius. One that comes out otherwise tells of a shadow taken for the rim and widens the std.
    width_px : px
        Of the cable.

    Returns
    -------
    Circle or None
        None if no circle shows at least ``settings.min_rim`` of its rim.
    """
    # The centre lies between one diameter back and one diameter ahead of the mask's end.
    window = _Window.cut(photo, end.place, 3.1 * radius.px, radius.px)
    if window is None:
        return None
    along, aside = _along_cable(window, end)
    fall = np.maximum(np.abs(along) / radius.px - 1.4, 0.0) / 0.3
    prior = np.exp(-0.5 * (aside / (settings.aside_std_radii * radius.px)) ** 2 - 0.5 * fall**2)
    # Mostly the mask ends at the rim and all behind it is cable; if it ends behind the cover, cable begins before that.
    # A rim that is not seen as a sharp edge is sought as a soft one: out of focus, or faint in the noise.
    for softness, least in ((1.0, settings.min_rim), (settings.soft_rim_px, settings.min_soft_rim)):
        for cable_from in (0.0, -2.4 * radius.px):
            on_cable = (along < cable_from) & (np.abs(aside) < 0.8 * width_px)
            found = _best_circle(photo, window, radius, on_cable, prior, softness, settings)
            if found is not None and found.rim >= least:
                return found
    return _by_dot(photo, window, radius.px, along, aside, settings)


def _by_dot(
    photo: Photo, window: _Window, radius_px: float, along: Array, aside: Array, settings: BearingSettings
) -> Circle | None:
    """Cover of the ground's own look: the cable ends at its rim, and a dot or screw marks the axis."""
    spread = settings.aside_std_radii * radius_px
    prior = np.exp(-0.5 * (aside / spread) ** 2 - 0.5 * ((along - radius_px) / spread) ** 2)
    nowhere = np.zeros(prior.shape, bool)
    # the sizes tried are a third apart
    sizes = [Radius(share * radius_px, 0.08) for share in settings.dot_radii]
    dots = [_best_circle(photo, window, size, nowhere, prior, 1.0, settings) for size in sizes]
    seen = [dot for dot in dots if dot is not None and dot.rim >= settings.sure_rim]
    if not seen:
        return None
    dot = max(seen, key=lambda circle: circle.rim)
    return replace(dot, radius=radius_px, radius_std=0.1 * radius_px)


def _best_circle(
    photo: Photo,
    window: _Window,
    radius: Radius,
    blind: NDArray[np.bool_],
    prior: Array,
    softness: float,
    settings: BearingSettings,
) -> Circle | None:
    """The circle with the most of its rim seen among the best centres of the window."""
    votes = _votes(window, radius.px / window.reduction, blind, settings) * prior
    best: Circle | None = None
    for _ in range(settings.candidates):
        v, u = np.unravel_index(int(np.argmax(votes)), votes.shape)
        circle = fit_circle(photo, window.to_pixels(np.array([u, v], float)), radius, settings, softness=softness)
        if circle is not None and (best is None or circle.rim > best.rim + 0.02):
            best = circle
        if best is not None and best.rim > settings.sure_rim:
            break
        cv2.circle(votes, (int(u), int(v)), max(2, round(0.3 * radius.px / window.reduction)), 0.0, cv2.FILLED)
    return best


@dataclass(frozen=True)
class _Window:
    """Square piece of the photo, reduced so that the circle keeps 16 to 32 cells."""

    grey: NDArray[np.float32]
    origin: Array
    reduction: int

    @classmethod
    def cut(cls, photo: Photo, middle: Array, half: float, radius: float) -> _Window | None:
        low = np.maximum(np.floor(middle - half).astype(int), 0)
        high = np.minimum(np.ceil(middle + half).astype(int) + 1, photo.size)
        if (high - low < radius).any():
            return None
        reduction = max(1, int(radius / 16.0))
        size = tuple(int(side) // reduction for side in high - low)
        part = photo.pixels[low[1] : high[1], low[0] : high[0]][: size[1] * reduction, : size[0] * reduction]
        small = cv2.resize(part, size, interpolation=cv2.INTER_AREA).astype(np.float32) / np.float32(photo.full_scale)
        return cls(small if small.ndim == 3 else small[..., None], low.astype(float), reduction)

    def to_cells(self, uv: Array) -> Array:
        return np.asarray((uv - self.origin - (self.reduction - 1) / 2.0) / self.reduction)

    def to_pixels(self, cells: Array) -> Array:
        return np.asarray(cells * self.reduction + (self.reduction - 1) / 2.0 + self.origin)


def _along_cable(window: _Window, end: CableEnd) -> tuple[Array, Array]:
    """Distance (px) of each cell beyond the end of the cable and aside of its axis."""
    v, u = np.mgrid[: window.grey.shape[0], : window.grey.shape[1]]
    du, dv = np.moveaxis(window.to_pixels(np.stack([u, v], axis=-1)) - end.place, -1, 0)
    return du * end.outward[0] + dv * end.outward[1], dv * end.outward[0] - du * end.outward[1]


def _votes(window: _Window, radius: float, blind: NDArray[np.bool_], settings: BearingSettings) -> NDArray[np.float32]:
    """Change of the mean grey value across a circle around each cell, colours together.

    That is the gradient correlated with a ring of radial directions (Daugman's operator): a faint rim adds up all
    round where texture cancels. Strong edges are clipped, and the cable's own, which are straight and would heap up
    beside it, are left out (``blind``).
    """
    blurred = cv2.GaussianBlur(window.grey, (0, 0), max(0.7, 0.04 * radius))
    gu = np.atleast_3d(cv2.Sobel(blurred, cv2.CV_32F, 1, 0))
    gv = np.atleast_3d(cv2.Sobel(blurred, cv2.CV_32F, 0, 1))
    strength = np.sqrt((gu**2 + gv**2).sum(axis=2))
    gain = 1.0 / np.maximum(strength, settings.edge_over_texture * float(np.median(strength)) + 1e-6)
    gain[blind] = 0.0
    half = int(np.ceil(1.25 * radius))
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(np.float32)
    distance = np.hypot(x, y) + np.float32(1e-6)
    ring = np.exp(-0.5 * ((distance - radius) / max(0.7, settings.ring_width * radius)) ** 2)
    ring /= distance * ring.sum()
    votes = np.zeros(strength.shape, np.float32)
    for channel in range(gu.shape[2]):
        across = cv2.filter2D(gu[..., channel] * gain, -1, ring * x, borderType=cv2.BORDER_CONSTANT)
        across += cv2.filter2D(gv[..., channel] * gain, -1, ring * y, borderType=cv2.BORDER_CONSTANT)
        votes += np.abs(across)
    return votes


def fit_circle(
    photo: Photo, center: Array, expected: Radius, settings: BearingSettings, *, softness: float = 1.0
) -> Circle | None:
    """Fit a circle to the edges around a first guess; None if there are too few.

    Strategy: radial profiles, each time from the centre and radius fitted before; the edge is the centroid of the
    slope about its steepest place; Gauss-Newton on the radial residuals with Tukey's biweight. The slope is taken over
    ``softness`` px: sought over its own blur, an edge stands out of noise the most.
    """
    radius = expected.px
    count = int(np.clip(2.0 * np.pi * radius, 90, settings.directions))
    angle = np.arange(count) * (2.0 * np.pi / count)
    ray = np.column_stack([np.cos(angle), np.sin(angle)])
    span = max(4.0, settings.search_radii * radius)
    parameters = np.array([*center, radius])
    # A third of the rays finds the circle, all of them measure it, twice: the first guess may be some pixels off.
    for span_now, every in ((span, 3), (0.5 * span, 1), (0.5 * span, 1)):
        rays, reach = ray[::every], max(3.0, span_now)
        edge, trust = _radial_edges(photo, parameters, rays, reach, softness, settings)
        fitted = _robust_circle(parameters, rays, edge, trust, reach, expected)
        if fitted is None:
            return None
        before, (parameters, covariance) = parameters, fitted
    miss = np.hypot(*(before[:2] + (before[2] + edge)[:, None] * ray - parameters[:2]).T) - parameters[2]
    rim = float(np.mean(np.abs(miss) < max(0.75, settings.rim_tolerance * radius)))
    off, other = np.hypot(*(parameters[:2] - center)), abs(parameters[2] - radius)
    concentric = other > max(4.0 * expected.std * radius, 1.0)
    if off > 0.5 * radius or (concentric and (rim < settings.sure_rim or other > 1.2 * span)):
        return None
    if concentric:
        # A bevel or groove turned on the same axis, seen all round: it tells the centre, the radius it does not.
        std = float(np.hypot(np.sqrt(0.5 * np.trace(covariance[:2, :2])), settings.center_std_floor_px))
        return Circle((float(parameters[0]), float(parameters[1])), radius, std, 0.1 * radius, rim)
    # A rim wrongly placed on one side moves the centre by half of what it adds to the radius.
    excess = max(abs(parameters[2] - radius) - expected.std * radius, 0.0)
    std = float(
        np.linalg.norm([np.sqrt(0.5 * np.trace(covariance[:2, :2])), settings.center_std_floor_px, 0.5 * excess])
    )
    radius_std = float(np.hypot(np.sqrt(covariance[2, 2]), settings.center_std_floor_px))
    return Circle((float(parameters[0]), float(parameters[1])), float(parameters[2]), std, radius_std, rim)


def _radial_edges(
    photo: Photo, parameters: Array, ray: Array, span: float, softness: float, settings: BearingSettings
) -> tuple[Array, Array]:
    """Radius of the edge in each direction relative to the circle, NaN where none stands out, and its weight.

    The variance of an edge falls with the square of its slope; a soft shadow beside a rim of little contrast would
    else pass for the rim.
    """
    # The outer halves of the rays tell what is no edge: sheen, texture and noise.
    calm = span + 4.0 * (softness - 1.0)  # a soft edge reaches beyond the range in which it is sought
    offsets = np.arange(-calm - span, calm + span + 0.25, 0.5)
    points = parameters[:2] + (parameters[2] + offsets)[None, :, None] * ray[:, None, :]
    low = np.maximum(np.floor(points.min(axis=(0, 1))).astype(int) - 2, 0)
    high = np.minimum(np.ceil(points.max(axis=(0, 1))).astype(int) + 3, photo.size)
    if (high - low < 4).any():
        return np.full(len(ray), np.nan), np.zeros(len(ray))
    part = photo.pixels[low[1] : high[1], low[0] : high[0]].astype(np.float32) / np.float32(photo.full_scale)
    u, v = (points[..., axis].astype(np.float32) - np.float32(low[axis]) for axis in (0, 1))
    profile = cv2.remap(part, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).reshape(*u.shape, -1)
    # Rays are pooled with their neighbours along the rim: noise falls, and the rim stays where it is.
    pooled = gaussian_filter1d(profile, settings.pooled_rays * softness, axis=0, mode="wrap")
    slope = gaussian_filter1d(np.gradient(pooled, 0.5, axis=1), 2.0 * softness, axis=1)
    strength = np.sqrt((slope**2).sum(axis=2))
    inner = np.abs(offsets) <= span
    outside = (u < 1) | (v < 1) | (u > part.shape[1] - 2) | (v > part.shape[0] - 2)
    seen = ~(outside & inner).any(axis=1)
    place = np.argmax(np.where(inner, strength, 0.0), axis=1)
    near = np.abs(np.arange(len(offsets)) - place[:, None]) <= 5 * softness
    mass = np.where(near, strength - np.min(np.where(near, strength, np.inf), axis=1)[:, None], 0.0)
    edge = (mass @ offsets) / (mass.sum(axis=1) + 1e-12)
    peak = strength[np.arange(len(ray)), place]
    found = seen & (peak > settings.rim_over_texture * float(np.median(strength[:, np.abs(offsets) > calm])))
    usual = float(np.percentile(peak[found], 75)) if found.any() else 1.0
    return np.where(found, edge, np.nan), np.minimum((peak / usual) ** 2, 1.0)


def _robust_circle(
    parameters: Array, ray: Array, edge: Array, trust: Array, span: float, expected: Radius
) -> tuple[Array, Array] | None:
    found = np.isfinite(edge)
    if found.sum() < 12:
        return None
    points = parameters[:2] + (parameters[2] + edge[found])[:, None] * ray[found]
    fit, scale = parameters.copy(), 0.5 * span
    for step in range(25):
        arm = points - fit[:2]
        distance = np.hypot(*arm.T)
        residual = distance - fit[2]
        tukey = trust[found] * np.clip(1.0 - (residual / (4.685 * scale)) ** 2, 0.0, None) ** 2
        design = np.column_stack([arm / distance[:, None], np.ones(len(points))])
        normal = design.T @ (tukey[:, None] * design)
        # A whole rim has the determinant W^3 / 4 (W the sum of weights), an eighth of it a thousandth of that.
        if np.linalg.det(normal) < 2.5e-4 * tukey.sum() ** 3 or not tukey.any():
            return None
        gradient = design.T @ (tukey * residual)
        prior = (scale / (expected.std * expected.px)) ** 2
        normal[2, 2] += prior
        gradient[2] += prior * (expected.px - fit[2])
        change = np.linalg.solve(normal, gradient)
        fit = fit + change
        # The scale may fall by a third a step: a robust fit that trusts its first guess too early keeps its error.
        floor = 0.67 * scale if step < 6 else 0.03
        settled = np.abs(change).max() < 1e-3 and step >= 6
        scale = max(_MAD_TO_STD * float(np.median(np.abs(residual))), floor)
        if settled:
            break
    spread = float(np.sqrt((tukey * residual**2).sum() / tukey.sum()))
    lag = float((residual[1:] * residual[:-1] * tukey[1:] * tukey[:-1]).sum() / ((tukey * residual) ** 2).sum())
    # Neighbouring directions share noise and texture: an autoregression of lag one inflates the variance so much.
    inflation = (1.0 + np.clip(lag, 0.0, 0.95)) / (1.0 - np.clip(lag, 0.0, 0.95))
    covariance = np.linalg.inv(normal) * spread**2 * inflation
    return fit, covariance

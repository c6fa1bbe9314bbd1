"""Round bearing covers: a circle of about known radius near the end of the cable, to a few hundredths of a pixel.

``window -> colour gradient -> votes for centres at one radius (Hough) -> radial profiles -> edges -> robust circle``

Any look serves, brighter or darker than ground and cable, with or without a dot, as long as part of the rim shows:
edges vote by direction and not by strength, and the circle is fitted with a robust loss, so the sector where the
cable leaves and sectors without contrast do not count.
Units: px of the photo as displayed.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from pipeline.records import Array
from pipeline.settings.vision_stages import BearingSettings
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


def find_cover(
    photo: Photo, end_px: Array, outward: Array, radius_px: float, settings: BearingSettings
) -> Circle | None:
    """The cover at the end of a cable.

    Parameters
    ----------
    photo : Photo
    end_px : (2,) px
        Where the cable's mask ends: at the rim, or beyond it where cover and cable look alike.
    outward : (2,)
        Unit vector in which the cable leaves.
    radius_px : px
        Expected radius; the true one may differ by ``settings.radius_tolerance``.

    Returns
    -------
    Circle or None
        None if no circle shows at least ``settings.min_rim`` of its rim.
    """
    # The centre lies between one diameter back and one diameter ahead of the mask's end.
    window = _Window.cut(photo, end_px, (2.0 + 1.0 + settings.radius_tolerance) * radius_px, radius_px)
    if window is None:
        return None
    votes = _votes(window, radius_px / window.reduction, settings)
    votes *= _prior(votes.shape, window.to_cells(end_px), outward, radius_px / window.reduction)
    best: Circle | None = None
    for _ in range(settings.candidates):
        v, u = np.unravel_index(int(np.argmax(votes)), votes.shape)
        circle = fit_circle(photo, window.to_pixels(np.array([u, v], float)), radius_px, settings)
        if circle is not None and (best is None or circle.rim > best.rim + 0.02):
            best = circle
        if best is not None and best.rim > settings.sure_rim:
            break
        cv2.circle(votes, (int(u), int(v)), max(2, round(0.3 * radius_px / window.reduction)), 0.0, cv2.FILLED)
    return best if best is not None and best.rim >= settings.min_rim else None


@dataclass(frozen=True)
class _Window:
    """Square piece of the photo, reduced so that the circle keeps a few tens of cells."""

    grey: NDArray[np.float32]
    origin: Array
    reduction: int

    @classmethod
    def cut(cls, photo: Photo, middle: Array, half: float, radius: float) -> _Window | None:
        low = np.maximum(np.floor(middle - half).astype(int), 0)
        high = np.minimum(np.ceil(middle + half).astype(int) + 1, photo.size)
        if (high - low < radius).any():
            return None
        reduction = max(1, int(radius / 24.0))
        size = tuple(int(side) // reduction for side in high - low)
        part = photo.pixels[low[1] : high[1], low[0] : high[0]][: size[1] * reduction, : size[0] * reduction]
        small = cv2.resize(part, size, interpolation=cv2.INTER_AREA).astype(np.float32) / np.float32(photo.full_scale)
        return cls(small if small.ndim == 3 else small[..., None], low.astype(float), reduction)

    def to_cells(self, uv: Array) -> Array:
        return np.asarray((uv - self.origin - (self.reduction - 1) / 2.0) / self.reduction)

    def to_pixels(self, cells: Array) -> Array:
        return np.asarray(cells * self.reduction + (self.reduction - 1) / 2.0 + self.origin)


def _votes(window: _Window, radius: float, settings: BearingSettings) -> NDArray[np.float32]:
    """Picture of votes: each edge votes for the two centres one radius away along its gradient."""
    blurred = cv2.GaussianBlur(window.grey, (0, 0), max(1.0, 0.04 * radius))
    gu = np.atleast_3d(cv2.Sobel(blurred, cv2.CV_32F, 1, 0))
    gv = np.atleast_3d(cv2.Sobel(blurred, cv2.CV_32F, 0, 1))
    strength = np.hypot(gu, gv)
    channel = np.argmax(strength, axis=2)[..., None]
    gu, gv, strength = (np.take_along_axis(part, channel, axis=2)[..., 0] for part in (gu, gv, strength))
    floor = settings.edge_over_texture * float(np.median(strength)) + 1e-6
    v, u = np.nonzero(strength > floor)
    directions = np.stack([gu[v, u], gv[v, u]]) / strength[v, u]
    # A strong edge (the cable's) counts at most three times a weak one (a grey cover on a grey ground).
    weight = np.minimum(strength[v, u] / floor, 3.0)
    votes = np.zeros(strength.shape, np.float32)
    for factor in np.linspace(1.0 - settings.radius_tolerance, 1.0 + settings.radius_tolerance, 7):
        for sign in (-1.0, 1.0):
            at = np.rint(np.stack([u, v]) + sign * factor * radius * directions).astype(int)
            inside = (at >= 0).all(axis=0) & (at < np.array([[votes.shape[1]], [votes.shape[0]]])).all(axis=0)
            np.add.at(votes, (at[1, inside], at[0, inside]), weight[inside])
    return cv2.GaussianBlur(votes, (0, 0), max(1.0, 0.06 * radius))


def _prior(shape: tuple[int, ...], end: Array, outward: Array, radius: float) -> NDArray[np.float32]:
    """Where a cover can be: the cable's axis runs through its centre, give or take the bend under the cover."""
    v, u = np.mgrid[: shape[0], : shape[1]]
    along = (u - end[0]) * outward[0] + (v - end[1]) * outward[1]
    aside = (v - end[1]) * outward[0] - (u - end[0]) * outward[1]
    beyond = np.maximum(np.abs(along) - 1.4 * radius, 0.0)
    return np.exp(-0.5 * (aside / (0.4 * radius)) ** 2 - 0.5 * (beyond / (0.3 * radius)) ** 2).astype(np.float32)


def fit_circle(photo: Photo, center: Array, radius: float, settings: BearingSettings) -> Circle | None:
    """Fit a circle to the edges around a first guess; None if there are too few.

    Strategy: radial profiles, twice (the second time from the fitted centre and radius); the edge is the centroid of
    the slope about its steepest place; Gauss-Newton on the radial residuals with Tukey's biweight.
    """
    count = int(np.clip(2.0 * np.pi * radius, 90, settings.directions))
    angle = np.arange(count) * (2.0 * np.pi / count)
    ray = np.column_stack([np.cos(angle), np.sin(angle)])
    span = max(4.0, 2.0 * settings.radius_tolerance * radius)
    parameters = np.array([*center, radius])
    for span_now in (span, max(3.0, 0.5 * span)):
        edge = _radial_edges(photo, parameters, ray, span_now)
        fitted = _robust_circle(parameters, ray, edge, span_now)
        if fitted is None:
            return None
        parameters, weight, scale, covariance = fitted
    off = np.hypot(*(parameters[:2] - center))
    if off > 0.5 * radius or abs(parameters[2] / radius - 1.0) > 1.5 * settings.radius_tolerance:
        return None
    rim = float(np.mean(np.isfinite(edge) & (weight > 0.2) & (scale < 0.04 * radius)))
    std = float(np.hypot(np.sqrt(0.5 * np.trace(covariance[:2, :2])), settings.center_std_floor_px))
    radius_std = float(np.hypot(np.sqrt(covariance[2, 2]), settings.center_std_floor_px))
    return Circle((float(parameters[0]), float(parameters[1])), float(parameters[2]), std, radius_std, rim)


def _radial_edges(photo: Photo, parameters: Array, ray: Array, span: float) -> Array:
    """Radius of the edge in each direction relative to the circle, NaN where none stands out."""
    offsets = np.arange(-span, span + 0.25, 0.5)
    points = parameters[:2] + (parameters[2] + offsets)[None, :, None] * ray[:, None, :]
    low = np.maximum(np.floor(points.min(axis=(0, 1))).astype(int) - 2, 0)
    high = np.minimum(np.ceil(points.max(axis=(0, 1))).astype(int) + 3, photo.size)
    if (high - low < 4).any():
        return np.full(len(ray), np.nan)
    part = photo.pixels[low[1] : high[1], low[0] : high[0]].astype(np.float32) / np.float32(photo.full_scale)
    u, v = (points[..., axis].astype(np.float32) - np.float32(low[axis]) for axis in (0, 1))
    profile = cv2.remap(part, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).reshape(*u.shape, -1)
    slope = gaussian_filter1d(np.gradient(profile, 0.5, axis=1), 2.0, axis=1)
    strength = np.sqrt((slope**2).sum(axis=2))
    seen = (u >= 1).all(axis=1) & (v >= 1).all(axis=1)
    seen &= (u <= part.shape[1] - 2).all(axis=1) & (v <= part.shape[0] - 2).all(axis=1)
    place = np.argmax(strength[:, 3:-3], axis=1) + 3
    near = np.abs(np.arange(len(offsets)) - place[:, None]) <= 5
    mass = np.where(near, strength - np.min(np.where(near, strength, np.inf), axis=1)[:, None], 0.0)
    edge = (mass @ offsets) / (mass.sum(axis=1) + 1e-12)
    peak = strength[np.arange(len(ray)), place]
    return np.where(seen & (peak > 3.0 * np.median(strength, axis=1)) | (seen & (peak > np.median(peak))), edge, np.nan)


def _robust_circle(parameters: Array, ray: Array, edge: Array, span: float) -> tuple[Array, Array, float, Array] | None:
    found = np.isfinite(edge)
    if found.sum() < 12:
        return None
    points = parameters[:2] + (parameters[2] + edge[found])[:, None] * ray[found]
    fit, scale = parameters.copy(), 0.5 * span
    for step in range(25):
        arm = points - fit[:2]
        distance = np.hypot(*arm.T)
        residual = distance - fit[2]
        tukey = np.clip(1.0 - (residual / (4.685 * scale)) ** 2, 0.0, None) ** 2
        design = np.column_stack([arm / distance[:, None], np.ones(len(points))])
        normal = design.T @ (tukey[:, None] * design)
        if np.linalg.det(normal) < 1e-4 * len(points) ** 3 * 1e-2:  # less than an eighth of the rim: no centre
            return None
        change = np.linalg.solve(normal, design.T @ (tukey * residual))
        fit = fit + change
        # The scale may fall by a third a step: a robust fit that trusts its first guess too early keeps its error.
        floor = 0.67 * scale if step < 6 else 0.03
        settled = np.abs(change).max() < 1e-3 and step >= 6
        scale = max(_MAD_TO_STD * float(np.median(np.abs(residual))), floor)
        if settled:
            break
    weight = np.zeros(len(edge))
    weight[found] = tukey
    spread = float(np.sqrt((tukey * residual**2).sum() / tukey.sum()))
    lag = float((residual[1:] * residual[:-1] * tukey[1:] * tukey[:-1]).sum() / ((tukey * residual) ** 2).sum())
    # Neighbouring directions share noise and texture: an autoregression of lag one inflates the variance so much.
    inflation = (1.0 + np.clip(lag, 0.0, 0.95)) / (1.0 - np.clip(lag, 0.0, 0.95))
    covariance = np.linalg.inv(normal) * spread**2 * inflation
    return fit, weight, spread, covariance

"""Corners of a board on one photo or more to the plane map: tilt, scale and lens in one fit.

Photos that show the board in the plane of the cable, shifted or turned as one likes; one is enough. All corners
together give the homography (tilt and scale) and the radial lens term ``k1``:

``board (X, Y) -> moved in the plane -> H^-1 -> ideal pixel -> r (1 + k1 (r / R)^2) -> photo``

R half the picture's diagonal. Three photos or more may show the board in any position, as they must to calibrate a
lens: where one plane does not fit them, the lens comes from all (camera matrix, k1, k2, p1, p2), and each photo shows
a plane of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import least_squares

from pipeline.messages import Message
from pipeline.records import Array
from pipeline.vision.median import SURE_SIGMAS, scatter
from pipeline.vision.scale.plane import Lens, PlaneMap, project

USUAL_LENS = 0.02  # relative; standard deviation of k1 at half the diagonal among lenses nobody corrected
_LEAST_STD_PX = 1e-3  # px; of corners: a tenth of what noise leaves at best
_DISTANCE_STD = 0.3  # relative; a distance known worse tells no more than a usual one
_CORNER_STD_PX = 0.15  # px; corners of real boards off the plane, before they are fitted
_ONE_PLANE_RATIO = 1.5  # ratio of the corners' rms in one plane to that in free positions; tilts of a degree double it


@dataclass(frozen=True)
class BoardView:
    """Corners of the board on one photo: ``board_m`` (n, 2) on the board, ``uv`` (n, 2) on the photo."""

    name: str
    board_m: Array
    uv: Array
    size: tuple[int, int]


@dataclass(frozen=True)
class PlaneFit:
    """Plane map of the board's surface, and how sure it is.

    Attributes
    ----------
    rms_px : float px
        Of the corners off the fit.
    scale_std, border_std : float
        Relative standard deviations of the scale in the middle of the picture, and of its change from there to the
        border.
    distance_m : float or None
        Of the camera, if the photos tell.
    aside : tuple of PlaneMap
        Maps one standard deviation away along each principal direction of the fit's covariance.
    photo : str
        Of which it is the plane; empty where it is that of all.
    """

    plane: PlaneMap
    rms_px: float
    scale_std: float
    border_std: float
    distance_m: float | None
    lens_source: Message
    aside: tuple[PlaneMap, ...]
    photo: str = ""


def fit_views(views: list[BoardView]) -> list[PlaneFit]:
    """Plane maps of the board's surface from one photo or more: one for all, or that of each photo."""
    flat = _fit_plane_views(views)
    if len(views) < 3:  # two positions leave focal lengths and middle of a lens open (Zhang, 2000)
        return [flat]
    free = _fit_free_views(views)
    # Photos that all show the board in one plane fit there as well, and tell no focal length: any lens would do.
    return free if flat.rms_px > _ONE_PLANE_RATIO * free[0].rms_px else [flat]


def _fit_plane_views(views: list[BoardView]) -> PlaneFit:
    """All photos show the board in one plane: one homography, one radial term, a rigid move for each further photo."""
    middle, radius = _picture(views[0])
    start, moves = _start(views, middle, radius)
    fit = _least_squares(views, np.concatenate([[0.0], start, *moves]), USUAL_LENS)
    source = Message("lens.fitted", k1=fit.x[0], std=np.sqrt(fit.covariance[0, 0]))
    camera = np.array([[radius, 0.0, middle[0]], [0.0, radius, middle[1]], [0.0, 0.0, 1.0]])
    return _plane_fit(fit, Lens(camera, np.zeros(5)), views[0], rms=fit.rms, lens_source=source)


def _plane_fit(
    fit: _Solution,
    lens: Lens,
    view: BoardView,
    *,
    rms: float,
    lens_source: Message,
    distance: float | None = None,
    photo: str = "",
) -> PlaneFit:
    """The plane of a fit to corners without the distortion of a lens, which the fit's radial term adds to."""
    middle, radius = _picture(view)
    to_unit = np.array([[1 / radius, 0, -middle[0] / radius], [0, 1 / radius, -middle[1] / radius], [0, 0, 1]])
    # k1 counts from half the diagonal in the fit, from the focal length in the lens
    share = (float(lens.camera[0, 0]) / radius) ** 2

    def plane_of(x: Array) -> PlaneMap:
        homography = np.append(x[1:9], 1.0).reshape(3, 3) @ to_unit
        return PlaneMap(homography, Lens(lens.camera, lens.distortion + np.r_[x[0] * share, np.zeros(4)]))

    # A board that leaves the middle out, or that hardly tells the lens, tells the scale there by extrapolation.
    around = np.array([[u, v] for u in (-0.9, 0.0, 0.9) for v in (-0.9, 0.0, 0.9) if u or v])
    places = np.vstack([middle, middle * (1.0 + around)])

    def logarithms(x: Array) -> Array:
        return np.log(plane_of(x).local_scale(places))

    steps = 1e-4 * fit.unit * np.eye(len(fit.x))
    slopes = np.array([(logarithms(fit.x + step) - logarithms(fit.x - step)) / 2e-4 for step in steps])
    change = slopes[:, 1:] - slopes[:, :1]
    variance = np.mean(np.einsum("ij,ik,kj->j", change, fit.covariance, change))
    # The other photos' own moves stay: they say nothing about the plane of the first.
    values, vectors = np.linalg.eigh(fit.covariance[:9, :9])
    aside = np.zeros((9, len(fit.x)))
    aside[:, :9] = (vectors * np.sqrt(np.maximum(values, 0.0))).T * fit.unit[:9]
    return PlaneFit(
        plane_of(fit.x),
        rms,
        scale_std=float(np.sqrt(slopes[:, 0] @ fit.covariance @ slopes[:, 0])),
        border_std=float(np.sqrt(variance)),
        distance_m=distance,
        lens_source=lens_source,
        aside=tuple(plane_of(fit.x + step) for step in aside),
        photo=photo,
    )


def _picture(view: BoardView) -> tuple[Array, float]:
    """Middle of the picture and half its diagonal, px."""
    width, height = view.size
    return np.array([0.5 * (width - 1), 0.5 * (height - 1)]), 0.5 * float(np.hypot(width, height))


@dataclass(frozen=True)
class _Solution:
    """Parameters ``x``, their covariance in units of ``unit``, rms of the residuals in px."""

    x: Array
    unit: Array
    covariance: Array
    rms: float


def _start(views: list[BoardView], middle: Array, radius: float) -> tuple[Array, list[Array]]:
    """Homography of the first photo and rigid moves of the others from matching by it."""
    first = homography_of((views[0].uv - middle) / radius, views[0].board_m)
    start = (first / first[2, 2]).ravel()[:8]
    moves = []
    for view in views[1:]:
        plane = project(first, (view.uv - middle) / radius)
        a, b = view.board_m - view.board_m.mean(axis=0), plane - plane.mean(axis=0)
        turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
        moves.append(np.array([turn, *(plane.mean(axis=0) - _rotation(turn) @ view.board_m.mean(axis=0))]))
    return start, moves


def homography_of(uv: Array, points: Array) -> Array:
    """Homography ``(3, 3)`` that carries ``uv`` to ``points``, both ``(n, 2)``.

    Raises
    ------
    numpy.linalg.LinAlgError
        All lie on one line or in one point.
    """
    matrix, _ = cv2.findHomography(uv, points)
    if matrix is None or abs(matrix[2, 2]) < 1e-9:
        raise np.linalg.LinAlgError
    return np.asarray(matrix)


def _rotation(turn: float) -> Array:
    return np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])


def _least_squares(views: list[BoardView], start: Array, lens_std: float) -> _Solution:
    """Corners against the model, in px; the first parameter is k1.

    A board that hardly tells the lens would have it bend the picture outside the board at will: lenses have k1 about
    zero with the standard deviation ``lens_std``, and that is one more observation.
    """
    middle, radius = _picture(views[0])
    size = float(np.ptp(views[0].board_m))
    scale = np.array([1.0, *[size] * 6, 1.0, 1.0, *[1.0, size, size] * (len(views) - 1)])

    def corners(q: Array) -> Array:
        x = q * scale
        to_picture = np.linalg.inv(np.append(x[1:9], 1.0).reshape(3, 3))
        parts = []
        for i, view in enumerate(views):
            points = view.board_m
            if i:
                turn, *shift = x[9 + 3 * (i - 1) : 12 + 3 * (i - 1)]
                points = points @ _rotation(turn).T + shift
            ideal = project(to_picture, points)
            shown = ideal * (1.0 + x[0] * (ideal**2).sum(axis=1, keepdims=True))
            parts.append((shown * radius + middle - view.uv).ravel())
        return np.concatenate(parts)

    std, q = _CORNER_STD_PX, start / scale
    for _ in range(2):  # the second time with the corners' own scatter
        used = std

        def residual(q: Array, used: float = used) -> Array:
            return np.append(corners(q), used / lens_std * q[0])

        found = least_squares(residual, q, x_scale="jac", loss="soft_l1", f_scale=3.0 * used, max_nfev=60)
        q, error = np.asarray(found.x), corners(np.asarray(found.x))
        # of most of them: a corner mistaken for another thing shall not widen what it is judged by
        std = max(scatter(error, 0.0), _LEAST_STD_PX)
    rms = float(np.sqrt(error @ error / max(len(error) - len(q), 1)))
    slopes = np.asarray(found.jac)
    slopes[-1] *= rms / used
    return _Solution(q * scale, scale, np.asarray(np.linalg.pinv(slopes.T @ slopes)) * rms**2, rms)


def _fit_free_views(views: list[BoardView]) -> list[PlaneFit]:
    """Any positions: camera matrix and lens from all, the plane of each photo."""
    objects = [np.column_stack([v.board_m, np.zeros(len(v.board_m))]).astype(np.float32) for v in views]
    images = [v.uv.astype(np.float32).reshape(-1, 1, 2) for v in views]
    simple = cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_K2 | cv2.CALIB_ZERO_TANGENT_DIST
    fits = [
        cv2.calibrateCameraExtended(objects, images, views[0].size, np.eye(3), np.zeros(5), flags=flags)
        for flags in (simple, cv2.CALIB_FIX_K3)
    ]
    # k2 and the tangential terms run wild outside the board unless the corners surely show them.
    drop = (fits[0][0] ** 2 - fits[1][0] ** 2) / fits[1][0] ** 2 * 2 * sum(len(v.uv) for v in views)
    rms, camera, distortion, turns, shifts, stds, *_ = fits[1] if drop > SURE_SIGMAS**2 * 3 else fits[0]
    lens = Lens(np.asarray(camera, np.float64), np.asarray(distortion, np.float64).ravel()[:5])
    focal, stds = float(lens.camera[0, 0]), np.ravel(stds)  # of fx, fy, cx, cy, k1
    middle, radius = _picture(views[0])
    source = Message("lens.photos", photos=len(views))
    found = []
    for view, turn, shift in zip(views, turns, shifts, strict=True):
        ideal = replace(view, uv=lens.undistort(view.uv))
        # The board's z axis points away from or toward the camera; the distance from the plane is the same.
        distance = float(abs(cv2.Rodrigues(turn)[0][:, 2] @ np.ravel(shift)))
        start = np.append(0.0, _start([ideal], middle, radius)[0])
        fit = _least_squares([ideal], start, float(stds[4]) * (radius / focal) ** 2)
        # OpenCV counts distances, here as above coordinates.
        made = _plane_fit(
            fit,
            lens,
            view,
            rms=float(rms) / np.sqrt(2.0),
            lens_source=source,
            distance=distance if stds[0] < _DISTANCE_STD * focal else None,
            photo=view.name,
        )
        found.append(made)
    return found

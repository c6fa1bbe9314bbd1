"""Photos of a chessboard or ChArUco board to the plane map: tilt, scale and lens in one fit.

The board lies in the plane on which the cable lies. Every photo of the folder shows it there, shifted or turned as one
likes; one is enough. All corners together give the homography (tilt and scale) and the radial lens term ``k1``:

``board (X, Y) -> moved in the plane -> H^-1 -> ideal pixel -> r (1 + k1 (r / R)^2) -> photo``

R half the picture's diagonal. From ten photos on they may show the board in any position; then the lens comes from
all of them (camera matrix, k1, k2, p1, p2) and the plane from the first by name.

The cable axis lies half a diameter above the board. A ray through the board at (x, y) passes the height h at
``(x, y) + h/Z (foot - (x, y))``, Z the camera's distance from the plane: a change of scale by 1 - h/Z, whatever
the tilt.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pipeline.errors import InputError
from pipeline.records import Array, Board, CameraSpec, Finding, Rejected, Scale
from pipeline.settings.vision import VisionSettings
from pipeline.settings.vision.scale import CalibrationSettings
from pipeline.vision.photo import Photo, load_photo
from pipeline.vision.scale.calibration import Calibration
from pipeline.vision.scale.plane import Lens, PlaneMap

_SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"}
_DICTIONARIES = (
    cv2.aruco.DICT_4X4_1000,
    cv2.aruco.DICT_5X5_1000,
    cv2.aruco.DICT_6X6_1000,
    cv2.aruco.DICT_7X7_1000,
    cv2.aruco.DICT_ARUCO_ORIGINAL,
)


@dataclass(frozen=True)
class BoardView:
    """Corners of the board on one photo: ``board_m`` (n, 2) on the board, ``uv`` (n, 2) on the photo."""

    name: str
    board_m: Array
    uv: Array
    size: tuple[int, int]


@dataclass(frozen=True)
class PlaneFit:
    """Plane map of the board's surface; ``rms_px`` of the corners; relative ``scale_std``; camera distance if known."""

    plane: PlaneMap
    rms_px: float
    scale_std: float
    distance_m: float | None
    lens_source: str


def calibrate_by_board(camera: CameraSpec, diameter_m: float, settings: VisionSettings) -> Calibration:
    """Calibrate from the folder of ``camera``.

    Raises
    ------
    InputError
        ``calibration/no-board``: the board is on none of the photos, or no plane follows from its corners;
        ``calibration/size``: photos of different sizes.
    """
    if camera.calibration is None or camera.board is None:
        raise ValueError("calibrate_by_board needs a folder of photos and the board's size")
    stage = settings.calibration
    views, findings = _read_views(camera.calibration, camera.board, settings)
    try:
        fit = fit_views(views, stage)
    except (np.linalg.LinAlgError, cv2.error) as error:
        raise InputError(
            "no plane follows from the corners of the board",
            path=camera.calibration,
            code="calibration/no-board",
            remedy="show the whole board from above, lying in the plane of the cable",
        ) from error
    plane, height_std, height_findings = _raise_to_axis(fit, camera.distance_m, diameter_m, stage)
    middle = 0.5 * np.array([views[0].size], float)
    std = float(np.sqrt(fit.scale_std**2 + stage.board_std**2 + height_std**2))
    scale = Scale(float(plane.local_scale(middle)[0]), std, f"board photos ({len(views)}), {fit.lens_source}")
    if fit.rms_px > stage.max_board_rms_px:
        text = f"The board's corners lie {fit.rms_px:.2f} px rms off the fitted plane; is it flat and the photo sharp?"
        findings.append(Finding("calibration/residual", "warning", text))
    return Calibration(plane, scale, (*findings, *height_findings))


def _read_views(folder: Path, board: Board, settings: VisionSettings) -> tuple[list[BoardView], list[Finding]]:
    views: list[BoardView] = []
    findings: list[Finding] = []
    for path in sorted(p for p in folder.iterdir() if p.suffix.lower() in _SUFFIXES):
        photo = load_photo(path, settings.photo)
        view = photo if isinstance(photo, Rejected) else find_board(photo, board, settings.calibration)
        if isinstance(view, Rejected):
            findings.append(Finding("calibration/photo", "warning", f"Calibration photo left out: {view.reason}"))
        else:
            views.append(view)
    if not views:
        raise InputError(
            f"the board ({board.columns} x {board.rows} inner corners) is found on none of the calibration photos",
            path=folder,
            code="calibration/no-board",
            remedy="check columns and rows (inner corners) and show the whole board in focus",
        )
    if len({view.size for view in views}) > 1:
        raise InputError(
            "the calibration photos have different sizes",
            path=folder,
            code="calibration/size",
            remedy="take all of them with the camera settings of the measurement",
        )
    return views, findings


def find_board(photo: Photo, board: Board, settings: CalibrationSettings) -> BoardView | Rejected:
    """Corners of the board on a photo, sub-pixel; rejected with ``calibration/no-corners`` if it is not there."""
    grey = _grey8(photo)
    factor = max(1, round(max(photo.size) / settings.board_search_px))
    reduced = cv2.resize(grey, None, fx=1.0 / factor, fy=1.0 / factor, interpolation=cv2.INTER_AREA)
    small = np.asarray(reduced, np.uint8)
    found = _charuco(small, board) if board.charuco else _chessboard(small, board)
    # corners on one line tell no plane, however many there are
    if found is None or len(found[0]) < 6 or not _spread(found[0], 0.25 * board.square_m):
        reason = f"{photo.name}: the board with {board.columns} x {board.rows} inner corners is not seen."
        return Rejected(photo.name, "calibration/no-corners", reason)
    points, uv = found
    if factor > 1:
        # refined at full resolution; half a window of the reduction covers the first estimate's error
        uv = uv * factor + 0.5 * (factor - 1)
        criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-4)
        start = np.ascontiguousarray(uv.reshape(-1, 1, 2), np.float32)
        corners = cv2.cornerSubPix(grey, start, (3 * factor, 3 * factor), (-1, -1), criteria)
        uv = np.asarray(corners.reshape(-1, 2), np.float64)
    return BoardView(photo.name, points, uv, photo.size)


def _spread(points: Array, least: float) -> bool:
    """True if the points span a plane: their standard deviation is at least ``least`` in every direction."""
    covariance = np.cov(points, rowvar=False)
    return bool(np.sqrt(max(float(np.linalg.eigvalsh(covariance)[0]), 0.0)) > least)


def _grey8(photo: Photo) -> NDArray[np.uint8]:
    pixels = photo.pixels if photo.channels == 1 else cv2.cvtColor(photo.pixels, cv2.COLOR_BGR2GRAY)
    if pixels.dtype == np.uint8:
        return np.asarray(pixels, np.uint8)
    levels: NDArray[np.uint8] = np.clip(pixels * (255.0 / photo.full_scale), 0, 255).astype(np.uint8)
    return levels


def _chessboard(grey: NDArray[np.uint8], board: Board) -> tuple[Array, Array] | None:
    size = (board.columns, board.rows)
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    found, corners = cv2.findChessboardCornersSB(grey, size, flags=flags)
    if not found:
        return None
    grid = np.mgrid[: board.columns, : board.rows].T.reshape(-1, 2) * board.square_m
    return grid.astype(np.float64), np.asarray(corners, np.float64).reshape(-1, 2)


def _charuco(grey: NDArray[np.uint8], board: Board) -> tuple[Array, Array] | None:
    """Corners of a ChArUco board; which dictionary it was printed with is found by trying."""
    marker = 0.75 * board.square_m if board.marker_m is None else board.marker_m
    best: tuple[Array, Array] | None = None
    for name in _DICTIONARIES:
        dictionary = cv2.aruco.getPredefinedDictionary(name)
        size = (board.columns + 1, board.rows + 1)
        pattern = cv2.aruco.CharucoBoard(size, board.square_m, marker, dictionary)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(pattern).detectBoard(grey)
        if ids is not None and (best is None or len(ids) > len(best[0])):
            points = np.asarray(pattern.getChessboardCorners(), np.float64)[np.ravel(ids), :2]
            best = points, np.asarray(corners, np.float64).reshape(-1, 2)
        if best is not None and len(best[0]) > 0.5 * board.columns * board.rows:
            break
    return best


def fit_views(views: list[BoardView], settings: CalibrationSettings) -> PlaneFit:
    """Plane map of the board's surface from one photo or more."""
    flat = _fit_plane_views(views, settings)
    if len(views) < settings.lens_photos:
        return flat
    free = _fit_free_views(views, settings)
    # Photos that all show the board in one plane fit there as well, and tell no focal length: any lens would do.
    return free if flat.rms_px > settings.one_plane_ratio * free.rms_px else flat


def _fit_plane_views(views: list[BoardView], settings: CalibrationSettings) -> PlaneFit:
    """All photos show the board in one plane: one homography, one radial term, a rigid move for each further photo."""
    width, height = views[0].size
    middle, radius = np.array([0.5 * (width - 1), 0.5 * (height - 1)]), 0.5 * float(np.hypot(width, height))
    start, moves = _start(views, middle, radius)
    with_lens = _least_squares(views, np.concatenate([[0.0], start, *moves]), middle, radius, free_lens=True)
    k1, k1_std = float(with_lens.x[0]), float(np.sqrt(with_lens.covariance[0, 0]))
    # A lens term that does not stand out of its own uncertainty would only add its error outside the board.
    use_lens = abs(k1) > settings.lens_sigmas * k1_std
    fit = (
        with_lens
        if use_lens
        else _least_squares(views, with_lens.x * (np.arange(len(with_lens.x)) > 0), middle, radius)
    )
    homography, lens = _plane_parts(fit.x, middle, radius)
    source = f"lens k1 = {k1:+.4f} ± {k1_std:.4f} at half the diagonal" if use_lens else "no lens term needed"
    plane = PlaneMap(homography, lens if use_lens else None)
    return PlaneFit(plane, fit.rms, _scale_std(with_lens, middle, radius), None, source)


def _plane_parts(x: Array, middle: Array, radius: float) -> tuple[Array, Lens]:
    """Homography from pixels and lens, of the parameters of `_least_squares`."""
    homography = np.append(x[1:9], 1.0).reshape(3, 3) @ np.array(
        [[1 / radius, 0, -middle[0] / radius], [0, 1 / radius, -middle[1] / radius], [0, 0, 1]]
    )
    camera = np.array([[radius, 0.0, middle[0]], [0.0, radius, middle[1]], [0.0, 0.0, 1.0]])
    return homography, Lens(camera, np.array([x[0], 0.0, 0.0, 0.0, 0.0]))


def _scale_std(fit: _Solution, middle: Array, radius: float) -> float:
    """Relative standard deviation of the scale in the middle of the picture, by all parameters, the lens among them.

    A board that leaves the middle out, or that hardly tells the lens, tells the scale there by extrapolation: also
    where the lens term is left out for that.
    """

    def logarithm(x: Array) -> float:
        return float(np.log(PlaneMap(*_plane_parts(x, middle, radius)).local_scale(middle[None])[0]))

    steps = 1e-4 * fit.unit * np.eye(len(fit.x))
    slope = np.array([(logarithm(fit.x + step) - logarithm(fit.x - step)) / 2e-4 for step in steps])
    return float(np.sqrt(slope @ fit.covariance @ slope))


@dataclass(frozen=True)
class _Solution:
    """Parameters ``x``, their covariance in units of ``unit``, rms of the residuals in px and their number."""

    x: Array
    unit: Array
    covariance: Array
    rms: float


def _start(views: list[BoardView], middle: Array, radius: float) -> tuple[Array, list[Array]]:
    """Homography of the first photo and rigid moves of the others from matching by it."""
    first = _homography((views[0].uv - middle) / radius, views[0].board_m)
    start = (first / first[2, 2]).ravel()[:8]
    moves = []
    for view in views[1:]:
        plane = _apply(first, (view.uv - middle) / radius)
        a, b = view.board_m - view.board_m.mean(axis=0), plane - plane.mean(axis=0)
        turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
        moves.append(np.array([turn, *(plane.mean(axis=0) - _rotation(turn) @ view.board_m.mean(axis=0))]))
    return start, moves


def _homography(uv: Array, points: Array) -> Array:
    matrix, _ = cv2.findHomography(uv, points)
    if matrix is None or abs(matrix[2, 2]) < 1e-9:
        raise np.linalg.LinAlgError  # on one line or in one point
    return np.asarray(matrix)


def _rotation(turn: float) -> Array:
    return np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])


def _apply(matrix: Array, points: Array) -> Array:
    image = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    return np.asarray(image[:, :2] / image[:, 2:])


def _least_squares(
    views: list[BoardView], start: Array, middle: Array, radius: float, *, free_lens: bool = False
) -> _Solution:
    """Corners against the model, in px; the first parameter is k1, held at its start unless ``free_lens``."""
    size = float(np.ptp(views[0].board_m))
    scale = np.concatenate([[1.0], np.array([size, size, size, size, size, size, 1.0, 1.0])])
    scale = np.concatenate([scale, *[np.array([1.0, size, size])] * (len(views) - 1)])
    free = np.ones(len(start), bool)
    free[0] = free_lens

    def full(q: Array) -> Array:
        x = start / scale
        x[free] = q
        return np.asarray(x * scale)

    def residual(q: Array) -> Array:
        x = full(q)
        to_picture = np.linalg.inv(np.append(x[1:9], 1.0).reshape(3, 3))
        parts = []
        for i, view in enumerate(views):
            points = view.board_m
            if i:
                turn, *shift = x[9 + 3 * (i - 1) : 12 + 3 * (i - 1)]
                points = points @ _rotation(turn).T + shift
            ideal = _apply(to_picture, points)
            shown = ideal * (1.0 + x[0] * (ideal**2).sum(axis=1, keepdims=True))
            parts.append((shown * radius + middle - view.uv).ravel())
        return np.concatenate(parts)

    found = least_squares(residual, (start / scale)[free], x_scale="jac", loss="soft_l1", f_scale=0.5, max_nfev=60)
    error = residual(found.x)
    spare = max(len(error) - len(found.x), 1)
    rms = float(np.sqrt(error @ error / spare))
    covariance = np.zeros((len(start), len(start)))
    slopes = np.asarray(found.jac)
    covariance[np.ix_(free, free)] = np.linalg.pinv(slopes.T @ slopes) * rms**2
    return _Solution(full(found.x), scale, covariance, rms)


def _fit_free_views(views: list[BoardView], settings: CalibrationSettings) -> PlaneFit:
    """Ten or more positions: camera matrix and lens from all, the plane from the first photo."""
    objects = [np.column_stack([v.board_m, np.zeros(len(v.board_m))]).astype(np.float32) for v in views]
    images = [v.uv.astype(np.float32).reshape(-1, 1, 2) for v in views]
    simple = cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_K2 | cv2.CALIB_ZERO_TANGENT_DIST
    fits = [
        cv2.calibrateCamera(objects, images, views[0].size, np.eye(3), np.zeros(5), flags=flags)
        for flags in (simple, cv2.CALIB_FIX_K3)
    ]
    # k2 and the tangential terms run wild outside the board unless the corners really show them.
    drop = (fits[0][0] ** 2 - fits[1][0] ** 2) / fits[1][0] ** 2 * 2 * sum(len(v.uv) for v in views)
    rms, camera, distortion, turns, shifts = fits[1] if drop > settings.lens_sigmas**2 * 3 else fits[0]
    lens = Lens(np.asarray(camera, np.float64), np.asarray(distortion, np.float64).ravel()[:5])
    ideal = lens.undistort(views[0].uv)
    homography = _homography(ideal, views[0].board_m)
    rotation, _ = cv2.Rodrigues(turns[0])
    # The board's z axis points away from or toward the camera; the distance from the plane is the same.
    distance = float(abs(rotation[:, 2] @ np.ravel(shifts[0])))
    spread = float(np.hypot(*np.ptp(views[0].uv, axis=0)))
    std = float(rms) * np.sqrt(8.0 / (2 * len(ideal))) / spread
    # OpenCV counts distances, here as above coordinates.
    return PlaneFit(
        PlaneMap(homography, lens), float(rms) / np.sqrt(2.0), std, distance, f"lens from {len(views)} photos"
    )


def _raise_to_axis(
    fit: PlaneFit, distance_m: float | None, diameter_m: float, settings: CalibrationSettings
) -> tuple[PlaneMap, float, tuple[Finding, ...]]:
    """From the board's surface to the plane of the cable axis, half a diameter above."""
    height = 0.5 * diameter_m
    distance = distance_m if distance_m is not None else fit.distance_m
    if distance is None:
        std = height / settings.usual_distance_m
        text = (
            f"The cable axis lies {1e3 * height:.1f} mm above the board and the camera's distance is unknown; "
            f"up to {100 * std:.1f} % of scale are counted as uncertainty. Give distance_mm in [camera]."
        )
        return fit.plane, std, (Finding("calibration/height", "info", text),)
    factor = 1.0 - height / distance
    homography = np.diag([factor, factor, 1.0]) @ fit.plane.homography
    # the board's thickness and the user's reading of the distance are known to about a third of the height
    return PlaneMap(homography, fit.plane.lens), height / distance / 3.0, ()

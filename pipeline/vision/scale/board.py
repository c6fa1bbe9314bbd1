"""Photos of a chessboard or ChArUco board to the calibration: corners, plane, height of the cable axis above it.

The board lies in the plane on which the cable lies; one photo of it is enough (`pipeline.vision.scale.plane_fit`). Its
corners are found by OpenCV and placed by `pipeline.vision.scale.corners`.

The cable axis lies half a diameter above the board. A ray through the board at (x, y) passes the height h at
``(x, y) + h/Z (foot - (x, y))``, Z the camera's distance from the plane: a change of scale by 1 - h/Z, whatever
the tilt.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.messages import Message
from pipeline.records import Array, Board, CameraSpec, Finding, Rejected, Scale, doubtful, inferred
from pipeline.settings.vision import CalibrationSettings, VisionSettings
from pipeline.vision.photo import Photo, load_photo
from pipeline.vision.scale.calibration import Calibration
from pipeline.vision.scale.corners import refine_corners
from pipeline.vision.scale.plane import PlaneMap, project
from pipeline.vision.scale.plane_fit import BoardView, PlaneFit, fit_views, homography_of

_SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"}
_DICTIONARIES = (
    cv2.aruco.DICT_4X4_1000,
    cv2.aruco.DICT_5X5_1000,
    cv2.aruco.DICT_6X6_1000,
    cv2.aruco.DICT_7X7_1000,
    cv2.aruco.DICT_ARUCO_ORIGINAL,
)
_BOARD_STD = 3e-4  # relative; a printed board measured with a ruler: 0.1 mm on 300 mm
MAX_BORDER_STD = 0.002  # relative, scale at the border against the middle; curvature is off by half of it, 0.1 %
_MAX_BOARD_RMS_PX = 0.5  # px; real boards reach 0.12 to 0.16 px, bent ones do not


def calibrate_by_board(camera: CameraSpec, diameter_m: float, settings: VisionSettings) -> list[Calibration]:
    """Calibrate from the folder of ``camera``: one plane for all photos, or that of each photo.

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
        fits = fit_views(views)
    except (np.linalg.LinAlgError, cv2.error) as error:
        raise InputError(Message("calibration/no-board.plane"), path=camera.calibration) from error
    return [_calibration_of(fit, views, findings, camera, diameter_m, stage) for fit in fits]


def _calibration_of(
    fit: PlaneFit,
    views: list[BoardView],
    read: list[Finding],
    camera: CameraSpec,
    diameter_m: float,
    settings: CalibrationSettings,
) -> Calibration:
    """The calibration by a fitted plane of the board's surface, raised to the axis of the cable."""
    raised, height_std, height_findings = _raise_to_axis(fit, camera.distance_m, diameter_m, settings)
    plane = _magnified(fit.plane, raised)
    uniform = float(np.hypot(_BOARD_STD, height_std))
    source = Message("scale.board", photos=len(views), lens=fit.lens_source)
    middle = 0.5 * np.array([views[0].size], float)
    scale = Scale(float(plane.local_scale(middle)[0]), float(np.hypot(fit.scale_std, uniform)), source)
    findings = list(read)
    if fit.rms_px > _MAX_BOARD_RMS_PX:
        findings.append(doubtful("calibration/residual", rms_px=fit.rms_px))
    if fit.border_std > MAX_BORDER_STD:
        findings.append(doubtful("calibration/border", std=fit.border_std))
    if fit.photo:
        findings.append(inferred("calibration/planes", image=fit.photo))
    aside = tuple(_magnified(other, raised) for other in fit.aside)
    return Calibration(plane, scale, (*findings, *height_findings), uniform, aside)


def _read_views(folder: Path, board: Board, settings: VisionSettings) -> tuple[list[BoardView], list[Finding]]:
    views: list[BoardView] = []
    findings: list[Finding] = []
    for path in sorted(p for p in folder.iterdir() if p.suffix.lower() in _SUFFIXES):
        photo = load_photo(path, settings.photo)
        view = photo if isinstance(photo, Rejected) else find_board(photo, board)
        if isinstance(view, Rejected):
            findings.append(doubtful("calibration/photo", image=view.image, said=view.said))
        else:
            views.append(view)
    if not views:
        raise InputError(Message("calibration/no-board", columns=board.columns, rows=board.rows), path=folder)
    if len({view.size for view in views}) > 1:
        raise InputError(Message("calibration/size"), path=folder)
    return views, findings


def find_board(photo: Photo, board: Board) -> BoardView | Rejected:
    """Corners of the board on a photo, sub-pixel; rejected with ``calibration/no-corners`` if it is not there."""
    grey = cv2.convertScaleAbs(_grey(photo), alpha=255.0 / photo.full_scale)
    factor = max(1, round(max(photo.size) / 2000.0))  # px; corners are refined at full resolution
    reduced = cv2.resize(grey, None, fx=1.0 / factor, fy=1.0 / factor, interpolation=cv2.INTER_AREA)
    small = np.asarray(reduced, np.uint8)
    found = _charuco(small, board) if board.charuco else _chessboard(small, board)
    missing = Rejected(photo.name, Message("calibration/no-corners", columns=board.columns, rows=board.rows))
    if found is None or not _tells_plane(found[0], board):
        return missing
    points, uv = found
    uv = _refined(photo, board, points, uv * factor + 0.5 * (factor - 1))
    clear = np.isfinite(uv[:, 0])
    if not _tells_plane(points[clear], board):
        return missing
    return BoardView(photo.name, points[clear], uv[clear], photo.size)


def _tells_plane(points: Array, board: Board) -> bool:
    """True if the corners span a plane: on one line they tell none, however many there are."""
    if len(points) < 6:
        return False
    spread = np.sqrt(max(float(np.linalg.eigvalsh(np.cov(points, rowvar=False))[0]), 0.0))
    return bool(spread > 0.25 * board.square_m)


def _refined(photo: Photo, board: Board, points: Array, uv: Array) -> Array:
    """Corners ``(n, 2)`` fitted to the photo at its full size and depth, NaN where it shows none."""
    middle, size = uv.mean(axis=0), float(np.ptp(uv))
    to_picture = np.asarray(np.linalg.inv(homography_of((uv - middle) / size, points)), np.float64)
    half = 0.5 * board.square_m * np.eye(2)
    cells = [size * (project(to_picture, points + step) - project(to_picture, points - step)) for step in half]
    marker_share = _marker_m(board) / board.square_m if board.charuco else 0.0
    return refine_corners(_grey(photo), uv, np.stack(cells, axis=-1), marker_share)


def _marker_m(board: Board) -> float:
    return 0.75 * board.square_m if board.marker_m is None else board.marker_m


def _grey(photo: Photo) -> NDArray[Any]:
    return photo.pixels if photo.channels == 1 else np.asarray(cv2.cvtColor(photo.pixels, cv2.COLOR_BGR2GRAY))


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
    best: tuple[Array, Array] | None = None
    for name in _DICTIONARIES:
        dictionary = cv2.aruco.getPredefinedDictionary(name)
        size = (board.columns + 1, board.rows + 1)
        pattern = cv2.aruco.CharucoBoard(size, board.square_m, _marker_m(board), dictionary)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(pattern).detectBoard(grey)
        if ids is not None and (best is None or len(ids) > len(best[0])):
            points = np.asarray(pattern.getChessboardCorners(), np.float64)[np.ravel(ids), :2]
            best = points, np.asarray(corners, np.float64).reshape(-1, 2)
        if best is not None and len(best[0]) > 0.5 * board.columns * board.rows:
            break
    return best


def _magnified(plane: PlaneMap, factor: float) -> PlaneMap:
    return PlaneMap(np.diag([factor, factor, 1.0]) @ plane.homography, plane.lens)


def _raise_to_axis(
    fit: PlaneFit, distance_m: float | None, diameter_m: float, settings: CalibrationSettings
) -> tuple[float, float, tuple[Finding, ...]]:
    """Lengths in the plane of the cable axis, half a diameter above the board's surface, over those seen on that."""
    height = 0.5 * diameter_m
    distance = distance_m if distance_m is not None else fit.distance_m
    if distance is None:
        std = height / settings.usual_distance_m
        return 1.0, std, (inferred("calibration/height", height_m=height, std=std),)
    # the board's thickness and the user's reading of the distance are known to about a third of the height
    return 1.0 - height / distance, height / distance / 3.0, ()

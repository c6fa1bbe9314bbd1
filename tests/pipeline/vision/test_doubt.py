"""Is the band of the curvature wide enough for what a board leaves open of tilt and lens, and a number of the scale?"""

from dataclasses import dataclass

import numpy as np

from pipeline.settings.vision import CalibrationSettings
from pipeline.vision.render import Camera, ChessBoard
from pipeline.vision.scale.calibration import Calibration, from_number, with_doubt_of_plane
from pipeline.vision.scale.plane_fit import USUAL_LENS, fit_views
from tests.pipeline.vision.curves import of_curvature
from tests.pipeline.vision.test_calibration import SQUARE, views_of

STAGE = CalibrationSettings()
CURVE = of_curvature(8.0, 0.18)


@dataclass(frozen=True)
class Shape:
    s: np.ndarray
    kappa: np.ndarray


@dataclass(frozen=True)
class Line:
    """What `with_doubt_of_plane` reads of a centerline, without any error of its own."""

    u_px: np.ndarray
    v_px: np.ndarray
    shape: Shape
    kappa_std: np.ndarray


def arc(camera: Camera) -> Line:
    u, v = camera.project(CURVE.x, CURVE.y)
    return Line(u, v, Shape(CURVE.s, CURVE.kappa), np.zeros(len(CURVE.s)))


def bend(line: Line, calibration: Calibration) -> np.ndarray:
    path = calibration.plane.to_plane(np.column_stack([line.u_px, line.v_px]))
    step = np.gradient(path, line.shape.s, axis=0)
    turn = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    return np.abs(np.gradient(turn) / np.gradient(line.shape.s) / np.hypot(*step.T))[3:-3]


def test_errors_of_a_small_board_are_as_large_as_the_band_says() -> None:
    scores = []
    for seed in range(20):
        rng = np.random.default_rng([12, seed])
        tilt = np.sin(np.radians(rng.uniform(-2.0, 2.0, 2))) / 0.4
        camera = Camera(1300, 640, 5_400.0, k1=float(rng.normal(0.0, USUAL_LENS)), perspective_per_m=tuple(tilt))
        board = ChessBoard(6, 5, SQUARE, (0.06, 0.03), (0.0, 0.0, rng.uniform(-0.05, 0.05)))
        fit = fit_views(views_of(camera, [board], 0.15, seed))[0]
        calibration = Calibration(fit.plane, from_number(5_400.0, STAGE).scale, aside=fit.aside)
        line = arc(camera)
        std = with_doubt_of_plane(line, calibration).kappa_std[3:-3]
        scores.append((bend(line, calibration) - 8.0) / std)
    # errors of one board are alike all along the cable: twenty boards tell their rms to a sixth
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.4
    assert np.mean(np.abs(scores) < 1.96) > 0.85


def test_a_scale_of_a_tenth_of_a_percent_opens_the_band_by_as_much() -> None:
    line = arc(Camera(1300, 640, 5_400.0))
    calibration = from_number(5_400.0, STAGE)
    wider = with_doubt_of_plane(line, calibration).kappa_std
    np.testing.assert_allclose(wider, STAGE.given_scale_std * CURVE.kappa, rtol=1e-9)

"""Scale and plane; truth comes from the camera of the rendered photos, which knows its own geometry exactly."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from pipeline.errors import InputError
from pipeline.messages import Message
from pipeline.records import Board, CameraSpec, LoadStep, Rejected, RigSpec, Scale, Specimen
from pipeline.settings.vision import CalibrationSettings, VisionSettings
from pipeline.vision.bearings.steady import moved_axes
from pipeline.vision.photo import Photo
from pipeline.vision.render import Camera, ChessBoard, Ground, Scene, Sensor, Strand, render_board
from pipeline.vision.rough import Bearing, RoughCable
from pipeline.vision.scale.board import MAX_BORDER_STD, calibrate_by_board, find_board
from pipeline.vision.scale.calibration import (
    Calibration,
    axis_parallax_std,
    check_scale,
    from_found,
    from_number,
    in_plane_of_cable,
)
from pipeline.vision.scale.corners import refine_corners
from pipeline.vision.scale.plane import Lens, PlaneMap
from pipeline.vision.scale.plane_fit import BoardView, fit_views
from tests.pipeline.vision.curves import of_curvature

STAGE = CalibrationSettings()
SETTINGS = VisionSettings()
CURVE = of_curvature(5.0, 0.18)
SQUARE = 0.010
BOARD = Board(13, 7, SQUARE)


def grid(camera: Camera) -> np.ndarray:
    """Pixels spread over the inner nine tenths of the picture."""
    u, v = np.meshgrid(np.linspace(0.05, 0.95, 12) * camera.width, np.linspace(0.05, 0.95, 8) * camera.height)
    return np.column_stack([u.ravel(), v.ravel()])


def shape_error(plane: PlaneMap, camera: Camera, *, height_m: float = 0.0) -> float:
    """Largest distance (m) between mapped and true points after the best rigid move: no scale is fitted."""
    uv = grid(camera)
    true = np.column_stack(camera.plane(uv[:, 0], uv[:, 1], height_m=height_m))
    found = plane.to_plane(uv)
    a, b = true - true.mean(axis=0), found - found.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    return float(np.hypot(*(b - a @ left @ right).T).max())


def board_photo(folder: Path, camera: Camera, board: ChessBoard, name: str = "board.png") -> None:
    scene = Scene(Strand(CURVE), camera, sensor=Sensor(blur_px=0.8, noise=0.01), ground=Ground(colour=(0.5, 0.5, 0.5)))
    assert cv2.imwrite(str(folder / name), render_board(scene, board))


def test_plain_scale_maps_and_inverts() -> None:
    plane = PlaneMap.from_scale(8_000.0)
    np.testing.assert_allclose(plane.to_plane(np.array([[800.0, -400.0]])), [[0.1, -0.05]], rtol=1e-12)
    np.testing.assert_allclose(plane.to_pixels(np.array([[0.1, -0.05]])), [[800.0, -400.0]], rtol=1e-12)
    np.testing.assert_allclose(plane.local_scale(np.array([[3.0, 4.0]])), [8_000.0], rtol=1e-9)


def test_lens_and_homography_invert_each_other_to_rounding() -> None:
    lens = Lens(np.array([[900.0, 0, 640], [0, 900, 480], [0, 0, 1]]), np.array([-0.12, 0.03, 1e-3, -5e-4, 0.0]))
    plane = PlaneMap(np.array([[1e-4, 2e-6, 0.01], [-1e-6, 1.1e-4, 0.0], [1e-5, -2e-5, 1.0]]), lens)
    uv = np.array([[10.0, 20.0], [640.0, 480.0], [1200.0, 900.0]])
    np.testing.assert_allclose(plane.to_pixels(plane.to_plane(uv)), uv, rtol=0, atol=1e-9)  # px, of 1200


def test_jacobian_is_the_derivative_of_the_map() -> None:
    plane = PlaneMap(np.array([[1e-4, 0, 0], [0, 1e-4, 0], [2e-5, 1e-5, 1.0]]))
    at = np.array([[500.0, 300.0]])
    step = 1e-3
    for axis in range(2):
        move = step * np.eye(2)[axis]
        slope = (plane.to_plane(at + move) - plane.to_plane(at - move)) / (2 * step)
        # roundings of 0.05 m over a step of 2e-3 px are 3e-14 m/px, a hundred-millionth of the smallest entry
        np.testing.assert_allclose(plane.jacobian(at)[0, :, axis], slope[0], rtol=1e-7)


@pytest.mark.parametrize(
    ("tilt_deg", "k1", "columns"), [(0.0, 0.0, 13), (2.0, 0.0, 13), (2.0, -0.01, 19), (0.0, 0.01, 19)]
)
def test_one_board_photo_takes_tilt_and_distortion_away(
    tmp_path: Path, tilt_deg: float, k1: float, columns: int
) -> None:
    distance = 0.4
    camera = Camera(1200, 600, 5_400.0, k1=k1, perspective_per_m=(np.sin(np.radians(tilt_deg)) / distance, 0.0))
    camera = replace(camera, distance_m=distance)
    board_photo(tmp_path, camera, ChessBoard(columns, 9, SQUARE))
    spec = CameraSpec(calibration=tmp_path, board=Board(columns, 9, SQUARE), distance_m=1e9)
    calibration = calibrate_by_board(spec, 0.005, SETTINGS)[0]
    # Uncorrected, 1 % of distortion is 1 mm at the border and 2 degrees are 8 mm. A hundred corners to 0.008 px
    # leave 0.2 um, 5 um at the rim of the picture, which no corner reaches, where the lens counts six times.
    assert 1e6 * shape_error(calibration.plane, camera) < 5.0
    true_scale = 5_400.0
    assert abs(calibration.scale.px_per_m / true_scale - 1.0) < 3.0 * calibration.scale.std_relative


def test_scale_of_the_axis_above_the_board_is_corrected_by_the_camera_distance(tmp_path: Path) -> None:
    distance, diameter = 0.4, 0.006
    camera = Camera(1100, 600, 5_000.0, distance_m=distance, perspective_per_m=(0.03, 0.02))
    # the board lies on the table, the camera's scale is that of the cable axis, half a diameter above
    board_photo(tmp_path, camera, ChessBoard(13, 7, SQUARE, height_m=-0.5 * diameter))
    spec = CameraSpec(calibration=tmp_path, board=BOARD, distance_m=distance + 0.5 * diameter)
    raised = calibrate_by_board(spec, diameter, SETTINGS)[0]
    assert 1e6 * shape_error(raised.plane, camera) < 5.0  # as in the plane of the board, above
    flat = calibrate_by_board(replace(spec, distance_m=None), diameter, SETTINGS)[0]
    # without the distance the scale is off by h / Z = 0.75 %, 0.8 mm at a corner 0.11 m from the middle, and says so
    assert 1e6 * shape_error(flat.plane, camera) > 0.0075 * 0.1e6
    assert flat.scale.std_relative > 0.5 * 0.5 * diameter / distance  # told for the usual distance, twice this one
    assert [finding.code for finding in flat.findings] == ["calibration/height"]


def test_charuco_board_is_found_whatever_its_dictionary(tmp_path: Path) -> None:
    for name in (cv2.aruco.DICT_4X4_50, cv2.aruco.DICT_5X5_250):
        dictionary = cv2.aruco.getPredefinedDictionary(name)
        pattern = cv2.aruco.CharucoBoard((12, 8), SQUARE, 0.7 * SQUARE, dictionary)
        # 40 px a square and a white border of 50 px: the picture itself is the photo, at 4000 px/m
        sheet = pattern.generateImage((12 * 40, 8 * 40))
        assert cv2.imwrite(
            str(tmp_path / "board.png"), cv2.copyMakeBorder(sheet, *[50] * 4, cv2.BORDER_CONSTANT, value=255)
        )
        spec = CameraSpec(
            calibration=tmp_path, board=Board(11, 7, SQUARE, charuco=True, marker_m=0.7 * SQUARE), distance_m=1e9
        )
        calibration = calibrate_by_board(spec, 0.005, SETTINGS)[0]
        assert calibration.scale.px_per_m == pytest.approx(4_000.0, rel=2.5e-5)  # 0.01 px on the 400 px of the board


@pytest.mark.parametrize("charuco", [False, True])
def test_corners_are_placed_as_well_as_the_noise_allows(charuco: bool) -> None:
    """The limit of an edge (module docstring of corners) for 2 % of noise on a step of 84 % and 2 x 17 px of edge."""
    camera = Camera(900, 600, 4_200.0, k1=-0.01, perspective_per_m=(0.08, -0.05), look_at_m=(0.09, 0.03))
    board = ChessBoard(9, 6, SQUARE, rotation=(0.0, 0.0, 0.2))
    scene = Scene(Strand(CURVE), camera, sensor=Sensor(blur_px=1.0, noise=0.02), ground=Ground(colour=(0.5, 0.5, 0.5)))
    grey = render_board(scene, board).astype(float)
    grey = grey if grey.ndim == 2 else grey.mean(axis=2)
    truth = board.corners(camera)
    near = truth + np.random.default_rng(4).uniform(-1.5, 1.5, truth.shape)  # as far as a reduced picture leaves them
    turn = np.array([[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]])
    cells = np.broadcast_to(42.0 * turn, (len(truth), 2, 2))
    # beside markers of 0.6 squares only a cross along the edges is read
    found = refine_corners(grey, near, cells, 0.6 if charuco else 0.0)
    limit = 0.02 / 0.84 * np.sqrt(2.0 * np.sqrt(np.pi) * np.hypot(1.0, 0.29) / (2.0 * 17.0))
    # a third more: blur, directions and light are fitted from the same pixels, and the edges fade at the corner
    assert np.sqrt(np.mean((found - truth) ** 2)) < 1.33 * limit
    assert np.abs(found - truth).max() < 5.0 * limit  # four standard deviations: one in 10,000 numbers


def test_no_corner_is_made_up_where_there_is_none() -> None:
    grey = 100.0 + 3.0 * np.random.default_rng(1).standard_normal((80, 120))
    grey[:, 60:] += 80.0  # one edge, not two
    cells = np.broadcast_to(20.0 * np.eye(2), (3, 2, 2))
    places = np.array([[30.0, 40.0], [60.0, 40.0], [500.0, 40.0]])  # ground, edge, outside
    assert np.isnan(refine_corners(grey, places, cells)).all()


def test_small_board_says_that_it_does_not_tell_the_border(tmp_path: Path) -> None:
    camera = Camera(1200, 620, 5_400.0, k1=-0.01)
    told = [fit_views(views_of(camera, [ChessBoard(*size, SQUARE)], 0.1, 1))[0] for size in ((6, 4), (19, 9))]
    assert told[0].border_std > MAX_BORDER_STD > told[1].border_std
    board_photo(tmp_path, camera, ChessBoard(4, 3, 0.006, (0.03, 0.01)))
    spec = CameraSpec(calibration=tmp_path, board=Board(4, 3, 0.006), distance_m=1e9)
    calibration = calibrate_by_board(spec, 0.005, SETTINGS)[0]
    assert [finding.code for finding in calibration.findings] == ["calibration/border"]


def views_of(camera: Camera, poses: list[ChessBoard], noise_px: float, seed: int) -> list[BoardView]:
    rng = np.random.default_rng(seed)
    views = []
    for i, board in enumerate(poses):
        corners = board.corners(camera)
        a, b = np.meshgrid(np.arange(board.columns) * board.square_m, np.arange(board.rows) * board.square_m)
        points = np.column_stack([a.ravel(), b.ravel()])
        noisy = corners + noise_px * rng.standard_normal(corners.shape)
        views.append(BoardView(f"{i}", points, noisy, (camera.width, camera.height)))
    return views


def test_several_photos_in_the_plane_share_one_fit() -> None:
    camera = Camera(2000, 1000, 9_000.0, k1=-0.01, perspective_per_m=(0.05, -0.04))
    poses = [ChessBoard(7, 5, SQUARE, (x, y), (0, 0, turn)) for x, y, turn in ((0.04, 0.03, 0.1), (0.14, 0.03, -0.4))]
    errors = [shape_error(fit_views(views_of(camera, poses[:n], 0.1, 3))[0].plane, camera) for n in (1, 2)]
    # 0.1 px are 11 um: two boards hold all of the picture to three times the error of a corner, one small board at the
    # left tells little about the right half of it.
    assert 1e6 * errors[1] < 33.0
    assert errors[1] < 0.5 * errors[0]


def test_scale_by_one_photo_is_as_sure_as_it_says() -> None:
    scores = []
    for seed in range(20):
        rng = np.random.default_rng([8, seed])
        tilt = np.sin(np.radians(rng.uniform(-2.0, 2.0, 2))) / 0.4
        camera = Camera(1200, 620, 5_400.0, k1=float(rng.choice([-0.01, 0.0, 0.01])), perspective_per_m=tuple(tilt))
        board = ChessBoard(int(rng.integers(7, 15)), 7, SQUARE, (0.02, 0.02), (0.0, 0.0, rng.uniform(-0.05, 0.05)))
        fit = fit_views(views_of(camera, [board], float(rng.uniform(0.05, 0.2)), seed))[0]
        middle = 0.5 * np.array([camera.width, camera.height])
        about = middle + np.array([[2.0, 0.0], [-2.0, 0.0], [0.0, 2.0], [0.0, -2.0]])
        x, y = camera.plane(about[:, 0], about[:, 1])
        area = abs((x[0] - x[1]) * (y[2] - y[3]) - (x[2] - x[3]) * (y[0] - y[1])) / 16.0
        scores.append((fit.plane.local_scale(middle[None])[0] * np.sqrt(area) - 1.0) / fit.scale_std)
    # True stds give 0.7 to 1.3 rms; smaller where a lens term is left out rightly, and counted all the same.
    assert 0.3 < np.sqrt(np.mean(np.square(scores))) < 1.4
    assert np.max(np.abs(scores)) < 3.5  # beyond it lies one lot of twenty in a hundred


def test_ten_positions_give_the_lens_and_the_camera_distance() -> None:
    camera = Camera(2000, 1200, 5_000.0, k1=-0.02, distance_m=0.45)
    rng = np.random.default_rng(5)
    poses = [ChessBoard(13, 7, SQUARE)]
    poses += [
        ChessBoard(
            13, 7, SQUARE, tuple((0.09, 0.03) + 0.03 * rng.uniform(-1, 1, 2)), tuple(0.5 * rng.uniform(-1, 1, 3))
        )
        for _ in range(11)
    ]
    fit = fit_views(views_of(camera, poses, 0.1, 7))[0]
    # foreshortening is about a fifth of 600 px of board: 0.1 px tell it to a thousandth, by a single corner
    assert fit.distance_m == pytest.approx(0.45, rel=1e-3)
    assert fit.rms_px == pytest.approx(0.1, rel=0.065)  # 2184 numbers tell it to 1.5 %: three of those, and 77 fitted
    assert 1e6 * shape_error(fit.plane, camera) < 200.0  # 0.05 % of the picture's 0.4 m, the boards leave the rim out


def test_few_positions_tell_the_lens_and_the_cable_tells_which_plane_is_its_own() -> None:
    """Three tilted boards and one in the plane of the cable, taken for one plane, put the scale 12 % off."""
    camera = Camera(2000, 1200, 5_000.0, k1=-0.02, distance_m=0.45)
    tilts = [(0.2, -0.1, 0.1), (-0.15, 0.2, -0.2), (0.1, 0.25, 0.05), (0.0, 0.0, 0.0)]
    poses = [ChessBoard(13, 7, SQUARE, (0.05, 0.03), tilt) for tilt in tilts]
    planes = [
        Calibration(fit.plane, Scale(5_000.0, fit.scale_std, Message("scale.number")))
        for fit in fit_views(views_of(camera, poses, 0.1, 7))
    ]
    assert len(planes) == 4
    travel = np.array([0.0, 0.01, 0.02, 0.03])
    ends = [camera.project([0.1 + d, 0.28], [0.12, 0.12])[0] for d in travel]  # along the middle of the picture
    cables = [found(left, right, middle=600.0) for left, right in ends]
    best = in_plane_of_cable(planes, specimen(length_m=0.165), cables, travel, STAGE)  # the middle one of the four
    assert best.plane is planes[3].plane
    assert 1e6 * shape_error(best.plane, camera) < 200.0  # as with ten positions


@pytest.mark.parametrize("k1", [-0.05, 0.05])
def test_travel_and_length_are_seen_through_the_lens(k1: float) -> None:
    """Along the picture such a lens shows a metre up to 15 % shorter or longer than in its middle."""
    camera = Camera(2000, 600, 5_000.0, k1=k1, distance_m=0.45)
    poses = [ChessBoard(13, 7, SQUARE, (0.13, 0.02), tilt) for tilt in [(0.0, 0.0, 0.0), (0.2, -0.1, 0.1), (0, 0.2, 0)]]
    planes = [
        Calibration(fit.plane, Scale(5_000.0, fit.scale_std, Message("scale.number")))
        for fit in fit_views(views_of(camera, poses, 0.05, 8))
    ]

    def seen(x: tuple[float, float]) -> RoughCable:
        u, v = camera.project(np.linspace(*x, 100), np.full(100, 0.11))
        left, right = (Bearing((float(u[k]), float(v[k])), 0.02, None, None, "given") for k in (0, -1))
        cable = replace(found(0.0, 1.0), path_px=np.column_stack([u, v]), visible=(0, 99))
        return replace(cable, left=left, right=right)

    first = seen((0.01, 0.39))
    assert in_plane_of_cable(planes, specimen(length_m=0.38), [first], np.zeros(1), STAGE).plane is planes[0].plane
    axes = (first.left.center_px, first.right.center_px)
    (u, v), fixed = moved_axes(axes, "left", 0.05, planes[0].plane)
    assert fixed == axes[1]
    # px; what the lens is known to: unmoved places of the picture are drawn to a tenth of that by the same boards
    assert np.hypot(*np.subtract((u, v), seen((0.06, 0.39)).left.center_px)) < 1.0


def test_positions_in_one_plane_give_no_distance() -> None:
    camera = Camera(2000, 1200, 6_000.0, distance_m=0.45)
    poses = [ChessBoard(9, 6, SQUARE, (0.06 + 0.005 * i, 0.03), (0.0, 0.0, 0.2 * i)) for i in range(11)]
    assert fit_views(views_of(camera, poses, 0.1, 2))[0].distance_m is None


def test_folder_without_a_board_is_the_users_error(tmp_path: Path) -> None:
    assert cv2.imwrite(str(tmp_path / "a.png"), np.full((300, 400), 128, np.uint8))
    with pytest.raises(InputError, match="13 x 7 inner corners") as raised:
        calibrate_by_board(CameraSpec(calibration=tmp_path, board=BOARD), 0.005, SETTINGS)
    assert raised.value.code == "calibration/no-board"


def test_corners_that_tell_no_plane_are_the_users_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    board_photo(tmp_path, Camera(1100, 600, 5_000.0), ChessBoard(13, 7, SQUARE))
    seen = BoardView("board.png", np.mgrid[:13, :7].T.reshape(-1, 2) * SQUARE, np.full((91, 2), 300.0), (1100, 600))
    monkeypatch.setattr("pipeline.vision.scale.board.find_board", lambda *_: seen)
    with pytest.raises(InputError, match="no plane follows") as raised:
        calibrate_by_board(CameraSpec(calibration=tmp_path, board=BOARD), 0.005, SETTINGS)
    assert raised.value.code == "calibration/no-board"


def test_corners_on_one_line_are_no_board(monkeypatch: pytest.MonkeyPatch) -> None:
    line = np.column_stack([np.arange(8) * SQUARE, np.zeros(8)])
    monkeypatch.setattr("pipeline.vision.scale.board._charuco", lambda *_: (line, 4_000.0 * line))
    photo = Photo("a.png", np.full((300, 400), 128, np.uint8), 8)
    found = find_board(photo, Board(11, 7, SQUARE, charuco=True))
    assert isinstance(found, Rejected) and found.code == "calibration/no-corners"


def test_unreadable_calibration_photo_is_a_finding(tmp_path: Path) -> None:
    board_photo(tmp_path, Camera(1100, 600, 5_000.0), ChessBoard(13, 7, SQUARE))
    (tmp_path / "empty.jpg").write_bytes(b"")
    spec = CameraSpec(calibration=tmp_path, board=BOARD, distance_m=1.0)
    calibration = calibrate_by_board(spec, 0.005, SETTINGS)[0]
    assert [f.code for f in calibration.findings] == ["calibration/photo"]
    assert "empty.jpg" in calibration.findings[0].message


def found(left: float, right: float, radius: float | None = None, std: float = 0.02, middle: float = 0.0) -> RoughCable:
    """A cable whose axes lie at the given u and at v ``middle``; only what calibration reads is filled."""
    path = np.column_stack([np.linspace(left, right, 50), np.full(50, middle)])
    bearings = [Bearing((u, middle), std, radius, 0.02 if radius else None) for u in (left, right)]
    grey = np.zeros((1, 1), np.float32)
    return RoughCable("a", path, (0, 49), *bearings, 20.0, grey, (0, 0), True, 0.5, 1.0)


def specimen(*, marker_m: float | None = 0.012, length_m: float = 0.18) -> Specimen:
    step = LoadStep(0, "loading", 0.0, 0.0, 0.0, None, np.empty(0), np.empty(0), None)
    rig = RigSpec(marker_diameter_m=marker_m)
    return Specimen("a", Path(), length_m, 0.005, CameraSpec(), rig, (step,), {})


def test_scale_by_travel_against_the_log() -> None:
    scale, travel = 9_500.0, np.array([0.0, 0.004, 0.008, 0.012])
    rng = np.random.default_rng(2)
    cables = [found(200 + scale * d + 0.02 * rng.standard_normal(), 1900.0) for d in travel]
    flat = STAGE.model_copy(update={"usual_distance_m": 1e6})
    calibration = from_found(specimen(marker_m=None), cables, travel, flat)
    assert calibration is not None
    assert calibration.scale.source.key == "scale.travel"
    std = calibration.scale.std_relative
    assert abs(calibration.scale.px_per_m - scale) < 3.0 * std * scale
    # of a line through the axes against the travel; two axes of 0.02 px each, the scale found stands for the true one
    about = travel - travel.mean()
    assert std == pytest.approx(np.sqrt(2.0) * 0.02 / (scale * np.sqrt(about @ about)), rel=1e-3)
    # covers move nearer to the camera than the cable does
    high = from_found(specimen(marker_m=None), cables, travel, STAGE)
    assert high is not None
    parallax = axis_parallax_std(specimen(), cables, STAGE)
    assert high.scale.std_relative == pytest.approx(np.hypot(std, parallax), rel=1e-4)  # what is left of it in `flat`


def test_covers_stand_above_the_cable_unless_the_axes_were_pointed_at() -> None:
    covers = [found(200, 1900, 57.0)]
    assert axis_parallax_std(specimen(), covers, STAGE) == pytest.approx(
        (2.5e-3 + 1e-3) / 0.8
    )  # half a cable and a lid
    near = replace(specimen(), camera=CameraSpec(distance_m=0.5))
    assert axis_parallax_std(near, covers, STAGE) == pytest.approx(7e-3)
    for kind in ("given", "end"):
        seen = [replace(c, left=replace(c.left, kind=kind), right=replace(c.right, kind=kind)) for c in covers]
        assert axis_parallax_std(specimen(), seen, STAGE) == 0.0


def test_scale_by_covers_where_nothing_moved() -> None:
    calibration = from_found(specimen(), [found(200, 1900, 57.0)], np.array([0.0]), STAGE)
    assert calibration is not None
    assert calibration.scale.px_per_m == pytest.approx(2 * 57.0 / 0.012)
    assert calibration.scale.source.key == "scale.covers"


def test_scale_by_the_length_where_nothing_else_tells() -> None:
    calibration = from_found(specimen(marker_m=None), [found(200, 1910)], np.array([0.0]), STAGE)
    assert calibration is not None
    assert calibration.scale.px_per_m == pytest.approx(1710 / 0.18)
    assert calibration.scale.std_relative == STAGE.length_scale_std
    assert from_found(specimen(), [], np.empty(0), STAGE) is None


@pytest.mark.parametrize(("error", "codes"), [(0.0, []), (0.002, []), (0.03, ["scale/covers", "scale/displacement"])])
def test_wrong_scale_is_found_by_covers_and_travel(error: float, codes: list[str]) -> None:
    true, travel = 9_500.0, np.array([0.0, 0.005, 0.010])
    cables = [found(200 + true * d, 1900.0, 0.006 * true) for d in travel]
    calibration = from_number(true * (1 + error), STAGE)
    findings = check_scale(specimen(), calibration, cables, travel, STAGE)
    assert [finding.code for finding in findings] == codes
    assert all("-2.9" in finding.message for finding in findings)


@pytest.mark.parametrize(("error", "level"), [(0.0, "info"), (0.05, "warning")])
def test_covers_of_another_width_than_given_speak_against_no_scale_that_travel_confirms(
    error: float, level: str
) -> None:
    true, travel = 9_500.0, np.array([0.0, 0.005, 0.010])
    cables = [found(200 + true * d, 1900.0, 0.95 * 0.006 * true) for d in travel]  # domes: the rim seen is 5 % narrower
    cable = specimen(length_m=(1700.0 - 0.005 * true) / true)  # as long as on the middle one of the photos
    findings = check_scale(cable, from_number(true * (1 + error), STAGE), cables, travel, STAGE)
    covers = next(finding for finding in findings if finding.code == "scale/covers")
    assert covers.level == level
    assert ("95.0 % as wide" in covers.message) == (level == "info")

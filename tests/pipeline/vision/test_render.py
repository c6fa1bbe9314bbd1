"""The renderer against closed forms: moments of its pictures, inverse maps, exact boards. Nothing is traced here."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, inf, pi, sin, sqrt

import cv2
import numpy as np
import pytest

from fixtures.grounds import cloth, squared, stone, wood
from fixtures.things import Thing
from fixtures.turned import turned_jpeg
from pipeline.vision.render import Cover, Ground, Scene, Sensor, Strand, render, render_board
from pipeline.vision.render.clutter import ChessBoard
from pipeline.vision.render.ground import Texture
from pipeline.vision.render.lens import Camera
from pipeline.vision.render.lighting import DIRECTIONAL, Light, cylinder
from pipeline.vision.render.sensor import encode
from pipeline.vision.render.sheath import Sheath
from pipeline.vision.render.strand import half_plane
from tests.pipeline.vision.curves import of_curvature

# A black cable on a white sheet, without noise: what is dark is coverage and nothing else.
LEVEL = 60_000  # a white that 16 bits hold exactly: half a count over 300 px moves a first moment by 4e-3 px
SHEET = Light(ambient=0.0, strength=LEVEL / 65_535)
INK = Sheath(colour=(0.0, 0.0, 0.0))
WHITE = Ground("plain", (1.0, 1.0, 1.0))


def darkness(cable: Strand, camera: Camera, blur_px: float) -> np.ndarray:
    sensor = Sensor(blur_px=blur_px, noise=0.0, bit_depth=16)
    scene = Scene(cable, camera, covers=(None, None), light=SHEET, ground=WHITE, sensor=sensor)
    return 1.0 - render(scene).pixels / LEVEL


@pytest.mark.parametrize("roll", [0.0, 0.003, 0.1, 0.5, pi / 4 - 0.01])
@pytest.mark.parametrize("shift", [0.0, 0.21, 0.5])
@pytest.mark.parametrize("blur", [0.6, 0.8, 2.0])
def test_straight_bar_has_the_midline_and_width_of_its_formula(roll: float, shift: float, blur: float) -> None:
    camera = Camera(300, 300, 1000.0, look_at_m=(0.1, shift / 1000), roll_rad=roll)
    mask = darkness(Strand(of_curvature(0.0, 0.2), 0.0203, INK, overhang_m=0.3), camera, blur)
    columns = slice(80, 220)
    moment = (mask * np.arange(300)[:, None]).sum(0)[columns] / mask.sum(0)[columns]
    # The axis lies `shift` px from the middle, against the rolled v axis (-sin, cos).
    u = np.arange(300)[columns] - 149.5 - shift * sin(roll)
    exact = 149.5 - shift * cos(roll) + u * np.tan(roll)
    # 16 bits: 0.5/65535 a pixel at arms of 20 px; aliases of a 0.67 px edge (blur and pixel): 2e-4 px.
    assert np.abs(moment - exact).max() < 5e-4
    assert mask.sum(0)[columns] == pytest.approx(20.3 / cos(roll), abs=2e-3)


@pytest.mark.parametrize(("radius_px", "width_px"), [(900.0, 48.3), (120.0, 21.0), (60.0, 10.4)])
def test_circular_cable_has_the_midline_of_its_circle(radius_px: float, width_px: float) -> None:
    scale, blur = 10_000.0, 0.8
    kappa = scale / radius_px
    curve = of_curvature(kappa, 2.0 / kappa)
    camera = Camera(900, 400, scale, look_at_m=(0.5 * curve.chord, float(curve.y.max()) - 0.005), mirrored=True)
    mask = darkness(Strand(curve, width_px / scale, INK), camera, blur)
    cu, cv = (float(a) for a in camera.project(0.5 * curve.chord, curve.y.max() - 1 / kappa))
    u = np.arange(900)[np.abs(np.arange(900) - cu) < min(0.4 * radius_px, 300)]
    moment = (mask * np.arange(400)[:, None]).sum(0)[u] / mask.sum(0)[u]
    # Closed form: column area and moment between two circles, averaged over lens and pixel (Gauss-Hermite).
    nodes, weights = np.polynomial.hermite_e.hermegauss(7)
    at = u[:, None] - cu + sqrt(blur**2 + 1 / 12) * nodes
    outer, inner = (np.sqrt((radius_px + h) ** 2 - at**2) for h in (width_px / 2, -width_px / 2))
    exact = cv - 0.5 * ((outer**2 - inner**2) @ weights) / ((outer - inner) @ weights)
    assert np.abs(moment - exact).max() < 1e-3


def test_covered_part_of_a_pixel_is_the_area_beside_a_line() -> None:
    rng = np.random.default_rng(1)
    angle, distance = rng.uniform(0, 2 * pi, 200), rng.uniform(-0.8, 0.8, 200)
    gradient = np.stack([np.cos(angle), np.sin(angle)])
    x = (np.arange(400) + 0.5) / 400 - 0.5
    side = distance[:, None, None] + gradient[0, :, None, None] * x[:, None] + gradient[1, :, None, None] * x
    # Counting 400 x 400 points errs by about the border's length over the spacing, 1/400, times 1/sqrt(12 * 400).
    assert half_plane(distance, gradient) == pytest.approx((side > 0).mean((1, 2)), abs=2e-3)
    corner = half_plane(np.array([-0.5]), np.array([[sqrt(0.5)], [sqrt(0.5)]]))
    leg = sqrt(2) * (sqrt(0.5) - 0.5)
    assert corner[0] == pytest.approx(leg**2 / 2, rel=1e-12)


def test_curve_of_constant_curvature_is_a_circle() -> None:
    curve = of_curvature(8.0, 0.2)
    assert curve.chord == pytest.approx(2 / 8.0 * sin(0.8), rel=1e-13)
    assert curve.y.max() == pytest.approx((1 - cos(0.8)) / 8.0, rel=1e-12)
    assert curve.theta[0] == pytest.approx(0.8, rel=1e-12)


CAMERAS = [
    Camera(),
    Camera(roll_rad=0.3, mirrored=True, k1=-0.03),
    Camera(k1=0.05, perspective_per_m=(0.09, -0.04)),
    Camera(k1=-0.05, perspective_per_m=(0.06, 0.03), distance_m=0.5).turned(1),
]


@pytest.mark.parametrize("camera", CAMERAS)
def test_camera_maps_are_inverse(camera: Camera) -> None:
    X, Y = np.meshgrid(np.linspace(0.0, 0.18, 7), np.linspace(-0.01, 0.07, 5))
    for height in (0.0, -0.002):
        u, v = camera.project(X, Y, height_m=height)
        back = camera.plane(u, v, height_m=height)
        assert np.hypot(back[0] - X, back[1] - Y).max() < 1e-14


def test_camera_keeps_its_word() -> None:
    camera = Camera(1000, 800, 5000.0, look_at_m=(0.02, 0.01), k1=-0.04)
    half = camera.half_diagonal_px
    assert half == pytest.approx(hypot(500, 400))
    u, v = camera.distort(half, 0.0)
    assert u == pytest.approx(499.5 + 0.96 * half) and v == pytest.approx(399.5)
    # True tilt: seen at 30 degrees from 0.5 m, a point 0.1 m up the slope. Pinhole by hand.
    tilted = Camera(1000, 800, 5000.0, look_at_m=(0.0, 0.0), perspective_per_m=(sin(0.5) / 0.5, 0.0), distance_m=0.5)
    u, _ = tilted.project(0.1, 0.0)
    assert u - 499.5 == pytest.approx(5000 * 0.5 * 0.1 * cos(0.5) / (0.5 + 0.1 * sin(0.5)))
    # A plane 5 mm below the axis looks smaller by D / (D + h).
    near = Camera(1000, 800, 5000.0, look_at_m=(0.0, 0.0), distance_m=0.4)
    assert near.project(0.05, 0.0, height_m=-0.005)[0] - 499.5 == pytest.approx(250 * 0.4 / 0.405)
    with pytest.raises(ValueError, match="folds"):
        Camera(k1=-0.4)


def test_truth_is_the_camera_of_the_curve() -> None:
    curve = of_curvature(lambda s: 2 + 7 * np.sin(pi * s / 0.18), 0.18)
    cable = Strand(curve, place_m=(0.01, 0.005), angle_rad=0.1)
    picture = render(Scene(cable, Camera(1200, 600, 5000.0, mirrored=True), sensor=Sensor(noise=0.0)))
    scale = 5000.0
    X = 0.01 + cos(0.1) * curve.x - sin(0.1) * curve.y
    Y = 0.005 + sin(0.1) * curve.x + cos(0.1) * curve.y
    assert picture.u_px == pytest.approx(599.5 + scale * (X - 0.09), abs=1e-9)
    assert picture.v_px == pytest.approx(299.5 - scale * (Y - 0.03), abs=1e-9)
    assert picture.left_px == (picture.u_px[0], picture.v_px[0])
    assert picture.right_px == (picture.u_px[-1], picture.v_px[-1])


def test_cover_is_a_disc_on_the_axis() -> None:
    camera = Camera(300, 200, 5000.0, look_at_m=(0.0123, 0.0004), distance_m=inf)
    cable = Strand(of_curvature(1.0, 0.02), 0.001, INK)
    cover = Cover(0.008, (0.0, 0.0, 0.0), dot_m=0.0, sheen=0.0)
    scene = Scene(cable, camera, (cover, None), SHEET, WHITE, sensor=Sensor(blur_px=0.8, noise=0.0, bit_depth=16))
    both = 1.0 - render(scene).pixels / LEVEL
    left = both[:, :80]  # the disc spans columns 68 to 108: its left part, a segment, has a closed form
    u0, v0 = render(scene).left_px
    v = np.arange(200)[:, None]
    assert (left * v).sum() / left.sum() == pytest.approx(v0, abs=1e-3)
    column = 74
    half = sqrt(20.0**2 - (column - u0) ** 2)
    # Blur lowers a chord by its curvature, 20^2/half^3 (0.8^2 + 1/12) / 2.
    assert both[:, column].sum() == pytest.approx(2 * half - 400 / half**3 * (0.64 + 1 / 12), rel=3e-3)


def test_chessboard_photo_shows_the_exact_corners() -> None:
    camera = Camera(1200, 700, 5000.0, k1=-0.02, roll_rad=0.03, perspective_per_m=(0.05, 0.02), distance_m=0.5)
    scene = Scene(Strand(of_curvature(1.0, 0.1)), camera, sensor=Sensor(blur_px=0.8, noise=0.003))
    board = ChessBoard(11, 6, 0.012, place_m=(0.088, 0.032), rotation=(0.1, -0.05, 0.02), height_m=-0.0023)
    found, corners = cv2.findChessboardCorners(render_board(scene, board), (11, 6))
    assert found
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-4)
    fine = cv2.cornerSubPix(render_board(scene, board), corners, (9, 9), (-1, -1), criteria).reshape(-1, 2)
    exact = board.corners(camera)
    exact = exact if np.hypot(*(fine[0] - exact[0])) < 5 else exact[::-1]
    off = fine - exact
    assert np.abs(off.mean(0)).max() < 0.01  # 66 corners of that scatter: three standard errors
    assert np.sqrt((off**2).sum(1).mean()) < 0.05  # OpenCV's own corners scatter by 0.02 to 0.04 px at this noise
    with pytest.raises(ValueError, match="finite"):
        board.corners(replace(camera, distance_m=inf))


def test_shading_of_a_cylinder() -> None:
    across = np.linspace(-1, 1, 201)
    one, zero = np.ones_like(across), np.zeros_like(across)
    even, _ = cylinder(Light(ambient=0.6), across, one, zero, gloss=0.0, shininess=1.0)
    assert even == pytest.approx(even[::-1]) and even.max() == pytest.approx(1.0)
    side = Light(azimuth_rad=0.0, elevation_rad=0.8, ambient=0.4)
    diffuse, glossy = cylinder(side, across, one, zero, gloss=0.5, shininess=40.0)
    # The matt maximum faces the lamp (Lambert): across = cos(elevation); the highlight lies half way to it.
    flank = across[np.argmax(diffuse - 0.4 * (0.5 + 0.5 * np.sqrt(1 - across**2)))]
    assert flank == pytest.approx(cos(0.8), abs=0.005)  # half a step of the grid, here and below
    assert across[np.argmax(glossy)] == pytest.approx(sin(0.5 * (pi / 2 - 0.8)), abs=0.005)


def test_same_scene_same_picture_and_seed_changes_noise_only() -> None:
    cable = Strand(of_curvature(6.0, 0.1), sheath=Sheath(text="NYM 3x1.5", stripe=0.2, strands=0.1))
    things = (
        Thing("ruler", (0.05, 0.06), (0.08, 0.01)),
        Thing("pen", (0.03, 0.05)),
        Thing("text", (0.1, 0.05), text="a"),
    )
    camera = Camera(800, 500, 5000.0)
    scene = Scene(cable, camera, light=DIRECTIONAL, ground=Ground(cloth, contrast=0.1, angle_rad=0.2), things=things)
    assert np.array_equal(render(scene).pixels, render(scene).pixels)
    assert not np.array_equal(render(scene).pixels, render(replace(scene, seed=1)).pixels)
    assert np.array_equal(render(scene).u_px, render(replace(scene, seed=1)).u_px)


@pytest.mark.parametrize("mode", ["grey", "colour", "alpha"])
@pytest.mark.parametrize("bit_depth", [8, 12, 16])
@pytest.mark.parametrize("kind", ["plain", "brushed", cloth, wood, stone, squared])
def test_every_ground_in_every_format(kind: str | Texture, bit_depth: int, mode: str) -> None:
    cable = Strand(of_curvature(6.0, 0.1))
    sensor = Sensor(bit_depth=bit_depth, mode=mode, noise=0.0)
    scene = Scene(cable, Camera(300, 200, 1500.0), ground=Ground(kind, (0.5, 0.5, 0.5), 0.05), sensor=sensor)
    pixels = render(scene).pixels
    assert pixels.shape == {"grey": (200, 300), "colour": (200, 300, 3), "alpha": (200, 300, 4)}[mode]
    assert pixels.dtype == (np.uint8 if bit_depth == 8 else np.uint16)
    assert pixels[..., :1].max() < 2**bit_depth if mode == "grey" else pixels[..., :3].max() < 2**bit_depth
    # a pattern of 5 % moves the median by less than a fifth of that; so does the last of 8 bits
    assert np.median(pixels[..., 0] if mode != "grey" else pixels) == pytest.approx(2 ** (bit_depth - 1), rel=0.01)


def test_cable_outside_the_picture_leaves_the_ground() -> None:
    cable = Strand(of_curvature(6.0, 0.1), place_m=(5.0, 5.0))
    scene = Scene(cable, Camera(300, 200, 1500.0), light=SHEET, ground=WHITE, sensor=Sensor(noise=0.0, bit_depth=16))
    assert np.unique(render(scene).pixels).tolist() == [LEVEL]


def test_noise_has_the_spread_asked_for() -> None:
    cable = Strand(of_curvature(6.0, 0.01))
    sensor = Sensor(noise=0.02, shot_noise=0.03, bit_depth=16)
    scene = Scene(cable, Camera(900, 600, 1500.0), (None, None), ground=Ground("plain", (0.5, 0.5, 0.5)), sensor=sensor)
    corner = render(scene).pixels[:200] / 65535
    # 180 000 pixels: the spread's own standard error is 0.17 %.
    assert corner.std() == pytest.approx(sqrt(0.02**2 + 0.03**2 * 0.5), rel=0.01)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_shows_the_picture_as_it_is(orientation: int) -> None:
    v, u = np.mgrid[0:64, 0:96]
    pixels = (u * 2 + v // 2).astype(np.uint8)
    data = np.frombuffer(turned_jpeg(pixels, orientation), np.uint8)
    with_tag = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)  # OpenCV obeys the tag
    assert with_tag.shape == pixels.shape
    assert np.abs(with_tag.astype(int) - pixels).max() <= 2  # levels that a jpg takes from a ramp


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_sixteen_bits_and_colours_survive_the_file(suffix: str) -> None:
    pixels = np.random.default_rng(0).integers(0, 65536, (20, 30, 3)).astype(np.uint16)
    back = cv2.imdecode(np.frombuffer(encode(pixels, suffix), np.uint8), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(back[:, :, ::-1], pixels)
    with pytest.raises(ValueError, match="16 bit"):
        encode(pixels, ".jpg")

"""The cable is found on any usable photo and refused with its reason on any other. Truth: the rendered curve."""

from dataclasses import replace
from math import pi

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from fixtures.grounds import cloth, squared, stone, wood
from fixtures.photographed.renderer import photograph, random_look
from fixtures.things import Thing
from pipeline.records import Rejected
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo
from pipeline.vision.render import Camera, Cover, Ground, Light, Picture, Scene, Sensor, Strand
from pipeline.vision.render.sheath import Sheath
from pipeline.vision.rough import RoughCable
from pipeline.vision.segmentation import find_cable
from tests.pipeline.vision.curves import of_curvature
from tests.pipeline.vision.drawn import drawn

SCALE = 5_500.0
LENGTH, DIAMETER, COVER = 0.17, 0.0046, 0.012
CURVE = of_curvature(lambda s: 5.0 + 3.0 * np.sin(pi * s / LENGTH), LENGTH)
CAMERA = Camera(1150, 480, SCALE, look_at_m=(0.5 * CURVE.chord, 0.022))
GREY = (0.75,) * 3
COLOUR = Sensor(mode="colour", noise=0.01)


def scene(**changes: object) -> Scene:
    return replace(
        Scene(Strand(CURVE, DIAMETER), CAMERA, ground=Ground(colour=GREY), sensor=Sensor(noise=0.01)), **changes
    )


def strand(colour: tuple[float, float, float], **sheath: object) -> Strand:
    return Strand(CURVE, DIAMETER, Sheath(colour, **sheath))


def photo_of(picture: Picture, bits: int = 8) -> Photo:
    pixels = picture.pixels
    return Photo("a.png", pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[..., 2::-1]), bits)


KNOWN = Cable(DIAMETER * SCALE, LENGTH * SCALE, BearingHints(cover_px=COVER * SCALE))
UNKNOWN = Cable()


def find(scene: Scene, cable: Cable = KNOWN) -> tuple[RoughCable | Rejected, Picture]:
    picture = drawn(scene)
    return find_cable(photo_of(picture, scene.sensor.bit_depth), cable=cable), picture


def offset_widths(rough: RoughCable, picture: Picture) -> float:
    """Largest distance of the visible path from the true centerline, in cable diameters."""
    true = np.column_stack(
        [np.interp(np.linspace(0, 1, 8001), np.linspace(0, 1, len(w)), w) for w in (picture.u_px, picture.v_px)]
    )
    first, last = rough.visible
    distance, _ = cKDTree(true).query(rough.path_px[first : last + 1])
    return float(distance.max() / (DIAMETER * SCALE))


LESS_THAN_A_CELL = 0.1
"""Widths; a cell of the reduced photo is an eighth of the width."""

LOOKS: dict[str, dict[str, object]] = {
    "black on grey": {},
    "white on black": {"cable": strand((0.9,) * 3), "ground": Ground(colour=(0.12,) * 3)},
    "grey on grey": {"cable": strand((0.45,) * 3)},
    "red on green, like luminance": {
        "cable": strand((0.75, 0.15, 0.15)),
        "ground": Ground(colour=(0.25, 0.45, 0.25)),
        "sensor": COLOUR,
    },
    "yellow on white": {"cable": strand((0.9, 0.8, 0.1)), "ground": Ground(colour=(0.9,) * 3), "sensor": COLOUR},
    "highlight": {"cable": strand((0.17,) * 3, gloss=0.8, shininess=60.0)},
    "text": {"cable": strand((0.17,) * 3, text="H07RN-F 3G1.5", text_size=0.9)},
    "stripe": {"cable": strand((0.17,) * 3, stripe=0.2, stripe_colour=(0.85,) * 3)},
    "stranded rope": {"cable": strand((0.3,) * 3, strands=0.4)},
    "shadow": {"light": Light(elevation_rad=0.95, ambient=0.45, shadow=0.35)},
    "light falls off": {"light": Light(gradient=(0.5, -0.3), vignette=0.3)},
    "brushed metal": {"ground": Ground("brushed", GREY, 0.05, 2.0)},
    "cloth": {"ground": Ground(cloth, GREY, 0.05, 2.0)},
    "wood": {"ground": Ground(wood, GREY, 0.06, 2.0, 0.7)},
    "stone": {"ground": Ground(stone, GREY, 0.05)},
    "squared paper": {"ground": Ground(squared, GREY, 0.3)},
    "noise of 5 %": {"sensor": Sensor(noise=0.05)},
    "12 bits in 16": {"sensor": Sensor(bit_depth=12, noise=0.01)},
    "blur of 2 px": {"sensor": Sensor(blur_px=2.0, noise=0.01)},
    "objects and writing": {
        "things": (
            Thing("ruler", (0.05, 0.054), (0.06, 0.012), 0.1, (0.85,) * 3),
            Thing("pen", (0.14, 0.055), (0.05, 0.006), -0.1),
            Thing("disc", (0.02, 0.045), (0.015, 0.015), 0.0, (0.2,) * 3),
            Thing("text", (0.09, -0.012), (0.05, 0.006), 0.0, (0.1,) * 3, "Probe 7b"),
        )
    },
    "a second, shorter cable": {"others": (Strand(of_curvature(3.0, 0.05), DIAMETER, place_m=(0.06, 0.045)),)},
}


@pytest.mark.parametrize("cable", [KNOWN, UNKNOWN], ids=["diameter known", "nothing known"])
@pytest.mark.parametrize("look", LOOKS, ids=str)
def test_cable_of_any_look_is_followed(look: str, cable: Cable) -> None:
    rough, picture = find(scene(**LOOKS[look]), cable)
    assert isinstance(rough, RoughCable), rough.reason
    # A quarter of the width is what the sub-pixel search takes in; it is the cable and not one of its edges.
    assert offset_widths(rough, picture) < 0.25
    covered = COVER / LENGTH
    first, last = rough.visible
    seen = np.hypot(*np.diff(rough.path_px[first : last + 1], axis=0).T).sum() / (LENGTH * SCALE)
    # Without knowing of covers, one of the ground's grey may pass for ground or its dark screw for cable.
    most = 1.01 * (1 - covered) if cable is KNOWN else 1.01
    assert 0.97 * (1 - covered) < seen < most  # half a width at each end is 2.7 %
    # shadow and gloss move the border of a mask by a tenth of the width
    assert rough.half_width_px == pytest.approx(0.5 * DIAMETER * SCALE, rel=0.15)
    if cable is KNOWN:
        assert rough.left.kind == rough.right.kind == "cover"
        # a tenth of a pixel, 0.02 mm, as every cover is to be found
        assert np.hypot(*np.subtract(rough.left.center_px, picture.left_px)) < 0.1
        assert np.hypot(*np.subtract(rough.right.center_px, picture.right_px)) < 0.1


def test_cover_about_three_cables_wide_makes_no_crossing() -> None:
    wide = Cover(3.0 * DIAMETER, (0.15,) * 3)
    rough, _ = find(scene(covers=(wide, wide)), UNKNOWN)
    assert isinstance(rough, RoughCable), rough.reason


def test_ruler_beside_the_cable_is_no_crossing() -> None:
    """It is two cables wide and runs past both covers, nearer than two of its own widths."""
    along = np.linspace(0.0, np.pi, 200)
    bow = np.column_stack([330.0 + 360.0 * along, 530.0 - 350.0 * np.sin(along)])
    grey = np.full((680, 1800), 35.0, np.float32)
    cv2.rectangle(grey, (0, 606), (1799, 664), 150.0, -1)
    cv2.polylines(grey, [np.rint(16.0 * bow).astype(np.int32)], False, 240.0, 30, cv2.LINE_AA, 4)
    for u, v in bow[[0, -1]].round().astype(int).tolist():
        cv2.circle(grey, (u, v), 40, 140.0, -1, cv2.LINE_AA)
    noise = 4.0 * np.random.default_rng(2).standard_normal(grey.shape)
    photo = Photo("ruler.png", np.clip(cv2.GaussianBlur(grey, (0, 0), 1.0) + noise, 0, 255).astype(np.uint8), 8)
    found = find_cable(photo, cable=UNKNOWN)
    assert isinstance(found, RoughCable)
    between = np.abs(found.path_px[:, 0] - 895.0) < 500.0  # without the covers, which nothing says are there
    assert cKDTree(bow).query(found.path_px[between])[0].max() < 8.0  # a quarter of the width
    assert np.ptp(found.path_px[between, 0]) > 990.0  # all of it, but for the spacing of the points


@pytest.mark.parametrize("azimuth", [-1.3, 1.7])
def test_cable_is_found_in_the_band_that_it_makes_with_a_hard_shadow(azimuth: float) -> None:
    lamp = np.array([np.cos(0.45) * np.cos(azimuth), np.cos(0.45) * np.sin(azimuth), np.sin(0.45)])
    look = replace(random_look(np.random.default_rng(1)), lamp=lamp, shadow=0.6, softness=0.1, ambient=0.4, radius=13.0)
    look = replace(look, sheath=np.full(3, 0.2), ground=np.full(3, 0.8), specular=0.1, letters=False, texture=0.0)
    picture = photograph(CURVE, look, DIAMETER, np.random.default_rng(2))
    rough = find_cable(photo_of(picture), cable=Cable(26.0, 26.0 * LENGTH / DIAMETER))
    assert isinstance(rough, RoughCable), rough.reason
    true = np.column_stack([picture.u_px, picture.v_px])
    distance, nearest = cKDTree(true).query(rough.path_px)
    beside = (nearest > 0) & (nearest < len(true) - 1)  # the ends stick out, the truth stops at the axes
    assert beside.mean() > 0.8  # a sixth of the path sticks out
    assert distance[beside].max() < 0.25 * 26.0


@pytest.mark.parametrize(("length", "level"), [(None, "warning"), (LENGTH * SCALE, "info")], ids=["unknown", "known"])
def test_end_at_a_larger_thing_is_told(length: float | None, level: str) -> None:
    """Where no length tells whether a piece is missing, that the line may be short is a warning."""
    box = Thing("box", (0.0, 0.0), (0.03, 0.03), 0.0, (0.1,) * 3)
    rough, _ = find(scene(covers=(None, None), things=(box,)), Cable(DIAMETER * SCALE, length))
    assert isinstance(rough, RoughCable)
    assert (rough.left.kind, rough.right.kind) == ("clamp", "end")
    (finding,) = rough.findings
    assert (finding.code, finding.level) == ("photo/hidden-end", level)
    assert ("may be short" in finding.message) is (length is None)
    assert f"({rough.left.center_px[0]:.0f}, {rough.left.center_px[1]:.0f}) px" in finding.message


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("roll", [0.0, 0.06, pi / 2, pi, -pi / 2])
def test_camera_may_be_turned_and_mirrored(roll: float, mirrored: bool) -> None:
    upright = abs(np.sin(roll)) > 0.9
    camera = replace(CAMERA, roll_rad=roll, mirrored=mirrored)
    camera = replace(camera, width=CAMERA.height, height=CAMERA.width) if upright else camera
    rough, picture = find(scene(camera=camera))
    assert isinstance(rough, RoughCable), rough.reason
    assert offset_widths(rough, picture) < LESS_THAN_A_CELL
    left, right = np.array(rough.left.center_px), np.array(rough.right.center_px)
    assert (right - left)[1 if upright else 0] > 0
    assert np.hypot(*(rough.path_px[0] - left)) < 1e-6
    assert np.hypot(*(rough.path_px[-1] - right)) < 1e-6


def test_figures_of_the_photo_are_true() -> None:
    flat = strand((0.17,) * 3)
    for noise, blur in ((0.01, 0.8), (0.03, 1.5)):
        rough, _ = find(scene(cable=flat, sensor=Sensor(noise=noise, blur_px=blur), light=Light(ambient=1.0)))
        assert isinstance(rough, RoughCable)
        assert rough.dark
        # ambient light leaves a matt cylinder at its full colour in the middle and half of it at the flanks
        assert 0.75 - 0.17 <= rough.contrast <= 0.75 - 0.5 * 0.17


def test_window_is_the_photo_along_the_cable() -> None:
    picture = drawn(scene())
    rough = find_cable(photo_of(picture), cable=KNOWN)
    assert isinstance(rough, RoughCable)
    first, last = rough.visible
    for u, v in np.rint(rough.path_px[first:last:20]).astype(int):
        assert rough.grey[v - rough.origin_px[1], u - rough.origin_px[0]] == pytest.approx(picture.pixels[v, u] / 255)


def test_neighbour_photo_narrows_the_search_and_changes_nothing() -> None:
    thing = Thing("pen", (0.09, -0.015), (0.16, 0.006), 0.0)
    first, _ = find(scene())
    assert isinstance(first, RoughCable)
    picture = drawn(scene(camera=replace(CAMERA, look_at_m=(0.5 * CURVE.chord + 0.004, 0.022)), things=(thing,)))
    alone = find_cable(photo_of(picture), cable=KNOWN)
    helped = find_cable(photo_of(picture), cable=KNOWN, near=first)
    assert isinstance(alone, RoughCable) and isinstance(helped, RoughCable)
    assert np.abs(np.subtract(alone.left.center_px, helped.left.center_px)).max() < 1e-9  # by the same pixels
    # a neighbour that misleads costs time, not the photo
    astray = replace(first, path_px=first.path_px * 0.2)
    assert isinstance(find_cable(photo_of(picture), cable=KNOWN, near=astray), RoughCable)


def test_free_ends_are_the_axes_where_nothing_covers_them() -> None:
    rough, picture = find(scene(covers=(None, None)), Cable(DIAMETER * SCALE))
    assert isinstance(rough, RoughCable)
    for bearing, true in ((rough.left, picture.left_px), (rough.right, picture.right_px)):
        assert bearing.kind == "end"
        assert np.hypot(*np.subtract(bearing.center_px, true)) < 3.0 * bearing.std_px
        assert bearing.std_px < 0.05 * DIAMETER * SCALE  # a square cut is centred to a twentieth of the width


def test_given_axes_cut_a_cable_that_goes_on_behind_them() -> None:
    cable = replace(strand((0.17,) * 3), overhang_m=0.012)
    picture = drawn(scene(cable=cable, covers=(None, None)))
    hints = BearingHints(given_px=(picture.left_px, picture.right_px))
    rough = find_cable(photo_of(picture), cable=Cable(DIAMETER * SCALE, LENGTH * SCALE, hints))
    assert isinstance(rough, RoughCable)
    assert rough.path_px[0] == pytest.approx(picture.left_px)
    assert offset_widths(rough, picture) < LESS_THAN_A_CELL


SECOND = Strand(CURVE, DIAMETER, place_m=(0.0, 0.022))
ACROSS = Strand(of_curvature(0.1, 0.06), DIAMETER, place_m=(0.06, 0.02), angle_rad=1.0)
ASIDE = replace(CAMERA, look_at_m=(0.14, 0.022))
CLOTH = Ground(cloth, GREY, 0.03)


@pytest.mark.parametrize(
    ("code", "changes", "cable"),
    [
        ("photo/contrast", {"cable": strand((0.72,) * 3), "ground": CLOTH, "sensor": Sensor(noise=0.05)}, UNKNOWN),
        ("photo/leaves-frame", {"camera": ASIDE}, KNOWN),
        ("photo/leaves-frame", {"camera": ASIDE}, UNKNOWN),
        ("photo/crossing", {"others": (ACROSS,)}, KNOWN),
        ("photo/crossing", {"others": (ACROSS,), "covers": (None, None)}, UNKNOWN),
        ("photo/two-candidates", {"others": (SECOND,), "covers": (None, None)}, UNKNOWN),
        ("photo/bearing", {"covers": (None, None)}, KNOWN),
    ],
)
def test_unusable_photo_is_refused_with_its_reason(code: str, changes: dict[str, object], cable: Cable) -> None:
    outcome, _ = find(scene(**changes), cable)
    assert isinstance(outcome, Rejected)
    assert outcome.code == code
    assert outcome.image == "a.png" and len(outcome.reason) > 20
    assert outcome.said.values


@pytest.mark.parametrize(
    ("changes", "cable"),
    [
        ({"cable": strand((0.74,) * 3), "ground": CLOTH, "sensor": Sensor(noise=0.02)}, KNOWN),
        ({"cable": strand((0.70,) * 3), "ground": CLOTH, "sensor": Sensor(noise=0.05)}, UNKNOWN),
        ({"sensor": Sensor(blur_px=8.0, noise=0.005)}, Cable(DIAMETER * SCALE)),
    ],
    ids=["pale on cloth", "pale in noise", "out of focus"],
)
def test_a_poor_photo_that_a_person_would_trace_is_traced(changes: dict[str, object], cable: Cable) -> None:
    outcome, picture = find(scene(**changes), cable)
    assert isinstance(outcome, RoughCable)
    assert offset_widths(outcome, picture) < 0.25  # within the reach in which edges are sought


@pytest.mark.parametrize("cable", [UNKNOWN, Cable(DIAMETER * SCALE)], ids=["nothing known", "diameter known"])
@pytest.mark.parametrize("ground", [Ground(colour=GREY), Ground(cloth, GREY, 0.05)], ids=["plain", "cloth"])
@pytest.mark.parametrize("turn", [1.35, 1.45, 1.55, 1.7, 1.85])
def test_cable_that_crosses_itself_is_refused(turn: float, ground: Ground, cable: Cable) -> None:
    # the two straight ends cross at an angle of turn - 1 half circles, from 63 to 153 degrees
    loop = of_curvature(turn * pi / 0.16, 0.16)
    look = (0.5 * loop.chord, 0.5 * float(loop.y.max() + loop.y.min()))
    strand = Strand(loop, DIAMETER, overhang_m=0.10 if turn < 1.7 else 0.05)
    camera = Camera(1000, 1000, SCALE, look_at_m=look)
    outcome, _ = find(scene(cable=strand, camera=camera, covers=(None, None), ground=ground), cable)
    assert isinstance(outcome, Rejected)
    # at the flattest crossing the ring and the two ends, joined, may be told as two strips
    assert outcome.code in (("photo/crossing", "photo/two-candidates") if turn > 1.8 else ("photo/crossing",))


def test_wrong_diameter_is_refused_with_both_widths() -> None:
    wrong = replace(KNOWN, diameter_px=1.9 * DIAMETER * SCALE)
    outcome, _ = find(scene(), wrong)
    assert isinstance(outcome, Rejected)
    assert outcome.code == "photo/width"
    # to a cell of the reduced photo, of which eight are to lie across the diameter that was given
    assert outcome.said.values["width_px"] / outcome.said.values["diameter_px"] == pytest.approx(
        1.0 / 1.9, abs=1.0 / 8.0
    )


def test_empty_table_is_refused() -> None:
    empty = Photo("a.png", np.full((400, 600), 180, np.uint8), 8)
    outcome = find_cable(empty, cable=KNOWN)
    assert isinstance(outcome, Rejected)
    assert outcome.code == "photo/blank"


def test_cable_that_lies_on_itself_is_refused() -> None:
    ring = of_curvature(2.4 * pi / 0.2, 0.2)
    camera = Camera(700, 700, SCALE, look_at_m=(0.5 * ring.chord, 0.5 * float(ring.y.max() + ring.y.min())))
    outcome, _ = find(scene(cable=Strand(ring, DIAMETER, overhang_m=0.03), camera=camera, covers=(None, None)), UNKNOWN)
    assert isinstance(outcome, Rejected)
    assert outcome.code == "photo/crossing"


@pytest.mark.parametrize("cable", [UNKNOWN, Cable(DIAMETER * SCALE)], ids=["nothing known", "diameter known"])
def test_piece_of_a_cable_that_leaves_the_frame_is_not_taken_for_it(cable: Cable) -> None:
    loop = of_curvature(1.25 * pi / 0.16, 0.16)
    camera = Camera(1000, 1000, SCALE, look_at_m=(0.5 * loop.chord, 0.5 * float(loop.y.max() + loop.y.min())))
    strand = Strand(loop, DIAMETER, overhang_m=0.10)
    # the texture tears the mask of the cable at some levels
    woven = Ground(cloth, GREY, 0.05)
    outcome, _ = find(scene(cable=strand, camera=camera, covers=(None, None), ground=woven), cable)
    assert isinstance(outcome, Rejected)
    assert outcome.code == "photo/leaves-frame"


def round_sheath(edge: float, crest: float, cover: int) -> tuple[Photo, np.ndarray]:
    """A lit round sheath 72 px across with dark flanks between two covers, drawn in shells; and its course in px."""
    rng, picture = np.random.default_rng(0), np.full((560, 1500), 205, np.uint8)
    u = np.linspace(200.0, 1300.0, 400)
    course = np.column_stack([u, 200.0 + 140.0 * np.sin(pi * (u - 200.0) / 1100.0)])
    points = np.round(16.0 * course).astype(np.int32)  # 4 bits of a pixel
    for across in range(72, 2, -4):
        lit = edge + (crest - edge) * np.sqrt(1.0 - (across / 72.0) ** 2)
        cv2.polylines(picture, [points], False, lit, across, cv2.LINE_AA, 4)
    for u0, v0 in points[[0, -1]].tolist():
        cv2.circle(picture, (u0, v0), 16 * 62, cover, cv2.FILLED, cv2.LINE_AA, 4)
        cv2.circle(picture, (u0, v0), 16 * 32, cover - 30, 8, cv2.LINE_AA, 4)
    noisy = cv2.GaussianBlur(picture, (0, 0), 1.5) + rng.normal(0.0, 1.5, picture.shape)
    return Photo("a.png", np.clip(noisy, 0, 255).astype(np.uint8), 8), course


@pytest.mark.parametrize(("edge", "crest", "cover"), [(70, 155, 130), (90, 155, 110), (90, 170, 110), (90, 140, 130)])
def test_without_a_scale_the_flanks_of_a_sheath_pass_for_no_cable(edge: float, crest: float, cover: int) -> None:
    """Each flank is a strip as long as the cable, and both may join at a cover: too thin for their length."""
    photo, course = round_sheath(edge, crest, cover)
    found = find_cable(photo, cable=Cable(slenderness=1150 / 72))
    assert isinstance(found, RoughCable)
    between_covers = found.path_px[(found.path_px[:, 0] > 262.0) & (found.path_px[:, 0] < 1238.0)]
    assert cKDTree(course).query(between_covers)[0].max() < 0.25 * 72  # a flank lies half a diameter aside


def test_without_a_scale_a_strip_of_another_slenderness_is_refused() -> None:
    photo, _ = round_sheath(90, 90, 130)
    wrong = find_cable(photo, cable=Cable(slenderness=2.5 * 1150 / 72))
    assert isinstance(wrong, Rejected)
    assert wrong.code == "photo/width" and "length_mm and diameter_mm" in wrong.reason

"""Bearing axes: covers of every look, free ends, pixels of the user. Truth: the rendered scene's own axes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erfc

from fixtures.grounds import squared, wood
from pipeline.vision.bearings.cover_size import cover_radius, visible_ends
from pipeline.vision.bearings.covers import BearingHints, find_bearings, find_cover, left_first
from pipeline.vision.bearings.rim import SAME_RADIUS, Circle, Radius
from pipeline.vision.bearings.steady import fixed_cover
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo
from pipeline.vision.render import Camera, Cover, Ground, Light, Picture, Scene, Sensor, Strand, render
from pipeline.vision.render.sheath import Sheath
from pipeline.vision.rough import Bearing, RoughCable
from pipeline.vision.search.ends import CableEnd
from pipeline.vision.segmentation import find_cable
from tests.pipeline.vision.curves import of_curvature

SCALE = 9_000.0
CURVE = of_curvature(9.0, 0.035)
CAMERA = Camera(540, 300, SCALE, look_at_m=(0.017, 0.0))


def scene(**changes: object) -> Scene:
    cover = Cover(diameter_m=0.012)
    base = Scene(
        Strand(CURVE, 0.0046), CAMERA, (cover, cover), ground=Ground(colour=(0.75,) * 3), sensor=Sensor(noise=0.01)
    )
    return replace(base, **changes)


def photo_of(picture: Picture, bits: int = 8) -> Photo:
    pixels = picture.pixels
    return Photo("a", pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[..., 2::-1]), bits)


def rough_end(picture: Picture, side: int, radius: float, off: float = 0.0) -> CableEnd:
    """Where the cable meets the rim, ``off`` radii farther out; its direction half a radius before."""
    path = np.column_stack([picture.u_px, picture.v_px])[:: -1 if side == 0 else 1]
    distance = np.hypot(*(path - path[-1]).T)
    rim, before = path[np.argmin(np.abs(distance - radius))], path[np.argmin(np.abs(distance - 1.5 * radius))]
    outward = (rim - before) / np.hypot(*(rim - before))
    return CableEnd(rim + off * radius * outward, outward)


def centre_errors(scene: Scene, *, off: float = 0.0, radius_error: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Errors (px) of both centres and their standard deviations."""
    picture = render(scene)
    errors, stds = [], []
    for side, true in enumerate((picture.left_px, picture.right_px)):
        cover = scene.covers[side]
        assert cover is not None
        radius = 0.5 * cover.diameter_m * SCALE
        circle = find_cover(
            photo_of(picture, scene.sensor.bit_depth),
            rough_end(picture, side, radius, off),
            Radius(radius * (1 + radius_error), 0.01 if radius_error == 0 else 0.05),
            scene.cable.diameter_m * SCALE,
        )
        assert circle is not None
        assert circle.radius == pytest.approx(radius, rel=0.01)  # a rim hardly off the ground tells it to 0.3 px
        errors.append(np.subtract(circle.center, true))
        stds.append(circle.std)
    return np.array(errors), np.array(stds)


GREY = (0.75,) * 3
LOOKS = {
    "bench": {},
    "brighter than ground": {"covers": (Cover(colour=(0.95,) * 3),) * 2},
    "black, no dot": {"covers": (Cover(colour=(0.08,) * 3, dot_m=0.0),) * 2},
    "colour of the cable": {"covers": (Cover(colour=(0.17,) * 3, dot_m=0.0),) * 2},
    "hardly off the ground": {"covers": (Cover(colour=(0.71,) * 3, dot_m=0.0, sheen=0.0),) * 2},
    "sheen into the ground's grey": {"covers": (Cover(colour=(0.66,) * 3, sheen=0.4),) * 2},
    "dark rim and slot": {"covers": (Cover(rim=0.4, slot=True),) * 2},
    "hardly wider than the cable": {"covers": (Cover(diameter_m=0.007),) * 2},
    "brushed ground": {"ground": Ground("brushed", GREY, 0.04)},
    "wood": {"ground": Ground(wood, GREY, 0.05)},
    "squared paper": {"ground": Ground(squared, GREY, 0.2)},
    "shadow on one side": {"light": Light(elevation_rad=0.95, ambient=0.45, shadow=0.35)},
    "bevel in a hard shadow": {
        "light": Light(0.8, 0.6, ambient=0.35, shadow=0.7, softness=0.1),
        "covers": (Cover(rim=0.3, colour=(0.7,) * 3),) * 2,
    },
    "faint beside its hard shadow": {
        "light": Light(-1.2, 0.6, ambient=0.35, shadow=0.75, softness=0.05),
        "covers": (Cover(colour=(0.45,) * 3),) * 2,
        "ground": Ground(colour=(0.55,) * 3),
    },
    "noise of 5 %": {"sensor": Sensor(noise=0.05)},
    "colour, same luminance": {
        "covers": (Cover(colour=(0.95, 0.66, 0.75)),) * 2,
        "sensor": Sensor(mode="colour", noise=0.01),
    },
    "12 bits in 16": {"sensor": Sensor(bit_depth=12, noise=0.01)},
    "white cable on black": {"cable": Strand(CURVE, 0.0046, Sheath((0.9,) * 3)), "ground": Ground(colour=(0.1,) * 3)},
}


@pytest.mark.parametrize("look", LOOKS, ids=str)
def test_centre_of_any_cover_is_found_within_its_uncertainty(look: str) -> None:
    errors, stds = centre_errors(scene(**LOOKS[look]))
    # Of 64 errors the largest is 2.4 standard deviations; 3.5 leaves room for another light.
    assert np.all(np.abs(errors) < 3.5 * stds[:, None])
    # A tenth of a pixel is 0.01 mm; a rim of 4 % contrast (0.11 px) and 5 % noise (0.13 px) cannot tell so much.
    hard = ("hardly off the ground", "noise of 5 %")
    assert np.all(stds < (0.15 if look in hard else 0.1))


@pytest.mark.parametrize(("off", "radius_error"), [(-0.6, 0.0), (0.7, 0.0), (1.8, 0.0), (0.0, 0.05), (0.0, -0.05)])
def test_centre_does_not_depend_on_the_first_guess(off: float, radius_error: float) -> None:
    first, stds = centre_errors(scene())
    again, _ = centre_errors(scene(), off=off, radius_error=radius_error)
    assert np.abs(again - first).max() < 0.5 * stds.max()  # half of what light and noise leave open


def test_cover_is_found_where_the_cable_seems_to_end_a_radius_before_it() -> None:
    errors, stds = centre_errors(scene(), off=-1.05)
    assert np.all(np.abs(errors) < 3.5 * stds[:, None])  # as for any look
    assert np.all(stds < 0.1)


def test_standard_deviation_of_the_centre_is_true() -> None:
    ground = Ground("brushed", GREY, 0.03)
    scores = []
    for seed in range(14):
        cover = Cover(colour=((0.35 + 0.04 * seed) % 0.7,) * 3)
        errors, stds = centre_errors(scene(seed=seed, ground=ground, covers=(cover, cover), sensor=Sensor(noise=0.03)))
        scores.extend((errors / stds[:, None]).ravel())
    # 56 scores: a true one-sigma gives 0.85 to 1.15 rms (95 %); the floor for light makes it smaller here.
    assert 0.4 < np.sqrt(np.mean(np.square(scores))) < 1.3


def test_cover_of_the_grounds_own_look_is_found_by_its_dot() -> None:
    cover = Cover(colour=GREY, sheen=0.0, dot_m=0.0025)
    picture = render(scene(covers=(cover, cover)))
    radius = 0.006 * SCALE
    for side, true in enumerate((picture.left_px, picture.right_px)):
        circle = find_cover(photo_of(picture), rough_end(picture, side, radius), Radius(radius, 0.01), 0.0046 * SCALE)
        assert circle is not None
        assert np.hypot(*np.subtract(circle.center, true)) < 3.5 * circle.std  # as for any look
        assert circle.radius == radius


def test_strips_that_end_alike_share_one_search(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = render(scene())
    photo, radius = photo_of(picture), 0.006 * SCALE
    places: list[CableEnd] = []

    def searched(photo: Photo, end: CableEnd, *rest: object) -> Circle | None:
        places.append(end)
        return find_cover(photo, end, Radius(radius, 0.01), 41.0)

    monkeypatch.setattr("pipeline.vision.bearings.covers.find_cover", searched)
    hints = BearingHints(cover_px=2.0 * radius)
    # radii; the second is the same end, the third lies under the cover that was seen, the fourth at none
    for aside, early in ((0.0, 0.0), (0.05, 0.0), (0.3, 0.0), (0.0, 0.5)):
        ends = tuple(rough_end(picture, side, radius) for side in (0, 1))
        shifts = (radius * (aside * np.array([0.0, 1.0]) - early * end.outward) for end in ends)
        moved = tuple(replace(end, place=end.place + shift) for end, shift in zip(ends, shifts, strict=True))
        axes = find_bearings(photo, moved, 41.0, hints)
        for axis, true in zip(axes, (picture.left_px, picture.right_px), strict=True):
            assert axis is not None
            assert np.hypot(*np.subtract(axis.center_px, true)) < 0.1  # px, as for any look
    assert len(places) == 4


def test_no_cover_is_no_circle() -> None:
    picture = render(scene(covers=(None, None), ground=Ground("brushed", GREY, 0.05)))
    radius = 0.006 * SCALE
    ends = tuple(rough_end(picture, side, radius, off=1.0) for side in (0, 1))
    assert find_bearings(photo_of(picture), ends, 41.0, BearingHints(cover_px=2 * radius)) == (None, None)


def test_given_axes_are_assigned_to_the_nearer_ends() -> None:
    picture = render(scene(covers=(None, None)))
    ends = tuple(rough_end(picture, side, 5.0) for side in (0, 1))
    for given in ((picture.left_px, picture.right_px), (picture.right_px, picture.left_px)):
        left, right = find_bearings(photo_of(picture), ends, 41.0, BearingHints(given_px=given))
        assert left is not None and right is not None
        assert (left.center_px, right.center_px) == (picture.left_px, picture.right_px)
        assert (left.kind, left.std_px) == ("given", 1.0)


@pytest.mark.parametrize(
    ("angle_deg", "first_is_left"),
    [(0, True), (79, True), (85, True), (95, True), (101, False), (180, False), (-85, False), (-95, False)],
)
def test_left_is_by_u_and_upper_where_the_chord_is_upright(angle_deg: float, first_is_left: bool) -> None:
    angle = np.radians(angle_deg)
    assert left_first(np.zeros(2), np.array([np.cos(angle), np.sin(angle)])) == first_is_left


def painted_covers(
    lefts: list[tuple[float, float]], right: tuple[float, float], radius: float, disc_grey: float = 150.0
) -> list[Photo]:
    """Painted here: discs (of the ground's grey) with a thin circle on each, a soft shadow aside, a cable."""
    rng = np.random.default_rng(8)
    v, u = np.mgrid[:220, :700].astype(float)
    photos = []
    for left in lefts:
        grey = np.full(u.shape, 150.0)
        for axis in (left, right):
            shade = 0.5 * erfc((np.hypot(u - axis[0] + 8.0, v - axis[1] + 7.0) - radius) / (np.sqrt(2.0) * 5.0))
            grey *= 1.0 - 0.25 * shade
        along = np.subtract(right, left) / np.hypot(*np.subtract(right, left))
        s = (u - left[0]) * along[0] + (v - left[1]) * along[1]
        t = (v - left[1]) * along[0] - (u - left[0]) * along[1]
        between = (s > 0.0) & (s < np.hypot(*np.subtract(right, left)))
        grey += (50.0 - grey) * between * 0.5 * erfc((np.abs(t) - 14.0) / np.sqrt(2.0))
        for axis in (left, right):
            distance = np.hypot(u - axis[0], v - axis[1])
            disc, line = 0.5 * erfc((distance - radius) / np.sqrt(2.0)), np.exp(-0.5 * ((distance - 18.0) / 1.2) ** 2)
            grey += disc * (disc_grey - 30.0 * line - grey)
        grey += rng.normal(0.0, 1.5, grey.shape)
        photos.append(Photo("painted", grey.clip(0, 255).astype(np.uint8), 8))
    return photos


def cable_to_the_rims(left: tuple[float, float], right: tuple[float, float], radius: float) -> RoughCable:
    """What a search without any size finds: the cable from visible end to visible end."""
    along = np.subtract(right, left) / np.hypot(*np.subtract(right, left))
    path = np.linspace(np.array(left) + radius * along, np.array(right) - radius * along, 80)
    ends = [Bearing((float(place[0]), float(place[1])), 2.8, kind="end") for place in path[[0, -1]]]
    nothing = np.zeros((1, 1), np.float32)
    return RoughCable("a", path, (0, 79), ends[0], ends[1], 14.0, nothing, (0, 0), True, 0.4, 1.0)


def test_size_of_covers_is_told_where_letters_hide_the_last_of_the_cable() -> None:
    lefts, right, radius = [(90.4, 120.7), (131.2, 119.9)], (610.3, 90.6), 36.0
    photos = painted_covers(lefts, right, radius, disc_grey=215.0)
    lost = [cable_to_the_rims(left, right, 1.6 * radius) for left in lefts]
    seen = [(photos[0], lost[0]), (photos[1], replace(lost[1], visible=(0, 77)))]  # 10 px more at one end
    found = cover_radius(seen)
    assert found is not None and abs(found - radius) < 0.1  # px, though a soft shadow lies beside the rim


@pytest.mark.parametrize("share", [0.72, 0.82])
def test_bright_middle_tells_the_axis_of_a_cover_whose_rim_is_like_the_ground(share: float) -> None:
    left, right, radius = (90.4, 120.7), (610.3, 90.6), 36.0
    photo = painted_covers([left], right, radius)[0]
    bright = painted_covers([left], right, share * radius, disc_grey=215.0)[0]
    v, u = np.mgrid[:220, :700]
    for axis in (left, right):  # the rim hides the cable as far as it reaches
        middle = np.hypot(u - axis[0], v - axis[1]) < share * radius + 2.0
        photo.pixels[middle] = bright.pixels[middle]
    ends = visible_ends(cable_to_the_rims(left, right, radius))
    bearings = find_bearings(photo, ends, 28.0, BearingHints(cover_px=2.0 * radius))
    for bearing, true in zip(bearings, (left, right), strict=True):
        assert bearing is not None and bearing.radius_px == pytest.approx(radius, abs=0.1)
        assert np.abs(np.subtract(bearing.center_px, true)).max() < 0.1  # px, though a soft shadow lies beside it


def ringed_cover(
    left: tuple[float, float],
    right: tuple[float, float],
    *,
    cable_above: float,
    inner: float = 29.0,
    outer: float = 36.0,
) -> Photo:
    """Rings between two radii (px), middles of the ground's look, at both ends of a cable 28 px wide.

    The cable is seen up to ``cable_above`` px from the axes: it vanishes under the ring, or runs across it.
    """
    v, u = np.mgrid[0:240, 0:700].astype(float)
    along = np.subtract(right, left) / np.hypot(*np.subtract(right, left))
    s = (u - left[0]) * along[0] + (v - left[1]) * along[1]
    t = (v - left[1]) * along[0] - (u - left[0]) * along[1]
    grey = np.full(u.shape, 170.0)
    distance = np.minimum(np.hypot(u - left[0], v - left[1]), np.hypot(u - right[0], v - right[1]))
    ring = 0.5 * (erfc((distance - outer) / np.sqrt(2.0)) - erfc((distance - inner) / np.sqrt(2.0)))
    grey += (45.0 - grey) * ring
    between = (s > 0.0) & (s < np.hypot(*np.subtract(right, left)))
    shown = (
        between * 0.5 * erfc((np.abs(t) - 14.0) / np.sqrt(2.0)) * erfc((cable_above - distance) / np.sqrt(2.0)) / 2.0
    )
    grey += (85.0 - grey) * shown + np.random.default_rng(5).normal(0.0, 1.5, grey.shape)
    return Photo("ringed", grey.clip(0, 255).astype(np.uint8), 8)


def test_rim_of_a_cover_with_a_ring_is_the_outer_one() -> None:
    left, right = (90.4, 120.7), (610.3, 110.6)
    photo = ringed_cover(left, right, cable_above=36.0)
    found = cover_radius([(photo, cable_to_the_rims(left, right, 30.0))])  # a mask ends within the dark ring
    assert found is not None and abs(found - 36.0) < 0.2  # px; the other edge of the ring lies 7 px away


@pytest.mark.parametrize(("inner", "outer"), [(37.0, 45.0), (24.0, 40.0), (63.0, 75.0)])
def test_ring_at_the_end_of_a_cable_is_no_loop_of_it(inner: float, outer: float) -> None:
    photo = ringed_cover((90.4, 120.7), (610.3, 110.6), cable_above=outer, inner=inner, outer=outer)
    found = find_cable(photo, cable=Cable(28.0, bearings=BearingHints(cover_px=2.0 * outer)))
    assert isinstance(found, RoughCable)
    assert np.abs(np.subtract(found.left.center_px, (90.4, 120.7))).max() < 0.1  # px, as for any cover


def test_one_cover_without_a_screw_tells_no_size() -> None:
    left, right, radius = (90.4, 120.7), (610.3, 90.6), 36.0
    photo = painted_covers([left], right, radius)[0]
    photo.pixels[60:120, 580:640] = 150  # the right one's circle is gone
    assert cover_radius([(photo, cable_to_the_rims(left, right, radius))]) is None


def test_size_of_dark_covers_hardly_wider_than_a_dark_cable() -> None:
    lefts, right, radius = [(90.4, 120.7), (131.2, 119.9)], (610.3, 90.6), 20.0  # of a cable 28 px wide
    photos = painted_covers(lefts, right, radius, disc_grey=60.0)
    # cable and covers are one dark thing, which ends on the far side of their rims
    seen = list(zip(photos, [cable_to_the_rims(left, right, -radius) for left in lefts], strict=True))
    found = cover_radius(seen)
    assert found is not None and abs(found / radius - 1.0) < SAME_RADIUS  # a line 2 px inside the rim draws it in


@pytest.mark.parametrize("seed", range(3))
def test_cover_hardly_off_the_ground_is_found_by_its_dot(seed):
    """Its rim shows in parts on one photo and not on the next."""
    rng, center = np.random.default_rng(seed), np.array([60.3, 50.2])
    v, u = np.mgrid[0:480, 0:640] / 4.0 - 0.375
    distance = np.hypot(u - center[0], v - center[1])
    drawn = np.where(distance < 3.5, 20.0, np.where(distance < 14.5, 196.0, 200.0 + 0.1 * u))
    grey = drawn.reshape(120, 4, 160, 4).mean(axis=(1, 3)) + rng.normal(0.0, 2.0, (120, 160))
    end = CableEnd(center + np.array([16.0, 0.0]), np.array([-1.0, 0.0]))
    circle = find_cover(Photo("a", np.rint(grey).astype(np.uint8), 8), end, Radius(15.4, 0.05), 9.0)
    assert circle is not None
    assert circle.center == pytest.approx(center, abs=0.1)


def test_a_cover_that_a_neighbour_photo_shows_is_found_though_the_cable_s_end_was_led_astray():
    """Along a shadow that passes beside the cover the mask runs on beyond it."""
    lefts, right, radius = [(90.4, 120.7)], (610.3, 90.6), 36.0
    photo = painted_covers(lefts, right, radius, disc_grey=60.0)[0]
    shadow = CableEnd(np.array([right[0] + 1.1 * radius, right[1] - 1.3 * radius]), np.array([1.0, 0.0]))
    ends = shadow, CableEnd(np.array([lefts[0][0] + radius, lefts[0][1]]), np.array([-1.0, 0.0]))
    assert find_bearings(photo, ends, 28.0, BearingHints(cover_px=2.0 * radius))[0] is None
    near = (Bearing((89.0, 121.0), 0.03, radius), Bearing((610.0, 90.5), 0.03, radius))
    found = find_bearings(photo, ends, 28.0, BearingHints(cover_px=2.0 * radius, seen=near))[0]
    assert found is not None and found.center_px == pytest.approx(right, abs=0.1)


@pytest.mark.parametrize(("std_px", "astray"), [(0.5, ()), (0.05, (3,))])
def test_a_cover_that_is_off_by_its_own_error_stands_still(std_px: float, astray: tuple[int, ...]) -> None:
    """On pictures of few pixels a cover is found to half a pixel, more than the play of a rig."""
    path, grey = np.zeros((2, 2)), np.zeros((1, 1), np.float32)
    found = []
    for moved, off in enumerate((0.0, 0.1, -0.1, 1.0)):
        left, right = (Bearing(place, std_px, 36.0) for place in ((90.0 + 20.0 * moved, 120.0), (610.0 + off, 90.0)))
        found.append(RoughCable("a", path, (0, 1), left, right, 14.0, grey, (0, 0), True, 0.4, 1.0))
    fixed = fixed_cover(found, 0.3)
    assert fixed is not None and (fixed.side, fixed.astray) == ("right", astray)

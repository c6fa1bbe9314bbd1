"""All photos of a specimen on one scale; rendered series with known axes, the shared benches and real photographs."""

import json
from dataclasses import replace
from functools import cache
from math import pi
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from fixtures.things import Thing
from pipeline.intake.folder import read_specimen
from pipeline.messages import Message
from pipeline.records import CameraSpec, Centerline, LoadStep, PhotoHints, Rejected, RigSpec, Side, Specimen, Traces
from pipeline.settings import IntakeSettings
from pipeline.settings.vision import VisionSettings
from pipeline.vision import series_search as search_module
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo
from pipeline.vision.render import Camera, Cover, Curve, Ground, Light, Scene, Sensor, Strand, render
from pipeline.vision.render.sheath import Sheath
from pipeline.vision.rough import RoughCable
from pipeline.vision.series import trace_series
from pipeline.vision.single import trace_photo
from tests.pipeline.vision.curves import of_curvature

SETTINGS = VisionSettings()
# the covers of these scenes lie in the plane: seen from so far away, any height does
FLAT = VisionSettings.model_validate({"calibration": {"usual_distance_m": 1e6}})
SCALE, LENGTH, DIAMETER, COVER = 5_500.0, 0.17, 0.0046, 0.012


TENTH_OF_A_PIXEL = 0.1 / SCALE
"""m; what two axes of some hundredths of a pixel each may leave of a chord."""


def arch(bend: float) -> Curve:
    return of_curvature(lambda s: bend * np.sin(pi * s / LENGTH) + 1.0, LENGTH)


CURVES = [arch(bend) for bend in (2.0, 5.0, 8.0)]
TRAVEL = [CURVES[0].chord - curve.chord for curve in CURVES]


def series(
    folder: Path,
    *,
    moving: Side = "left",
    given: RigSpec | None = None,
    camera: Camera | None = None,
    scale_error: float | None = 0.0,
    drift_m: float = 0.0,
    covers: bool = True,
    cover_m: float = COVER,
    hands: tuple[Thing, ...] = (),
) -> Specimen:
    """Three photos of a cable pushed by one bearing; ``scale_error`` None leaves the scale out."""
    camera = Camera(1150, 520, SCALE, look_at_m=(0.085, 0.022)) if camera is None else camera
    cover = Cover(cover_m) if covers else None
    steps, images = [], {}
    for i in range(len(CURVES)):
        name = f"step_{i:02d}.png"
        start = (TRAVEL[i] if moving == "left" else 0.0, drift_m * i)
        (folder / name).write_bytes(photo(i, start, camera, cover, hands))
        steps.append(LoadStep(i, "loading", TRAVEL[i], 1.0, 0.01, None, np.empty(0), np.empty(0), name))
        images[name] = folder / name
    rig = RigSpec(moving, COVER if covers else None) if given is None else given
    spec = CameraSpec(None if scale_error is None else SCALE * (1 + scale_error))
    return Specimen("a", folder, LENGTH, DIAMETER, spec, rig, tuple(steps), images)


@cache
def photo(i: int, start: tuple[float, float], camera: Camera, cover: Cover | None, hands: tuple[Thing, ...]) -> bytes:
    """PNG of one photo of the series; most tests look at the same three."""
    scene = Scene(
        Strand(CURVES[i], DIAMETER, Sheath((0.17,) * 3), start),
        camera,
        (cover, cover),
        Light(gradient=(0.1, 0.0)),
        Ground("brushed", (0.75,) * 3, 0.02),
        things=hands,
        sensor=Sensor(noise=0.01),
        seed=i,
    )
    written, png = cv2.imencode(".png", render(scene).pixels)
    assert written
    return png.tobytes()


def lines(traces: Traces) -> list[Centerline]:
    assert all(isinstance(photo, Centerline) for photo in traces.photos), traces.photos
    return [photo for photo in traces.photos if isinstance(photo, Centerline)]


def codes(traces: Traces) -> set[str]:
    return {finding.code for finding in traces.findings if finding.level != "info"}


def test_chords_and_lengths_of_a_series_are_true(tmp_path: Path) -> None:
    traces = trace_series(series(tmp_path), SETTINGS)
    for line, curve in zip(lines(traces), CURVES, strict=True):
        # five sigma of two axes, each some hundredths of a pixel at 5.5 px/mm
        assert line.chord_m == pytest.approx(curve.chord, abs=5 * line.chord_std_m)
        assert line.chord_std_m < TENTH_OF_A_PIXEL
        assert line.traced_length_m == pytest.approx(LENGTH, abs=5 * line.traced_length_std_m)
        assert line.preview is not None and line.preview.strip is not None
    assert not codes(traces)
    assert traces.scale.source.key == "scale.number"


def test_scale_follows_from_the_displacement_log(tmp_path: Path) -> None:
    traces = trace_series(series(tmp_path, scale_error=None), FLAT)
    assert traces.scale.source.key == "scale.travel"
    # axes of some hundredths of a pixel on a way of 50 px: a thousandth
    assert abs(traces.scale.px_per_m / SCALE - 1) < 4 * traces.scale.std_relative < 0.005
    assert [f.code for f in traces.findings if f.level == "info"] == ["scale/source"]
    assert len(lines(traces)) == 3


def test_wrong_scale_is_found_by_covers_and_length(tmp_path: Path) -> None:
    # a travel of a few millimetres tells less: covers of the wrong size make the axes uncertain
    traces = trace_series(series(tmp_path, scale_error=0.03), SETTINGS)
    assert {"scale/covers", "scale/length"} <= codes(traces)


def test_bearing_that_moves_is_told_from_the_fixed_one(tmp_path: Path) -> None:
    specimen = series(tmp_path, moving="right")
    assert not codes(trace_series(specimen, SETTINGS))
    claimed = replace(specimen, rig=replace(specimen.rig, moving_bearing="left"))
    traces = trace_series(claimed, SETTINGS)
    assert codes(traces) == {"rig/moving-bearing"}
    assert len(lines(traces)) == 3


@pytest.mark.parametrize("quarter", [1, -1])
def test_upright_series_is_named_by_the_bearing_that_moves(tmp_path: Path, quarter: int) -> None:
    upright = Camera(1150, 520, SCALE, look_at_m=(0.085, 0.022)).turned(quarter)
    traces = trace_series(series(tmp_path, camera=upright), SETTINGS)
    assert not codes(traces)
    left = np.array([line.left_px for line in lines(traces)])
    right = np.array([line.right_px for line in lines(traces)])
    # axes of some hundredths of a pixel each
    assert np.ptp(left, axis=0).max() == pytest.approx(SCALE * (TRAVEL[-1] - TRAVEL[0]), abs=0.2)
    assert np.ptp(right, axis=0).max() < 0.2
    # turned clockwise the left bearing is up, turned back it is down
    assert (right - left)[0, 1] * quarter > 0


@pytest.mark.parametrize("mirrored", [False, True])
def test_bow_is_positive_on_either_side(tmp_path: Path, mirrored: bool) -> None:
    camera = Camera(1150, 520, SCALE, look_at_m=(0.085, 0.022), roll_rad=0.04, mirrored=mirrored)
    for line in lines(trace_series(series(tmp_path, camera=camera), SETTINGS)):
        assert line.mirrored == mirrored
        assert np.median(line.shape.kappa) > 0
        assert line.shape.y.max() > 0


def test_camera_that_moved_is_a_finding(tmp_path: Path) -> None:
    traces = trace_series(series(tmp_path, drift_m=1.5e-3), SETTINGS)
    assert "photo/camera-moved" in codes(traces)
    # the fixed axis wanders by 0, 1.5, 3 mm in one coordinate: 0.87 mm rms a coordinate, of which a chord has two axes
    assert all(line.chord_std_m == pytest.approx(1.22e-3, rel=0.05) for line in lines(traces))


@pytest.mark.parametrize(("always", "sure"), [(False, False), (True, False), (True, True)])
def test_other_photos_tell_where_the_fixed_cover_stands(
    always: bool, sure: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the last photo a shadow is taken for the cover: it is searched again, and refused if that does not help.

    A dot on another thing makes it sure of a cover; the log is against it all the same.
    """
    sound = search_module.find_cable

    def misled(
        photo: Photo,
        *,
        cable: Cable | None = None,
        near: RoughCable | None = None,
        hints: PhotoHints | None = None,
    ) -> RoughCable | Rejected:
        found = sound(photo, cable=cable, near=near, hints=hints)
        if photo.name != "step_02.png" or isinstance(found, Rejected) or (near is None and not always):
            return found
        u, v = found.right.center_px
        return replace(found, right=replace(found.right, center_px=(u + 30.0, v + 20.0), sure=sure))

    monkeypatch.setattr(search_module, "find_cable", misled)
    traces = trace_series(series(tmp_path), SETTINGS)
    assert [isinstance(photo, Rejected) for photo in traces.photos] == [False, False, always]
    assert {photo.code for photo in traces.photos if isinstance(photo, Rejected)} <= {"photo/bearing"}
    for line, curve in zip(traces.photos, CURVES, strict=True):
        if isinstance(line, Centerline):
            assert line.chord_m == pytest.approx(curve.chord, abs=5 * line.chord_std_m)  # as without the shadow
            assert line.chord_std_m < TENTH_OF_A_PIXEL
    assert not codes(traces)


def test_a_cover_half_seen_on_one_photo_does_not_make_the_others_doubt_theirs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a photo taken in motion the rim is doubled: that its cover lies 2 px away is within its own error."""
    sound = search_module.find_cable

    def doubled(photo: Photo, **known: Any) -> RoughCable | Rejected:
        found = sound(photo, **known)
        if photo.name != "step_02.png" or isinstance(found, Rejected):
            return found
        u, v = found.right.center_px
        return replace(found, right=replace(found.right, center_px=(u + 2.0, v), std_px=1.0, sure=False))

    monkeypatch.setattr(search_module, "find_cable", doubled)
    traces = trace_series(series(tmp_path), SETTINGS)
    assert not codes(traces)
    for line in lines(traces)[:2]:
        assert line.chord_std_m < TENTH_OF_A_PIXEL


def test_given_axes_follow_the_displacement(tmp_path: Path) -> None:
    camera = Camera(1150, 520, SCALE, look_at_m=(0.085, 0.022))
    (u0, u1), (v0, v1) = camera.project(np.array([0.0, CURVES[0].chord]), np.zeros(2))
    given = RigSpec("left", None, ((float(u0), float(v0)), (float(u1), float(v1))))
    traces = trace_series(series(tmp_path, given=given, covers=False, camera=camera), SETTINGS)
    for line, curve in zip(lines(traces), CURVES, strict=True):
        assert line.chord_m == pytest.approx(curve.chord)
        assert line.axis_std_px == pytest.approx(1.0)


@pytest.mark.parametrize(("diameter", "scale_error"), [(0.0098, 0.0), (0.025, None)])
def test_covers_of_a_diameter_nobody_gave_are_found(tmp_path: Path, diameter: float, scale_error: float | None) -> None:
    rig = RigSpec("left", None)
    specimen = series(tmp_path, given=rig, cover_m=diameter, scale_error=scale_error)
    traces = trace_series(specimen, FLAT)
    assert "rig/covers-found" in {finding.code for finding in traces.findings}
    assert not codes(traces)
    for line, curve in zip(lines(traces), CURVES, strict=True):
        std = np.hypot(line.chord_std_m, line.chord_m * traces.scale.std_relative)
        assert line.chord_m == pytest.approx(curve.chord, abs=4 * std)
        assert std < 2.5e-3 * curve.chord  # what three photos and the log tell of the scale, as with covers given


def test_ends_lost_here_and_there_about_covers_are_no_ends_of_the_cable(tmp_path: Path) -> None:
    """Slots of the cable's grey lead its strip across covers: its length is right on the median, not on each photo."""
    camera = Camera(1150, 520, SCALE, look_at_m=(0.085, 0.022))
    specimen = series(tmp_path, given=RigSpec("left", None), camera=camera)
    for name, curve, start, slots in (
        ("step_01.png", CURVES[1], TRAVEL[1], (-1,)),
        ("step_02.png", CURVES[2], TRAVEL[2], (-1,)),
    ):
        picture = cv2.imread(str(tmp_path / name))
        for end in slots:
            axis = np.array([start + curve.x[end], curve.y[end]])
            turn = curve.theta[end] + (pi if end == 0 else 0.0)
            way = 0.5 * COVER * np.array([np.cos(turn), np.sin(turn)])
            u, v = camera.project(*np.array([axis - way, axis + 0.7 * way]).T)
            rim = [(round(x), round(y)) for x, y in zip(u, v, strict=True)]
            cv2.line(picture, rim[0], rim[1], (44, 44, 44), round(0.8 * SCALE * DIAMETER), cv2.LINE_AA)
        assert cv2.imwrite(str(tmp_path / name), picture)
    traces = trace_series(specimen, FLAT)
    assert "rig/covers-found" in {finding.code for finding in traces.findings}
    for line, curve in zip(lines(traces), CURVES, strict=True):
        assert line.chord_m == pytest.approx(curve.chord, abs=5 * line.chord_std_m)


def test_without_any_scale_a_cable_that_vanishes_is_refused(tmp_path: Path) -> None:
    blocks = tuple(Thing("box", (x, 0.0), (0.03, 0.04)) for x in (-0.01, 0.18))
    specimen = series(tmp_path, given=RigSpec("left", None), covers=False, hands=blocks, scale_error=None)
    traces = trace_series(specimen, SETTINGS)
    assert {photo.code for photo in traces.photos if isinstance(photo, Rejected)} == {"photo/bearing"}
    assert len(traces.photos) == 3


def test_bad_photos_are_refused_and_the_others_measured(tmp_path: Path) -> None:
    specimen = series(tmp_path)
    (tmp_path / "step_01.png").write_bytes(b"")
    del specimen.images["step_02.png"]
    traces = trace_series(specimen, SETTINGS)
    assert [type(photo) for photo in traces.photos] == [Centerline, Rejected]
    assert isinstance(traces.photos[1], Rejected) and traces.photos[1].code == "photo/empty"


def test_series_without_any_usable_photo_says_so(tmp_path: Path) -> None:
    specimen = series(tmp_path, scale_error=None)
    for path in specimen.images.values():
        assert cv2.imwrite(str(path), np.full((300, 500), 128, np.uint8))
    traces = trace_series(specimen, SETTINGS)
    assert all(isinstance(photo, Rejected) and photo.preview is not None for photo in traces.photos)
    assert traces.scale.source.key == "scale.none"


def test_preview_is_a_reduced_photo_and_a_straight_strip(tmp_path: Path) -> None:
    line = lines(trace_series(series(tmp_path), SETTINGS))[2]
    assert line.preview is not None and line.preview.strip is not None
    small = cv2.imdecode(np.frombuffer(line.preview.jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert small.shape == (line.preview.height, line.preview.width)
    assert line.preview.width * line.preview.reduction == pytest.approx(1150, abs=0.5 * line.preview.reduction)
    strip = cv2.imdecode(np.frombuffer(line.preview.strip, np.uint8), cv2.IMREAD_GRAYSCALE).astype(float)
    seen = strip[:, int(0.1 * strip.shape[1]) : int(0.9 * strip.shape[1])]
    rows = np.arange(len(strip))
    dark = np.clip(np.median(seen) + 40 - seen, 0, None)
    middle = (dark * rows[:, None]).sum(axis=0) / dark.sum(axis=0)
    # a band that bends by less than a twentieth of the cable: the strip shows two widths over its height
    assert np.ptp(middle) < 0.05 * 0.5 * len(strip)


@pytest.mark.shared
@pytest.mark.parametrize("name", ["bench-a", "bench-b", "bench-c"])
def test_axes_and_path_of_the_bench(name: str, shared_data: Path) -> None:
    traces = trace_series(read_specimen(shared_data / "bench" / name, IntakeSettings()), SETTINGS)
    truth = json.loads((shared_data / "bench" / name / "truth.json").read_text())
    assert not codes(traces)
    for line, step in zip(lines(traces), truth["steps"], strict=True):
        path = np.array(step["px"])
        # a tenth of a pixel, 0.01 mm
        assert np.hypot(*np.subtract(line.left_px, path[0])) < 0.1
        assert np.hypot(*np.subtract(line.right_px, path[-1])) < 0.1
        assert 1e3 * line.chord_m == pytest.approx(step["chord_mm"], abs=0.01)
        dense = np.column_stack([np.interp(np.linspace(0, 100, 20_001), np.arange(101), column) for column in path.T])
        distance, _ = cKDTree(dense).query(np.column_stack([line.u_px, line.v_px])[line.shape.seen])
        # the truth's 101 points, 20 px apart, are joined by chords: up to 0.05 px, and as much for the line
        assert np.sqrt(np.mean(distance**2)) < 0.1


@pytest.mark.shared
def test_real_cable_is_followed_from_clamp_to_clamp(shared_data: Path) -> None:
    folder = shared_data / "real" / "loop"
    line = trace_photo(folder / "black0.jpg")
    assert isinstance(line, Centerline)
    hand = np.loadtxt(folder / "black0_handpoints.csv", delimiter=",", skiprows=1)[:, :2]
    path = np.column_stack([line.u_px, line.v_px])
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T))]
    curve = CubicSpline(along, path)(np.linspace(0.0, along[-1], 20_001))  # points of the record are 25 px apart
    distance, _ = cKDTree(curve).query(hand[1:-1])
    # The hand points lie 3.6 px rms off a good trace, which is known ten times better; the outermost lie on the clamps.
    assert np.sqrt(np.mean(distance**2)) < 4.0
    clamps = np.sort(np.array([np.hypot(*(path[i] - hand[j])) for i in (0, -1) for j in (0, -1)]))[:2]
    assert clamps.max() < 60.0  # px, three widths: the size of a clamp
    # 1.5 m of cable, 4 mm thick to half a millimetre
    assert line.traced_length_m / line.width_m == pytest.approx(1.5 / 4e-3, rel=0.5 / 4.0)
    assert line.width_std_m < 0.05 * line.width_m  # a pixel of 21: no scale, light from one side
    # black cable before a black holder: the line ends where the light does, and says so
    assert [finding.code for finding in line.findings] == ["photo/hidden-end"] * 2


@pytest.mark.shared
@pytest.mark.parametrize(("name", "code"), [("blackcrit", "photo/crossing"), ("white0", "photo/contrast")])
def test_real_photo_is_refused_with_the_reason(name: str, code: str, shared_data: Path) -> None:
    outcome = trace_photo(shared_data / "real" / "loop" / f"{name}.jpg")
    assert isinstance(outcome, Rejected)
    assert outcome.code == code
    assert outcome.said.values
    assert outcome.preview is not None


@pytest.mark.parametrize(("scale_error", "lost"), [(0.0, (0, 1)), (None, (0, 2)), (0.0, (2,))])
def test_photos_without_a_cable_are_searched_again_with_what_the_others_tell(
    scale_error: float | None, lost: tuple[int, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Told of a neighbour, or without a scale of the covers' size; one that was told all this is not searched twice."""
    sound, asked = search_module.find_cable, []

    def strict(
        photo: Photo, *, cable: Cable, near: RoughCable | None, hints: PhotoHints | None
    ) -> RoughCable | Rejected:
        if photo.taken is not None:
            return Rejected(photo.name, Message("photo/crossing"))  # without the ground nothing more is seen
        asked.append(photo.name)
        told = near is not None and cable.diameter_px is not None and lost != (2,)
        if told or int(photo.name[5:7]) not in lost:
            return sound(photo, cable=cable, near=near)
        return Rejected(photo.name, Message("photo/crossing"))

    monkeypatch.setattr(search_module, "find_cable", strict)
    photos = trace_series(series(tmp_path, scale_error=scale_error), FLAT).photos
    again = () if lost == (2,) else lost
    assert [isinstance(photo, Centerline) for photo in photos] == [k in again or k not in lost for k in range(3)]
    assert asked == [f"step_{k:02d}.png" for k in (0, 1, 2, *again)]

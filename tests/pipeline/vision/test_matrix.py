"""Failure table of the vision stage as a matrix of scenes and conditions: right answer or refusal, nothing silent.

Each scene is rendered with known truth, written as a photo file and traced as a specimen's photo. ``right`` says what
right means; a scene is either to be traced, to be refused, or may do both as long as an answer is right.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from fixtures.grounds import cloth, squared, stone, wood
from fixtures.scenes import usual_photography
from fixtures.things import Thing
from fixtures.turned import turned_jpeg
from pipeline.records import CameraSpec, Centerline, LoadStep, Rejected, RigSpec, Specimen, Traces
from pipeline.settings import VisionSettings
from pipeline.simulate import Experiment, State
from pipeline.vision.render import Camera, Cover, Curve, Ground, Picture, Scene, Sensor, Strand, render
from pipeline.vision.render.lighting import DIRECTIONAL, EVEN, Light
from pipeline.vision.render.sensor import write_picture
from pipeline.vision.render.sheath import WHITE, Sheath
from pipeline.vision.series import trace_series
from tests.pipeline.vision.curves import of_curvature
from tests.pipeline.vision.drawn import drawn

LENGTH, DIAMETER = 0.181, 0.0046
BENT = of_curvature(lambda s: 2.0 + 7.0 * np.sin(np.pi * s / LENGTH), LENGTH)
FIXED = (LENGTH - BENT.chord, 0.0)
METAL = Ground("brushed", (0.76, 0.76, 0.77), 0.02)
GREY = Cover()


@dataclass(frozen=True)
class Case:
    """A scene: changes to the usual one, how it is written, what is told about the bearings."""

    sheath: Sheath = field(default_factory=lambda: Sheath(gloss=0.3))
    curve: Curve = BENT
    px_per_m: float = 6_000.0
    camera: dict[str, Any] = field(default_factory=dict)
    quarter_turns: int = 0
    scene: dict[str, Any] = field(default_factory=dict)
    file: str = "photo.bmp"  # a PNG takes a tenth of a second to write
    jpeg_quality: int = 92
    exif_orientation: int = 1
    axes_given: bool = False
    size_given: bool = True  # of the covers

    def picture(self, condition: dict[str, Any]) -> tuple[Scene, Picture]:
        height = 0.095 if "roll_rad" not in self.camera else 0.095 + 0.1 * abs(self.camera["roll_rad"])
        size = (int(0.233 * self.px_per_m), int(height * self.px_per_m))
        middle = (FIXED[0] + 0.5 * self.curve.chord, 0.5 * float(self.curve.y.max()))
        camera = replace(Camera(*size, self.px_per_m, middle), **self.camera).turned(self.quarter_turns)
        chosen = {**condition, **self.scene}
        if "sensor" in condition and "sensor" in self.scene:
            chosen["sensor"] = replace(self.scene["sensor"], noise=condition["sensor"].noise)
        over = 0.0 if chosen.get("covers") == (None, None) else 0.003
        scene = Scene(Strand(self.curve, DIAMETER, self.sheath, FIXED, overhang_m=over), camera, **chosen)
        return scene, drawn(scene)


def trace(case: Case, condition: dict[str, Any], folder: Path) -> tuple[Scene, Picture, Traces]:
    scene, picture = case.picture(condition)
    return scene, picture, photo_of(scene, picture, case, folder)


def photo_of(scene: Scene, picture: Picture, case: Case, folder: Path) -> Traces:
    """The picture as the only photo of a specimen."""
    path = folder / case.file
    path.parent.mkdir(exist_ok=True)
    if case.exif_orientation == 1:
        write_picture(path, picture.pixels, jpeg_quality=case.jpeg_quality)
    else:
        path.write_bytes(turned_jpeg(picture.pixels, case.exif_orientation, jpeg_quality=case.jpeg_quality))
    cover = scene.covers[0]
    rig = RigSpec(
        marker_diameter_m=cover.diameter_m if cover is not None and case.size_given else None,
        bearings_px=(picture.left_px, picture.right_px) if case.axes_given else None,
    )
    step = LoadStep(0, "loading", 0.013, 1.0, 0.01, 20.0, np.array([20.0]), np.array([1.0]), case.file)
    camera = CameraSpec(scale_px_per_m=scene.camera.px_per_m)
    specimen = Specimen("matrix", folder, LENGTH, DIAMETER, camera, rig, (step,), {case.file: path})
    return trace_series(specimen, VisionSettings())


def wrong(picture: Picture, line: Centerline, px_per_m: float) -> list[str]:
    """What is not right about a centerline; each limit is the issue's, or the line's own standard deviation.

    Midline: 0.25 px rms (directional light) or, up to 0.6 px, twice the standard deviation it states; no place beyond
    1 px. Axes: 1 px, or three of their own standard deviations. Curvature: 0.5 % of its maximum in the interior, 5 % in
    the last 10 mm, or twice its own standard deviation where the photo says that it is worse (blur, texture).
    Length: 0.3 mm.
    """
    curve, shape = picture.curve, line.shape
    s = np.linspace(curve.s[0], curve.s[-1], 20_001)
    path = np.column_stack([CubicSpline(curve.s, row)(s) for row in (picture.u_px, picture.v_px)])
    away, nearest = cKDTree(path).query(np.column_stack([line.u_px, line.v_px]))
    kappa = np.interp(s[nearest], curve.s, curve.kappa)
    interior = (shape.s > 0.010) & (shape.s < shape.s[-1] - 0.010)
    largest = float(np.abs(curve.kappa).max())
    off, std = np.abs(shape.kappa - kappa), line.kappa_std
    ends = min(
        max(np.hypot(*np.subtract(line.left_px, a)), np.hypot(*np.subtract(line.right_px, b)))
        for a, b in ((picture.left_px, picture.right_px), (picture.right_px, picture.left_px))
    )
    outer = shape.seen & ~interior
    stated = 2.0 * rms(line.position_std[shape.seen]) * px_per_m
    midline = away[shape.seen]
    checks = {
        f"midline {rms(midline):.3f} px": rms(midline) < min(max(0.25, stated), 0.6) and midline.max() < 1.0,
        f"axes {ends:.2f} px": ends < max(1.0, 3.0 * line.axis_std_px),
        f"curvature {rms(off[interior]):.3f} 1/m": rms(off[interior]) < max(0.005 * largest, 2.0 * rms(std[interior])),
        f"end curvature {rms(off[outer]):.3f} 1/m": rms(off[outer]) < max(0.05 * largest, 2.0 * rms(std[outer])),
        f"length {line.traced_length_m:.5f} m": abs(line.traced_length_m - LENGTH) < max(3e-4, 2.0 / px_per_m),
    }
    return [name for name, good in checks.items() if not good]


def series(
    folder: Path, curvatures: list[float], scales: list[float], log_gain: float = 1.0, *, scale_given: bool = True
) -> Traces:
    """Photos of a cable bent more and more, each taken at a scale of its own while the first one's is stated."""
    steps, images = [], {}
    bows = [of_curvature(kappa, LENGTH) for kappa in curvatures]
    for number, (bow, scale) in enumerate(zip(bows, scales, strict=True)):
        cable = Strand(bow, DIAMETER, Sheath(gloss=0.3), (LENGTH - bow.chord, 0.0), overhang_m=0.003)
        camera = Camera(1864, 760, scale, (0.5 * LENGTH, 0.02))
        name = f"step_{number}.bmp"
        write_picture(folder / name, render(Scene(cable, camera, light=DIRECTIONAL, ground=METAL, seed=number)).pixels)
        images[name] = folder / name
        travel = log_gain * (bows[0].chord - bow.chord)
        steps.append(LoadStep(number, "loading", travel, 1.0, 0.01, None, np.array([]), np.array([1.0]), name))
    # covers drawn in the plane of the cable look as high ones do from very far away
    camera_spec = CameraSpec(scale_px_per_m=scales[0] if scale_given else None, distance_m=100.0)
    rig = RigSpec(marker_diameter_m=0.012)
    specimen = Specimen("series", folder, LENGTH, DIAMETER, camera_spec, rig, tuple(steps), images)
    return trace_series(specimen, VisionSettings())


@pytest.mark.parametrize(
    ("scales", "log_gain", "codes"),
    [
        ([8_000.0, 8_000.0, 8_000.0], 1.0, set()),
        ([8_000.0, 8_000.0, 8_100.0], 1.0, {"photo/length-varies"}),
        ([8_000.0, 8_000.0, 8_000.0], 1.05, {"scale/displacement"}),
    ],
    ids=["as told", "camera moved once", "log off by 5 %"],
)
def test_free_checks_of_a_series(scales: list[float], log_gain: float, codes: set[str], tmp_path: Path) -> None:
    traces = series(tmp_path, [3.0, 6.0, 9.0], scales, log_gain)
    assert all(isinstance(line, Centerline) for line in traces.photos)
    warnings = {finding.code for finding in traces.findings if finding.level == "warning"}
    assert codes <= warnings
    assert bool(warnings) == bool(codes)


def test_scale_without_a_number_comes_from_the_log(tmp_path: Path) -> None:
    traces = series(tmp_path, [3.0, 6.0, 9.0], [8_000.0] * 3, scale_given=False)
    assert all(isinstance(line, Centerline) for line in traces.photos)
    assert abs(traces.scale.px_per_m / 8_000.0 - 1.0) < 3.0 * traces.scale.std_relative < 0.01
    assert {finding.code for finding in traces.findings} == {"scale/source"}


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


CONDITIONS: dict[str, dict[str, Any]] = {
    "even": {"light": EVEN},
    "directional": {"light": DIRECTIONAL, "ground": METAL},
    "noisy": {"light": DIRECTIONAL, "sensor": Sensor(noise=0.03)},
}

CLUTTER = (
    Thing("ruler", (0.09, 0.055), (0.12, 0.012), 0.02, (0.9, 0.85, 0.4)),
    Thing("pen", (0.05, 0.05), (0.05, 0.007), -0.5),
    Thing("text", (0.12, 0.01), (0.1, 0.004), 0.0, (0.1, 0.1, 0.1), "probe 7"),
    Thing("box", (0.03, 0.05), (0.04, 0.02), 0.2, (0.15, 0.15, 0.15)),
)

# Rows of the table that a user's ordinary photo may show: traced, and right, in every condition.
TRACED: dict[str, Case] = {
    "plain": Case(),
    "highlight": Case(sheath=Sheath(gloss=1.2, shininess=80)),
    "text": Case(sheath=Sheath(text="NYM-J 3x1.5 VDE", gloss=0.3)),
    "red": Case(sheath=Sheath(colour=(0.8, 0.1, 0.1), gloss=0.4), scene={"sensor": Sensor(mode="colour")}),
    "stripe": Case(sheath=Sheath(colour=(0.1, 0.5, 0.1), stripe=0.3), scene={"sensor": Sensor(mode="colour")}),
    "strands": Case(sheath=Sheath(strands=0.7)),
    "bright on dark": Case(sheath=Sheath(colour=WHITE), scene={"ground": Ground("plain", (0.1, 0.1, 0.1))}),
    "dark covers": Case(scene={"covers": (Cover(0.012, (0.05, 0.05, 0.05), 0.0),) * 2}),
    "light covers": Case(scene={"covers": (Cover(0.012, (0.9, 0.9, 0.9), 0.003),) * 2}),
    "open ends": Case(scene={"covers": (None, None)}, axes_given=True),
    "mirrored": Case(camera={"mirrored": True}),
    "rolled": Case(camera={"roll_rad": -0.3}),
    "cloth": Case(scene={"ground": Ground(cloth, (0.8, 0.8, 0.78), 0.05)}),
    "squared paper": Case(scene={"ground": Ground(squared, (0.9, 0.9, 0.9), 0.4, 1.5)}),
    "clutter": Case(scene={"things": CLUTTER}),
    "5 px/mm": Case(px_per_m=5_000.0),
    "blur 3 px": Case(scene={"sensor": Sensor(blur_px=3.0)}),
    "slightly bent": Case(curve=of_curvature(1.5, LENGTH)),
    "one-sided": Case(curve=of_curvature(lambda s: 2 + 12 * np.exp(-(((s / LENGTH - 0.3) / 0.15) ** 2)), LENGTH)),
}


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("name", TRACED)
def test_ordinary_photo_is_traced(name: str, condition: str, tmp_path: Path) -> None:
    scene, picture, traces = trace(TRACED[name], CONDITIONS[condition], tmp_path)
    (line,) = traces.photos
    assert isinstance(line, Centerline), line
    assert wrong(picture, line, scene.camera.px_per_m) == []
    assert line.mirrored == scene.camera.mirrored


# How the photo is taken and stored must not matter: one condition.
STORED: dict[str, Case] = {
    "turned 90": Case(quarter_turns=1),
    "turned 180": Case(quarter_turns=2),
    "turned 270": Case(quarter_turns=3),
    "turned and mirrored": Case(quarter_turns=1, camera={"mirrored": True}),
    **{f"EXIF {n}": Case(file="photo.jpg", exif_orientation=n) for n in (3, 5, 6, 8)},
    "JPEG 75": Case(file="photo.jpg", jpeg_quality=75),
    "png": Case(file="photo.png"),
    "umlauts": Case(file="Größe 5 Übung/foto ß.png"),
    **{
        f"{bits} bit {mode} {suffix}": Case(scene={"sensor": Sensor(bit_depth=bits, mode=mode)}, file=f"photo.{suffix}")
        for bits, mode, suffix in (
            (12, "grey", "tif"),
            (12, "colour", "png"),
            (16, "colour", "tif"),
            (16, "alpha", "png"),
        )
    },
    "tone curve": Case(scene={"sensor": Sensor(gamma=2.2)}),
    "sharpened": Case(scene={"sensor": Sensor(sharpen=1.0)}),
    "vignette": Case(scene={"light": replace(DIRECTIONAL, vignette=0.5, gradient=(0.4, 0.2))}),
    "parallel cable": Case(
        scene={"others": (Strand(BENT, DIAMETER, Sheath(gloss=0.3), (FIXED[0], 0.03)),)}, camera={"height": 1300}
    ),
}


@pytest.mark.parametrize("name", STORED)
def test_way_of_storing_does_not_matter(name: str, tmp_path: Path) -> None:
    scene, picture, traces = trace(STORED[name], CONDITIONS["directional"], tmp_path)
    (line,) = traces.photos
    assert isinstance(line, Centerline), line
    assert wrong(picture, line, scene.camera.px_per_m) == []


# A path that meets itself: one whole turn within 50 mm.
SELF_CROSSING = of_curvature(lambda s: 1 + 2 * np.pi / 0.04 * np.exp(-np.pi * ((s - 0.09) / 0.04) ** 2), LENGTH)
ACROSS = Strand(of_curvature(1.0, 0.12), DIAMETER, Sheath(gloss=0.3), (0.04, -0.03), 1.2)
BESIDE = Strand(BENT, DIAMETER, Sheath(gloss=0.3), (FIXED[0], 0.0065))
PALE = Sheath(colour=(0.8, 0.8, 0.8))

REFUSED: dict[str, Case] = {
    "crosses itself": Case(curve=SELF_CROSSING),
    "another cable across": Case(scene={"others": (ACROSS,)}),
    "leaves the picture below": Case(camera={"look_at_m": (0.09, -0.033)}),
    "leaves the picture sideways": Case(camera={"look_at_m": (0.17, 0.015)}),
    "out of focus": Case(scene={"sensor": Sensor(blur_px=20.0)}),
    "cable cut by a box": Case(scene={"others": (ACROSS, replace(ACROSS, place_m=(0.1, -0.03)))}),
}


@pytest.mark.parametrize("name", REFUSED)
def test_impossible_photo_is_refused_with_its_figure(name: str, tmp_path: Path) -> None:
    _, _, traces = trace(REFUSED[name], CONDITIONS["directional"], tmp_path)
    (outcome,) = traces.photos
    assert isinstance(outcome, Rejected), f"{name} was traced"
    assert outcome.code.startswith("photo/")
    assert len(outcome.reason) > 20


# Hard photos: an answer or a refusal, but never a wrong answer.
HARD: dict[str, Case] = {
    "wood": Case(scene={"ground": Ground(wood, (0.6, 0.45, 0.3), 0.1, 2.0, 0.3)}),
    "stone": Case(scene={"ground": Ground(stone, (0.6, 0.6, 0.6), 0.1)}),
    "nearly the ground's colour": Case(sheath=Sheath(colour=(0.76, 0.76, 0.77)), scene={"light": Light(ambient=1.0)}),
    "dark on dark": Case(scene={"ground": Ground("plain", (0.24, 0.24, 0.24))}),
    "white on white cloth": Case(sheath=PALE, scene={"ground": Ground(cloth, (0.82, 0.82, 0.82), 0.03)}),
    "sharp shadow": Case(
        px_per_m=8_000.0, scene={"light": Light(elevation_rad=0.6, ambient=0.35, shadow=0.7, softness=0.08)}
    ),
    "shadow along": Case(scene={"light": Light(0.3, 0.6, ambient=0.35, shadow=0.7, softness=0.08)}),
    "covers like the ground": Case(scene={"covers": (Cover(0.012, (0.76, 0.76, 0.76), 0.0),) * 2}),
    "covers with screws": Case(scene={"covers": (Cover(0.012, (0.7, 0.7, 0.7), 0.006, rim=0.3, slot=True),) * 2}),
    "touching cable": Case(scene={"others": (BESIDE,)}),
    "moved": Case(scene={"sensor": Sensor(motion_px=15.0, motion_rad=0.6)}),
    "blur 8 px": Case(scene={"sensor": Sensor(blur_px=8.0)}),
    "pale cable": Case(sheath=Sheath(colour=(0.62, 0.62, 0.6), gloss=0.5)),
    "open ends, axes not given": Case(scene={"covers": (None, None)}),
    "3 px/mm": Case(px_per_m=3_000.0),
    "covers of unknown size": Case(size_given=False),
    "light covers of unknown size": Case(
        scene={"covers": (Cover(0.012, (0.9, 0.9, 0.9), 0.003),) * 2}, size_given=False
    ),
}


@pytest.mark.parametrize("condition", ["directional", "noisy"])
@pytest.mark.parametrize("name", HARD)
def test_hard_photo_is_right_or_refused(name: str, condition: str, tmp_path: Path) -> None:
    scene, picture, traces = trace(HARD[name], CONDITIONS[condition], tmp_path)
    (outcome,) = traces.photos
    if isinstance(outcome, Centerline):
        assert wrong(picture, outcome, scene.camera.px_per_m) == []
    else:
        assert outcome.code.startswith("photo/") and outcome.reason


@pytest.mark.parametrize("seed", [0, 2, 3, 5, 8, 9, 20, 21, 22, 46, 47])
def test_photo_of_any_usual_rig_is_right_or_refused(seed: int, tmp_path: Path) -> None:
    photography = usual_photography(seed)
    rng = np.random.default_rng([seed, 5])
    k0, bow, skew = rng.uniform(0.5, 2.5), rng.uniform(3.0, 9.0), rng.uniform(-1.0, 1.0)
    curve = of_curvature(lambda s: k0 + bow * np.sin(np.pi * s / LENGTH) + skew * (2 * s / LENGTH - 1), LENGTH)
    state = State(0.0, curve.chord, curve.s, curve.x, curve.y, curve.theta, curve.kappa, 0.0 * curve.s)
    experiment = Experiment(length_m=LENGTH, diameter_m=DIAMETER)
    scene = photography.scene(experiment, state, photography.camera(experiment, (state,)), seed)
    picture = render(scene)
    case = Case(
        file=f"photo{photography.suffix}", jpeg_quality=photography.jpeg_quality, axes_given=scene.covers[0] is None
    )
    (outcome,) = photo_of(scene, picture, case, tmp_path).photos
    if isinstance(outcome, Centerline):
        assert wrong(picture, outcome, scene.camera.px_per_m) == []
    else:
        assert outcome.code.startswith("photo/") and outcome.reason

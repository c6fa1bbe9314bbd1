"""Virtual experiments: mechanics against the continuum solver, instruments against formulas, the folder as files."""

from __future__ import annotations

import csv
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from fixtures import continuum
from fixtures.memory import Slipping
from pipeline.simulate import (
    EFFECTS,
    Experiment,
    Photography,
    State,
    Written,
    bend,
    demo_specimen,
    parse_effect,
    protocol,
    simulate_specimen,
    write_specimen,
)
from pipeline.vision.render import Sensor

SMALL = Photography(width=480, height=240)
BASE = Experiment(displacements_m=protocol("unloading", 2, 0.005))
CABLE = continuum.Cable()

CATALOGUE = [
    "nonlinear_stiffness",
    "pre_curvature",
    "pre_curvature_varying",
    "stiffness_varying",
    "hysteresis",
    "plastic_set",
    "relaxation",
    "bearing_friction",
    "bearing_stiffness",
    "rigid_ends",
    "rig_compliance",
    "displacement_offset",
    "length_error",
    "force_offset",
    "force_drift",
    "force_gain",
    "in_plane_load",
    "scale_error",
    "lens_distortion",
    "camera_tilt",
    "out_of_plane_bow",
    "stiffness_drift",
]


def small(folder: Path, effects: dict, **change: object) -> Written:
    experiment = replace(BASE, displacements_m=(0.0, 0.008), effects=effects, force_noise=0.0)
    return simulate_specimen(folder, experiment, photography=replace(SMALL, **change))


def read_log(folder: Path) -> list[dict[str, str]]:
    with (folder / "force.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_cause_of_the_catalogue_can_be_hidden() -> None:
    assert list(EFFECTS) == CATALOGUE


def test_linear_cable_has_the_exact_forces() -> None:
    natural = 2 / 2.0 * np.sin(0.2)
    experiment = Experiment(
        length_m=0.2, EI0=5e-3, EI1=5e-3, displacements_m=tuple(natural - 0.2 + d for d in (0.005, 0.010, 0.015))
    )
    exact = [0.610252789, 0.810307454, 0.907461983]
    # The rod's error falls with the square of its 400 elements: 1e-5 at most.
    assert [state.force for state in bend(experiment)] == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize(
    ("effects", "cable"),
    [
        ({}, {}),
        ({"pre_curvature": 1.2}, {"K0": 1.2}),
        ({"pre_curvature_varying": 0.7}, {"K0_profile": lambda u: 0.7 * (2 * u - 1)}),
        (
            {"stiffness_varying": (-0.3, 0.6)},
            {"stiffness_profile": lambda u: -0.3 * np.exp(-0.5 * ((u - 0.6) / 0.08) ** 2)},
        ),
        ({"plastic_set": 0.1}, {"set_rate": 0.1}),
        ({"bearing_friction": 2e-3}, {"bearing_friction": 2e-3}),
        ({"bearing_stiffness": 0.02}, {"bearing_stiffness": 0.02}),
        ({"rigid_ends": 0.008}, {"rigid_end": 0.008}),
        ({"rig_compliance": 3e-4}, {"compliance": 3e-4}),
        ({"displacement_offset": 4e-4}, {"displacement_offset": 4e-4}),
        ({"in_plane_load": (0.4, 0.2)}, {"load": (0.4, 0.2)}),
        (
            {"hysteresis": (2e-3, 3.0)},
            {"memory": Slipping((2e-3 / 3, 1e-3 / 3, 2e-3 / 9), (1.0, 2.0, 3.0))},
        ),
    ],
    ids=lambda value: "-".join(value) or "ideal",
)
def test_mechanics_agree_with_a_continuous_rod(effects: dict, cable: dict) -> None:
    ours = bend(replace(BASE, effects=effects))
    theirs = continuum.bend(replace(CABLE, **cable), BASE.displacements_m)
    scale = max(state.F for state in theirs)
    # 400 elements against collocation: 1e-4 of the largest force, 1 um of the shape.
    assert [a.force for a in ours] == pytest.approx([b.F for b in theirs], abs=2e-4 * scale)
    for a, b in zip(ours, theirs, strict=True):
        assert a.chord == pytest.approx(b.chord, abs=2e-7)
        assert np.interp(a.s, b.s, b.y) == pytest.approx(a.y, abs=2e-6)


def test_nonlinear_stiffness_takes_ordinates_and_one_is_a_constant() -> None:
    one = bend(replace(BASE, effects={"nonlinear_stiffness": 0.01}))
    three = bend(replace(BASE, effects={"nonlinear_stiffness": (0.01, 0.01, 0.01)}))
    linear = bend(replace(BASE, EI0=0.01, EI1=0.01))
    assert [a.force for a in one] == pytest.approx([a.force for a in linear], rel=1e-9, abs=1e-9)
    assert [a.force for a in three] == pytest.approx([a.force for a in linear], rel=1e-9, abs=1e-9)
    soft = bend(replace(BASE, effects={"nonlinear_stiffness": (0.018, 0.012, 0.006)}))
    assert soft[2].force < bend(replace(BASE, EI0=0.018, EI1=0.018))[2].force


@pytest.mark.parametrize(
    ("effect", "shown"),
    [
        ({"force_offset": 0.05}, lambda F, t, begin: F + 0.05),
        ({"force_gain": 0.02}, lambda F, t, begin: F * 1.02),
        ({"force_drift": 1e-4}, lambda F, t, begin: F + 1e-4 * (begin + t)),
        ({"relaxation": (0.05, 6.0)}, lambda F, t, begin: F * (1 - 0.05 * (1 - np.exp(-t / 6.0)))),
        ({"stiffness_drift": -0.01}, lambda F, t, begin: F * (1 - 0.01 * begin / 60.0)),
    ],
    ids=["offset", "gain", "drift", "relaxation", "stiffness"],
)
def test_load_cell_shows(tmp_path: Path, effect: dict, shown: object) -> None:
    written = small(tmp_path / "a", effect)
    for row in read_log(written.folder):
        step = int(row["step"])
        begin = 60.0 * step
        F = written.truth["steps"][step]["F"]
        exact = shown(F, float(row["time_s"]) - begin, begin)
        # Times are written to 0.01 s: relaxation runs by 0.05 F / 6 s at most.
        assert float(row["force_N"]) == pytest.approx(exact, abs=0.05 * F / 6.0 * 0.005 + 1e-6)


def test_descriptions_are_wrong_by_the_amount_asked_for(tmp_path: Path) -> None:
    right = tomllib.loads((small(tmp_path / "a", {}).folder / "specimen.toml").read_text(encoding="utf-8"))
    wrong = small(tmp_path / "b", {"length_error": 0.01, "scale_error": -0.005})
    text = tomllib.loads((wrong.folder / "specimen.toml").read_text(encoding="utf-8"))
    assert right["specimen"]["length_mm"] == 181.0
    assert text["specimen"]["length_mm"] == pytest.approx(181.0 * 1.01, abs=1e-4)
    factor = text["camera"]["scale_px_per_mm"] / right["camera"]["scale_px_per_mm"]
    assert factor == pytest.approx(0.995, rel=1e-6)
    assert wrong.truth["px_per_mm"] == pytest.approx(right["camera"]["scale_px_per_mm"], rel=1e-6)
    assert wrong.truth["L_mm"] == pytest.approx(181.0)


def test_camera_effects_move_the_pixels_and_nothing_else(tmp_path: Path) -> None:
    plain, bent = small(tmp_path / "a", {}).truth, small(tmp_path / "b", {"lens_distortion": -0.02}).truth
    tilted = small(tmp_path / "c", {"camera_tilt": (0.1, 0.2)}).truth
    scale, middle = 1e3 * plain["px_per_mm"], np.array([239.5, 119.5])
    for a, b, c in zip(plain["steps"], bent["steps"], tilted["steps"], strict=True):
        assert a["F"] == b["F"] == c["F"] and a["xy_mm"] == b["xy_mm"] == c["xy_mm"]
        p = np.array(a["px"]) - middle
        gain = 1 - 0.02 * (p**2).sum(1, keepdims=True) / (240**2 + 120**2)
        # 101 truth points are splined from the rod's 401 vertices, before or after the lens: 1e-6 px.
        assert np.array(b["px"]) == pytest.approx(middle + p * gain, abs=1e-5)
        assert np.array(c["px"]) == pytest.approx(middle + p / (1 + p @ [[0.1], [0.2]] / scale), abs=1e-5)


def test_a_bow_that_leaves_the_plane_is_seen_foreshortened(tmp_path: Path) -> None:
    plain, leaning = small(tmp_path / "a", {}).truth, small(tmp_path / "b", {"out_of_plane_bow": 0.01}).truth
    top = max(np.max(np.array(step["xy_mm"])[:, 1]) for step in plain["steps"])
    share = np.sqrt(1.0 - (10.0 / top) ** 2)
    for a, b in zip(plain["steps"], leaning["steps"], strict=True):
        assert a["F"] == b["F"] and a["xy_mm"] == b["xy_mm"]
        u, v = np.array(a["px"]).T
        # the chord lies along u, the axes at one v; tracing the spline of the nodes is right to 1e-4 px
        assert np.array(b["px"])[:, 0] == pytest.approx(u, abs=1e-3)
        assert np.array(b["px"])[:, 1] - v[0] == pytest.approx(share * (v - v[0]), abs=1e-3)
    with pytest.raises(ValueError, match="higher than the largest bow"):
        small(tmp_path / "c", {"out_of_plane_bow": 0.1})


def test_folder_holds_what_a_measured_one_holds(tmp_path: Path) -> None:
    written = simulate_specimen(tmp_path / "cable 7ä", replace(BASE, id="cable 7ä"), photography=SMALL)
    files = sorted(str(p.relative_to(written.folder)) for p in written.folder.rglob("*") if p.is_file())
    assert files == ["force.csv", *(f"images/step_{k:02d}.png" for k in range(4)), "specimen.toml"]
    assert written.truth_file == tmp_path / "cable 7ä.truth.json"
    assert json.loads(written.truth_file.read_text(encoding="utf-8")) == written.truth
    rows = read_log(written.folder)
    assert list(rows[0]) == ["step", "branch", "time_s", "displacement_mm", "force_N", "image"]
    holds = {int(row["step"]): row["branch"] for row in rows}
    assert list(holds.values()) == ["mounted", "loading", "loading", "unloading"]
    assert [row["image"] for row in rows if row["image"]] == [f"images/step_{k:02d}.png" for k in range(4)]
    assert cv2.imread(str(written.folder / "images/step_02.png"), cv2.IMREAD_UNCHANGED).shape == (240, 480)


def test_force_noise_has_its_size(tmp_path: Path) -> None:
    experiment = replace(BASE, displacements_m=(0.008,), samples=4000, force_noise=0.01)
    written = simulate_specimen(tmp_path / "a", experiment, photography=SMALL)
    forces = np.array([float(row["force_N"]) for row in read_log(written.folder)])
    F = written.truth["steps"][0]["F"]
    # 4000 samples: the spread's standard error is 1.1 %, the mean's 1.6e-4 of F.
    assert forces.std() == pytest.approx(0.01 * F, rel=0.05)
    assert forces.mean() == pytest.approx(F, rel=7e-4)


def test_soft_cables_keep_their_digits(tmp_path: Path) -> None:
    written = small(tmp_path / "a", {"nonlinear_stiffness": 1e-5})
    forces = [float(row["force_N"]) for row in read_log(written.folder) if row["step"] == "1"]
    # half of the ninth decimal of 2 mN
    assert forces == pytest.approx([written.truth["steps"][1]["F"]] * 8, rel=2.5e-7)


def test_same_seed_same_bytes(tmp_path: Path) -> None:
    a, b, c = (
        simulate_specimen(tmp_path / name, replace(BASE, displacements_m=(0.004,), seed=seed), photography=SMALL).folder
        for name, seed in (("a", 1), ("b", 1), ("c", 2))
    )
    for name in ("force.csv", "images/step_00.png"):
        assert (a / name).read_bytes() == (b / name).read_bytes()
        assert (a / name).read_bytes() != (c / name).read_bytes()


@pytest.mark.parametrize("moving", ["left", "right"])
def test_the_other_bearing_stands_still(tmp_path: Path, moving: str) -> None:
    experiment = replace(BASE, moving=moving)
    steps = simulate_specimen(tmp_path / "a", experiment, photography=replace(SMALL, roll_rad=0.02)).truth["steps"]
    still, pushed = ("right_px", "left_px") if moving == "left" else ("left_px", "right_px")
    assert np.ptp([step[still] for step in steps], axis=0).max() < 1e-6
    assert np.ptp([step[pushed] for step in steps], axis=0).max() > 10


@pytest.mark.parametrize("scale", ["number", "board", "markers", "bearings"])
def test_scale_is_told_as_asked(tmp_path: Path, scale: str) -> None:
    written = small(tmp_path / "a", {}, scale=scale, distance_m=0.5)
    text = tomllib.loads((written.folder / "specimen.toml").read_text(encoding="utf-8"))
    camera = text.get("camera", {})
    assert ("scale_px_per_mm" in camera) == (scale == "number")
    assert (written.folder / "calibration" / "board.png").exists() == ("board" in camera) == (scale == "board")
    assert "bearing_marker_mm" in text["rig"]


def test_open_ends_give_the_bearings_pixels(tmp_path: Path) -> None:
    written = small(tmp_path / "a", {}, covers=(None, None))
    rig = tomllib.loads((written.folder / "specimen.toml").read_text(encoding="utf-8"))["rig"]
    step = written.truth["steps"][0]
    assert np.array(rig["bearings_px"]) == pytest.approx(np.array([step["left_px"], step["right_px"]]), abs=0.006)


def test_sixteen_bit_colour_turned_and_mirrored(tmp_path: Path) -> None:
    sensor = Sensor(bit_depth=16, mode="colour")
    written = small(tmp_path / "a", {}, suffix=".tif", sensor=sensor, quarter_turns=1, mirrored=True)
    picture = cv2.imread(str(written.folder / "images/step_01.tif"), cv2.IMREAD_UNCHANGED)
    assert picture.shape == (480, 240, 3) and picture.dtype == np.uint16
    px = np.array(written.truth["steps"][1]["px"])
    assert np.ptp(px[:, 1]) > np.ptp(px[:, 0])
    dark = picture[px[50, 1].round().astype(int), px[50, 0].round().astype(int)].mean()
    assert dark < 0.6 * np.median(picture)


def test_truth_knows_the_pre_curvature_and_law_that_were_used(tmp_path: Path) -> None:
    truth = small(tmp_path / "a", {"pre_curvature": 1.0, "pre_curvature_varying": 0.5}).truth
    assert truth["K0"] == pytest.approx(1.0)
    assert np.array(truth["K0_along"]) == pytest.approx(np.linspace(0.5, 1.5, 101))
    D = np.array(truth["law"]["excess_per_m"])
    law = 0.0075 * D + 0.0105 * 4.5 * np.tanh(D / 4.5)
    assert np.array(truth["law"]["moment_Nm"]) == pytest.approx(law, abs=1e-12)
    # central differences
    assert np.gradient(law, D)[5:-5] == pytest.approx(truth["law"]["tangent_Nm2"][5:-5], rel=2e-3)
    assert "ei0" not in small(tmp_path / "b", {"nonlinear_stiffness": 0.01}).truth


def test_states_of_another_solver_are_photographed(tmp_path: Path) -> None:
    bent = continuum.bend(CABLE, [0.008])
    states = tuple(State(b.F, b.chord, b.s, b.x, b.y, b.theta, b.kappa, b.m) for b in bent)
    experiment = replace(BASE, displacements_m=(0.008,))
    written = write_specimen(tmp_path / "a", experiment, states=states, photography=SMALL)
    assert written.truth["steps"][0]["F"] == bent[0].F
    with pytest.raises(ValueError, match="1 states for 4"):
        write_specimen(tmp_path / "b", BASE, states=states, photography=SMALL)


def test_effects_are_read_from_text() -> None:
    assert parse_effect("hysteresis=0.002,3") == ("hysteresis", (0.002, 3.0))
    with pytest.raises(ValueError, match="the nearest is bearing_friction"):
        parse_effect("bearing_fricton=1")
    with pytest.raises(ValueError, match="N m"):
        parse_effect("bearing_friction=much")
    for impossible, told in (("hysteresis=-0.002", "is negative"), ("bearing_stiffness=nan", "finite numbers")):
        with pytest.raises(ValueError, match=told):
            parse_effect(impossible)
    with pytest.raises(ValueError, match=r"takes 2 numbers \(along .*\), not 1"):
        bend(replace(BASE, effects={"in_plane_load": 1.0}))


def test_impossible_experiments_are_the_callers_mistake() -> None:
    with pytest.raises(ValueError, match="positive"):
        Experiment(EI0=-1.0)
    with pytest.raises(ValueError, match="known are three, loading, unloading"):
        protocol("four", 3, 0.005)
    with pytest.raises(ValueError, match="no equilibrium"):
        bend(replace(BASE, displacements_m=(0.5,)))
    assert protocol("unloading", 3, 1.0) == (0.0, 1.0, 2.0, 3.0, 2.0, 1.0)


def test_demo_is_a_whole_specimen(tmp_path: Path) -> None:
    written = demo_specimen(tmp_path / "demo", seed=4)
    assert len(list((written.folder / "images").iterdir())) == 7
    assert cv2.imread(str(written.folder / "images/step_00.png"), cv2.IMREAD_UNCHANGED).shape == (1000, 2448)
    assert written.truth["effects"] == {}
    forces = [step["F"] for step in written.truth["steps"]]
    assert forces[0] == pytest.approx(0.0, abs=1e-9) and min(forces[1:]) > 0
    for step in written.truth["steps"]:
        px = np.array(step["px"])
        assert px.min() > 50 and px[:, 0].max() < 2398 and px[:, 1].max() < 950

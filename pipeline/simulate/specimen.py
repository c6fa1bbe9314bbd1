"""Writes a virtual experiment as a specimen folder: images/, force.csv, specimen.toml; the truth in a file of its own.

The folder holds nothing a measured one would not hold. ``truth.json``: id, effects, law (of K - K0), K0 (mean, and at
101 places along the free cable), length, scale, and for each step force, chord and, at 101 equidistant arc lengths,
kappa (1/m), moment (N m), position (mm) and the pixel path of the centerline, (0, 0) the middle of the first pixel.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.messages import Message
from pipeline.simulate.effects import Readings, Setup
from pipeline.simulate.experiment import Experiment, State, bend, protocol
from pipeline.simulate.photography import Photography, fitted_board
from pipeline.vision.render import Camera, Picture, render, render_board
from pipeline.vision.render.sensor import write_picture

TRUTH_POINTS = 101


@dataclass(frozen=True)
class Written:
    """A written specimen: its folder, the file with the truth, and the truth itself."""

    folder: Path
    truth_file: Path
    truth: dict[str, Any]


def simulate_specimen(
    folder: Path,
    experiment: Experiment,
    *,
    photography: Photography | None = None,
    truth_file: Path | None = None,
) -> Written:
    """Bend, photograph and log a cable; see `write_specimen`."""
    return write_specimen(folder, experiment, states=bend(experiment), photography=photography, truth_file=truth_file)


def demo_specimen(folder: Path, seed: int = 0, *, truth_file: Path | None = None) -> Written:
    """Simulate and photograph the specimen of ``cablebend demo``, a mounted cable and six loading steps; a few seconds.

    The cable, its pre-curvature, the camera's roll and the print on the sheath differ from seed to seed within what is
    usual on such a rig; nothing is hidden in it.

    Parameters
    ----------
    folder : Path
    seed : int
        Chooses cable, camera and noise.
    truth_file : Path or None
        See `write_specimen`.
    """
    rng = np.random.default_rng([seed, 2])
    length = rng.uniform(0.17, 0.21)
    EI0 = float(np.exp(rng.uniform(np.log(4e-3), np.log(4e-2))))
    experiment = Experiment(
        id=folder.name,
        length_m=round(length, 4),
        diameter_m=round(rng.uniform(0.0042, 0.0062), 4),
        EI0=EI0,
        EI1=EI0 * rng.uniform(0.3, 0.6),
        kc=rng.uniform(3.5, 6.0),
        K0=rng.uniform(1.0, 2.5),
        displacements_m=protocol("loading", 6, round(0.0125 * length, 4)),
        seed=seed,
    )
    photography = Photography(roll_rad=rng.uniform(-0.02, 0.02))
    printed = replace(photography.sheath, text=f"CABLEBEND DEMO {seed:04d}", text_pitch=30.0)
    return simulate_specimen(
        folder, experiment, photography=replace(photography, sheath=printed), truth_file=truth_file
    )


def write_specimen(
    folder: Path,
    experiment: Experiment,
    *,
    states: tuple[State, ...],
    photography: Photography | None = None,
    truth_file: Path | None = None,
) -> Written:
    """Photograph and log states bent by any solver.

    Parameters
    ----------
    folder : Path
        Made if missing; existing files of the same names are overwritten.
    experiment : Experiment
        Its effects on instruments and camera are applied here; those on cable and rig must be in ``states``.
    states : tuple of State
        One per displacement.
    photography : Photography or None
        The default camera, light and ground.
    truth_file : Path or None
        Default: beside the folder, named ``<folder>.truth.json``.

    Raises
    ------
    ValueError
        If states and displacements differ in number.
    """
    if len(states) != len(experiment.displacements_m):
        raise ValueError(f"{len(states)} states for {len(experiment.displacements_m)} displacements")
    photography = photography or Photography()
    setup = experiment.setup(photography.camera(experiment, states))
    (folder / "images").mkdir(parents=True, exist_ok=True)
    names = [f"images/step_{number:02d}{photography.suffix}" for number in range(len(states))]
    pictures = []
    lean = _lean(setup, states)
    for number, (name, state) in enumerate(zip(names, states, strict=True)):
        picture = render(photography.scene(experiment, state, setup.camera, number, lean=lean))
        write_picture(folder / name, picture.pixels, jpeg_quality=photography.jpeg_quality)
        pictures.append(replace(picture, pixels=picture.pixels[:0]))  # its truth alone
    if photography.scale == "board":
        _calibrate(folder, experiment, photography, setup.camera, states[0])
    shown, log = _force_log(experiment, setup.readings, states, names)
    (folder / "force.csv").write_text(log, encoding="utf-8")
    (folder / "specimen.toml").write_text(_description(experiment, setup, photography, pictures[0]), encoding="utf-8")
    truth = _truth(experiment, setup, states, pictures, shown)
    truth_file = truth_file or folder.parent / f"{folder.name}.truth.json"
    truth_file.write_text(json.dumps(truth, indent=1), encoding="utf-8")
    return Written(folder, truth_file, truth)


def _lean(setup: Setup, states: tuple[State, ...]) -> float:
    """Sine of the angle by which the plane of the cable is turned about the chord.

    Raises `ValueError` if the bow cannot stand so high.
    """
    bow = max(float(np.max(np.abs(state.y))) for state in states)
    if not setup.bow < bow:
        raise ValueError(Message("misuse.bow", given_m=setup.bow, largest_m=bow))
    return setup.bow / bow


def _calibrate(folder: Path, experiment: Experiment, photography: Photography, camera: Camera, state: State) -> None:
    (folder / "calibration").mkdir(exist_ok=True)
    scene = photography.scene(experiment, state, camera, 10_000)  # a seed no step has
    pixels = render_board(scene, fitted_board(experiment, camera))
    path = folder / "calibration" / f"board{photography.suffix}"
    write_picture(path, pixels, jpeg_quality=photography.jpeg_quality)


def _force_log(
    experiment: Experiment, readings: Readings, states: tuple[State, ...], names: list[str]
) -> tuple[list[float], str]:
    """Noiseless reading at the time of each photo (N), and the text of ``force.csv``."""
    rng = np.random.default_rng([experiment.seed, 1])
    noise = experiment.force_noise * max(abs(state.force) for state in states)
    lines, shown = ["step,branch,time_s,displacement_mm,force_N,image"], []
    times = np.linspace(min(0.5, 0.1 * experiment.hold_s), experiment.hold_s, experiment.samples)
    # 4 digits below the noise: rounding is none of the errors of this log.
    digits = max(5, 3 - int(np.floor(np.log10(noise)))) if noise > 0 else 9
    for number, (state, branch) in enumerate(zip(states, experiment.branches, strict=True)):
        begin = number * experiment.period_s
        force = readings.shown((1.0 + readings.stiffer * number) * state.force, begin, times)
        shown.append(float(force[-1]))
        force = force + noise * rng.standard_normal(times.size)
        for k, (time, value) in enumerate(zip(times, force, strict=True)):
            image = names[number] if k == times.size - 1 else ""
            displacement = 1e3 * experiment.displacements_m[number]
            lines.append(f"{number},{branch},{begin + time:.2f},{displacement:.3f},{value:.{digits}f},{image}")
    return shown, "\n".join(lines) + "\n"


def _description(experiment: Experiment, setup: Setup, photography: Photography, first: Picture) -> str:
    """Text of ``specimen.toml``."""
    length = 1e3 * experiment.length_m * (1.0 + setup.readings.length)
    lines = [
        "[specimen]",
        f"id = {json.dumps(experiment.id, ensure_ascii=False)}",
        f"length_mm = {length:.4f}",
        f"diameter_mm = {1e3 * experiment.diameter_m:.3f}",
        "",
        "[camera]",
    ]
    if photography.scale == "number":
        lines.append(f"scale_px_per_mm = {1e-3 * setup.camera.px_per_m * (1.0 + setup.readings.scale):.6f}")
    elif photography.scale == "board":
        board = fitted_board(experiment, setup.camera)
        square = 1e3 * board.square_m / (1.0 + setup.readings.scale)
        lines.append('calibration = "calibration"')
        lines.append(f"board = {{columns = {board.columns}, rows = {board.rows}, square_mm = {square:.6f}}}")
        if isfinite(setup.camera.distance_m):
            # to the board's plane, which lies below that of the cable's axis
            lines.append(f"distance_mm = {1e3 * (setup.camera.distance_m - board.height_m):.3f}")
    lines += ["", "[rig]", f'moving_bearing = "{experiment.moving}"']
    covers = [cover for cover in photography.covers if cover is not None]
    if len(covers) == 2:
        lines.append(f"bearing_marker_mm = {1e3 * covers[0].diameter_m:.3f}")
    else:
        axes = ", ".join(f"[{u:.2f}, {v:.2f}]" for u, v in (first.left_px, first.right_px))
        lines.append(f"bearings_px = [{axes}]")
    return "\n".join(lines) + "\n"


def _truth(
    experiment: Experiment,
    setup: Setup,
    states: tuple[State, ...],
    pictures: list[Picture],
    shown: list[float],
) -> dict[str, Any]:
    excess = np.linspace(-5.0, 20.0, 251)
    law, rest = setup.test.characteristic, setup.test.rod.section.pre_curvature
    stick_slip = {"ei0": experiment.EI0, "ei1": experiment.EI1, "kc": experiment.kc}
    return {
        "id": experiment.id,
        "seed": experiment.seed,
        "effects": {name: np.atleast_1d(value).tolist() for name, value in experiment.effects.items()},
        **({} if "nonlinear_stiffness" in experiment.effects else stick_slip),
        "K0": float(np.mean(rest)),
        "K0_along": np.interp(np.linspace(0.0, 1.0, TRUTH_POINTS), np.linspace(0.0, 1.0, rest.size), rest).tolist(),
        "law": {
            "excess_per_m": excess.tolist(),
            "moment_Nm": np.asarray(law.moment(excess, np.zeros_like(excess))).tolist(),
            "tangent_Nm2": np.asarray(law.tangent(excess, np.zeros_like(excess))).tolist(),
        },
        "L_mm": 1e3 * experiment.length_m,
        "px_per_mm": 1e-3 * setup.camera.px_per_m,
        "steps": [
            _step(number, experiment, state, picture, force)
            for number, (state, picture, force) in enumerate(zip(states, pictures, shown, strict=True))
        ],
    }


def _step(number: int, experiment: Experiment, state: State, picture: Picture, shown: float) -> dict[str, Any]:
    s = np.linspace(0.0, float(state.s[-1]), TRUTH_POINTS)
    x, y, u, v = (CubicSpline(state.s, row)(s) for row in (state.x, state.y, picture.u_px, picture.v_px))
    kappa, m = (np.interp(s, state.s, row) for row in (state.kappa, state.moment))
    return {
        "step": number,
        "branch": experiment.branches[number],
        "F": state.force,
        "F_shown": shown,
        "chord_mm": 1e3 * state.chord,
        "s_mm": (1e3 * s).tolist(),
        "kappa": kappa.tolist(),
        "m": m.tolist(),
        "xy_mm": (1e3 * np.column_stack([x, y])).tolist(),
        "px": np.column_stack([u, v]).tolist(),
        "left_px": list(picture.left_px),
        "right_px": list(picture.right_px),
    }

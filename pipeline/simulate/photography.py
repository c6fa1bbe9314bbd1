"""How a virtual experiment is photographed: camera over the rig, light, ground, covers, file format, scale.

The rig stands still on the table: X along the chord, the fixed bearing on its place in every photo, the bow toward +Y.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.simulate.experiment import Experiment, State
from pipeline.vision.render import (
    Camera,
    ChessBoard,
    Cover,
    Curve,
    Ground,
    Light,
    Scene,
    Sensor,
    Strand,
    Thing,
)
from pipeline.vision.render.lighting import DIRECTIONAL
from pipeline.vision.render.sheath import Sheath

ScaleSource = Literal["number", "board", "markers", "bearings"]


@dataclass(frozen=True)
class Photography:
    """Camera, light and looks; lengths in m on the table.

    Attributes
    ----------
    width, height : int px
        Of the unturned picture.
    px_per_m : float or None
        None: the chord fills four fifths of the width.
    roll_rad : float
    quarter_turns : int
    mirrored : bool
        Bow up on the photo.
    distance_m : float
        Camera to cable, for tilt and for a board below the axis; ``inf`` for none.
    light, ground, sheath, sensor : records of the renderer
    covers : (Cover or None, Cover or None)
        None shows the cable's ends on the axes.
    things : tuple
        What else is in view.
    scale : str
        How the folder tells the scale: a ``number``, a ``board`` photo, the covers (``markers``) or the displacement
        log (``bearings``).
    suffix : str
        ``.png``, ``.jpg``, ``.tif`` or ``.bmp``.
    jpeg_quality : int
    """

    width: int = 2448
    height: int = 1000
    px_per_m: float | None = None
    roll_rad: float = 0.0
    quarter_turns: int = 0
    mirrored: bool = False
    distance_m: float = inf
    light: Light = DIRECTIONAL
    ground: Ground = field(default_factory=lambda: Ground("brushed", (0.76, 0.76, 0.77), 0.02))
    sheath: Sheath = field(default_factory=lambda: Sheath(gloss=0.3))
    sensor: Sensor = field(default_factory=Sensor)
    covers: tuple[Cover | None, Cover | None] = field(default_factory=lambda: (Cover(), Cover()))
    things: tuple[Thing, ...] = ()
    scale: ScaleSource = "number"
    suffix: str = ".png"
    jpeg_quality: int = 92

    def camera(self, experiment: Experiment, states: tuple[State, ...]) -> Camera:
        """Camera that sees all steps, without hidden lens or tilt."""
        scale = self.px_per_m or 0.8 * self.width / max(state.chord for state in states)
        low = min(_left_axis(experiment, state) for state in states)
        high = max(_left_axis(experiment, state) + state.chord for state in states)
        bow = max(float(np.max(state.y)) for state in states)
        middle = (0.5 * (low + high), 0.5 * bow)
        camera = Camera(
            self.width, self.height, scale, middle, self.roll_rad, self.mirrored, distance_m=self.distance_m
        )
        return camera.turned(self.quarter_turns)

    def scene(self, experiment: Experiment, state: State, camera: Camera, number: int, *, lean: float = 0.0) -> Scene:
        """The photo of one step; ``lean``: sine of the angle by which the cable's plane is turned about the chord."""
        curve = _seen(state, lean)
        # Under a cover the cable goes on a little beyond the axis; without one it ends there.
        over = 0.0 if None in self.covers else 0.25 * min(c.diameter_m for c in self.covers if c is not None)
        place = (_left_axis(experiment, state), 0.0)
        cable = Strand(curve, experiment.diameter_m, self.sheath, place, overhang_m=over)
        seed = int(np.random.SeedSequence([experiment.seed, number]).generate_state(1)[0])
        return Scene(
            cable,
            camera,
            covers=self.covers,
            light=self.light,
            ground=self.ground,
            things=self.things,
            sensor=self.sensor,
            seed=seed,
            ground_seed=experiment.seed,
        )


def fitted_board(experiment: Experiment, camera: Camera) -> ChessBoard:
    """The board of the calibration photo, on the table, half a diameter below the axis, as large as the view takes."""
    square = 0.085 * min(camera.width, camera.height) / camera.px_per_m
    along = int(0.9 * max(camera.width, camera.height) / camera.px_per_m / square) - 3
    turn = camera.roll_rad if camera.width >= camera.height else camera.roll_rad - np.pi / 2
    turn = turn if camera.mirrored else -turn
    rows = 7 if along != 7 else 6  # different counts tell the board's directions apart
    low = -0.5 * experiment.diameter_m
    return ChessBoard(along, rows, square, camera.look_at_m, (0.0, 0.0, turn), low)


def _seen(state: State, lean: float) -> Curve:
    """The curve in the picture: y is foreshortened, and with it arc length, direction and curvature."""
    if not lean:
        return Curve(state.s, state.x, state.y, state.theta, state.kappa)
    flat = np.sqrt(1.0 - lean**2)
    along, across = np.cos(state.theta), flat * np.sin(state.theta)
    shorter = np.hypot(along, across)
    s = CubicSpline(state.s, shorter).antiderivative()(state.s)
    theta = state.theta + np.angle(np.exp(1j * (np.arctan2(across, along) - state.theta)))
    return Curve(s, state.x, flat * state.y, theta, state.kappa * flat / shorter**3)


def _left_axis(experiment: Experiment, state: State) -> float:
    """X of the left axis: 0 if the right bearing is pushed, else so that the right one stays at the cable's length."""
    return 0.0 if experiment.moving == "right" else experiment.length_m - state.chord

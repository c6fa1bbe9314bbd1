"""Causes that can be hidden in a virtual experiment, by the names of the catalogue, and what their values mean.

An effect has one or a few values, the first is its size. It acts in one of three places:

* on the cable or rig: it changes the `rod.bending_test.BendingTest`;
* on what is read: load cell, displacement log, stated length and scale (`Readings`);
* on the camera.

Signs follow the catalogue: a stated value that is too large has a positive error; a load cell that shows too much has a
positive offset, gain or drift; a positive displacement offset pushes the bearing further than the log says.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from pipeline.diagnosis.causes import CATALOGUE
from pipeline.intake.tomltable import nearest
from pipeline.messages import Message
from pipeline.records import Array
from pipeline.vision.render import Camera
from rod.bending_test import BendingTest
from rod.characteristic import Characteristic
from rod.section import InternalFriction

Values = tuple[float, ...]

SPAN_PER_M = 10.0  # ordinates of nonlinear_stiffness lie evenly over K - K0 = 0 .. 10 1/m, as in the paper's Table 1
ONE_SIDED = frozenset(cause.name for cause in CATALOGUE if cause.sign)  # their sizes cannot be negative
POSSIBLE = {
    "stiffness_varying": (-1.0, 1.0),  # a stiffness is positive
    "relaxation": (-1.0, 1.0),  # no more than all of a force is lost
    "force_gain": (-1.0, 10.0),  # a load cell does not turn forces round
    "length_error": (-0.5, 1.0),  # no length is mistaken for its half or double
    "scale_error": (-0.5, 1.0),
    "stiffness_drift": (-0.1, 0.1),  # what changes by a tenth from step to step is another cable
}
"""Between which their sizes lie, neither end included."""

WIDTH = 0.08  # standard deviation of a local kink or soft spot, in lengths: the 15 mm of a splice on a cable of 181 mm


@dataclass(frozen=True)
class Readings:
    """What the rig's instruments and the specimen's description get wrong.

    ``offset`` N, ``gain`` -, ``drift`` N/s; ``relaxation`` share of the force lost and ``relaxation_time`` s;
    ``length`` and ``scale`` relative errors of the stated values. ``stiffer``: share by which the cable itself, and
    with it the force, grows from step to step; where nothing but the cable resists, its shape does not change.
    """

    offset: float = 0.0
    gain: float = 0.0
    drift: float = 0.0
    relaxation: float = 0.0
    relaxation_time: float = 7.0
    length: float = 0.0
    scale: float = 0.0
    stiffer: float = 0.0

    def shown(self, force: float, begin: float, time: Array) -> Array:
        """What the load cell shows (n,) N of a step's ``force``, ``time`` (n,) s after the hold began at ``begin``."""
        held = force * (1.0 - self.relaxation * (1.0 - np.exp(-time / self.relaxation_time)))
        return held * (1.0 + self.gain) + self.offset + self.drift * (begin + time)


@dataclass(frozen=True)
class Setup:
    """Everything an effect can change; ``bow`` (m): how far the largest bow stands up from the plane of the picture."""

    test: BendingTest
    readings: Readings
    camera: Camera
    bow: float = 0.0


class Effect(NamedTuple):
    """A cause that can be hidden: how many values it may have, any number if none is told, and what they change."""

    counts: tuple[int, ...]
    apply: Callable[[Setup, Values], Setup]


def hide(setup: Setup, effects: Mapping[str, float | Values]) -> Setup:
    """Setup with all effects in it; raises `ValueError` if a name is unknown or the number of values is wrong."""
    for name, given in effects.items():
        effect = _effect(name)
        values = tuple(float(v) for v in np.atleast_1d(given))
        if effect.counts and len(values) not in effect.counts:
            counts = {"given": len(values), "counts": effect.counts}
            raise ValueError(Message("misuse.values", name=name, takes=Message(f"effect.{name}"), **counts))
        setup = effect.apply(setup, values)
    return setup


def parse_effect(text: str) -> tuple[str, Values]:
    """Read ``NAME=VALUE`` or ``NAME=VALUE,VALUE``.

    Raises `ValueError` if it cannot be read, or no such value can be; the message names the nearest known name.
    """
    given, _, rest = text.partition("=")
    name = given.strip()
    _effect(name)
    told = {"text": repr(text), "name": name, "takes": Message(f"effect.{name}")}
    try:
        values = tuple(float(part) for part in rest.split(","))
    except ValueError:
        values = (np.nan,)
    if not np.all(np.isfinite(values)):
        raise ValueError(Message("misuse.no-number", **told))
    low, high = POSSIBLE.get(name, (-np.inf, np.inf))
    if name in ONE_SIDED and min(values) < 0.0:
        raise ValueError(Message("misuse.negative", **told))
    if not low < values[0] < high:
        raise ValueError(Message("misuse.impossible", **told, low=low, high=high))
    return name, values


def check_geometry(length: float, pre_curvature: float, effects: Mapping[str, float | Values]) -> None:
    """Refuse what does not fit a cable of this length.

    Raises `ValueError` with the figures: a cable rolled up to more than a half circle at rest has no chord to be pushed
    along, and stiff ends of more than a quarter of the length each leave less cable than clamp.
    """
    K0 = float(np.atleast_1d(effects.get("pre_curvature", pre_curvature))[0])
    if not abs(K0) * length < np.pi:
        raise ValueError(Message("misuse.rolled-up", K0=K0, length_m=length, most=np.pi / length))
    stiff = float(np.atleast_1d(effects.get("rigid_ends", 0.0))[0])
    if not 4.0 * stiff < length:
        left_m = length - 2.0 * stiff
        raise ValueError(Message("misuse.rigid-ends", stiff_m=stiff, left_m=left_m, length_m=length, most_m=length / 4))


def _effect(name: str) -> Effect:
    if name in EFFECTS:
        return EFFECTS[name]
    near = nearest(name, EFFECTS)
    key = "misuse.no-cause-near" if near else "misuse.no-cause"
    raise ValueError(Message(key, name=repr(name), known=[near] if near else EFFECTS))


def _along(values: Values) -> Callable[[Array], Array]:
    """Deviation along the cable: linear, from -size to size; or, with a place, a local bump there."""
    if len(values) == 1:
        return lambda u: values[0] * (2.0 * u - 1.0)
    return lambda u: values[0] * np.exp(-0.5 * ((u - values[1]) / WIDTH) ** 2)


def _stiffness(setup: Setup, values: Values) -> Setup:
    knots = np.linspace(0.0, SPAN_PER_M, max(len(values), 2))
    ordinates = np.broadcast_to(values, knots.shape)
    law = Characteristic.from_ordinates(knots, ordinates, reading="tangent", abscissa="excess")
    return replace(setup, test=replace(setup.test, characteristic=law))


def _varying_pre_curvature(setup: Setup, values: Values) -> Setup:
    mean, deviation = float(np.mean(setup.test.rod.section.pre_curvature)), _along(values)
    return replace(setup, test=replace(setup.test, pre_curvature=lambda u: mean + deviation(u)))


def _varying_stiffness(setup: Setup, values: Values) -> Setup:
    deviation = _along(values)
    return replace(setup, test=replace(setup.test, stiffness_profile=lambda u: 1.0 + deviation(u)))


def _hysteresis(setup: Setup, values: Values) -> Setup:
    stick = values[1] if len(values) > 1 else 3.0
    return replace(setup, test=replace(setup.test, friction=InternalFriction(values[0], stick)))


def _load(setup: Setup, values: Values) -> Setup:
    return replace(setup, test=replace(setup.test, load=(values[0], values[1])))


def _tilt(setup: Setup, values: Values) -> Setup:
    return replace(setup, camera=replace(setup.camera, perspective_per_m=(values[0], sum(values[1:]))))


def _in(place: Literal["test", "readings", "camera"], *fields: str) -> Callable[[Setup, Values], Setup]:
    """The values, in their order, are those of fields of a part of the set-up."""

    def apply(setup: Setup, values: Values) -> Setup:
        part: Any = getattr(setup, place)
        changes: dict[str, Any] = {place: replace(part, **dict(zip(fields, values, strict=False)))}
        return replace(setup, **changes)

    return apply


def _in_bearings(field: str) -> Callable[[Setup, Values], Setup]:
    """The value is that of a field of both bearings."""

    def apply(setup: Setup, values: Values) -> Setup:
        change: dict[str, Any] = {field: values[0]}
        left, right = (replace(end, **change) for end in (setup.test.left, setup.test.right))
        return replace(setup, test=replace(setup.test, left=left, right=right))

    return apply


EFFECTS: dict[str, Effect] = {
    "nonlinear_stiffness": Effect((), _stiffness),
    "pre_curvature": Effect((1,), _in("test", "pre_curvature")),
    "pre_curvature_varying": Effect((1, 2), _varying_pre_curvature),
    "stiffness_varying": Effect((1, 2), _varying_stiffness),
    "hysteresis": Effect((1, 2), _hysteresis),
    "plastic_set": Effect((1,), _in("test", "plastic_rate")),
    "relaxation": Effect((1, 2), _in("readings", "relaxation", "relaxation_time")),
    "bearing_friction": Effect((1,), _in_bearings("friction_moment")),
    "bearing_stiffness": Effect((1,), _in_bearings("stiffness")),
    "rigid_ends": Effect((1,), _in_bearings("rigid_length")),
    "rig_compliance": Effect((1,), _in("test", "compliance")),
    "displacement_offset": Effect((1,), _in("test", "displacement_offset")),
    "length_error": Effect((1,), _in("readings", "length")),
    "force_offset": Effect((1,), _in("readings", "offset")),
    "force_drift": Effect((1,), _in("readings", "drift")),
    "force_gain": Effect((1,), _in("readings", "gain")),
    "in_plane_load": Effect((2,), _load),
    "scale_error": Effect((1,), _in("readings", "scale")),
    "lens_distortion": Effect((1,), _in("camera", "k1")),
    "camera_tilt": Effect((1, 2), _tilt),
    "out_of_plane_bow": Effect((1,), lambda setup, values: replace(setup, bow=values[0])),
    "stiffness_drift": Effect((1,), _in("readings", "stiffer")),
}

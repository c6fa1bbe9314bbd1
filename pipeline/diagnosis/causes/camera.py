"""What the camera gets wrong: scale, radial distortion, tilt.

All three move points on the plane of the cable, seen from the centre of the picture: true place ``p`` (relative to the
centre, m) goes to the place that the photo with its stated scale claims. Bearings and cable are moved alike and the
chord frame is laid through the moved bearings, so chord and shape change together.

    scale_error      p -> p / (1 + e)                       e: stated px/mm over true px/mm, minus 1
    lens_distortion  p -> p (1 + k1 |p|^2 / R^2)            R: half the picture's diagonal on the plane
    camera_tilt      p -> p / (1 + g . p)                   g: perspective terms along and across the chord, 1/m

A tilt phi seen from the distance D has g = sin(phi) / D, and changes lengths by the square of phi as well, half a
percent at 6 degrees, fifty times what a photo shows. A tilt that large has D^2 as a second number, positive where the
camera is turned about the rig, cos(phi) along the tilt; negative where it leans where it stands and the rig is cut from
the side of its picture, 1 / cos(phi)^2 along the tilt and 1 / cos(phi) across it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.cause import Cause, Variant
from pipeline.diagnosis.observations.prediction import Facts, Model, Observer, Prediction

Array = NDArray[np.float64]
USUAL, FAR = 3.0, 6.0
"""Camera to cable in lengths: usual, and farthest: a long lens, before which a tilt is hardly seen otherwise."""

STEEP = 4.0
"""Multiple of the usual amount at which the trace of a steep tilt is computed: nearly its plausible size."""

STEEPEST = 0.3
"""Sine of the largest tilt: beyond 17 degrees anybody sees it."""

DISTORTED = 0.01
"""Radial distortion at half the picture's diagonal by a common zoom lens."""


def tilt_of(length: float) -> float:
    """Perspective term, 1/m, of two degrees seen from twice a cable's length."""
    return float(np.tan(np.radians(2.0)) / (2.0 * length))


Move = Callable[[Array, Array], tuple[Array, Array]]


def seen_through(move: Move) -> Observer:
    """Observer whose camera shows the point (x, y), counted from the centre of the picture, at ``move(x, y)``."""

    def observer(prediction: Prediction, facts: Facts) -> Prediction:
        centre = facts.picture_centre
        chord = prediction.chord[..., None]
        # the two bearings travel as two more points; a short tangent at every point carries its direction along
        x = np.concatenate([np.zeros_like(chord), chord, prediction.x], axis=-1) - centre[:, :1]
        y = np.concatenate([np.zeros_like(chord), np.zeros_like(chord), prediction.y], axis=-1) - centre[:, 1:]
        direction = np.concatenate([np.zeros_like(chord), np.zeros_like(chord), prediction.theta], axis=-1)
        reach = 1e-4 * facts.length
        seen_x, seen_y = move(x, y)
        tip_x, tip_y = move(x + reach * np.cos(direction), y + reach * np.sin(direction))
        span_x, span_y = seen_x[..., 1] - seen_x[..., 0], seen_y[..., 1] - seen_y[..., 0]
        roll = np.arctan2(span_y, span_x)[..., None]
        rel_x, rel_y = seen_x[..., 2:] - seen_x[..., :1], seen_y[..., 2:] - seen_y[..., :1]
        turned = np.arctan2(tip_y - seen_y, tip_x - seen_x)[..., 2:] - roll - prediction.theta
        return replace(
            prediction,
            chord=np.hypot(span_x, span_y),
            x=np.cos(roll) * rel_x + np.sin(roll) * rel_y,
            y=np.cos(roll) * rel_y - np.sin(roll) * rel_x,
            # the direction is kept on the branch of the true one: slopes may pass 90 degrees
            theta=prediction.theta + turned - 2.0 * np.pi * np.round(turned / (2.0 * np.pi)),
        )

    return observer


def scaled(error: float) -> Observer:
    """Observer whose stated px/mm is ``1 + error`` times the true one: all lengths and the chord shrink by that."""
    factor = 1.0 / (1.0 + error)

    def observer(prediction: Prediction, facts: Facts) -> Prediction:
        return replace(
            prediction,
            chord=factor * prediction.chord,
            s=factor * prediction.s,
            x=factor * prediction.x,
            y=factor * prediction.y,
        )

    return observer


def axes_off(errors: Array) -> Observer:
    """Observer that takes the bearing axes at (left along, left across, right along, right across) (4,) m off them.

    A fifth number is the part of their way from the centre of the picture by which both are seen farther out. The chord
    frame is laid through what is taken for the axes. Three more are what is left of tilt along and across the chord
    (1/m) and of the lens's distortion.
    """
    parallax, along, across, lens = errors[4:]

    def observer(prediction: Prediction, facts: Facts) -> Prediction:
        square = facts.half_diagonal**2

        def move(x: Array, y: Array) -> tuple[Array, Array]:
            grow = (1.0 + lens * (x * x + y * y) / square) / (1.0 + along * x + across * y)
            return x * grow, y * grow

        prediction = seen_through(move)(prediction, facts)
        left = errors[:2] - parallax * facts.picture_centre
        span = (1.0 + parallax) * prediction.chord + errors[2] - errors[0]
        rise = errors[3] - errors[1]
        roll = np.arctan2(rise, span)[..., None]
        rel_x, rel_y = prediction.x - left[:, :1], prediction.y - left[:, 1:]
        return replace(
            prediction,
            chord=np.hypot(span, rise),
            x=np.cos(roll) * rel_x + np.sin(roll) * rel_y,
            y=np.cos(roll) * rel_y - np.sin(roll) * rel_x,
            theta=prediction.theta - roll,
        )

    return observer


class ScaleError(Cause):
    """``scale_error``: the stated px/mm is not the true one."""

    name = "scale_error"
    unit = "-"
    seat = "camera"

    def plausible(self, facts: Facts) -> float:
        """One percent: a scale read from a ruler one cable radius off the plane."""
        return 0.01

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Everything the camera sees shrinks by ``1 + amount``."""
        return model.observed(scaled(amount))


class LensDistortion(Cause):
    """``lens_distortion``: radial distortion left in the photos."""

    name = "lens_distortion"
    unit = "-"
    limited = True
    seat = "camera"

    def plausible(self, facts: Facts) -> float:
        """One percent at half the diagonal: a common zoom lens."""
        return DISTORTED

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Points move out by ``amount`` times the cube of their distance from the centre."""
        square = facts.half_diagonal**2

        def move(x: Array, y: Array) -> tuple[Array, Array]:
            grow = 1.0 + amount * (x * x + y * y) / square
            return x * grow, y * grow

        return model.observed(seen_through(move))


LEAN = 0.1
"""Of the usual tilt of a camera: a fifth of a degree, what a good spirit level leaves."""


class CameraTilt(Cause):
    """``camera_tilt``: the camera does not look straight down."""

    name = "camera_tilt"
    unit = "1/m"
    combines = True
    limited = True
    seat = "camera"

    def plausible(self, facts: Facts) -> float:
        """Two degrees seen from twice the cable's length."""
        return tilt_of(facts.length)

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Tilt along and across the chord, by perspective alone and steep, with the signed D^2 as ``width``, m^2."""
        lean, square = LEAN * tilt_of(facts.length), facts.length**2
        plain = (
            Variant("along the chord", at=0.0, ordinary=lean),
            Variant("across the chord", at=1.0, ordinary=lean),
        )
        steep = tuple(
            replace(
                form,
                label=f"{form.label}, steep",
                ordinary=0.0,
                width=USUAL**2 * square,
                tuned=("width",),
                width_range=(-(FAR**2) * square, FAR**2 * square),
                setting="steep",
                trace=trace,
            )
            for form in plain
            # what grows with the square of the tilt does not change its sign, so neither trace tells of the other
            for trace in (STEEP, -STEEP)
        )
        return (*plain, *steep)

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """The scale falls by ``amount`` per metre along (``at`` 0) or across (``at`` 1) the chord.

        Beside a tilt in the other direction the picture is sheared too: turned by both, a point that lies off along the
        chord has sunk by the first turn when the second one moves it across (product of both rotations).
        """
        across = variant.at > 0.5
        sine = float(np.clip(amount * np.sqrt(abs(variant.width)), -STEEPEST, STEEPEST))
        shorter, both = float(np.sqrt(1.0 - sine**2)), sine * model.lean[0 if across else 1]
        own, other, sheared = (shorter, 1.0, -both) if variant.width >= 0.0 else (shorter**-2, 1.0 / shorter, both)

        def move(x: Array, y: Array) -> tuple[Array, Array]:
            if across:
                return x * other / (1.0 + amount * y), (y * own + x * sheared) / (1.0 + amount * y)
            return (x * own + y * sheared) / (1.0 + amount * x), y * other / (1.0 + amount * x)

        lean = model.lean[0] + (not across) * sine, model.lean[1] + across * sine
        return replace(model.observed(seen_through(move)), lean=lean)

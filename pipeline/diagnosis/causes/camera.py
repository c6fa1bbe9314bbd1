"""What the camera gets wrong: scale, radial distortion, tilt.

All three move points on the plane of the cable, seen from the centre of the picture: true place ``p`` (relative to the
centre, m) goes to the place that the photo with its stated scale claims. Bearings and cable are moved alike and the
chord frame is laid through the moved bearings, so chord and shape change together.

    scale_error      p -> p / (1 + e)                       e: stated px/mm over true px/mm, minus 1
    lens_distortion  p -> p (1 + k1 |p|^2 / R^2)            R: half the picture's diagonal on the plane
    camera_tilt      p -> p / (1 + g . p)                   g: perspective terms along and across the chord, 1/m

A tilt phi seen from the distance D has g = sin(phi) / D, and foreshortens its own direction by cos(phi) as well: half a
percent at 6 degrees, fifty times what a photo shows. A tilt that large has the distance as a second number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.cause import Cause, Variant
from pipeline.diagnosis.observations.prediction import Facts, Model, Observer, Prediction

Array = NDArray[np.float64]
DISTANCES = (1.0, 3.0, 15.0)
"""Camera to cable in lengths: nearest (all of it is hardly seen), usual, and farthest (a tilt is none from there)."""

STEEP = 4.0
"""Multiple of the usual amount at which the trace of a steep tilt is computed: nearly its plausible size."""

STEEPEST = 0.95
"""Sine of the largest tilt."""

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
        turned = np.arctan2(tip_y - seen_y, tip_x - seen_x)[..., 2:] - roll
        return replace(
            prediction,
            chord=np.hypot(span_x, span_y),
            x=np.cos(roll) * rel_x + np.sin(roll) * rel_y,
            y=np.cos(roll) * rel_y - np.sin(roll) * rel_x,
            # the direction is kept on the branch of the true one: slopes may pass 90 degrees
            theta=prediction.theta + np.angle(np.exp(1j * (turned - prediction.theta))),
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
        """Tilt along and across the chord, each without and with what it foreshortens, seen from ``width`` (m)."""
        lean = LEAN * tilt_of(facts.length)
        plain = (
            Variant("along the chord", at=0.0, ordinary=lean),
            Variant("across the chord", at=1.0, ordinary=lean),
        )
        labels = ("along the chord, and foreshortened", "across the chord, and foreshortened")
        steep = tuple(
            replace(
                form,
                label=label,
                ordinary=0.0,
                width=DISTANCES[1] * facts.length,
                tuned=("width",),
                width_range=(DISTANCES[0] * facts.length, DISTANCES[-1] * facts.length),
                setting="foreshortened",
                trace=trace,
            )
            for form, label in zip(plain, labels, strict=True)
            # what is foreshortened does not change its sign with the tilt, so neither trace tells of the other
            for trace in (STEEP, -STEEP)
        )
        return (*plain, *steep)

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """The scale falls by ``amount`` per metre along (``at`` 0) or across (``at`` 1) the chord.

        Beside a tilt in the other direction the picture is sheared too: turned by both, a point that lies off along the
        chord has sunk by the first turn when the second one moves it across (product of both rotations).
        """
        across = variant.at > 0.5
        # a refit may step anywhere: beyond 70 degrees the camera looks along the table
        sine = float(np.clip(amount * variant.width, -STEEPEST, STEEPEST))
        shorter, sheared = float(np.sqrt(1.0 - sine**2)), -sine * model.lean[0 if across else 1]

        def move(x: Array, y: Array) -> tuple[Array, Array]:
            if across:
                return x / (1.0 + amount * y), (y * shorter + x * sheared) / (1.0 + amount * y)
            return (x * shorter + y * sheared) / (1.0 + amount * x), y / (1.0 + amount * x)

        lean = model.lean[0] + (not across) * sine, model.lean[1] + across * sine
        return replace(model.observed(seen_through(move)), lean=lean)

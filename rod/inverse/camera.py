"""How a camera shows the plane of the cable: scale, tilt and lens, and bearing axes that were found beside their place.

An observer turns a prediction into what the photo claims. Points are counted from the centre of the picture; bearings
and cable are moved alike, and the chord frame is laid through the moved bearings. All lengths in m, tilts in 1/m.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rod.array import Array
from rod.inverse.prediction import Facts, Observer, Prediction

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


def scaled(error: Array | float) -> Observer:
    """Observer whose stated px/mm is ``1 + error`` times the true one: all lengths and the chord shrink by that.

    Of k errors (k,) it makes k variations of a prediction.
    """
    factor = 1.0 / (1.0 + np.asarray(error)[..., None])

    def observer(prediction: Prediction, facts: Facts) -> Prediction:
        return replace(
            prediction,
            chord=factor * prediction.chord,
            s=factor * prediction.s,
            x=factor[..., None] * prediction.x,
            y=factor[..., None] * prediction.y,
        )

    return observer


def axes_off(errors: Array) -> Observer:
    """Observer that takes the bearing axes at (left along, left across, right along, right across) (4,) m off them.

    A fifth number is the part of their way from the centre of the picture by which both are seen farther out. The chord
    frame is laid through what is taken for the axes. Three more are what is left of tilt along and across the chord
    (1/m) and of the lens's distortion. Of errors (k, 8) it makes k variations of a prediction.
    """
    parallax, along, across, lens = np.moveaxis(errors[..., 4:], -1, 0)[..., None, None]

    def observer(prediction: Prediction, facts: Facts) -> Prediction:
        square = facts.half_diagonal**2

        def move(x: Array, y: Array) -> tuple[Array, Array]:
            grow = (1.0 + lens * (x * x + y * y) / square) / (1.0 + along * x + across * y)
            return x * grow, y * grow

        prediction = seen_through(move)(prediction, facts)
        left = errors[..., None, :2] - parallax * facts.picture_centre
        apart, rise = np.moveaxis(errors[..., 2:4] - errors[..., :2], -1, 0)[..., None]
        span = (1.0 + parallax[..., 0]) * prediction.chord + apart
        roll = np.arctan2(rise, span)[..., None]
        rel_x, rel_y = prediction.x - left[..., :1], prediction.y - left[..., 1:]
        return replace(
            prediction,
            chord=np.hypot(span, rise),
            x=np.cos(roll) * rel_x + np.sin(roll) * rel_y,
            y=np.cos(roll) * rel_y - np.sin(roll) * rel_x,
            theta=prediction.theta - roll,
        )

    return observer

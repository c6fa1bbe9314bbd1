"""What the camera gets wrong: scale, radial distortion, tilt.

All three move points on the plane of the cable, seen from the centre of the picture: true place ``p`` (relative to the
centre, m) goes to the place that the photo with its stated scale claims. Bearings and cable are moved alike and the
chord frame is laid through the moved bearings, so chord and shape change together.

    scale_error      p -> p / (1 + e)                       e: stated px/mm over true px/mm, minus 1
    lens_distortion  p -> p (1 + k1 q + k2 q^2)             q = |p|^2 / R^2, R: half the picture's diagonal on the plane
    camera_tilt      p -> p / (1 + g . p)                   g: perspective terms along and across the chord, 1/m

A tilt phi seen from the distance D has g = sin(phi) / D, and changes lengths by the square of phi as well, half a
percent at 6 degrees, fifty times what a photo shows. A tilt that large has its direction and D^2 as further numbers, in
place of one along and one across the chord; D^2 is positive where the camera is turned about the rig, cos(phi) along
the tilt; negative where it leans where it stands and the rig is cut from the side of its picture, 1 / cos(phi)^2 along
the tilt and 1 / cos(phi) across it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.records import Array
from rod.inverse.camera import DISTORTED, scaled, seen_through, tilt_of
from rod.inverse.cause import Cause, Variant
from rod.inverse.prediction import Facts, Model

USUAL, FAR = 3.0, 12.0
"""Camera to cable in lengths: usual, and farthest: a long lens, before which a tilt is hardly seen otherwise."""

STEEP = 4.0
"""Multiple of the usual amount at which the trace of a steep tilt is computed: nearly its plausible size."""

STEEPEST = 0.3
"""Sine of the largest tilt: beyond 17 degrees anybody sees it."""


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

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """The first two terms of the series in the square of the distance; ``at``: the power of that square."""
        return (
            Variant("with the cube of the distance", at=1.0, component=True),
            Variant("with its fifth power", at=2.0, component=True, rare=True),
        )

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Points move out by ``amount`` times the third or fifth power of their distance from the centre."""
        square = facts.half_diagonal**2

        def move(x: Array, y: Array) -> tuple[Array, Array]:
            grow = 1.0 + amount * ((x * x + y * y) / square) ** variant.at
            return x * grow, y * grow

        return model.observed(seen_through(move))


class CameraTilt(Cause):
    """``camera_tilt``: the camera does not look straight down."""

    name = "camera_tilt"
    unit = "1/m"
    limited = True
    seat = "camera"

    def plausible(self, facts: Facts) -> float:
        """Two degrees seen from twice the cable's length."""
        return tilt_of(facts.length)

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Perspective alone, along and across the chord; steep in any direction, with the signed D^2 as ``width``, m^2.

        ``at`` is the direction, in rad from the chord toward the bow.
        """
        square = facts.length**2
        steep = Variant(
            "steep enough to shorten the picture",
            width=USUAL**2 * square,
            tuned=("at", "width"),
            at_range=(-0.75 * np.pi, 0.75 * np.pi),
            width_range=(-(FAR**2) * square, FAR**2 * square),
            setting="steep",
        )
        return (
            Variant("along the chord", at=0.0, component=True),
            Variant("across the chord", at=0.5 * np.pi, component=True),
            # what grows with the square of the tilt does not change its sign, so no trace tells of the others
            *(
                replace(steep, at=at, width=way * steep.width, trace=trace)
                for at in (0.0, 0.25 * np.pi, 0.5 * np.pi, -0.25 * np.pi)
                for way in (1.0, -1.0)
                for trace in (STEEP, -STEEP)
            ),
        )

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """The scale falls by ``amount`` per metre in a direction, and lengths with the square of the tilt."""
        sine = float(np.clip(amount * np.sqrt(abs(variant.width)), -STEEPEST, STEEPEST))
        flat, (cosine, turned) = np.sqrt(1.0 - sine**2), (fn(variant.at) for fn in (np.cos, np.sin))
        own, other = (flat, 1.0) if variant.width >= 0.0 else (flat**-2, 1.0 / flat)

        def move(x: Array, y: Array) -> tuple[Array, Array]:
            along, across = cosine * x + turned * y, cosine * y - turned * x
            nearer = 1.0 / (1.0 + amount * along)
            along, across = own * nearer * along, other * nearer * across
            return cosine * along - turned * across, cosine * across + turned * along

        return model.observed(seen_through(move))

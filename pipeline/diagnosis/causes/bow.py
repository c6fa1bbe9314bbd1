"""``out_of_plane_bow``: the cable leaves the plane of the picture and is seen foreshortened.

The cable stays the plane curve (x, y) that the rod makes, but its plane is turned about the chord by an angle phi, with
sin(phi) = height / largest y: in the picture y shrinks to y cos(phi), chord and forces are what they were. What stands
up to z = y sin(phi) toward a camera at the distance D is seen larger as well, by 1 / (1 - z / D) from the centre of the
picture.

From step to step the height goes with a power of the bow, from none to the square: one height in all photos, one lean,
or a height that grows with the travel. What stands up as h sin(pi s / L) over a bow in the plane is to leading order
the same: with the same chord and length the bow is seen as sqrt(y^2 - h^2).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rod.inverse.cause import Cause, Variant
from rod.inverse.prediction import Facts, Model, Prediction

SOFT = 8
"""How sharply the sine of the angle comes to its end at one: at 0.7 it is still right to 0.7 %."""

LEAST = 1e-3
"""Share of the largest bow below which a cable counts as straight."""

NEAR = (0.1, 1.0)
"""Length over the distance of a near camera, least and most: below, no bow stands up far enough to be seen larger."""

GROWTH = (0.0, 2.0)
"""Power of the bow with which the height goes, least and most: a height in proportion to the travel goes with its
square."""


class OutOfPlaneBow(Cause):
    """``out_of_plane_bow``: the cable rises from the plane of the picture between the bearings."""

    name = "out_of_plane_bow"
    unit = "m"
    sign = 1
    limited = True
    seat = "cable"

    def plausible(self, facts: Facts) -> float:
        """A sixth of the bow: a lean of ten degrees."""
        return facts.moment_scale / facts.force_scale / 6.0

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """The same height in all photos (``at`` 0) or the same lean (1), seen by a far or a near camera (``width``).

        ``width`` is the length over the distance of the camera, negative where the bow leads away from it; 0 from afar,
        where nothing but the height shrinks the bow: a near camera tells of their product first.
        """
        low, high = NEAR
        near = Variant(width=0.5 * (low + high), tuned=("at", "width"), at_range=GROWTH, width_range=NEAR)
        views = (
            # what is foreshortened grows with the square of the height
            Variant(tuned=("at",), at_range=GROWTH, trace=4.0, power=2.0),
            near,
            replace(near, width=-near.width, width_range=(-high, -low)),
        )
        return tuple(
            replace(view, label=label, at=at)
            for label, at in (("at one height in all photos", 0.0), ("at one angle in all photos", 1.0))
            for view in views
        )

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Lean the plane of the cable so far that the largest bow stands ``amount`` up."""

        def observer(prediction: Prediction, facts: Facts) -> Prediction:
            bow = np.max(np.abs(prediction.y), axis=-1, keepdims=True)
            top = bow.max(axis=-2, keepdims=True)
            sine = amount / top * (np.maximum(bow, LEAST * top) / top) ** (variant.at - 1.0)
            lean = sine / (1.0 + np.abs(sine) ** SOFT) ** (1.0 / SOFT)
            flat = np.sqrt(1.0 - lean**2)
            x = prediction.x - facts.picture_centre[:, :1]
            y = flat * prediction.y - facts.picture_centre[:, 1:]
            near = variant.width / facts.length * lean
            larger = 1.0 / (1.0 - near * prediction.y)
            grows = larger**2 * near * np.sin(prediction.theta)
            along = larger * np.cos(prediction.theta) + grows * x
            across = larger * flat * np.sin(prediction.theta) + grows * y
            turned = np.arctan2(across, along) - prediction.theta
            return replace(
                prediction,
                x=larger * x + facts.picture_centre[:, :1],
                y=larger * y + facts.picture_centre[:, 1:],
                theta=prediction.theta + np.angle(np.exp(1j * turned)),
            )

        return model.observed(observer)

"""One photo beside the simulated cable: distances and curvatures, the errors of its own bearing axes taken out.

The axes found on a photo are off by a fraction of a pixel, which turns and shifts all of its midline. How far is part
of the noise of the fit; for a picture of what the simulation misses its likeliest value is taken off.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rod.array import Array
from rod.inverse.fit import Fit
from rod.inverse.noise import by_axes
from rod.inverse.observation import Observation, PhotoData, Places, foot_points
from rod.measurement import MeasuredShape
from rod.midline import Midline


class PhotoFit(NamedTuple):
    """Distance (n,) m of measured places from the simulated cable along its normal, and its curvature there, 1/m."""

    distance: Array
    kappa: Array


def photo_fit(observation: Observation, fitted: Fit, photo: PhotoData, of: Midline | MeasuredShape) -> PhotoFit:
    """The simulated cable beside the sections of a photo, or beside its smooth curve.

    Parameters
    ----------
    observation : Observation
    fitted : Fit
        With a prediction.
    photo : PhotoData
    of : Midline or MeasuredShape
        Of this photo.
    """
    prediction = fitted.run.prediction
    assert prediction is not None
    foot = foot_points(Places(np.full(len(of.s), photo.step), of.s, of.x, of.y, ()), prediction)
    distance = np.cos(foot.direction) * foot.gap_y - np.sin(foot.direction) * foot.gap_x
    step = fitted.run.steps[photo.step]
    kappa = np.interp(prediction.s[foot.left] + foot.t * foot.width, prediction.s, step.kappa)
    return PhotoFit(distance - by_axes(of, photo.chord)[1:] @ _axis_errors(observation, fitted, photo), kappa)


def distance_std(photo: PhotoData, shape: MeasuredShape) -> Array:
    """Standard deviation (n,) m of `photo_fit`'s distance to the smooth curve of a photo, errors of its axes apart."""
    sections = np.column_stack([np.interp(photo.sections.s, shape.s, column) for column in shape.basis_normal.T])
    taken = by_axes(shape, photo.chord)[1:] @ _likeliest(photo) @ photo.whiten[:, 1:]
    left = shape.basis_normal - taken @ sections
    return np.asarray(np.sqrt(np.maximum(np.einsum("ip,pq,iq->i", left, shape.covariance, left), 0.0)))


def _axis_errors(observation: Observation, fitted: Fit, photo: PhotoData) -> Array:
    """The likeliest errors (4,) m of the axes of a photo, in the order of `by_axes`."""
    own = observation.separated(fitted.residual[: observation.rows.count])[observation.rows.of_photo(photo.step)]
    return np.asarray(_likeliest(photo) @ own)


def _likeliest(photo: PhotoData) -> Array:
    """What takes whitened rows of a photo to the likeliest errors of its axes: (4, rows) m."""
    return np.asarray(0.5 * photo.stated_chord_std**2 * (photo.whiten @ by_axes(photo.sections, photo.chord)).T)

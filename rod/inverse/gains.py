"""How a fitted law responds to every source of error, and what it is without the force-free photo.

To first order the law moves by ``response J^T W dr`` where the whitened residual changes by dr, and by
``-response L d`` where a nuisance is off by d that its prior, of precision L, takes for zero. Sources are named as
those of the balance equations, so that a comparison of both ways knows what they have in common.
"""

from __future__ import annotations

import numpy as np

from rod.array import Array
from rod.inverse.base import AXES
from rod.inverse.fit import Fit
from rod.inverse.mean_law import force_rows, linearised, rows_posterior, weights
from rod.inverse.noise import by_axes
from rod.inverse.observation import DISPLACEMENT_STD, Observation, PhotoData, observe
from rod.measured_law import Source
from rod.measurement import MeasuredTest


def gains(test: MeasuredTest, observation: Observation, fitted: Fit, response: Array) -> dict[Source, Array]:
    """Response of log(tangent) to the sources of error, each per standard deviation, see `rod.measured_law`.

    Parameters
    ----------
    test : MeasuredTest
    observation : Observation
    fitted : Fit
    response : (n, p)
        Change of log(tangent) by the gradient of half of chi-square, its sign turned.
    """
    base = fitted.extension.base
    count, known = observation.rows.count, fitted.extension.prior[: base.known]
    found = {name: -response @ (known.T @ (known @ d))[:, None] for name, d in _nuisances(test, fitted).items()}
    onto = response @ (fitted.jacobian[:count].T * weights(observation, fitted) ** 2)
    for photo in observation.photos:
        for name, columns in _errors_of(photo).items():
            rows = np.zeros((count, columns.shape[1]))
            rows[observation.rows.of_photo(photo.step)] = photo.whiten @ columns
            found[name, test.steps[photo.step].step] = onto @ observation.joined(rows)
    for i, step in enumerate(test.steps):
        if len(observation.forces[i]):
            rows = np.zeros((count, 1))
            newtons = step.force_std * np.eye(len(test.steps))[i]
            rows[observation.rows.force, 0] = np.concatenate(force_rows(observation, newtons))
            found["force", step.step] = onto @ rows
    return found


def _nuisances(test: MeasuredTest, fitted: Fit) -> dict[Source, Array]:
    """Changes (p,) of the vector by one standard deviation of each common error."""
    base = fitted.extension.base
    unit = dict(zip(base.names, np.eye(fitted.extension.size), strict=False))
    found: dict[Source, Array] = {("scale", -1): base.scale_std * unit["scale"]}
    found["length", -1] = base.length_std * unit["length"]
    if base.axes:
        found |= {(name, -1): base.axis_std * unit[name] for name in AXES[:4]}
        beside = base.axis_parallax_std * base.camera_foot_std
        for way in ("along", "across"):
            found[f"foot_{way}", -1] = beside * (unit[f"left_{way}"] + unit[f"right_{way}"])
        found["parallax", -1] = base.axis_parallax_std * unit["parallax"]
    names = base.names[base.moved_at]
    for name, step, std in zip(names, base.moved, base.moved_std, strict=True):
        found["displacement", test.steps[step].step] = std * unit[name]
    return found


def _errors_of(photo: PhotoData) -> dict[str, Array]:
    """Errors of one photo: what a standard deviation of each does to (chord, sections), (1 + b, k)."""
    axis = photo.stated_chord_std / np.sqrt(2.0) * by_axes(photo.sections, photo.chord)
    chord = np.eye(len(axis), 1)
    return {
        "photo": np.vstack([np.zeros(len(photo.sections.s)), photo.sections.factor]),
        "chord": DISPLACEMENT_STD * chord,
    } | {name: axis[:, [k]] for k, name in enumerate(AXES[:4])}


def loaded_pre_curvature(
    test: MeasuredTest, observation: Observation, fitted: Fit, rest: frozenset[int], *, functions: int
) -> tuple[float, float]:
    """K0 and its standard deviation, 1/m, without the photos of the steps ``rest``: a witness of its own."""
    at = fitted.extension.base.pre_curvature_index
    value, J = linearised(observation, fitted)
    count, kept = observation.rows.count, ~np.isin(observation.rows.step, list(rest))
    if kept.all():
        return float(fitted.vector[at]), float(np.sqrt(rows_posterior(fitted, value, J).covariance[at, at]))
    alone = observe(
        test, photo_noise=observation.photo_noise, functions=functions, without_photos=rest, without_forces=rest
    )
    weight = weights(observation, fitted)

    def without(rows: Array) -> Array:
        left = alone.joined(observation.separated((rows[:count].T / weight).T)[kept])
        return np.concatenate([(left.T * weight[kept]).T, rows[count:]])

    found = rows_posterior(fitted, without(value), without(J))
    return float(found.mean[at]), float(np.sqrt(found.covariance[at, at]))

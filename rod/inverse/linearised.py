"""How the whitened residual moves with the prediction: from predictions moved a little to columns, all at once.

The distance of a section from the curve is stationary along the curve at its foot point, so the foot points found for
the prediction serve for all that is near it: a column is what the curve does there, across itself. Exact to first
order; a column costs a tenth of a residual found anew.

Sign: that of the model, ``d residual = - column``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rod.array import Array
from rod.inverse.observation import Observation, foot_points, of_hold
from rod.inverse.prediction import Prediction


class _Nodes(NamedTuple):
    """A node of the curve beside every section: which, and what a unit of its x or y, theta and s does there.

    ``place``: along both axes alike. ``turn``, ``slide``: across the curve.
    """

    at: NDArray[np.int_]
    place: Array
    turn: Array
    slide: Array


def columns_of(observation: Observation, at: Prediction, moved: Prediction, steps: Array) -> Array:
    """Columns (N, k) per unit, rows as in ``observation.rows``.

    Parameters
    ----------
    observation : Observation
    at : Prediction
    moved : Prediction
        Its k variations, each a short step away.
    steps : (k,)
        How far.
    """
    parts = _forces(observation, at, moved)
    if observation.photos:
        places = observation.all_sections
        sine, cosine, nodes = _across(observation, at)
        off = {name: getattr(moved, name) - getattr(at, name) for name in ("s", "x", "y", "theta")}
        across = np.zeros((len(steps), len(places.s)))
        for node in nodes:
            here = slice(None), places.step, node.at
            across += node.place * (cosine * off["y"][here] - sine * off["x"][here])
            across += node.turn * off["theta"][here] + node.slide * off["s"][:, node.at]
        chord = moved.chord - at.chord
        for photo, own in zip(observation.photos, places.of_photo, strict=True):
            parts.append(photo.whiten @ np.vstack([chord[:, photo.step], across[:, own].T]))
    return np.asarray(observation.joined(np.vstack(parts)) / steps)


def _forces(observation: Observation, at: Prediction, moved: Prediction) -> list[Array]:
    """Changes (h, k) of the holds."""
    noise = observation.force_std, observation.force_common
    holds = zip(observation.forces, at.samples, moved.samples, *noise, strict=True)
    return [of_hold((new - old).T[: len(data)] / std, alike / std) for data, old, new, std, alike in holds]


@lru_cache(maxsize=1)
def _across(observation: Observation, at: Prediction) -> tuple[Array, Array, tuple[_Nodes, _Nodes]]:
    """Sine and cosine (k,) of the curve at the foot points, and its two nodes beside each.

    The curve is that of `observation.foot_points`: a Hermite cubic of x, y and theta, whose own direction is not quite
    the one between those of its nodes. What it moves along itself changes no distance.
    """
    foot = foot_points(observation.all_sections, at)
    t, width, step, left, right = foot.t, foot.width, observation.all_sections.step, foot.left, foot.left + 1
    rest = 1.0 - t
    h1, h2, h3 = t * t * (3.0 - 2.0 * t), t * rest * rest, -t * t * rest
    by_h1, by_h2, by_h3 = 6.0 * t * rest / width, rest * (1.0 - 3.0 * t), -t * (2.0 - 3.0 * t)
    a, b = at.theta[step, left], at.theta[step, right]
    up = by_h1 * (at.y[step, right] - at.y[step, left]) + by_h2 * np.sin(a) + by_h3 * np.sin(b)
    ahead = by_h1 * (at.x[step, right] - at.x[step, left]) + by_h2 * np.cos(a) + by_h3 * np.cos(b)
    direction = np.arctan2(up, ahead)
    by_width = h2 * np.sin(a - direction) + h3 * np.sin(b - direction)
    nodes = (
        _Nodes(left, 1.0 - h1, width * h2 * np.cos(a - direction), -by_width),
        _Nodes(right, h1, width * h3 * np.cos(b - direction), by_width),
    )
    return np.sin(direction), np.cos(direction), nodes

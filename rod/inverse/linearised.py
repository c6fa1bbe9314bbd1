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

from rod.inverse.observation import Observation, foot_points, of_hold
from rod.inverse.prediction import Prediction

Array = NDArray[np.float64]


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
    common = observation.force_common or (0.0,) * len(observation.forces)
    holds = zip(observation.forces, at.samples, moved.samples, observation.force_std, common, strict=True)
    return [of_hold((new - old).T[: len(data)] / std, alike / std) for data, old, new, std, alike in holds]


@lru_cache(maxsize=1)
def _across(observation: Observation, at: Prediction) -> tuple[Array, Array, tuple[_Nodes, _Nodes]]:
    """Sine and cosine (k,) of the curve at the foot points, and its two nodes beside each.

    The curve is that of `observation.foot_points`: a Hermite cubic of x, y and theta.
    """
    foot = foot_points(observation.all_sections, at)
    sine, cosine = np.sin(foot.direction), np.cos(foot.direction)
    t, width = foot.t, foot.width
    rest = 1.0 - t
    h1, h2, h3 = t * t * (3.0 - 2.0 * t), t * rest * rest, -t * t * rest
    step, left, right = observation.all_sections.step, foot.left, foot.left + 1
    a, b = at.theta[step, left], at.theta[step, right]
    # across the curve: of a unit vector at the angle a its sine of (a - direction), of its turn the cosine
    over_a, over_b = np.sin(a - foot.direction), np.sin(b - foot.direction)
    span = cosine * (at.y[step, right] - at.y[step, left]) - sine * (at.x[step, right] - at.x[step, left])
    by_t = span * 6.0 * t * rest + width * (over_a * rest * (1.0 - 3.0 * t) - over_b * t * (2.0 - 3.0 * t))
    by_width = over_a * h2 + over_b * h3
    nodes = (
        _Nodes(left, 1.0 - h1, width * h2 * np.cos(a - foot.direction), -by_t * rest / width - by_width),
        _Nodes(right, h1, width * h3 * np.cos(b - foot.direction), -by_t * t / width + by_width),
    )
    return sine, cosine, nodes

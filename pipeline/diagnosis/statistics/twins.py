"""Twins: causes whose traces in the data point in (nearly) the same direction.

In: the unit directions ``u_k`` of `score.Scores`, and which cause owns each of them (a cause that is scanned, such as a
soft spot at an unknown place, owns several). Out: cosines between causes, the nearest twin of each, and the class of
names that no amount of looking at these data can tell apart.

Two causes with ``|cos| = c`` are told apart when ``lambda sqrt(1 - c^2)`` exceeds about 4 (lambda: size of the effect
in sigma); with c = 1 never, whatever the size.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array

Owner = NDArray[np.int_]


def cosines(unit: Array) -> Array:
    """Cosines (k, k) between directions, 0 where a direction is invisible."""
    return np.clip(unit.T @ unit, -1.0, 1.0)


def between_causes(cosine: Array, owner: Owner, count: int) -> Array:
    """Largest ``|cos|`` (count, count) between any directions of two causes; the diagonal is 1 where visible."""
    table = np.zeros((count, count))
    np.maximum.at(table, (owner[:, None], owner[None, :]), np.abs(cosine))
    return table


DIGITS = 5
"""Of a cosine: few data leave few directions, many causes are exact twins there, and rounding would choose."""


def nearest(table: Array) -> tuple[NDArray[np.int_], Array]:
    """Index and cosine of the nearest twin of each cause; index -1 where a cause has none."""
    others = table - np.diag(np.diag(table)) - np.eye(len(table))
    index = np.argmax(np.round(others, DIGITS), axis=1)
    value = others[np.arange(len(table)), index]
    return np.where(value > 0.0, index, -1), np.maximum(value, 0.0)

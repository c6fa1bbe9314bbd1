"""Two directions at once: what every pair of them removes, on the linear scores.

In: scores ``z``, cosines, owners and admissible signs of all directions. Out: for each pair of directions of different
causes the chi-square it removes,

    gain = (z_i^2 + z_j^2 - 2 c z_i z_j) / (1 - c^2),

where both conditional amounts ``a_i ~ (z_i - c z_j) / (1 - c^2)`` have their admissible sign.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array

COLLINEAR = 0.985
"""|cos| above which the split between two causes is noise."""


def pair_gains(z: Array, cosine: Array, sign: Array, owner: NDArray[np.int_], *, collinear: float = COLLINEAR) -> Array:
    """Chi-square removed by each pair (k, k); 0 where a pair is not allowed.

    Not allowed: two directions of one cause, pairs closer than ``collinear`` (their split would be noise), and pairs
    with an inadmissible sign (those are no better than their better half).
    """
    apart = 1.0 - cosine**2
    allowed = (owner[:, None] != owner[None, :]) & (np.abs(cosine) < collinear)
    safe = np.where(allowed, apart, 1.0)
    amount = (z[:, None] - cosine * z[None, :]) / safe
    right = (sign[:, None] == 0) | (sign[:, None] * amount > 0.0)
    gain = (z[:, None] ** 2 + z[None, :] ** 2 - 2.0 * cosine * z[:, None] * z[None, :]) / safe
    return np.where(allowed & right & right.T, gain, 0.0)

"""What an experiment tells about its parameters: from derivatives and noise to Fisher information.

Units: forces in N, positions in m, parameters in their own units (`rod.parameters`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rod.characteristic import Array
from rod.equilibrium import Equilibrium
from rod.sensitivity import Derivatives


def fisher_information(
    steps: Sequence[Equilibrium],
    sensitivities: Sequence[Derivatives],
    *,
    force_std: float,
    normal_std: float,
) -> Array:
    """Information that forces and shapes carry on the parameters, (q, q) per unit squared.

    Parameters
    ----------
    steps, sensitivities : (k,)
        Equilibria and their derivatives.
    force_std : N
        Of each force.
    normal_std : m
        Of the position of every vertex along the normal, independent of each other; for correlated photos scale it up
        by the square root of vertices per independent point.

    Raises
    ------
    ValueError
        For standard deviations that are not positive.
    """
    if not (force_std > 0.0 and normal_std > 0.0):
        raise ValueError(f"standard deviations must be positive, got {force_std} N and {normal_std} m")
    total = np.zeros((len(sensitivities[0].names),) * 2)
    for step, d in zip(steps, sensitivities, strict=True):
        normal = normal_displacement(step, d) / normal_std
        total += np.outer(d.force, d.force) / force_std**2 + normal.T @ normal
    return total


def normal_displacement(step: Equilibrium, d: Derivatives) -> Array:
    """Displacement of the centerline along its normal (-sin theta, cos theta) per unit, (n, q) m.

    A slide of the vertices along the cable does not enter.
    """
    return np.asarray(np.cos(step.theta)[:, None] * d.y - np.sin(step.theta)[:, None] * d.x)

"""Whether a state of the discrete rod is a minimum of its potential energy: the proof that an equilibrium is stable."""

import numpy as np
from scipy.linalg import LinAlgError, cholesky_banded

from tests.rod.potential_energy import HALF_BANDWIDTH


def is_minimum(potential, q, free):
    """Whether the Hessian on the free unknowns is positive definite, by banded Cholesky factorisation."""
    band = potential.hessian(q)
    for k in range(1, HALF_BANDWIDTH + 1):
        band[k, : potential.size - k] *= free[k:] & free[: potential.size - k]
    band[0, ~free] = np.max(band[0])
    try:
        cholesky_banded(band, lower=True)
    except LinAlgError:
        return False
    return True

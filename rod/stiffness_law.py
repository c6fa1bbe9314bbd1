"""A positive law of any form over the bend K - K0: log f_EI is a spline.

It is `rod.compliance_law` with moment and bend exchanged:

    log(f / unit) = sum_i a_i B_i(xi),    m = int_0^(K - K0) f dD,    f_EI = dm/dK = f

It is the same family of laws on the same abscissa, but what stays when a coefficient changes is the law at all other
bends, not at all other moments. So it is the one to fit where something else carries a part of the moment (friction
between the wires): the curvatures of the cable are as the photos say, whoever carries how much.

Units: bends in 1/m, stiffness in N m^2. Beyond the bends of its basis the stiffness is that of the nearer end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from rod.array import Array
from rod.compliance_law import ComplianceLaw, LawBasis
from rod.moment_curve import LawOfBend, moment_curve


@dataclass(frozen=True, eq=False)
class StiffnessLaw(LawOfBend):
    """One law: coefficients (p,) of log f on a basis of bends. A moment curve (`rod.characteristic.ParametricCurve`).

    ``rise`` is the moment over the bend, told as `rod.compliance_law` tells the bend over the moment.
    """

    rise: ComplianceLaw

    @property
    def basis(self) -> LawBasis:
        """Splines over the bend."""
        return self.rise.basis

    @cached_property
    def at(self) -> Callable[[Array], tuple[Array, Array]]:
        """Function from bends (n,) to moment and tangent."""
        return moment_curve(self.basis.moments, self.rise.bends, self.rise.rates).at

    @property
    def stiffness_scale(self) -> float:
        """Largest tangent stiffness on the basis, N m^2; used for scaling only."""
        return float(self.rise.rates.max())

    @property
    def parameters(self) -> int:
        """Number of coefficients."""
        return self.basis.size

    def moment_by_parameters(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of the moment by the coefficients at fixed curvature, (n, p) N m."""
        return self.rise.bend_by_coefficients(np.asarray(K, float) - np.asarray(K0, float))

    def log_tangent_by_parameters(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of log f by the coefficients at fixed curvature, (n, p)."""
        return self.basis.at(np.asarray(K, float) - np.asarray(K0, float))

    def log_tangent_by_pre_curvature(self, K: ArrayLike, K0: ArrayLike) -> Array:
        """Derivative of log f by K0 at fixed curvature, (n,) m."""
        return -self.rise.log_slope(np.asarray(K, float) - np.asarray(K0, float))

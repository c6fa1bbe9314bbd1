"""What is known of the form of a law before its data: log f_EI is smooth, and its slope at rest is moderate.

The unknowns of the inverse problem are ``z = log f_EI`` at the knots, so the stiffness is positive. The smoothness
prior, density ``exp(-int (d^2 z / dt^2)^2 dt / (2 tau^2))``, leaves straight lines free; it makes the number of knots
harmless from above. A cable that was never set bends alike to both sides of its rest curvature: f_EI is even about K0
and its slope there zero. Not every cable is such, so the slope at the first knot has a prior of its own,
``N(0, slope^2)``.

Along what a law is smooth depends on the law. One that softens as layers slip does so within a small part of the
curvature but over a large part of the bending moment, and is smooth along the moment; one that stiffens is smooth along
the curvature; a few that change most just beside rest along the root of the curvature beyond it. So ``t`` from 0 to 1
runs with one of them (`places_of`), and which, tau and slope follow from the data: they are averaged over in
`pipeline.diagnosis.fits.spline_average`. Without the root, K0 of laws that are steepest at rest came out three standard
deviations off where no force-free photo shows it.

Units: knots in 1/m; z, t and the sizes are pure numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.fits.knots import first_slope, roughness
from rod.characteristic import Characteristic

Array = NDArray[np.float64]

LEAST_RISE = 1e-3
"""Of the moment between neighbouring knots, against an even rise: less is no order that a spline could be laid on."""

NEAR_REST = 0.02
"""Of the visited range: nearer to rest the root is a straight line. So much lies under the covers of most photos."""

ROOT_SHARE = 1.0 / 8.0
"""Of laws that are smooth along the root, relative to the others: what laws that are steepest at rest gain by it is
hardly less than with even shares, and those that are flat there lose nothing that could be seen."""

FIRST_SIZES = (6.0, 3.0)
"""tau and slope of fits before the data are known: between a straight line and mid-range the law may differ by a factor
e^(6/8), and over the range of its first slope by e^3."""


@dataclass(frozen=True)
class LawPrior:
    """Prior of one form.

    Attributes
    ----------
    places : (k,)
        Of the knots: curvatures or moments, in any unit.
    tau, slope : float
        Prior standard deviations of d^2 z / dt^2, and of dz / dt at the first knot.
    """

    places: Array
    tau: float
    slope: float

    @cached_property
    def rows(self) -> Array:
        """Matrix R with ``(R @ z)^2 / 2`` minus the log density of z, (k - 1, k): all but the level has a prior."""
        g = first_slope(self.places)
        values, vectors = np.linalg.eigh(roughness(self.places) / self.tau**2 + np.outer(g, g) / self.slope**2)
        return np.asarray(np.sqrt(values[1:])[:, None] * vectors[:, 1:].T)

    def carried(self, knots: Array, to: Array) -> LawPrior:
        """The same prior for a spline whose knots lie at `to` (n,) instead of `knots` (k,), both in 1/m and rising.

        Beyond the old knots the places go on with the slope of the nearest two: a fit may visit a little more than its
        knots cover, and knots that share a place carry no spline.
        """
        reach = float(max(knots[0] - to.min(), to.max() - knots[-1], 0.0)) + float(np.ptp(knots))
        slopes = np.diff(self.places)[[0, -1]] / np.diff(knots)[[0, -1]]
        beyond = self.places[[0, -1]] + np.array([-reach, reach]) * slopes
        wide = np.concatenate([[knots[0] - reach], knots, [knots[-1] + reach]])
        return replace(self, places=np.interp(to, wide, np.concatenate([beyond[:1], self.places, beyond[1:]])))


def first_prior(knots: Array) -> LawPrior:
    """Wide, along the curvature: for fits before which there is no law whose moments could be taken."""
    return LawPrior(knots, *FIRST_SIZES)


class Along(NamedTuple):
    """Places of the knots (k,), in any unit, along which a law may be smooth, and how many laws are, relative."""

    places: Array
    share: float = 1.0


def places_of(law: Characteristic, knots: Array, pre_curvature: float) -> tuple[Along, ...]:
    """Curvature of the knots (1/m), root of the curvature beyond rest, and moment (N m) where that grows."""
    moments = law.moment(knots, pre_curvature)
    rises = np.diff(moments)
    root = Along(np.sqrt((knots - knots[0]) / np.ptp(knots) + NEAR_REST), ROOT_SHARE)
    grows = rises.min() > LEAST_RISE * np.ptp(moments) / rises.size
    return (Along(knots), root, Along(moments)) if grows else (Along(knots), root)


def log_volume(places: Array) -> float:
    """Half the log determinant of the roughness between fixed end knots: of the density's norm for sizes of one."""
    return 0.5 * float(np.linalg.slogdet(roughness(places)[1:-1, 1:-1])[1])

"""The paper's iterative method (Sec. 2.3): a nonlinear cable with a solver for linear rods only.

Local stiffnesses EI_i are put into the linear-elastic rod, Eq. (4) is minimised, the EI_i are updated from the new
curvatures, and so on until the shape stays. Two updates:

* ``printed``: EI_i = f(K_i), the characteristic itself. The fixed point has m = f(K) (K - K0): whatever f was meant to
  be, the method reads it as a **secant**.
* ``consistent``: EI_i = m(K_i) / (K_i - K0), the secant of the moment curve (limit f(K0)). The fixed point is the
  minimiser of the corrected Eq. (5) in the reading that the characteristic has.

The error is multiplied by about 1 - (dm/dK) / EI_i an iteration: slow where the tangent is small against the secant
(softening), divergent where it exceeds twice the secant (stiffening). Damping EI <- EI + damping (update - EI) gives
1 - damping (dm/dK) / EI_i; ``damping=None`` chooses 2 / (1 + largest ratio) where a ratio exceeds one.

Signs and units as in `rod.equilibrium`. Source: Sec. 2.3 of the paper.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rod.array import Array
from rod.characteristic import Characteristic
from rod.discretisation import Rod
from rod.equilibrium import Equilibrium, Outcome, solve
from rod.reduction import Hold
from rod.section import Section

Update = Literal["printed", "consistent"]

#: Largest change of curvature against the largest curvature at which the shape counts as settled; and the ratio of
#: tangent to secant, a quotient of sums, is known to some hundred roundings of 1e-16 each.
SETTLED, ROUNDING = 1e-10, 1e-12


@dataclass(frozen=True, eq=False)
class Iteration:
    """Result of the iterative method.

    Attributes
    ----------
    equilibrium : Equilibrium
        Of the last linear-elastic rod.
    stiffness : (n,) N m^2
        Its local stiffnesses, at the joints.
    changes : (k,) 1/m
        Largest change of curvature in each iteration after the first; k + 1 minimisations in all.
    damping : float
        Used in the last iteration.
    newton_steps : int
        Of all minimisations together.
    outcome : Outcome
        CONVERGED; LIMIT_POINT if a local stiffness or the tangent is not positive; STALLED if the shape did not
        settle.
    """

    equilibrium: Equilibrium
    stiffness: Array
    changes: Array
    damping: float
    newton_steps: int
    outcome: Outcome

    @property
    def iterations(self) -> int:
        """Number of minimisations."""
        return self.changes.size + 1

    @property
    def error_factor(self) -> float:
        """Factor by which the error shrinks an iteration, from the last changes above rounding; NaN if unknown."""
        usable = self.changes[self.changes > 1e-9 * self.changes.max(initial=0.0)]
        return float((usable[-1] / usable[-4]) ** (1.0 / 3.0)) if usable.size > 4 else float("nan")


def iterate(
    rod: Rod,
    hold: Hold,
    *,
    update: Update = "printed",
    damping: float | None = None,
    most: int = 300,
) -> Iteration:
    """Equilibrium by the iterative method.

    Parameters
    ----------
    rod : Rod
        With a `Characteristic`, without internal friction and plastic set.
    hold : Hold
    update : {"printed", "consistent"}
    damping : float or None
        Between 0 and 1; None: automatic, 1 for softening cables.
    most : int
        Largest number of minimisations.

    Raises
    ------
    ValueError
        For a rod with memory or a law that is no `Characteristic`, or damping outside (0, 1].
    """
    section, law = rod.section, rod.section.law
    if not isinstance(law, Characteristic) or section.friction is not None or section.sets:
        raise ValueError("the iterative method takes a Characteristic without friction and plastic set")
    if damping is not None and not 0.0 < damping <= 1.0:
        raise ValueError(f"damping must lie in (0, 1], got {damping}")
    stiffness = _stiffness(section, law, update)
    secant = stiffness(section.pre_curvature)
    # EA and GA belong to the cable, not to its momentary local stiffness.
    rigid = replace(rod, axial_stiffness=1.0 / rod.flexibility[0], shear_stiffness=1.0 / rod.flexibility[1])
    changes: list[float] = []
    used, steps, outcome = 1.0, 0, Outcome.STALLED
    here: Equilibrium | None = None
    while len(changes) + 1 < most:
        linear = Section(Characteristic.constant(1.0), section.pre_curvature, secant)
        there = solve(replace(rigid, section=linear), hold, start=here)
        steps += there.iterations
        K = rod.curvature(there.angles)
        if here is not None:
            changes.append(float(np.abs(K - rod.curvature(here.angles)).max()))
        here = there
        target = stiffness(K)
        if not there.good or np.any(target <= 0.0):
            outcome = Outcome.LIMIT_POINT if np.any(target <= 0.0) else there.outcome
            break
        if changes and changes[-1] <= SETTLED * np.abs(K).max():
            tangent = _slope(section, law, update, K)
            outcome = Outcome.CONVERGED if tangent.min() > 0.0 else Outcome.LIMIT_POINT
            break
        used = _damping(_slope(section, law, update, K) / target) if damping is None else damping
        secant = secant + used * (target - secant)
    if here is None:
        raise ValueError(f"most must be at least 2, got {most}")
    return Iteration(here, secant, np.array(changes), used, steps, outcome)


def _stiffness(section: Section, law: Characteristic, update: Update) -> Callable[[Array], Array]:
    """Update of the local stiffness from the curvature."""
    profile = np.ones(1) if section.profile is None else section.profile
    if update == "printed":
        return lambda K: np.asarray(profile * law.f(K - section.pre_curvature if law.abscissa == "excess" else K))
    return lambda K: np.asarray(profile * law.secant(K, section.pre_curvature))


def _slope(section: Section, law: Characteristic, update: Update, K: Array) -> Array:
    """Tangent of the moment curve that the fixed point has."""
    meant = law if update == "consistent" else replace(law, reading="secant")
    tangent = meant.tangent(K, section.pre_curvature)
    return tangent if section.profile is None else section.profile * tangent


def _damping(ratios: Array) -> float:
    """Largest contraction over all joints if some tangent exceeds its secant; otherwise the plain method.

    Where the cable is straight both are the same, but for roundings.
    """
    largest = float(ratios.max())
    return 1.0 if largest <= 1.0 + ROUNDING else 2.0 / (1.0 + largest)

"""The paper's virtual experiments as numbers: what can be checked of it without a real cable.

* `table_one`: forces and curvature ranges of Table 1 for both readings and both zeros of displacement, and the shapes
  with that of the initial rod, which is already slightly bent (Fig. 3).
* `virtual_inverse`: Eq. (7) on Table 1's data with its evolution: control points and characteristic (Fig. 4), forces
  and curvatures (Fig. 5). Data and fit share the grid, as in the paper: it shows that the parameters can be identified,
  and validates nothing.
* `forced_straight`: the same data fitted with K0 = 0 (Fig. 6), by the forces alone (Eq. (6)), which are met with wrong
  values, and with the curvatures (Eq. (7)): negative stiffness at low curvature. Displacement is counted from where the
  true cable was mounted, for the machine knows that and not the model's K0. Where the paper speaks of small deviations,
  the forces of this fit are off by -36, +14 and +16 mN of 430 to 450 mN. Its minimum depends on the number of nodes,
  because the sum over curvatures does and the end joints are bent without a moment: f_EI(0) is -0.61 mN m^2 with the
  101 nodes here (two other solvers agree), -0.69 with 50 and -0.53 with 400.
* `iteration_costs`: the iterative method of Sec. 2.3 beside Newton's method on the nonlinear energy.
* `disagreement`: what makes the two curves of Fig. 7 differ. Each cause is switched on alone in a virtual test of
  Table 1's cable, the inverse problem and the pointwise graph of Eq. (14) are compared as the paper compares them, and
  the share of a cause is its part of the sum of the squared rms differences.

Signs and units: chord frame, SI; f_EI in N m^2.

Source: *Identification of Nonlinear Elastic Bending Behavior for Cable Simulation*, Secs. 3.2, 4 and 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.signal import savgol_filter

from rod.array import Array
from rod.bending_test import TABLE_1, TABLE_1_KNOTS, BendingTest, simulate, table_1
from rod.characteristic import Reading
from rod.equilibrium import Equilibrium, solve
from rod.iteration import iterate
from rod.paper_fit import PaperFit, Virtual, paper_fit

STEPS: Array = TABLE_1["step"] * np.arange(1.0, 4.0)
READINGS: tuple[Reading, Reading] = ("secant", "tangent")

#: Amplitude of K0(s) - K0, one wave along the cable, 1/m: what a spool leaves in a cable bent to a radius of half a
#: metre on it differs by such an amount.
VARYING = 0.3
#: Standard deviation of each point of the traced centerline, m: half a pixel at 10 px/mm, a skeleton's; and the spacing
#: of the points, and the window of the local quadratics that differentiate the centerline and its curvature.
POSITION_NOISE, SPACING, WINDOW = 5e-5, 2e-4, 0.03


class Arc(NamedTuple):
    """Position (n,) m of a rod in its chord frame."""

    x: Array
    y: Array


@dataclass(frozen=True)
class TableOne:
    """One row of Table 1's experiment: ``steps`` with forces (3,) N and largest curvatures (3,) 1/m."""

    steps: tuple[Equilibrium, ...]

    @property
    def forces(self) -> Array:
        """Reaction forces P (3,) N."""
        return np.array([step.force for step in self.steps])

    @property
    def largest_curvatures(self) -> Array:
        """Curvature at mid-span (3,) 1/m; the smallest is K0, at the ends."""
        return np.array([np.max(step.kappa) for step in self.steps])

    @property
    def initial(self) -> Arc:
        """The rod before the first step, free of force: an arc of curvature K0."""
        K0, half = TABLE_1["pre_curvature"], 0.5 * TABLE_1["pre_curvature"] * TABLE_1["length"]
        theta = half - K0 * self.steps[0].s
        return Arc((np.sin(half) - np.sin(theta)) / K0, (np.cos(theta) - np.cos(half)) / K0)


@dataclass(frozen=True)
class IterationCost:
    """One step of Table 1, each method from the force-free shape.

    Attributes
    ----------
    minimisations, newton_steps : int
        Of the iterative method as printed; each minimisation is a linear-elastic rod solved by Newton steps.
    error_factor : float
        By which its error shrinks in a minimisation.
    direct_newton_steps : int
        Of Newton's method on the nonlinear energy.
    """

    minimisations: int
    newton_steps: int
    error_factor: float
    direct_newton_steps: int


@dataclass(frozen=True)
class Difference:
    """Difference of the two curves of Fig. 7 made by one cause.

    Attributes
    ----------
    cause : str
    kappa : (n,) 1/m
    inverse, balance : (n,) N m^2
        Both f_EI as the paper would print them, the latter as the median of the graphs.
    graphs : (3,) of ((m,) 1/m, (m,) N m^2)
        The graph of Eq. (14) of each photo.
    rms : relative
    share : relative
        Of the sum of squares over all causes; NaN for all causes together.
    """

    cause: str
    kappa: Array
    inverse: Array
    balance: Array
    graphs: tuple[tuple[Array, Array], ...]
    rms: float
    share: float = float("nan")


def table_one(reading: Reading, *, from_length: bool = False) -> TableOne:
    """Virtual experiment of Sec. 3.2; displacement from the natural chord, or from the length."""
    test = table_1(reading, elements=400)
    chords = (test.length if from_length else test.zero_chord) - STEPS
    return TableOne(simulate(test, chords=chords))


def virtual_data(test: BendingTest, *, from_length: bool = False, elements: int = 100) -> Virtual:
    """Data of Eq. (7) from a virtual test: curvature at the ``elements + 1`` joints of the fit's grid.

    ``from_length`` counts the same bearing positions from the length, so that a fit with another K0 finds them again.
    """
    steps = simulate(test, displacements=STEPS)
    grid = np.linspace(0.0, test.length, elements + 1)
    curvatures = np.array([np.interp(grid, step.s, step.kappa) for step in steps])
    travel = np.array([test.length - step.chord for step in steps]) if from_length else STEPS
    return Virtual(test.length, travel, np.array([step.force for step in steps]), curvatures)


def virtual_inverse() -> PaperFit:
    """Inverse problem of Sec. 4 on Table 1's data, with its evolution."""
    return paper_fit(virtual_data(table_1("secant")), TABLE_1_KNOTS)


def forced_straight(*, curvatures: bool = True) -> PaperFit:
    """The same fit with K0 = 0, which the cable does not have (Fig. 6): Eq. (7), or without curvatures Eq. (6)."""
    data = virtual_data(table_1("secant"), from_length=True)
    data = data if curvatures else replace(data, curvatures=None)
    return paper_fit(data, TABLE_1_KNOTS, zero="length", pre_curvature=0.0)


def iteration_costs() -> tuple[IterationCost, ...]:
    """The printed iteration against the direct way on the steps of Table 1; a Newton step costs both the same."""
    test, costs = table_1("secant"), []
    for displacement in STEPS:
        hold = test.hold("displacements", float(displacement))
        found = iterate(test.rod, hold, update="printed")
        direct = solve(test.rod, hold)
        costs.append(IterationCost(found.iterations, found.newton_steps, found.error_factor, direct.iterations))
    return tuple(costs)


def disagreement() -> tuple[Difference, ...]:
    """Causes of Fig. 7's disagreement, each alone with its share, then all together (the last)."""
    rng = np.random.default_rng(7)

    def differentiated(step: Equilibrium) -> tuple[Array, Array]:
        return _from_photo(step, rng)

    def wave(xi: Array) -> Array:
        return TABLE_1["pre_curvature"] + VARYING * np.cos(2.0 * np.pi * xi)

    alone = (
        _difference("secant against tangent", table_1("secant", elements=400), "secant", _exact),
        _difference("varying pre-curvature", _with_wave("tangent", wave), "tangent", _exact),
        _difference("differentiation", table_1("tangent", elements=400), "tangent", differentiated),
    )
    total = sum(part.rms**2 for part in alone)
    together = _difference("all together", _with_wave("secant", wave), "secant", differentiated)
    shares = (replace(d, share=d.rms**2 / total) for d in alone)
    return (*shares, together)


def _with_wave(reading: Reading, pre_curvature: Callable[[Array], Array]) -> BendingTest:
    return replace(table_1(reading, elements=400), pre_curvature=pre_curvature)


def _difference(
    cause: str, test: BendingTest, reading: Reading, pointwise: Callable[[Equilibrium], tuple[Array, Array]]
) -> Difference:
    """Fit, take the graph of the photos, and compare both where both were; the graph by its median over curvature."""
    fit = paper_fit(virtual_data(test), TABLE_1_KNOTS, reading=reading)
    graphs = tuple(pointwise(step) for step in simulate(test, displacements=STEPS))
    kappa, ratio = (np.concatenate(columns) for columns in zip(*graphs, strict=True))
    # 12 bins between the 5th and 95th percentile: wide enough for a median in each, narrow against the bend of f
    low, high = np.percentile(kappa, (5.0, 95.0))
    edges = np.linspace(low, high, 13)
    inside = [(kappa >= left) & (kappa < right) for left, right in pairwise(edges)]
    middle = 0.5 * (edges[:-1] + edges[1:])
    balance = np.array([np.median(ratio[chosen]) for chosen in inside])
    inverse = fit.characteristic.f(middle)
    rms = float(np.sqrt(np.mean((balance / inverse - 1.0) ** 2)))
    return Difference(cause, middle, inverse, balance, graphs, rms)


def _exact(step: Equilibrium) -> tuple[Array, Array]:
    """Graph of Eq. (14) from the simulated curve itself, without the two end joints and mid-span (0/0)."""
    return _graph(step.s, step.kappa, step.force * step.y)


def _from_photo(step: Equilibrium, rng: np.random.Generator) -> tuple[Array, Array]:
    """Graph of Eq. (14) from noisy points of the centerline, differentiated by local quadratics."""
    s = np.arange(step.s[0], step.s[-1], SPACING)
    theta = np.interp(s, step.s, step.theta)
    sideways = POSITION_NOISE * rng.standard_normal(s.size)
    x = np.interp(s, step.s, step.x) - sideways * np.sin(theta)
    y = np.interp(s, step.s, step.y) + sideways * np.cos(theta)
    points = 2 * round(0.5 * WINDOW / SPACING) + 1
    dx, dy, ddx, ddy = (
        savgol_filter(values, points, 2, deriv=order, delta=SPACING) for order in (1, 2) for values in (x, y)
    )
    kappa = (ddx * dy - dx * ddy) / np.hypot(dx, dy) ** 3  # positive toward the bow: K = -dtheta/ds
    return _graph(
        s,
        savgol_filter(kappa, points, 2),
        step.force * y,
        turn=savgol_filter(kappa, points, 2, deriv=1, delta=SPACING),
        lift=savgol_filter(step.force * y, points, 2, deriv=1, delta=SPACING),
    )


def _graph(
    s: Array, kappa: Array, moment: Array, *, turn: Array | None = None, lift: Array | None = None
) -> tuple[Array, Array]:
    turn = np.gradient(kappa, s) if turn is None else turn
    lift = np.gradient(moment, s) if lift is None else lift
    # where the curvature hardly changes the ratio says nothing: mid-span, a twentieth of the largest slope
    usable = np.abs(turn) > 0.05 * np.max(np.abs(turn))
    usable[[0, -1]] = False
    return kappa[usable], lift[usable] / turn[usable]

"""The inverse problem exactly as the paper states it (Sec. 4), for comparison and the virtual experiment of Table 1.

Three control points at given abscissae and a constant K0 are fitted to the forces and curvatures of all steps,

    sum_j (F_j^S - F_j^G)^2 + w sum_j sum_i (K_ji^S - K_ji^G)^2      Eq. (7), w = 1e-3 (N m)^2

with the sum over i on the vertices of the simulated grid; w = 0 and K0 = 0 is Eq. (6). Levenberg-Marquardt from
EI = 0.01 N m^2 constant and K0 = 1 1/m; the evolution over the iterations is kept (Figs. 4 and 5). It is scipy's
trust-region form of the method: MINPACK's cannot be told that a trial has no equilibrium, and with the secant reading
it ends at the limit point half-way.

w has a unit and its sum depends on the number of vertices: the default of `rod.inverse` weights every residual by its
standard deviation instead, and fits positions rather than curvatures. A method that stops has not converged for that:
from half of all starts (EI = 0.03 N m^2, say) it ends at the edge of what has an equilibrium, far from any minimum. So
the gradient decides, and there are further starts whose stiffness is scaled to the forces: the best end is the result.
Nothing here keeps the stiffness positive: with K0 forced to zero the fit runs into negative stiffness at low curvature,
which is the paper's Fig. 6. Trials without a stable equilibrium are refused.

Signs and units: chord frame, SI; displacement from the natural chord of the mounted cable, or from the length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from rod.array import Array
from rod.bending_test import BendingTest, simulate
from rod.characteristic import Characteristic, Reading
from rod.equilibrium import Equilibrium
from rod.sensitivity import derivatives

PAPER_WEIGHT = 1e-3
PAPER_START = (0.01, 1.0)
#: Turns K0 L at which further starts are bent; the arch of Table 1 has 0.4.
FURTHER_TURNS = (0.1, 0.4, 0.8)
#: Residuals below this, relative to the data, are rounding; gradients (cosines) below the other are at a minimum.
EXACT, STATIONARY = 1e-8, 1e-4
#: Relative change of objective and parameters at which the method stops.
SETTLED = 1e-12


@dataclass(frozen=True)
class Virtual:
    """Data of the fit: displacements and forces (n,) m, N; curvatures at the joints (n, elements + 1) 1/m or None.

    The simulated rod has joints where the curvatures are, and as many as any where there are none.
    """

    length: float
    displacements: Array
    forces: Array
    curvatures: Array | None = None

    def __post_init__(self) -> None:
        for name in ("displacements", "forces", "curvatures"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, np.asarray(given, float))
        rows = {given.shape[:1] for given in (self.displacements, self.forces, self.curvatures) if given is not None}
        if len(rows) != 1 or (self.curvatures is not None and self.curvatures.ndim != 2):
            raise ValueError("give one displacement, one force and one row of curvatures for each step")

    @property
    def elements(self) -> int | Array:
        """Number of elements of the simulated rod."""
        return BendingTest.elements if self.curvatures is None else self.curvatures.shape[1] - 1


@dataclass(frozen=True)
class PaperIteration:
    """State of the fit at one iteration: control points (k,) N m^2, K0 1/m, objective N^2, and the steps simulated."""

    ordinates: Array
    pre_curvature: float
    objective: float
    steps: tuple[Equilibrium, ...]


@dataclass(frozen=True)
class PaperFit:
    """Result of the paper's fit: the best end of all starts.

    Attributes
    ----------
    characteristic : Characteristic
    pre_curvature : 1/m
    objective : N^2
    history : tuple of PaperIteration
        From the start that led there to the result.
    steps : tuple of Equilibrium
        At the result.
    gradient : float
        Largest cosine between the residuals and a column of their Jacobian: 0 at a minimum, and where the data are met.
    others : tuple of PaperFit
        Ends of the other starts; none where the start asked for met the data exactly.
    """

    characteristic: Characteristic
    pre_curvature: float
    objective: float
    history: tuple[PaperIteration, ...] = field(repr=False)
    steps: tuple[Equilibrium, ...] = field(repr=False)
    gradient: float
    others: tuple[PaperFit, ...] = field(default=(), repr=False)

    @property
    def converged(self) -> bool:
        """Whether the fit ended at a minimum: its gradient vanishes."""
        return self.gradient < STATIONARY

    @property
    def iterations(self) -> int:
        """Levenberg-Marquardt iterations, the start not counted."""
        return len(self.history) - 1


def paper_fit(
    data: Virtual,
    knots: ArrayLike,
    *,
    reading: Reading = "secant",
    start: tuple[float, float] = PAPER_START,
    pre_curvature: float | None = None,
    zero: Literal["natural", "length"] = "natural",
) -> PaperFit:
    """Fit control points and K0 by Eq. (7), or Eq. (6).

    Parameters
    ----------
    data : Virtual
        ``curvatures`` None drops the curvature term.
    knots : (k,) 1/m
    reading : {"secant", "tangent"}
        What the control points mean; the paper's iterative method makes them a secant.
    start : (N m^2, 1/m)
    pre_curvature : 1/m or None
        Fixes K0; None fits it.
    zero : {"natural", "length"}
        From where displacement is counted.

    Raises
    ------
    ValueError
        If the start has no equilibrium, or there are fewer data than parameters.
    """
    at = np.asarray(knots, float)
    problem = _Problem(data, at, reading, pre_curvature, zero)
    size = at.size + (pre_curvature is None)
    if (count := data.forces.size + (0 if data.curvatures is None else data.curvatures.size)) < size:
        raise ValueError(f"{count} data do not determine {size} parameters: give more steps, or fix pre_curvature")
    first = _from_start(problem, start)
    if first is None:
        raise ValueError(
            f"no equilibrium at the start EI = {start[0]} N m^2, K0 = {start[1]} 1/m: give a start nearer to the cable"
        )
    if first.gradient == 0.0:
        return first
    turns = (0.0,) if pre_curvature is not None else FURTHER_TURNS
    further = (_from_start(problem, problem.scaled_start(turn / data.length)) for turn in turns)
    best, *others = sorted((first, *(end for end in further if end)), key=lambda end: end.objective)
    return replace(best, others=tuple(others))


def _from_start(problem: _Problem, start: tuple[float, float]) -> PaperFit | None:
    """The fit from one start; None if that has no equilibrium."""
    k, fixed = problem.knots.size, problem.fixed is not None
    begin = np.ones(k + (not fixed))
    unit = np.r_[np.full(k, start[0]), [start[1] or 1.0] * (not fixed)]
    history: list[PaperIteration] = []
    accepted = problem.simulate(begin * unit, None)
    trial = accepted
    if not np.all(np.isfinite(accepted.residual)):
        return None

    def residual(p: Array) -> Array:
        nonlocal trial
        if np.array_equal(p, begin):
            trial = accepted
        elif np.all(np.isfinite(p)):
            trial = problem.simulate(p * unit, accepted.steps)
        else:  # scipy's trust region, shrunk to nothing at a limit point
            return np.full(accepted.residual.size, np.inf)
        return trial.residual

    def jacobian(p: Array) -> Array:  # called where a trial was accepted, right after it
        nonlocal accepted
        accepted = trial
        history.append(problem.iteration(p * unit, accepted))
        return np.asarray(problem.jacobian(accepted) * unit)

    with np.errstate(all="ignore"):  # at a limit point scipy's trust region shrinks until its own ratios overflow
        found = least_squares(
            residual, begin, jacobian, x_scale="jac", xtol=SETTLED, ftol=SETTLED, gtol=SETTLED, max_nfev=100
        )
    end = problem.simulate(found.x * unit, accepted.steps)
    history.append(problem.iteration(found.x * unit, end))
    size, gradient = float(np.linalg.norm(end.residual)), np.inf
    if size < EXACT * problem.data_norm:
        gradient = 0.0
    elif np.isfinite(size):
        J = problem.jacobian(end)
        gradient = float(np.max(np.abs(J.T @ end.residual) / np.linalg.norm(J, axis=0))) / size
    return PaperFit(*problem.split(found.x * unit), size**2, tuple(history), end.steps, gradient)


@dataclass(frozen=True)
class _Simulation:
    """Steps of one trial and its residuals (r,)."""

    test: BendingTest
    steps: tuple[Equilibrium, ...]
    residual: Array


@dataclass(frozen=True)
class _Problem:
    """Eq. (7) with its fixed choices; parameters: control points, then K0 if it is free."""

    data: Virtual
    knots: Array
    reading: Reading
    fixed: float | None
    zero: Literal["natural", "length"]

    def split(self, parameters: Array) -> tuple[Characteristic, float]:
        k = self.knots.size
        law = Characteristic.from_ordinates(self.knots, parameters[:k], reading=self.reading)
        return law, float(parameters[k]) if self.fixed is None else self.fixed

    @property
    def data_norm(self) -> float:
        """Size of the data in the objective, N."""
        bends = 0.0 if self.data.curvatures is None else PAPER_WEIGHT * float(np.sum(self.data.curvatures**2))
        return float(np.sqrt(np.sum(self.data.forces**2) + bends))

    def scaled_start(self, K0: float) -> tuple[float, float]:
        """Start of a fit: the constant stiffness (N m^2) that meets the forces best with a K0, and that K0 (1/m)."""
        steps = self.simulate(np.r_[np.ones(self.knots.size), [K0] * (self.fixed is None)], None).steps
        forces = np.array([step.force for step in steps])
        scale = float(forces @ self.data.forces / (forces @ forces))
        return (abs(scale) if np.isfinite(scale) and scale else PAPER_START[0]), K0

    def simulate(self, parameters: Array, warm: Sequence[Equilibrium] | None) -> _Simulation:
        law, K0 = self.split(parameters)
        test = BendingTest(self.data.length, law, K0, zero=self.zero, elements=self.data.elements)
        steps = simulate(test, self.data.displacements, branch="up", starts=warm)
        reached = all(step.good for step in steps)
        forces = np.array([step.force for step in steps]) - self.data.forces
        rows = [forces]
        if self.data.curvatures is not None:
            rows.append(np.sqrt(PAPER_WEIGHT) * (np.array([s.kappa for s in steps]) - self.data.curvatures).ravel())
        value = np.concatenate(rows)
        return _Simulation(test, steps, value if reached else np.full(value.size, np.inf))

    def jacobian(self, here: _Simulation) -> Array:
        parameters = ("ordinates",) if self.fixed is not None else ("ordinates", "pre_curvature")
        slopes = derivatives(here.test, here.steps, parameters)
        rows = [np.stack([slope.force for slope in slopes])]
        if self.data.curvatures is not None:
            rows.append(np.sqrt(PAPER_WEIGHT) * np.vstack([slope.kappa for slope in slopes]))
        return np.vstack(rows)

    def iteration(self, parameters: Array, here: _Simulation) -> PaperIteration:
        law, K0 = self.split(parameters)
        return PaperIteration(law.ordinates, K0, float(here.residual @ here.residual), here.steps)

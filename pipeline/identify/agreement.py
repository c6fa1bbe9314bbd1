"""Comparison of two ways to one characteristic: same quantity, same range, joint uncertainty.

Both ways read the same photos and forces and smooth the same law, so their errors are correlated. To first order both
are linear, in the errors of the data and in the form of the law. Each way states how its log f answers to every source
of error (`gains`: midline of each photo, each force, scale, axes, length) and by how much its prior makes it fall short
of a given law (`shortfall`). The covariance of the difference of both follows from the same errors and the same laws
sent through both,

    V = sum (G_1 - G_2) (G_1 - G_2)^T + (B_1 - B_2) F F^T (B_1 - B_2)^T + `DISCRETE`^2

over the sources (photos, forces, nuisances, each in standard deviations), for laws of the forms F that the smoothness
prior allows (`rod.law_prior`, with the weights that the data give them). What both miss alike cancels, and that is
nearly all: they differ by the length, which the inverse problem alone reads, and by its solver.

The test itself is `pipeline.identify.contrast`'s: the mean of the log ratio over each third of the common range.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.identify.contrast import LogCurve, p_value, parts_difference
from pipeline.messages import Message
from pipeline.records import Array
from rod.balance import BalanceGraph
from rod.inverse import Estimate
from rod.measured_law import MeasuredLaw
from rod.measurement import MeasuredTest


def log_curve(law: MeasuredLaw) -> LogCurve:
    """What the comparison of two curves needs of a measured law."""
    return LogCurve(law.kappa, law.tangent, law.log_covariance)


DISCRETE = 5e-4
"""Of log f over a part of the range: what the elements of the simulated rod change in it, three to one hundred."""

LEVEL = 0.05
"""Of the test whether both ways agree: the usual one."""


@dataclass(frozen=True)
class Agreement:
    """Both ways compared as the tangent reading on the range that both visited.

    Attributes
    ----------
    range_per_m : (low, high)
    rms_relative, max_relative : float
        Of log(inverse / balance).
    p_value : float
        Of a difference as large as this where nothing is wrong.
    compatible : bool
        p_value at least the level.
    level : float
    hints : tuple of Message
        What could make them differ, with the size each would have; empty if compatible.
    """

    range_per_m: tuple[float, float]
    rms_relative: float
    max_relative: float
    p_value: float
    compatible: bool
    level: float
    hints: tuple[Message, ...] = ()


def compare(test: MeasuredTest, inverse: Estimate, graph: BalanceGraph) -> Agreement | None:
    """Compare both ways; None if they visited no common curvature."""
    one, two = inverse.law, graph.law
    if one is None or two is None:
        return None
    first, second = log_curve(one), log_curve(two)
    grid = first.common_grid(second)
    if grid is None:
        return None
    ratio = first.log_on(grid) - second.log_on(grid)
    laws = inverse.law_forms, _on(one.kappa, two.kappa, inverse.law_forms)
    covariance = difference_covariance(one, two, laws, grid)
    p = p_value(parts_difference(first, second, grid), covariance)
    return Agreement(
        range_per_m=(float(grid[0]), float(grid[-1])),
        rms_relative=float(np.sqrt(np.mean(ratio**2))),
        max_relative=float(np.max(np.abs(ratio))),
        p_value=p,
        compatible=p >= LEVEL,
        level=LEVEL,
        hints=() if p >= LEVEL else difference_hints(test, one, two, graph.checks.get("left_right_z", 0.0)),
    )


def _on(kappa: Array, other: Array, columns: Array) -> Array:
    """Columns (n, p) on a grid of curvature, on another one by linear interpolation."""
    return np.stack([np.interp(other, kappa, column) for column in columns.T], axis=1)


def difference_covariance(one: MeasuredLaw, two: MeasuredLaw, laws: tuple[Array, Array], grid: Array) -> Array:
    """Covariance (parts, parts) of the difference of two ways; ``laws`` (n, p) go through both, see the module."""
    first, second = log_curve(one).contraction(grid), log_curve(two).contraction(grid)
    short = first @ one.shortfall @ laws[0] - second @ two.shortfall @ laws[1]
    total: Array = short @ short.T + DISCRETE**2 * np.eye(len(short))
    ways = (first, one), (-second, two)
    for source in one.gains | two.gains:
        moved = np.sum([onto @ law.gains[source] for onto, law in ways if source in law.gains], axis=0)
        total = total + moved @ moved.T
    return total


def rest_curvature(test: MeasuredTest) -> tuple[float, float] | None:
    """Mean curvature of the force-free photos, weighted by their joint noise, and its std with the scale, 1/m."""
    means, weights = [], []
    for step in test.steps:
        shape = step.shape
        if step.branch != "mounted" or shape is None or np.count_nonzero(shape.seen) < 8:
            continue
        seen = np.flatnonzero(shape.seen)
        at = seen[np.unique(np.linspace(0, seen.size - 1, 60).astype(int))]
        covariance = shape.basis_kappa[at] @ shape.covariance @ shape.basis_kappa[at].T
        # The curve has fewer parameters than points here: a thousandth of its variance keeps the inverse bounded.
        covariance[np.diag_indices_from(covariance)] += 1e-3 * np.median(np.diag(covariance))
        weighted = np.linalg.solve(covariance, np.ones(at.size))
        weights.append(float(weighted.sum()))
        means.append(float(weighted @ shape.kappa[at]) / weights[-1])
    if not means:
        return None
    mean = float(np.average(means, weights=weights))
    return mean, float(np.hypot(1.0 / np.sqrt(sum(weights)), test.scale_std * mean))


def difference_hints(
    test: MeasuredTest, inverse: MeasuredLaw, balance: MeasuredLaw, halves_z: float
) -> tuple[Message, ...]:
    """First candidates for a difference of the two ways, each with the size it would have.

    `halves_z` is the difference of the cable's halves in the balance equations, in standard deviations.
    """
    first, second = log_curve(inverse), log_curve(balance)
    grid = first.common_grid(second)
    if grid is None:
        return ()
    reading = np.interp(grid, inverse.kappa, inverse.secant / inverse.tangent) - 1.0
    stretch = first.onto(grid) @ inverse.gains["scale", -1] - second.onto(grid) @ balance.gains["scale", -1]
    hints = [
        Message("hint.reading", change=np.abs(reading).max()),
        Message("hint.scale", change=0.01 / test.scale_std * np.abs(stretch).max()),
        Message("hint.varying", z=abs(halves_z)),
    ]
    zeros = [s.chord + s.displacement for s in test.steps if s.chord is not None and s.displacement is not None]
    if len(zeros) > 1:
        hints.append(Message("hint.displacement", spread_m=max(zeros) - min(zeros)))
    return tuple(hints)

"""Comparison of two ways to one characteristic: same quantity, same range, joint uncertainty.

Both ways read the same photos and forces, so their errors are correlated; each way states how its log f answers to
every source of error (curve of each photo, each force, the scale), and the covariance of the difference follows:

    V = N_1 + N_2 - X - X^T + (1 - common) (R_1 + R_2),   N_i = sum G_i S G_i^T,  X = sum G_1 S G_2^T,  R_i = C_i - N_i

over the sources of error with covariance S and gains G. What remains of each band, R, is mostly what no data tell about
the form of the law; both ways smooth the same law, so a part ``common`` of it is the same error in both (measured with
the accuracy study: 0.6; with none the test would never reject).

The test itself is `pipeline.identify.contrast`'s: the mean of the log ratio over each third of the common range.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.identify.contrast import LogCurve, p_value, parts_difference
from pipeline.records import Array
from rod.balance import BalanceGraph
from rod.inverse import Estimate
from rod.measurement import MeasuredTest

Source = tuple[str, int]


@dataclass(frozen=True)
class Characterised:
    """What a way hands to the comparison: log f on a grid with covariance and gains, and K0."""

    curve: LogCurve
    gains: dict[Source, Array]
    pre_curvature: float
    pre_curvature_std: float

    @staticmethod
    def of_inverse(way: Estimate) -> Characterised:
        """Of the inverse problem."""
        curve = LogCurve(way.kappa, way.tangent, way.log_covariance)
        return Characterised(curve, way.gains, way.pre_curvature, way.pre_curvature_std)

    @staticmethod
    def of_balance(way: BalanceGraph) -> Characterised:
        """Of the balance equations."""
        curve = LogCurve(way.kappa, way.tangent, way.log_covariance)
        return Characterised(curve, way.gains, way.pre_curvature, way.pre_curvature_std)


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
    hints : tuple of str
        What could make them differ, with the size each would have; empty if compatible.
    """

    range_per_m: tuple[float, float]
    rms_relative: float
    max_relative: float
    p_value: float
    compatible: bool
    level: float
    hints: tuple[str, ...] = ()


def compare(
    test: MeasuredTest, inverse: Estimate, graph: BalanceGraph, *, level: float, common: float
) -> Agreement | None:
    """Compare both ways; None if they visited no common curvature. `common`: see the module."""
    one, two = Characterised.of_inverse(inverse), Characterised.of_balance(graph)
    grid = one.curve.common_grid(two.curve)
    if grid is None:
        return None
    ratio = one.curve.log_on(grid) - two.curve.log_on(grid)
    first, second = one.curve.contraction(grid), two.curve.contraction(grid)
    shared = first @ cross_covariance(test, one.gains, two.gains) @ second.T
    noises = (
        first @ cross_covariance(test, one.gains, one.gains) @ first.T,
        second @ cross_covariance(test, two.gains, two.gains) @ second.T,
    )
    bands = one.curve.parts_covariance(grid), two.curve.parts_covariance(grid)
    covariance = common * sum(noises) + (1.0 - common) * sum(bands) - shared - shared.T
    p = p_value(parts_difference(one.curve, two.curve, grid), covariance)
    return Agreement(
        range_per_m=(float(grid[0]), float(grid[-1])),
        rms_relative=float(np.sqrt(np.mean(ratio**2))),
        max_relative=float(np.max(np.abs(ratio))),
        p_value=p,
        compatible=p >= level,
        level=level,
        hints=() if p >= level else difference_hints(test, inverse, graph),
    )


def cross_covariance(test: MeasuredTest, one: dict[Source, Array], two: dict[Source, Array]) -> Array:
    """Covariance between two estimates by the errors of the data that both read, (n_1, n_2)."""
    total: Array = np.zeros((next(iter(one.values())).shape[0], next(iter(two.values())).shape[0]))
    for step in test.steps:
        force, curve = ("force", step.step), ("curve", step.step)
        if force in one and force in two:
            total += step.force_std**2 * one[force] @ two[force].T
        if curve in one and curve in two and step.shape is not None:
            total += one[curve] @ step.shape.covariance @ two[curve].T
    scale = ("scale", -1)
    if scale in one and scale in two:
        total += test.scale_std**2 * one[scale] @ two[scale].T
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


def difference_hints(test: MeasuredTest, inverse: Estimate, graph: BalanceGraph) -> tuple[str, ...]:
    """First candidates for a difference of the two ways, each with the size it would have."""
    one, two = Characterised.of_inverse(inverse), Characterised.of_balance(graph)
    grid = one.curve.common_grid(two.curve)
    if grid is None:
        return ()
    reading = np.interp(grid, inverse.kappa, inverse.secant / inverse.tangent) - 1.0
    stretch = one.curve.onto(grid) @ one.gains["scale", -1] - two.curve.onto(grid) @ two.gains["scale", -1]
    hints = [
        f"reading one curve as a secant and the other as a tangent would make {np.abs(reading).max():.0%}",
        f"a scale wrong by 1 % would make {0.01 * np.abs(stretch).max():.1%}",
    ]
    z = graph.checks.get("left_right_z", 0.0)
    hints.append(f"a pre-curvature that varies along the cable: the halves differ by {abs(z):.1f} standard deviations")
    zeros = [s.chord + s.displacement for s in test.steps if s.chord is not None and s.displacement is not None]
    if len(zeros) > 1:
        spread = max(zeros) - min(zeros)
        hints.append(f"displacement against the photos' chords: they differ by {1e3 * spread:.2f} mm over the steps")
    return tuple(hints)

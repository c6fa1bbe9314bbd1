"""The characteristic of a fitted model as a curve with its band, and how far one model's f_EI lies from another's.

All curves are over the curvature K = K0 + D on the visited range, tangent reading first; bands are 1 sigma from the
covariance of the fit, correlations between the coefficients a_i of log f and K0 included:

    d log f = sum_i B_i da_i - (d log f / dK) dK0,   dm = sum_i (dm / da_i) da_i - f dK0,   at fixed K.

Amounts and forms of the causes in the model are errors like these: all share one factor of their joint covariance.
What else is believed widens the band later (`pipeline.diagnosis.posterior.mixture`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.records import Array
from pipeline.result import CauseForm, Curve
from rod.inverse.base_fit import law_of
from rod.inverse.estimate import by_parameters
from rod.inverse.fit import Fit
from rod.measured_law import POINTS


def visited(fitted: Fit) -> tuple[float, float]:
    """Smallest and largest curvature over all steps of a cable of this law that is bent alike at rest, 1/m.

    Where K0 varies along the cable, it is the excess over it that f_EI is known for.
    """
    kappa = fitted.pre_curvature + fitted.excess
    return float(kappa.min()), float(kappa.max())


class Stated(NamedTuple):
    """log f_EI at curvatures and, last, K0 (1/m) of a fitted model: values (n + 1,), derivatives (n + 1, p)."""

    values: Array
    rows: Array


def stated(fitted: Fit, kappa: Array) -> Stated:
    """f_EI of a fitted model at curvatures (n,) 1/m."""
    tangent = law_of(fitted).tangent(kappa, fitted.pre_curvature)
    rows = np.zeros((len(kappa) + 1, fitted.extension.size))
    rows[:-1] = by_parameters(fitted, kappa)[0]
    if (bend := fitted.extension.base.pre_curvature_index) is not None:
        rows[-1, bend] = 1.0
    return Stated(np.append(np.log(tangent), fitted.pre_curvature), rows)


def curve(fitted: Fit, *, covariance: Array | None = None, other: Fit | None = None) -> Curve:
    """f_EI and m of a fitted model on its visited range.

    Parameters
    ----------
    fitted : Fit
    covariance : (p, p) or None
        Of the vector, where that is known better than from the linearised fit alone.
    other : Fit or None
        Another answer to the same data: how far its f_EI lies from this one is one standard deviation more.
    """
    law, K0 = law_of(fitted), fitted.pre_curvature
    low, high = visited(fitted)
    K = np.linspace(max(low, K0), high, POINTS)
    by_log, by_moment = by_parameters(fitted, K)
    used, root = _root(fitted, covariance)
    tangent, moment = law.tangent(K, K0), law.moment(K, K0)
    by_rest = np.zeros(fitted.extension.size)
    if (bend := fitted.extension.base.pre_curvature_index) is not None:
        by_rest[bend] = 1.0
    apart_f, apart_m = [tangent[:, None] * by_log[:, used] @ root], [by_moment[:, used] @ root]
    apart_rest = [by_rest[used] @ root]
    if other is not None:
        there, rest = law_of(other), other.pre_curvature
        apart_f.append((there.tangent(K, rest) - tangent)[:, None])
        apart_m.append((there.moment(K, rest) - moment)[:, None])
        apart_rest.append(np.array([rest - K0]))
    factor = np.hstack(apart_f)
    tangent_std, moment_std = (np.linalg.norm(columns, axis=1) for columns in (factor, np.hstack(apart_m)))
    excess = K - K0
    # at K = K0 the secant is the tangent, and so is its band
    far = excess > 1e-3 * (high - K0)
    excess = np.where(far, excess, 1.0)
    secant = np.where(far, moment / excess, tangent)
    secant_std = np.where(far, moment_std / excess, tangent_std)
    return Curve(
        kappa_per_m=K.tolist(),
        moment_Nm=moment.tolist(),
        moment_std_Nm=moment_std.tolist(),
        tangent_Nm2=tangent.tolist(),
        tangent_std_Nm2=tangent_std.tolist(),
        secant_Nm2=secant.tolist(),
        secant_std_Nm2=secant_std.tolist(),
        supported=[True] * POINTS,
        tangent_factor_Nm2=factor.tolist(),
        pre_curvature_factor_per_m=np.concatenate(apart_rest).tolist(),
    )


def forms(fitted: Fit, cause: str, *, columns: int, covariance: Array | None = None) -> list[CauseForm]:
    """The forms of a cause in a fitted model, with their rows in the factor (``columns`` wide) of its `curve`."""
    used, root = _root(fitted, covariance)
    found = []
    for at, term in zip(fitted.extension.amounts_at, fitted.extension.terms, strict=True):
        if term.cause.name != cause:
            continue
        tuned = term.variant.tuned
        rows = np.zeros((1 + len(tuned), columns))
        first = used.index(at)
        rows[:, : root.shape[1]] = root[first : first + len(rows)]
        form = term.variant.moved({name: float(fitted.vector[at + 1 + j]) for j, name in enumerate(tuned)})
        if form.by_factors:
            rows[1:] *= form.at
        found.append(
            CauseForm(
                label=form.label,
                amount=float(fitted.vector[at]),
                std=float(np.linalg.norm(rows[0])),
                at=form.at,
                width=form.width,
                tuned=list(tuned),
                factor=rows.tolist(),
            )
        )
    return found


def _root(fitted: Fit, covariance: Array | None) -> tuple[list[int], Array]:
    """Positions in the vector of law, K0 and the causes' amounts and forms, and a factor (k, k) of their covariance."""
    base = fitted.extension.base
    bend = base.pre_curvature_index
    used = [*range(base.law.size), *([] if bend is None else [bend])]
    used += range(len(base.names), fitted.extension.size)
    return used, factor_of((fitted.covariance if covariance is None else covariance)[np.ix_(used, used)])


def factor_of(covariance: Array) -> Array:
    """Factors (..., p, p) of covariances, also where data that hardly tell some unknowns leave them nearly singular."""
    std = np.sqrt(np.maximum(np.einsum("...ii->...i", covariance), 1e-300))  # unknowns are of very different size
    values, vectors = np.linalg.eigh(covariance / std[..., :, None] / std[..., None, :])
    return np.asarray(std[..., :, None] * vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :])


def stiffness_change(before: Fit, after: Fit) -> float:
    """Root mean square of the relative difference of f_EI at equal curvature, where both models have been bent to."""
    ranges = [(*visited(m), m.pre_curvature) for m in (before, after)]
    low, high = max(max(low, K0) for low, _, K0 in ranges), min(high for _, high, _ in ranges)
    K = np.linspace(min(low, high), high, 60)
    f = [law_of(m).tangent(K, m.pre_curvature) for m in (before, after)]
    return float(np.sqrt(np.mean((f[1] / f[0] - 1.0) ** 2)))


def curve_change(before: Curve, after: Curve) -> float | None:
    """Relative rms difference of two curves of f_EI where both are supported; None where they have no range in common.

    Curves are compared on the points of ``after``.
    """
    K, f = np.array(after.kappa_per_m), np.array(after.tangent_Nm2)
    known = np.array(before.supported, dtype=bool)
    at = np.array(before.kappa_per_m)[known]
    if at.size < 2:
        return None
    common = (at[0] <= K) & (at[-1] >= K)
    if not np.any(common):
        return None
    there = np.interp(K[common], at, np.array(before.tangent_Nm2)[known])
    return float(np.sqrt(np.mean((f[common] / there - 1.0) ** 2)))


def stiffness_change_linear(fitted: Fit, columns: Array, amounts: Array) -> Array:
    """Relative rms change (k,) of f_EI, to first order, by effects that are in the data but not in the model.

    ``columns`` (N, k) are whitened traces per unit of ``amounts`` (k,); the fit then moves by ``J^+ S a``.
    """
    size = np.linalg.norm(fitted.jacobian, axis=0)
    moves = np.linalg.pinv(fitted.jacobian / size, rcond=1e-7) @ (columns * amounts) / size[:, None]
    low, high = visited(fitted)
    K = np.linspace(low, high, 60)
    base, trial = fitted.extension.base, 1e-3  # first order: a thousandth of the move, scaled up again
    vectors = [fitted.vector, *(fitted.vector + trial * move for move in moves.T)]
    before, *after = (base.characteristic(v).tangent(K, base.pre_curvature(v)) for v in vectors)
    return np.array([np.sqrt(np.mean((f / before - 1.0) ** 2)) / trial for f in after])

"""A characteristic as measured: what a way through the data says of f_EI and K0, with its bands and what moves it.

Both ways end in a linearised fit of some unknowns with their covariance; `propagated` reads the same record off either,
so that what is compared, stored and drawn is the same of both, and neither needs to know the other.

Signs and units: curvature K in 1/m positive toward the bow, moment in N m, f_EI in N m^2 (tangent unless it says
secant). Relative errors are errors of log f_EI.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rod.array import Array

Source = tuple[str, int]

POINTS = 61
"""Of a reported curve: smooth at any figure's width."""

#: Within this share of the range from K0 the secant m / (K - K0) is 0/0 to working precision, and is the tangent.
NEAR_REST = 1e-3


@dataclass(frozen=True, eq=False)
class MeasuredLaw:
    """f_EI on a grid over the visited range, and the pre-curvature, with bands; SI units.

    Attributes
    ----------
    pre_curvature, pre_curvature_std : 1/m
    kappa : (n,) 1/m
        Grid over the visited range.
    moment, tangent, secant : (n,) N m, N m^2, N m^2
        With ``moment_std``, ``tangent_std``, ``secant_std``.
    log_covariance : (n, n)
        Joint covariance of log(tangent) on the grid.
    rest_covariance : (n,) 1/m
        Covariance of log(tangent) with the pre-curvature.
    gains : dict
        Response of log(tangent) on the grid to the sources of error, per standard deviation of independent errors: what
        a comparison with another way through the same data needs for the joint uncertainty. By name and step, -1 for
        what all photos have in common: ``("photo", step)`` (n, b) of the whitened midline (`rod.midline`), ``("force",
        step)`` (n, 1), the axes of one photo ``("left_across", step)`` and all that `rod.balance.moment_points` and
        `rod.inverse.gains` name alike, ``("common_force", -1)`` (n, e); and what a way alone knows.
    shortfall : (n, n)
        Error of log(tangent) on the grid by the smoothness prior, per log(tangent) of the true law there.
    loaded_pre_curvature, loaded_pre_curvature_std : 1/m
        Without the force-free photo: a witness of its own.
    """

    pre_curvature: float
    pre_curvature_std: float
    kappa: Array
    moment: Array
    moment_std: Array
    tangent: Array
    tangent_std: Array
    secant: Array
    secant_std: Array
    log_covariance: Array
    rest_covariance: Array
    gains: dict[Source, Array] = field(default_factory=dict)
    shortfall: Array = field(default_factory=lambda: np.empty((0, 0)))
    loaded_pre_curvature: float = np.nan
    loaded_pre_curvature_std: float = np.nan


def propagated(
    kappa: Array,
    pre_curvature: float,
    *,
    moment: Array,
    tangent: Array,
    by_moment: Array,
    by_log: Array,
    by_pre_curvature: Array,
    covariance: Array,
) -> MeasuredLaw:
    """All readings of a fitted law with bands by first-order propagation; gains, shortfall and witness are left open.

    Parameters
    ----------
    kappa : (n,) 1/m
    pre_curvature : 1/m
    moment, tangent : (n,) N m, N m^2
        On the grid.
    by_moment, by_log : (n, q)
        Derivatives of the moment and of log(tangent) by the unknowns.
    by_pre_curvature : (q,)
        Derivative of K0 by the unknowns.
    covariance : (q, q)
        Of the unknowns.
    """
    D = kappa - pre_curvature
    near = np.abs(D) < NEAR_REST * (kappa[-1] - kappa[0])
    D = np.where(near, 1.0, D)
    by_secant = by_moment / D[:, None] + np.outer(moment / D**2, by_pre_curvature)
    by_secant = np.where(near[:, None], tangent[:, None] * by_log, by_secant)

    def std(by: Array) -> Array:
        return np.asarray(np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", by, covariance, by), 0.0)))

    return MeasuredLaw(
        pre_curvature=pre_curvature,
        pre_curvature_std=float(std(by_pre_curvature[None])[0]),
        kappa=kappa,
        moment=moment,
        moment_std=std(by_moment),
        tangent=tangent,
        tangent_std=tangent * std(by_log),
        secant=np.where(near, tangent, moment / D),
        secant_std=std(by_secant),
        log_covariance=by_log @ covariance @ by_log.T,
        rest_covariance=by_log @ covariance @ by_pre_curvature,
    )

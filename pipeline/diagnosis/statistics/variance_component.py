"""A variance beside a fitted model: how much numbers of one kind, one at each step, scatter about nothing.

``r = J b + D d + e`` with unit noise e, parameters b that are fitted and numbers d ~ N(0, tau^2 I). What the parameters
can imitate is projected out of r and D; along the singular directions of what is left of D the data are independent,
u_j ~ N(0, 1 + tau^2 s_j^2), so the restricted likelihood of tau is a sum (Patterson and Thompson 1971; REML). Nothing
else that lies in the data makes tau large but what d itself would do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, special

from pipeline.diagnosis.statistics.score import span

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Component:
    """Scatter of d.

    Attributes
    ----------
    std : float
        Likeliest tau, in the unit of d; the largest tried if it is that or more.
    p_value : float
        How often noise alone makes it as likely, half of a chi-square since tau cannot be negative.
    share : float
        Of the chi-square beyond noise that is left beside the courses, what numbers of that scatter take away, their
        own squares counted against them.
    price : float
        Log of the determinant that the likelihood pays for them.
    between : (float, float)
        Ends of the 95 % interval of tau: where twice the restricted log-likelihood is 3.84 below its largest.
    """

    std: float
    p_value: float
    share: float
    price: float
    between: tuple[float, float]


TRIALS, BEYOND = 200, 67
"""Values of tau tried between a thousandth of the largest and that: steps of 3.5 %, a tenth of what six steps tell; and
beyond it, for the upper end of the interval alone, up to ten times the largest."""


def component(residual: Array, jacobian: Array, columns: Array, *, lines: Array, most: float) -> Component | None:
    """Restricted likelihood of the scatter of ``d`` beside a fitted model.

    Parameters
    ----------
    residual : (n,)
        Whitened, of the fitted model, with its rows of prior knowledge.
    jacobian : (n, p)
        Of everything fitted.
    columns : (n, k)
        Whitened sensitivities to the numbers d, one at each step.
    lines : (k, l)
        Courses of d over the steps that are no scatter; they are fitted along.
    most : float
        Largest tau tried.

    Returns
    -------
    Component or None
        None where nothing of d is left beside all that.
    """
    fixed = span(np.hstack([jacobian, columns @ lines]))
    left, weight, _ = linalg.svd(columns - fixed @ (fixed.T @ columns), full_matrices=False)
    seen = weight * most > VISIBLE
    if not np.any(seen):
        return None
    squared, s2 = (left[:, seen].T @ residual) ** 2, weight[seen] ** 2
    tau = np.r_[0.0, np.geomspace(1e-3 * most, most, TRIALS), most * np.geomspace(1.0, 10.0, BEYOND + 1)[1:]]
    wide = 1.0 + np.outer(tau**2, s2)
    twice = -np.sum(np.log(wide) + squared / wide, axis=1)
    best = int(np.argmax(twice[: 1 + TRIALS]))
    likely = np.flatnonzero(twice >= twice[best] - WITHIN)
    misfit = float(np.sum((residual - fixed @ (fixed.T @ residual)) ** 2)) - (len(residual) - fixed.shape[1])
    return Component(
        std=float(tau[best]),
        p_value=0.5 * float(special.chdtrc(1, twice[best] - twice[0])),
        share=float(np.sum(squared - squared / wide[best])) / max(misfit, 1e-12),
        price=float(np.sum(np.log(wide[best]))),
        between=(float(tau[likely[0]]), float(tau[likely[-1]])),
    )


WITHIN = float(special.chdtri(1, 0.05))
"""Fall of twice the log-likelihood at the ends of a 95 % interval of one number (Wilks 1938)."""


VISIBLE = 1.0
"""Sigma that a number of the largest scatter must make to be seen."""

"""What is known of a law before its data, for the balance way: log c = l is smooth, its slope at rest moderate.

A prior is the density ``exp(-int (d^2 l / dt^2)^2 dt / (2 tau^2) - (dl/dt at rest)^2 / (2 slope^2))``, with t from 0 to
1 over the range met. Most laws are smooth along the moment: layers that slip let the compliance rise with it. A few
change most just beside rest and need not bend alike to both sides: they are smooth along the root of the curvature
beyond rest. Without a force-free photo that decides on K0: with priors along the moment alone, K0 of laws that are
steepest at rest came out up to 6 standard deviations too high.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rod.balance.compliance import ComplianceCurve

Array = NDArray[np.float64]

NEAR_REST = 0.02
"""Of the range of curvature: nearer to rest a root is a straight line. So much lies under the covers of most photos."""

ROOT_SHARE = 1.0 / 8.0
"""Of laws that are smooth along the root: what laws that are steepest at rest gain by it is hardly less than with even
shares, and those that are flat there, or fall with the moment, lose nothing that could be seen."""

MOST = 100.0
"""Compliance over its mean or below it: no cable's law goes that far, but a fit to a wrong force may on its way."""


@dataclass(frozen=True)
class Smoothness:
    """What the priors along one t are made of, for the p coefficients of log c.

    Attributes
    ----------
    roughness : (p, p)
        Matrix of ``int (d^2 l / dt^2)^2 dt``.
    first_slope : (p,)
        ``dl/dt`` at m = 0.
    share : float
        Of laws that are smooth along this t, relative to the others.
    """

    roughness: Array
    first_slope: Array
    share: float

    @property
    def log_volume(self) -> float:
        """Half the log determinant of the roughness between fixed ends: of the density's norm for a size of one."""
        return 0.5 * float(np.linalg.slogdet(self.roughness[1:-1, 1:-1])[1])


def smoothnesses(curve: ComplianceCurve) -> tuple[Smoothness, ...]:
    """Along the moment, and along the root of the curvature beyond rest as `curve` has it.

    Strategy: with ' for d/dmu, ``d^2 l / dt^2 = (l'' - l' t''/t') / t'^2`` is linear in the coefficients of l for a
    given t; its square is integrated on the nodes of the basis, exactly along the moment.
    """
    basis, span = curve.basis, curve.basis.high - curve.basis.low
    mu = np.append(basis.nodes, -basis.low / span)  # the last place is rest
    m, met = basis.low + mu * span, float(np.ptp(curve.rise))
    k = np.abs(curve.excess(m)) / met
    by_mu = np.clip(curve.compliance(m) * span / met, 1.0 / MOST, MOST)  # dk/dmu, but for the sign
    root = 2.0 * np.sqrt(k + NEAR_REST) * (np.sqrt(k.max() + NEAR_REST) - np.sqrt(NEAR_REST))
    rate = curve.log_slope(m) * span - 0.5 * np.sign(m) * by_mu / (k + NEAR_REST)
    first, second = np.asarray(basis.spline(mu, 1)), np.asarray(basis.spline(mu, 2))
    return (
        _smoothness(first, second, np.ones(mu.size), np.zeros(mu.size), basis.weights, share=1.0),
        _smoothness(first, second, by_mu / root, rate, basis.weights, share=ROOT_SHARE),
    )


def _smoothness(first: Array, second: Array, speed: Array, rate: Array, weights: Array, *, share: float) -> Smoothness:
    """From ``speed = t'`` and ``rate = t''/t'`` at the nodes and, last, at rest."""
    bend = ((second - rate[:, None] * first) / speed[:, None] ** 2)[:-1] * np.sqrt(weights * speed[:-1])[:, None]
    return Smoothness(bend.T @ bend, first[-1] / speed[-1], share)

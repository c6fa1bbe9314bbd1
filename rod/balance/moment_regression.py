"""Regression of curvature on moment over all points of all photos: the numerical part of the balance way.

Unknowns, in this order: coefficients of log c (see `rod.balance.compliance`), the pre-curvature K0, the errors common
to all photos (`rod.balance.moment_points.CommonErrors`, each in units of its standard deviation), and Legendre
coefficients 1 to 4 of K0(s) - K0. Gauss-Newton; the covariance of the residual depends on the compliance and is renewed
in each iteration. The prior of the law's form is its roughness and its slope at rest (`rod.balance.smoothness`), log c
being flat there for a cable that bends alike to both sides. The posterior is an average over what the law may be smooth
along and over the sizes of both, weighted by their evidence (Laplace), so that the bands hold what the data do not know
about the form of the law.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from rod.balance.compliance import ComplianceBasis, ComplianceCurve, compliance_curve
from rod.balance.moment_points import CommonErrors, MomentPoints, Residual, residual
from rod.balance.smoothness import smoothnesses

Array = NDArray[np.float64]

BOW_TERMS = 4
"""Legendre terms of K0(s) - K0: a linear set from the spool, one and two bows, and a kink's rough place."""

ROUGHNESS_STEPS = 15
"""Values of the roughness averaged over: a factor 1.6 apart, over which the posterior hardly changes."""

SLOPES, SLOPE_STEPS = (0.03, 3.0), 5
"""Sizes of the prior of log c's slope at rest averaged over: from none that could be seen to a factor e^3."""


@dataclass(frozen=True)
class Posterior:
    """Average over what the law may be smooth along, and over the sizes of roughness and slope.

    Attributes
    ----------
    mean : (q,)
    covariance : (q, q)
        Also the response: a change dr of the whitened residual moves the mean by -covariance J^T dr, the weights of the
        sizes included, since d log(evidence) of each is -(J (its mean - mean))^T dr up to a common term.
    shrinkage : (q, p)
        By how much the mean falls short of a law with the coefficients a of log c, per unit of a.
    """

    mean: Array
    covariance: Array
    shrinkage: Array


@dataclass(frozen=True)
class Regression:
    """A settled regression.

    Attributes
    ----------
    curve : ComplianceCurve
    unknowns : (q,)
        See the module for their order; the rows were taken within a hundredth of a standard deviation of them.
    posterior : Posterior
    rows : tuple of Residual
        Whitened, one entry per photo.
    jacobian : (n, q)
        Whitened, of all rows.
    """

    curve: ComplianceCurve
    unknowns: Array
    posterior: Posterior
    rows: tuple[Residual, ...]
    jacobian: Array


@dataclass(frozen=True)
class MomentModel:
    """Data, basis and priors of the regression.

    Attributes
    ----------
    data : tuple of MomentPoints
    basis : ComplianceBasis
    common_std : CommonErrors
        Standard deviations of what is wrong on all photos alike.
    floor : 1/m
        Curvature that no photo resolves.
    roughness : (low, high)
        Range of the prior standard deviation of d^2 log c / dt^2.
    varying : bool
        Whether K0(s) is free to vary.
    force_errors : tuple of mappings of step number -> N
        See `rod.measurement.MeasuredTest`; they are in the bands and not in the fit.
    """

    data: tuple[MomentPoints, ...]
    basis: ComplianceBasis
    common_std: CommonErrors
    floor: float
    roughness: tuple[float, float]
    varying: bool = False
    force_errors: tuple[Mapping[int, float], ...] = ()

    def rows(self, unknowns: Array) -> tuple[ComplianceCurve, tuple[Residual, ...]]:
        """Compliance curve and whitened residuals at the given unknowns."""
        curve, K0, errors = (
            compliance_curve(self.basis, unknowns[: self.size]),
            unknowns[self.size],
            self.errors(unknowns),
        )
        bow = self.bow(unknowns)
        return curve, tuple(
            residual(d, curve, float(K0), varying=bow_terms(d) @ bow, errors=errors, floor=self.floor)
            for d in self.data
        )

    @property
    def size(self) -> int:
        """Number of coefficients of log c: the place of K0; the common errors and K0(s) follow."""
        return int(self.basis.table.shape[1])

    @property
    def common(self) -> slice:
        """Place of the common errors among the unknowns."""
        return slice(self.size + 1, self.size + 1 + len(self.common_std))

    def errors(self, unknowns: Array) -> CommonErrors:
        """The common errors in their units."""
        return CommonErrors(*(float(v) for v in unknowns[self.common] * np.array(self.common_std)))

    def bow(self, unknowns: Array) -> Array:
        """Legendre coefficients of K0(s) - K0, (4,) 1/m."""
        return unknowns[self.common.stop :]

    def columns(self, data: MomentPoints, row: Residual) -> Array:
        """Whitened jacobian of one photo with respect to all unknowns, (n, q)."""
        columns = np.hstack([row.jacobian, -row.whitener @ bow_terms(data)])
        columns[:, self.common] *= np.array(self.common_std)
        return columns

    def posterior(self, unknowns: Array, value: Array, J: Array) -> Posterior:
        """Mean and covariance of the unknowns, averaged over the priors with their evidence as the weight.

        The priors act on the coefficients alone: all other unknowns are eliminated once, and follow.
        """
        p, size = self.size, J.shape[1]
        prior = np.zeros(size)
        prior[self.common] = 1.0
        if not self.varying:  # a prior far sharper than any photo switches them off
            prior[self.common.stop :] = (1e6 / self.floor) ** 2
        normal, pull = J.T @ J + np.diag(prior), J.T @ (J @ unknowns - value)
        law, rest = slice(0, p), slice(p, size)
        unit = 1.0 / np.sqrt(np.diag(normal)[rest])  # unknowns of very different size
        inner = unit[:, None] * np.linalg.inv(unit[:, None] * normal[rest, rest] * unit) * unit
        back = -inner @ normal[rest, law]
        schur, force = normal[law, law] + normal[law, rest] @ back, pull[law] + back.T @ pull[rest]
        precisions, norms = self._priors(compliance_curve(self.basis, unknowns[:p]))
        A = schur + precisions
        inverses = np.linalg.inv(A)
        means = inverses @ force
        evidence = norms + 0.5 * (means @ force - np.linalg.slogdet(A)[1])
        weight = np.exp(evidence - evidence.max())
        weight /= weight.sum()
        mean = weight @ means
        spread = means - mean
        covariance = np.tensordot(weight, inverses, 1) + (weight[:, None] * spread).T @ spread
        shrinkage = np.eye(p) - covariance @ schur
        across = back @ covariance
        return Posterior(
            np.concatenate([mean, inner @ pull[rest] + back @ mean]),
            np.block([[covariance, across.T], [across, inner + across @ back.T]]),
            np.vstack([shrinkage, back @ shrinkage]),
        )

    def _priors(self, curve: ComplianceCurve) -> tuple[Array, Array]:
        """All priors averaged over: their precisions of log c (n, p, p) and the logs of their norms (n,)."""
        rough = np.linspace(np.log(self.roughness[0]), np.log(self.roughness[1]), ROUGHNESS_STEPS)
        steep = np.linspace(np.log(SLOPES[0]), np.log(SLOPES[1]), SLOPE_STEPS)
        log_tau, log_slope = (axis.ravel() for axis in np.meshgrid(rough, steep))
        precisions, norms = [], []
        for smooth in smoothnesses(curve):
            flat = np.outer(smooth.first_slope, smooth.first_slope)
            precision = np.exp(-2.0 * log_tau)[:, None, None] * smooth.roughness
            precisions.append(precision + np.exp(-2.0 * log_slope)[:, None, None] * flat)
            # Each prior counts as often as it has directions: the roughness leaves straight lines free.
            norms.append(np.log(smooth.share) + smooth.log_volume - (self.size - 2) * log_tau - log_slope)
        return np.concatenate(precisions), np.concatenate(norms)


def bow_terms(data: MomentPoints) -> Array:
    """Legendre polynomials 1 to 4 of 2 s/L - 1 at the points of a photo, (n, 4)."""
    t = 2.0 * data.s / data.length - 1.0
    return np.asarray(np.polynomial.legendre.legvander(t, BOW_TERMS)[:, 1:])


def regress(model: MomentModel, *, pre_curvature: float, iterations: int = 25) -> Regression | None:
    """Fit by Gauss-Newton from a straight line of compliance; None if it does not settle."""
    p = model.size
    unknowns = np.concatenate([np.zeros(p), [pre_curvature], np.zeros(len(model.common_std) + BOW_TERMS)])
    for _ in range(iterations):
        rows = model.rows(unknowns)[1]
        value = np.concatenate([row.value for row in rows])
        J = np.vstack([model.columns(d, row) for d, row in zip(model.data, rows, strict=True)])
        posterior = model.posterior(unknowns, value, J)
        move = posterior.mean - unknowns
        # A hundredth of a standard deviation is nothing anyone could see.
        if np.all(np.abs(move) <= 0.01 * np.sqrt(np.maximum(np.diag(posterior.covariance), 0.0)) + 1e-12):
            mean = posterior.mean  # the last move is made, its rows are not taken again
            return Regression(compliance_curve(model.basis, mean[:p]), mean, posterior, rows, J)
        # One unit of log c is a factor e in stiffness: longer steps leave the range of the linearisation.
        unknowns = unknowns + move * min(1.0, 1.0 / max(float(np.max(np.abs(move[:p]))), 1e-12))
    return None


def assumption_checks(model: MomentModel, found: Regression) -> dict[str, float]:
    """Score tests of the assumptions: what would each further freedom explain beyond the noise of `model`.

    Returns
    -------
    dict
        ``left_right_z``: curvature linear in s, in sigma. ``photos_p``: an own K0 for each photo. ``uniform_p``: K0(s)
        with Legendre terms 1 to 4. ``chi2``, ``degrees_of_freedom`` of the fit.
    """
    rows = model.rows(found.unknowns)[1]
    J = np.vstack([model.columns(d, row) for d, row in zip(model.data, rows, strict=True)])
    value = np.concatenate([row.value for row in rows])
    response = model.posterior(found.unknowns, value, J).covariance
    value = value - J @ (response @ (J.T @ value))  # nothing where the model is the one that was fitted
    bow = np.vstack([row.whitener @ bow_terms(d) for d, row in zip(model.data, rows, strict=True)])
    photo = np.zeros((value.size, len(rows)))
    ends = np.cumsum([0] + [row.value.size for row in rows])
    for k, row in enumerate(rows):
        photo[ends[k] : ends[k + 1], k] = row.whitener.sum(axis=1)

    def score(columns: Array) -> Array:
        inside = columns.T @ J
        information = columns.T @ columns - inside @ response @ inside.T
        values, vectors = np.linalg.eigh(information)
        # A combination of which the fit leaves less than a millionth is not testable: it is an unknown itself.
        keep = values > 1e-6 * np.max(np.sum(columns**2, axis=0), initial=0.0)
        return np.asarray((vectors[:, keep].T @ (columns.T @ value)) / np.sqrt(values[keep]))

    def p_value(z: Array) -> float:
        return float(chdtrc(z.size, z @ z)) if z.size else 1.0

    left_right = score(bow[:, :1])
    used = float(np.einsum("ij,jk,ik->", J, response, J))
    return {
        "left_right_z": float(left_right[0]) if left_right.size else 0.0,
        "photos_p": p_value(score(photo)),
        "uniform_p": p_value(score(bow)),
        "chi2": float(value @ value),
        "degrees_of_freedom": max(sum(row.informative for row in rows) - used, 0.0),
    }


def uniform_at_rest(data: MomentPoints, floor: float) -> float:
    """Probability of a force-free photo as uneven as this one if the cable's curvature at rest is constant."""
    covariance = data.by_curve_kappa @ data.curve_covariance @ data.by_curve_kappa.T
    covariance[np.diag_indices_from(covariance)] += floor**2
    columns = np.column_stack([np.ones(data.s.size), bow_terms(data)])
    weighted = np.linalg.solve(covariance, columns)
    information = columns.T @ weighted
    estimate = np.linalg.solve(information, weighted.T @ data.kappa)[1:]
    spread = np.linalg.inv(information)[1:, 1:]
    return float(chdtrc(estimate.size, estimate @ np.linalg.solve(spread, estimate)))

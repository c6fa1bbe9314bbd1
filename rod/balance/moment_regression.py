"""Regression of curvature on moment over all points of all photos: the numerical part of the balance way.

Unknowns, in this order: coefficients of the law (`rod.compliance_law`), the pre-curvature K0, the errors common to all
photos (`rod.balance.moment_points.CommonErrors`, each in units of its standard deviation), and Legendre coefficients 1
to 4 of K0(s) - K0. Gauss-Newton toward the mean over all priors of the law's form (`rod.law_prior`), so that the bands
hold what the data do not know about it; the covariance of the residual depends on the compliance and is renewed in each
iteration. Once settled, the abscissa of the law is laid along the law found, and it is settled again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from rod.array import Array
from rod.balance.moment_points import CommonErrors, MomentPoints, Residual, residual
from rod.compliance_law import ComplianceLaw, LawBasis, refreshed
from rod.law_prior import Forms, Posterior, averaged, priors

BOW_TERMS = 4
"""Legendre terms of K0(s) - K0: a linear set from the spool, one and two bows, and a kink's rough place."""

LAYINGS = 3
"""Times that the abscissa is laid along the law found so far; each leaves a quarter of what the way there left."""

ITERATIONS = 25
"""Bound of the Gauss-Newton method; four or five are usual."""


@dataclass(frozen=True)
class Regression:
    """A converged regression.

    Attributes
    ----------
    model : MomentModel
        With the basis on which the unknowns are.
    curve : ComplianceLaw
    unknowns : (q,)
        See the module for their order; the rows were taken within a hundredth of a standard deviation of them.
    posterior : Posterior
    rows : tuple of Residual
        Whitened, one entry per photo.
    """

    model: MomentModel
    curve: ComplianceLaw
    unknowns: Array
    posterior: Posterior
    rows: tuple[Residual, ...]


@dataclass(frozen=True)
class MomentModel:
    """Data, basis and priors of the regression.

    Attributes
    ----------
    data : tuple of MomentPoints
    basis : LawBasis
    common_std : CommonErrors
        Standard deviations of what is wrong on all photos alike.
    varying : bool
        Whether K0(s) is free to vary.
    blur : float
        Factor on the noise of the photos and forces, above 1 where they contradict each other.
    force_errors : tuple of mappings of step number -> N
        See `rod.measurement.MeasuredTest`; they are in the bands and not in the fit.
    """

    data: tuple[MomentPoints, ...]
    basis: LawBasis
    common_std: CommonErrors
    varying: bool = False
    blur: float = 1.0
    force_errors: tuple[Mapping[int, float], ...] = ()

    def linearised(self, unknowns: Array) -> tuple[tuple[Residual, ...], Array, Array]:
        """Whitened residuals of each photo, those of all (n,), and their derivatives by all unknowns (n, q)."""
        curve, K0, errors = self.basis.law(unknowns[: self.size]), float(unknowns[self.size]), self.errors(unknowns)
        bow = self.bow(unknowns)
        rows = tuple(
            residual(d, curve, K0, varying=bow_terms(d) @ bow, errors=errors, blur=self.blur) for d in self.data
        )
        J = np.vstack([self.columns(d, row) for d, row in zip(self.data, rows, strict=True)])
        return rows, np.concatenate([row.value for row in rows]), J

    @property
    def size(self) -> int:
        """Number of coefficients of log c: the place of K0; the common errors and K0(s) follow."""
        return self.basis.size

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
        columns = np.hstack([row.jacobian, row.whitened(data.by_curvature @ bow_terms(data))])
        columns[:, self.common] *= np.array(self.common_std)
        return columns

    def posterior(self, unknowns: Array, value: Array, J: Array, forms: Forms = "all") -> Posterior:
        """Mean and covariance of the unknowns, averaged over the priors with their evidence as the weight."""
        known = np.zeros(J.shape[1])
        known[self.common] = 1.0
        if not self.varying:  # a prior far sharper than any photo switches them off
            known[self.common.stop :] = 1e6 * max(d.length for d in self.data)
        rows = np.diag(known)[known > 0.0]
        value, J = np.concatenate([value, rows @ unknowns]), np.vstack([J, rows])
        return averaged(value, J, unknowns, priors(self.basis, forms))


def bow_terms(data: MomentPoints) -> Array:
    """Legendre polynomials 1 to 4 of 2 s/L - 1 at the points of a photo, (n, 4)."""
    t = 2.0 * (data.s - data.s[0]) / data.length - 1.0
    return np.asarray(np.polynomial.legendre.legvander(t, BOW_TERMS)[:, 1:])


def regress(model: MomentModel, *, pre_curvature: float) -> Regression | None:
    """Fit by Gauss-Newton from a straight line of compliance; None if it does not converge."""
    unknowns = np.concatenate([np.zeros(model.size), [pre_curvature], np.zeros(len(model.common_std) + BOW_TERMS)])
    found = _settled(model, unknowns, "rough")
    for laid in range(LAYINGS):
        if found is None:
            return None
        met = np.concatenate([d.true_moment(model.errors(found.unknowns)) for d in model.data])
        basis = refreshed(found.curve, float(met.min()), float(met.max()))
        unknowns = np.concatenate([basis.projected(found.curve), found.unknowns[model.size :]])
        found = _settled(replace(model, basis=basis), unknowns, "all" if laid == LAYINGS - 1 else "rough")
    return found


def _settled(model: MomentModel, unknowns: Array, forms: Forms) -> Regression | None:
    """Gauss-Newton from given unknowns; see `rod.law_prior.priors` for `forms`."""
    p = model.size
    for count in range(ITERATIONS):
        rows, value, J = model.linearised(unknowns)
        posterior = model.posterior(unknowns, value, J, forms)
        move = posterior.mean - unknowns
        std = np.sqrt(np.maximum(np.diag(posterior.covariance), 0.0))
        # A fiftieth of a standard deviation is nothing anyone could see.
        if np.all(np.abs(move) <= 0.02 * std + 1e-12):
            mean = posterior.mean  # the last move is made, its rows are not taken again
            return Regression(model, model.basis.law(mean[:p]), mean, posterior, rows)
        if 3 * count > ITERATIONS and np.any(np.abs(move) > std):
            break  # what still goes to and fro by as much never comes to rest
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
    rows, value, J = model.linearised(found.unknowns)
    response = model.posterior(found.unknowns, value, J).covariance
    value = value - J @ (response @ (J.T @ value))  # nothing where the model is the one that was fitted
    bow = np.vstack([row.whitened(d.by_curvature @ bow_terms(d)) for d, row in zip(model.data, rows, strict=True)])
    photo = np.zeros((value.size, len(rows)))
    ends = np.cumsum([0] + [row.value.size for row in rows])
    for k, (d, row) in enumerate(zip(model.data, rows, strict=True)):
        photo[ends[k] : ends[k + 1], k] = row.whitened(d.by_curvature.sum(axis=1))

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
        "degrees_of_freedom": max(float(value.size - len(rows)) - used, 0.0),
    }


def uniform_at_rest(model: MomentModel, data: MomentPoints) -> float:
    """Probability of a force-free photo as uneven as this one if the cable's curvature at rest is constant."""
    law = model.basis.law(np.zeros(model.size))  # without a moment any will do
    row = residual(data, law, 0.0, varying=np.zeros(1), errors=CommonErrors())
    J = model.columns(data, row)[:, model.size :]  # K0, what all photos have in common, bow
    known = np.zeros(J.shape[1])
    known[1 : 1 + len(model.common_std)] = 1.0
    spread = np.linalg.inv(J.T @ J + np.diag(known))[:, -BOW_TERMS:]
    bow = spread.T @ (J.T @ row.value)
    return float(chdtrc(bow.size, bow @ np.linalg.solve(spread[-BOW_TERMS:], bow)))

"""The positive law against quadrature of its own compliance, and its priors against closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf

from rod.compliance_law import COEFFICIENTS, moment_basis, refreshed, splines
from rod.law_prior import NEAR_REST, REACH, REST_SLOPES, ROUGH, SMOOTH, averaged, priors

RNG = np.random.default_rng(3)
STEEP = 2.0 * np.tanh((np.arange(COEFFICIENTS) - 12) / 2.0) + 0.2 * RNG.normal(size=COEFFICIENTS)
"""A fifty-fold fall within a sixth of the abscissa, and ripple on it."""


def laws():
    for low, high in ((0.0, 0.05), (-0.02, 0.05), (-0.03, 0.0)):
        first = moment_basis(low, high, unit=60.0).law(STEEP)
        yield first
        second = refreshed(first, low, high)
        yield second.law(second.projected(first))


@pytest.mark.parametrize("law", list(laws()))
def test_bend_is_the_integral_of_the_compliance(law):
    m = np.linspace(law.basis.moments[0], law.basis.moments[-1], 9)
    exact = [quad(law.compliance, 0.0, at, limit=200, epsabs=1e-9)[0] for at in m]
    assert np.allclose(law.bend(m), exact, atol=2e-6 * np.ptp(exact))
    slope = [(law.bend(at + 1e-8) - law.bend(at - 1e-8)) / 2e-8 for at in m]
    assert np.allclose(slope, law.compliance(m), rtol=2e-4)


@pytest.mark.parametrize("law", list(laws()))
def test_moment_is_the_inverse_and_goes_on_beyond_the_moments_met(law):
    """Moments corrected for a common error of the axes leave the range: bend, compliance and inverse stay one law."""
    span = law.basis.span
    m = np.linspace(law.basis.moments[0] - 0.2 * span, law.basis.moments[-1] + 0.2 * span, 37)
    K0 = 1.7
    K = K0 + law.bend(m)
    assert np.allclose(law.moment(K, K0), m, atol=1e-6 * span)
    assert np.allclose(law.tangent(K, K0) * law.compliance(m), 1.0, rtol=5e-4)  # of order three between ends of cells
    assert np.allclose(law.moment_by_pre_curvature(K, K0), -law.tangent(K, K0))
    step = 1e-6 * np.ptp(K)
    assert np.allclose((law.energy(K + step, K0) - law.energy(K - step, K0)) / (2 * step), m, atol=1e-6 * span)
    assert law.energy(np.array([K0]), K0)[0] == pytest.approx(0.0, abs=1e-15)
    assert np.all(law.log_slope(np.array([m[0], m[-1]])) == 0.0)


@pytest.mark.parametrize("law", list(laws()))
def test_derivatives_by_the_coefficients(law):
    b, h = law.basis, 1e-6
    K = law.bend(np.linspace(b.moments[0] - 0.123 * b.span, b.moments[-1] + 0.123 * b.span, 24))
    by, by_log = law.moment_by_parameters(K, 0.0), law.log_tangent_by_parameters(K, 0.0)
    for i in range(law.parameters):
        ahead, behind = (b.law(law.coefficients + sign * h * np.eye(b.size)[i]) for sign in (1, -1))
        slope = (ahead.moment(K, 0.0) - behind.moment(K, 0.0)) / (2 * h)
        assert np.allclose(by[:, i], slope, atol=1e-6 * b.span)
        # f = 1 / c(m(K)), of order four; `tangent` itself is of order three
        slope = np.log(behind.compliance(behind.moment(K, 0.0)) / ahead.compliance(ahead.moment(K, 0.0))) / (2 * h)
        assert np.allclose(by_log[:, i], slope, atol=1e-4 * np.abs(by_log).max())


def test_a_law_laid_anew_is_the_same_law():
    law = moment_basis(0.0, 0.05, unit=60.0).law(np.linspace(0.0, 3.0, COEFFICIENTS))
    basis = refreshed(law, 0.0, 0.05)
    again = basis.law(basis.projected(law))
    assert np.allclose(again.bend(basis.moments), law.bend(basis.moments), atol=1e-4 * law.bend(0.05))
    share = 0.5 * (basis.moments / 0.05 + law.bend(basis.moments) / law.bend(0.05))
    assert np.allclose(basis.xi[::2], share, atol=1e-4)


def test_a_law_needs_moments():
    with pytest.raises(ValueError, match="loaded cable"):
        moment_basis(0.0, 0.0, unit=1.0)


def quadratic(forms, a):
    """Twice minus the log densities of coefficients a, one per prior and slope at rest."""
    return np.einsum("i,nij,j->n", a, forms.precisions, a)


def test_priors_are_the_integrals_of_the_module():
    """Of g = t^3 and g = t, which the splines hold, rest at t = 0; then of g = logarithm, straight over its own abscissa."""
    basis = moment_basis(0.0, 0.05, unit=60.0)
    t = np.linspace(0.0, 1.0, 400)
    half = (ROUGH.size + SMOOTH.size) * len(REST_SLOPES)
    cube, line = (np.linalg.lstsq(splines(basis.size)(t), t**n, rcond=None)[0] for n in (3, 1))
    exact = np.r_[(36.0 / 3.0 + 9.0 / 5.0 / REACH**2) / ROUGH**2, (36.0 + 36.0 / 3.0 + 9.0 / 5.0) / SMOOTH**2]
    assert np.allclose(quadratic(priors(basis), cube)[:half], np.tile(exact, len(REST_SLOPES)), rtol=1e-8)
    for k, slope in enumerate(REST_SLOPES):
        told = quadratic(priors(basis), line)[k * exact.size : (k + 1) * exact.size]
        exact = np.r_[1 / REACH**2 / ROUGH**2, 1 / SMOOTH**2] + 1 / slope**2
        assert np.allclose(told, exact, rtol=1e-6)  # third derivatives of lines are differences of large numbers
    rough = [form[: ROUGH.size] for form in np.split(quadratic(priors(basis), cube), 2 * len(REST_SLOPES))]
    assert np.allclose(quadratic(priors(basis, smooth=False), cube), np.concatenate(rough))
    many = moment_basis(0.0, 0.05, unit=60.0, size=80)
    logarithm = np.log1p(t / NEAR_REST) / np.log1p(1.0 / NEAR_REST)
    a = np.linalg.lstsq(splines(80)(t), logarithm, rcond=None)[0]
    at_rest = float(splines(80)(0.0, 1) @ a)
    told = quadratic(priors(many), a)[half : half + ROUGH.size] - at_rest**2 / REST_SLOPES[0] ** 2
    assert np.allclose(told, 1 / REACH**2 / ROUGH**2, rtol=0.02)
    level = priors(basis).precisions @ np.ones(basis.size)
    assert np.allclose(level, 0.0, atol=1e-9 * priors(basis).precisions.max())


def test_the_norm_of_a_prior_is_that_of_its_density():
    """Over all g but its level the density integrates to one: by the determinant."""
    forms = priors(moment_basis(0.0, 0.05, unit=60.0))
    for precision, norm in zip(forms.precisions, forms.log_norms, strict=True):
        values = np.linalg.eigvalsh(precision)[1:]  # the first is the level, without a prior
        assert norm == pytest.approx(0.5 * np.sum(np.log(values)), abs=1e-3)


def data(rng, noise=0.05):
    """A linear problem: g seen at places along t, and a further unknown that adds to all of them."""
    basis = moment_basis(0.0, 0.05, unit=60.0)
    at = np.linspace(0.05, 1.0, 120)
    J = np.hstack([splines(basis.size)(at), at[:, None] ** 2]) / noise
    known = np.zeros((1, basis.size + 1))
    known[0, -1] = 1.0
    true = np.exp(-0.5 * ((at - 0.5) / 0.15) ** 2)
    value = np.r_[-(true / noise + rng.normal(size=at.size)), 0.0]
    return basis, at, true, value, np.vstack([J, known])


def test_posterior_covers_and_answers_to_the_data_by_its_covariance():
    inside = []
    for seed in range(40):
        basis, at, true, value, J = data(np.random.default_rng(seed))
        found = averaged(value, J, np.zeros(J.shape[1]), priors(basis))
        seen = np.hstack([splines(basis.size)(at), at[:, None] ** 2])
        std = np.sqrt(np.einsum("ij,jk,ik->i", seen, found.covariance, seen))
        inside.append(np.mean(np.abs(seen @ found.mean - true) < 1.96 * std))
    assert 0.9 < np.mean(inside) <= 1.0
    push = RNG.normal(size=value.size) * 1e-3
    ahead, behind = (averaged(value + sign * push, J, np.zeros(J.shape[1]), priors(basis)).mean for sign in (1, -1))
    # the weights of the priors move with the data too, which one prior's normal equations would miss
    assert np.allclose(0.5 * (ahead - behind), -found.covariance @ (J.T @ push), atol=1e-6)


def test_evidence_tells_smooth_laws_from_those_with_a_step():
    shares = []
    for step in (False, True):
        basis, at, _, _, J = data(RNG)
        true = 2.0 * erf((at - 0.5) / 0.02) if step else 1.5 * at**2
        value = np.r_[-(true / 0.05 + np.random.default_rng(4).normal(size=at.size)), 0.0]
        weights = averaged(value, J, np.zeros(J.shape[1]), priors(basis)).weights
        shares.append(float(weights.reshape(-1, ROUGH.size + SMOOTH.size)[:, ROUGH.size :].sum()))
    assert shares[0] > 0.5
    assert shares[1] < 0.05


@pytest.mark.parametrize("strength", [1e3, 1e6, 1e8])
def test_no_variance_is_negative_where_the_other_unknowns_imitate_the_law(strength):
    rng = np.random.default_rng(1)
    basis = moment_basis(0.0, 0.05, unit=60.0)
    others, law = rng.normal(size=(60, 4)), 1e-3 * rng.normal(size=(60, basis.size))
    J = np.block([[law + strength * others[:, :1], strength * others], [np.zeros((4, basis.size)), np.eye(4)]])
    found = averaged(np.r_[rng.normal(size=60), np.zeros(4)], J, np.zeros(basis.size + 4), priors(basis))
    assert np.all(np.diag(found.covariance) > 0.0)

"""The positive law against quadrature of its own compliance, and its priors against closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf

from rod.compliance_law import COEFFICIENTS, moment_basis, refreshed, splines
from rod.inverse.laws import over_moments
from rod.law_prior import FREER, PLACES, QUICK, REACH, REST_SLOPES, TAUS, Posterior, averaged, priors
from rod.measured_law import propagated
from rod.stiffness_law import StiffnessLaw

RNG = np.random.default_rng(3)
RIPPLE = 0.2
STEEP = 2.0 * np.tanh((np.arange(COEFFICIENTS) - 12) / 2.0) + RIPPLE * RNG.normal(size=COEFFICIENTS)
"""A fifty-fold fall within a sixth of the abscissa, and ripple on it."""

AT = np.asarray(splines(COEFFICIENTS)(np.linspace(0.0, 1.0, 400)))


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
    assert law.stiffness_scale == pytest.approx(1.0 / law.compliance(law.basis.moments).min())


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
    """Log c rises by 3 along the moment: the share of its change is that of the moment, and counts for 3 / 4."""
    law = moment_basis(0.0, 0.05, unit=60.0).law(np.linalg.lstsq(AT, 3.0 * np.linspace(0, 1, len(AT)), rcond=None)[0])
    basis = refreshed(law, 0.0, 0.05)
    again = basis.law(basis.projected(law))
    assert np.allclose(again.bend(basis.moments), law.bend(basis.moments), atol=1e-4 * law.bend(0.05))
    moment, bend = basis.moments / 0.05, law.bend(basis.moments) / law.bend(0.05)
    assert np.allclose(basis.xi[::2], (1.75 * moment + bend) / 2.75, atol=1e-4)


def test_a_law_needs_moments():
    with pytest.raises(ValueError, match="loaded cable"):
        moment_basis(0.0, 0.0, unit=1.0)


def quadratic(families, a):
    """Twice minus the log densities of coefficients a, (families, TAUS)."""
    return np.array([(a @ one.form @ a) / TAUS**2 + a @ one.fixed @ a for one in families])


def test_priors_are_the_integrals_of_the_module():
    """Of t^3 and t, which the splines hold, rest at t = 0."""
    basis = moment_basis(0.0, 0.05, unit=60.0)
    t = np.linspace(0.0, 1.0, 400)
    cube, line = (np.linalg.lstsq(splines(basis.size)(t), t**n, rcond=None)[0] for n in (3, 1))
    rough, smooth = 36.0 / 3.0 + 9.0 / 5.0 / REACH**2, 36.0 + 36.0 / 3.0 + 9.0 / 5.0
    told = quadratic(priors(basis, "even"), cube).reshape(len(REST_SLOPES), 2, TAUS.size)
    assert np.allclose(told, np.outer([rough, smooth], TAUS**-2.0), rtol=1e-8)
    told = quadratic(priors(basis, "even"), line).reshape(len(REST_SLOPES), 2, TAUS.size)
    exact = np.outer([1 / REACH**2, 1.0], TAUS**-2.0) + np.array(REST_SLOPES)[:, None, None] ** -2
    assert np.allclose(told, exact, rtol=1e-6)  # third derivatives of lines are differences of large numbers
    assert np.allclose(quadratic(priors(basis, "rough"), cube), quadratic(priors(basis, "even"), cube)[::2])
    for one in priors(basis):
        assert np.allclose((one.form + one.fixed) @ np.ones(basis.size), 0.0, atol=1e-9 * one.form.max())


def test_quick_laws_are_freer_in_one_third():
    """Of t^2, rest at t = 0: g1 = 2 t, g2 = 2, integrated over each third and over the rest."""
    basis = moment_basis(0.0, 0.05, unit=60.0)
    t = np.linspace(0.0, 1.0, 400)
    square = np.linalg.lstsq(splines(basis.size)(t), t**2, rcond=None)[0]
    even, every = priors(basis, "even"), priors(basis)
    quick = every[len(even) :]
    assert len(quick) == PLACES * len(REST_SLOPES)
    begin = np.repeat(np.linspace(0.0, 1.0 - QUICK, PLACES), len(REST_SLOPES))
    whole, third = (
        4.0 * (high - low) + 4.0 / 3.0 * (high**3 - low**3) / REACH**2
        for low, high in ((0.0, 1.0), (begin, begin + QUICK))
    )
    exact = (whole - third + third / FREER**2)[:, None] / TAUS**2
    assert np.allclose(quadratic(quick, square), exact, rtol=1e-6)
    # half of the weight beforehand: the norms hold what the determinants do not
    shares = [one.log_norms[0] - 0.5 * slogdet_without_level(one.form / TAUS[0] ** 2 + one.fixed) for one in every]
    assert np.exp(shares[: len(even)]) == pytest.approx(np.ones(len(even)), abs=1e-3)
    assert np.exp(shares[len(even) :]).sum() == pytest.approx(len(even), rel=1e-3)


def slogdet_without_level(precision):
    return np.sum(np.log(np.linalg.eigvalsh(precision)[1:]))


def test_the_norm_of_a_prior_is_that_of_its_density():
    """Over all g but its level the density integrates to one: by the determinant."""
    for one in priors(moment_basis(0.0, 0.05, unit=60.0), "even"):
        for tau, norm in zip(TAUS, one.log_norms, strict=True):
            values = np.linalg.eigvalsh(one.form / tau**2 + one.fixed)[1:]  # the first is the level, without a prior
            assert norm == pytest.approx(0.5 * np.sum(np.log(values)), abs=1e-3)


def test_average_is_that_of_each_prior_by_its_normal_equations():
    basis, _, _, value, J = data(np.random.default_rng(5))
    at, p = RNG.normal(size=J.shape[1]), basis.size
    families = priors(basis)
    found = averaged(value, J, at, families)
    means, covariances, evidence = [], [], []
    for one in families:
        for tau, norm in zip(TAUS, one.log_norms, strict=True):
            P = np.zeros((p + 1, p + 1))
            P[:p, :p] = one.form / tau**2 + one.fixed
            A = J.T @ J + P
            means.append(at - np.linalg.solve(A, J.T @ value + P @ at))
            there = value + J @ (means[-1] - at)
            covariances.append(np.linalg.inv(A))
            misfit = there @ there + means[-1] @ P @ means[-1]
            evidence.append(norm - 0.5 * (misfit + np.linalg.slogdet(A)[1]))
    weights = np.exp(np.array(evidence) - max(evidence))
    weights /= weights.sum()
    mean = weights @ means
    off = np.array(means) - mean
    assert found.log_evidence == pytest.approx(max(evidence) + np.log(np.mean(np.exp(evidence - max(evidence)))))
    assert np.allclose(found.weights.ravel(), weights, atol=1e-6)
    assert np.allclose(found.mean, mean, atol=1e-6)
    whole = np.tensordot(weights, covariances, 1) + (weights[:, None] * off).T @ off
    assert np.allclose(found.covariance, whole, atol=1e-5 * whole.max())


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
    smooth, quick = [], []
    for step in (False, True):
        basis, at, _, _, J = data(RNG)
        even = len(priors(basis, "even"))
        true = 2.0 * erf((at - 0.5) / 0.02) if step else 1.5 * at**2
        value = np.r_[-(true / 0.05 + np.random.default_rng(4).normal(size=at.size)), 0.0]
        weights = averaged(value, J, np.zeros(J.shape[1]), priors(basis)).weights
        smooth.append(float(weights[1:even:2].sum()))
        quick.append(float(weights[even:].sum()))
    assert smooth[1] < 0.05
    assert smooth[0] > 5.0 * smooth[1]
    assert quick[1] > 0.95
    assert quick[0] < 0.5  # less than beforehand


@pytest.mark.parametrize("strength", [1e3, 1e6, 1e8])
def test_no_variance_is_negative_where_the_other_unknowns_imitate_the_law(strength):
    rng = np.random.default_rng(1)
    basis = moment_basis(0.0, 0.05, unit=60.0)
    others, law = rng.normal(size=(60, 4)), 1e-3 * rng.normal(size=(60, basis.size))
    J = np.block([[law + strength * others[:, :1], strength * others], [np.zeros((4, basis.size)), np.eye(4)]])
    found = averaged(np.r_[rng.normal(size=60), np.zeros(4)], J, np.zeros(basis.size + 4), priors(basis))
    assert np.all(np.diag(found.covariance) > 0.0)


def test_forms_of_a_normal_prior_are_that_prior():
    """Of a posterior by one normal prior its forms are those of the prior, whatever the data; the level has none."""
    one = priors(moment_basis(0.0, 0.05, unit=60.0))[0]
    precision = one.form / 2.0**2 + one.fixed
    rows = RNG.normal(size=(40, COEFFICIENTS))
    information = rows.T @ rows
    covariance = np.linalg.inv(information + precision)
    none = np.empty(0)
    forms = Posterior(none, covariance, none, none, 0.0, information).law_forms
    level = np.full((COEFFICIENTS, COEFFICIENTS), 1.0 / COEFFICIENTS)
    apart = np.eye(COEFFICIENTS) - level
    exact = np.linalg.pinv(precision, rcond=1e-10)
    assert forms.shape[1] == COEFFICIENTS - 1
    assert np.allclose(apart @ forms @ forms.T @ apart, apart @ exact @ apart, atol=1e-6 * exact.max())


def test_bands_of_all_readings_are_those_of_their_derivatives():
    """Of m = a (K - K0) + b (K - K0)^3, linearised about three unknowns; the secant is the tangent at rest."""
    kappa, rest = np.linspace(1.0, 9.0, 9), 2.0
    C = 1e-4 * np.array([[4.0, 1.0, -0.5], [1.0, 9.0, 2.0], [-0.5, 2.0, 16.0]])

    def read(a, b, K0):
        D = kappa - K0
        return a * D + b * D**3, a + 3.0 * b * D**2, a + b * D**2

    def by(number):
        steps = [read(*(np.array([5.0, 0.1, rest]) + sign * h)) for h in 1e-6 * np.eye(3) for sign in (1.0, -1.0)]
        return np.column_stack([(steps[2 * k][number] - steps[2 * k + 1][number]) / 2e-6 for k in range(3)])

    moment, tangent, secant = read(5.0, 0.1, rest)
    law = propagated(
        kappa,
        rest,
        moment=moment,
        tangent=tangent,
        by_moment=by(0),
        by_log=by(1) / tangent[:, None],
        by_pre_curvature=np.array([0.0, 0.0, 1.0]),
        covariance=C,
    )
    assert np.allclose(law.secant, secant)
    away = np.abs(kappa - rest) > 0.5
    for number, std in ((0, law.moment_std), (1, law.tangent_std), (2, law.secant_std)):
        exact = np.sqrt(np.einsum("ij,jk,ik->i", by(number), C, by(number)))
        assert np.allclose(std[away], exact[away], rtol=1e-6)
    assert law.secant_std[~away] == pytest.approx(law.tangent_std[~away])
    assert law.pre_curvature_std == pytest.approx(0.04)


@pytest.mark.parametrize("size", [3.0, 6.0, 10.0])
def test_an_abscissa_along_a_law_that_is_hardly_stiff_at_all_rises(size):
    """A fit on its way to nowhere made such laws, whose own abscissa swings back between its points."""
    start = moment_basis(0.0, 10.0, unit=5e-3, size=16)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        law = StiffnessLaw(start.law(size * rng.standard_normal(16)))
        rise = over_moments(law, np.array([0.0, 10.0]))
        for _ in range(4):
            moments = law.rise.bend(np.array([0.0, 10.0]))
            basis = refreshed(rise, *moments, size=24)
            assert np.all(np.diff(basis.moments) > 0.0)
            rise = basis.law(basis.projected(rise) + 0.5 * size * rng.standard_normal(24))

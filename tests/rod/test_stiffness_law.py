"""The law of the bend against quadrature of its own stiffness, and against the same law over the moment."""

import numpy as np
import pytest
from scipy.integrate import quad

from rod.compliance_law import COEFFICIENTS, moment_basis, refreshed
from rod.stiffness_law import StiffnessLaw

FALLS = -1.5 * np.tanh((np.arange(COEFFICIENTS) - 9) / 2.0) + 0.1 * np.random.default_rng(4).normal(size=COEFFICIENTS)
"""A twenty-fold fall of the stiffness, and ripple on it."""


def laws():
    for low, high in ((0.0, 9.0), (-4.0, 9.0)):
        first = moment_basis(low, high, unit=5e-3).law(FALLS)
        yield StiffnessLaw(first)
        second = refreshed(first, low, high)
        yield StiffnessLaw(second.law(second.projected(first)))


@pytest.mark.parametrize("law", list(laws()))
def test_moment_is_the_integral_of_the_stiffness(law):
    D, K0, span = law.basis.moments[[0, 40, 90, 160, -1]], 1.7, law.basis.span
    moment = [quad(law.rise.compliance, 0.0, at, limit=200)[0] for at in D]
    assert np.allclose(law.moment(K0 + D, K0), moment, atol=2e-6 * max(moment))
    # between the ends of cells the tangent is of order three; beyond the last one it stays
    between = np.linspace(D[0], D[-1] + 0.2 * span, 137)
    assert np.allclose(law.tangent(K0 + between, K0), law.rise.compliance(between), rtol=5e-4)
    assert np.allclose(law.moment_by_pre_curvature(K0 + D, K0), -law.tangent(K0 + D, K0))
    h = 1e-6 * span
    slope = np.log(law.rise.compliance(between[:100] + h) / law.rise.compliance(between[:100] - h)) / (2 * h)
    inside = -law.log_tangent_by_pre_curvature(K0 + between[:100], K0)
    assert np.allclose(inside[1:], slope[1:], atol=1e-5 * np.abs(slope).max())


@pytest.mark.parametrize("law", list(laws()))
def test_derivatives_by_the_coefficients(law):
    b, h = law.basis, 1e-6
    K = np.linspace(b.moments[0] - 0.123 * b.span, b.moments[-1] + 0.123 * b.span, 24)
    by, by_log = law.moment_by_parameters(K, 0.0), law.log_tangent_by_parameters(K, 0.0)
    for i in range(law.parameters):
        ahead, behind = (StiffnessLaw(b.law(law.rise.coefficients + s * h * np.eye(b.size)[i])) for s in (1, -1))
        slope = (ahead.moment(K, 0.0) - behind.moment(K, 0.0)) / (2 * h)
        assert np.allclose(by[:, i], slope, atol=1e-6 * np.abs(by).max())
        slope = np.log(ahead.rise.compliance(K) / behind.rise.compliance(K)) / (2 * h)
        assert np.allclose(by_log[:, i], slope, atol=1e-6)


@pytest.mark.parametrize("law", list(laws()))
def test_it_is_the_law_over_the_moment_with_both_exchanged(law):
    """The inverse of the moment curve, laid as a compliance law, gives the same moments and tangents."""
    D, m = law.basis.moments, law.rise.bends
    basis = moment_basis(float(m[0]), float(m[-1]), unit=1.0 / law.basis.unit, size=80)
    log_c = -np.log(law.tangent(np.interp(basis.moments, m, D), 0.0) * basis.unit)
    other = basis.law(np.linalg.lstsq(basis.at_ends, log_c, rcond=None)[0])
    assert np.allclose(other.moment(D, 0.0), m, atol=2e-3 * np.ptp(m))

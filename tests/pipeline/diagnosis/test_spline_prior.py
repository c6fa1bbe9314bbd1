"""The spline of the diagnosis and the average over its priors, against quadrature and by limits."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from pipeline.diagnosis.fits.knots import first_slope, place_knots, roughness
from pipeline.diagnosis.fits.spline_average import average
from pipeline.diagnosis.fits.spline_prior import Along


def test_roughness_is_the_integral_of_the_squared_bend():
    knots, z = place_knots(1.0, 9.0, 6), np.array([0.3, -0.1, 0.4, 0.2, 0.9, 0.0])
    t = (knots - knots[0]) / np.ptp(knots)
    spline = CubicSpline(t, z, bc_type="natural")
    integral = sum(quad(lambda x: spline(x, 2) ** 2, a, b)[0] for a, b in pairwise(t))
    assert z @ roughness(knots) @ z == pytest.approx(integral, rel=1e-9)
    assert first_slope(knots) @ z == pytest.approx(float(spline(0.0, 1)), rel=1e-12)


def test_straight_lines_have_no_roughness():
    knots = place_knots(0.0, 5.0, 7)
    assert knots @ roughness(knots) @ knots == pytest.approx(0.0, abs=1e-9)


def test_knots_need_a_range():
    with pytest.raises(ValueError, match="at least three"):
        place_knots(0.0, 5.0, 2)
    with pytest.raises(ValueError, match="not empty"):
        place_knots(5.0, 5.0, 3)


@pytest.mark.parametrize("seed", range(4))
def test_no_variance_is_negative_where_the_other_unknowns_imitate_the_law(seed):
    # What the law does to the data is `strength` times what one of four others does, but for 1e-3. Then the level is as
    # well known as that one's prior, and its variance falls with the square of `strength`.
    rng, strength, k = np.random.default_rng(seed), np.array([1e3, 1e6, 1e8]), 8
    others, law = rng.normal(size=(60, 4)), 1e-3 * rng.normal(size=(60, k + 1))
    value = np.r_[rng.normal(size=60), np.zeros(4)]
    along = (Along(np.linspace(0.0, 1.0, k)),)
    least = []
    for times in strength:
        alike = law + times * others[:, :1] * np.r_[np.ones(k), 0.0]
        J = np.block([[alike, times * others], [np.zeros((4, k + 1)), np.eye(4)]])
        least.append(np.diag(average(value, J, np.zeros(k + 5), along, (0.05, 60.0)).covariance).min())
    assert np.allclose(strength**2 * least, strength[0] ** 2 * least[0], rtol=1e-6)

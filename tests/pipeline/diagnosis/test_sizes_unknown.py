"""Amounts of unknown size: the closed form held against sums of normal densities and quadrature."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from pipeline.diagnosis.posterior.evidence import SIZES, _sizes_unknown


def cause(plausible, sign=0):
    return SimpleNamespace(plausible=lambda facts: plausible, sign=sign)


def told(value, covariance, parts):
    return float(_sizes_unknown(np.array([value]), np.array([covariance]), parts, None)[0])


@pytest.mark.parametrize("share", [0.0, 0.7, -0.9999])
def test_amounts_of_two_causes_are_weighed_together(share):
    """Also where the data know little but a combination of them: a load and the gain of the cell that weighs it."""
    value, std = np.array([-2.0, 0.6, 0.04]), np.array([2.9, 0.8, 1.5])
    across = np.array([[1.0, share**2, share], [share**2, 1.0, share], [share, share, 1.0]])
    covariance = np.outer(std, std) * across
    logs = [
        multivariate_normal.logpdf(value, cov=covariance + np.diag([(one * 1.9) ** 2] * 2 + [(other * 0.01) ** 2]))
        for one in SIZES
        for other in SIZES
    ]
    exact = logsumexp(logs) - 2.0 * np.log(len(SIZES))
    assert told(value, covariance, [(cause(1.9), [0, 1]), (cause(0.01), [2])]) == pytest.approx(exact, abs=1e-6)


def test_amounts_of_one_cause_are_of_one_size_and_sign():
    """Normal about zero, and of one sign alone: twice as dense there."""
    value, std = np.array([0.8, -0.1]), np.array([0.5, 0.4])

    def seen(size, k):
        def among(a):
            return 2.0 * norm.pdf(value[k], a, std[k]) * norm.pdf(a, 0.0, 0.5 * size)

        return quad(among, 0.0, 8.0 * 0.5 * size, points=[min(0.8, 4.0 * size)])[0]

    exact = np.log(np.mean([seen(size, 0) * seen(size, 1) for size in SIZES]))
    assert told(value, np.diag(std**2), [(cause(0.5, sign=1), [0, 1])]) == pytest.approx(exact, abs=1e-6)

"""Penalised least squares against dense linear algebra that shares no step with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import block_diag

from pipeline.vision.centerline.smoothing import Problem, whiten

N, P = 60, 9


def problem(seed: int = 0) -> Problem:
    rng = np.random.default_rng(seed)
    position = np.sort(rng.uniform(0.0, 10.0, N))
    design = np.vander(position / 10.0, P, increasing=True) + 0.05 * rng.standard_normal((N, P))
    return Problem(
        design=design,
        data=design @ rng.standard_normal(P) + 0.1 * rng.standard_normal(N),
        penalty=np.diff(np.eye(P - 2), 2, axis=0),
        null=4,
        std=rng.uniform(0.5, 2.0, N),
        position=position,
    )


def correlation(task: Problem, length: float):
    return np.exp(-np.abs(task.position[:, None] - task.position) / length)


def dense_criterion(task: Problem, length: float, weight: float):
    """-2 log restricted likelihood with sigma profiled out, by determinants of full matrices."""
    V = correlation(task, length) * np.outer(task.std, task.std)
    S = block_diag(np.zeros((2, 2)), task.penalty.T @ task.penalty)
    A = task.design.T @ np.linalg.solve(V, task.design) + weight * S
    q = np.linalg.solve(A, task.design.T @ np.linalg.solve(V, task.data))
    r = task.data - task.design @ q
    free = N - task.null
    sigma2 = (r @ np.linalg.solve(V, r) + weight * q @ S @ q) / free
    rank = P - task.null
    value = free * np.log(sigma2) + np.linalg.slogdet(A)[1] - rank * np.log(weight) + np.linalg.slogdet(V)[1]
    return value, q, sigma2, A


def test_whitening_gives_independent_errors():
    task = problem()
    V = correlation(task, 0.8) * np.outer(task.std, task.std)
    W = whiten(np.eye(N), task.std, task.gaps, 0.8)
    assert_allclose(W @ V @ W.T, np.eye(N), atol=1e-10)


def test_estimate_is_the_minimum_at_the_likeliest_weight():
    task = problem()
    weights = np.geomspace(1e-4, 1e4, 401)
    best = weights[np.argmin([dense_criterion(task, 0.8, w)[0] for w in weights])]
    exact = dense_criterion(task, 0.8, best)[1]
    # The program tries weights a factor of about two apart, which moves the estimate by a part of its error.
    error = np.sqrt(np.diag(task.smooth(0.8).covariance))
    assert np.max(np.abs(task.estimate(0.8) - exact) / error) < 0.15


@pytest.mark.parametrize("seed", [3, 5, 7])
def test_correlation_length_has_the_likelihood_of_the_dense_form(seed):
    task, rng = problem(seed), np.random.default_rng(seed)
    data = task.design @ rng.standard_normal(P) + 0.1 * task.std * errors(rng, task.position, 0.6)
    task = replace(task, data=data)
    lengths = np.geomspace(0.05, 5.0, 30)
    weights = np.geomspace(1e-5, 1e5, 30)
    value = [min(dense_criterion(task, length, w)[0] for w in weights) for length in lengths]
    found = task.correlation_length(5.0)
    at_found = min(dense_criterion(task, found, w)[0] for w in weights)
    assert at_found < min(value) + 0.2  # a tenth of what one standard deviation costs would be 0.1


def errors(rng, position, length: float):
    """Gaussian errors of unit variance and correlation exp(-ds / length), by the root of the full matrix."""
    V = np.exp(-np.abs(position[:, None] - position) / length)
    return np.linalg.cholesky(V + 1e-12 * np.eye(len(position))) @ rng.standard_normal(len(position))


def test_covariance_is_that_of_all_weights():
    """Mean of covariances plus spread of estimates over the likelihood of the weight, by dense matrices."""
    task = problem(1)
    weights = np.geomspace(1e-9, 1e9, 401)
    value, q, sigma2, A = zip(*(dense_criterion(task, 0.8, w) for w in weights), strict=True)
    odds = np.exp(-0.5 * (np.array(value) - min(value)))
    odds /= odds.sum()
    q = np.array(q)
    mean = odds @ q
    each = sum(o * s * np.linalg.inv(a) for o, s, a in zip(odds, sigma2, A, strict=True) if o > 1e-12)
    total = each + ((q - mean) * odds[:, None]).T @ (q - mean)
    found = task.smooth(0.8)
    # the program's weights are a factor of about two apart, here they are one of a tenth
    assert_allclose(np.sqrt(np.diag(found.covariance)), np.sqrt(np.diag(total)), rtol=0.03)


def test_gain_is_the_derivative_with_respect_to_the_data():
    task = problem(2)
    found = task.smooth(0.8)
    assert_allclose(found.gain @ task.data, found.estimate, rtol=1e-8)

"""Medians are numpy's, whatever is among the numbers, and no warning where there are none."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.vision.median import median, medians, quantile

SIZES = [1, 2, 3, 240, 5000]


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("size", SIZES)
def test_as_numpys(kind, size):
    values = np.random.default_rng(size).normal(size=(4, size)).astype(kind)
    assert median(values[0]) == np.median(values[0])
    assert np.array_equal(medians(values, axis=1), np.median(values, axis=1))
    assert np.array_equal(medians(values.T, axis=0), np.median(values, axis=1))
    assert medians(values, axis=1).dtype == kind


@pytest.mark.parametrize("size", [5, 6, 2000, 2001])
def test_one_that_is_no_number_leaves_none(size):
    values = np.arange(2 * size, dtype=float).reshape(2, size)
    values[0, 1] = np.nan
    assert np.isnan(median(values[0])) and np.array_equal(np.isnan(medians(values, axis=1)), [True, False])
    assert np.isnan(median(np.empty(0))) and np.isnan(medians(np.empty((2, 0)), axis=1)).all()


def test_levels_of_a_picture_do_not_run_over():
    levels = np.array([[200, 250, 100, 251]], np.uint8)
    assert median(levels) == 225.0 and medians(levels, axis=1)[0] == 225.0
    assert median(levels[:, :3]) == 200.0


@pytest.mark.parametrize("share", [0.0, 0.005, 0.1, 0.75, 0.98, 1.0])
def test_quantiles_are_linear_between_neighbours(share):
    values = np.random.default_rng(1).normal(size=(30, 11))
    assert quantile(values, share) == pytest.approx(np.quantile(values, share), abs=1e-15)
    assert quantile(values[0, :1], share) == values[0, 0]

import numpy as np
import pytest

from pipeline.diagnosis.statistics.gain import Fold, folds_by_level, held_out, whitened_by_prediction


def test_both_branches_of_a_level_are_left_out_together_and_the_mounted_step_never():
    displacement = np.array([0.0, 1.0, 2.0, 3.0, 2.001, 1.0])
    branch = ("mounted", *("loading",) * 3, *("unloading",) * 2)
    assert folds_by_level(displacement, branch, same=0.01) == [[1, 5], [2, 4], [3]]


def folds(rng, effect):
    """Straight line plus an effect that bends; the base model is the line, the extended one has the bend."""
    x = np.linspace(-1.0, 1.0, 60)
    line, bend = np.column_stack([np.ones(60), x]), x**3
    full = np.column_stack([line, bend])
    data = effect * bend + rng.standard_normal(60)
    made = []
    for part in np.array_split(np.arange(60), 4):
        kept = np.setdiff1d(np.arange(60), part)
        left = [data[part] - d[part] @ np.linalg.lstsq(d[kept], data[kept], rcond=None)[0] for d in (line, full)]
        made.append(Fold(left[0], left[1], full[kept], full[part]))
    return made


def test_true_extension_removes_the_excess_on_what_it_has_not_seen():
    shares = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        removed, interval = held_out(folds(rng, 20.0), draws=500, rng=rng)
        assert interval[0] <= removed <= interval[1]
        shares.append(removed)
    assert np.mean(shares) == pytest.approx(1.0, abs=0.02)


def test_nothing_is_shared_out_where_the_base_has_no_excess():
    rng = np.random.default_rng(1)
    assert held_out(folds(rng, 0.0), draws=500, rng=rng) is None


def test_a_useless_extension_removes_nothing():
    rng = np.random.default_rng(2)
    made = [Fold(fold.base, fold.base, fold.inside, fold.outside) for fold in folds(rng, 20.0)]
    assert held_out(made, draws=500, rng=rng)[0] == 0.0


def test_what_the_kept_data_do_not_tell_counts_for_neither_model():
    inside = np.array([[1.0, 0.0], [1.0, 0.0]])
    outside = np.array([[0.0, 1.0], [1.0, 0.0]])
    unknown, known = whitened_by_prediction(Fold(np.eye(2)[0], np.eye(2)[1], inside, outside))
    assert unknown @ unknown < 1e-6
    assert known @ known == pytest.approx(1.0 / 1.5)


def test_whitening_by_prediction_is_that_of_the_full_covariance():
    rng = np.random.default_rng(3)
    inside, outside, residual = rng.normal(size=(30, 4)), rng.normal(size=(12, 4)), rng.normal(size=12)
    covariance = np.eye(12) + outside @ np.linalg.solve(inside.T @ inside, outside.T)
    white, same = whitened_by_prediction(Fold(residual, residual, inside, outside))
    assert white @ same == pytest.approx(residual @ np.linalg.solve(covariance, residual), rel=1e-10)


def test_a_hold_of_200_000_samples_is_weighed():
    rng = np.random.default_rng(4)
    outside, noise = rng.normal(size=(200_000, 2)), rng.normal(size=200_000)
    fold = Fold(0.2 + noise, noise, np.eye(2) * 1e3, outside)
    _, interval = held_out([fold], draws=500, rng=rng)
    assert interval[0] < 1.0 == interval[1] and interval[1] - interval[0] < 1.0

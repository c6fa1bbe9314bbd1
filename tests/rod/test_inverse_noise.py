from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from fixtures.continuum import Cable
from fixtures.hidden import LOOP, SIX, THREE, Reading, hidden_test
from fixtures.trials import f_error
from pipeline.diagnosis.diagnose import diagnose
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.force_noise import SPREADS, force_noise
from rod.inverse.noise import (
    calibrate_photo_noise,
    section_covariance,
    smooth_basis,
)
from rod.inverse.observation import observe, residual
from rod.inverse.prediction import Prediction
from rod.measurement import MeasuredStep
from rod.midline import block_covariance, midline


def test_uncorrelated_sections_average_by_the_square_root():
    s, first = 0.3 * np.arange(12), np.array([0, 4, 8])
    assert np.allclose(block_covariance(s, np.ones(12), first, np.full(3, 4), 0.0), np.eye(3) / 4.0)


@pytest.fixture(scope="module")
def shape():
    return hidden_test(Cable(), THREE, largest=0.0138, seed=5).steps[-1].shape


def test_block_means_lie_on_the_curve(shape):
    """Without noise a block mean lies on the curve, not inside the arc: the mean of positions would be 0.4 um off."""
    exact = Reading(section_px=1e-9, axis_px=1e-9)
    clean = hidden_test(Cable(), THREE, largest=0.0138, seed=5, reading=exact).steps[-1].shape
    blocks = midline(clean, blocks=90)
    radius = 1.0 / np.interp(blocks.s, clean.s, clean.kappa)
    inside = np.interp(blocks.s, clean.section_s, clean.section_y) - blocks.y
    assert np.max(np.abs(inside)) < 2e-8 < np.diff(blocks.s).max() ** 2 / 24.0 / radius.min()


@pytest.mark.parametrize(("factor", "stretch"), [(1.0, 1.0), (1.4, 1.0), (1.0, 2.8), (0.7, 0.6)])
def test_noise_is_measured_beside_a_smooth_misfit(shape, factor, stretch):
    blocks = midline(shape, blocks=96)
    basis = smooth_basis(blocks.s, 0.181, functions=20)
    smooth = np.linalg.qr(basis)[0]
    root = np.linalg.cholesky(section_covariance(blocks, factor=factor, stretch=stretch))
    misfit = basis @ np.linspace(1e-3, 1e-5, 20)  # a hundred times the noise, and smooth
    weights, slow = [], []
    for seed in range(8):  # what seven photos tell of the correlation scatters by a tenth: the mean of eight tells bias
        rng = np.random.default_rng([1, seed])
        found = calibrate_photo_noise(
            [root @ rng.standard_normal(len(blocks.s)) + misfit for _ in range(7)],
            [blocks] * 7,
            [basis] * 7,
        )
        slow.append(np.sum(smooth * (section_covariance(blocks, factor=found.factor, stretch=found.stretch) @ smooth)))
        factor_of = np.linalg.cholesky(section_covariance(blocks, factor=found.factor, stretch=found.stretch))
        # what counts is the weight of a smooth component (the false alarms are set by it)
        weights.append(np.linalg.norm(smooth.T @ np.linalg.solve(factor_of, root).T, axis=1)[:8])
    # a tenth where the stated correlation is nearly right; where it is wrong by 2.8 the prior holds a part of that
    assert np.all(np.abs(np.mean(weights, axis=0) - 1.0) < (0.1 if stretch < 2.0 else 0.2))
    # and the level of the slow noise is told to a fifth or better: of eight, three standard errors are three quarters
    assert np.std(np.log(slow), ddof=1) < 1.75 * 0.2


def test_force_noise_ignores_drift_and_level():
    test = hidden_test(Cable(), THREE, largest=0.0138, seed=5, reading=Reading(force_drift=0.01))
    level = force_noise(test.steps, floor=0.0, distinct=1e-3)
    truth = test.steps[0].force_std
    assert level.freedom == 18
    assert np.all(np.abs(level.std / truth - 1.0) < 3.0 / np.sqrt(2.0 * 18))


@pytest.mark.parametrize("time_constant", [1.0, 2.0, 7.0])
def test_force_noise_ignores_a_decay_in_the_holds(time_constant):
    """Taken for noise, a loss of 5 % within the first samples made the level up to four times as high as it is."""
    fast = Reading(relaxation=(0.05, time_constant))
    ratios = []
    for seed in range(4):
        test = hidden_test(Cable(), LOOP, largest=0.0138, seed=seed, reading=fast)
        ratios.append(np.mean(force_noise(test.steps, floor=0.0, distinct=1e-3).std) / test.steps[0].force_std)
    assert abs(np.mean(ratios) - 1.0) < 3.0 / np.sqrt(2.0 * 4 * 35)  # 35 free samples each, three standard errors


def test_a_noisy_hold_gets_its_own_level():
    test = hidden_test(Cable(), THREE, largest=0.0138, seed=5)
    noisy = replace(test.steps[1], hold_forces=test.steps[1].hold_forces + 0.5 * (-1.0) ** np.arange(8))
    level = force_noise((test.steps[0], noisy, test.steps[2]), floor=0.0, distinct=1e-3)
    assert level.std[1] > 10.0 * level.std[0]


QUIET = (
    (0.031371, 0.031427, 0.031614, 0.031476, 0.031084, 0.031493),
    (0.038578, 0.038598, 0.038532, 0.038383, 0.038562, 0.038522),
    (0.040728, 0.040649, 0.040612, 0.040544, 0.040484, 0.040376),
)
"""Forces of a photographed specimen without effect, N; all scatter by 1.2e-4 N, the third lies on a line by chance."""


def holds(forces):
    times = 0.5 + 3.608 * np.arange(len(forces[0]))
    return tuple(
        MeasuredStep(k, "loading", 0.0, samples[-1], 1e-4, hold_times=times, hold_forces=np.array(samples))
        for k, samples in enumerate(forces)
    )


def test_a_hold_that_is_quiet_by_chance_gets_no_level_of_its_own():
    level = force_noise(holds(QUIET), floor=2e-5, distinct=1e-3)
    assert level.own == () and level.freedom == 12
    assert np.all(np.abs(level.std / 1.2e-4 - 1.0) < 2.0 / np.sqrt(2.0 * 12))


@pytest.mark.parametrize(("count", "samples"), [(3, 6), (14, 5)])
def test_holds_of_one_level_are_told_apart_as_rarely_as_asked(count, samples):
    """Uncorrected for few samples, 14 holds of five differed six times as often as the test allows."""
    rng, draws, level = np.random.default_rng(3), 200, 0.01
    found = [
        force_noise(holds(rng.standard_normal((count, samples))), floor=0.0, distinct=level).own for _ in range(draws)
    ]
    # two tests of that level lead there; three standard errors
    assert np.mean([own != () for own in found]) < 2.0 * level + 3.0 * np.sqrt(2.0 * level / draws)


def test_levels_of_their_own_are_drawn_to_each_other_and_known_badly():
    """Levels of a spread of 4 samples: the assumed one must be right on average, and its freedom that of the tails."""
    rng, scores = np.random.default_rng(4), []
    for _ in range(200):
        true = np.sqrt(4.0 / rng.chisquare(4.0, 7))
        forces = true[:, None] * rng.standard_normal((7, 6))
        level = force_noise(holds(forces), floor=0.0, distinct=1.0)  # always of their own
        means = np.array([samples.mean() for samples in forces]) * np.sqrt(6.0) / level.std
        scores += [2.0 * stats.t.sf(abs(z), own) for z, own in zip(means, level.own, strict=True)]
    # 1,400 holds: one in a hundred is known to 0.3 %, and seven holds do not tell their spread well
    assert np.mean(np.array(scores) < 0.01) == pytest.approx(0.01, abs=0.005)


@pytest.mark.parametrize("levels", [(1.0, 1.5, 0.8, 1.2, 30.0), (1.0, 10.0, 0.1, 3.0, 30.0)])
def test_levels_of_their_own_are_the_mean_over_the_likelihood_of_their_spread(levels):
    """Smyth 2004: a hold's variance over the common level follows F, here by its density in scipy."""
    forces = np.array(levels)[:, None] * np.random.default_rng(8).standard_normal((len(levels), 6))
    found = force_noise(holds(forces), floor=0.0, distinct=1e-3)
    f, times = 4, np.arange(6.0)
    own = np.array([np.polyfit(times, samples, 1, full=True)[1][0] / f for samples in forces])
    level, spread = (table.ravel() for table in np.meshgrid(np.geomspace(own.min(), own.max(), 31), SPREADS))
    weight = np.prod([stats.f.pdf(one / level, f, spread) / level for one in own], axis=0)
    drawn = (spread * level + f * own[:, None]) / (spread + f)
    assert found.std**2 == pytest.approx(drawn @ weight / weight.sum(), rel=1e-9)
    assert found.own == pytest.approx([weight.sum() / (weight @ (1.0 / (spread + f)))] * len(levels), rel=1e-9)


def test_samples_that_repeat_in_all_digits_are_no_quiet_hold():
    rng = np.random.default_rng(5)
    forces = np.round(10.0 + 3e-3 * rng.standard_normal((5, 6)), 2)
    forces[2] = 10.0
    with np.errstate(all="raise"):
        assert force_noise(holds(forces), floor=5e-3, distinct=1e-3).own == ()


@pytest.mark.parametrize("timed", [True, False])
def test_three_samples_of_a_hold_tell_their_scatter(timed):
    """The force of a hold is known better than one sample: taken for the scatter of each, chance was six sigma."""
    rng, std = np.random.default_rng(6), 3e-3
    steps = holds(10.0 + std * rng.standard_normal((60, 3)))
    steps = tuple(replace(one, force_std=std / 3.0, hold_times=np.arange(3.0) if timed else None) for one in steps)
    level = force_noise(steps, floor=0.0, distinct=1e-3)
    assert level.freedom == 60
    assert level.std == pytest.approx(std, rel=3.0 / np.sqrt(2.0 * level.freedom))


def test_two_samples_on_a_line_tell_nothing_but_what_their_hold_is_known_to():
    steps = tuple(replace(one, force_std=1e-3, hold_times=np.arange(2.0)) for one in holds(np.full((4, 2), 10.0)))
    level = force_noise(steps, floor=0.0, distinct=1e-3)
    assert level.freedom == 0 and level.std == pytest.approx(np.sqrt(2.0) * 1e-3)


def test_stated_level_where_there_are_no_samples():
    test = hidden_test(Cable(), THREE, largest=0.0138, seed=5)
    bare = tuple(replace(step, hold_forces=None, hold_times=None) for step in test.steps)
    level = force_noise(bare, floor=0.0, distinct=1e-3)
    assert level.freedom == 0 and level.std[0] == test.steps[0].force_std


@pytest.mark.parametrize("scatter", [0.02, 0.2, 0.4, 1.0])
def test_forces_in_coarse_digits_are_as_uncertain_as_they_are(scatter):
    """The mean of a hold, whitened, has unit variance, whether its samples repeat one number or scatter."""
    rng, digit, found = np.random.default_rng(11), 0.01, []
    test = hidden_test(Cable(), THREE, largest=0.0138, seed=1)
    for _ in range(150):
        true = rng.uniform(0.4, 1.0, 6)
        holds = true[:, None] + scatter * digit * rng.standard_normal((6, 30))
        steps = tuple(
            replace(
                test.steps[0],
                force=float(hold[-1]),
                hold_forces=hold,
                hold_times=np.arange(30.0),
                shape=None,
                chord=None,
            )
            for hold in np.round(holds, 2)
        )
        observation = observe(replace(test, steps=steps))
        none = np.zeros((6, 2))
        shown = Prediction(true, tuple(np.full(30, f) for f in true), none[:, 0], np.arange(2.0), none, none, none)
        off = residual(observation, shown).reshape(6, 30)
        found.extend(np.sqrt(30.0) * off.mean(axis=1))
    # a level that six holds share is known to 5 %; where rounding takes all, its own bounded distribution is narrower
    assert np.std(found) == pytest.approx(1.0, abs=0.12)


def test_a_decay_is_found_in_a_log_without_times():
    """Its rows come one after the other: taken for scatter, a loss of 8 % in each hold was in f_EI without a word."""
    test = hidden_test(Cable(), SIX, largest=0.0138, seed=2, reading=Reading(relaxation=(0.08, 7.0)))
    bare = replace(test, steps=tuple(replace(step, hold_times=None, time=None) for step in test.steps))
    part, _, _ = diagnose(faults_of_input(bare), None, DiagnosisSettings())
    assert (part.verdict, [cause.name for cause in part.causes]) == ("named", ["relaxation"])
    assert f_error(part.extended, Cable())[0] < 0.02

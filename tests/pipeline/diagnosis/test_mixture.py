"""The band that holds all that is believed: against drawn mixtures, curves by hand, and a cable that is known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fixtures.aliens import with_alien
from fixtures.continuum import Cable
from fixtures.effects import LARGEST, PROTOCOLS
from fixtures.hidden import hidden_test
from fixtures.scores import refit_one
from fixtures.trials import alien_size
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.causes.load_cell import ForceGain
from pipeline.diagnosis.fits.extended import curve as curve_of
from pipeline.diagnosis.fits.identified_again import identified_again
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.diagnosis.posterior.error_grid import error_grid
from pipeline.diagnosis.posterior.evidence import SIZES, _sized
from pipeline.diagnosis.posterior.mixture import _half_width, centre_of, widening
from pipeline.faults import faults_of_input
from pipeline.identify.parts import curve
from pipeline.identify.ways import identify_test
from pipeline.result import Curve, Widening
from pipeline.settings.diagnosis import DiagnosisSettings
from pipeline.settings.identify import IdentifySettings
from tests.pipeline.diagnosis.among import among

SETTINGS = DiagnosisSettings()


def test_half_width_holds_95_percent_of_what_is_drawn():
    rng = np.random.default_rng(3)
    weight, mean, std = np.array([0.7, 0.2, 0.1]), np.array([[0.0], [2.0], [-5.0]]), np.array([[1.0], [0.5], [2.0]])
    which = rng.choice(3, 400_000, p=weight)
    drawn = mean[which, 0] + std[which, 0] * rng.standard_normal(which.size)
    # the quantile of 400,000 draws is known to one percent here
    assert _half_width(weight, mean, std)[0] == pytest.approx(np.quantile(np.abs(drawn), 0.95), rel=0.01)
    assert _half_width(np.ones(1), np.zeros((1, 1)), np.ones((1, 1)))[0] == pytest.approx(1.96, abs=1e-3)


@pytest.mark.parametrize(("value", "std"), [(0.03, 0.002), (0.004, 0.01), (5.0, 50.0)])
def test_what_is_known_of_a_size_moves_all_that_goes_with_it(value, std):
    """By summing on a grid: an amount of a normal prior of any of the sizes, and an unknown that goes with it."""
    gain = ForceGain()
    sizes = SIZES * gain.plausible(None)
    with_amount, own = -3.0, 0.2
    covariance = np.array([[own**2 + (with_amount * std) ** 2, with_amount * std**2], [with_amount * std**2, std**2]])
    extension = SimpleNamespace(amounts_at=(1,), terms=(SimpleNamespace(cause=gain),), facts=None)
    fitted = SimpleNamespace(extension=extension, vector=np.array([7.0, 0.4 * value]))
    move, known = _sized(fitted, [1], np.array([[0.1, 0.6 * value]]), covariance[None])
    at = np.sinh(np.linspace(-9.0, 9.0, 200_001)) * 1e-4
    prior = np.sum(np.exp(-0.5 * (at / sizes[:, None]) ** 2) / sizes[:, None], axis=0)
    weight = prior * np.exp(-0.5 * ((at - value) / std) ** 2) * np.gradient(at)
    weight /= weight.sum()
    mean = float(weight @ at)
    variance = float(weight @ (at - mean) ** 2)
    assert fitted.vector[1] + move[0, 1] == pytest.approx(mean, rel=1e-4, abs=1e-6)
    assert known[0, 1, 1] == pytest.approx(variance, rel=1e-3)
    assert move[0, 0] == pytest.approx(0.1 + with_amount * (mean - value), rel=1e-4)
    assert known[0, 0, 0] == pytest.approx(own**2 + with_amount**2 * variance, rel=1e-3)


def test_a_wider_band_is_that_of_curves_that_are_moved():
    """Every column is one way in which f_EI and K0 are off together: the law is moved so, its moment integrated."""
    K, K0, low = np.linspace(2.0, 8.0, 601), 2.0, 1e-3
    f = 0.01 * (1.0 + 0.3 * np.cos(K))
    m = np.r_[0.0, np.cumsum(0.5 * (f[1:] + f[:-1]) * np.diff(K))]
    none = np.zeros(K.size)
    plain = Curve(
        kappa_per_m=K.tolist(), moment_Nm=m.tolist(), moment_std_Nm=none.tolist(), tangent_Nm2=f.tolist(),
        tangent_std_Nm2=none.tolist(), secant_Nm2=np.r_[f[0], m[1:] / (K[1:] - K0)].tolist(),
        secant_std_Nm2=none.tolist(), supported=[True] * K.size,
    )  # fmt: skip
    column, rest = low * np.sin(K), 0.02
    wide = Widening(kappa_per_m=K.tolist(), tangent_factor=column[:, None].tolist(), pre_curvature_factor_per_m=[rest])
    found = wide.of(plain)
    moved = f * (1.0 + column)
    by_hand = np.r_[0.0, np.cumsum(0.5 * (moved[1:] + moved[:-1]) * np.diff(K))] - f[0] * rest - m
    assert np.allclose(found.tangent_std_Nm2, np.abs(f * column), rtol=1e-9)
    assert np.allclose(found.moment_std_Nm, np.abs(by_hand), rtol=1e-6, atol=1e-9 * m[-1])


@pytest.mark.parametrize("sticks", [False, True])
def test_the_band_grows_with_what_no_cause_makes(sticks):
    """A load cell that sticks from step to step bends f_EI: the band of the fit alone leaves it out."""
    cable = Cable()
    test = hidden_test(cable, PROTOCOLS["loop"], largest=LARGEST, seed=41)
    if sticks:
        test = with_alien(test, "sticking", 12.0 * alien_size("loop", "sticking"))
    found = identify_test(test, IdentifySettings())
    # that no cause at all makes it is asked of six steps (test_hidden_effects)
    names = "bearing_friction force_offset force_drift relaxation stiffness_drift" if sticks else ""
    part, _, _ = among(test, names, found)
    answer = part.extended if part.widening is None else part.widening.of(curve(found.inverse))
    K, f, std = (np.array(row) for row in (answer.kappa_per_m, answer.tangent_Nm2, answer.tangent_std_Nm2))
    truth = cable.law(K - cable.K0)[1]
    assert np.mean(np.abs(f - truth) <= 1.96 * std) > 0.9
    if sticks:
        assert part.verdict == "unexplained"
    else:
        # what is believed beside the base model of a specimen without effect adds less than the noise itself
        assert part.verdict == "adequate" and np.median(std / curve(found.inverse).tangent_std_Nm2) < 1.5


@pytest.fixture(scope="module")
def rubbing():
    """A cable in bearings that rub: what it is fitted with, that refit, it identified again, and its curve."""
    causes = [cause for cause in CATALOGUE if cause.name == "bearing_friction"]
    test = hidden_test(Cable(bearing_friction=3e-3), PROTOCOLS["loop"], largest=LARGEST, seed=47)
    bench = prepare(faults_of_input(test), SETTINGS, causes=causes)
    refit = refit_one(bench.observation, bench.base, bench.suspicion, 0).fitted
    again = identified_again(bench.observation, refit)
    return bench, refit, again.fitted, curve_of(again.fitted, covariance=again.covariance)


def widened(bench, answer, refit, again):
    """Standard deviations (n,) of log f_EI that are added to a curve where a refit alone is believed."""
    one = SimpleNamespace(
        found=SimpleNamespace(fitted=refit, unnamed=False), causes=(0,), something_else=False, probability=1.0
    )
    grid, posterior = error_grid(bench.observation, bench.facts), SimpleNamespace(believed=[one])
    wider = widening(grid, posterior, bench.base, bench.suspicion, centre_of(answer), own=(refit, again))
    return np.linalg.norm(np.array(wider.tangent_factor), axis=1)


def test_the_band_is_that_of_the_law_that_is_stated(rubbing):
    """A refit's law may run off where nothing holds it; the error models speak of the law that is the answer.

    About the refit they were 5 in log f_EI apart at rest, and the band of a constant law was 270 % wide there.
    """
    bench, refit, again, answer = rubbing
    law = slice(0, refit.extension.base.law.size)
    astray = refit.vector.copy()
    astray[law] += 2.0 * np.cos(2.0 * np.arange(law.stop))
    assert widened(bench, answer, replace(refit, vector=astray), again).max() < 0.02


def test_a_band_is_widened_from_what_the_curve_states_itself(rubbing):
    """A fit that does not hold may state a band of nothing: the whole band of what is believed is added to it."""
    bench, refit, again, answer = rubbing
    sure = answer.model_copy(update={"tangent_std_Nm2": [1e-9 * f for f in answer.tangent_Nm2]})
    whole, added = widened(bench, sure, refit, again), widened(bench, answer, refit, again)
    own = centre_of(answer).std[:-1]
    assert np.median(whole) > 0.5 * np.median(own)
    assert np.hypot(added, own) == pytest.approx(np.maximum(whole, own), rel=1e-6)

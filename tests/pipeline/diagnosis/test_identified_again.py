"""f_EI with the causes in the model, against laws and loops that the coarse spline and sharp elements cannot follow."""

import numpy as np
import pytest

from fixtures.continuum import Cable
from fixtures.effects import SPOT, Form, profile
from fixtures.hidden import LOOP, SIX, Protocol, Reading, hidden_test
from fixtures.memory import BoucWen, Slipping
from fixtures.scores import refit_one
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.fits.extended import curve
from pipeline.diagnosis.fits.identified_again import identified_again
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings

SETTINGS = DiagnosisSettings()


def off(cable, name, protocol, largest, seed):
    """Relative rms error of f_EI, rms band, rms error in standard deviations; sizes of causes whose forms add up."""
    test = hidden_test(cable, protocol, largest=largest, seed=seed)
    causes = [cause for cause in CATALOGUE if cause.name == name]
    bench = prepare(faults_of_input(test), SETTINGS, causes=causes)
    accepted = refit_one(bench.observation, bench.base, bench.suspicion, 0)
    again = identified_again(bench.observation, accepted.fitted)
    found = curve(again.fitted, covariance=again.covariance, other=again.other)
    kappa, tangent, std = (np.array(v) for v in (found.kappa_per_m, found.tangent_Nm2, found.tangent_std_Nm2))
    truth = cable.law(kappa - cable.K0)[1]
    errors = (tangent / truth - 1.0, std / truth, (tangent - truth) / std)
    return [*(float(np.sqrt(np.mean(values**2))) for values in errors), again.sizes]


@pytest.mark.parametrize("form", ["bell", "exponential"])
def test_a_steep_law_is_followed(form):
    """A fall by four within a fifth of the range: a smooth law along the curvature was 2.5 to 6 % off."""
    cable = Cable(EI0=0.02, EI1=0.005, kc=2.6, form=form, stiffness_profile=profile(-0.25, SPOT))
    error, band, z, _ = off(cable, "stiffness_varying", SIX, 0.03, seed=16)
    assert error < 0.02 and band < 0.02
    # errors along the curve hang together: few independent ones, of which the rms exceeds two once in a thousand
    assert z < 2.0


def test_which_place_of_a_cable_the_law_is_of_is_part_of_the_band():
    """A taper with a splice is told by forms none of whose places need have the stiffness that the law is of."""
    tapered = Cable(EI0=0.015, EI1=0.015, stiffness_profile=lambda u: 0.3 * u - 0.15 + profile(0.15, SPOT)(u))
    error, _, z, _ = off(tapered, "stiffness_varying", SIX, 0.0138, seed=26)
    assert z < 2.0 and error < 0.05
    alone = Cable(EI0=0.015, EI1=0.015, stiffness_profile=profile(-0.2, SPOT))
    error, band, z, _ = off(alone, "stiffness_varying", SIX, 0.0138, seed=26)
    assert z < 2.0 and error < 0.01 and band < 0.01


def test_a_loop_of_another_form_is_within_the_band():
    """Bouc and Wen's friction is no sum of elements; with such a sum the law is off by more than its noise."""
    cable = Cable(memory=BoucWen(4e-3, 1.2))
    error, band, z, _ = off(cable, "hysteresis", LOOP, 0.0138, seed=17)
    assert error < 0.02 and band < 0.04
    assert z < 2.0


def test_the_size_of_a_loop_allows_for_other_forms():
    """Two elements stand for three, whose sum they miss by 8 %: six standard deviations of the fit itself."""
    friction = Slipping((4e-3, 3e-3, 2e-3), (0.5, 4 / 3, 3.5))
    shares, branches = (0, 1 / 3, 2 / 3, 1, 2 / 3, 1 / 3), ("mounted", *("loading",) * 3, *("unloading",) * 2)
    cable = Cable(length=0.19, EI0=0.012, EI1=0.008, kc=6.0, memory=friction)
    *_, z, sizes = off(cable, "hysteresis", Protocol(shares, branches), 0.015, seed=2)
    size, std = sizes["hysteresis"]
    assert abs(size - friction.half_width) < 2.0 * std and std < 0.16 * size
    assert z < 2.0


def test_what_is_known_of_a_rig_stays_known():
    """Without a photo at rest the zero is known to 20 um beforehand, and to no more: no step on the way adds to it."""
    protocol = Protocol(SIX.shares[1:], SIX.branches[1:])
    reading = Reading(length_error=2e-3, play=1e-5)
    test = hidden_test(Cable(), protocol, largest=0.03, seed=18, reading=reading)
    bench = prepare(faults_of_input(test), SETTINGS)
    again, at = identified_again(bench.observation, bench.base).fitted, bench.base.extension.base.rig_at
    std = np.sqrt(np.diag(bench.base.covariance))
    assert at.size and np.all(np.abs(again.vector - bench.base.vector)[at] < std[at])


@pytest.mark.parametrize(("amount", "width"), [(0.5, 0.3), (1.0, 0.35)])
def test_a_spot_that_would_be_wider_than_spots_are_is_held(amount, width):
    """Cut at the end of its range it left the rest of the model where it belongs beside another: 19,000 for 200."""
    cable = Cable(K0_profile=profile(amount, Form("in a spot", 0.5, width)))
    causes = [cause for cause in CATALOGUE if cause.name == "pre_curvature_varying"]
    bench = prepare(
        faults_of_input(hidden_test(cable, SIX, largest=0.0138, seed=round(2 * amount))), SETTINGS, causes=causes
    )
    fitted = refit_one(bench.observation, bench.base, bench.suspicion, 0).fitted
    again = identified_again(bench.observation, fitted).fitted
    # another law than the fit's, and a standard deviation of each unknown off at most
    assert 0.0 < again.chi2 - fitted.chi2 < fitted.extension.size

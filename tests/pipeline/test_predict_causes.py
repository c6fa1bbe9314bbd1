"""Predictions of cables that are more than a uniform law: what the diagnosis found in the cable goes along.

Truth: `fixtures.continuum` (collocation), another solver; the test is diagnosed and then another one is predicted.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fixtures.continuum import Cable, bend
from fixtures.effects import LARGEST, SPOT, profile
from fixtures.hidden import LOOP, SIX, hidden_test
from fixtures.memory import Slipping
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.diagnose import conclude
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.diagnosis.presentation.part import present
from pipeline.faults import faults_of_input
from pipeline.identified_model import identified_model
from pipeline.predict import predict
from pipeline.result import Result, SpecimenPart
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.bending_test import simulate

# forces to 1e-4: with 100 elements, a tenth of the noise of the load cell
SETTINGS = DiagnosisSettings()
COARSE = 100
FORTH_AND_BACK = (0.006, 0.012, 0.009, 0.003)


CABLES = {
    "hysteresis": (Cable(memory=Slipping((4e-3,), (1.0,))), LOOP),
    "plastic_set": (Cable(set_rate=0.08), LOOP),
    "stiffness_varying": (Cable(stiffness_profile=profile(-0.2, SPOT)), SIX),
    "bearing_friction": (Cable(bearing_friction=2.5e-3), LOOP),
}


@cache
def result_of(name):
    """Diagnosed with that cause alone in the catalogue: which one it is is the business of other tests."""
    cable, protocol = CABLES[name]
    test = hidden_test(cable, protocol, largest=LARGEST, seed=21)
    causes = [cause for cause in CATALOGUE if cause.name == name]
    bench = prepare(faults_of_input(test), SETTINGS, causes=causes)
    part = present(bench, conclude(bench), SETTINGS)
    specimen = SpecimenPart(id="hidden", length_m=cable.length, diameter_m=0.005, folder=".", moving_bearing="left")
    return Result(status="measured", specimen=specimen, diagnosis=part)


@pytest.mark.parametrize("name", ["hysteresis", "plastic_set", "stiffness_varying"])
def test_what_was_found_in_the_cable_is_in_the_prediction(name):
    result, cable = result_of(name), CABLES[name][0]
    ahead = predict(result, FORTH_AND_BACK, elements=COARSE)
    truth = bend(cable, FORTH_AND_BACK)
    plain = predict(without_causes(result), FORTH_AND_BACK, elements=COARSE)
    assert [finding.code for finding in ahead.findings] == ["predict/cause"]
    missed = []
    for step, true, bare in zip(ahead.steps, truth, plain.steps, strict=True):
        # four standard deviations and the error of 100 elements
        assert step.force_N == pytest.approx(true.F, abs=4.0 * step.force_std_N + 3e-4 * true.F)
        high = np.max(true.y)
        at = int(np.argmax(step.y_m))
        assert step.y_m[at] == pytest.approx(high, abs=4.0 * step.y_std_m[at] + 1e-5 * cable.length)
        missed.append(abs(bare.force_N - true.F) / step.force_std_N)
    assert max(missed) > 10.0  # without the cause the same steps are far off


def without_causes(result):
    return result.model_copy(update={"diagnosis": result.diagnosis.model_copy(update={"causes": []})})


def test_what_belongs_to_the_rig_stays_behind():
    result = result_of("bearing_friction")
    assert [cause.name for cause in result.diagnosis.causes] == ["bearing_friction"]
    ahead = predict(result, FORTH_AND_BACK, elements=COARSE)
    for step, true in zip(ahead.steps, bend(Cable(), FORTH_AND_BACK), strict=True):
        assert step.force_N == pytest.approx(true.F, abs=4.0 * step.force_std_N + 3e-4 * true.F)
    assert [finding.code for finding in ahead.findings] == ["predict/left-out"]


def test_a_cable_that_remembers_is_not_predicted_after_a_refused_step():
    result = result_of("hysteresis")
    ahead = predict(result, (0.006, 0.03, 0.006), elements=COARSE)
    assert [step.status for step in ahead.steps] == ["predicted", "refused", "refused"]
    assert ahead.steps[2].reason == "this step depends on the one to 30 mm before it, which could not be predicted"


def test_the_band_is_that_of_cables_drawn_from_the_joint_covariance():
    """Law, pre-curvature, amount and place of the cause drawn together: the spread of the force is its band."""
    result = result_of("stiffness_varying")
    model, rng, forces = identified_model(result), np.random.default_rng(4), []
    (ahead,) = predict(result, [0.008], elements=COARSE).steps
    for _ in range(100):
        drawn = rng.standard_normal(model.factor.shape[1])
        change = model.factor @ drawn
        other = replace(
            model,
            characteristic=replace(model.characteristic, ordinates=model.characteristic.ordinates + change[:-1]),
            pre_curvature=model.pre_curvature + change[-1],
            forms=tuple(moved(form, form.factor @ drawn) for form in model.forms),
        )
        forces.append(simulate(other.bending_test(Cable().length), [0.008], branch="up")[0].force)
    # the deviation of 100 samples scatters by 7 %
    assert np.std(forces) == pytest.approx(ahead.force_std_N, rel=0.25)
    assert np.mean(forces) == pytest.approx(ahead.force_N, abs=0.5 * ahead.force_std_N)


def moved(form, by):
    for row, change in enumerate(by):
        form = form.moved(row, change)
    return form

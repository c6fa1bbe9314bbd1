"""Forces that change their factor, zero or sign during a test, in continuum data; what causes do is none of them."""

from dataclasses import replace

import numpy as np
import pytest

from fixtures.effects import HIDE, LARGEST, PROTOCOLS, Form
from fixtures.hidden import hidden_test
from pipeline.diagnosis import diagnose
from pipeline.diagnosis.causes import SUSPECTS
from pipeline.diagnosis.diagnose import _data_at_fault
from pipeline.diagnosis.fits.force_breaks import force_break
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings

SETTINGS = DiagnosisSettings()
DRIFT = [cause for cause in SUSPECTS if cause.name == "force_drift"]


@pytest.fixture(scope="module")
def honest():
    cable, reading = HIDE["force_gain"](0.0, Form())
    return {name: hidden_test(cable, PROTOCOLS[name], largest=LARGEST, seed=31, reading=reading) for name in PROTOCOLS}


def spoiled(test, change):
    """The test with ``change(index, force)`` in place of its forces."""
    steps = (
        replace(s, force=float(change(i, s.force)), hold_forces=change(i, s.hold_forces))
        for i, s in enumerate(test.steps)
    )
    return replace(test, steps=tuple(steps))


def fault(test, causes=SUSPECTS):
    return _data_at_fault(prepare(faults_of_input(test), SETTINGS, causes=causes), {})


@pytest.mark.parametrize("protocol", ["six", "loop"])
@pytest.mark.parametrize(
    ("factor", "rivals"), [(0.5, DRIFT), (0.9, SUSPECTS), (2.0, DRIFT)], ids=["half", "less", "twice"]
)
def test_a_factor_from_one_step_on(honest, protocol, factor, rivals):
    """The smallest change is what any cause may come nearest to."""
    found = fault(spoiled(honest[protocol], lambda i, force: force * (factor if i >= 3 else 1.0)), rivals)
    (finding,) = found.findings
    assert (finding.code, finding.level) == ("force/factor", "error")
    assert "from step 3 on" in finding.message and "by a factor of" in finding.message
    (correction,) = found.corrections
    assert correction.steps == tuple(range(3, 7)) and correction.factor == pytest.approx(factor, rel=5e-3)
    kept = [step.force for step in honest[protocol].steps]
    assert [step.force for step in found.test.steps] == pytest.approx(kept, rel=5e-3)


@pytest.mark.parametrize(("protocol", "dead"), [("six", {4, 5, 6}), ("loop", {1, 2})])
def test_a_load_cell_that_died_is_left_out_and_not_multiplied(honest, protocol, dead):
    rng = np.random.default_rng(5)
    test = honest[protocol]

    def silent(i, force):
        return test.steps[i].force_std * rng.standard_normal(np.shape(force)) if i in dead | {0} else force

    found = fault(spoiled(test, silent))
    (finding,) = found.findings
    assert (finding.code, finding.level) == ("force/dead", "warning")
    assert ("from step 4 on" if protocol == "six" else "before step 3") in finding.message
    assert found.forces == dead and not found.corrections


@pytest.mark.parametrize(("turned", "rivals"), [({2}, SUSPECTS), ({1, 2}, SUSPECTS), ({4, 5, 6}, DRIFT)])
def test_forces_of_the_other_sign_are_turned_whichever_they_are(honest, turned, rivals):
    found = fault(spoiled(honest["loop"], lambda i, force: -force if i in turned else force), rivals)
    (finding,) = found.findings
    assert (finding.code, finding.level) == ("force/sign", "warning")
    assert found.corrections[0].steps == tuple(sorted(turned)) and found.corrections[0].factor == -1.0
    assert f"steps {', '.join(map(str, sorted(turned)))} have the sign of tension" in finding.message


@pytest.mark.parametrize("first", [2, 3])
def test_a_zero_that_jumps(honest, first):
    found = fault(spoiled(honest["loop"], lambda i, force: force + 0.3 * (i >= first)))
    (finding,) = found.findings
    assert (finding.code, finding.level) == ("force/zero-moved", "warning")  # it read zero before
    assert f"from step {first} on" in finding.message
    assert found.corrections[0].offset == pytest.approx(0.3, abs=0.04)


def test_what_all_forces_under_load_share_is_no_break(honest):
    """At rest there is nothing to tare, so it is a cause: as a break it took a load in the plane, f_EI 21 % off."""
    bench = prepare(faults_of_input(spoiled(honest["loop"], lambda i, force: force + 0.3 * (i >= 1))), SETTINGS)
    assert force_break(bench) is None


@pytest.fixture(scope="module")
def either(honest):
    """A zero that jumps where all forces are of one size: a factor would do as well."""
    return fault(spoiled(honest["six"], lambda i, force: force + 0.3 * (i >= 3)))


def test_a_factor_and_a_zero_that_forces_of_one_size_do_not_tell_apart_are_both_named(either):
    (finding,) = either.findings
    assert finding.level == "error" and "which these data do not tell apart" in finding.message
    assert "by a factor of 1.09" in finding.message and "mN" in finding.message


def test_one_bad_force_stays_one(honest):
    found = fault(spoiled(honest["loop"], lambda i, force: force * (0.5 if i == 4 else 1.0)))
    assert [finding.code for finding in found.findings] == ["force/outlier"] and found.forces == {4}


CAUSES = [
    ("hysteresis", 6e-3), ("bearing_friction", 5e-3), ("relaxation", 0.12), ("force_drift", 2e-3),
    ("force_offset", 0.3), ("plastic_set", 0.08), ("rig_compliance", 5e-4),
]  # fmt: skip


@pytest.mark.parametrize(("name", "amount"), CAUSES)
def test_no_cause_is_a_break(name, amount):
    cable, reading = HIDE[name](amount, Form())
    assert fault(hidden_test(cable, PROTOCOLS["loop"], largest=LARGEST, seed=32, reading=reading)) is None


def test_the_rest_of_the_diagnosis_goes_on_with_the_corrected_forces_and_their_errors(honest):
    test = spoiled(honest["six"], lambda i, force: force * (0.5 if i >= 4 else 1.0))
    part, findings, faults = diagnose(faults_of_input(test), None, SETTINGS)
    assert part.verdict == "adequate" and [finding.code for finding in findings] == ["force/factor"]
    assert (part.left_out_forces, part.left_out_photos) == ([], [])
    assert np.array([s.force for s in faults.test.steps]) == pytest.approx(
        [s.force for s in honest["six"].steps], rel=5e-3
    )
    (told,) = part.corrected_forces
    (error,) = faults.test.common_force_errors
    assert told.errors_N == [list(error.values())]
    assert set(error) == {4, 5, 6} and 1e-4 < abs(error[4]) / honest["six"].steps[4].force < 0.02


@pytest.mark.parametrize("kind", ["factor", "zero"])
def test_what_a_correction_may_be_off_by_is_what_it_is_off_by(kind):
    cable, reading = HIDE["force_gain"](0.0, Form())
    z = []
    for seed in range(8):
        test = hidden_test(cable, PROTOCOLS["loop"], largest=LARGEST, seed=seed, reading=reading)
        top = max(step.force for step in test.steps)
        slope, jump = (0.5, 0.0) if kind == "factor" else (1.0, 0.4 * top)
        changed = spoiled(test, lambda i, force, a=slope, b=jump: a * force + b if i >= 4 else force)
        # what causes could do about it has no part in its size, and to score all of them takes half of the time
        found, _ = force_break(prepare(faults_of_input(changed), SETTINGS, causes=DRIFT))
        (correction,), (errors,) = found.corrections, found.test.common_force_errors
        assert tuple(errors) == correction.steps == (4, 5, 6)
        off = [found.test.steps[i].force - test.steps[i].force for i in errors]
        assert off == pytest.approx(np.array(list(errors.values())) * off[0] / errors[4], rel=1e-6)
        z.append(off[0] / errors[4])
    # eight errors of a standard deviation of one: their rms is outside once in a thousand
    assert 0.3 < np.sqrt(np.mean(np.square(z))) < 1.9


def test_two_kinds_that_are_not_told_apart_are_an_error_too(honest, either):
    own, other = (np.array(list(error.values())) for error in either.test.common_force_errors)
    corrected = np.array([step.force for step in either.test.steps[3:]])
    truth = np.array([step.force for step in honest["six"].steps[3:]])
    assert np.all(np.abs(corrected - truth) < 3.0 * np.hypot(own, other))
    # had it been a factor: each of two that are as likely is off by its share of their distance
    by_factor = corrected + np.sqrt(2.0) * other
    assert (truth + 0.3) / by_factor == pytest.approx(np.full(4, 1.09), abs=0.01)
    assert np.ptp((truth + 0.3) / by_factor) < 1e-6

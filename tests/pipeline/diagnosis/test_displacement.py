"""A displacement log that scatters, or none at all: where the bearing stood is then an unknown of every step."""

from dataclasses import replace

import numpy as np
import pytest

from fixtures.continuum import Cable
from fixtures.effects import LARGEST
from fixtures.hidden import LOOP, SIX, THREE, Reading, hidden_test
from pipeline.diagnosis.diagnose import diagnose
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.diagnosis.statistics.score import admissible
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.sensitivities import sensitivities, whole_residual
from rod.inverse.simulation import run

SETTINGS = DiagnosisSettings()
SCATTER = 5e-5
PROTOCOLS = {"three": THREE, "six": SIX, "loop": LOOP}


def scattered(test, *, seed=0, told=True):
    """The test with a displacement log that scatters by `SCATTER`, which it tells or not."""
    rng = np.random.default_rng(seed)
    steps = [
        replace(step, displacement=step.displacement + SCATTER * rng.standard_normal(), displacement_std=SCATTER)
        for step in test.steps
    ]
    return replace(test, steps=tuple(step if told else replace(step, displacement_std=None) for step in steps))


def unlogged(test):
    return replace(test, steps=tuple(replace(step, displacement=None) for step in test.steps))


def bench_of(test):
    return prepare(faults_of_input(test), SETTINGS)


@pytest.mark.parametrize("name", PROTOCOLS)
def test_scatter_that_the_log_tells_is_no_cause(name):
    test = hidden_test(Cable(), PROTOCOLS[name], largest=LARGEST, seed=31)
    told = bench_of(scattered(test))
    assert told.largest < told.limit
    moved = told.base.extension.base.moved
    assert moved == tuple(i for i, step in enumerate(test.steps) if step.branch != "mounted")
    # The photos tell all but the zero, in which the scatter of the steps is averaged; their own axes add a fifth.
    std = np.sqrt(np.diag(told.base.covariance))[told.base.extension.base.moved_at]
    assert np.all(std < 1.2 * SCATTER / np.sqrt(len(moved)))


def test_scatter_that_the_log_does_not_tell_looks_like_a_cause():
    untold = bench_of(scattered(hidden_test(Cable(), SIX, largest=LARGEST, seed=31), told=False))
    assert untold.largest > untold.limit


@pytest.mark.parametrize("name", PROTOCOLS)
def test_a_log_without_displacements_is_no_cause(name):
    test = unlogged(hidden_test(Cable(), PROTOCOLS[name], largest=LARGEST, seed=32))
    bench = bench_of(test)
    assert bench.largest < bench.limit
    names = [cause.name for cause in bench.suspicion.causes]
    lost = bench.suspicion.of(names.index("displacement_offset"))
    # the photos alone say where the bearing stood: no zero can be wrong, 5 % of the length is no knowledge of it
    assert np.all(bench.suspicion.scores.surviving[lost] < 0.05)


def test_causes_are_found_beside_the_scatter():
    test = hidden_test(Cable(), SIX, largest=LARGEST, seed=33, reading=Reading(play=4e-4))
    bench = bench_of(scattered(test))
    loudest = bench.suspicion.terms[int(np.argmax(admissible(bench.suspicion.scores.z, bench.suspicion.sign)))]
    assert bench.largest > bench.limit
    assert loudest.cause.name in ("displacement_offset", "rig_compliance")  # twins on one branch


def test_columns_of_displacements_against_differences():
    bench = bench_of(scattered(hidden_test(Cable(), LOOP, largest=LARGEST, seed=34)))
    fitted, observation = bench.base, bench.observation
    extension, vector = fitted.extension, fitted.vector
    exact = sensitivities(observation, extension, vector, extension.base_model(vector), fitted.run)
    for name in ("displacement_1", "displacement_3", "displacement_6"):
        place = extension.base.names.index(name)
        h = 1e-6 * np.eye(vector.size)[place]
        ahead, behind = (
            whole_residual(
                observation,
                run(extension.model(vector + sign * h), extension.facts, near=fitted.run).prediction,
                vector + sign * h,
                extension.prior,
            )
            for sign in (1.0, -1.0)
        )
        slope = -(ahead - behind) / 2e-6
        # a one-sided difference through the observers and an equilibrium to 1e-9: a thousandth
        assert np.allclose(exact[:, place], slope, atol=2e-3 * np.abs(slope).max()), name


def test_a_wrong_zero_that_presses_a_cable_over_to_its_other_side():
    """Bent down at rest, pressed by a wrong zero and bowed up on its photo: the offset is found, and K0 below zero."""
    cable = Cable(K0=-1.0, displacement_offset=2e-4)
    test = hidden_test(cable, SIX, largest=LARGEST, seed=33)
    assert test.steps[0].shape is not None and np.mean(test.steps[0].shape.y) > 0.0
    part, _, _ = diagnose(faults_of_input(test), None, SETTINGS)
    assert (part.verdict, [cause.name for cause in part.causes]) == ("named", ["displacement_offset"])
    found = part.causes[0]  # offset and K0 act as one on the chord at rest, so the band is wide
    assert found.unit == "m" and abs(found.estimate - 2e-4) < 2.0 * found.std < 1e-4


def test_photos_taken_before_the_drive_stood_still_are_no_cause():
    """The forces are those at rest; half of the photos show the bearing up to 0.4 mm before its place."""
    late = np.array([0.0, 0.0, 4e-4, 0.0, 1.5e-4, 0.0, 3.5e-4]) / LARGEST
    at_rest = hidden_test(Cable(), SIX, largest=LARGEST, seed=33)
    before = replace(SIX, shares=tuple((np.array(SIX.shares) - late).tolist()))
    seen = hidden_test(Cable(), before, largest=LARGEST, seed=33)
    steps = (
        replace(step, chord=other.chord, shape=other.shape)
        for step, other in zip(at_rest.steps, seen.steps, strict=True)
    )
    part, *_ = diagnose(faults_of_input(replace(at_rest, steps=tuple(steps))), None, SETTINGS)
    assert part.verdict == "unexplained"
    assert part.leftover.key == "left.astray" and part.next_experiment.key == "next.repeat"

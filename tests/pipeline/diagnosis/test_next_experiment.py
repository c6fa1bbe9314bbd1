"""The next experiment: better than the same test once more, or settled by itself, or none."""

from __future__ import annotations

import pytest

from fixtures.effects import HIDE, LARGEST, PROTOCOLS, Form
from fixtures.hidden import hidden_test
from fixtures.scores import SETTINGS, refit_one
from pipeline.diagnosis.causes import SUSPECTS
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.diagnosis.plans.next_experiment import BETTER, next_experiment, protocols
from pipeline.faults import faults_of_input

NAMES = [cause.name for cause in SUSPECTS]


def refits(protocol, amount, names, hidden):
    cable, reading = HIDE[hidden](amount, Form())
    test = hidden_test(cable, PROTOCOLS[protocol], largest=LARGEST, seed=3, reading=reading)
    bench = prepare(faults_of_input(test), SETTINGS)
    found = [refit_one(bench.observation, bench.base, bench.suspicion, NAMES.index(n)) for n in names]
    return bench, found


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_nobody_is_told_to_do_what_was_done(protocol):
    bench, _ = refits(protocol, 0.0, (), "force_offset")
    told = [one.what for one in protocols(bench.facts)]
    assert ("next.unload" in told) == (protocol != "loop")
    assert ("next.free-photo" in told) == (protocol == "three")


def test_unloading_beats_repetition_for_friction_and_its_twin():
    bench, (friction, bend) = refits("six", 0.004, ("bearing_friction", "pre_curvature_varying"), "bearing_friction")
    found = next_experiment(bench, friction, [bend], SETTINGS)
    assert found.key == "next.unload"
    assert set(found.separates) == {"bearing_friction", "pre_curvature_varying"}
    assert found.sigma >= SETTINGS.separated and found.sigma > found.repeated_sigma + BETTER


@pytest.mark.parametrize(
    ("names", "key"),
    [(("force_offset", "force_drift"), "next.settled"), (("stiffness_drift", "stiffness_varying"), "next.repeat")],
)
def test_repetition_is_what_it_is_held_against(names, key):
    """Twice the data take two explanations farther apart by themselves; what does no better is not proposed, and the
    same test once more only where no reading settles one of them by itself.
    """
    bench, (one, other) = refits("loop", 0.03, names, names[0])
    once = next_experiment(bench, one, [other], SETTINGS)
    assert once.repeated_sigma > SETTINGS.separated  # two that these data tell apart already
    assert once.key == key or once.sigma > once.repeated_sigma + BETTER

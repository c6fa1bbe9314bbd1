"""Photos that show no axis that moves: it was put where the log says, and is as wrong as the log."""

from dataclasses import replace

import numpy as np
import pytest

from fixtures.continuum import Cable
from fixtures.effects import HIDE, LARGEST, Form
from fixtures.hidden import SIX, hidden_test
from fixtures.trials import f_error
from pipeline.diagnosis import diagnose
from pipeline.diagnosis.plans.plan import more_steps
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.base_fit import base_fit
from rod.inverse.prediction import facts_of

FRAME = 3e-4
"""m at the largest force: a frame that yields by 7 px of 24 px/mm."""


def put_by_log(test, beyond=0.0):
    """The test as photos show it whose moving axis was put by the log, or so far (m) beyond, after the first step."""
    first, *others = test.steps

    def put(step):
        chord = first.chord + first.displacement - step.displacement - beyond
        off = (chord - step.chord) * (test.moving == "left")
        shape = replace(step.shape, x=step.shape.x + off, section_x=step.shape.section_x + off)
        return replace(step, chord=chord, shape=shape, chord_by_log=True)

    return replace(test, steps=(first, *(put(step) for step in others)))


@pytest.fixture(scope="module")
def yielding():
    """A rig whose frame yields, and its cable."""
    forces = [step.force for step in hidden_test(Cable(), SIX, largest=LARGEST, seed=4).steps]
    cable, reading = HIDE["rig_compliance"](FRAME / max(forces), Form())
    return hidden_test(cable, SIX, largest=LARGEST, seed=4, reading=reading), cable


@pytest.mark.parametrize("moving", ["left", "right"])
def test_where_the_axis_was_put_tells_nothing(yielding, moving):
    test = replace(yielding[0], moving=moving)
    fits = [base_fit(test, facts_of(test)) for test in (put_by_log(test), put_by_log(test, 5e-4))]
    one, other = (found.fitted for found in fits)
    assert one.chi2 == pytest.approx(other.chi2, rel=2e-3)
    assert one.vector == pytest.approx(other.vector, abs=2e-3 * np.abs(one.vector).max())


def test_lengths_by_the_log_doubt_no_length(yielding):
    """The photo that shows both axes tells it; the others are told once."""
    far = put_by_log(yielding[0], 0.03 * yielding[0].length)
    moved = [replace(step, shape=replace(step.shape, s=1.03 * step.shape.s)) for step in far.steps[1:]]
    found = faults_of_input(replace(far, steps=(far.steps[0], *moved))).findings
    assert [finding.code for finding in found] == ["rig/axis-by-log"]
    assert f"on {len(moved)} others" in found[0].message and "left" in found[0].message


def test_further_steps_are_planned_alike(yielding):
    test = put_by_log(yielding[0])
    facts, last = facts_of(test), test.steps[-1]
    more = more_steps(facts, [last.displacement - 1e-3], ["unloading"])
    assert np.isnan(more.chord_by_log[0]) and more.chord_by_log[-1] == pytest.approx(last.chord + 1e-3)
    seen = facts_of(yielding[0])
    assert np.isnan(more_steps(seen, [1e-3], ["loading"]).chord_by_log).all()


def test_what_moves_the_axis_is_told_from_the_shapes(yielding):
    test, cable = yielding
    part = diagnose(faults_of_input(put_by_log(test)), None, DiagnosisSettings()).part
    assert part.verdict == "named" and part.causes[0].name == "rig_compliance", part.headline
    assert f_error(part.extended, cable)[0] < 0.02

"""A rig as laboratories have it: zero, length and camera a little off. Nothing is named then, and the reader told."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from fixtures.continuum import Cable
from fixtures.effects import LARGEST
from fixtures.hidden import LOOP, SIX, Reading, hidden_test
from fixtures.trials import f_error
from pipeline.diagnosis.causes.camera import tilt_of
from pipeline.diagnosis.explanations.search import searched
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.diagnosis.posterior.detectable import found_at
from pipeline.diagnosis.posterior.hypotheses import SHARES
from pipeline.diagnosis.posterior.products import AS_RIGS_ARE, MOVED
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.observation import residual
from rod.inverse.simulation import run
from tests.pipeline.diagnosis.among import among

LEAN = 0.12 * tilt_of(Cable().length)
"""A quarter of a degree."""


def diagnosed(protocol, seed, *, zero=-2.5e-5, names="", **cable):
    """The verdict, the names and the findings of a rig that is off as rigs are."""
    reading = Reading(play=zero, length_error=1.5e-3, tilt=(LEAN, -LEAN))
    test = hidden_test(Cable(**cable), protocol, largest=LARGEST, seed=seed, reading=reading)
    part, findings, _ = among(test, names)
    return part, {finding.code: finding.message for finding in findings}


@pytest.mark.parametrize(
    ("protocol", "seed", "names"),
    [
        (SIX, 51, ""),
        (LOOP, 52, "displacement_offset length_error camera_tilt scale_error bearing_friction plastic_set"),
    ],
    ids=["six", "loop"],
)
def test_nothing_is_named_where_a_rig_is_off_as_rigs_are(protocol, seed, names):
    part, told = diagnosed(protocol, seed, names=names)
    assert part.verdict == "adequate" and not part.causes
    size = re.search(r"displacement offset by −(\S+) ± (\S+)\sµm", told["rig/ordinary"])
    assert size is not None
    zero, std = map(float, size.groups())
    assert abs(zero - 25.0) < 3.0 * std < 25.0


@pytest.mark.parametrize(("share", "named"), [(0.003, []), (0.02, ["force_offset"])])
def test_a_load_cell_is_off_as_every_one_is_or_more(share, named):
    """Of the largest force: what is left of a zero is told with its size, and one that was never set is a cause."""
    reading = Reading(play=-2.5e-5, length_error=1.5e-3, tilt=(LEAN, -LEAN))
    test = hidden_test(Cable(), LOOP, largest=LARGEST, seed=57, reading=reading)
    zero = share * max(abs(step.force) for step in test.steps)
    steps = (replace(one, force=one.force + zero, hold_forces=one.hold_forces + zero) for one in test.steps)
    part, findings, _ = among(replace(test, steps=tuple(steps)), "")
    assert [cause.name for cause in part.causes] == named, part.headline
    if named:
        assert part.causes[0].estimate == pytest.approx(zero, rel=0.2)
    else:
        told = {finding.code: finding.message for finding in findings}["rig/ordinary"]
        size, std = map(float, re.search(r"force offset by (\S+) ± (\S+)\smN", told).groups())
        assert abs(size - 1e3 * zero) < 3.0 * std < 1e3 * zero


def test_columns_of_the_rig_are_those_of_difference_quotients():
    fitted = prepare(faults_of_input(hidden_test(Cable(), LOOP, largest=LARGEST, seed=58)), DiagnosisSettings())
    observation, fitted = fitted.observation, fitted.base
    for at, step in zip(fitted.extension.base.rig_at, (1e-6, 1e-3, 1e-5, 1e-4, 1e-4), strict=True):
        moved = fitted.vector + step * np.eye(len(fitted.vector))[at]
        there = run(fitted.extension.model(moved), fitted.extension.facts, near=fitted.run).prediction
        count = observation.rows.count
        quotient = (fitted.residual[:count] - residual(observation, there)) / step
        assert np.allclose(fitted.jacobian[:count, at], quotient, rtol=2e-3, atol=2e-3 * np.abs(quotient).max())


def test_a_cause_is_named_beside_such_a_rig_and_the_rig_is_not():
    part, told = diagnosed(LOOP, 53, bearing_friction=0.004)
    assert part.verdict == "named" and [cause.name for cause in part.causes] == ["bearing_friction"]
    assert part.causes[0].estimate == pytest.approx(0.004, rel=0.1)
    assert "rig/ordinary" in told
    off, covered = f_error(part.extended, Cable(bearing_friction=0.004))
    # f_EI is that of the model with the rig in it: exact to what a rig's length of a tenth of a per cent leaves
    assert off < 0.01 and covered > 0.9


def test_a_zero_that_is_lost_is_named_on_such_a_rig():
    part, _ = diagnosed(SIX, 54, zero=2.5e-4)
    assert [cause.name for cause in part.causes] == ["displacement_offset"]
    # the rest of the rig is off as well: its share of the zero is in the band
    assert abs(part.causes[0].estimate - 2.5e-4) < 0.2 * 2.5e-4


@pytest.mark.parametrize("told", [3e-6, 0.7e-6, 0.1e-6])
def test_a_zero_is_named_from_a_few_times_that_of_every_rig(told):
    """However much better photos tell it: at 0.7 um it was found at no size, and said to be able to hide."""
    ordinary, usual = 2e-5, 2.6e-4
    # the rig exact, or off as rigs are, which its evidence pays; variances of the zero by both
    known = np.array([told**2, told**2 + ordinary**2])
    weight = np.array([MOVED[0.0, 0.0], MOVED[AS_RIGS_ARE] * told / math.hypot(told, ordinary)])
    odds = math.log(SHARES[0][0] / SHARES[1][0] * 2 * 19)
    needed = found_at(weight / weight.sum(), 1.0 / known, odds, 30.0 * usual, usual, 0)
    assert 2.0 * ordinary < needed < 6.0 * ordinary


def test_what_every_rig_has_starts_no_search():
    """Scores take the zero of the displacement for exact, what is believed does not."""
    test = hidden_test(Cable(), LOOP, largest=LARGEST, seed=91, reading=Reading(play=2e-5))
    bench = prepare(faults_of_input(test), DiagnosisSettings())
    assert bench.largest > 4.0 * bench.limit
    search = searched(bench)
    assert search.posterior.word == "base" and not any(one.found for one in search.hypotheses)

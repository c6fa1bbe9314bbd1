"""Two causes: which pair, and what may stand in the place of each."""

from dataclasses import replace

import pytest

from fixtures.continuum import Cable
from fixtures.effects import HIDE, LARGEST, Form
from fixtures.hidden import LOOP, SIX, Protocol, Reading, hidden_test
from fixtures.memory import Slipping
from fixtures.scores import refit_one
from pipeline.diagnosis import diagnose
from pipeline.diagnosis.causes import SUSPECTS
from pipeline.diagnosis.explanations import search
from pipeline.diagnosis.explanations.pair_fits import with_all_forms
from pipeline.diagnosis.explanations.refit import fit_term
from pipeline.diagnosis.fits.search import suspect
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.diagnosis.posterior.explanation import explanation_of
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings

SETTINGS = DiagnosisSettings()


def test_a_lens_beside_a_force_that_decays_is_no_wrong_scale():
    """Which moves the same points."""
    steps = Protocol((0.0, 1 / 3, 2 / 3, 1.0), ("mounted", *("loading",) * 3))
    reading = Reading(lens=2e-3, relaxation=(0.03, 7.0))
    part, _, _ = diagnose(
        faults_of_input(hidden_test(Cable(), steps, largest=0.0138, seed=21, reading=reading)), None, SETTINGS
    )
    assert part.verdict == "two_causes", part.headline
    assert {cause.name for cause in part.causes} == {"lens_distortion", "relaxation"}, part.headline


def test_each_half_of_a_pair_has_all_its_forms():
    """A load at an angle to the chord beside a wrong lens: with its louder part alone neither half is right."""
    steps = Protocol((0.0, 1 / 3, 2 / 3, 1.0), ("mounted", *("loading",) * 3))
    cable = Cable(load=(-0.06, 0.06))
    test = hidden_test(cable, steps, largest=0.0138, seed=21, reading=Reading(lens=0.012))
    bench = prepare(faults_of_input(test), SETTINGS)
    names = [cause.name for cause in SUSPECTS]
    load, lens = names.index("in_plane_load"), names.index("lens_distortion")
    one = fit_term(bench.observation, bench.base, bench.suspicion, bench.suspicion.best(load))
    beside = suspect(bench.observation, one, SUSPECTS)
    half = explanation_of((load, lens), bench.base, fit_term(bench.observation, one, beside, beside.best(lens)))
    (whole,) = with_all_forms(bench, [half])
    assert len(whole.fitted.extension.terms) == len(half.fitted.extension.terms) + 2 == 4
    true = {
        "along the chord": -0.06,
        "across the chord": 0.06,
        "with the cube of the distance": 0.012,
        "with its fifth power": 0.0,
    }
    for k, term in enumerate(whole.fitted.extension.terms):
        amount, std = whole.fitted.amount(k)
        assert amount == pytest.approx(true[term.variant.label], abs=3.0 * std)


def test_all_causes_that_are_likely_beside_one_are_tried(monkeypatch):
    """Beside a K0 that varies a force's zero, six times that of every rig, shows little more than others do."""
    cable, reading = HIDE["pre_curvature_varying"](0.15, Form("growing along the cable"))
    test = hidden_test(cable, LOOP, largest=LARGEST, seed=31, reading=replace(reading, force_offset=0.028))
    bench = prepare(faults_of_input(test), SETTINGS)
    names = [cause.name for cause in bench.suspicion.causes]
    tried = []
    monkeypatch.setattr(search, "pairs_beside", lambda bench, one, second, causes, hopeless: tried.extend(causes) or [])
    seeking, varying = search.Search(bench), names.index("pre_curvature_varying")
    seeking._with_others(*seeking.add([refit_one(bench.observation, bench.base, bench.suspicion, varying)]))
    assert {"force_offset", "displacement_offset", "in_plane_load"} <= {names[cause] for cause in tried}
    assert len(tried) < 7


def test_every_cause_is_tried_before_something_is_called_unexplained(monkeypatch):
    """Stiff ends of 9 % of the length had so small a score that no fit ever held them, and f_EI was 18 % off."""
    bench = prepare(faults_of_input(hidden_test(Cable(rigid_end=0.0163), SIX, largest=0.0138, seed=3)), SETTINGS)
    names = [cause.name for cause in bench.suspicion.causes]
    monkeypatch.setattr(search, "candidates", lambda *_, **__: [names.index("in_plane_load")])
    seeking = search.Search(bench)
    seeking.hypotheses = seeking.hypotheses[:1]  # no score promises anything
    assert seeking.posterior.word == "rest"
    best = min(seeking.singles(), key=lambda one: one.fitted.chi2)
    assert [names[cause] for cause in best.causes] == ["rigid_ends"]
    amount, std = best.amount(bench.suspicion.causes[best.causes[0]])
    assert abs(amount - 0.0163) < 4.0 * std


def test_a_weak_cause_beside_one_fifty_times_as_loud_is_needed_where_only_both_leave_the_noise():
    """Friction of 7.7 mN m between the wires and a scale 0.8 % wrong: the second removes 2 % of what the first does."""
    amount = 0.0077
    cable = Cable(memory=Slipping((amount / 3.0, 2.0 * amount / 9.0), (1.0, 3.0)))  # slips at 1 and at 3 1/m
    test = hidden_test(cable, LOOP, largest=0.0138, seed=4, reading=Reading(scale_error=0.008))
    part, _, _ = diagnose(faults_of_input(test), None, SETTINGS)
    assert part.verdict == "two_causes" and {cause.name for cause in part.causes} == {"hysteresis", "scale_error"}
    scale = next(cause for cause in part.causes if cause.name == "scale_error")
    assert abs(scale.estimate - 0.008) < 4.0 * scale.std

"""Two causes: which pair, and what may stand in the place of each."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fixtures.aliens import with_alien
from fixtures.continuum import Cable
from fixtures.hidden import LOOP, SIX, THREE, Protocol, Reading, hidden_test
from fixtures.memory import Slipping
from pipeline.diagnosis import diagnose
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.explanations import two_causes
from pipeline.diagnosis.explanations.effort import Effort
from pipeline.diagnosis.explanations.exchange import exchanged
from pipeline.diagnosis.explanations.explanation import Explanation
from pipeline.diagnosis.explanations.pair_fits import refitted_pairs, with_all_forms
from pipeline.diagnosis.explanations.pair_set import weighed_pairs
from pipeline.diagnosis.explanations.two_causes import masking
from pipeline.diagnosis.fits.faults import faults_of_input
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.diagnosis.observations.work import newton_steps
from pipeline.diagnosis.statistics.pairs import Pair
from pipeline.diagnosis.statistics.verdict import Weighed
from pipeline.settings.diagnosis import DiagnosisSettings

SETTINGS = DiagnosisSettings()


def explanation(causes, gain, tuned):
    return Explanation(causes, SimpleNamespace(chi2=500.0 - gain), gain, Weighed(gain, tuned=tuned))


@pytest.fixture
def bench():
    base = SimpleNamespace(residual=np.zeros(120), extension=SimpleNamespace(size=8))
    scores = SimpleNamespace(unit=np.eye(4))
    return SimpleNamespace(
        base=base, suspicion=SimpleNamespace(scores=scores, owner=np.arange(4), causes=CATALOGUE[:4])
    )


PAIR = (0, 1)


def test_a_pair_that_fits_better_than_one_cause_of_several_forms_stands_alone(bench):
    two, instead = weighed_pairs(bench, [explanation(PAIR, 400.0, 1)], SETTINGS, [explanation((2,), 370.0, 3)])
    assert two is not None and [two.names(place) for place in (0, 1)] == [[0], [1]]
    assert two.chance(0) == pytest.approx(1.0, abs=1e-6) and instead == []


def test_one_cause_of_several_forms_that_fits_as_well_may_stand_for_both(bench):
    """Two more free numbers cost it exp(-2), the pair's prior is a tenth: of equal gain it keeps a place."""
    two, instead = weighed_pairs(bench, [explanation(PAIR, 400.0, 1)], SETTINGS, [explanation((2,), 400.0, 4)])
    assert two is not None and instead == []
    assert [two.names(place) for place in (0, 1)] == [[0, 2], [1, 2]] and 0.5 < two.chance(0) < 0.95


def test_the_causes_of_a_pair_that_fits_as_well_join_the_class_of_one_cause(bench):
    two, instead = weighed_pairs(bench, [explanation(PAIR, 400.0, 1)], SETTINGS, [explanation((2,), 400.0, 1)])
    assert two is None and instead == [0, 1]
    assert weighed_pairs(bench, [explanation(PAIR, 390.0, 1)], SETTINGS, [explanation((2,), 400.0, 1)]) == (None, [])


def test_its_prior_alone_does_not_keep_a_pair_out_of_the_class(bench):
    """Less than two sigma apart; prior and gain together leave it 2 %, less than the set asks for."""
    two, instead = weighed_pairs(bench, [explanation(PAIR, 397.0, 1)], SETTINGS, [explanation((2,), 400.0, 1)])
    assert two is None and instead == [0, 1]
    assert weighed_pairs(bench, [explanation(PAIR, 397.0, 2)], SETTINGS, [explanation((2,), 400.0, 1)]) == (None, [])


def test_a_search_whose_effort_is_spent_begins_nothing(bench):
    assert exchanged(bench, [explanation(PAIR, 400.0, 1)], SETTINGS, Effort.of(-1)) == []
    assert not Effort().spent


def test_a_diagnosis_as_a_whole_has_an_end_and_says_so():
    """Data that nothing explains kept every search at work; what is left out then is what comes last."""
    test = hidden_test(Cable(), SIX, largest=0.0138, seed=21, reading=Reading(lens=2e-2))
    strange = with_alien(test, "bump", 2e-4)
    hasty = SETTINGS.model_copy(update={"all_newton_steps": 300})
    spent = []
    for settings in (hasty, SETTINGS):
        before = newton_steps()
        part, findings = diagnose(strange, None, settings)
        spent.append(newton_steps() - before)
        assert part.verdict == "unexplained"
        assert ("diagnosis/search-ended" in [f.code for f in findings]) == (settings is hasty)
    assert spent[0] < 0.7 * spent[1]


def test_a_search_that_is_ended_says_so_and_ends_at_the_same_place_each_time():
    """Effort is counted in Newton steps: how busy the machine is decides nothing."""
    steps = Protocol((0.0, 1 / 3, 2 / 3, 1.0), ("mounted", *("loading",) * 3))
    test = hidden_test(Cable(), steps, largest=0.0138, seed=21, reading=Reading(lens=2e-3, relaxation=(0.03, 7.0)))
    hasty = SETTINGS.model_copy(update={"search_newton_steps": 1})
    spent = []
    for _ in range(2):
        before = newton_steps()
        _, findings = diagnose(test, None, hasty)
        spent.append(newton_steps() - before)
        assert [f.code for f in findings].count("diagnosis/search-ended") == 1
    assert spent[0] == spent[1] > 100  # four equilibria of some three steps each, in tens of fits
    before = newton_steps()
    _, findings = diagnose(test, None, SETTINGS)
    assert newton_steps() - before > spent[0]
    assert "diagnosis/search-ended" not in [f.code for f in findings]


def test_a_wrong_half_of_a_pair_is_exchanged():
    """Beside a force that decays, a wrong scale is put right: it is the lens, which moves the same points."""
    steps = Protocol((0.0, 1 / 3, 2 / 3, 1.0), ("mounted", *("loading",) * 3))
    reading = Reading(lens=2e-3, relaxation=(0.03, 7.0))
    test = hidden_test(Cable(), steps, largest=0.0138, seed=21, reading=reading)
    bench = prepare(faults_of_input(test, SETTINGS), SETTINGS, knots=4, refine=False)
    names = [cause.name for cause in CATALOGUE]
    scale, decay, lens = (names.index(n) for n in ("scale_error", "relaxation", "lens_distortion"))
    given = Pair(bench.suspicion.best(scale), bench.suspicion.best(decay), 0.0)
    (wrong,) = refitted_pairs(bench, [given], SETTINGS, hopeless=bench.base.chi2)
    best = max(exchanged(bench, [wrong], SETTINGS), key=lambda pair: pair.gain)
    assert best.causes == (lens, decay) and best.gain > wrong.gain + 16.0


def test_each_half_of_a_pair_has_all_its_forms():
    """A load at an angle to the chord beside a wrong lens: with its louder part alone neither half is right."""
    steps = Protocol((0.0, 1 / 3, 2 / 3, 1.0), ("mounted", *("loading",) * 3))
    cable = Cable(load=(-0.06, 0.06))
    test = hidden_test(cable, steps, largest=0.0138, seed=21, reading=Reading(lens=0.012))
    bench = prepare(faults_of_input(test, SETTINGS), SETTINGS, knots=4, refine=False)
    names = [cause.name for cause in CATALOGUE]
    load, lens = names.index("in_plane_load"), names.index("lens_distortion")
    given = Pair(bench.suspicion.best(load), bench.suspicion.best(lens), 0.0)
    (half,) = refitted_pairs(bench, [given], SETTINGS, hopeless=np.inf)
    (whole,) = with_all_forms(bench, [half], SETTINGS)
    assert len(whole.fitted.extension.terms) == 3 and whole.gain > half.gain + SETTINGS.shape_gain
    amount, std = whole.amount(CATALOGUE[lens])
    assert abs(amount - 0.012) < 4.0 * std


def test_a_weak_cause_beside_one_fifty_times_as_loud_is_needed_where_only_both_leave_the_noise():
    """Friction of 7.7 mN m between the wires and a scale 0.8 % wrong: the second removes 2 % of what the first does."""
    amount = 0.0077
    cable = Cable(memory=Slipping((amount / 3.0, 2.0 * amount / 9.0), (1.0, 3.0)))  # slips at 1 and at 3 1/m
    test = hidden_test(cable, LOOP, largest=0.0138, seed=4, reading=Reading(scale_error=0.008))
    part, _ = diagnose(test, None, SETTINGS)
    assert part.verdict == "two_causes" and {cause.name for cause in part.causes} == {"hysteresis", "scale_error"}
    scale = next(cause for cause in part.causes if cause.name == "scale_error")
    assert abs(scale.estimate - 0.008) < 4.0 * scale.std


@pytest.mark.parametrize(("gain", "tried"), [(50.0, True), (15.0, False)])
def test_a_pair_beyond_the_linear_limit_is_nothing_where_scores_spread_wider(monkeypatch, gain, tried):
    """A linear theory that claims half the spread there is: its limit (6) is a fourth of the true one (24)."""
    settings = DiagnosisSettings(bootstrap=10, masked_draws=1000, masked_least=0.0)
    bench = prepare(faults_of_input(hidden_test(Cable(), THREE, largest=0.0138, seed=3), settings), settings, knots=5)
    scores = replace(bench.suspicion.scores, unit=0.5 * bench.suspicion.scores.unit)
    asked = []
    monkeypatch.setattr(two_causes, "linear_pairs", lambda *_: [Pair(0, 1, gain)])
    monkeypatch.setattr(two_causes, "refitted_pairs", lambda *_, **__: asked.append(True) or [])
    assert masking(replace(bench, suspicion=replace(bench.suspicion, scores=scores)), settings) is None
    assert bool(asked) is tried

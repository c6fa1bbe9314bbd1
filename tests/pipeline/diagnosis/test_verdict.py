import sys
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.diagnosis.causes.cause import Variant
from pipeline.diagnosis.diagnose import _beyond_catalogue, _refitted
from pipeline.diagnosis.explanations.effort import Effort
from pipeline.diagnosis.statistics.score import score
from pipeline.diagnosis.statistics.verdict import Weighed, credible_set, decide, probabilities, scan_share, with_twins
from pipeline.settings.diagnosis import DiagnosisSettings

LINEAR, WAVE = Variant("growing along the cable"), Variant("in waves", at=-3.0, known=0.3)


def weigh(gains, **kind):
    return probabilities([Weighed(gain, **kind) for gain in gains], reduced_chi2=1.0, implausible=4.0)


def test_probabilities_follow_the_likelihood():
    p = weigh([20.0, 18.0, 10.0])
    assert p.sum() == pytest.approx(1.0)
    assert p[1] / p[0] == pytest.approx(np.exp(-1.0))


def test_misfit_of_the_best_tempers_the_others():
    options = [Weighed(1000.0), Weighed(980.0)]
    sharp = probabilities(options, reduced_chi2=1.0, implausible=4.0)
    blunt = probabilities(options, reduced_chi2=10.0, implausible=4.0)
    assert sharp[1] < 1e-4 and blunt[1] == pytest.approx(1.0 / (1.0 + np.e), rel=1e-6)


def test_absurd_amounts_and_long_scans_lose():
    p = probabilities([Weighed(20.0), Weighed(20.0, excess=40.0)], reduced_chi2=1.0, implausible=4.0)
    assert p[1] / p[0] == pytest.approx(0.01)
    assert scan_share(np.array([3.0])) == 0.0
    assert scan_share(np.array([5.0, 0.0, 0.0, 0.0])) == pytest.approx(np.log(1.0 / 4.0), abs=1e-4)


def test_set_holds_the_level():
    p = np.array([0.5, 0.02, 0.4, 0.08])
    assert credible_set(p, level=0.95) == [0, 2, 3]
    assert credible_set(p, level=0.5) == [0]


def test_twins_that_remove_as_much_share_the_class():
    probability = np.array([0.97, 0.02, 0.006, 0.004])
    gain, closeness = np.array([100.0, 99.0, 99.0, 80.0]), np.array([1.0, 0.99, 0.5, 0.99])
    assert with_twins([0], probability, gain, closeness, cosine=0.95, margin=4.0) == [0, 1]
    assert with_twins([0, 1], probability, gain, closeness, cosine=0.95, margin=4.0) == [0, 1]
    assert with_twins([0], probability, gain, closeness, cosine=0.95, margin=30.0) == [0, 1, 3]


def test_stated_probabilities_are_true_for_twins():
    """Two causes at a cosine of 0.97, effects of 3 to 9 sigma: of those named with 70 %, 70 % must be right."""
    rng = np.random.default_rng(1)
    columns = np.array([[1.0, 0.97], [0.0, np.sqrt(1.0 - 0.97**2)]])
    right, stated, inside = [], [], []
    for _ in range(4000):
        truth = int(rng.integers(2))
        data = rng.choice([-1.0, 1.0]) * rng.uniform(3.0, 9.0) * columns[:, truth] + rng.standard_normal(2)
        p = weigh(score(data, np.zeros((2, 0)), columns).z ** 2)
        right.append(int(np.argmax(p)) == truth)
        stated.append(p.max())
        inside.append(truth in credible_set(p, level=0.95))
    right, stated = np.array(right), np.array(stated)
    for low, high in ((0.5, 0.65), (0.65, 0.8), (0.8, 0.95)):
        chosen = (stated > low) & (stated <= high)
        # the target of 0.03 plus two standard errors of some 500 draws
        assert abs(right[chosen].mean() - stated[chosen].mean()) < 0.03 + 2.0 * 0.5 / np.sqrt(chosen.sum())
    assert np.mean(inside) > 0.95


@pytest.mark.parametrize(
    ("facts", "word"),
    [
        ({"detected": False, "alien": False, "two": False, "names": 0, "powerless": False}, "adequate"),
        ({"detected": False, "alien": False, "two": False, "names": 0, "powerless": True}, "underpowered"),
        ({"detected": False, "alien": True, "two": False, "names": 0, "powerless": False}, "unexplained"),
        ({"detected": True, "alien": True, "two": False, "names": 1, "powerless": False}, "unexplained"),
        ({"detected": True, "alien": False, "two": True, "names": 1, "powerless": False}, "two_causes"),
        ({"detected": True, "alien": False, "two": False, "names": 1, "powerless": False}, "named"),
        ({"detected": True, "alien": False, "two": False, "names": 2, "powerless": False}, "class"),
    ],
)
def test_word(facts, word):
    assert decide(**facts) == word


@pytest.mark.parametrize(
    ("branch", "announced", "others"),
    [("loading", 0.0, True), ("loading", 8.0, False), ("mounted", 0.0, False)],
    ids=["another valley", "announced", "K0 is known"],
)
def test_a_cause_that_no_score_announced_is_not_refitted_alone(monkeypatch, branch, announced, others):
    """Without the force-free photo it was found in another valley of K0, where other causes fit as well."""
    tried = []

    def explanations(bench, causes, settings, whole):
        tried.append(causes)
        return [SimpleNamespace(causes=(0,), gain=50.0)] if 0 in causes else [], False

    suspicion = SimpleNamespace(
        causes=("friction", "offset", "nothing"),
        of=lambda k: np.arange(k, min(k + 1, 2)),
        statistic=np.array([announced, 2.0]),
    )
    bench = SimpleNamespace(
        suspicion=suspicion, facts=SimpleNamespace(branch=(branch, "loading")), largest=6.0, limit=3.5
    )
    room = sys.modules[_refitted.__module__]  # its package names a function as the module
    monkeypatch.setattr(room, "candidates", lambda *_, any_sign: [0])
    monkeypatch.setattr(room, "_explanations", explanations)
    _refitted(bench, DiagnosisSettings(), Effort())
    assert tried == ([[0], [1]] if others else [[0]])


@pytest.mark.parametrize(
    ("variant", "both", "reduced", "excess", "p_value", "alien"),
    [
        (WAVE, False, 6.0, 50.0, 0.0, True),  # stiff ends taken for waves of the stiffness: 98 % removed, names nothing
        (WAVE, False, 1.1, 50.0, 0.0, False),
        (LINEAR, False, 6.0, 50.0, 0.0, False),  # one form alone imitates little: its share of the misfit decides
        (LINEAR, False, 6.0, 500.0, 0.0, True),
        (LINEAR, True, 6.0, 50.0, 0.0, True),
        (LINEAR, True, 1.1, 50.0, 0.0, False),
        (WAVE, True, 6.0, 500.0, 0.2, False),  # chance alone leaves as much
    ],
)
def test_what_can_imitate_much_must_leave_no_more_than_noise(variant, both, reduced, excess, p_value, alien):
    extension = SimpleNamespace(terms=(SimpleNamespace(variant=variant),))
    accepted = SimpleNamespace(gain=2000.0, fitted=SimpleNamespace(extension=extension, reduced_chi2=reduced))
    left = SimpleNamespace(p_value=p_value, excess=excess)
    assert _beyond_catalogue(accepted, left, DiagnosisSettings(), both=both) is alien


@pytest.mark.parametrize(("excess", "p_value", "alien"), [(50.0, 0.0, True), (50.0, 0.2, False)])
def test_without_an_explanation_anything_beyond_chance_is_unexplained(excess, p_value, alien):
    left = SimpleNamespace(p_value=p_value, excess=excess)
    assert _beyond_catalogue(None, left, DiagnosisSettings(), both=False) is alien

"""What few control points leave is named as no cause: nulls of laws with a kink, and weak causes that must stay named.

Truth: `fixtures.continuum`, so nothing but the noise and the law's form is in the data of a null.
"""

from dataclasses import replace

import pytest

from fixtures.continuum import Cable
from fixtures.effects import LARGEST
from fixtures.hidden import LOOP, Reading, hidden_test
from fixtures.trials import Trial, made
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.diagnose import conclude, settled
from pipeline.diagnosis.explanations.finer_law import points_instead
from pipeline.diagnosis.fits.faults import faults_of_input
from pipeline.diagnosis.fits.workbench import prepare, with_points
from pipeline.settings.diagnosis import DiagnosisSettings

SETTINGS = DiagnosisSettings()


def bench_of(test, *names, knots=SETTINGS.knots, refine=True):
    causes = [cause for cause in CATALOGUE if cause.name in names]
    bench = prepare(faults_of_input(test, SETTINGS), SETTINGS, knots=knots, causes=causes, refine=refine)
    assert not isinstance(bench, str), bench
    return bench


def named(bench, concluded):
    accepted = () if concluded.accepted is None else concluded.accepted.causes
    return [bench.suspicion.causes[k].name for k in accepted]


def test_a_cause_that_a_finer_law_does_as_well_is_not_named():
    """Four points on a law of stick and slip: a frame that yields takes 106 of chi-square, two more points take 405."""
    test = hidden_test(Cable(EI0=0.03, EI1=0.006, kc=3.0, K0=1.0), LOOP, largest=LARGEST, seed=4)
    bench = bench_of(test, "rig_compliance", knots=4, refine=False)
    assert bench.largest > 2.0 * bench.limit
    finer, concluded = settled(bench, SETTINGS)
    assert named(finer, concluded) == [] and not concluded.alien
    assert len(finer.base.extension.base.knots) > len(bench.base.extension.base.knots)


def test_a_law_with_a_kink_is_no_fault_of_the_simulation():
    """Another control point was told as what the simulation lacks, of a cable with nothing hidden in it."""
    cable = Cable(length=0.196, EI0=0.0045, EI1=0.0019, kc=5.5, K0=-0.635, form="linear")
    test = hidden_test(cable, LOOP, largest=0.012, seed=1, reading=Reading(px_per_m=1e4, force_noise=2e-3))
    bench = bench_of(test, "nonlinear_stiffness", "hysteresis", knots=6)
    concluded = conclude(bench, SETTINGS)
    assert named(bench, concluded) == ["nonlinear_stiffness"]
    finer = with_points(bench, points_instead(bench, concluded, SETTINGS), SETTINGS)
    assert finer.largest < finer.limit < bench.largest


@pytest.mark.parametrize(("protocol", "name", "seed"), [("six", "force_offset", 61010), ("loop", "hysteresis", 61018)])
def test_a_weak_cause_stays_named(protocol, name, seed):
    """At the detectable amount: of force offsets 5 to 12 % survive beside the law, and still it takes none of them."""
    bench = bench_of(made(Trial("hidden", protocol, seed, (name,), 1.0)), name, "nonlinear_stiffness")
    concluded = conclude(bench, SETTINGS)
    assert named(bench, concluded) == [name]
    assert points_instead(bench, concluded, SETTINGS) is None


def test_friction_and_law_of_a_test_without_unloading_stay_one_class():
    """They are the same there, exactly: whichever is likelier, no law is laid in the place of the other."""
    bench = bench_of(made(Trial("hidden", "six", 31, ("hysteresis",), 0.0)), "hysteresis", "nonlinear_stiffness")
    concluded = conclude(bench, SETTINGS)
    assert {bench.suspicion.causes[k].name for k in concluded.names} == {"hysteresis", "nonlinear_stiffness"}
    assert points_instead(bench, concluded, SETTINGS) is None
    alone = replace(concluded, members=1)
    assert {bench.suspicion.causes[k].name for k in alone.names} != {"hysteresis", "nonlinear_stiffness"}
    assert points_instead(bench, alone, SETTINGS) is not None

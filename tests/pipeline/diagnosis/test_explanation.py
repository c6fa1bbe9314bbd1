"""Refits: forms that are not needed are dropped, refits without some data do not see them, bands of a class."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import rod.inverse.fit as fits
from fixtures.continuum import Cable
from fixtures.hidden import LOOP, SIX, Reading, hidden_test
from fixtures.memory import Slipping
from fixtures.scores import refit_one
from pipeline.diagnosis.causes import SUSPECTS
from pipeline.diagnosis.explanations.refit import Addition, linear_start
from pipeline.diagnosis.explanations.single_cause import refits
from pipeline.diagnosis.fits.extended import curve
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.diagnosis.presentation.findings import too_large
from pipeline.faults import faults_of_input
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.fit import fit

SETTINGS = DiagnosisSettings()
BEARINGS = [cause.name for cause in SUSPECTS].index("bearing_stiffness")
ELEMENTS = Slipping((2e-3, 1.3e-3), (1.0, 3.0))


def prepared(cable, seed):
    return prepare(faults_of_input(hidden_test(cable, LOOP, largest=0.0138, seed=seed)), SETTINGS)


@pytest.fixture(scope="module")
def plain():
    return prepared(Cable(), 6)


@pytest.mark.parametrize("distance", [0.86, -0.86])
@pytest.mark.parametrize("tilt", [(0.13, 0.0), (0.0, 0.13), (0.0, -0.13)])
def test_a_steep_tilt_is_one_to_the_noise(tilt, distance):
    """6.5 degrees from 0.86 m foreshorten by 0.64 %, or stretch by twice that: perspective alone is not it."""
    test = hidden_test(Cable(), SIX, largest=0.0138, seed=3, reading=Reading(tilt=tilt, distance=distance))
    bench = prepare(faults_of_input(test), SETTINGS)
    index = [cause.name for cause in SUSPECTS].index("camera_tilt")
    found = refit_one(bench.observation, bench.base, bench.suspicion, index)
    amount, std = found.amount(SUSPECTS[index])
    assert amount == pytest.approx(sum(tilt), abs=3.0 * std) and std < 0.02
    assert found.fitted.chi2 < 1.3 * (len(bench.base.residual) - found.fitted.extension.size)


def test_a_bow_that_grows_with_the_travel_is_one_to_the_noise():
    """None at rest, 12 mm at the end, as the square of the bow: one height or one angle in all photos is not it."""
    test = hidden_test(Cable(K0=2.0), SIX, largest=0.0138, seed=4, reading=Reading(bow=(0.012, 2.0, 0.0)))
    bench = prepare(faults_of_input(test), SETTINGS)
    index = [cause.name for cause in SUSPECTS].index("out_of_plane_bow")
    found = refit_one(bench.observation, bench.base, bench.suspicion, index)
    amount, std = found.amount(SUSPECTS[index])
    assert amount == pytest.approx(0.012, abs=3.0 * std) and std < 0.001
    assert found.fitted.chi2 < 1.3 * (len(bench.base.residual) - found.fitted.extension.size)


def test_two_elements_that_slip_are_found_as_two():
    """Truth by collocation; each slip within four of its standard deviations, and the law is itself again."""
    bench = prepared(Cable(memory=ELEMENTS), 6)
    index = [cause.name for cause in SUSPECTS].index("hysteresis")
    found = refit_one(bench.observation, bench.base, bench.suspicion, index)
    own = found.fitted.extension.amounts_at
    assert len(own) == 2
    slip = sorted((found.fitted.vector[at + 1], np.sqrt(found.fitted.covariance[at + 1, at + 1])) for at in own)
    for (value, std), truth in zip(slip, ELEMENTS.slip, strict=True):
        assert abs(value - truth) < 4.0 * std and std < 0.1 * truth
    amount, std = found.amount(SUSPECTS[index])
    assert amount == pytest.approx(np.dot(ELEMENTS.stiffness, ELEMENTS.slip), abs=4.0 * std)


def test_many_wires_that_slip_one_after_the_other_are_one_form():
    """Five elements of equal moment, most of which slip early: one form says how many slip by when."""
    slip = (0.3, 0.6, 1.05, 1.65, 2.4)
    bench = prepared(Cable(memory=Slipping(tuple(8e-4 / one for one in slip), slip)), 42)
    index = [cause.name for cause in SUSPECTS].index("hysteresis")
    several = refits(bench.observation, bench.base, bench.suspicion, index)
    found = next(one for one in several if len(one.fitted.extension.terms) == 1)
    (term,), (at,) = found.fitted.extension.terms, found.fitted.extension.amounts_at
    std = np.sqrt(found.fitted.covariance[at + 1, at + 1])
    assert found.fitted.vector[at + 1] == pytest.approx(2.4, abs=4.0 * std) and std < 0.3
    amount, std = found.amount(term.cause)
    assert amount == pytest.approx(4e-3, abs=4.0 * std) and std < 2e-4
    assert found.fitted.chi2 < 1.3 * (len(bench.base.residual) - found.fitted.extension.size)


def test_springs_of_two_bearings_are_told_apart():
    """One three times as stiff as the other, by collocation: both are components of one cause, each with its amount."""
    spring = 2.4e-3
    bench = prepared(Cable(bearing_stiffness=spring, sides=(1.0, 0.3)), 35)
    found = refit_one(bench.observation, bench.base, bench.suspicion, BEARINGS)
    told = {term.variant.label: found.fitted.amount(k) for k, term in enumerate(found.fitted.extension.terms)}
    assert set(told) == {"at the left bearing", "at the right bearing"}
    for label, share in zip(sorted(told), (1.0, 0.3), strict=True):
        amount, std = told[label]
        assert amount == pytest.approx(share * spring, abs=4.0 * std) and std < 0.25 * (1.0 - 0.3) * spring


def test_a_bearing_that_yields_before_it_slips_is_no_friction_of_wires():
    """Three sigma apart at the least, and the moment at which it slips is the hidden one within four sigma."""
    bench = prepared(Cable(bearing_friction=1.8e-3, stick_angle=0.03), 34)
    friction, wires = (
        refit_one(bench.observation, bench.base, bench.suspicion, [cause.name for cause in SUSPECTS].index(name))
        for name in ("bearing_friction", "hysteresis")
    )
    assert friction.gain > wires.gain + 9.0
    amount, std = friction.amount(SUSPECTS[friction.causes[0]])
    assert amount == pytest.approx(1.8e-3, abs=4.0 * std) and std < 1e-4


def test_a_cause_that_would_have_to_be_impossibly_large_is_told_as_such():
    """A camera that looks along the table has no photo; a load cell that was never set to zero may show anything."""
    facts = SimpleNamespace(length=0.18, force_scale=2.0)
    for name, told in (("camera_tilt", True), ("force_offset", False)):
        cause = next(cause for cause in SUSPECTS if cause.name == name)
        found = SimpleNamespace(causes=(0,), amount=lambda kind: (30.0 * kind.plausible(facts), 0.0))
        bench = SimpleNamespace(facts=facts, suspicion=SimpleNamespace(causes=(cause,)))
        assert bool(too_large(bench, SimpleNamespace(accepted=found))) is told


def test_a_start_is_a_possible_cable_where_none_tried_has_an_equilibrium(plain, monkeypatch):
    """A whole linear move had left the range of a slip, and the refit began with a negative one."""
    monkeypatch.setattr(fits, "run", lambda *_, **__: SimpleNamespace(prediction=None))
    direction = int(plain.suspicion.of([cause.name for cause in SUSPECTS].index("hysteresis"))[0])
    term = plain.suspicion.terms[direction]
    added = Addition(plain.base, term, 1.0, 1e9 * plain.suspicion.columns[:, direction])
    assert added.extension.admissible(linear_start(plain.observation, added))


def test_rows_left_out_of_a_refit_do_not_matter(plain):
    rows = len(plain.observation.rows.kind)
    kept = np.r_[plain.observation.rows.step != 3, np.ones(len(plain.base.residual) - rows, dtype=bool)]
    spoilt = replace(plain.observation, added=np.where(plain.observation.rows.step == 3, 50.0, 0.0))
    found = [
        fit(
            observation,
            plain.base.extension,
            begin,
            iterations=10,
            tolerance=1e-3,
            kept=kept,
        )
        for observation, begin in ((plain.observation, plain.base), (spoilt, plain.base.vector))
    ]
    # both end within the tolerance of the same minimum: a thirtieth of a standard deviation
    std = np.sqrt(np.diag(plain.base.covariance))
    assert np.all(np.abs(found[0].vector - found[1].vector) < 0.1 * std)
    apart = (found[1].residual - found[0].residual)[:rows]
    # what was added to the rows left out is all there, as far as the two fits agree on them
    assert np.allclose(apart, spoilt.added, atol=0.5)


def test_the_band_holds_the_distance_to_another_answer(plain):
    count = plain.base.extension.base.law.size
    other = replace(
        plain.base, vector=plain.base.vector + np.r_[np.full(count, 0.03), np.zeros(len(plain.base.vector) - count)]
    )
    alone = curve(plain.base)
    shared = curve(plain.base, other=other)
    apart = np.expm1(0.03) * np.array(alone.tangent_Nm2)
    expected = np.hypot(alone.tangent_std_Nm2, apart)
    assert shared.tangent_Nm2 == alone.tangent_Nm2
    assert shared.tangent_std_Nm2 == pytest.approx(expected, rel=1e-6)
    assert shared.moment_std_Nm[-1] > alone.moment_std_Nm[-1]

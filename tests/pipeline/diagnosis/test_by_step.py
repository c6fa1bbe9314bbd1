"""What goes on from step to step: friction that differs, a set of all the cable, relaxation that is remembered.

Data by collocation, no rod of ours.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from fixtures.continuum import Cable, bend
from fixtures.effects import LARGEST, PROTOCOLS
from fixtures.hidden import STAY, Protocol, Reading, hidden_test, maxwell
from pipeline.diagnosis import diagnose
from pipeline.diagnosis.causes.load_cell import SLOWLY
from pipeline.faults import faults_of_input
from tests.pipeline.diagnosis.among import among


def found(cable, protocol, seed):
    """Part of the result, and whether f_EI lies in its band."""
    test = hidden_test(cable, PROTOCOLS[protocol], largest=LARGEST, seed=seed)
    part, _, _ = diagnose(faults_of_input(test), None)
    K, f, std = (
        np.array(row) for row in (part.extended.kappa_per_m, part.extended.tangent_Nm2, part.extended.tangent_std_Nm2)
    )
    truth = cable.law(K - cable.K0)[1]
    assert np.sqrt(np.mean((f / truth - 1.0) ** 2)) < 0.02
    return part, float(np.mean(np.abs(f - truth) <= 1.96 * std))


BOTH = (1.0, 0.7, 1.5, 0.8, 1.2, 0.6, 1.4)
EACH = tuple(zip(BOTH, (1.1, 1.3, 0.5, 0.9, 0.5, 1.5, 0.8), strict=True))


@pytest.mark.parametrize(("factors", "forms"), [(BOTH, 7), (EACH, 13)])
def test_friction_of_the_bearings_that_differs_from_step_to_step(factors, forms):
    part, covered = found(Cable(bearing_friction=1.2e-3, friction_varies=factors), "loop", 41)
    assert part.verdict == "named" and part.causes[0].name == "bearing_friction", part.headline
    assert len(part.causes[0].forms) == forms and covered > 0.9
    # the mean is known no better than the single ones scatter
    assert part.causes[0].estimate == pytest.approx(1.2e-3, rel=0.3)


def with_journals(cable, protocol):
    """The cable in bearings whose friction grows with the force, to that of the cable at the largest one."""
    for _ in range(6):  # each time a quarter of what is left to it or less
        forces = np.array([abs(one.F) for one in bend(cable, protocol.displacements(LARGEST))])
        cable = replace(cable, friction_varies=tuple(forces / forces.max()))
    return cable


ONE_BEARING = [
    ("bearing_friction", Cable(bearing_friction=3e-3, sides=(1.0, 0.0))),
    ("bearing_stiffness", Cable(bearing_stiffness=4e-3, sides=(0.0, 1.0))),
    ("bearing_stiffness", Cable(bearing_stiffness=4e-3, sides=(1.0, 0.4))),
]


def test_one_bearing_alone_is_named_with_its_side():
    """With both alike these were unexplained, or a load in the plane and a stiffness that varies were named."""
    inside = []
    for seed, (name, cable) in enumerate(ONE_BEARING, start=43):
        part, covered = found(cable, "loop", seed)
        assert part.verdict == "named" and part.causes[0].name == name, part.headline
        assert [form for form in part.causes[0].forms if form.label.startswith("at the ") or form.width > 0.9]
        inside.append(covered)
    assert np.mean(inside) > 0.9  # of one smooth error a tenth of the range is by chance outside


ON_LOADING = Protocol(tuple(i / 6 for i in range(1, 7)), ("loading",) * 6)


@pytest.mark.parametrize(("K0", "amount", "protocol"), [(2.0, 3e-3, PROTOCOLS["loop"]), (0.3, 0.015, ON_LOADING)])
def test_friction_of_the_bearings_that_grows_with_the_force(K0, amount, protocol):
    """Without a photo at rest a large one was taken for a cable that is bent to the other side at rest."""
    cable = with_journals(Cable(K0=K0, bearing_friction=amount), protocol)
    part, _, _ = diagnose(faults_of_input(hidden_test(cable, protocol, largest=LARGEST, seed=47)), None)
    assert part.verdict == "named" and part.causes[0].name == "bearing_friction", part.headline
    assert [form.label for form in part.causes[0].forms] == ["that grows with the force"]
    assert part.causes[0].estimate == pytest.approx(amount, abs=4.0 * part.causes[0].std)
    curve = part.extended
    K, f, std = (np.array(row) for row in (curve.kappa_per_m, curve.tangent_Nm2, curve.tangent_std_Nm2))
    assert np.mean(np.abs(f - cable.law(K - cable.K0)[1]) < 1.96 * std) > 0.9 and np.median(std / f) < 0.03


@pytest.mark.parametrize(("protocol", "late"), [("six", 0), ("loop", 0), ("six", 1)])
def test_relaxation_of_a_spring_in_series_with_a_dashpot_is_remembered(protocol, late):
    """Every piece of the cable relaxes by its own moment. Taken for a loss of the changes of the force, f_EI of such a
    cable was 4 % off. What the force lost before the first sample is in the band.
    """
    elastic, spring, decay = 0.010, 0.0025, 12.0
    cable = Cable(EI0=elastic, EI1=elastic, memory=maxwell(spring, decay))
    test = hidden_test(cable, PROTOCOLS[protocol], largest=LARGEST, seed=61, reading=Reading(late=late))
    part, _, _ = diagnose(faults_of_input(test), None)
    assert part.verdict == "named" and part.causes[0].name == "relaxation", part.headline
    assert part.causes[0].forms[0].label == "decaying since every change of the bow"
    f, std = np.array(part.extended.tangent_Nm2), np.array(part.extended.tangent_std_Nm2)
    at_once = elastic + spring
    lost, unseen = (spring * -np.expm1(-STAY * samples / decay) for samples in (late, late + 1))
    assert np.mean(np.abs(f - at_once) < 1.96 * std) > 0.9 and np.median(std / f) < 0.01 + unseen / at_once
    assert np.sqrt(np.mean((f / (at_once - lost) - 1.0) ** 2)) < 0.02
    # a share of what was left at the first sample
    assert part.causes[0].estimate == pytest.approx(0.2, abs=4.0 * part.causes[0].std + lost / at_once)


@pytest.mark.parametrize(
    ("protocol", "seed", "rivals"),
    [("six", 71, ""), ("six", 72, "force_drift stiffness_drift relaxation force_offset"), ("loop", 71, "")],
)
def test_a_zero_of_the_load_cell_that_wanders(protocol, seed, rivals):
    """A smooth random path, which shows while a step is held as well as from one to the next."""
    cable = Cable()
    test = hidden_test(cable, PROTOCOLS[protocol], largest=LARGEST, seed=seed)
    walk = 0.03 * max(abs(step.force) for step in test.steps) * np.random.default_rng(seed).standard_normal(6)
    zero = PchipInterpolator(np.linspace(0.0, test.steps[-1].time, 7), np.append(0.0, np.cumsum(walk)))
    steps = [
        replace(step, force=step.force + float(zero(step.time)), hold_forces=step.hold_forces + zero(step.hold_times))
        for step in test.steps
    ]
    part, _, _ = among(replace(test, steps=tuple(steps)), rivals)
    assert part.verdict == "named" and part.causes[0].name == "force_drift", part.headline
    went = max((float(zero(time)) for step in steps for time in step.hold_times[[0, -1]]), key=abs)
    size, std, unit = part.causes[0].stated  # how far the zero went
    assert unit == "N" and size == pytest.approx(went, abs=3.0 * std) and std < 0.3 * abs(went)
    assert part.causes[0].unit == "N/s"
    K, f, std = (np.array(getattr(part.extended, of)) for of in ("kappa_per_m", "tangent_Nm2", "tangent_std_Nm2"))
    assert np.mean(np.abs(f - cable.law(K - cable.K0)[1]) <= 1.96 * std) > 0.9 and np.median(std / f) < 0.05


@pytest.mark.parametrize(("power", "begins", "memory", "earlier"), [
    (0.05, 2.0, True, 0.5), (0.05, 2.0, False, 0.0), (0.08, 0.1, True, 1.0), (0.08, 0.1, False, 1.0),
])  # fmt: skip
def test_relaxation_by_a_power_law_has_no_time_constant(power, begins, memory, earlier):
    """Plastics relax as t^-n (Findley, Lai and Onaran 1976), by the moment, which goes with force times bow.

    What the force lost before its first sample, after the hold began, is in no data and has to be in the band.
    """
    cable = Cable(EI0=0.010, EI1=0.010)
    test = hidden_test(cable, PROTOCOLS["loop"], largest=LARGEST, seed=65)
    steps = test.steps
    bow = np.array([max(float(step.shape.y.max()), 1e-9) for step in steps])
    change = np.diff([step.force * high for step, high in zip(steps, bow, strict=True)], prepend=0.0)
    begun = np.array([step.hold_times[0] - earlier for step in steps])
    relaxed = []
    for k, step in enumerate(steps):
        lost = 1.0 - (1.0 + (step.hold_times - begun[: k + 1, None]) / begins) ** -power
        lost = change[: k + 1] @ lost / bow[k] if memory else step.force * lost[-1]
        relaxed.append(replace(step, force=step.force - lost[-1], hold_forces=step.hold_forces - lost))
    part, _, _ = diagnose(faults_of_input(replace(test, steps=tuple(relaxed))), None)
    assert part.verdict == "named" and part.causes[0].name == "relaxation", part.headline
    assert [form.label for form in part.causes[0].forms] == [SLOWLY[memory]]
    f, std = np.array(part.extended.tangent_Nm2), np.array(part.extended.tangent_std_Nm2)
    # n |log(1 - b / tau)| in the root mean square over every b up to tau, see `lost_unseen`
    assert np.mean(np.abs(f - 0.010) < 1.96 * std) > 0.9 and np.median(std / f) < 0.03 + np.sqrt(2.0) * power
    at_first = 0.010 * (1.0 + earlier / begins) ** -power
    assert np.sqrt(np.mean((f / at_first - 1.0) ** 2)) < 0.02


def half_sine(u):
    return np.sin(np.pi * u)


@pytest.mark.parametrize(("protocol", "profile"), [("loop", half_sine), ("six", np.ones_like)])
def test_a_set_that_goes_with_the_largest_bend_anywhere(protocol, profile):
    inside = []
    for seed in (23, 24):
        part, covered = found(Cable(set_rate=0.05, set_from=3.0, set_profile=profile), protocol, seed)
        assert part.causes[0].name == "plastic_set", part.headline
        form = part.causes[0].forms[0]
        assert form.label == ("in a half sine along the cable" if profile is half_sine else "alike all along the cable")
        assert part.causes[0].estimate == pytest.approx(0.05, abs=4.0 * part.causes[0].std)
        inside.append(covered)
    assert np.mean(inside) > 0.9  # of one smooth error a tenth of the range is by chance outside


def test_a_set_where_the_cable_bends_is_part_of_the_law_on_loading():
    test = hidden_test(Cable(set_rate=0.05, set_from=3.0), PROTOCOLS["six"], largest=LARGEST, seed=23)
    part, _, _ = diagnose(faults_of_input(test), None)
    assert part.verdict == "adequate", part.headline
    assert {"plastic_set", "hysteresis"} <= {spot.name for spot in part.blind_spots}

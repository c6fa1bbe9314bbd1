"""Every cause of the contract's table, hidden in data of another solver and discretisation, must be found again.

Truth: `fixtures.continuum` (collocation) read by the rig and camera of `fixtures.hidden` with the noise of real photos.
The expected answer is the name, the class where physics allows no more, ``adequate`` where nothing is hidden.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fixtures.continuum import Cable, Slipping
from fixtures.hidden import LOOP, SIX, THREE, Reading, hidden_test
from fixtures.make import hidden_specimen
from pipeline.diagnosis import diagnose
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.diagnose import conclude
from pipeline.diagnosis.faults import faults_of_input
from pipeline.diagnosis.score import sigma_needed
from pipeline.diagnosis.search import detectable_amount
from pipeline.diagnosis.workbench import prepare
from pipeline.identify import measured_test
from pipeline.intake.folder import read_specimen
from pipeline.settings import Settings
from pipeline.settings.diagnosis import DiagnosisSettings
from pipeline.simulate import Experiment
from pipeline.vision.series import trace_series

SETTINGS = DiagnosisSettings()
PROTOCOLS = {"three": THREE, "six": SIX, "loop": LOOP}
LARGEST = 0.0138
LAW = {"EI0": 0.018, "EI1": 0.0075, "kc": 4.5}


def growing(amount):
    return lambda u: amount * (2.0 * u - 1.0)


def waved(amount):
    return lambda u: amount * np.sin(2.0 * np.pi * u)


def spot(amount):
    return lambda u: amount * np.exp(-0.5 * ((u - 0.6) / 0.06) ** 2)


HIDE = {
    "pre_curvature_varying": lambda a: (Cable(K0_profile=growing(a)), Reading()),
    "stiffness_varying": lambda a: (Cable(stiffness_profile=spot(-a)), Reading()),
    # two sharp elements that slip at 1 and 3 1/m and share the half width as 1 to 2
    "hysteresis": lambda a: (Cable(memory=Slipping((a / 3.0, 2.0 * a / 9.0), (1.0, 3.0))), Reading()),
    "plastic_set": lambda a: (Cable(set_rate=a), Reading()),
    "relaxation": lambda a: (Cable(), Reading(relaxation=(a, 7.0))),
    "bearing_friction": lambda a: (Cable(bearing_friction=a), Reading()),
    "bearing_stiffness": lambda a: (Cable(bearing_stiffness=a), Reading()),
    "rigid_ends": lambda a: (Cable(rigid_end=a), Reading()),
    "rig_compliance": lambda a: (Cable(compliance=a), Reading()),
    "displacement_offset": lambda a: (Cable(displacement_offset=a), Reading()),
    "length_error": lambda a: (Cable(), Reading(length_error=a)),
    "force_offset": lambda a: (Cable(), Reading(force_offset=a)),
    "force_drift": lambda a: (Cable(), Reading(force_drift=a)),
    "force_gain": lambda a: (Cable(), Reading(force_gain=a)),
    "in_plane_load": lambda a: (Cable(load=(a, 0.0)), Reading()),
    "scale_error": lambda a: (Cable(), Reading(scale_error=a)),
    "lens_distortion": lambda a: (Cable(), Reading(lens=a)),
    "camera_tilt": lambda a: (Cable(), Reading(tilt=(a, 0.0))),
}
"""How an amount of each cause is put into the continuum, the load cell or the camera."""

CLEAREST = {
    "pre_curvature_varying": lambda a: (Cable(K0_profile=waved(a)), Reading()),
    "stiffness_varying": lambda a: (Cable(stiffness_profile=waved(a)), Reading()),
}
"""The form whose detectable amount is the smallest, where a cause has several."""

NEEDS_THE_WAY_BACK = ("hysteresis", "plastic_set", "bearing_friction")


def f_error(curve, law=LAW, K0=2.0):
    """Relative error of a tangent curve against the hidden law, rms over its range."""
    kappa = np.array(curve.kappa_per_m)
    truth = law["EI1"] + (law["EI0"] - law["EI1"]) / np.cosh((kappa - K0) / law["kc"]) ** 2
    return float(np.sqrt(np.mean((np.array(curve.tangent_Nm2) / truth - 1.0) ** 2)))


@cache
def outlook(protocol):
    """Plausible size and detectable amount of every cause under a protocol, from a specimen with nothing hidden."""
    bench = bench_of(hidden_test(Cable(), PROTOCOLS[protocol], largest=LARGEST, seed=99))
    needed = sigma_needed(bench.limit, power=0.9)
    return {
        cause.name: (
            cause.plausible(bench.facts),
            detectable_amount(
                bench.observation, bench.base, bench.suspicion, index, needed=needed, trace=SETTINGS.trace
            ),
        )
        for index, cause in enumerate(bench.suspicion.causes)
    }


def bench_of(test):
    bench = prepare(faults_of_input(test, SETTINGS), SETTINGS, knots=SETTINGS.knots)
    assert not isinstance(bench, str), bench
    return bench


def names_found(bench):
    """Names in the set of the conclusion; empty where nothing was found."""
    conclusion = conclude(bench, SETTINGS)
    if conclusion.accepted is None:
        return [], conclusion
    found = [CATALOGUE[e.causes[0]].name for e in conclusion.singles[: conclusion.members]]
    return found + [CATALOGUE[cause].name for cause in conclusion.accepted.causes], conclusion


def test_every_cause_of_the_catalogue_is_hidden_here():
    # a law of another form is the base model's own business; see test_rediscovery for where it is found
    assert set(HIDE) == {cause.name for cause in CATALOGUE} - {"nonlinear_stiffness"}


@pytest.mark.parametrize("name", [name for name in HIDE if name != "force_gain"])
def test_plausible_size_is_named_and_f_comes_back(name):
    protocol = "loop" if name in NEEDS_THE_WAY_BACK else "six"
    # below the detectable amount nothing can be asked for: bearing_stiffness and rigid_ends lie just at it
    size = max(outlook(protocol)[name][0], 1.5 * outlook(protocol)[name][1])
    cable, reading = HIDE[name](size)
    part, findings = diagnose(
        hidden_test(cable, PROTOCOLS[protocol], largest=LARGEST, seed=7, reading=reading), None, SETTINGS
    )
    assert [finding.code for finding in findings if finding.level == "error"] == []
    assert part.verdict in ("named", "class"), part.headline
    assert name in part.causes[0].class_, part.headline
    if part.verdict == "named" and name != "relaxation":
        # relaxation: the share that is lost depends on what happens after the hold
        sign = -1.0 if name == "stiffness_varying" else 1.0
        assert part.causes[0].estimate == pytest.approx(sign * size, abs=4.0 * part.causes[0].std + 0.05 * size)
    assert f_error(part.extended) < 0.02, part.headline


# both multiples of every cause are in the study (python -m fixtures.study); here they alternate, for time
@pytest.mark.parametrize(
    ("name", "times"),
    [
        (name, (2.0, 4.0)[number % 2])
        for number, name in enumerate(name for name in HIDE if name not in ("force_gain", "hysteresis"))
    ],
)
def test_multiples_of_the_detectable_amount_are_in_the_set(name, times):
    protocol = {2.0: "loop", 4.0: "six"}[times] if name not in NEEDS_THE_WAY_BACK else "loop"
    plausible, detectable = outlook(protocol)[name]
    factor = np.sqrt(times) if name == "rigid_ends" else times  # its trace grows with the square
    cable, reading = CLEAREST.get(name, HIDE[name])(factor * detectable)
    bench = bench_of(hidden_test(cable, PROTOCOLS[protocol], largest=LARGEST, seed=int(10 * times), reading=reading))
    found, conclusion = names_found(bench)
    assert name in found and not conclusion.alien
    assert np.isfinite(plausible)


@pytest.mark.parametrize("protocol", ["three", "six", "loop"])
@pytest.mark.parametrize("seed", [11, 12, 13])
def test_nothing_is_named_where_nothing_is_hidden(protocol, seed):
    law = {11: Cable(), 12: Cable(EI0=0.03, EI1=0.005, kc=5.0, K0=1.2), 13: Cable(EI0=2e-4, EI1=1.5e-4, kc=3.0, K0=2.5)}
    bench = bench_of(hidden_test(law[seed], PROTOCOLS[protocol], largest=LARGEST, seed=seed))
    found, conclusion = names_found(bench)
    assert found == [] and not conclusion.alien


def test_force_gain_is_never_seen_and_said_to_be_invisible():
    test = hidden_test(Cable(), SIX, largest=LARGEST, seed=3, reading=Reading(force_gain=0.05))
    part, _ = diagnose(test, None, SETTINGS)
    assert part.verdict == "adequate"
    blind = {spot.name: spot for spot in part.blind_spots}
    assert blind["force_gain"].stiffness_bias_at_plausible_size == pytest.approx(0.01, rel=0.02)
    assert "weights" in blind["force_gain"].settled_by


def test_three_loading_steps_show_a_growing_pre_curvature():
    test = hidden_test(Cable(K0=0.6, K0_profile=growing(0.7)), THREE, largest=LARGEST, seed=5)
    part, _ = diagnose(test, None, SETTINGS)
    assert part.verdict == "named" and part.causes[0].name == "pre_curvature_varying"
    assert part.causes[0].estimate == pytest.approx(0.7, abs=0.01)
    assert part.gain.heldout_excess_removed > 0.9
    assert f_error(part.extended, K0=0.6) < 0.02


def test_two_causes_are_both_found():
    cable = Cable(bearing_friction=0.002, displacement_offset=3e-4)
    part, _ = diagnose(hidden_test(cable, LOOP, largest=LARGEST, seed=8), None, SETTINGS)
    assert part.verdict == "two_causes"
    assert {cause.name for cause in part.causes} == {"bearing_friction", "displacement_offset"}
    assert f_error(part.extended) < 0.02


def test_an_effect_outside_the_catalogue_is_unexplained():
    """Waves along the cable that come and go from step to step as no beam's do, a tenth of a millimetre high."""
    test = hidden_test(Cable(), SIX, largest=LARGEST, seed=9)
    steps = list(test.steps)
    for index, size in ((2, 1.2e-4), (4, -1.6e-4), (5, 1.4e-4)):
        shape = steps[index].shape
        push = size * np.sin(5.0 * np.pi * shape.section_s / 0.181) ** 3
        steps[index] = replace(steps[index], shape=replace(shape, section_y=shape.section_y + push))
    part, _ = diagnose(replace(test, steps=tuple(steps)), None, SETTINGS)
    assert part.verdict == "unexplained", part.headline
    assert "shapes" in part.leftover["message"]


RENDERED = {
    "adequate": ({}, (0.0, 0.0046, 0.0092, 0.0138)),
    "stiffness_varying": ({"stiffness_varying": (-0.15, 0.6)}, (0.0, 0.0046, 0.0092, 0.0138)),
    "bearing_friction": ({"bearing_friction": 2e-3}, (0.0, 0.0069, 0.0138, 0.0092, 0.0046)),
    "camera_tilt": ({"camera_tilt": (0.05, 0.0)}, (0.0, 0.0046, 0.0092, 0.0138)),
}


@pytest.mark.parametrize("name", RENDERED)
def test_through_rendered_photos(tmp_path, name):
    """From pictures of collocation solutions, light from one side, through the whole vision stage."""
    effects, displacements = RENDERED[name]
    experiment = Experiment(id=name, displacements_m=displacements, effects=effects, seed=17)
    folder = hidden_specimen(tmp_path / name, experiment).folder
    settings = Settings()
    specimen = read_specimen(folder, settings.intake)
    test = measured_test(specimen, trace_series(specimen, settings.vision), settings.identify)
    part, findings = diagnose(test, None, settings.diagnosis)
    assert findings == ()
    if name == "adequate":
        assert part.verdict == "adequate", part.headline
    else:
        assert part.verdict in ("named", "class") and name in part.causes[0].class_, part.headline
        assert f_error(part.extended) < 0.02

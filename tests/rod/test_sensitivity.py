"""Derivatives by the implicit function theorem against central differences, to 1e-6 relative, for every parameter."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rod.bending_test import BendingTest, simulate, table_1
from rod.characteristic import Characteristic
from rod.equilibrium import Equilibrium
from rod.laws import StickSlip
from rod.parameters import NAMES, Parameter, Toward
from rod.section import InternalFriction
from rod.sensitivity import derivatives
from rod.support import Support

JOINTS = 41
XI = np.linspace(0.0, 1.0, JOINTS)
BASIS = np.cos(2.0 * np.pi * XI)
LAW = Characteristic.from_ordinates([0.0, 5.0, 10.0], [5e-3, 3e-3, 2e-3])
EVERYTHING = BendingTest(
    0.2,
    LAW,
    2.0 + 0.5 * XI,
    stiffness_profile=1.0 + 0.1 * np.sin(3.0 * XI),
    elements=JOINTS - 1,
    load=(0.05, 0.1),
    compliance=1e-3,
    stiffening=0.5,
    left=Support(stiffness=2e-3, hardening=2.0, friction_moment=3e-4, rigid_length=4e-3),
    right=Support(stiffness=1e-3, hardening=-2.0, friction_moment=2e-4, rigid_length=3e-3),
    friction=InternalFriction(1e-3, 1.5),
    plastic_rate=0.05,
    set_threshold=0.3,
    axial_stiffness=5e3,
    shear_stiffness=3e3,
    displacement_offset=1e-4,
)
DISPLACEMENTS = np.array([0.0, 3e-3, 8e-3, 1.3e-2, 9e-3, 4e-3])  # there and back: memory takes part

Vary = Callable[[BendingTest, float], BendingTest]


def both(change: dict[str, float], test: BendingTest, h: float) -> BendingTest:
    ends = [replace(s, **{k: getattr(s, k) + h for k in change}) for s in (test.left, test.right)]
    return replace(test, left=ends[0], right=ends[1])


def one(side: str, name: str) -> Vary:
    def vary(test: BendingTest, h: float) -> BendingTest:
        support = getattr(test, side)
        return replace(test, **{side: replace(support, **{name: (getattr(support, name) or 0.0) + h})})

    return vary


def control_point(index: int) -> Vary:
    return lambda t, h: replace(
        t, characteristic=replace(t.characteristic, ordinates=t.characteristic.ordinates + h * np.eye(3)[index])
    )


# Column name: how to vary the test, and a step that leaves 1e-9 of truncation in the four-point formula.
VARIATIONS: dict[str, tuple[Vary, float]] = {
    "ordinates[0]": (control_point(0), 3e-7),
    "ordinates[1]": (control_point(1), 3e-7),
    "ordinates[2]": (control_point(2), 3e-7),
    "pre_curvature": (lambda t, h: replace(t, pre_curvature=t.rod.section.pre_curvature + h), 3e-4),
    "pre_curvature[0]": (lambda t, h: replace(t, pre_curvature=t.rod.section.pre_curvature + h * BASIS), 3e-4),
    "stiffness_profile": (lambda t, h: replace(t, stiffness_profile=t.rod.section.profile + h), 3e-4),
    "stiffness_profile[0]": (lambda t, h: replace(t, stiffness_profile=t.rod.section.profile + h * BASIS), 3e-4),
    "displacement_offset": (lambda t, h: replace(t, displacement_offset=t.displacement_offset + h), 3e-7),
    "rig_compliance": (lambda t, h: replace(t, compliance=t.compliance + h), 3e-6),
    "rig_stiffening": (lambda t, h: replace(t, stiffening=t.stiffening + h), 3e-4),
    "length": (lambda t, h: replace(t, length=t.length + h), 3e-6),
    "rigid_ends": (lambda t, h: both({"rigid_length": h}, t, h), 3e-6),
    "rigid_left": (one("left", "rigid_length"), 3e-6),
    "rigid_right": (one("right", "rigid_length"), 3e-6),
    "bearing_stiffness": (lambda t, h: both({"stiffness": h}, t, h), 3e-6),
    "bearing_stiffness_left": (one("left", "stiffness"), 3e-6),
    "bearing_stiffness_right": (one("right", "stiffness"), 3e-6),
    "bearing_hardening_left": (one("left", "hardening"), 3e-3),
    "bearing_hardening_right": (one("right", "hardening"), 3e-3),
    "bearing_friction": (lambda t, h: both({"friction_moment": h}, t, h), 3e-6),
    "bearing_friction_left": (one("left", "friction_moment"), 3e-6),
    "bearing_friction_right": (one("right", "friction_moment"), 3e-6),
    "end_moment_left": (one("left", "moment"), 3e-6),
    "end_moment_right": (one("right", "moment"), 3e-6),
    "load_x": (lambda t, h: replace(t, load=(t.load[0] + h, t.load[1])), 3e-4),
    "load_y": (lambda t, h: replace(t, load=(t.load[0], t.load[1] + h)), 3e-4),
    "hysteresis": (lambda t, h: replace(t, friction=replace(t.friction, half_width=t.friction.half_width + h)), 3e-6),
    "stick_curvature": (
        lambda t, h: replace(t, friction=replace(t.friction, stick_curvature=t.friction.stick_curvature + h)),
        3e-4,
    ),
    "plastic_set": (lambda t, h: replace(t, plastic_rate=t.plastic_rate + h), 3e-5),
    "set_threshold": (lambda t, h: replace(t, set_threshold=t.set_threshold + h), 3e-4),
    "set_saturation": (lambda t, h: replace(t, set_saturation=t.set_saturation + h), 3e-4),
}


def parameter(name: str, test: BendingTest = EVERYTHING) -> Parameter:
    """By its name where it has one, else by the test that has a little more of it."""
    named, given = name.partition("[")[:2]
    if named not in NAMES:
        vary, h = VARIATIONS[name]
        return Toward(test, vary(test, h), h)
    return (named, BASIS) if given and named != "ordinates" else named


Run = Callable[[BendingTest, tuple[Equilibrium, ...] | None], tuple[Equilibrium, ...]]


def worst_error(test: BendingTest, by: Parameter, vary: Vary, h: float, run: Run, column: int = 0) -> float:
    """Largest difference to central differences over all steps and quantities, relative to the largest derivative."""
    steps = run(test, None)
    assert all(step.good for step in steps)
    exact = derivatives(test, steps, [by])
    shifted = {k: run(vary(test, k * h), steps) for k in (-2, -1, 1, 2)}
    errors = []
    for name in ("s", "x", "y", "theta", "kappa", "moment", "force", "chord"):
        error = size = 0.0
        for i, d in enumerate(exact):
            v = {k: np.asarray(getattr(path[i], name)) for k, path in shifted.items()}
            differences = (8.0 * (v[1] - v[-1]) - (v[2] - v[-2])) / (12.0 * h)
            derivative = np.asarray(getattr(d, name))[..., column]
            error = max(error, float(np.abs(differences - derivative).max()))
            # An imposed chord does not move: its rounding is held against the movement of the cable.
            size = max(size, float(np.abs(d.x[:, column] if name == "chord" else derivative).max()))
        errors.append(error / size if size else error)
    return max(errors)


def displaced(test: BendingTest, starts: tuple[Equilibrium, ...] | None) -> tuple[Equilibrium, ...]:
    return simulate(test, DISPLACEMENTS, starts=starts)


@pytest.mark.parametrize("name", VARIATIONS)
def test_every_parameter_along_a_path_with_memory(name: str) -> None:
    vary, h = VARIATIONS[name]
    if name.startswith("ordinates"):
        assert worst_error(EVERYTHING, "ordinates", vary, h, displaced, column=int(name[-2])) < 1e-6
        return
    assert worst_error(EVERYTHING, parameter(name), vary, h, displaced) < 1e-6


@pytest.mark.parametrize("name", ["pre_curvature", "length", "rigid_ends", "bearing_friction", "load_y"])
def test_with_imposed_chords(name: str) -> None:
    # Without friction elements: each of the four shifted paths would slip at other joints than the middle one.
    test = replace(EVERYTHING, friction=None, plastic_rate=0.0)
    chords = test.zero_chord - DISPLACEMENTS - 1e-3
    vary, h = VARIATIONS[name]
    assert worst_error(test, parameter(name, test), vary, h, lambda t, s: simulate(t, chords=chords, starts=s)) < 1e-6


@pytest.mark.parametrize("name", ["pre_curvature", "load_y"])
def test_of_a_rod_as_soft_across_as_along(name: str) -> None:
    vary, h = VARIATIONS[name]
    test = replace(EVERYTHING, axial_stiffness=30.0, shear_stiffness=30.0)
    assert worst_error(test, parameter(name, test), vary, h, displaced) < 1e-6


@pytest.mark.parametrize("zero", ["length", "loaded", 0.198])
@pytest.mark.parametrize("name", ["length", "pre_curvature", "load_y"])
def test_zero_of_displacement_takes_part(name: str, zero: str | float) -> None:
    vary, h = VARIATIONS[name]
    test = replace(EVERYTHING, zero=zero)
    assert worst_error(test, parameter(name, test), vary, h, displaced) < 1e-6


def test_imposed_chord_and_imposed_force_are_each_others_inverse() -> None:
    chord, force = 0.186, simulate(EVERYTHING, chords=[0.186])[0].force
    by_chord = derivatives(EVERYTHING, simulate(EVERYTHING, chords=[chord]), ["chord"])[0]
    by_force = derivatives(EVERYTHING, simulate(EVERYTHING, forces=[force]), ["force"])[0]
    assert by_force.chord[0] == pytest.approx(1.0 / by_chord.force[0], rel=1e-8)
    assert np.allclose(by_force.y[:, 0], by_chord.y[:, 0] / by_chord.force[0], rtol=1e-6, atol=1e-12)
    assert by_chord.chord[0] == pytest.approx(1.0, rel=1e-9)


def test_with_imposed_forces() -> None:
    vary, h = VARIATIONS["pre_curvature"]
    assert worst_error(EVERYTHING, "pre_curvature", vary, h, lambda t, s: simulate(t, forces=[0.3, 0.5])) < 1e-6


@pytest.mark.parametrize("side", ["left", "right"])
def test_clamps_follow_their_angle(side: str) -> None:
    clamp = Support("clamp", angle=0.2 if side == "left" else -0.2, rigid_length=3e-3)
    test = replace(EVERYTHING, **{side: clamp}, friction=None, plastic_rate=0.0)
    vary = one(side, "angle")
    turning = Toward(test, vary(test, 1e-4), 1e-4)
    assert worst_error(test, turning, vary, 1e-4, lambda t, s: simulate(t, chords=[0.19, 0.18])) < 1e-6


@pytest.mark.parametrize("name", ["angle", "stiffness", "hardening"])
@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("hardening", [3.0, -3.0])
def test_springs_follow_their_numbers(hardening: float, side: str, name: str) -> None:
    test = replace(EVERYTHING, **{side: Support(stiffness=2e-3, hardening=hardening, angle=0.3)}, friction=None)
    vary, h = one(side, name), 3e-6 if name == "stiffness" else 1e-4
    assert worst_error(test, Toward(test, vary(test, h), h), vary, h, displaced) < 1e-6


def test_clamp_as_mounted_turns_with_the_pre_curvature() -> None:
    test = replace(EVERYTHING, left=Support("clamp", rigid_length=3e-3))
    vary, h = VARIATIONS["pre_curvature[0]"]
    assert worst_error(test, ("pre_curvature", BASIS), vary, h, displaced) < 1e-6


@pytest.mark.parametrize("reading", ["tangent", "secant"])
@pytest.mark.parametrize("abscissa", ["curvature", "excess"])
def test_control_points_and_pre_curvature_in_every_reading(reading: str, abscissa: str) -> None:
    law = Characteristic.from_ordinates([0.0, 8.0, 20.0], [5e-3, 4e-3, 3e-3], reading=reading, abscissa=abscissa)
    test = replace(EVERYTHING, characteristic=law)
    for column in range(3):
        assert worst_error(test, "ordinates", control_point(column), 3e-7, displaced, column=column) < 1e-6
    vary, h = VARIATIONS["pre_curvature"]
    assert worst_error(test, "pre_curvature", vary, h, displaced) < 1e-6


@pytest.mark.parametrize("abscissa", ["curvature", "excess"])
@pytest.mark.parametrize("name", ["pre_curvature[0]", "stiffness_profile[0]", "plastic_set"])
def test_set_beside_a_law_that_stays(name: str, abscissa: str) -> None:
    law = replace(LAW, abscissa=abscissa)
    test = replace(EVERYTHING, characteristic=law, law_stays=True)
    vary, h = VARIATIONS[name]
    assert worst_error(test, parameter(name, test), vary, h, displaced) < 1e-6
    assert worst_error(test, "ordinates", control_point(1), 3e-7, displaced, column=1) < 1e-6


@pytest.mark.parametrize("name", ["pre_curvature[0]", "plastic_set", "set_threshold", "set_saturation"])
def test_set_that_slows_down(name: str) -> None:
    test = replace(EVERYTHING, set_saturation=0.3)
    vary, h = VARIATIONS[name]
    assert worst_error(test, parameter(name, test), vary, h, displaced) < 1e-6


CAUSES = ("bearing_stiffness", "bearing_friction", "rigid_ends", "load_x", "load_y", "hysteresis", "plastic_set")


@pytest.mark.parametrize("name", CAUSES)
def test_score_at_zero_is_the_one_sided_derivative(name: str) -> None:
    # Score tests need the derivative where the cause is absent: compared with forward differences, error of order h.
    test = replace(table_1("tangent", elements=40), friction=InternalFriction(0.0, 1.5))
    steps = displaced(test, None)
    exact = derivatives(test, steps, [parameter(name, test)])
    vary, h = VARIATIONS[name]
    once, twice = displaced(vary(test, h), None), displaced(vary(test, 2.0 * h), None)
    for step, d, a, b in zip(steps[1:], exact[1:], once[1:], twice[1:], strict=True):
        forward = (4.0 * a.force - b.force - 3.0 * step.force) / (2.0 * h)
        assert forward == pytest.approx(d.force[0], rel=2e-4)  # error of order h^2


@pytest.mark.parametrize("name", [name for name in VARIATIONS if name.partition("[")[0] in NAMES])
def test_toward_a_test_that_differs_is_the_parameter_that_differs(name: str) -> None:
    vary, step = VARIATIONS[name][0], 1e-2 * VARIATIONS[name][1]
    column = int(name[-2]) if name.startswith("ordinates") else 0
    steps = displaced(EVERYTHING, None)
    toward = Toward(EVERYTHING, vary(EVERYTHING, step), step)
    for by, going in zip(
        derivatives(EVERYTHING, steps, [parameter(name)]), derivatives(EVERYTHING, steps, [toward]), strict=True
    ):
        for what in ("s", "x", "theta", "kappa", "force"):
            expected = np.asarray(getattr(by, what))[..., column]
            assert np.asarray(getattr(going, what))[..., 0] == pytest.approx(
                expected, rel=1e-4, abs=1e-5 * float(np.abs(expected).max(initial=0.0)) + 1e-12
            )


def test_all_parameters_in_one_call_are_the_single_ones() -> None:
    steps = displaced(EVERYTHING, None)
    every = ["ordinates", *(parameter(name) for name in VARIATIONS if not name.startswith("ordinates"))]
    together = derivatives(EVERYTHING, steps, every)[-1]
    assert together.force.size == len(VARIATIONS)
    for name in ("pre_curvature", "hysteresis", "load_x"):
        alone = derivatives(EVERYTHING, steps, [parameter(name)])[-1]
        column = list(VARIATIONS).index(name)
        assert np.allclose(together.kappa[:, column], alone.kappa[:, 0], rtol=1e-10, atol=1e-10)


def test_pre_curvature_is_the_sum_of_its_pieces() -> None:
    steps = displaced(EVERYTHING, None)
    pieces = [np.maximum(1.0 - 2.0 * XI, 0.0), 1.0 - np.abs(1.0 - 2.0 * XI), np.maximum(2.0 * XI - 1.0, 0.0)]
    split = derivatives(EVERYTHING, steps, [("pre_curvature", piece) for piece in pieces])[-1]
    whole = derivatives(EVERYTHING, steps, ["pre_curvature"])[-1]
    assert split.force.sum() == pytest.approx(whole.force[0], rel=1e-9)


def test_force_gain_and_stiffness_scale_cannot_be_told_apart() -> None:
    # Scale law: f -> c f leaves the shapes and multiplies the forces.
    test = table_1("tangent")
    for step, d in zip(steps := simulate(test, [0.005, 0.01]), derivatives(test, steps, ["ordinates"]), strict=True):
        by_scale = test.characteristic.ordinates
        assert d.force @ by_scale == pytest.approx(step.force, rel=1e-6)
        assert np.abs(d.kappa @ by_scale).max() < 1e-5 * step.kappa.max()


@pytest.mark.parametrize(
    ("nonsense", "message"),
    [
        ("stiffness", "unknown parameter"),
        (("length", BASIS), "only pre_curvature, stiffness_profile vary"),
        (("pre_curvature", BASIS[:-1]), "one value per joint"),
        (Toward(EVERYTHING, replace(EVERYTHING, friction=None), 1.0), "other elements"),
        (Toward(EVERYTHING, replace(EVERYTHING, elements=XI[1:] + 1.0), 1.0), "other elements"),
        (Toward(EVERYTHING, replace(EVERYTHING, elements=JOINTS), 1.0), "other elements"),
    ],
)
def test_nonsense_is_refused(nonsense: object, message: str) -> None:
    steps = displaced(EVERYTHING, None)
    with pytest.raises(ValueError, match=message):
        derivatives(EVERYTHING, steps, [nonsense])


def test_missing_ingredients_are_named() -> None:
    test = BendingTest(0.2, StickSlip(6e-3, 3e-3, 4.0), 2.0)
    steps = simulate(test, [0.01])
    with pytest.raises(ValueError, match="only a law with parameters"):
        derivatives(test, steps, ["ordinates"])
    with pytest.raises(ValueError, match="no equilibrium"):
        derivatives(test, simulate(test, chords=[0.3]), ["pre_curvature"])


def test_table_of_names_is_complete() -> None:
    tested = {name.partition("[")[0] for name in VARIATIONS}
    assert set(NAMES) - tested == {"chord", "force"}  # tested on their own

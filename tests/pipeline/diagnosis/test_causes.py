"""Each cause against a formula or an argument of its own, on a cable of the base model."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from fixtures.continuum import Cable
from fixtures.hidden import LOOP, hidden_test
from pipeline.diagnosis import explain
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.causes.profile import PIECE, forms_between
from pipeline.simulate.effects import ONE_SIDED
from rod.inverse.base import start
from rod.inverse.prediction import facts_of
from rod.inverse.simulation import run

CONTRACT = {
    "nonlinear_stiffness", "pre_curvature_varying", "stiffness_varying", "hysteresis", "plastic_set", "relaxation",
    "bearing_friction", "bearing_stiffness", "rigid_ends", "rig_compliance", "displacement_offset", "length_error",
    "force_offset", "force_drift", "force_gain", "in_plane_load", "scale_error", "lens_distortion", "camera_tilt",
    "out_of_plane_bow", "stiffness_drift",
}  # fmt: skip
BY_NAME = {cause.name: cause for cause in CATALOGUE}


@pytest.fixture(scope="module")
def bench():
    test = hidden_test(Cable(), LOOP, largest=0.0138, seed=2)
    facts = facts_of(test)
    base = start(test, facts)
    model = base.model(base.neutral())
    return facts, model, run(model, facts)


def made(bench, name, amount, variant=0):
    facts, model, _ = bench
    cause = BY_NAME[name]
    found = run(cause.apply(model, amount, cause.variants(facts)[variant], facts), facts)
    assert found.prediction is not None, found.advice
    return found.prediction


def test_catalogue_is_the_contract_without_the_base_model():
    assert set(BY_NAME) == CONTRACT


def test_signs_are_those_that_can_be_hidden():
    assert {cause.name for cause in CATALOGUE if cause.sign} == ONE_SIDED


@pytest.mark.parametrize("name", sorted(CONTRACT - {"nonlinear_stiffness"}))  # the base law has any form
def test_amount_zero_changes_nothing_and_a_plausible_one_something(bench, name):
    facts, model, before = bench
    cause = BY_NAME[name]
    changed = []
    for index, variant in enumerate(cause.variants(facts)):
        same = made(bench, name, 0.0, index)
        assert np.allclose(same.force, before.prediction.force, rtol=1e-7, atol=1e-9)
        assert np.allclose(same.y, before.prediction.y, rtol=0, atol=1e-10)
        there = run(cause.apply(model, cause.plausible(facts), variant, facts), facts)
        assert there.prediction is not None, there.failed
        # stiff ends add vertices, so bows are compared, not points
        moved = [np.abs(np.max(there.prediction.y, 1) - np.max(before.prediction.y, 1)).max() / 0.181]
        moved += [
            np.abs(a - b).max() / facts.force_scale
            for a, b in zip(there.prediction.samples, before.prediction.samples, strict=True)
        ]
        changed.append(max(moved))
    assert max(changed) > 1e-5 and cause.plausible(facts) > 0.0


@pytest.mark.parametrize("name", sorted(CONTRACT))
def test_no_step_of_a_refit_makes_an_impossible_cable(bench, name):
    """A refit of foreign data may step anywhere that the sign allows (a length of -1.1 m ended a diagnosis)."""
    facts, model, _ = bench
    cause = BY_NAME[name]
    for times in (-1e3, -30.0, 30.0, 1e3):
        for variant in cause.variants(facts) if cause.sign * times >= 0.0 else ():
            rod = cause.apply(model, times * cause.plausible(facts), variant, facts).bending.rod
            assert rod.length > 0.0 and np.all(rod.edges[1:-1] > 0.0)  # the outer ones are rigid pieces


def test_unknown_name_lists_the_known():
    with pytest.raises(ValueError, match="bearing_friction"):
        explain("bearing_fiction")


def test_sizes_scale_with_the_cable(bench):
    """f -> c f leaves shapes and multiplies forces: plausible sizes of forces and moments follow, lengths do not."""
    facts, _, _ = bench
    stiff = replace(facts, force_scale=1e3 * facts.force_scale, moment_scale=1e3 * facts.moment_scale)
    powers = {"N": 1, "N m": 1, "N m^2": 1, "N m/rad": 1, "N/m": 1, "N/s": 1, "m/N": -1}
    for cause in CATALOGUE:
        ratio = cause.plausible(stiff) / cause.plausible(facts)
        assert ratio == pytest.approx(1e3 ** powers.get(cause.unit, 0)), cause.name


def test_load_cell(bench):
    facts, _, before = bench
    force, clock = before.prediction.force, facts.clock
    assert np.allclose(made(bench, "force_offset", 0.1).force, force + 0.1)
    assert np.allclose(made(bench, "force_gain", 0.02).force, 1.02 * force)
    drifted = made(bench, "force_drift", 1e-3)
    assert np.allclose(drifted.samples[3], force[3] + 1e-3 * (clock[3] + facts.hold_times[3]))
    relaxed = made(bench, "relaxation", 0.1, 2)
    constant = BY_NAME["relaxation"].variants(facts)[2].at
    assert np.allclose(relaxed.samples[2], force[2] * (1.0 - 0.1 * (1.0 - np.exp(-facts.hold_times[2] / constant))))


def test_chord_follows_the_rig(bench):
    _, _, before = bench
    seen = before.prediction
    assert np.allclose(made(bench, "displacement_offset", 1e-4, 1).chord, seen.chord - 1e-4, atol=1e-12)
    pushed = made(bench, "displacement_offset", 1e-4, 0).chord - seen.chord
    assert pushed[0] == 0.0 and np.allclose(pushed[1:], -1e-4, atol=1e-12)
    yielding = made(bench, "rig_compliance", 1e-4)
    assert np.allclose(yielding.chord - seen.chord, 1e-4 * yielding.force, atol=1e-9)


def test_camera_moves_points_as_its_formula_says(bench):
    facts, _, before = bench
    seen = before.prediction
    for name, move in (
        ("lens_distortion", lambda p: p * (1.0 + 0.02 * np.sum(p**2, -1, keepdims=True) / facts.half_diagonal**2)),
        ("camera_tilt", lambda p: p / (1.0 + 0.1 * p[..., :1])),
        ("scale_error", lambda p: p / 1.02),
    ):
        amount = 0.1 if name == "camera_tilt" else 0.02
        there = made(bench, name, amount)
        for i in (0, 3):
            centre = facts.picture_centre[i]
            ends, points = (
                move(np.array(p) - centre)
                for p in ([[0.0, 0.0], [seen.chord[i], 0.0]], np.column_stack([seen.x[i], seen.y[i]]))
            )
            along = ends[1] - ends[0]
            assert there.chord[i] == pytest.approx(np.hypot(*along), rel=1e-12)
            cross = (along[0] * (points - ends[0])[:, 1] - along[1] * (points - ends[0])[:, 0]) / np.hypot(*along)
            assert np.allclose(there.y[i], cross, atol=1e-12)
            # directions are those of the moved curve, by differences along it
            slope = np.gradient(there.y[i], there.x[i], edge_order=2)
            assert np.allclose(np.tan(there.theta[i])[5:-5], slope[5:-5], atol=5e-4)


def test_friction_of_both_kinds_changes_sign_on_the_way_back(bench):
    """Loading needs more force than without friction, unloading less once the way back has made it slip."""
    _, _, before = bench
    for name in ("hysteresis", "bearing_friction"):
        amount = 0.3 * BY_NAME[name].plausible(bench[0])
        change = made(bench, name, amount).force - before.prediction.force
        assert np.all(change[1:4] > 0.0) and np.all(np.diff(change[3:]) < 0.0) and change[-1] < 0.0


def test_spot_leaves_the_cable_beside_it_as_it_was(bench):
    facts, model, _ = bench
    cause = BY_NAME["stiffness_varying"]
    index = next(i for i, v in enumerate(cause.variants(facts)) if v.width > 0.0 and v.at == 0.5)
    changed = cause.apply(model, -0.2, cause.variants(facts)[index], facts)
    profile = changed.bending.rod.section.profile
    assert profile[0] == pytest.approx(1.0, abs=1e-6) and profile.min() == pytest.approx(0.8, abs=1e-3)


def test_a_file_a_family():
    """The catalogue stays a set of small files: no file of causes above 300 lines."""
    folder = Path(__file__).parents[3] / "pipeline" / "diagnosis" / "causes"
    assert all(len(path.read_text().splitlines()) <= 300 for path in folder.glob("*.py"))


@pytest.mark.parametrize(("name", "amount"), [("stiffness_varying", -0.29), ("pre_curvature_varying", 1.4)])
def test_several_forms_that_add_up_to_one_spot_are_told_as_it(bench, name, amount):
    """0.6 of a spot and 0.4 of it again."""
    facts, model, _ = bench
    cause = BY_NAME[name]
    spot = replace(cause.variants(facts)[-1], at=0.405, width=0.06)
    parts = cause.apply(cause.apply(model, 0.6 * amount, spot, facts), 0.4 * amount, spot, facts)
    variant, size, stiffer = forms_between(model, parts)[0]
    assert variant.at == pytest.approx(0.405, abs=0.01)  # half a step of the search
    assert variant.width == pytest.approx(0.06, rel=0.13)
    assert size == pytest.approx(amount, rel=0.1)
    assert stiffer == pytest.approx(0.0, abs=0.01)
    assert forms_between(model, model) == []


@pytest.mark.parametrize("field", ["pre_curvature", "stiffness_profile"])
def test_a_splice_is_told_by_place_and_length(bench, field):
    """Between two soft borders of another shape than those of the form."""
    _, model, _ = bench
    at = np.concatenate(([0.0], np.cumsum(model.bending.rod.elements)))
    box = 0.5 * (np.tanh((at - 0.31) / 0.02) - np.tanh((at - 0.47) / 0.02))
    before = model.bending.rod.section.pre_curvature if field == "pre_curvature" else 1.0
    spliced = replace(model, bending=replace(model.bending, **{field: before + 0.5 * box}))
    found = {variant.label: (variant, size) for variant, size, _ in forms_between(model, spliced)}
    variant, size = found[PIECE]
    assert (variant.at, variant.width) == pytest.approx((0.39, 0.08), rel=0.13)  # half a step of the search
    # a pre-curvature counts from its mean, which a sixth of the cable raises by a sixth of the step
    assert size == pytest.approx(0.5 * (1.0 - 0.16 * (field == "pre_curvature")), rel=0.1)


@pytest.mark.parametrize("sines", [(0.06, 0.07), (-0.06, 0.07), (0.03, -0.1)])
@pytest.mark.parametrize(("way", "tolerance"), [("foreshortened", 1e-9), ("stretched", 2e-4)])
def test_a_tilt_in_any_direction_is_a_turn_before_a_pinhole(bench, sines, way, tolerance):
    """Against one rotation in space about an oblique axis: chord and distances between places are those it shows.

    Of the plane about the picture's middle, or of the camera where it stands, the middle then brought back.
    """
    facts, model, here = bench
    distance, cause = 0.4, BY_NAME["camera_tilt"]
    form = next(form for form in cause.variants(facts) if "width" in form.tuned)
    form = replace(form, width=distance**2 * (1.0 if way == "foreshortened" else -1.0))
    form = replace(form, at=np.arctan2(sines[1], sines[0]))
    model = cause.apply(model, np.hypot(*sines) / distance, form, facts)
    seen = run(model, facts).prediction
    axis = np.array([sines[1], -sines[0], 0.0])
    turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * np.arcsin(np.linalg.norm(sines)))
    stands = np.array([0.0, 0.0, distance if way == "stretched" else 0.0])
    back = np.array([0.0, 0.0, distance]) - stands
    for k, centre in enumerate(facts.picture_centre):
        flat = np.column_stack([here.prediction.x[k] - centre[0], here.prediction.y[k] - centre[1]])
        points = turn.apply(np.column_stack([flat, np.zeros(len(flat))]) + stands) + back
        middle = turn.apply(stands) + back
        true = distance * (points[:, :2] / points[:, 2:] - middle[:2] / middle[2])
        shown = np.column_stack([seen.x[k], seen.y[k]])
        # third powers of the tilt are left where the camera leans: the amount then is its tangent, not its sine
        assert pdist(shown) == pytest.approx(pdist(true), abs=tolerance * np.ptp(flat))

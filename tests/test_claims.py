"""What the README claims of the whole road, on specimens of another simulator and renderer: from folder to result.

The tolerances are the product's claims, not what happens to come out: midline 0.1 px, forces 1 %, f_EI 2 % after an
extension; where the README prints f_EI to 0.3 % and K0 to 0.001 1/m, three times that is left to other noise.
"""

import json

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pipeline.result import from_json, to_json
from pipeline.run import measure

pytestmark = pytest.mark.shared


@pytest.fixture(scope="session")
def benches(shared_data):
    """Results of the three specimens, measured once a worker."""
    return {name: measure(shared_data / "bench" / f"bench-{name}") for name in "abc"}


@pytest.fixture(scope="session")
def truths(shared_data):
    return {
        name: json.loads((shared_data / "bench" / f"bench-{name}" / "truth.json").read_text(encoding="utf-8"))
        for name in "abc"
    }


def stiffness(truth, kappa):
    """Tangent of the true law m = ei1 D + (ei0 - ei1) kc tanh(D / kc), D = kappa - K0."""
    return truth["ei1"] + (truth["ei0"] - truth["ei1"]) / np.cosh((kappa - truth["K0"]) / truth["kc"]) ** 2


def rms_relative(curve, truth):
    kappa = np.array(curve.kappa_per_m)[curve.supported]
    measured = np.array(curve.tangent_Nm2)[curve.supported]
    return np.sqrt(np.mean((measured / stiffness(truth, kappa) - 1.0) ** 2))


@pytest.mark.parametrize("name", ["a", "b", "c"])
def test_centerlines_follow_the_true_path(benches, truths, name):
    for photo, step in zip(benches[name].photos, truths[name]["steps"], strict=True):
        assert photo.status == "traced"
        inside = slice(10, -10)  # of 101 points: the visible interior
        traced = np.column_stack([photo.u_px, photo.v_px])
        # 200 traced points lie 10 px apart; between them the polyline is refined linearly, 0.02 px off at most
        fine = np.column_stack(
            [np.interp(np.linspace(0, 1, 20001), np.linspace(0, 1, len(traced)), c) for c in traced.T]
        )
        distance, _ = cKDTree(fine).query(np.array(step["px"])[inside])
        assert np.sqrt(np.mean(distance**2)) < 0.1  # px; what is promised of the visible interior


def test_both_ways_find_the_characteristic(benches, truths):
    result, truth = benches["a"], truths["a"]
    for curve in (result.inverse.curve, result.balance.curve):
        assert rms_relative(curve, truth) < 3.0 * 0.003
        kappa, tangent, std = (np.array(v) for v in (curve.kappa_per_m, curve.tangent_Nm2, curve.tangent_std_Nm2))
        covered = np.abs(tangent - stiffness(truth, kappa)) < 1.96 * std
        # one curve counts for about three independent points: with one of them outside two thirds would be left
        assert np.mean(covered[curve.supported]) > 0.8
    assert result.agreement.compatible
    low, high = result.inverse.supported_per_m
    reached = max(max(step["kappa"]) for step in truth["steps"])
    assert truth["K0"] - 0.1 < low < high < 1.02 * reached  # only what was visited


def test_pre_curvature_and_forces(benches, truths):
    result, truth = benches["a"], truths["a"]
    for value, std in result.agreement.pre_curvature.values():
        assert abs(value - truth["K0"]) < max(3.0 * 0.001, 4.0 * std)
    for part in (result.inverse, result.balance):
        assert part.pre_curvature_per_m == pytest.approx(truth["K0"], abs=3.0 * 0.001)
    largest = max(step["F"] for step in truth["steps"])
    for step, true in zip(result.steps, truth["steps"], strict=True):
        # promised is 1 %, of what is true and of what the noisy log says
        assert step.force_fit_N == pytest.approx(true["F"], abs=0.01 * largest)
        assert step.force_fit_N == pytest.approx(step.force_N, rel=0.01) or step.branch == "mounted"


def test_nothing_is_named_where_nothing_is_hidden(benches):
    assert benches["a"].diagnosis.verdict == "adequate"
    assert benches["a"].diagnosis.causes == []


@pytest.mark.parametrize(
    ("name", "cause"), [("b", "hysteresis"), ("c", "pre_curvature_varying")], ids=["bench-b", "bench-c"]
)
def test_the_hidden_effect_is_found_and_the_characteristic_mended(benches, truths, name, cause):
    diagnosis = benches[name].diagnosis
    assert [c.name for c in diagnosis.causes] == [cause]
    assert diagnosis.gain.heldout_excess_removed > 0.9
    assert rms_relative(diagnosis.extended, truths[name]) < 0.02  # promised after an extension


@pytest.mark.parametrize("name", ["b", "c"])
def test_misfit_beyond_noise_is_said_and_held_by_the_bands(benches, name):
    """Both ways give a curve all the same; what the base model cannot follow counts as noise of what it read."""
    result = benches[name]
    assert {"identify/misfit-shape", "identify/misfit-force"} & {f.code for f in result.findings}
    assert result.balance.curve is not None
    plain, spoiled = (r.inverse.curve for r in (benches["a"], result))
    # the same rig, noise and steps: a band that ignored a misfit of many standard deviations would be as narrow
    assert np.median(spoiled.tangent_std_Nm2) > 3.0 * np.median(plain.tangent_std_Nm2)


def test_a_result_survives_its_file(benches):
    for result in benches.values():
        assert from_json(to_json(result)) == result

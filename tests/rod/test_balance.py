"""The balance way against truth from quadrature and from solve_bvp; nothing of the project's solvers takes part."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from rod.balance import BalanceOutcome, balance, moment_regression
from rod.balance.moment_points import CommonErrors, _between, moment_points, pointwise_graph, residual
from rod.compliance_law import moment_basis
from rod.measurement import MeasuredTest
from rod.midline import midline
from tests.rod.virtual_cable import Fading, StickSlip, bent_by_bvp, equilibrium, force_free
from tests.rod.virtual_photo import Camera, bending_test, moved_axes, parted_axes, record, scaled, stretched

LENGTH = 0.2
LAW = StickSlip(5e-3, 1.5e-3, 4.0, 2.0)
CHORDS = force_free(LAW, LENGTH).chord - np.array([5e-3, 10e-3, 15e-3])
SHARP = Camera(section_px=1e-3, axis_px=1e-3, scale=1e-6, length=1e-9)


def measured(seed=1, law=LAW, chords=CHORDS, **kind):
    return bending_test(law, LENGTH, chords, np.random.default_rng(seed), **kind)[0]


def law_of(test, **kind):
    return balance(test, **kind).law


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_sharp_photos_give_the_law_back(seed):
    graph = law_of(measured(seed=seed, camera=SHARP, force_noise=1e-6))
    # positions are known to 1e-6 of the length here, a hundredth of what good photos know
    off = graph.tangent / LAW.tangent(graph.kappa) - 1
    assert np.sqrt(np.mean(off**2)) < 2e-3
    assert np.all(np.abs(off) < 3 * graph.tangent_std / graph.tangent)
    error = graph.moment - LAW.moment(graph.kappa)
    assert np.all(np.abs(error) < 2e-4 * graph.moment.max())
    assert np.sqrt(np.mean(error**2)) < 1e-4 * graph.moment.max()
    assert np.all(np.abs(error[1:]) < 3 * graph.moment_std[1:])
    assert graph.pre_curvature == pytest.approx(LAW.K0, abs=2e-3)


@pytest.mark.parametrize(("longer", "stiffer"), [(1.0, 2.0**-10), (2.0**-10, 1.0), (256.0, 256.0)])
def test_result_scales_with_length_and_stiffness(longer, stiffer):
    """Numbers have units: the same photos and forces in others, by powers of two, which round as the first did."""
    test = measured()
    found, unit = balance(scaled(test, longer, stiffer)), balance(test)
    for name, size in (("tangent", stiffer), ("moment", stiffer / longer), ("kappa", 1.0 / longer)):
        assert getattr(found.law, name) == pytest.approx(size * getattr(unit.law, name), rel=1e-6)
    for name, size in (("tangent_std", stiffer), ("moment_std", stiffer / longer), ("secant_std", stiffer)):
        assert getattr(found.law, name) == pytest.approx(size * getattr(unit.law, name), rel=1e-5)
    assert longer * found.law.pre_curvature == pytest.approx(unit.law.pre_curvature, rel=1e-7)
    assert found.checks == pytest.approx(unit.checks, rel=1e-4)


def test_secant_and_tangent_are_readings_of_one_moment_curve(monkeypatch):
    monkeypatch.setattr("rod.balance.graph.POINTS", 241)
    graph = law_of(measured())
    K0 = graph.pre_curvature
    away = graph.kappa - K0 > 0.5
    assert np.allclose(graph.secant[away], graph.moment[away] / (graph.kappa[away] - K0), rtol=1e-12)
    slope = np.gradient(graph.moment, graph.kappa)[1:-1]
    assert np.allclose(slope, graph.tangent[1:-1], rtol=1e-3)  # central differences over 241 points
    assert graph.secant[0] == pytest.approx(graph.tangent[0], rel=1e-9)  # the limit, where the moment is zero


def test_constant_stiffness_is_found_constant():
    graph = law_of(measured(law=replace(LAW, EI1=LAW.EI0)))
    assert np.all(np.abs(graph.tangent / LAW.EI0 - 1) < 0.02)


def test_band_is_true_to_the_gains():
    """A single error of known size moves the estimate as its gain says."""
    test = measured()
    graph = law_of(test)
    k, step = 2, test.steps[2]
    pushed = replace(step, force=step.force + step.force_std)
    moved = law_of(replace(test, steps=(*test.steps[:k], pushed, *test.steps[k + 1 :])))
    told = graph.gains["force", step.step][:, 0]
    seen = np.log(np.interp(graph.kappa, moved.kappa, moved.tangent) / graph.tangent)
    inner = slice(3, -3)
    # A gain holds the abscissa and the derivatives, which answer to the data too: a third of a fifth of the band.
    assert np.all(np.abs(seen - told)[inner] < 0.07 * (graph.tangent_std / graph.tangent)[inner])
    assert np.max(np.abs(told) * graph.tangent / graph.tangent_std) > 0.15


def test_common_errors_move_the_estimate_as_told():
    """On all photos: a scale wrong by 0.1 %, each axis by its standard deviation of 50 um, covers above the cable."""
    steps = tuple(replace(step, picture_centre=(0.1, 0.05)) for step in measured().steps)
    test = replace(measured(), steps=steps, axis_std=5e-5, axis_parallax_std=2e-3, camera_foot_std=0.025)
    graph = law_of(test)
    left, right, foot, parallax = (
        graph.gains[source, -1][:, 0] for source in ("left_across", "right_across", "foot_across", "parallax")
    )
    cases = [
        (moved_axes(test, 5e-5, 5e-5), foot),
        (parted_axes(test, 1e-3, (0.1, 0.05)), 0.5 * parallax),
        (stretched(test, 1.001), graph.gains["scale", -1][:, 0] * -1e-3 / test.scale_std),
        (moved_axes(test, 5e-5, 0.0), left),
        (moved_axes(test, 0.0, 5e-5), right),
    ]
    for moved, told in cases:
        found = law_of(moved)
        seen = np.log(np.interp(graph.kappa, found.kappa, found.tangent) / graph.tangent)
        # the sizes of the priors answer too: within a twentieth of the band
        assert np.all(np.abs(seen - told)[3:-3] < 0.05 * (graph.tangent_std / graph.tangent)[3:-3])
    # Where all moments are small the lift of an axis counts most.
    assert np.argmax(np.abs(left)) == 0
    far = graph.kappa > graph.kappa[0] + 0.25 * np.ptp(graph.kappa)
    assert np.abs(left[0]) > 3 * np.abs(left[far]).max()


def test_derivatives_of_a_photo_are_those_of_differences():
    """Without noise the weights stay as they are: only the midlines' rounding is left."""
    steps = tuple(replace(step, picture_centre=(0.08, 0.01)) for step in measured().steps)
    data = moment_points(replace(measured(), steps=steps))[2]
    basis = moment_basis(0.0, float(data.moment.max()), unit=1.0 / LAW.EI0)
    rng = np.random.default_rng(3)
    u = np.r_[0.1 * rng.standard_normal(basis.size), 2.0, 1e-3, 1e-4 * rng.standard_normal(6), 1e-3]

    def at(u):
        errors = CommonErrors(*u[basis.size + 1 :])
        return residual(data, basis.law(u[: basis.size]), u[basis.size], varying=0.0, errors=errors, blur=0.0)

    told, sizes = at(u).jacobian, np.r_[np.full(basis.size + 1, 1e-4), np.full(8, 1e-6)]
    for place, size in enumerate(sizes):
        h = size * np.eye(u.size)[place]
        slope = (at(u + h).value - at(u - h).value) / (2.0 * size)
        assert told[:, place] == pytest.approx(slope, abs=1e-5 * np.abs(slope).max() + 1e-3), place


def test_a_smooth_law_falls_short_by_nothing():
    """A constant stiffness is what the prior expects; between straight line and bent law it takes a part."""
    graph = law_of(measured())
    assert np.allclose(graph.shortfall.sum(axis=1), 0.0, atol=1e-6)  # rounding of large third derivatives
    t = (graph.kappa - graph.kappa[0]) / np.ptp(graph.kappa)
    assert np.abs(graph.shortfall @ t).max() < 0.1 * np.abs(graph.shortfall @ np.sin(9 * t)).max()


def test_pre_curvature_without_a_force_free_photo():
    """What the moments leave open at rest is filled by laws that are flat there, and the band says how much that is."""
    errors = [law_of(measured(seed=seed, mounted=False)) for seed in range(6)]
    z = [(graph.pre_curvature - LAW.K0) / graph.pre_curvature_std for graph in errors]
    # Six draws of a standard normal: their rms is above 1.6 once in 200 times.
    assert np.sqrt(np.mean(np.square(z))) < 1.6
    assert np.median([graph.pre_curvature_std for graph in errors]) < 0.1


@pytest.mark.parametrize("law", [StickSlip(2.5e-3, 5e-3, 4.0, 2.0), Fading(2.5e-3, 5e-3, 4.0, 2.0)])
def test_pre_curvature_of_cables_that_stiffen_without_a_force_free_photo(law):
    """Flat at rest or steepest there, which no photo of a bent cable tells apart: the band holds both."""
    chords = force_free(law, LENGTH).chord - np.array([5e-3, 10e-3, 15e-3])
    graphs = [law_of(measured(seed, law, chords, mounted=False)) for seed in range(6)]
    z = [(graph.pre_curvature - law.K0) / graph.pre_curvature_std for graph in graphs]
    # as above; with laws smooth along the moment alone the steep one is at 3.2
    assert np.sqrt(np.mean(np.square(z))) < 1.6
    assert np.median([graph.pre_curvature_std for graph in graphs]) < 0.1


def test_checks_are_quiet_on_a_uniform_cable():
    checks = balance(measured(seed=4)).checks
    assert abs(checks["left_right_z"]) < 3.5
    assert checks["photos_p"] > 1e-3
    assert checks["uniform_p"] > 1e-3
    # standard deviation of chi2 per degree of freedom is sqrt(2/60) here
    assert checks["chi2"] / checks["degrees_of_freedom"] == pytest.approx(1.0, abs=0.6)


def test_one_wrong_force_shows_photo_against_photo():
    test = measured()
    step = test.steps[2]
    wrong = replace(step, force=1.05 * step.force)
    assert balance(replace(test, steps=(*test.steps[:2], wrong, *test.steps[3:]))).checks["photos_p"] < 1e-6


def test_noise_within_which_no_curve_is_found_is_given_up_soon(monkeypatch):
    """Forces halved in mid-test: each photo was linearised 186 times until the noise was large enough."""
    counted = []
    monkeypatch.setattr(moment_regression, "residual", lambda *a, **k: counted.append(0) or residual(*a, **k))
    steps = measured().steps
    graph = balance(replace(measured(), steps=(*steps[:2], *(replace(s, force=0.5 * s.force) for s in steps[2:]))))
    assert graph.outcome is BalanceOutcome.MEASURED and graph.checks["noise_factor"] > 100.0
    assert len(counted) < 100 * len(steps)


def test_what_forces_have_in_common_moves_the_law_as_each_of_them_would():
    test, errors = measured(), {1: 1e-3, 3: 2e-3}
    steps = tuple(replace(s, force=1.2 * s.force) if s.step == 2 else s for s in test.steps)
    for given in (test, replace(test, steps=steps)):  # in spite of what contradicts the others, too
        graph = balance(replace(given, common_force_errors=(errors,)))
        assert (graph.checks["noise_factor"] > 1.0) == (given is not test)
        std = graph.checks["noise_factor"] * np.array([test.steps[k].force_std for k in errors])
        each = np.array([graph.law.gains["force", k][:, 0] * error for k, error in errors.items()])
        assert graph.law.gains["common_force", -1][:, 0] == pytest.approx((each / std[:, None]).sum(axis=0))


@pytest.mark.parametrize("mounted", [True, False])
def test_pre_curvature_growing_along_the_cable(mounted):
    """Truth by solve_bvp. With a force-free photo the law comes back; without one the halves disagree, and it shows.

    Of five draws every one must show the profile; f_EI is off by 0.6 % in the median of draws, by 3 % in one of 16.
    """
    rest = force_free(LAW, LENGTH)
    truth = [bent_by_bvp(LAW, LENGTH, chord, bow=lambda s: 0.8 * (2 * s / LENGTH - 1)) for chord in CHORDS]
    shapes = ([bent_by_bvp(LAW, LENGTH, None, bow=lambda s: 0.8 * (2 * s / LENGTH - 1))] if mounted else []) + truth
    graphs = [balance(record(shapes, rest.chord, np.random.default_rng(seed))[0]) for seed in range(5, 10)]
    if not mounted:
        assert min(abs(graph.checks["left_right_z"]) for graph in graphs) > 6
    else:
        assert max(graph.checks["uniform_at_rest_p"] for graph in graphs) < 1e-6
        assert [graph.varying[0] for graph in graphs] == pytest.approx(5 * [0.8], abs=0.05)
        off = [np.sqrt(np.mean((graph.law.tangent / LAW.tangent(graph.law.kappa) - 1) ** 2)) for graph in graphs]
        assert np.median(off) < 0.01


def test_bvp_and_quadrature_agree():
    """The two sources of truth of these tests, held against each other."""
    one, two = equilibrium(LAW, LENGTH, CHORDS[1]), bent_by_bvp(LAW, LENGTH, CHORDS[1], bow=np.zeros_like)
    assert two.force == pytest.approx(one.force, rel=1e-6)
    assert np.allclose(two.at(one.s)[3], one.kappa, rtol=1e-5)


def test_pointwise_graph_is_exact_on_an_exact_shape():
    step = measured(camera=Camera(section_px=1e-9, axis_px=1e-9, scale=0.0), force_noise=1e-9).steps[2]
    kappa, ratio = pointwise_graph(step)
    good = np.isfinite(ratio) & (kappa > 2.5) & (kappa < 0.9 * kappa.max())
    assert good.sum() > 30
    assert np.allclose(ratio[good], LAW.tangent(kappa[good]), rtol=1e-3)  # differences between neighbouring points


def test_pointwise_graph_needs_a_photo():
    with pytest.raises(ValueError, match="no photo"):
        pointwise_graph(replace(measured().steps[1], shape=None))


def test_without_loaded_photo_the_outcome_says_so():
    test = measured()
    only = MeasuredTest(test.length, test.length_std, test.scale_std, test.steps[:1])
    graph = balance(only)
    assert graph.outcome is BalanceOutcome.NO_PHOTO
    assert "photo" in graph.outcome.value
    assert graph.outcome is not BalanceOutcome.MEASURED
    assert graph.law is None


def test_tension_counted_as_compression_is_refused():
    test = measured()
    flipped = tuple(replace(step, force=-step.force) for step in test.steps)
    assert balance(replace(test, steps=flipped)).outcome is BalanceOutcome.NO_MOMENT


def test_mounted_step_is_force_free_whatever_the_load_cell_reads():
    test = measured()
    off = (replace(test.steps[0], force=0.3), *test.steps[1:])
    assert np.array_equal(law_of(replace(test, steps=off)).tangent, law_of(test).tangent)


def test_more_blocks_of_a_photo_change_nothing_beyond_the_band(monkeypatch):
    test = measured()
    one = law_of(test)
    monkeypatch.setattr("rod.balance.moment_points.midline", partial(midline, blocks=192))
    two = law_of(test)
    assert max(p.photo.s.size for p in moment_points(test)) >= 192
    assert np.all(np.abs(np.interp(one.kappa, two.kappa, two.tangent) - one.tangent) < 0.5 * one.tangent_std)


def test_points_are_where_they_were_measured_wherever_the_smooth_curve_begins():
    """A smooth curve that lies beside the cable by a tenth of a millimetre is only what positions are counted from."""
    camera = Camera(cover=0.0)
    shape = next(step.shape for step in measured(camera=camera).steps if step.branch == "loading")
    beside = 1e-4 * np.array([-np.sin(shape.theta[0]), np.cos(shape.theta[0])])
    moved = replace(shape, x=shape.x + beside[0], y=shape.y + beside[1])
    one, two = (
        moment_points(replace(test, steps=(replace(test.steps[1], shape=given),)))[0]
        for test in (measured(camera=camera),)
        for given in (shape, moved)
    )
    assert np.abs(one.offset - two.offset)[:-1].max() < 1e-6


def test_what_lies_between_two_nodes_is_interpolated() -> None:
    nodes, values, s = np.array([0.0, 0.03, 0.05, 0.2]), np.array([1.0, -2.0, 4.0, 3.0]), np.linspace(-0.05, 0.25, 61)
    assert _between(s, nodes) @ values == pytest.approx(np.interp(s, nodes, values), abs=1e-12)

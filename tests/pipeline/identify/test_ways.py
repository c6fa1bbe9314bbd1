"""Both ways side by side on a test with known truth: comparison, branches, parts of the result, findings."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.faults import Faults
from pipeline.identify import identification_parts, identify, identify_test
from pipeline.identify.agreement import difference_covariance, log_curve, rest_curvature
from pipeline.identify.findings import chord_findings, force_findings, pre_curvature_sources
from pipeline.result import Result, SpecimenPart, from_json, to_json
from rod.inverse import InverseOutcome


def with_steps(test, change):
    return replace(test, steps=tuple(change(step) for step in test.steps))


def codes(findings):
    return {finding.code for finding in findings}


def test_nothing_is_found_where_nothing_is_wrong(found):
    assert found.findings == ()
    assert found.agreement.compatible
    assert found.agreement.hints == ()


def test_three_sources_of_pre_curvature_agree_with_the_truth(found, law):
    sources = pre_curvature_sources(found)
    assert set(sources) == {"photo", "balance", "inverse"}
    for value, std in sources.values():
        assert abs(value - law.K0) < 4 * std
    # sections to 5 um over 0.2 m tell a curvature to 0.0003 1/m if independent, and these are alike over a millimetre
    assert sources["photo"][1] < 0.001


def test_both_ways_are_compared_on_the_range_both_visited(found):
    low, high = found.agreement.range_per_m
    assert low == pytest.approx(max(found.inverse.law.kappa[0], found.balance.law.kappa[0]))
    assert high == pytest.approx(min(found.inverse.law.kappa[-1], found.balance.law.kappa[-1]))
    assert 0 < found.agreement.rms_relative <= found.agreement.max_relative


def test_errors_of_the_data_and_of_the_form_add_up_to_the_band(found):
    """What the comparison sends through a way is all that its band holds, away from the ends of the range."""
    way = found.inverse
    noise = sum(gain @ gain.T for gain in way.law.gains.values())
    short = way.law.shortfall @ way.law_forms
    ratio = np.sqrt(np.diag(noise + short @ short.T) / np.diag(way.law.log_covariance))
    # The band averages over the prior's sizes, of which the sum takes one: that counts near K0, where the band is
    # mostly prior. What the midline knows beyond the smooth curve is missing: a sixth.
    assert np.all((ratio[15:-1] > 0.75) & (ratio[15:-1] < 1.3))


def test_what_both_ways_share_cancels_in_their_difference(found):
    one, two = found.inverse.law, found.balance.law
    grid = log_curve(one).common_grid(log_curve(two))
    no_form = tuple(np.zeros((law.kappa.size, 1)) for law in (one, two))

    def variances(first, second):
        return np.diag(difference_covariance(first, second, no_form, grid))

    apart = variances(one, replace(two, gains={})) + variances(replace(one, gains={}), two)
    # Near the rest curvature the ways weigh the photos differently; in the other two thirds most is common.
    assert np.all(variances(one, two)[1:] < 0.5 * apart[1:])


def test_a_second_measurement_of_the_force_scale_is_no_disagreement(measured, settings):
    """Forces are common to both ways: wrong by 10 % throughout they do not make them differ."""
    wrong = with_steps(measured, lambda s: replace(s, force=1.1 * s.force))
    assert identify_test(wrong, settings).agreement.compatible


def test_curvature_wrong_in_the_smooth_curve_alone_is_a_disagreement(measured, settings):
    """Only the balance way reads the curvature; the inverse way reads the raw midline."""

    def stiffer(step):
        kappa = 2.0 + 0.93 * (step.shape.kappa - 2.0)
        return replace(step, shape=replace(step.shape, kappa=kappa))

    result = identify_test(with_steps(measured, stiffer), settings)
    assert not result.agreement.compatible
    assert len(result.agreement.hints) >= 3
    assert "identify/agreement" in codes(result.findings)


def test_branches_are_fitted_apart_and_together(found, law):
    assert set(found.branches) == {"loading", "unloading"}
    assert {step.branch for step in found.branches["loading"].test.steps} == {"mounted", "loading"}
    assert {step.branch for step in found.branches["unloading"].test.steps} == {"unloading"}
    assert found.branches_p > 1e-3
    assert {step.branch for step in found.inverse.test.steps} == {"mounted", "loading", "unloading"}


def test_branches_that_differ_are_named(measured, settings):
    lower = with_steps(measured, lambda s: replace(s, force=0.8 * s.force) if s.branch == "unloading" else s)
    result = identify_test(lower, settings)
    assert result.branches_p < 1e-6
    assert "identify/branches" in codes(result.findings)


def test_no_branches_without_unloading(measured, settings):
    forth = replace(measured, steps=tuple(s for s in measured.steps if s.branch != "unloading"))
    result = identify_test(forth, settings)
    assert result.branches == {}
    assert result.branches_p is None


def test_photo_of_the_force_free_cable_gives_its_curvature(measured, law):
    value, std = rest_curvature(measured)
    assert abs(value - law.K0) < 4 * std
    assert rest_curvature(replace(measured, steps=measured.steps[1:])) is None


def test_chord_against_displacement(measured, settings):
    assert list(chord_findings(measured, settings)) == []
    short = with_steps(measured, lambda s: replace(s, displacement=1.02 * s.displacement))
    (finding,) = chord_findings(short, settings)
    assert finding.code == "identify/chord-displacement"
    assert "97.9 %" in finding.message or "98.0 %" in finding.message  # 1 / 1.02 but for the photos' noise


def test_photos_in_reverse_order_are_asked_about(measured, settings):
    back = with_steps(measured, lambda s: replace(s, displacement=0.016 - s.displacement))
    (finding,) = chord_findings(back, settings)
    assert finding.message.endswith("the log pushes them together: is their order reversed?")


def test_one_displacement_for_all_steps_is_told(measured, settings):
    still = with_steps(measured, lambda s: replace(s, displacement=0.01))
    (finding,) = chord_findings(still, settings)
    assert finding.message.endswith("but the log has one displacement for all steps")


def test_wrong_zero_of_displacement_leaves_the_result_alone(measured, settings, found):
    moved = with_steps(measured, lambda s: replace(s, displacement=s.displacement + 1e-3))
    assert np.allclose(identify_test(moved, settings).inverse.law.tangent, found.inverse.law.tangent, rtol=1e-9)


def test_what_is_at_fault_is_left_out_of_both_ways(measured, settings, law):
    wrong = with_steps(measured, lambda s: replace(s, force=1.25 * s.force) if s.step == 3 else s)
    spoiled = identify_test(wrong, settings)
    again = identify(Faults(wrong, forces=frozenset({3})), {}, settings)
    for way in (again.inverse.law, again.balance.law):
        truth = law.tangent(way.kappa)
        # what is left is the noise of the data; with the force a quarter too high it is 5 % or more
        assert np.sqrt(np.mean((way.tangent / truth - 1.0) ** 2)) < 0.02
    assert again.test is wrong, "what was measured stays in the result"
    assert "identify/misfit-force" in codes(spoiled.findings)
    assert "identify/misfit-force" not in codes(again.findings)


def test_a_load_cell_off_zero_is_told(measured):
    off = with_steps(measured, lambda s: replace(s, force=s.force + 20 * s.force_std))
    assert codes(force_findings(off)) == {"identify/force-zero"}


def test_tension_ends_in_outcomes_not_in_a_crash(measured, settings):
    result = identify_test(with_steps(measured, lambda s: replace(s, force=-s.force)), settings)
    assert {"identify/balance-no-moment", "identify/inverse-opposite-forces"} <= codes(result.findings)
    identification_parts(result)


def test_without_photos_both_ways_say_what_to_do(measured, settings):
    blind = with_steps(measured, lambda s: replace(s, shape=None, chord=None, chord_std=None))
    result = identify_test(blind, settings)
    assert result.inverse.outcome is InverseOutcome.NO_DATA
    assert {"identify/inverse-no-data", "identify/balance-no-photo"} <= codes(result.findings)
    parts = identification_parts(result)
    assert not parts.inverse.converged
    assert parts.inverse.curve is None
    assert parts.agreement.compatible is None
    assert len(parts.steps) == len(measured.steps)


def test_parts_survive_the_way_through_json(found, measured):
    parts = identification_parts(found)
    result = Result(
        status="measured",
        specimen=SpecimenPart(id="x", length_m=0.2, diameter_m=4e-3, folder="x", moving_bearing="left"),
        steps=parts.steps,
        inverse=parts.inverse,
        balance=parts.balance,
        agreement=parts.agreement,
    )
    assert from_json(to_json(result)) == result
    assert [s.force_N for s in parts.steps] == [s.force for s in measured.steps]
    assert parts.steps[0].force_fit_N == 0.0


def test_factor_of_the_band_gives_the_band(found):
    curve = identification_parts(found).inverse.curve
    factor = np.array(curve.tangent_factor_Nm2)
    assert np.allclose(np.sqrt((factor**2).sum(axis=1)), curve.tangent_std_Nm2, rtol=2e-3)


def test_residual_figures_are_those_of_the_noise(found, measured):
    misfit = identification_parts(found).inverse.misfit
    # Sections: 0.05 px at 11 px/mm, and a block mean of two correlation lengths keeps about two thirds of it.
    assert 2e-6 < misfit.shape_rmse_m < 5e-6
    assert misfit.force_rmse_N < 3 * max(s.force_std for s in measured.steps)
    assert misfit.chi2 == pytest.approx(misfit.degrees_of_freedom, abs=3.0 * np.sqrt(2.0 * misfit.degrees_of_freedom))


def test_photo_residuals_stand_at_the_points_of_the_centerline(found, measured):
    photos = identification_parts(found).photos
    for step in measured.steps:
        residual = np.array(photos[step.step].shape_residual_m)
        seen = step.shape.seen
        assert residual.size == step.shape.s.size
        z = residual[seen] / np.array(photos[step.step].shape_residual_std_m)[seen]
        assert np.abs(z).max() < 4  # of 200 points, alike over a few millimetres
        fitted = np.array(photos[step.step].kappa_fit_per_m)
        assert np.abs(fitted - step.shape.kappa)[step.shape.s.size // 2] < 0.1  # 1 % of the largest


def test_errors_of_the_axes_are_neither_in_the_residuals_of_a_photo_nor_in_their_band(found, measured, settings):
    """Axes that are known ten times less well shift and turn the whole midline, which the residual leaves out."""
    axis = 3e-4

    def doubted(step):
        covariance = step.shape.covariance.copy()
        covariance[0, 0] += axis**2
        covariance[1, 1] += 2.0 * (axis / step.chord) ** 2
        shape = replace(step.shape, covariance=covariance)
        return replace(step, shape=shape, chord_std=float(np.hypot(step.chord_std, np.sqrt(2.0) * axis)))

    before = identification_parts(found).photos
    after = identification_parts(identify_test(with_steps(measured, doubted), settings)).photos
    for number, photo in after.items():
        seen = next(step.shape.seen for step in measured.steps if step.step == number)
        std, own = (np.array(one.shape_residual_std_m)[seen] for one in (photo, before[number]))
        assert np.median(std) < 1.5 * np.median(own) < 0.1 * axis


def test_an_error_that_forces_have_in_common_is_in_both_bands(found, measured, settings):
    errors = {s.step: 0.004 * s.force for s in measured.steps if s.step >= 3}
    doubted = identify_test(replace(measured, common_force_errors=(errors,)), settings)
    off = with_steps(measured, lambda s: replace(s, force=s.force + errors.get(s.step, 0.0)))
    moved = identify_test(off, settings)
    for way in ("inverse", "balance"):
        before, after, there = (getattr(one, way).law for one in (found, doubted, moved))
        assert after.tangent == pytest.approx(before.tangent, rel=1e-9)
        # truth: what both ways make of forces that are off by just that, to a fifth: the derivatives answer to it too
        shift = np.log(np.interp(before.kappa, there.kappa, there.tangent) / before.tangent)
        added = (after.tangent_std / after.tangent) ** 2 - (before.tangent_std / before.tangent) ** 2
        assert np.abs(np.sqrt(added) - np.abs(shift)).max() < 0.2 * np.abs(shift).max()
        assert after.gains["common_force", -1][:, 0] == pytest.approx(shift, abs=0.2 * np.abs(shift).max())
        assert np.all(after.moment_std[5:] > before.moment_std[5:])
    curve = identification_parts(doubted).inverse.curve
    assert np.linalg.norm(curve.tangent_factor_Nm2, axis=1) == pytest.approx(curve.tangent_std_Nm2, rel=1e-6)

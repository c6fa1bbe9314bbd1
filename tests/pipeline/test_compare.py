"""Comparison of two results: the same cable twice, changed cables, and what makes a comparison doubtful.

27 random cables, each measured and identified twice: the characteristic's p-value was below 0.05 for 2 and below 0.5
for 11, that of K0 for 2 and 17.
"""

import json
from dataclasses import replace
from html import escape

import numpy as np
import pytest
from click.testing import CliRunner

from pipeline.cli import main
from pipeline.compare import compare
from pipeline.report.frames import comparison_frame
from pipeline.result import FindingPart, to_json
from tests.pipeline.virtual_experiment import identified
from tests.rod.virtual_cable import StickSlip, equilibrium, force_free
from tests.rod.virtual_photo import record

LENGTH = 0.2
LAW = StickSlip(5e-3, 1.5e-3, 4.0, 2.0)


def measured(law, seed, name, *, push=(5e-3, 10e-3, 15e-3)):
    rest = force_free(law, LENGTH)
    shapes = [rest, *(equilibrium(law, LENGTH, rest.chord - d) for d in push)]
    test, _ = record(shapes, rest.chord, np.random.default_rng(seed))
    return identified(test, name=name)


@pytest.fixture(scope="module")
def before():
    return measured(LAW, 1, "before")


@pytest.fixture(scope="module")
def again():
    return measured(LAW, 2, "again")


@pytest.fixture(scope="module")
def stiffer():
    return measured(replace(LAW, EI0=1.05 * LAW.EI0, EI1=1.05 * LAW.EI1), 3, "after")


def shifted(result, factor=1.0, **change):
    """The same result with another stiffness throughout, or other fields of its curve."""
    curve = result.inverse.curve
    names = ("moment_Nm", "tangent_Nm2", "secant_Nm2")
    scaled = {name: [factor * v for v in getattr(curve, name)] for name in names} | change
    part = result.inverse.model_copy(update={"curve": curve.model_copy(update=scaled)})
    return result.model_copy(update={"inverse": part})


def drawn(result, rng):
    """A result whose curve errs by its own covariance."""
    curve = result.inverse.curve
    factor = np.array(curve.tangent_factor_Nm2)
    tangent = np.array(curve.tangent_Nm2) + factor @ rng.standard_normal(factor.shape[1])
    part = result.inverse
    K0 = part.pre_curvature_per_m + part.pre_curvature_std_per_m * rng.standard_normal()
    part = part.model_copy(update={"curve": curve.model_copy(update={"tangent_Nm2": tangent.tolist()})})
    return result.model_copy(update={"inverse": part.model_copy(update={"pre_curvature_per_m": K0})})


def test_the_same_cable_measured_twice(before, again):
    comparison = compare(before, again)
    assert comparison.verdict == "no difference seen"
    assert comparison.p_characteristic > 0.025
    assert 0.0 < comparison.rms_relative <= comparison.max_relative
    assert np.all(np.abs(comparison.ratio - 1.0) < 4 * comparison.ratio_std)


def test_errors_by_the_covariance_are_called_a_difference_as_often_as_told(before):
    rng = np.random.default_rng(5)
    pairs = [compare(drawn(before, rng), drawn(before, rng)) for _ in range(200)]
    # Level 5 % for both tests together: 10 of 200, standard deviation 3.1; doubling p gives a little away.
    assert 1 <= sum(pair.verdict == "differ" for pair in pairs) <= 20
    p = np.array([pair.p_characteristic for pair in pairs])
    assert abs(np.mean(p < 0.5) - 0.5) < 0.12  # three and a half standard deviations


def test_a_cable_stiffer_by_a_twentieth_is_told(before, stiffer):
    comparison = compare(before, stiffer)
    assert comparison.verdict == "differ"
    assert "the bending stiffness characteristic" in comparison.statement
    assert "after is stiffer" in comparison.statement
    mean = comparison.mean_stiffness
    assert abs(mean.difference / mean.a - 0.05) < 4 * mean.std / mean.a
    assert compare(stiffer, before).mean_stiffness.difference == pytest.approx(-mean.difference)


def test_another_pre_curvature_is_told(before):
    part = before.inverse
    bent = part.model_copy(update={"pre_curvature_per_m": part.pre_curvature_per_m + 8 * part.pre_curvature_std_per_m})
    comparison = compare(before, before.model_copy(update={"inverse": bent}))
    assert comparison.verdict == "differ"
    assert "pre-curvature" in comparison.statement
    assert "characteristic (p" not in comparison.statement
    assert comparison.p_characteristic == pytest.approx(1.0)


def test_only_what_both_visited_is_compared(before):
    short = measured(LAW, 4, "short", push=(2e-3, 4e-3, 6e-3))
    comparison = compare(before, short)
    low, high = comparison.range_per_m
    assert high == pytest.approx(min(r.inverse.curve.kappa_per_m[-1] for r in (before, short)))
    assert low == pytest.approx(max(r.inverse.curve.kappa_per_m[0] for r in (before, short)))
    far = shifted(before, kappa_per_m=[k + 50.0 for k in before.inverse.curve.kappa_per_m])
    nothing = compare(before, far)
    assert nothing.verdict == "not comparable"
    assert "No curvature was visited by both" in nothing.statement
    assert nothing.range_per_m is None


def test_nothing_to_compare(before):
    comparison = compare(before, before.model_copy(update={"inverse": None}))
    assert comparison.verdict == "not comparable"
    assert "No characteristic was measured on before" in comparison.statement


def test_without_a_covariance_along_the_curve_nothing_is_tested(before):
    comparison = compare(before, shifted(before, 1.1, tangent_factor_Nm2=[]))
    assert comparison.verdict == "not comparable"
    assert comparison.p_characteristic is None
    assert comparison.max_relative == pytest.approx(0.1)


def codes(comparison):
    return [finding.code for finding in comparison.findings]


def test_one_scale_for_both_and_two_scales(before):
    assert codes(compare(before, before)) == ["compare/scale-shared"]
    board = before.scale.model_copy(update={"source": "board", "std_relative": 0.005})
    other = shifted(before, 1.02).model_copy(update={"scale": board})
    (finding,) = compare(before, other).findings
    assert (finding.code, finding.level) == ("compare/scale", "warning")
    assert "scales 0.99 % apart" in finding.message


def test_doubts(before):
    long = before.specimen.model_copy(update={"length_m": 1.3 * LENGTH})
    assert "compare/length" in codes(compare(before, before.model_copy(update={"specimen": long})))
    for code, level in (("identify/scale", "warning"), ("force/factor", "error")):
        doubt = FindingPart(code=code, level=level, message="The scale is off by 2 %.")
        (_, finding) = compare(before, before.model_copy(update={"findings": [doubt]})).findings
        assert finding.code == "compare/doubt"
        assert "The scale is off by 2 %." in finding.message
    curve = before.inverse.curve
    few = [k < curve.kappa_per_m[0] + 1.0 for k in curve.kappa_per_m]
    assert "compare/range" in codes(compare(before, shifted(before, supported=few)))


def test_it_shows_itself_in_a_notebook(before, stiffer):
    comparison = compare(before, stiffer)
    assert f"<tr><th>differ</th><td>{escape(comparison.statement)}</td></tr>" in comparison._repr_html_()


def test_frame(before, stiffer):
    frame = comparison_frame(compare(before, stiffer))
    assert list(frame.columns) == ["kappa_per_m", "ratio", "ratio_std"]
    assert np.all(frame.ratio_std > 0.0)


def test_command(before, stiffer, tmp_path):
    for name, result in (("a", before), ("b", stiffer)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "result.json").write_text(to_json(result), encoding="utf-8")

    def call(*arguments):
        return CliRunner().invoke(main, ["compare", *(str(argument) for argument in arguments)])

    done = call(tmp_path / "a", tmp_path / "b/result.json", "-o", tmp_path / "ratio.csv")
    assert done.exit_code == 0
    assert done.stdout.startswith("before and after differ beyond their bands")
    assert (tmp_path / "ratio.csv").read_text().startswith("kappa_per_m,ratio,ratio_std")
    document = json.loads(call(tmp_path / "a", tmp_path / "b", "--json").stdout)
    assert document["verdict"] == "differ"
    assert len(document["ratio"]) == len(document["kappa_per_m"])
    assert call(tmp_path / "a", tmp_path / "c").exit_code == 2

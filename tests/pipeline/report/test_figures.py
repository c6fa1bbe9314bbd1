"""Figures of mechanics where the data are unusual: nothing is cut off, and what is missing is not drawn."""

import pytest
from matplotlib.figure import Figure

from pipeline.report.canvas import style
from pipeline.report.evidence import mechanics_figures
from pipeline.report.figures import draw_moment, draw_pointwise, stiffness_unit
from pipeline.report.words import Words


def test_a_stiffness_below_zero_stays_in_the_picture(full_result):
    """Balance equations of bad photos may leave a negative tangent: the limits are in the unit of the axis."""
    curve = full_result.balance.curve
    lowest = -0.5 * max(curve.tangent_Nm2)
    wild = curve.model_copy(update={"tangent_Nm2": [lowest, *curve.tangent_Nm2[1:]]})
    result = full_result.model_copy(
        update={"balance": full_result.balance.model_copy(update={"curve": wild}), "photos": []}
    )
    with style():
        axes = draw_pointwise(Figure(figsize=(6, 4), dpi=72), result, Words())
    assert axes.get_ylim()[0] == pytest.approx(stiffness_unit(result, Words()).factor * lowest)


def test_a_stray_point_of_a_photo_does_not_shrink_the_moment_curve(full_result):
    balance = full_result.balance
    stray = {"points_kappa_per_m": [*balance.points_kappa_per_m, 70.0]}
    stray |= {"points_moment_Nm": [*balance.points_moment_Nm, 0.0]}
    result = full_result.model_copy(update={"balance": balance.model_copy(update=stray)})
    with style():
        axes = draw_moment(Figure(figsize=(6, 4), dpi=72), result, Words())
    assert axes.get_xlim()[1] < 1.2 * full_result.inverse.curve.kappa_per_m[-1]


@pytest.mark.parametrize("unvisited", [("unloading",), ("loading", "unloading")], ids=" and ".join)
def test_branches_are_compared_where_both_bent_the_cable(full_result, unvisited):
    curve = full_result.inverse.curve
    none = curve.model_copy(update={"supported": [False] * len(curve.supported)})
    branches = {name: none if name in unvisited else curve for name in ("loading", "unloading")}
    inverse = full_result.inverse.model_copy(update={"branches": branches})
    result = full_result.model_copy(update={"inverse": inverse, "photos": []})
    assert "branches" not in mechanics_figures(result, Words())


def test_the_unit_is_that_of_the_answer(diagnosed):
    """Without its cause the inverse problem may end anywhere: a law set aside is no guide."""
    named = diagnosed("named")
    curve = named.inverse.curve
    wild = curve.model_copy(update={"tangent_Nm2": [1e3 * value for value in curve.tangent_Nm2]})
    result = named.model_copy(update={"inverse": named.inverse.model_copy(update={"curve": wild})})
    assert stiffness_unit(result, Words()) == stiffness_unit(named, Words())

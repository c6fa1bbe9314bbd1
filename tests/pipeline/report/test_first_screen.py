"""The first screen: the answer in front, what could hide, what bands leave out; figures by the model that answers."""

import numpy as np
import pytest

from pipeline.report.answer import first_screen, pre_curvatures
from pipeline.report.diagnosed import diagnosis_view
from pipeline.report.document import report_html
from pipeline.report.evidence import main_figure, pointer_data
from pipeline.report.figures import steps_of_answer
from pipeline.report.frames import beam_frame, simulation_frame
from pipeline.report.maps import photos_of_answer
from pipeline.report.words import Words
from pipeline.result import BlindSpot, FindingPart, TwinPart, set_aside
from pipeline.settings import ReportSettings
from tests.pipeline.report.virtual_diagnosis import diagnosis_of
from tests.pipeline.report.virtual_result import measured_result

WORDS = Words("en")


def with_spots(result, *spots):
    blind = [
        BlindSpot(name=name, stiffness_bias_at_plausible_size=bias, settled_by="unloading") for name, bias in spots
    ]
    return result.model_copy(update={"diagnosis": result.diagnosis.model_copy(update={"blind_spots": blind})})


def test_what_could_hide_is_told_where_it_would_leave_the_band(diagnosed):
    result = diagnosed("adequate")
    curve = result.answer.curve
    band = WORDS.half_band * float((curve.tangent_std / curve.tangent).mean())
    told = first_screen(
        with_spots(result, ("force_gain", 0.5 * band), ("plastic_set", 2.0 * band), ("hysteresis", -0.27)),
        WORDS,
    ).hidden
    assert [line.split(",")[0] for line in told] == ["hysteresis", "plastic set"]
    assert told[0] == "hysteresis, by up to 27 % of f_EI: unloading in the same steps would show it."


def test_what_is_quoted_lies_where_the_data_determine_it(diagnosed):
    """Where hardly any of the cable was bent so far the band runs away: 8.5 +- 2.0 at the end of 18.0 +- 0.9."""
    result = diagnosed("unexplained")
    curve = result.inverse.curve
    std = np.array(curve.tangent_std_Nm2)
    std[-3:] *= 12.0
    spiked = curve.model_copy(update={"tangent_std_Nm2": std.tolist()})
    result = result.model_copy(update={"inverse": result.inverse.model_copy(update={"curve": spiked})})
    (kappa, _, band) = result.answer.curve.ends()[1]
    assert kappa == curve.kappa_per_m[-4] and band == std[-4]
    assert f"κ\xa0=\xa0{kappa:.3g}\xa01/m" in first_screen(result, WORDS).sentence


def test_what_lacks_the_cause_that_was_found_shows_no_pre_curvature(diagnosed):
    """A K0 of -1.4 by the simulation without the cause stood beside the 1.2 of the answer."""
    assert len(pre_curvatures(diagnosed("adequate"))) > len(pre_curvatures(diagnosed("named"))) > 0
    assert not {"inverse", "balance"} & set(pre_curvatures(diagnosed("named")))


def test_ways_that_disagree_do_so_by_the_probability_of_their_difference(diagnosed):
    """By bands that hold errors of both, 2.9 % were expected of two ways that contradict each other at 1 %."""
    result = diagnosed("unexplained")
    apart = result.agreement.model_copy(update={"compatible": False, "p_value": 1e-3})
    told = first_screen(result.model_copy(update={"agreement": apart}), WORDS).agreement
    assert "(p = 0.001)" in told and "expected" not in told


def test_a_sign_that_a_cause_cannot_have_is_named_and_no_probability_is_certain(diagnosed):
    result = diagnosed("named")
    rows = [
        r.model_copy(update={"z": -13.0, "p_adjusted": 1.0}) if r.name == "bearing_friction" else r
        for r in result.diagnosis.table
    ]
    sure = [cause.model_copy(update={"probability": 0.9982}) for cause in result.diagnosis.causes]
    part = result.diagnosis.model_copy(update={"table": rows, "causes": sure})
    shown = diagnosis_view(result.model_copy(update={"diagnosis": part}), WORDS)
    assert shown.rows[-1][0] == "bearing friction" and "wrong sign" in shown.rows[-1]
    assert "(probability > 99 %)" in shown.named[0].line


def test_columns_without_any_number_are_left_out(failed_result, full_result):
    """Of a specimen that was not measured nothing was simulated, and no photo has a length."""
    steps = [step.model_copy(update={"force_fit_N": None}) for step in full_result.steps]
    refused = [
        photo.model_copy(update={"chord_m": None, "traced_length_m": None, "width_m": None, "s_m": []})
        for photo in failed_result.photos
    ]
    text = report_html(failed_result.model_copy(update={"steps": steps, "photos": refused}))
    assert "Forces, measured</h3>" in text.replace("\n", "") and "simulated [" not in text
    assert all(head in report_html(full_result) for head in ("traced length", "simulated ["))


def test_nothing_is_concluded_from_numbers_that_are_not_usable(diagnosed):
    result = with_spots(diagnosed("adequate").model_copy(update={"photos": []}), ("hysteresis", 0.27))
    fault = FindingPart(code="size/force", level="error", message="the forces seem to be 1000 times too large")
    wrong = result.model_copy(update={"findings": [fault], "answer_": None})
    concluded = (
        "What could hide in these data",
        "Is the model adequate?",
        "Do the two ways agree?",
        ">Pre-curvature K0</span>",
        ">measured</span>",
        'id="diagnosis"',
        'id="use"',
    )
    good, bad = report_html(result), report_html(wrong)
    assert all(said in good for said in concluded) and not any(said in bad for said in concluded)
    assert '<span class="chip bad">not usable</span>' in bad
    for frame in (simulation_frame, beam_frame):  # nor goes anything into a simulation
        assert len(frame(result)) > 0 == len(frame(wrong)) and list(frame(wrong)) == list(frame(result))


def test_what_was_found_hides_no_more(diagnosed):
    spots = ("hysteresis", 0.3), ("bearing_friction", 0.25), ("plastic_set", 0.2)
    told = first_screen(with_spots(diagnosed("class"), *spots), WORDS).hidden
    assert [line.split(",")[0] for line in told] == ["plastic set"]
    told = first_screen(with_spots(diagnosed("unexplained"), *spots), WORDS).hidden
    assert len(told) == 3


def test_other_names_of_a_cause_are_told_once_the_likeliest_first(diagnosed):
    result = diagnosed("class")
    others = ["bearing_friction", "plastic_set", "rigid_ends", "camera_tilt", "force_drift"]
    twins = [TwinPart(name=name, probability=0.1**place, settled_by="") for place, name in enumerate(others, 1)]
    cause = result.diagnosis.causes[0].model_copy(update={"twins": twins})
    result = result.model_copy(update={"diagnosis": result.diagnosis.model_copy(update={"causes": [cause]})})
    (named,) = diagnosis_view(result, WORDS, figures=False).named
    friction = "bearing friction (10 %; settled by unloading in the same steps)"
    assert f"cannot be told apart here from {friction}; these leave no more than noise either: " in named.line
    assert [named.line.count(WORDS.cause(name)) for name in others] == [1, 1, 1, 1, 0]


@pytest.mark.parametrize("language", ["en", "de"])
def test_bands_say_what_they_do_not_contain(diagnosed, language):
    settings = ReportSettings(language=language)
    words = Words.of(settings)
    assert words("band_unexplained") in report_html(diagnosed("unexplained"), settings)
    assert words("band_unexplained") not in report_html(diagnosed("named"), settings)


def test_curves_without_the_cause_are_set_aside(diagnosed, full_result):
    named = diagnosed("named")
    assert set_aside(named) == {"inverse", "balance"}
    refuted = named.model_copy(update={"diagnosis": named.diagnosis.model_copy(update={"extended_refuted": True})})
    assert set_aside(refuted) == {"extended"}
    assert set_aside(full_result) == set()


def test_the_pointer_knows_which_curves_are_set_aside(diagnosed):
    result = diagnosed("named")
    ways = pointer_data(result, main_figure(result, WORDS), WORDS)["ways"]
    assert {way["method"]: way["aside"] for way in ways} == {"inverse": True, "balance": True, "extended": False}


def test_forces_are_those_of_the_model_that_answers(diagnosed):
    result = diagnosed("named")
    residuals = result.diagnosis.residuals_after
    left = [0.001 * (place + 1) for place in range(len(residuals.steps))]
    after = residuals.model_copy(update={"force_N": left})
    result = result.model_copy(update={"diagnosis": result.diagnosis.model_copy(update={"residuals_after": after})})
    shown = {step.step: step for step in steps_of_answer(result)}
    for number, rest in zip(after.steps, left, strict=True):
        assert shown[number].force_N - shown[number].force_fit_N == pytest.approx(rest, rel=1e-9)
    assert steps_of_answer(measured_result()) == measured_result().steps


def test_a_photo_shows_what_the_model_of_the_answer_leaves_of_it():
    result = measured_result()
    assert photos_of_answer(result) is result.photos  # the simulation answers
    result = result.model_copy(update={"diagnosis": diagnosis_of("named", result.photos), "answer_": None})
    assert result.answer.method == "extended"
    residuals = result.diagnosis.residuals_after
    for row, photo in zip(residuals.shape_m, photos_of_answer(result), strict=True):
        assert photo.kappa_fit_per_m == []  # that of the simulation without the cause
        middle, place = len(photo.s_m) // 2, len(residuals.s_m) // 2
        left = np.interp(photo.s_m[middle], residuals.s_m, [np.nan if v is None else v for v in row])
        assert np.isfinite(row[place]) and photo.shape_residual_m[middle] == pytest.approx(left)

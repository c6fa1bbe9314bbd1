"""Whether an answer may be used: decided once, from findings and values, and heeded wherever results meet."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from pipeline.cli import main
from pipeline.compare import compare
from pipeline.predict import predict
from pipeline.report.answer import first_screen
from pipeline.report.frames import characteristic_frame
from pipeline.report.words import Words
from pipeline.result import FindingPart, ForceCorrectionPart, Result, SpecimenPart, from_json, to_json
from tests.pipeline.report.virtual_diagnosis import diagnosis_of
from tests.pipeline.report.virtual_result import measured_result


@pytest.fixture(scope="module")
def measured():
    return measured_result()


def found(result, code, level="warning"):
    finding = FindingPart(code=code, level=level, message="the forces seem to be 1000 times too large")
    return result.model_copy(update={"findings": [finding], "answer_": None})


def test_the_answer_says_which_curve_it_is_and_why(measured):
    told = measured.answer
    assert (told.method, told.usable) == ("inverse", True)
    assert told.pre_curvature_per_m == measured.inverse.pre_curvature_per_m
    extended = measured.model_copy(update={"diagnosis": diagnosis_of("named", measured.photos)})
    assert extended.answer.method == "extended"
    assert extended.answer.reason != told.reason
    part = extended.diagnosis.model_copy(update={"verdict": "unexplained", "extended_refuted": False})
    nearest = extended.model_copy(update={"diagnosis": part}).answer
    assert nearest.method == "extended"
    assert "no cause in the catalogue removes the misfit" in nearest.reason and "best" not in nearest.reason


@pytest.mark.parametrize(
    ("code", "level", "usable"),
    [
        ("size/force", "error", False),
        ("size/force", "warning", False),
        ("length/other-cable", "error", False),
        ("photo/moving-apart", "error", False),
        ("force/sign", "warning", False),
        ("force/factor", "error", True),  # corrected, and the bands know by what
        ("force/dead", "warning", True),  # left out
        ("photo/other-step", "warning", True),
        ("diameter/seen", "error", True),
        ("identify/misfit-shape", "warning", True),
    ],
)
def test_faults_that_make_the_numbers_none_of_the_cable(measured, code, level, usable):
    told = found(measured, code, level).answer
    assert told.usable == usable
    assert ("1000 times" in told.reason) == (not usable)


def test_a_sign_turned_midway_is_corrected_and_no_fault(measured):
    correction = ForceCorrectionPart(steps=[5, 6], factor=-1.0, offset_N=0.0)
    diagnosis = diagnosis_of("adequate", measured.photos).model_copy(update={"corrected_forces": [correction]})
    assert found(measured, "force/sign").model_copy(update={"diagnosis": diagnosis}).answer.usable


def test_a_stiffness_that_is_negative(measured):
    curve = measured.inverse.curve
    curve = curve.model_copy(update={"tangent_Nm2": [-v for v in curve.tangent_Nm2]})
    told = measured.model_copy(update={"inverse": measured.inverse.model_copy(update={"curve": curve})}).answer
    assert not told.usable and "sign of the forces" in told.reason


def test_without_a_curve_there_is_no_answer_and_its_reason_is_the_error():
    message = "force.csv: the log is empty."
    finding = FindingPart(code="log/empty", level="error", message=message)
    told = Result(status="failed", specimen=SpecimenPart(id="a", folder="a"), findings=[finding]).answer
    assert (told.method, told.usable, told.reason) == (None, False, message)


def test_what_is_stored_counts(measured):
    stored = from_json(to_json(measured.model_copy(update={"answer_": found(measured, "size/force").answer.stored()})))
    assert not stored.answer.usable and stored.answer.curve is not None
    assert measured.answer.usable


@pytest.mark.parametrize(("language", "said"), [("en", "not usable"), ("de", "nicht verwendbar")])
def test_the_first_sentence_of_the_report_says_so(measured, language, said):
    wrong = found(measured, "size/force", "error")
    words = Words(language)
    assert said in first_screen(wrong, words).sentence.split(". ")[0]
    assert said not in first_screen(measured, words).sentence


def test_no_comparison_holds_it(measured):
    wrong = found(measured, "size/force", "error")
    for pair in ((measured, wrong), (wrong, measured)):
        comparison = compare(*pair)
        assert comparison.verdict == "not comparable"
        assert "not usable: the forces seem to be 1000 times too large" in comparison.statement


def test_nothing_is_predicted_with_it(measured, tmp_path):
    wrong = found(measured, "size/force", "error")
    with pytest.raises(ValueError, match="is not usable: the forces seem to be 1000"):
        predict(wrong, [0.004])
    (tmp_path / "result.json").write_text(to_json(wrong))
    done = CliRunner().invoke(main, ["predict", str(tmp_path), "--displacement-mm", "4"])
    assert (done.exit_code, done.stdout) == (3, "")
    assert done.stderr == f"cablebend: {wrong.specimen.id} is not usable: the forces seem to be 1000 times too large.\n"
    assert predict(measured, [0.004]).steps[0].status == "predicted"


def test_one_curve_of_the_table_is_the_answer(measured):
    for verdict, method in (("adequate", "inverse"), ("named", "extended")):
        result = measured.model_copy(update={"diagnosis": diagnosis_of(verdict, measured.photos)})
        table = characteristic_frame(result)
        assert set(table[table.answer == 1].method) == {method}
        assert np.isin(table.answer, (0, 1)).all() and (table.answer == 0).any()


def test_fields_that_nobody_knows_are_passed_over(measured):
    document = json.loads(to_json(measured))
    document["tomorrow"] = {"a": [1, None]}
    document["inverse"]["curve"]["tomorrow"] = [1.0]
    document["photos"][0]["tomorrow"] = "x"
    assert from_json(json.dumps(document)) == measured

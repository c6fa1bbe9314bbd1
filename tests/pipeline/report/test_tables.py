"""The tables: columns of the contract, numbers that survive, text no spreadsheet runs, no half file."""

import io

import pandas as pd
import pytest

from pipeline.report.cells import neutral
from pipeline.report.evidence import knot_rows, knot_title
from pipeline.report.figures import stiffness_unit
from pipeline.report.files import write_atomic
from pipeline.report.frames import causes_frame, centerlines_frame, forces_frame, photos_frame, simulation_frame
from pipeline.report.tables import csv_text, write_result, write_tables
from pipeline.report.words import Words
from pipeline.result import from_json, visited
from pipeline.rounding import rounded
from pipeline.settings import ReportSettings

CHARACTERISTIC = ["method", "answer", "kappa_per_m", "moment_Nm", "tangent_Nm2", "tangent_std_Nm2", "secant_Nm2"]
CHARACTERISTIC += ["supported"]
CENTERLINES = ["image", "s_m", "x_m", "y_m", "u_px", "v_px", "theta_rad", "kappa_per_m", "kappa_std_per_m"]


@pytest.fixture
def written(diagnosed, tmp_path):
    return {path.name: pd.read_csv(path) for path in write_tables(diagnosed("named"), tmp_path)}


def test_columns_are_those_of_the_contract(written):
    assert list(written["characteristic.csv"])[: len(CHARACTERISTIC)] == CHARACTERISTIC
    assert list(written["centerlines.csv"])[: len(CENTERLINES)] == CENTERLINES
    assert list(written["beam_table.csv"]) == ["bend_per_m", "moment_Nm", "moment_std_Nm", "measured"]
    assert list(written["simulation.csv"]) == ["quantity", "value", "std", "unit", "note"]


def test_numbers_survive(written, diagnosed):
    result, table = diagnosed("named"), written["characteristic.csv"]
    for method, curve in (("inverse", result.inverse.curve), ("balance", result.balance.curve)):
        rows = table[table.method == method]
        # nine digits are written
        assert rows.tangent_Nm2.to_numpy() == pytest.approx(curve.tangent_Nm2, rel=1e-8)
    assert set(table.method) == {"inverse", "balance", "extended"}
    lines = written["centerlines.csv"]
    photo = result.photos[1]
    assert lines[lines.image == photo.image].u_px.to_numpy() == pytest.approx(photo.u_px, rel=1e-8)
    beam = written["beam_table.csv"]
    assert beam.moment_Nm.to_numpy()[-5:] == pytest.approx(result.diagnosis.extended.moment_Nm[-5:], rel=1e-8)


def test_simulation_table_follows_the_range_asked_for(full_result, tmp_path):
    write_tables(full_result, tmp_path, ReportSettings(equivalent_range_per_m=(3.0, 7.0)))
    table = pd.read_csv(tmp_path / "simulation.csv").set_index("quantity")
    assert table.loc["equivalent_stiffness", "note"] == "inverse, kappa 3 to 7 1/m"
    assert set(table.index) == {"equivalent_stiffness", "pre_curvature", "smallest_bend_radius_seen"}


def test_extended_model_answers_in_every_table(diagnosed, written):
    result = diagnosed("named")
    extended = visited("extended", result.diagnosis.extended)
    first = written["simulation.csv"].set_index("quantity").loc["pre_curvature"]
    assert first.note == "extended"
    assert first.value == pytest.approx(extended.pre_curvature, rel=1e-8)
    words, unit = Words("en"), stiffness_unit(result, Words("en"))
    assert "extended" in knot_title(result, words)
    rows = knot_rows(result, words)
    assert rows[0][1] == unit.number(*extended.at(extended.kappa[0]))
    assert rows[-1][1] == unit.number(*extended.at(extended.kappa[-1]))


def test_points_of_the_characteristic_have_the_band_of_the_answer(full_result):
    """Where nothing is named the diagnosis widens the band, and the points of the fit itself know nothing of that."""
    words, unit = Words("en"), stiffness_unit(full_result, Words("en"))
    curve = full_result.inverse.curve
    wider = curve.model_copy(update={"tangent_std_Nm2": [5.0 * std for std in curve.tangent_std_Nm2]})
    result = full_result.model_copy(update={"inverse": full_result.inverse.model_copy(update={"curve": wider})})
    rows, answer = knot_rows(result, words), result.answer.curve
    assert rows[-1][1] == unit.number(answer.tangent[-1], answer.tangent_std[-1])
    assert "Points of the characteristic" in knot_title(result, words)


def test_failed_specimen_has_tables_with_heads_only(failed_result, tmp_path):
    for path in write_tables(failed_result, tmp_path):
        frame = pd.read_csv(path)
        assert frame.empty
        assert list(frame)


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@x", "\tx", "\r=1", "\n=1"])
def test_formulas_are_neutralised(text):
    read = pd.read_csv(io.StringIO(csv_text(pd.DataFrame({"image": [text], "value": [-1.5]}))))
    assert read.image[0] == "'" + text.replace("\r", " ")
    assert read.value[0] == -1.5


def test_other_text_stays_as_it_is():
    assert [neutral(cell) for cell in ("a=b", "", 3.0, None)] == ["a=b", "", 3.0, None]


def test_frames_have_units_in_their_columns(full_result, diagnosed):
    assert list(forces_frame(full_result))[2:5] == ["displacement_m", "force_N", "force_std_N"]
    assert len(forces_frame(full_result)) == 7
    assert photos_frame(full_result).chord_m.notna().all()
    assert list(causes_frame(diagnosed("named")).name)[:2] == ["hysteresis", "bearing_friction"]
    assert causes_frame(full_result).empty
    assert centerlines_frame(full_result).seen.dtype == bool
    assert simulation_frame(full_result).iloc[0].unit == "N m2"


def test_result_comes_back_as_it_was(full_result, tmp_path):
    assert from_json(write_result(full_result, tmp_path).read_text(encoding="utf-8")) == full_result


def test_result_shows_itself_in_a_notebook(diagnosed, partial_result):
    html = diagnosed("named")._repr_html_()
    answer = diagnosed("named").answer
    assert f"K0</th><td>{rounded(answer.pre_curvature_per_m, answer.pre_curvature_std_per_m)} 1/m" in html
    assert "extended: the model with the causes that were found" in html
    assert all(f"<th>{name}</th><td>{text}</td>" in html for name, text in answer.curve.told())
    assert "diagnosis: named" in html
    assert "<img" not in partial_result._repr_html_()


def test_interrupted_writing_leaves_the_old_file(tmp_path):
    path = write_atomic(tmp_path / "a.txt", "old")
    with pytest.raises(UnicodeEncodeError):
        write_atomic(path, "half \ud800")
    with pytest.raises(TypeError):
        write_atomic(path, 3)
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]

"""index.html and summary.csv: every specimen is there, with its reason if it failed; also after half a run."""

import json
import math
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from pipeline.batch.store import write_entry
from pipeline.messages import Message
from pipeline.report.tables import write_result
from pipeline.result import FindingPart, PhotoPart
from pipeline.result.row import POINTS, as_entry, from_entry, index_row, thinned
from pipeline.settings import ReportSettings
from tests.pipeline.report.virtual_index import write_index


def named(result, name, kind="HV 35"):
    specimen = result.specimen.model_copy(update={"id": name, "description": {"type": kind} if kind else {}})
    return result.model_copy(update={"specimen": specimen})


def reported(out, *names):
    """Folders with a report for the index to link."""
    for name in names:
        (out / name).mkdir(parents=True, exist_ok=True)
        (out / name / "report.html").touch()


@pytest.fixture(scope="module")
def batch(full_result, diagnosed, partial_result, failed_result):
    return [named(full_result, "a"), named(diagnosed("class"), "b"), partial_result, failed_result]


def test_summary_has_a_row_a_specimen(batch, tmp_path):
    reported(tmp_path, "a")
    _, summary = write_index(batch, tmp_path)
    table = pd.read_csv(summary)
    assert list(table.status) == ["measured", "measured", "partial", "failed"]
    assert list(table.verdict) == ["none", "class", "none", "none"]
    assert table.f_EI_low_Nm2[0] == pytest.approx(batch[0].inverse.curve.tangent_Nm2[0], rel=1e-8)
    assert table.K0_std_per_m[0] == 0.013
    assert table.reason[3] == "force.csv: the log is empty; export it again."
    assert table.id[2].startswith("'=")
    assert table.report[0] == "a/report.html"


def test_no_verdict_and_no_cause_stands_beside_a_fault(diagnosed, tmp_path):
    result = diagnosed("named")
    fault = FindingPart(code="size/force", level="error", message="the forces seem to be 1000 times too large")
    wrong = result.model_copy(update={"findings": [fault], "answer_": None})
    page = write_index([wrong], tmp_path)[0].read_text(encoding="utf-8")
    assert "data at fault" in page and "<br><b>" not in page

    told = PhotoPart.told(Message("photo/blank", brightness=0.03))
    photos = [photo.model_copy(update={"status": "rejected", **told}) for photo in result.photos]
    error = FindingPart(code="identify/inverse-no-data", level="error", message="no loaded step has both")
    lost = result.diagnosis.model_copy(update={"verdict": "underpowered", "causes": [], "extended": None})
    parts = {"photos": photos, "findings": [error], "diagnosis": lost, "answer_": None}
    nothing = {"inverse": None, "balance": None, "agreement": None, "status": "failed"}
    pages = write_index([result.model_copy(update=parts | nothing)], tmp_path)
    page = pages[0].read_text(encoding="utf-8")
    assert "too weak" not in page and f"{photos[0].image}: the picture shows nothing" in page
    assert "the picture shows nothing" in pd.read_csv(pages[1]).reason[0]


def test_page_links_every_report_and_escapes_names(batch, tmp_path):
    reported(tmp_path, "a")
    page = write_index(batch, tmp_path)[0].read_text(encoding="utf-8")
    assert page.count("<tr class=") == 4
    assert 'href="a/report.html"' in page
    assert 'href="b/report.html"' not in page
    assert "<img" not in page
    assert page.count("<script") == 3
    assert "the log is empty" in page


@pytest.mark.parametrize(
    ("verdict", "language", "told"),
    [
        ("class", "en", "hysteresis or bearing friction"),
        ("class", "de", "Hysterese oder Lagerreibung"),
        ("adequate", "en", ""),
        ("unexplained", "en", ""),  # a cause that does not suffice is none
    ],
)
def test_the_page_names_the_cause_and_its_class(diagnosed, tmp_path, verdict, language, told):
    pages = write_index([diagnosed(verdict)], tmp_path, ReportSettings(language=language))
    cell = re.search(r"<br><b>([^<]*)</b></td>", pages[0].read_text(encoding="utf-8"))
    assert (cell[1] if cell else "") == told


def test_folder_of_half_a_run_is_enough(batch, tmp_path):
    for result in batch[:2]:
        write_result(result, tmp_path / "deep" / result.specimen.id)
    reported(tmp_path, "deep/a")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "result.json").write_text('{"schema": "cablebend/res', encoding="utf-8")
    page, summary = write_index(tmp_path, tmp_path)
    table = pd.read_csv(summary)
    assert list(table.id) == ["broken", "a", "b"]
    assert "cannot be read" in table.reason[0]
    assert 'href="deep/a/report.html"' in page.read_text(encoding="utf-8")


def test_no_head_of_a_column_breaks_within_a_unit(batch, tmp_path):
    page = write_index(batch, tmp_path)[0].read_text(encoding="utf-8")
    assert page.count("[mN\N{NO-BREAK SPACE}m²]</button>") == 2


def test_the_unit_suits_most_specimens_not_the_stiffest(full_result, tmp_path):
    whole = full_result.inverse.curve
    stiff = whole.model_copy(update={"tangent_Nm2": [300.0 * value for value in whole.tangent_Nm2]})
    odd = full_result.model_copy(update={"inverse": full_result.inverse.model_copy(update={"curve": stiff})})
    results = [named(full_result, "a"), named(full_result, "b"), named(odd, "c", kind="")]
    page = write_index(results, tmp_path)[0].read_text(encoding="utf-8")
    assert page.count("[mN\N{NO-BREAK SPACE}m²]</button>") == 2


def test_types_are_offered_in_the_order_in_which_people_count(full_result, tmp_path):
    page = write_index([named(full_result, kind, kind) for kind in ("HV 10", "HV 9")], tmp_path)[0].read_text("utf-8")
    assert page.index('<option value="HV 9">') < page.index('<option value="HV 10">')


def test_empty_batch_gives_an_empty_index(tmp_path):
    page, summary = write_index(tmp_path, tmp_path)
    assert "Specimens: 0" in page.read_text(encoding="utf-8")
    assert pd.read_csv(summary).empty


def test_overlay_data_are_the_curves(batch, tmp_path):
    page = write_index(batch, tmp_path)[0].read_text(encoding="utf-8")
    curves = json.loads(re.search(r'id="curves">(.*?)</script>', page)[1])
    assert curves[3] is None
    ends, value, std = curves[0]
    assert len(value) == len(std) == POINTS
    assert ends == pytest.approx([batch[0].inverse.curve.kappa_per_m[i] for i in (0, -1)], rel=1e-3)
    assert value[0] == pytest.approx(1e3 * batch[0].inverse.curve.tangent_Nm2[0], rel=1e-3)  # four digits


def test_repeat_specimens_are_pooled_by_type(full_result, tmp_path):
    repeats = [named(full_result, str(i), "B") for i in range(3)] + [
        named(full_result, "x", "C"),
        named(full_result, "y", ""),
    ]
    page = write_index(repeats, tmp_path)[0].read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert page.count("<figcaption>") == 1
    assert (
        "3 specimens, compared from 2.00 to 8.70 1/m, where all were bent. "
        "They may all be the same cable: the scatter of f_EI and K0 " in page
    )
    assert '<td>f_EI</td><td>K0</td></tr><tr><th scope="row">mean</th><td>13.2' in page


def test_repeats_that_are_not_one_cable_are_told_and_the_farthest_is_named(full_result, tmp_path):
    other = full_result.answer.curve.pre_curvature + 5.0 * full_result.answer.curve.pre_curvature_std
    inverse = full_result.inverse.model_copy(update={"pre_curvature_per_m": other})
    turned = named(full_result, "turned", "B").model_copy(update={"inverse": inverse, "answer_": None})
    page = write_index([*(named(full_result, str(i), "B") for i in range(3)), turned], tmp_path)[0].read_text("utf-8")
    assert "They are not all the same cable: the scatter of K0 " in page and "turned is farthest off" in page


def test_german_index(batch, tmp_path):
    page = write_index(batch, tmp_path, ReportSettings(language="de"))[0].read_text(encoding="utf-8")
    assert "Proben: 4, davon 2 vermessen, 1 teilweise, 1 gescheitert." in page
    assert "20,00 ± 0,13" in page


def test_rows_stand_in_the_order_people_count_and_hidden_folders_stay_out(failed_result, tmp_path):
    for name in ("cable-10", "cable-2", "Cable-1", ".half/cable-3"):
        write_result(named(failed_result, name), tmp_path / name)
    assert list(pd.read_csv(write_index(tmp_path, tmp_path)[1]).id) == ["Cable-1", "cable-2", "cable-10"]


def test_failed_specimen_gets_a_report_that_says_why_and_what_to_do(failed_result, tmp_path):
    write_result(failed_result, tmp_path / "cable-13")
    page = write_index(tmp_path, tmp_path, ReportSettings(language="de"))[0].read_text(encoding="utf-8")
    assert 'href="cable-13/report.html"' in page
    report = (tmp_path / "cable-13/report.html").read_text(encoding="utf-8")
    assert "Das unten Genannte beheben und denselben Befehl noch einmal ausführen" in report


def test_no_link_leads_nowhere(failed_result, tmp_path):
    assert "<a href" not in write_index([failed_result], tmp_path)[0].read_text(encoding="utf-8")


def scaled(result, times, **changes):
    """The result with a stiffness so many times as large."""
    curve = result.inverse.curve
    update = {name: [times * v for v in getattr(curve, name)] for name in ("tangent_Nm2", "tangent_std_Nm2")}
    inverse = result.inverse.model_copy(update={"curve": curve.model_copy(update=update)})
    return result.model_copy(update={"inverse": inverse, **changes})


def test_a_row_is_the_same_from_its_entry(full_result, partial_result, failed_result, diagnosed):
    for result in (full_result, partial_result, failed_result, diagnosed("two_causes")):
        row = index_row(result)
        again = from_entry(json.loads(json.dumps(as_entry(row))))
        assert as_entry(again) == as_entry(row)


def test_a_row_keeps_the_covariance_whatever_its_directions(full_result):
    curve = full_result.answer.curve
    for columns in (0, 2, 3 * POINTS):
        factor = np.random.default_rng(3).standard_normal((len(curve.kappa), columns))
        kept = thinned(replace(curve, factor=factor), POINTS).factor
        grid = np.linspace(curve.kappa[0], curve.kappa[-1], POINTS)
        exact = np.stack([np.interp(grid, curve.kappa, row) for row in factor @ factor.T])
        exact = np.stack([np.interp(grid, curve.kappa, row) for row in exact.T])
        assert kept.shape[1] <= POINTS
        assert np.allclose(kept @ kept.T, exact, atol=1e-6 * max(1, columns))


def test_a_row_holds_causes_and_counts_of_findings(diagnosed):
    result = diagnosed("two_causes")
    row = index_row(result)
    assert row.causes == tuple(cause.name for cause in result.diagnosis.causes) and len(row.causes) == 2
    assert row.pre_curvature is not None
    levels = [finding.level for finding in result.findings]
    assert (row.warnings, row.errors) == (levels.count("warning"), levels.count("error"))


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("low",), [2.0, 0.02]),
        (("low",), [2.0, 0.02, math.inf]),
        (("pre_curvature",), [2.0, math.nan]),
        (("curve", "range"), [8.7, 2.0]),
        (("curve", "tangent"), [0.02]),
        (("curve", "tangent_std"), [1e-4]),
        (("curve", "factor"), "AACAPw=="),  # one number where there must be 576
        pytest.param(("curve", "factor"), "AADAfwAAwH8AAMB/" * 192, id="576 that are not finite"),
        (("curve", "factor"), "=1"),
        (("photos_used",), True),
        (("status",), "done"),
        (("version",), 0),
    ],
    ids=str,
)
def test_an_entry_of_wrong_values_is_no_row(place, value, full_result):
    whole = json.dumps(as_entry(index_row(full_result)))
    from_entry(json.loads(whole))
    data = inside = json.loads(whole)
    for name in place[:-1]:
        inside = inside[name]
    inside[place[-1]] = value
    with pytest.raises(ValueError, match=r"row|numbers|curve|padding"):
        from_entry(data)
    short = json.loads(whole)
    short["curve"] |= {"tangent": [0.02], "tangent_std": [1e-4], "factor": ""}
    with pytest.raises(ValueError, match="a curve of nothing"):
        from_entry(short)


def test_a_row_is_small(full_result):
    assert len(json.dumps(as_entry(index_row(full_result)))) < 5000


def test_results_with_entries_are_not_read(full_result, tmp_path, monkeypatch):
    for name in ("a", "b"):
        write_result(named(full_result, name), tmp_path / name)
        write_entry({"row": as_entry(index_row(named(full_result, name)))}, tmp_path / name)
    monkeypatch.setattr("pipeline.result.read_result", lambda path: pytest.fail(f"{path} was read"))
    assert list(pd.read_csv(write_index(tmp_path, tmp_path)[1]).id) == ["a", "b"]


def test_writing_the_index_loads_no_drawing_library():
    heavy = "{'matplotlib', 'pandas', 'cv2', 'skimage', 'pipeline.diagnosis', 'pipeline.vision'}"
    program = f"import sys, pipeline.report.index; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_what_is_not_usable_is_in_no_mean(full_result, tmp_path):
    fault = FindingPart(code="size/force", level="error", message="the forces seem to be 1000 times too large")
    wrong = scaled(named(full_result, "3", "B"), 1000.0, findings=[fault])
    batch = [named(full_result, str(i), "B") for i in range(3)] + [wrong]
    page, summary = write_index(batch, tmp_path)
    text = page.read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert "3 specimens, compared from 2.00 to 8.70 1/m" in text
    assert '<td>f_EI</td><td>K0</td></tr><tr><th scope="row">mean</th><td>13.2' in text
    assert '<tr class="unusable">' in text and "data at fault" in text
    table = pd.read_csv(summary)
    assert list(table.usable) == [True, True, True, False]
    assert list(table.worst_finding)[3] == "size/force"


@pytest.mark.parametrize(
    ("language", "said"), [("en", "check the unit of the forces"), ("de", "die Einheit der Kräfte")]
)
def test_a_wrong_unit_that_shows_beside_repeat_specimens_alone(full_result, tmp_path, language, said):
    """A soft cable a thousand times as stiff is still a cable."""
    batch = [named(full_result, str(i), "B") for i in range(5)] + [scaled(named(full_result, "5", "B"), 1000.0)]
    page, summary = write_index(batch, tmp_path, ReportSettings(language=language))
    assert list(pd.read_csv(summary).usable) == [True] * 5 + [False]
    assert "f_EI is 1000 times that of the other 5 specimens of type B" in pd.read_csv(summary).reason[5]
    text = page.read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert said in text and ("5 specimens, compared" in text or "5 Proben, verglichen" in text)


def test_of_two_that_contradict_each_other_neither_is_believed(full_result, tmp_path):
    pair = [named(full_result, "a", "B"), scaled(named(full_result, "b", "B"), 1000.0)]
    assert not pd.read_csv(write_index(pair, tmp_path)[1]).usable.any()
    pair = [named(full_result, "a", "B"), scaled(named(full_result, "b", "B"), 20.0)]
    assert pd.read_csv(write_index(pair, tmp_path)[1]).usable.all()


def test_a_reason_is_no_formula_in_the_summary(failed_result, tmp_path):
    hostile = Message("error.file", path="=cmd|' /C calc'!A0", said=Message("log/empty"))
    failed = failed_result.model_copy(update={"findings": [FindingPart.of("error", hostile, code="log/empty")]})
    summary = write_index([failed], tmp_path)[1].read_text(encoding="utf-8")
    assert "'=cmd|' /C calc'!A0: is empty; export the forces again." in summary

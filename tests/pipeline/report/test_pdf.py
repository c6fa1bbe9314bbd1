"""report.pdf: two to four pages, the same bytes each time, whatever a user wrote."""

import re

import pytest

from pipeline.messages import Message
from pipeline.report.canvas import style
from pipeline.report.pdf import Sheet, answer_sheet, list_troubles, pdf_bytes, printable, write_pdf
from pipeline.report.words import Words
from pipeline.result import BlindSpot, FindingPart
from pipeline.settings import ReportSettings


def pages(content):
    return len(re.findall(rb"/Type /Page\b", content))


def test_pages_and_bytes(diagnosed, tmp_path):
    path = write_pdf(diagnosed("named"), tmp_path)
    content = path.read_bytes()
    assert content.startswith(b"%PDF")
    assert pages(content) == 4
    assert content == pdf_bytes(diagnosed("named"))
    assert b"CreationDate" not in content


@pytest.mark.parametrize("language", ["en", "de"])
def test_the_first_page_says_what_bands_leave_open_and_what_could_hide(diagnosed, language):
    settings, words, result = ReportSettings(language=language), Words(language), diagnosed("unexplained")
    spot = BlindSpot(name="hysteresis", stiffness_bias_at_plausible_size=0.27, settled_by="")
    result = result.model_copy(update={"diagnosis": result.diagnosis.model_copy(update={"blind_spots": [spot]})})
    with style():
        sheets = [answer_sheet(one, words, settings) for one in (result, diagnosed("named"))]
    told = [" ".join(" ".join(text.get_text() for text in sheet.figure.texts).split()) for sheet in sheets]
    hidden = f"{words.cause('hysteresis').capitalize()}, "
    assert [words("band_unexplained") in text for text in told] == [True, False]
    assert [words("hidden_here") in text and hidden in text and "27 % " in text for text in told] == [True, False]


def test_photos_change_the_file(diagnosed):
    few = ReportSettings(photos_in_pdf=0)
    assert len(pdf_bytes(diagnosed("adequate"), few)) < 0.8 * len(pdf_bytes(diagnosed("adequate")))


@pytest.mark.parametrize("name", ["partial_result", "failed_result"])
def test_awkward_results_have_two_to_four_pages(name, request):
    assert 2 <= pages(pdf_bytes(request.getfixturevalue(name), ReportSettings(language="de"))) <= 4


def test_letters_without_a_shape_become_boxes():
    assert printable("κ² 中 ok") == "κ² □ ok"


def test_findings_that_find_no_room_are_counted():
    sheet = Sheet("cable-07")
    long = Message("identify/force-zero", force_N=(0.3, 0.025), step=0, z=12.0)
    list_troubles(sheet, [FindingPart.of("warning", long)] * 60, Words("de"))
    told = [text.get_text() for text in sheet.figure.texts]
    shown = sum(line.startswith("Warnung: Die Kraftmessdose zeigt 300\u00a0±\u00a025\u00a0mN") for line in told)
    assert 10 < shown < 60
    assert told[-1] == f"{60 - shown} weitere in report.html."
    assert sheet.room() > 0.0


def test_findings_that_find_no_room_for_a_title_are_counted_above_the_number_of_the_page():
    sheet = Sheet("cable-07")
    sheet.y += sheet.room() - 1.0
    list_troubles(sheet, [FindingPart.of("warning", Message("photo/unreadable"))] * 2, Words("en"))
    assert sheet.figure.texts[-1].get_text() == "What was wrong: 2 more in report.html."
    assert sheet.y < 842.0 - 20.0 - 8.0  # its own letters and those of the number, 8 pt

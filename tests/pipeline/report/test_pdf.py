"""report.pdf: two to four pages, the same bytes each time, whatever a user wrote."""

import re

import pytest

from pipeline.report.pdf import pdf_bytes, printable, write_pdf
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


def test_photos_change_the_file(diagnosed):
    few = ReportSettings(photos_in_pdf=0)
    assert len(pdf_bytes(diagnosed("adequate"), few)) < 0.8 * len(pdf_bytes(diagnosed("adequate")))


@pytest.mark.parametrize("name", ["partial_result", "failed_result"])
def test_awkward_results_have_two_to_four_pages(name, request):
    assert 2 <= pages(pdf_bytes(request.getfixturevalue(name), ReportSettings(language="de"))) <= 4


def test_letters_without_a_shape_become_boxes():
    assert printable("κ² 中 ok") == "κ² □ ok"

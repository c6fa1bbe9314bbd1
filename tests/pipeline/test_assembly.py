"""What the stages saw is gathered into a result: nothing that cost a photo is missing among the findings."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from pipeline.assembly import photo_findings, without_advice, without_those_told_better
from pipeline.messages import Message
from pipeline.records import Finding, Rejected
from pipeline.report.answer import first_screen
from pipeline.report.words import Words
from pipeline.result import FindingPart, leading
from pipeline.result.headline import headline
from pipeline.run import measure
from tests.pipeline.report.virtual_result import measured_result

ROOT = Path(__file__).resolve().parents[2]


def test_a_rejected_photo_is_a_finding_with_its_own_code_and_its_name():
    (found,) = photo_findings([Rejected("images/b.png", Message("photo/truncated"))])
    assert (found.code, found.level) == ("photo/truncated", "warning")
    assert found.message == "images/b.png: the file ends before the picture does; copy it again"
    assert Words("de").said(found.said).language == "de"


@pytest.fixture(scope="module")
def measured():
    return measured_result()


TOO_LARGE = "forces seem to be 1000 times too large (mN taken for N, or N for kN)"
READING = Message("size/force.too-large", times=1000.0, reading="mN-as-N")
UNIT = FindingPart.of("error", Message("size/force.unit", readings=[READING]))


@pytest.mark.parametrize(
    ("code", "level", "leads"),
    [
        ("size/force", "error", True),
        ("size/force", "warning", True),  # the scale of f_EI: no misfit would tell of it
        ("force/gain", "error", True),
        ("force/outlier", "warning", False),
        ("identify/inverse-no-start", "error", False),  # said where the numbers would be
        ("diagnosis/program-error", "error", False),  # the data are not to blame, and the numbers stand without it
    ],
)
def test_faults_of_the_data_come_before_the_numbers(measured, code, level, leads):
    fault = FindingPart(code=code, level=level, message="the log is wrong")
    assert (leading([fault]) is not None) == leads
    words = Words("en")
    told = first_screen(measured.model_copy(update={"findings": [fault]}), words)
    before_numbers = told.sentence.casefold().partition("the bending")[0]
    assert ("the log is wrong." in before_numbers) == leads and (told.tone == "bad") == leads
    remedy = words.code(code)
    assert (told.advice == (remedy[1] if remedy else "The log is wrong")) == leads


def test_the_headline_of_numbers_that_are_not_usable_is_the_fault_alone(measured):
    led = headline(measured.model_copy(update={"findings": [UNIT]}))
    assert str(led) == f"The numbers of cable-07 are not usable: the {TOO_LARGE}."
    german = Words("de").said(led)
    assert german.language == "de"
    assert german.text == (
        "Die Zahlen von cable-07 sind nicht verwendbar: Die Kräfte scheinen 1000-mal zu groß (mN für N gehalten, oder "
        "N für kN)."
    )


def test_what_is_told_as_a_fault_is_said_once():
    noticed = [
        Finding("scale/displacement", "warning", "the travel gives another scale"),
        Finding("scale/length", "warning", "the traced length is another"),
    ]
    unit = Finding("log/unit", "warning", "the log seems to hold cm instead of mm")
    assert [f.code for f in without_those_told_better(noticed, [unit])] == ["scale/length"]
    assert without_those_told_better(noticed, []) == noticed
    pulled = [Finding(f"identify/{name}", "warning", "off by 9 standard deviations") for name in ("length", "scale")]
    length = Finding("length/traced", "warning", "the photos show a cable of another length")
    told = without_those_told_better([*noticed, *pulled], [length])
    assert [f.code for f in told] == ["scale/displacement"]


@pytest.mark.parametrize(
    ("verdict", "extended", "level"), [("named", 1, "info"), ("unexplained", 1, "error"), ("named", None, "error")]
)
def test_a_fit_that_failed_for_want_of_a_cause_advises_nothing_else(verdict, extended, level):
    """Stiff ends were named, f_EI measured beside them, and above it stood that length_mm was wrong."""
    failed = Finding("identify/inverse-no-equilibrium", "error", "length_mm or the scale is wrong")
    contradicted = Finding("identify/inverse-opposite-forces", "error", "no cable does that")
    misfit = Finding("identify/misfit-force", "warning", Message("identify/misfit-force", rms=7.0))
    part = SimpleNamespace(verdict=verdict, extended=extended)
    open_ = Finding("identify/inverse-not-visible", "warning", "f_EI is open at 9 1/m")
    told = without_advice([failed, contradicted, misfit, open_], part)
    explained = "info" if level == "info" else "warning"
    assert [one.level for one in told] == [level, "error", explained, explained] and told[1] == contradicted
    assert told[3].said == open_.said
    assert ("length_mm" in str(told[0].said)) == (level == "error")


def test_what_several_photos_show_alike_is_said_once_with_all_their_names():
    def narrow(image, share):
        return Rejected(image, Message("photo/width.traced", width_over_diameter=share))

    photos = [narrow("a.png", 1.16), Rejected("b.png", Message("photo/empty")), narrow("c.png", 1.15)]
    told = photo_findings(photos)
    assert [finding.code for finding in told] == ["photo/width", "photo/empty"]
    assert told[0].message.startswith("2 photos (a.png, c.png), on a.png: what was traced is 116 % as wide")
    assert told[1].message == "b.png: the file is empty"
    (alike,) = photo_findings([narrow("a.png", 1.16), narrow("c.png", 1.16)])
    assert alike.message.startswith("2 photos (a.png, c.png): what was traced is 116 % as wide")
    german = Words("de").said(told[0].said)
    assert german.language == "de" and german.text.startswith("2 Fotos (a.png, c.png), auf a.png: Das ")
    assert Words("de").said(alike.said).language == "de"


def test_where_all_photos_are_refused_that_is_the_error(tmp_path):
    """Errors said that no step had a photo, and that the photos were black stood below as a warning."""
    shutil.copytree(ROOT / "fixtures/specimens/three", tmp_path / "dark")
    for photo in (tmp_path / "dark/images").iterdir():
        cv2.imwrite(str(photo), np.zeros((300, 400), np.uint8))
    result = measure(tmp_path / "dark")
    assert result.status == "failed" and "could be used" in result.headline
    told = {(finding.code, finding.level) for finding in result.findings if finding.level != "info"}
    assert ("photo/blank", "error") in told
    assert not [code for code, _ in told if code.startswith("identify/")]

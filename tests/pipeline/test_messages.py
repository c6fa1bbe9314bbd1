"""Messages are data: both catalogues say the same things, everything made finds its sentence, and survives JSON."""

import ast
import errno
import json
import os
import re
import string
from pathlib import Path

import numpy as np
import pytest

from pipeline.messages import Message, by_system, catalogue, free_text
from pipeline.report.words import Words
from pipeline.result import FindingPart

ROOT = Path(__file__).resolve().parents[2]
KEY = re.compile(r"[a-z]+[/.][a-zA-Z-]+(\.[a-z_-]+)?")
# Made of what stands in the data: branches, columns, ways, units, and what a number was compared with.
MADE = (
    "word.",
    "size/force.",
    "toml/missing-key.",
    "identify/",
    "folder/no-photos.",
    "toml/unknown-",
    "photo/no-",
    "settled.",
    "cause.",
    "form.",
    "diagnosis.",
    "photo/outlier",
    "force/outlier",
    "cli.",
    "help.",
    "click.",
    "plan.",
    "effect.",
    "paper.",
    "system.",
)


def gaps(text):
    return sorted({field for _, field, _, _ in string.Formatter().parse(text) if field is not None})


def test_both_languages_have_the_same_sentences_with_the_same_gaps():
    english, german = catalogue("en"), catalogue("de")
    of_rod = ("inverse.", "balance.", "equilibrium.")  # rod says its outcomes in English itself
    assert list(english) == [key for key in german if not key.startswith(of_rod)]
    assert [key for key in english if [*map(gaps, english[key])] != [*map(gaps, german[key])]] == []
    alike = [key for key, texts in english.items() if texts == german[key]]
    assert [key for key in alike if re.search(r"[a-z]{5}", re.sub(r"\{.*?\}", "", str(english[key])))] == []


def test_every_sentence_is_used_and_every_key_has_one():
    files = (ROOT / "pipeline").rglob("*.py")
    nodes = [node for path in files for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    texts = (node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str))
    found = {text for text in texts if KEY.fullmatch(text)}
    known = {key for key in catalogue("en") if "." in key or "/" in key}
    assert sorted(key for key in known - found if not key.startswith(MADE)) == []
    calls = {
        node.args[0].value
        for node in nodes
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("Message", "inferred", "doubtful")
        if node.args and isinstance(node.args[0], ast.Constant)
    }
    assert sorted(calls - catalogue("en").keys() - {"text"}) == []


def test_numbers_are_those_of_the_language():
    message = Message("identify/force-zero", force_N=(np.float64(0.0123), 0.0004), step=np.int64(0), z=30.75)
    assert message.said() == (
        "the load cell reads 12.3 ± 0.4\u00a0mN in the force-free step 0, 30.8 standard deviations from zero"
    )
    assert message.said("de").startswith("die Kraftmessdose zeigt 12,3 ± 0,4\u00a0mN im kraftfreien Schritt 0, 30,8 ")


def test_reasons_of_the_operating_system_are_said_in_the_language():
    for name in (key.removeprefix("system.") for key in catalogue("en") if key.startswith("system.")):
        number = getattr(errno, name)
        refused = by_system(OSError(number, os.strerror(number)))
        assert refused.said("en") == os.strerror(number).lower() != refused.said("de")
    unknown = by_system(OSError(errno.EXDEV, os.strerror(errno.EXDEV)))
    assert unknown.english and unknown.said("de") == os.strerror(errno.EXDEV).lower()


def test_what_is_quoted_from_a_file_stays_as_it_is():
    message = Message("log/no-column", role="force", names="'1.5 kg', {x}\x1b[2J")
    assert message.parts("de")[0] == r"keine Spalte für Kraft unter '1.5 kg', {x}\x1b[2J"
    assert len(Message("log/branch", cell="x" * 10_000).said()) < 800


def test_messages_hold_messages_and_come_back_from_json():
    inner = free_text("a pre-curvature that nobody knows")
    message = Message("compare/doubt", name="a 1.5", doubts=[inner, Message("compare/doubt.unexplained")])
    stored = json.loads(json.dumps(message.stored()))
    assert Message.read(stored) == message and hash(Message.read(stored)) == hash(message)
    assert str(Words("de").said(message)) == (
        "a 1.5: a pre-curvature that nobody knows; "
        "die Simulation lässt eine Abweichung, die keine bekannte Ursache beseitigt."
    )
    assert Words("de").said(message).language == "en"  # one of its parts is


@pytest.mark.parametrize(
    "damage",
    [{"key": "log/nothing"}, {"values": {}}, {"values": {"spread_m": "much"}}, {"values": {"spread_m": {"key": 1}}}],
)
def test_a_finding_whose_data_are_none_of_this_version_is_told_as_it_was_written(damage):
    part = FindingPart.of("warning", Message("identify/chord-displacement.one", spread_m=5e-4))
    assert part.code == "identify/chord-displacement" and "differ by 0.500 mm" in part.message
    stored = {**json.loads(part.model_dump_json()), **damage}
    assert FindingPart(**stored).said == free_text(part.message)

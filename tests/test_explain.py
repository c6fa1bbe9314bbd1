"""``cablebend explain``: every cause of the contract, and every code that a message may have, in both languages."""

import ast
import re
from pathlib import Path

import pytest

from pipeline.messages import catalogue
from pipeline.report.words import Words, documented_codes
from tests.test_cli import call

ROOT = Path(__file__).resolve().parents[1]


def test_explain_knows_every_cause_of_the_contract():
    known = call("explain").stdout
    assert len([line for line in known.splitlines() if not line.startswith(" ")]) == 22
    parts = ("Amount:", "Sits in:", "Shows with:", "Told apart by:", "At the rig:", "Settled by:")
    assert all(part in call("explain", "pre_curvature").stdout for part in parts)
    assert "An der Anlage:" in call("explain", "pre_curvature", "--language", "de").stdout
    assert call("explain", "rigid_ends").stdout.startswith("rigid_ends (m, not negative)")
    page = call("explain", "rig_compliance").stdout
    assert page.startswith("rig_compliance (m/N")
    german = call("explain", "rig_compliance", "--language", "de").stdout
    assert german.startswith("rig_compliance: Nachgiebigkeit der Anlage (m/N, nicht negativ)")
    assert "An der Anlage:    Die fotografierte Sehne statt des Protokolls verwenden" in german


@pytest.mark.parametrize("language", ["en", "de"])
def test_explain_knows_the_codes_of_messages(language):
    done = call("explain", "photo/blur", "--language", language)
    code, meaning, remedy = done.stdout.splitlines()
    assert (done.exit_code, code) == (0, "photo/blur")
    assert (meaning, remedy) == Words(language).code("photo/blur")
    listed = call("explain", "codes", "--language", language).stdout
    assert [line for line in listed.splitlines() if not line.startswith(" ")] == list(documented_codes())
    assert call("explain", "identify/inverse-stalled").exit_code == 0


def test_explain_names_what_is_near_and_nothing_else():
    assert "did you mean photo/blur?" in call("explain", "photo/blurr").stderr
    assert "did you mean rig_compliance?" in call("explain", "rig_complianc").stderr
    far = call("explain", "weather")
    assert far.exit_code == 2 and "did you mean" not in far.stderr and "lists all causes" in far.stderr


def test_every_code_of_a_message_is_documented():
    told = {key.partition(".")[0] for key in catalogue("en") if "/" in key}
    for path in (ROOT / "pipeline").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            text = node.value if isinstance(node, ast.Constant) else None
            if isinstance(text, str) and re.fullmatch(r"[a-z]+/[a-z][a-z-]*[a-z]", text):
                told.add(text)
    made = {code for code in documented_codes() if code.endswith("*")}  # of a way and its outcome
    families = tuple(code[:-1] for code in made if code.endswith("*"))
    assert {code for code in told if not code.startswith(families)} == set(documented_codes()) - made
    for texts in documented_codes().values():
        assert len(set(texts)) == 4 and all(text.endswith(".") for text in texts)

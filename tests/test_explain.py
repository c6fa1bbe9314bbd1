"""``cablebend explain``: every cause of the contract, and every code that a message may have, in both languages."""

import ast
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.causes.profile import piece, step, wave
from pipeline.messages import catalogue
from pipeline.report.diagnosed import _named
from pipeline.report.words import Words, documented_codes
from pipeline.result import CauseForm, CausePart, DiagnosisPart
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


def test_every_form_of_a_cause_is_said_in_words():
    facts = SimpleNamespace(
        branch=("mounted", "loading", "loading", "unloading"),
        bends=np.ones(4),
        hold_times=(np.arange(3.0),) * 4,
        clock=10.0 * np.arange(4.0),
        timed=True,
        returns=True,
        rest_side="natural",
        pushed=(1, 2, 3),
        **dict.fromkeys(("curvature_scale", "moment_scale", "force_scale", "length"), 1.0),
    )
    labels = {(cause.name, form.label) for cause in CATALOGUE for form in cause.variants(facts)}
    labels |= {(cause.name, form.label) for cause in CATALOGUE for way in cause.by_step(1.0, facts) for form in way}
    for name in ("pre_curvature_varying", "stiffness_varying"):
        labels |= {(name, form.label) for form in (piece(), step(), wave(1))}
    said = {tuple(key.split(".", 2)[1:]) for key in catalogue("en") if key.startswith("form.")}
    assert {one for one in labels if one[1]} == said


@pytest.mark.parametrize(
    ("language", "grows", "late"),
    [
        ("en", "a moment that grows with the force", "from a bend of 3.2 1/m on"),
        ("de", "ein Moment, das mit der Kraft wächst", "ab einer Biegung von 3,2 1/m"),
    ],
)
def test_the_form_of_a_cause_is_told_where_it_is_named(language, grows, late):
    assert grows in call("explain", "bearing_friction", "--language", language).stdout
    friction = CauseForm(label="that grows with the force", amount=0.001, std=1e-4)
    bent = CauseForm(label="alike all along the cable", amount=0.1, std=0.01, width=3.2, at=2.0, tuned=["width"])
    told = {"probability": 0.9, "estimate": 0.001, "std": 1e-4, "unit": "N m"}
    causes = [
        CausePart(name="bearing_friction", forms=[friction, friction], **told),
        CausePart(name="plastic_set", forms=[bent], **told),
    ]
    part = DiagnosisPart(verdict="two_causes", headline="", causes=causes)
    first, second = (cause.line for cause in _named(part, Words(language)))
    assert first.count(grows) == 1 and late in second


def test_nobody_is_told_to_mend_a_cause_that_does_not_suffice():
    cause = CausePart(name="rigid_ends", probability=0.9, estimate=0.004, std=3e-4, unit="m")
    for verdict, told in (("named", True), ("unexplained", False)):
        (named,) = _named(DiagnosisPart(verdict=verdict, headline="", causes=[cause]), Words())
        assert bool(named.summary) == bool(named.remedy) == told

"""No room writes sentences: what is said is a key with values, and both languages have it.

The truth is the code itself: its strings are read from the syntax tree, so a sentence written into a room tomorrow
fails here.
"""

import ast
import re
from pathlib import Path

import pytest

from pipeline.diagnosis import explain
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.words import could_have_been_seen, headline
from pipeline.errors import InputError
from pipeline.messages import Message, catalogue, ended, entry, free_text
from pipeline.report.words import Words
from pipeline.result import CausePart, CauseRow
from rod.balance import BalanceOutcome
from rod.inverse import InverseOutcome
from rod.newton import Outcome

ROOT = Path(__file__).resolve().parents[2]
# Text of files and of errors of a caller, names of the forms of causes (data), and drawings: none is said to a user.
ELSEWHERE = (
    "pipeline/__init__.py",
    "pipeline/batch/batch.py",
    "pipeline/batch/orders.py",
    "pipeline/batch/store.py",
    "pipeline/cli/",
    "pipeline/compare.py",
    "pipeline/diagnosis/causes/",
    "pipeline/diagnosis/rediscovery.py",
    "pipeline/intake/template.py",
    "pipeline/messages/",
    "pipeline/predict.py",
    "pipeline/report/",
    "pipeline/result/visited.py",
    "pipeline/rounding.py",
    "pipeline/settings/",
    "pipeline/simulate/",
    "pipeline/vision/render/",
)
# Patterns, lists of synonyms and commands are no sentences.
NO_SENTENCES = re.compile(r"\||\\d|-o OUT")


def template(node):
    """String of a node with {} for each value; None if it is no string."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return re.sub(r"([{}])", r"\1\1", node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(template(part) if isinstance(part, ast.Constant) else "{}" for part in node.values)
    return None


def no_messages(node):
    """Whether strings below a node are documentation, or for the caller of a function."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant)
    if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
        name = getattr(node.exc.func, "id", "")  # functions that make an InputError have names of their own
        return name.endswith("Error") and name != "InputError"
    return isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Field"


def strings(node):
    """All strings below a node that are no documentation, as templates."""
    if no_messages(node):
        return
    if text := template(node):
        yield text
    inside = ast.iter_child_nodes(node)
    if isinstance(node, ast.JoinedStr):  # its parts are no strings of their own, what is put in may hold some
        inside = (part.value for part in node.values if isinstance(part, ast.FormattedValue))
    for child in inside:
        yield from strings(child)


MODULES = [path.relative_to(ROOT).as_posix() for path in sorted((ROOT / "pipeline").rglob("*.py"))]


def is_sentence(text):
    return len(re.findall(r"[A-Za-z]{2,}", text)) > 2 and re.search(r"[\w)}] [\w({]", text)


def test_no_sentence_is_written_into_a_room():
    rooms = [name for name in MODULES if not name.startswith(ELSEWHERE)]
    assert len(rooms) > 100
    for module in rooms:
        told = set(strings(ast.parse((ROOT / module).read_text(encoding="utf-8"))))
        assert [text for text in told if is_sentence(text) and not NO_SENTENCES.search(text)] == [], module


SIZES = [(0.00488, 0.00017, "N m"), (0.7, 0.0014, "1/m")]
FOUND = {"explained": 0.94, "change": 0.2, "beside": 0.0, "seen": free_text(""), "left": free_text("")}
LOUD = {"z": 9.0, "p_adjusted": 0.0, "estimate": 0.0, "std": 1.0, "surviving_fraction": 1.0}
SEEN = could_have_been_seen(
    [
        CauseRow(name="stiffness_varying", unit="-", minimal_detectable=0.00051, **LOUD),
        CauseRow(name="displacement_offset", unit="m", minimal_detectable=3.5e-6, **LOUD),
    ],
    19,
)


def test_an_amount_that_shows_in_one_form_only_is_not_told():
    row = CauseRow(name="displacement_offset", unit="m", minimal_detectable=3e-6, detectable_in_any_form=5e-5, **LOUD)
    assert "from 50 µm" in str(could_have_been_seen([row], 1)).replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.parametrize(
    ("verdict", "names", "values", "told"),
    [
        (
            "named",
            [["hysteresis"]],
            {},
            "Der Simulation fehlt: Hysterese (4,88 ± 0,17\u00a0mN m); auf Schritten, die das Modell nicht kannte, "
            "beseitigt diese Erweiterung 94 % der Abweichung, und f_EI ändert sich um 20 % (Effektivwert).",
        ),
        (
            "named",
            [["hysteresis"]],
            {"explained": None, "change": 3.704},
            "Der Simulation fehlt: Hysterese (4,88 ± 0,17\u00a0mN m), und f_EI ändert sich um 370 % (Effektivwert).",
        ),
        (
            "named",
            [["hysteresis"]],
            {"explained": None, "change": None, "beside": 0.55},
            "Der Simulation fehlt: Hysterese (4,88 ± 0,17\u00a0mN m); dass daneben etwas anderes wirkt, hat eine "
            "Wahrscheinlichkeit von 55 %.",
        ),
        (
            "class",
            [["bearing_friction", "hysteresis", "plastic_set"]],
            {"change": None},
            "Eine Ursache, die diese Daten nicht sicher benennen können: Lagerreibung, Hysterese oder bleibende "
            "Verformung (als Lagerreibung: 4,88 ± 0,17\u00a0mN m); auf Schritten, die das Modell nicht kannte, "
            "beseitigt diese Erweiterung 94 % der Abweichung.",
        ),
        (
            "two_causes",
            [["hysteresis"], ["pre_curvature_varying"]],
            {"explained": None, "change": None},
            "Zwei Ursachen wirken zusammen: Hysterese (4,88 ± 0,17\u00a0mN m) und veränderliche Vorkrümmung "
            "(0,7000 ± 0,0014\u00a01/m).",
        ),
        (
            "adequate",
            [],
            {"seen": SEEN},
            "Nichts jenseits des Rauschens: Die Simulation erklärt Kräfte und Fotos; 2 von 19 Ursachen hätten sich "
            "bei plausibler Größe gezeigt, etwa veränderliche Steifigkeit ab 0,051\u00a0%, Wegnullpunkt "
            "ab 3,5\u00a0µm.",
        ),
    ],
)
def test_headline_of_the_diagnosis(verdict, names, values, told):
    causes = [
        CausePart(name=group[0], **{"class": group}, probability=1.0, estimate=estimate, std=std, unit=unit)
        for group, (estimate, std, unit) in zip(names, SIZES, strict=False)
    ]
    sentence = headline(verdict, causes=causes, **{**FOUND, **values})
    assert Words("de").said(sentence).text == told


@pytest.mark.parametrize(
    ("sentence", "told"),
    [
        (
            Message(
                "way.inverse-open",
                outcome=ended(InverseOutcome.NOT_VISIBLE),
                open=[
                    Message("open.stiffness", at_per_m=3.4, std=0.2),
                    Message("open.stiffness", at_per_m=5.2, std=0.3),
                ],
            ),
            "inverses Problem: Die Daten legen nicht jeden Parameter fest (die offenen Kombinationen stehen daneben); "
            "weiter biegen, Schritte oder ein Foto des kraftfreien Kabels ergänzen; offen: "
            "f_EI bei 3,4 1/m (± 0,2 im Logarithmus); f_EI bei 5,2 1/m (± 0,3 im Logarithmus)",
        ),
        (
            Message("rig/moving-bearing", moving="left", stated="right"),
            "auf den Fotos bewegt sich das Lager links, specimen.toml sagt moving_bearing = \"right\"; die Kamera "
            "kann um 180 Grad gedreht sein, oder die Fotos sind gespiegelt",
        ),
        (
            Message("next.settled", by=entry("settled", "length_error")),
            "ein Maßband",
        ),
        (
            InputError(Message("toml/unknown-key", name="'lenght_mm'", table="specimen", near="length_mm"),
                       path="a b/specimen.toml", line=3).placed,
            "a b/specimen.toml, Zeile 3: der Schlüssel 'lenght_mm' ist in [specimen] nicht bekannt; "
            "in length_mm umbenennen oder entfernen.",
        ),
        (
            Message("log/not-a-number", role="force", cell="'1.2.3'", sign="point"),
            "Kraft '1.2.3' ist keine Zahl (Zahlen dieser Datei haben als Dezimalzeichen: Punkt); "
            "die Zelle berichtigen oder die Zeile entfernen",
        ),
        (
            Message(
                "log/branch-inferred",
                file="log.csv",
                counts=[
                    Message("log/branch-inferred.count", count=count, branch=branch)
                    for branch, count in (("mounted", 1), ("loading", 5), ("unloading", 4))
                ],
            ),
            "log.csv: Äste nach der Reihenfolge der Verschiebungen: 1 eingelegt, 5 Belastung, 4 Entlastung",
        ),
        (
            Message("log/force-std", file="force.csv", share=0.005, std_N=0.002),
            "force.csv: keine wiederholten Messwerte; als Standardabweichung einer Kraft gilt 0,5 % der größten Kraft, "
            "2\u00a0mN",
        ),
    ],
)  # fmt: skip
def test_sentences_put_together_are_taken_apart(sentence, told):
    assert str(Words("de").said(sentence)) == told
    assert Words("de").said(sentence).language == "de"


@pytest.mark.parametrize("outcome", [*InverseOutcome, *BalanceOutcome, *Outcome], ids=str)
def test_outcomes_are_told_in_both_languages(outcome):
    said = ended(outcome)
    assert said.said() == outcome.value and said.said("de") not in (outcome.value, "")


@pytest.mark.parametrize("name", ["pre_curvature", *(cause.name for cause in CATALOGUE)])
def test_causes_explain_themselves_in_both_languages(name):
    for language in ("en", "de"):
        texts = [*Message(f"cause.{name}").parts(language), entry("settled", name).said(language)]
        assert len(texts) == 6 and all(text in explain(name, language) for text in texts)
    assert catalogue("en")[f"cause.{name}"] != catalogue("de")[f"cause.{name}"]


def test_what_is_not_known_stays_and_is_called_english():
    said = Words("de").said(Message("photos.one", image="a.png", said=free_text("The moon is full.")))
    assert (said.text, said.language) == ("a.png: The moon is full.", "en")
    assert Words("de").cause("moon_phase") == "moon phase"

"""German twins: every sentence that can get into a result has one, none is left over, and stored ones find theirs.

The truth is the code itself: its strings are read from the syntax tree, so a finding written tomorrow without its
German twin fails here.
"""

import ast
import functools
import re
import string
from pathlib import Path

import pytest

from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.words import SPOKEN, could_have_been_seen, headline
from pipeline.errors import InputError
from pipeline.messages import Message, free_text
from pipeline.report.german import EDGES, entries
from pipeline.report.words import Words
from pipeline.result import CausePart, CauseRow
from rod.balance import BalanceOutcome
from rod.inverse import InverseOutcome

ROOT = Path(__file__).resolve().parents[3]
# What is written there never gets into a result: the command line speaks English, and so do its own files.
ELSEWHERE = (
    "pipeline/__init__.py",
    "pipeline/batch/batch.py",
    "pipeline/batch/orders.py",
    "pipeline/batch/store.py",
    "pipeline/cli/",
    "pipeline/compare.py",
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
    "rod/paper.py",
)
# Patterns, lists of synonyms and commands are no sentences.
NO_SENTENCES = re.compile(r"\||\\d|-o OUT")
GERMAN = dict(entries())


def shown(text):
    """A string of the code as the catalogue has it: gaps side by side are one, edges and a pair of brackets are off."""
    text = re.sub(r"(\{\})+", "{}", text).strip(EDGES)
    return text[1:-1] if text[:1] == "(" and text[-1:] == ")" else text


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
        yield shown(text)
    inside = ast.iter_child_nodes(node)
    if isinstance(node, ast.JoinedStr):  # its parts are no strings of their own, what is put in may hold some
        inside = (part.value for part in node.values if isinstance(part, ast.FormattedValue))
    for child in inside:
        yield from strings(child)


MODULES = [
    path.relative_to(ROOT).as_posix() for room in ("pipeline", "rod") for path in sorted((ROOT / room).rglob("*.py"))
]
MODULES = [name for name in MODULES if not name.startswith(ELSEWHERE)]


@functools.cache
def strings_of(module):
    return set(strings(ast.parse((ROOT / module).read_text(encoding="utf-8"))))


@pytest.mark.parametrize("module", MODULES)
def test_every_sentence_has_a_german_twin(module):
    sentences = {
        text
        for text in strings_of(module)
        if len(re.findall(r"[A-Za-z]{2,}", text)) > 1 and re.search(r"[\w)}] [\w({]", text)
        if not NO_SENTENCES.search(text)
    }
    # each of these needs a line in pipeline/report/templates/german; names of causes have theirs in words.toml
    assert sorted(sentences - GERMAN.keys() - set(SPOKEN.values())) == []


def test_no_twin_is_left_over():
    assert sorted(GERMAN.keys() - set().union(*map(strings_of, MODULES))) == []


def test_both_have_the_same_gaps():
    def gaps(text):
        return sum(field is not None for _, field, _, _ in string.Formatter().parse(text))

    assert [english for english, german in GERMAN.items() if gaps(english) != gaps(german)] == []
    assert [german for german in GERMAN.values() if german != german.rstrip(" .")] == []


SIZES = [(0.00488, 0.00017, "N m"), (0.7, 0.0014, "1/m")]
FOUND = {"explained": 0.94, "change": 0.2, "weakest": "", "leftover": ""}
LOUD = {"z": 9.0, "p_adjusted": 0.0, "estimate": 0.0, "std": 1.0, "surviving_fraction": 1.0}
SEEN = could_have_been_seen(
    [
        CauseRow(name="stiffness_varying", unit="-", minimal_detectable=0.00051, **LOUD),
        CauseRow(name="displacement_offset", unit="m", minimal_detectable=3.5e-6, **LOUD),
    ],
    19,
)


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
            {"weakest": SEEN},
            "Nichts jenseits des Rauschens: Die Simulation erklärt Kräfte und Fotos; 2 von 19 Ursachen hätten sich "
            "bei plausibler Größe gezeigt, etwa veränderliche Steifigkeit ab 0,00051, Wegnullpunkt ab 3,5\u00a0µm.",
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
                outcome=free_text(InverseOutcome.NOT_VISIBLE.value),
                open=[
                    free_text("f_EI at 3.4 1/m (+- 0.2 in the logarithm)"),
                    free_text("f_EI at 5.2 1/m (+- 0.3 in the logarithm)"),
                ],
            ),
            "inverses Problem: die Daten legen nicht jeden Parameter fest (die offenen Kombinationen stehen daneben); "
            "weiter biegen, Schritte oder ein Foto des kraftfreien Kabels ergänzen; offen: "
            "f_EI bei 3,4 1/m (± 0,2 im Logarithmus); f_EI bei 5,2 1/m (± 0,3 im Logarithmus)",
        ),
        (
            Message("rig/moving-bearing", moving="left", stated="right"),
            "auf den Fotos bewegt sich das Lager links, specimen.toml sagt moving_bearing = \"right\"; die Kamera "
            "kann um 180 Grad gedreht sein, oder die Fotos sind gespiegelt",
        ),
        ("a tape measure (length_error)", "ein Maßband (Längenfehler)"),
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


@pytest.mark.parametrize("outcome", [*InverseOutcome, *BalanceOutcome], ids=lambda outcome: outcome.name)
def test_outcomes_are_known_whole(outcome):
    told = Words("de").said(Message("headline.none", advice=free_text(outcome.value))).text
    assert told == f"Keine Kennlinie wurde gemessen: {GERMAN[shown(outcome.value)]}."


def test_causes_are_explained_in_german():
    said = Words("de").said
    for cause in CATALOGUE:
        for text in (cause.summary, cause.sign_means, cause.needs, cause.apart, cause.remedy, cause.settled_by):
            assert said(text).text.rstrip(".") == GERMAN[shown(text)]


@pytest.mark.parametrize(
    "text",
    [
        "My own cause: the moon is full.",
        "fotos/a and b 1.5.png",
        "2.1.0",
        "–",
        "The fixed (right) bearing wanders over the photos; camera or frame moved.",  # some of its words are known
    ],
)
def test_what_is_not_known_stays_and_is_called_english(text):
    said = Words("de").said(text)
    assert (said.text, said.language) == (text, "en")


def test_english_stays_english():
    said = Words("en").said("f_EI at 5.2 1/m (+- 0.3 in the logarithm)")
    assert (said.text, said.language) == ("f_EI at 5.2 1/m (± 0.3 in the logarithm)", "en")

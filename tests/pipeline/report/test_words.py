"""Words: both languages complete, the same values in both, every key used, nothing asked for that is not there."""

import re
import string
import tomllib
from pathlib import Path

import pytest

from pipeline.diagnosis.causes import CATALOGUE
from pipeline.messages import Message
from pipeline.report.words import TABLE, Words

SOURCES = [p for p in Path(TABLE).parents[1].rglob("*") if p.suffix in (".py", ".html")]
SECTIONS = tomllib.loads(Path(TABLE).read_text(encoding="utf-8"))
ENTRIES = {f"{section}.{key}": texts for section, rows in SECTIONS.items() for key, texts in rows.items()}


def fields(text):
    return {name for _, name, _, _ in string.Formatter().parse(text) if name}


def test_every_entry_has_two_languages_with_the_same_values():
    assert len(ENTRIES) > 300
    for key, (english, german) in ENTRIES.items():
        assert english.strip() and german.strip(), key
        assert fields(english) == fields(german), key


def test_every_word_is_used():
    text = "".join(path.read_text(encoding="utf-8") for path in SOURCES)
    prefixes = set(re.findall(r"""["']([a-z0-9]+(?:_[a-z0-9]+)*_)(?:\{|["'] ~)""", text))
    for key in (name.split(".")[1] for name in ENTRIES):
        assert re.search(rf"""["']{key}["']""", text) or any(key.startswith(prefix) for prefix in prefixes), (
            f"{key} is never used"
        )


def test_every_cause_of_the_contract_has_a_name():
    for name in ("pre_curvature", *(cause.name for cause in CATALOGUE)):
        assert Words().cause(name) != Words("de").cause(name)
    assert Words().cause("pre_curvature_varying") == "varying pre-curvature"
    assert Words().cause("bearing_friction") == "bearing friction"
    assert Words("de").cause("hysteresis") == "Hysterese"
    assert Words("de").cause("my_new_cause") == "my new cause"


def test_unknown_language_is_a_mistake_of_the_caller():
    with pytest.raises(ValueError, match="one of en, de"):
        Words("fr")


def test_unknown_key_is_not_passed_over():
    with pytest.raises(KeyError):
        Words()("no such words")


def test_tails_of_probability_are_not_claimed():
    assert Words().probability(1e-30) == "< 0.0001"
    assert Words("de").probability(0.432) == "0,43"


def test_a_specimen_is_called_as_it_is_written():
    refused = Message("sentences", sentences=[Message("opening.failed", id="plain", reason="no photo")])
    assert str(refused) == Words().said(refused).sentence == "Specimen plain was not measured: no photo."
    assert Words().said(Message("comparison.unusable", name="plain", reason="")).sentence.startswith("plain is not")
    assert Words().said(Message("text", text="plain words begin a sentence")).sentence.startswith("Plain words")

"""The one error of a user's file: whatever it quotes, one short line that a terminal shows."""

import pickle
from pathlib import Path

from pipeline.errors import InputError


def test_a_sentence_is_one_short_line_whatever_it_quotes():
    quoted = "a\tb\n\x1b[2J\u202e\udcff"
    error = InputError(
        f"{quoted} {'x' * 100_000} end", path=Path(f"odd {quoted}"), line=3, code="a/b", remedy=f"give {quoted}"
    )
    assert error.sentence.isprintable()
    assert error.sentence.startswith(r"odd a\tb\n\x1b[2J\u202e\udcff, line 3: a\tb")
    assert " ... " in error.sentence
    assert " end; give a" in error.sentence
    assert len(error.sentence) < 800
    assert str(error) == error.sentence == pickle.loads(pickle.dumps(error)).sentence


def test_a_usual_sentence_is_as_it_was_written():
    error = InputError(
        "'Weg\xa0/ µm' is no column", path="Prüfling Ω/force.csv", line=3, code="a/b", remedy="correct it"
    )
    assert error.sentence == "Prüfling Ω/force.csv, line 3: 'Weg\xa0/ µm' is no column; correct it."

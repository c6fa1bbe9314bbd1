"""The one error of a user's file: whatever it quotes, one short line that a terminal shows."""

import pickle
from pathlib import Path

from pipeline.errors import InputError
from pipeline.messages import Message, free_text


def test_a_sentence_is_one_short_line_whatever_it_quotes():
    quoted = "a\tb\n\x1b[2J\u202e\udcff"
    told = Message("log/no-column", role="force", names=f"{quoted} {'x' * 100_000} end")
    error = InputError(told, path=Path(f"odd {quoted}"), line=3)
    assert error.sentence.isprintable()
    assert error.sentence.startswith(r"odd a\tb\n\x1b[2J\u202e\udcff, line 3: no column of force among a\tb")
    assert " ... " in error.sentence
    assert " end; " in error.sentence
    assert len(error.sentence) < 800
    assert str(error) == error.sentence == pickle.loads(pickle.dumps(error)).sentence


def test_a_usual_sentence_is_as_it_was_written():
    error = InputError(free_text("'Weg\xa0/ µm' is no column; correct it"), path="Prüfling Ω/force.csv", line=3)
    assert error.sentence == "Prüfling Ω/force.csv, line 3: 'Weg\xa0/ µm' is no column; correct it."

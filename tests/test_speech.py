"""What commands say: German where it was asked for, no line wider than the terminal, who is at which stage."""

import json
import re
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from pipeline.batch import Tally, run_batch
from pipeline.cli import main, speech
from pipeline.cli.design import echo_outlook
from pipeline.cli.group import COMMANDS
from pipeline.cli.predict import echo_findings
from pipeline.cli.run import echo_json
from pipeline.diagnosis.plans.design import Plan, design
from pipeline.messages import Message, catalogue
from pipeline.records import doubtful
from pipeline.settings import Settings
from tests.pipeline.cheap_batch import cheap_stages, write_specimens

BROKEN = Path(__file__).resolve().parents[1] / "fixtures" / "broken"


def call(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("toml/missing-key", "in [specimen]; ergänzen: "),
        ("log/not-a-number", "ist keine Zahl (Zahlen dieser Datei haben als Dezimalzeichen: "),
        ("folder/no-photos", "hat kein Foto, das verwendet werden kann"),
    ],
)
def test_check_speaks_german(code, told):
    done = call("check", BROKEN / code / "specimen", "--language", "de")
    assert told in done.output and "Fehler" in done.output and "error" not in done.output


def test_a_folder_that_is_not_there_is_missed_in_one_language():
    assert "'no-such' gibt es nicht" in (said := call("report", "no-such", "--language", "de").output)
    assert "irectory" not in said


@pytest.mark.parametrize("name", COMMANDS)
def test_help_is_german_wherever_the_language_is_asked_for(name):
    said = {call(*order).output for order in ([name, "--help", "--language", "de"], ["--language=de", name, "-h"])}
    (german,) = said
    english = call(name, "--help").output
    assert german.startswith("Aufruf:") and english.startswith("Usage:")
    lines = {line.strip() for line in german.splitlines() if len(re.findall("[a-zäöüß]{2,}[ .]", line)) > 2}
    assert lines and not lines & {line.strip() for line in english.splitlines()}


def test_the_catalogue_says_what_every_option_does_and_no_other():
    group = click.Context(main)
    commands = [main, *(main.get_command(group, name) for name in COMMANDS)]
    own, shared = set(), set()
    for command in commands:
        own.add(f"help.{command.name}")
        for option in command.get_params(group):
            if isinstance(option, click.Option):
                name = option.opts[-1].lstrip("-")
                own.add(f"help.{command.name}.{name}")
                shared.add(f"help.{name}")
    told = {key for key in catalogue("en") if key.startswith("help.")}
    assert told <= own | shared and {f"help.{name}" for name in ("main", *COMMANDS)} <= told
    listed = call("--help", "--language", "de").output
    assert all(catalogue("de")[f"help.{name}"][0] in listed for name in COMMANDS)


@pytest.mark.parametrize(
    ("arguments", "german", "english"),
    [
        (("runn",), "Den Befehl 'runn' gibt es nicht.", "No such command"),
        (("run", "--foo"), "Die Angabe '--foo' gibt es nicht.", "No such option"),
        (("predict", "x"), "Es fehlt die Angabe '--displacement-mm'.", "Missing option"),
        (("run", "x", "--workers", "0"), "0 liegt nicht im Bereich x>=1", "0 is not in the range x>=1"),
        (("init",), "einen Ordner FOLDER mit Fotos angeben", "give a FOLDER of photos"),
        (("explain", "stifness_varying"), "ist stiffness_varying gemeint?", "did you mean stiffness_varying?"),
        (("predict", "x", "--displacement-mm", "5;6"), "ist keine Liste von Zahlen", "is no list of numbers"),
        (("simulate", "x", "--hide", "bearing_friction=x"), "mit endlichen Zahlen", "with finite numbers"),
        (("simulate", "x", "--hide", "rigid_ends=-1"), "was rigid_ends nicht sein kann", "which rigid_ends cannot be"),
        (("simulate", "x", "--hide", "plastic"), "die nächste ist plastic_set", "the nearest is plastic_set"),
        (("simulate", "x", "--k0", "40"), "rollt 181 mm Kabel", "rolls 181 mm of cable"),
        (("simulate", "x", "--length-mm", "4"), "die Länge größer als", "the length above"),
        (("design", "--step-mm", "100"), "der geplante Versuch ist nicht möglich", "the planned test cannot be made"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_wrong_use_is_told_in_the_language_asked_for(arguments, german, english):
    done = call(*arguments, "--language", "de")
    assert done.exit_code == 2
    assert german in done.stderr and done.stderr.startswith("Aufruf:")
    other = call(*arguments)
    assert english in other.stderr and other.stderr.startswith("Usage:")


def test_errors_of_the_command_itself_are_german_too():
    done = call("run", BROKEN, "-o", "out", "--set", "intake.nothing_alike=3", "--language", "de")
    assert done.exit_code == 2
    assert done.stderr.startswith("cablebend: die Einstellung intake.nothing_alike ist nicht bekannt; ")
    assert "nothing_alike is not known" in call("run", BROKEN, "-o", "out", "--set", "intake.nothing_alike=3").stderr


def test_a_name_is_proposed_only_where_one_is_near():
    near = call("run", BROKEN, "-o", "out", "--set", "intake.log_max_byte=3").stderr
    far = call("run", BROKEN, "-o", "out", "--set", "intake.weather=3").stderr
    assert "the nearest one is intake.log_max_bytes" in near
    assert "nearest" not in far and "init --settings" in far


def test_tables_fit_a_terminal_and_are_a_line_a_record_in_a_pipe(monkeypatch, capsys):
    found = design(Plan(), Settings().diagnosis)
    lines = {}
    for width in (80, None):
        monkeypatch.setattr(speech, "columns", lambda width=width: width)
        monkeypatch.setattr("pipeline.cli.design.columns", lambda width=width: width)
        echo_outlook(found)
        lines[width] = capsys.readouterr().out.splitlines()
    assert max(map(len, lines[80])) <= 80
    (record,) = [line for line in lines[None] if line.startswith("bearing_friction")]
    assert "of its trace survives; like " in record
    (alone,) = [line for line in lines[None] if line.startswith("hysteresis")]  # on loading f_EI takes it over
    assert "survives; what helps: unload" in alone


def test_long_words_and_names_are_wrapped_beside_their_begin(monkeypatch):
    monkeypatch.setattr(speech, "columns", lambda: 40)
    lines = speech.entry("cable-07  measured  ", "the simulation explains forces and photos " * 3).splitlines()
    assert max(map(len, lines)) <= 40 and all(line.startswith(" " * 13) for line in lines[1:])


@pytest.mark.parametrize(
    "order",
    [["explain"], ["explain", "codes"], ["explain", "hysteresis"], ["check", "toml/missing-key/specimen"], ["design"]],
)
def test_pages_and_findings_fit_a_terminal(monkeypatch, order):
    for place in (speech, sys.modules["pipeline.cli.design"]):
        monkeypatch.setattr(place, "columns", lambda: 80)
    monkeypatch.chdir(BROKEN)
    lines = CliRunner().invoke(main, [*order, "--language", "de"], color=True).output.splitlines()
    assert len(lines) > 2 and max(len(click.unstyle(line)) for line in lines) <= 80


def test_what_makes_a_comparison_doubtful_fits_a_terminal(monkeypatch, capsys):
    monkeypatch.setattr(speech, "columns", lambda: 80)
    echo_findings([doubtful("compare/method", a="inverse", b="balance"), doubtful("compare/length", lengths_m=[1, 2])])
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("warning: One answers with the curve of the inverse problem, the other with that")
    assert len(lines) > 3 and max(map(len, lines)) <= 80


@pytest.mark.parametrize("batch", [{"in_process": True}, {"workers": 2}])
def test_the_stage_of_each_specimen_is_told(batch, tmp_path):
    write_specimens(tmp_path / "batch", ["a", "b", "c"])
    folders, told = sorted((tmp_path / "batch").iterdir()), []
    settings = Settings.model_validate({"batch": batch})
    run_batch(
        folders,
        tmp_path / "out",
        settings,
        stages=cheap_stages(),
        on_stage=lambda name, stage: told.append((name, stage)),
    )
    assert sorted(told) == [("a", "reports"), ("b", "reports"), ("c", "reports")]  # of a measurement of one's own


def test_what_else_is_to_say_stands_in_the_document_too(tmp_path, capsys):
    fault = Message("fault.none-of-its-type", times=1000.0, others=3, type="HV 35")
    tally = Tally(1, ("a",), measured=1, trouble=(Message("cli.outlying", name="a", said=fault),))
    echo_json(iter([]), tally, tmp_path)
    (told,) = json.loads(capsys.readouterr().out)["trouble"]
    assert told.startswith("a: f_EI is 1000 times that of the other 3 specimens")

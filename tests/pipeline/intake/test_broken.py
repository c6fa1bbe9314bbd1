"""Every error code has a broken folder in fixtures/broken and a sentence that is compared word for word."""

import ast
import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from pipeline.cli import main
from pipeline.messages import catalogue

ROOT = Path(__file__).resolve().parents[3]
BROKEN = ROOT / "fixtures" / "broken"
CASES = sorted(path.parent.relative_to(BROKEN).as_posix() for path in BROKEN.glob("*/*/specimen"))


def codes_in_source() -> set[str]:
    """Codes of all `InputError`s: sentences with a remedy, and where none is in the catalogue what is given as code."""
    told = {key.partition(".")[0] for key, texts in catalogue("en").items() if len(texts) == 2}
    codes = {code for code in told if "/" in code}  # the help of commands has two texts as well
    for path in (ROOT / "pipeline").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "InputError":
                given = [keyword.value for keyword in node.keywords if keyword.arg == "code"]
                codes |= {value.value for value in given if isinstance(value, ast.Constant)}
    return codes


def test_every_error_code_has_its_fixture_and_no_fixture_is_left_over():
    fixtures = {path.parent.relative_to(BROKEN).as_posix() for path in BROKEN.glob("*/*/sentence.txt")}
    assert codes_in_source() == fixtures


def sentences(output: str, errors: str) -> list[tuple[str | None, str]]:
    """Code (where it is told) and sentence of everything a command complained about."""
    found: list[tuple[str | None, str]] = [
        (None, line.removeprefix("cablebend: ")) for line in errors.splitlines() if line.startswith("cablebend: ")
    ]
    if output.startswith("{"):
        for specimen in json.loads(output)["specimens"]:
            found += [(note["code"], note["message"]) for note in specimen.get("findings", [])]
            if "headline" in specimen:
                found.append((specimen["code"], specimen["headline"]))
    return found


@pytest.mark.parametrize("code", CASES)
def test_sentence_word_for_word(code, tmp_path, monkeypatch):
    here = tmp_path / "here"
    shutil.copytree(BROKEN / code, here, symlinks=True)
    monkeypatch.chdir(here)
    command = here / "command.txt"
    arguments = command.read_text().split() if command.exists() else ["check", "--json", "specimen"]
    result = CliRunner().invoke(main, arguments)
    told = [(name, text.replace(f"{here}/", "")) for name, text in sentences(result.stdout, result.stderr)]
    expected = (BROKEN / code / "sentence.txt").read_text(encoding="utf-8").rstrip("\n")
    assert told and told[0] in ((code, expected), (None, expected))
    assert result.exit_code in (2, 3)
    assert isinstance(result.exception, SystemExit)

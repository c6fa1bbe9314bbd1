"""`cablebend init`: the template says what is there, and is a valid description once the two lengths are filled in."""

import pytest

from pipeline.errors import InputError
from pipeline.intake.template import write_template
from pipeline.settings.intake import IntakeSettings


def test_template_is_refused_until_it_is_filled_in(specimen_folder):
    folder = specimen_folder()
    (folder.path / "specimen.toml").unlink()
    (folder.path / "force.csv").rename(folder.path / 'Kraft "A".csv')
    path = write_template(folder.path, IntakeSettings())
    text = path.read_text(encoding="utf-8")
    assert "3 photos" in text
    with pytest.raises(InputError) as refused:
        folder.read()
    assert (refused.value.code, refused.value.line) == ("toml/wrong-value", 6)
    path.write_text(
        text.replace("length_mm = 0.0", "length_mm = 181.0").replace("diameter_mm = 0.0", "diameter_mm = 4.6")
    )
    assert len(folder.read().steps) == 3


def test_every_optional_line_is_valid_when_the_hash_is_removed(specimen_folder):
    folder = specimen_folder()
    folder.write("calibration/board.png", "x")
    (folder.path / "specimen.toml").unlink()
    text = write_template(folder.path, IntakeSettings()).read_text(encoding="utf-8")
    lines = [
        line.removeprefix("# ") if line.startswith("# ") and ("=" in line.split("#")[1] or "[[" in line) else line
        for line in text.splitlines()
    ]
    text = "\n".join(lines[2:]).replace("_mm = 0.0", "_mm = 50.0")
    text = "\n".join(line for line in text.splitlines() if not line.startswith(("columns", "decimal", "separator")))
    folder.write("specimen.toml", text)
    assert len(folder.read().steps) == 3


def test_an_existing_description_is_kept(specimen_folder):
    folder = specimen_folder()
    with pytest.raises(InputError) as refused:
        write_template(folder.path, IntakeSettings())
    assert refused.value.code == "init/exists"

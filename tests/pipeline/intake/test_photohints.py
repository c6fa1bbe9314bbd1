"""What a person says about single photos in specimen.toml: read with its lines, obeyed, never a reason to stop."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pipeline.errors import InputError
from pipeline.intake.folder import read_specimen
from pipeline.records import PhotoHints
from pipeline.settings.intake import IntakeSettings

THREE = Path(__file__).resolve().parents[3] / "fixtures" / "specimens" / "three"


@pytest.fixture
def folder(tmp_path):
    return Path(shutil.copytree(THREE, tmp_path / "three"))


def _with(folder, lines):
    file = folder / "specimen.toml"
    file.write_text(file.read_text(encoding="utf-8") + "\n" + lines, encoding="utf-8")
    return read_specimen(folder, IntakeSettings())


def test_a_photo_left_out_leaves_its_step_with_its_force(folder):
    before = read_specimen(folder, IntakeSettings())
    name = before.steps[1].image
    after = _with(folder, f'[[photos]]\nimage = "{name}"\nuse = false\n')
    assert after.steps[1].image is None
    assert after.steps[1].force_N == before.steps[1].force_N
    assert [finding.code for finding in after.findings if finding.code == "photo/left-out"]


def test_all_that_can_be_said_is_read(folder):
    name = read_specimen(folder, IntakeSettings()).steps[0].image
    lines = f"""[[photos]]
image = "{name}"
ends_px = [[1, 2], [3, 4]]
path_px = [[1, 2], [2, 2.5], [3, 4]]
region_px = [0, 0, 100, 50]
exclude_px = [[[1, 1], [2, 1], [2, 2]]]
"""
    hints = _with(folder, lines).hints[name]
    corners = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0))
    path = ((1.0, 2.0), (2.0, 2.5), (3.0, 4.0))
    assert hints == PhotoHints(True, ((1.0, 2.0), (3.0, 4.0)), path, (0.0, 0.0, 100.0, 50.0), (corners,))


def test_a_photo_that_was_deleted_is_passed_over(folder):
    told = _with(folder, '[[photos]]\nimage = "images/gone.png"\nuse = false\n').findings
    assert "photo/hint-unused" in [finding.code for finding in told]


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("regoin_px = [0, 0, 1, 1]", "toml/unknown-key"),
        ("region_px = [5, 0, 1, 1]", "toml/wrong-value"),
        ("path_px = [[1, 2]]", "toml/wrong-value"),
        ("ends_px = [[1, 2], [3, 4], [5, 6]]", "toml/wrong-value"),
    ],
)
def test_a_slip_is_told_with_its_line(folder, line, code):
    with pytest.raises(InputError) as told:
        _with(folder, f'[[photos]]\nimage = "a.png"\n{line}\n')
    assert told.value.code == code
    lines = (folder / "specimen.toml").read_text(encoding="utf-8").split("\n")
    assert told.value.line == lines.index(line) + 1


def test_a_table_without_a_photo_is_refused(folder):
    with pytest.raises(InputError, match="image is missing"):
        _with(folder, "[[photos]]\nuse = false\n")

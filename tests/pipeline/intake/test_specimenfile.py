"""specimen.toml: every key, and every refusal with its line."""

import pytest

from pipeline.errors import InputError
from pipeline.intake.specimenfile import asked_of_log, read_source, read_specimen_file
from pipeline.settings.intake import IntakeSettings

SETTINGS = IntakeSettings()
FULL = """\
[specimen]
id = "cable-07"
length_mm = 181.0
diameter_mm = 4.6
type = "H07V-K"
batch = 12
notes = 2026-11-21
temperature_C = 23.5

[camera]
scale_px_per_mm = 11
calibration = "calibration"
board = {columns = 9, rows = 6, square_mm = 10.0, charuco = true, marker_mm = 7.5}
distance_mm = 400

[rig]
moving_bearing = "right"
bearing_marker_mm = 12.0
bearings_px = [[100, 500.5], [2000, 498]]
force_sign = "tension"

[force_log]
file = "log.txt"
columns = {force = "Kraft [N]", displacement = 3}
units = {force = "mN"}
separator = ";"
decimal = ","
encoding = "cp1252"
"""


def read(folder, text):
    (folder / "calibration").mkdir(exist_ok=True)
    (folder / "specimen.toml").write_text(text, encoding="utf-8")
    return read_specimen_file(folder, SETTINGS)


def test_every_key(tmp_path):
    file = read(tmp_path, FULL)
    assert (file.id, file.length_m, file.diameter_m) == ("cable-07", pytest.approx(0.181), pytest.approx(0.0046))
    assert file.description == {"type": "H07V-K", "batch": "12", "notes": "2026-11-21", "temperature_C": "23.5"}
    assert file.camera.scale_px_per_m == pytest.approx(11e3)
    assert file.camera.calibration == tmp_path / "calibration"
    assert file.camera.distance_m == pytest.approx(0.4)
    board = file.camera.board
    assert (board.columns, board.rows, board.square_m, board.charuco, board.marker_m) == (9, 6, 0.01, True, 0.0075)
    assert file.rig.moving_bearing == "right"
    assert file.rig.marker_diameter_m == pytest.approx(0.012)
    assert file.rig.bearings_px == ((100.0, 500.5), (2000.0, 498.0))
    log = asked_of_log(read_source(tmp_path, SETTINGS))
    assert file.rig.force_sign == log.force_sign == "tension"
    assert (log.file, log.separator, log.decimal, log.encoding) == ("log.txt", ";", ",", "cp1252")
    assert log.columns == {"force": "Kraft [N]", "displacement": 3}
    assert log.units == {"force": "mN"}


def test_with_byte_order_mark_and_windows_lines(tmp_path):
    (tmp_path / "specimen.toml").write_bytes(b"\xef\xbb\xbf" + FULL.replace("\n", "\r\n").encode())
    (tmp_path / "calibration").mkdir()
    assert read_specimen_file(tmp_path, SETTINGS).id == "cable-07"


def test_id_is_the_folders_name(tmp_path):
    folder = tmp_path / "Kabel 7"
    folder.mkdir()
    assert read(folder, "[specimen]\nlength_mm = 100\ndiameter_mm = 5\n").id == "Kabel 7"


@pytest.mark.parametrize(
    ("old", "new", "code", "line"),
    [
        ("length_mm = 181.0", 'length_mm = "181"', "toml/wrong-value", 3),
        ("length_mm = 181.0", "length_mm = nan", "toml/wrong-value", 3),
        ("length_mm = 181.0", "length_mm = true", "toml/wrong-value", 3),
        ("length_mm = 181.0", "length_mm = 181_000.0", "toml/wrong-value", 3),
        ("length_mm = 181.0", "length_mm = " + "9" * 400, "toml/wrong-value", 3),
        ("length_mm = 181.0", "length_mm = " + "9" * 5000, "toml/syntax", None),
        ("length_mm = 181.0", "", "toml/missing-key", 1),
        ('id = "cable-07"', 'id = "../cable"', "toml/wrong-value", 2),
        ('id = "cable-07"', 'id = ".."', "toml/wrong-value", 2),
        ('id = "cable-07"', 'id = "con\\u0000"', "toml/wrong-value", 2),
        ('id = "cable-07"', 'id = ""', "toml/wrong-value", 2),
        ("diameter_mm = 4.6", "diamter_mm = 4.6", "toml/unknown-key", 4),
        ("[rig]", "[ring]", "toml/unknown-table", 16),
        ('moving_bearing = "right"', 'moving_bearing = "links"', "toml/wrong-value", 17),
        ("[[100, 500.5], [2000, 498]]", "[[100, 500.5]]", "toml/wrong-value", 19),
        ("[[100, 500.5], [2000, 498]]", "[[1, 2], [1, 2]]", "toml/wrong-value", 19),
        ("rows = 6", "rows = 6.5", "toml/wrong-value", 13),
        (", square_mm = 10.0", "", "toml/wrong-value", 13),
        ('calibration = "calibration"', 'calibration = "../elsewhere"', "file/outside", 12),
        ('calibration = "calibration"', 'calibration = "elsewhere"', "camera/no-calibration-folder", 12),
        ('force = "Kraft [N]"', 'power = "Kraft [N]"', "toml/wrong-value", 24),
        ('separator = ";"', 'separator = ":"', "toml/wrong-value", 26),
        ("[camera]", "[camera", "toml/syntax", 10),
        ("[specimen]", "specimen = 3\n[other]", "toml/unknown-table", 2),
    ],
)
def test_refusals_name_the_line(old, new, code, line, tmp_path):
    with pytest.raises(InputError) as refused:
        read(tmp_path, FULL.replace(old, new, 1))
    assert (refused.value.code, refused.value.line) == (code, line)


@pytest.mark.parametrize(
    ("misspelt", "meant"),
    [("lenght_mm", "length_mm"), ("diam_mm", "diameter_mm"), ("Length_mm", "length_mm"), ("temp_c", "temperature_C")],
)
def test_the_nearest_key_is_named(misspelt, meant, tmp_path):
    with pytest.raises(InputError) as refused:
        read(tmp_path, FULL.replace("notes", misspelt))
    assert f"rename it to {meant}" in refused.value.sentence


def test_deep_nesting_is_a_syntax_error(tmp_path):
    with pytest.raises(InputError) as refused:
        read(tmp_path, "a = " + "[" * 100_000)
    assert refused.value.code == "toml/syntax"


@pytest.mark.parametrize("again", ["length_mm = 182.0", "[specimen]", "x = {a = 1, a = 2}"])
def test_what_stands_twice_is_called_so(again, tmp_path):
    (tmp_path / "specimen.toml").write_text(f"[specimen]\nlength_mm = 181.0\n{again}\n")
    with pytest.raises(InputError, match=r"a second time \(.*\); keep one of the two") as refused:
        read_specimen_file(tmp_path, SETTINGS)
    assert (refused.value.code, refused.value.line) == ("toml/syntax", 3)

"""`cablebend check` looks at the photos: each fault of a picture is told with its code, and nothing is measured."""

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from pipeline.cli import main
from pipeline.intake.folder import read_specimen
from pipeline.settings import Settings
from pipeline.vision.series import look_at_photos

ROOT = Path(__file__).resolve().parents[2]
FIRST, OTHER = "step_00.jpg", "step_01.jpg"


@pytest.fixture
def folder(tmp_path):
    return Path(shutil.copytree(ROOT / "fixtures/specimens/three", tmp_path / "a"))


def picture(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def truncated(path, _):
    path.write_bytes(path.read_bytes()[:-20_000])


def black(path, _):
    cv2.imwrite(str(path), np.zeros_like(picture(path)))


def blurred(path, _):
    cv2.imwrite(str(path), cv2.GaussianBlur(picture(path), (0, 0), 10.0))


def smeared(path, _):
    cv2.imwrite(str(path), cv2.GaussianBlur(picture(path), (0, 0), 40.0))


def smaller(path, _):
    pixels = picture(path)
    cv2.imwrite(str(path), cv2.resize(pixels, (pixels.shape[1] // 2, pixels.shape[0] // 2)))


def turned(path, _):
    cv2.imwrite(str(path), cv2.rotate(picture(path), cv2.ROTATE_90_COUNTERCLOCKWISE))


def doubled(path, other):
    shutil.copy(other, path)


def checked(folder):
    done = CliRunner().invoke(main, ["check", "--json", str(folder), "--set", "batch.in_process=true"])
    return done.exit_code, json.loads(done.stdout)["specimens"][0]


def test_good_photos_are_no_news(folder):
    code, row = checked(folder)
    assert (code, row["status"], row["runs"]) == (0, "ok", True)
    assert not (folder / "result.json").exists()


@pytest.mark.parametrize(
    ("spoil", "codes"),
    [
        (truncated, {"photo/truncated"}),
        (black, {"photo/blank"}),
        (blurred, {"photo/blur"}),
        # smeared over forty pixels a cable hardly stands out, and no cover has a rim
        (smeared, {"photo/blur", "photo/contrast", "photo/bearing"}),
        (smaller, {"photo/size"}),
        (doubled, {"photo/doubled"}),
        (turned, {"photo/turned"}),
    ],
)
def test_a_spoilt_photo_is_told(folder, spoil, codes):
    spoil(folder / "images" / OTHER, folder / "images" / FIRST)
    code, row = checked(folder)
    told = {finding["code"]: finding for finding in row["findings"] if finding["level"] != "info"}
    assert (code, row["status"], row["runs"]) == (0, "warning", True)
    assert told.keys() & codes and OTHER in " ".join(finding["message"] for finding in told.values())


def test_no_photo_that_can_be_used_is_an_error(folder):
    for path in (folder / "images").iterdir():
        black(path, None)
    code, row = checked(folder)
    assert (code, row["status"], row["runs"]) == (3, "error", False)
    assert {f["code"] for f in row["findings"] if f["level"] == "error"} == {"photo/blank"}


def test_a_fault_of_several_photos_is_one_sentence_with_their_names(folder):
    for path in (folder / "images").iterdir():
        black(path, None)
    (message,) = [f["message"] for f in checked(folder)[1]["findings"] if f["code"] == "photo/blank"]
    assert message.startswith("3 photos (images/step_00.jpg, images/step_01.jpg, ")


def test_sizes_that_all_differ_are_named(folder):
    for number, path in enumerate(sorted((folder / "images").iterdir())):
        cv2.imwrite(str(path), cv2.copyMakeBorder(picture(path), *[8 * number] * 4, cv2.BORDER_REPLICATE))
    (told,) = [f for f in checked(folder)[1]["findings"] if f["code"] == "photo/size"]
    assert all(size in told["message"] for size in ("1120 x 420 px", "1136 x 436 px", "1152 x 452 px"))


def test_a_picture_of_a_telephone_is_told_once(folder):
    heic = b"\0\0\0\x18ftypheic"
    (folder / "images" / OTHER).write_bytes(heic)
    ((code, message),) = [(f["code"], f["message"]) for f in checked(folder)[1]["findings"] if f["level"] != "info"]
    assert code == "photo/unreadable" and "convert it to png or jpg" in message
    (folder / "images" / OTHER).rename(folder / "images" / "step_01.HEIC")
    log = folder / "force.csv"
    log.write_text(log.read_text().replace(OTHER, "step_01.HEIC"))
    ((code, message),) = [(f["code"], f["message"]) for f in checked(folder)[1]["findings"] if f["level"] != "info"]
    assert code == "photo/unreadable" and "convert it to png or jpg" in message


def test_one_photo_that_a_run_would_refuse_is_a_warning(folder):
    black(folder / "images" / OTHER, None)
    specimen = read_specimen(folder, Settings().intake)
    (told,) = look_at_photos(specimen, Settings().vision)
    assert (told.code, told.level) == ("photo/blank", "warning")


def test_all_values_that_are_missing_or_wrong_are_named_at_once(folder):
    file = folder / "specimen.toml"
    lines = [line for line in file.read_text().splitlines() if not line.startswith(("length_mm", "diameter_mm"))]
    file.write_text("\n".join(lines))
    message = checked(folder)[1]["findings"][0]["message"]
    assert "length_mm and diameter_mm are missing" in message and "add length_mm" in message
    at = lines.index("[specimen]") + 1
    file.write_text("\n".join([*lines[:at], "length_mm = 0.0", "diameter_mm = 0.0", *lines[at:]]))
    message = checked(folder)[1]["findings"][0]["message"]
    assert "length_mm = 0.0 and diameter_mm = 0.0 cannot be used" in message


def test_a_wrong_value_hides_no_missing_one_and_no_missing_file(folder):
    file = folder / "specimen.toml"
    text = file.read_text().replace("length_mm = 181.0000", "length_mm = 0").replace("diameter_mm = 4.600\n", "")
    file.write_text(text.replace('moving_bearing = "left"', 'moving_bearing = "links"\ncolour = "red"'))
    (folder / "force.csv").unlink()
    shutil.rmtree(folder / "images")
    code, row = checked(folder)
    assert (code, row["runs"]) == (3, False)
    told = [(finding["code"], finding["message"]) for finding in row["findings"]]
    assert [code for code, _ in told] == [
        "toml/wrong-value",
        "toml/unknown-key",
        "toml/wrong-value",
        "toml/missing-key",
        "folder/no-force-log",
        "folder/no-photos",
    ]
    for words, (_, message) in zip(
        ("length_mm = 0 cannot", "colour", "links", "diameter_mm is missing", "force log", "no photos"),
        told,
        strict=True,
    ):
        assert words in message


def test_a_description_that_cannot_be_parsed_hides_no_missing_file(folder):
    (folder / "specimen.toml").write_text("[specimen\n")
    (folder / "force.csv").unlink()
    shutil.rmtree(folder / "images")
    codes = {finding["code"] for finding in checked(folder)[1]["findings"]}
    assert codes == {"toml/syntax", "folder/no-force-log", "folder/no-photos"}


def test_a_misspelt_size_is_told_once(folder):
    file = folder / "specimen.toml"
    file.write_text(file.read_text().replace("diameter_mm", "diamter_mm"))
    assert [finding["code"] for finding in checked(folder)[1]["findings"]] == ["toml/unknown-key"]


def test_a_spreadsheet_in_place_of_the_log_is_named(folder):
    (folder / "force.csv").unlink()
    (folder / "Messung 3.xlsx").write_bytes(b"PK\x03\x04")
    message = checked(folder)[1]["findings"][0]["message"]
    assert "has no force log but the spreadsheet Messung 3.xlsx; open it and save the table of forces" in message

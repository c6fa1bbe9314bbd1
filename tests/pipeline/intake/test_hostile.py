"""One folder that cannot be read, whatever is wrong with it, is one entry with its sentence; the others are read."""

import ctypes
import importlib
import json
import os
import subprocess
import sys
import time

import cloudpickle
import pytest
from click.testing import CliRunner

from pipeline.batch.orders import result_names
from pipeline.cli import main
from pipeline.errors import InputError
from pipeline.intake.folder import find_specimens, find_undescribed
from pipeline.intake.specimenfile import read_specimen_file
from pipeline.intake.tomldepth import too_deep
from pipeline.settings import Settings
from pipeline.settings.intake import IntakeSettings
from tests.pipeline.intake.conftest import TOML
from tests.pipeline.intake.timing import spent

SETTINGS = IntakeSettings()
BOARD = "board = {columns = 9, rows = 6, square_mm = 10.0}\n"
BAD = {
    "hexadecimal": (TOML.replace("181.0", "0x" + "F" * 5000), "toml/wrong-value"),
    "long name": (TOML + f'calibration = "{"x" * 300}"\n' + BOARD, "camera/no-calibration-folder"),
    "long path": (TOML + f'calibration = "{"a/" * 100_000}"\n' + BOARD, "toml/wrong-value"),
    "dotted key": (TOML + "a." * 20_000 + "a = 1\n", "toml/syntax"),
    "notes": (TOML.replace("[camera]", f"notes = 0x{'F' * 5000}\n[camera]"), "toml/wrong-value"),
}


def ordinary_user():
    """Take from root, in a process to come, what makes it read everything; nobody else has it."""
    for capability in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
        ctypes.CDLL(None).prctl(24, capability, 0, 0, 0)  # PR_CAPBSET_DROP


def as_ordinary_user(*arguments):
    command = [sys.executable, "-m", "pipeline", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, preexec_fn=ordinary_user, check=False)


@pytest.mark.parametrize("what", BAD)
def test_description_nobody_foresaw_is_one_sentence(what, specimen_folder):
    toml, code = BAD[what]
    folder = specimen_folder(toml=toml)
    with pytest.raises(InputError) as refused:
        folder.read()
    assert refused.value.code == code
    assert len(str(refused.value.said)) < 500


def test_a_batch_of_hostile_folders_has_an_entry_for_each(specimen_folder, tmp_path):
    for name, (toml, _) in BAD.items():
        specimen_folder(toml=toml, name=f"batch/{name}")
    for name in ("locked", "no entry"):
        specimen_folder(name=f"batch/{name}")
    (tmp_path / "batch/not listed").mkdir()
    (tmp_path / "batch/locked").chmod(0)
    (tmp_path / "batch/no entry").chmod(0o444)
    (tmp_path / "batch/not listed").chmod(0o300)
    options = ["-o", tmp_path / "out", "--json", "--no-reports", "--set", "batch.in_process=true"]
    done = as_ordinary_user("run", tmp_path / "batch", *options)
    for name in ("locked", "no entry", "not listed"):
        (tmp_path / "batch" / name).chmod(0o700)
    assert done.returncode == 3, done.stderr
    found = {entry["name"]: entry["code"] for entry in json.loads(done.stdout)["specimens"]}
    closed = dict.fromkeys(("locked", "no entry", "not listed"), "file/unreadable")
    assert found == {name: code for name, (_, code) in BAD.items()} | closed


def test_check_as_an_ordinary_user_reads_what_it_can(specimen_folder, tmp_path):
    specimen_folder(name="batch/good")
    specimen_folder(name="batch/locked")
    (specimen_folder(name="batch/no photos", log=None).path / "images").chmod(0)
    (tmp_path / "batch/locked").chmod(0)
    (tmp_path / "batch/no photos").chmod(0o300)  # what is in it must be known by name
    done = as_ordinary_user("check", tmp_path / "batch", "--json")
    for name in ("batch/locked", "batch/no photos", "batch/no photos/images"):
        (tmp_path / name).chmod(0o700)
    assert done.returncode == 3, done.stderr
    rows = json.loads(done.stdout)["specimens"]
    assert not any(row["runs"] for row in rows)  # the photos of the good one show no cable
    assert {finding["code"].partition("/")[0] for finding in rows[0]["findings"]} == {"photo"}
    assert [row["findings"][0]["code"] for row in rows[1:]] == ["file/unreadable", "file/unreadable"]
    assert "(permission denied)" in rows[1]["findings"][0]["message"]


def test_check_has_a_time_limit(specimen_folder, tmp_path, monkeypatch, request):
    def slow(folder, settings):  # on any machine
        time.sleep(60.0)
        raise RuntimeError("nobody ended it")

    module = importlib.import_module("pipeline.cli.check")
    monkeypatch.setattr(module, "checked", slow)
    cloudpickle.register_pickle_by_value(module)  # so that the workers have it
    request.addfinalizer(lambda: cloudpickle.unregister_pickle_by_value(module))
    for name in ("one", "two"):
        specimen_folder(name=f"batch/{name}")
    done = CliRunner().invoke(main, ["check", str(tmp_path / "batch"), "--json", "--timeout", "0.0001"])
    assert done.exit_code == 3
    told = [row["findings"][0] for row in json.loads(done.stdout)["specimens"]]
    assert [finding["code"] for finding in told] == ["specimen/timeout"] * 2
    assert told[0]["message"] == "not finished within 0.0001 s; raise --timeout if that is too short"


def test_check_tells_what_nobody_foresaw(specimen_folder, monkeypatch):
    def broken(folder, settings):
        raise RecursionError("deeper and deeper")

    monkeypatch.setattr("pipeline.intake.folder.read_specimen", broken)
    done = CliRunner().invoke(main, ["check", str(specimen_folder().path), "--json"])
    assert done.exit_code == 3
    assert json.loads(done.stdout)["specimens"][0]["findings"][0]["code"] == "specimen/program-error"


def test_an_id_that_cannot_be_read_is_the_folders_name(specimen_folder, monkeypatch):
    def broken(folder, settings):
        raise ValueError("nobody foresaw this")

    monkeypatch.setattr("pipeline.batch.orders.read_specimen_file", broken)
    assert result_names([specimen_folder(name="cable").path], Settings()) == ["cable"]


def test_names_of_results_are_different_and_no_longer_than_a_file_system_takes(specimen_folder, tmp_path):
    toml = TOML.replace("[specimen]", '[specimen]\nid = "one"')
    ids = [specimen_folder(name=f"batch/{part}/{'c' * 250}", toml=toml).path for part in ("a", "b")]
    names = [specimen_folder(name=f"batch/{name}").path for name in ("x:y", "x*y", os.fsdecode(b"z\xff"))]
    also = specimen_folder(name=os.fsdecode(b"batch/z\xfe")).path
    found = result_names([*ids, *names, also], Settings())
    assert len({name.casefold() for name in found}) == len(found)
    assert max(len(name.encode()) for name in found) <= 200
    assert found == result_names([*ids, *names, also], Settings())
    assert result_names(ids[:1], Settings()) == ["one"]


def test_links_from_each_folder_to_each_other_are_followed_once(specimen_folder, tmp_path, monkeypatch):
    """Seven folders linked with each other have 13,700 ways through them."""
    specimen_folder(name="batch/cable")
    folders = [tmp_path / "batch" / f"f{k}" for k in range(7)]
    for folder in folders:
        folder.mkdir()
        for other in folders:
            if other != folder:
                (folder / other.name).symlink_to(other)
    listed = []
    scandir = os.scandir
    monkeypatch.setattr(os, "scandir", lambda path: listed.append(path) or scandir(path))
    assert find_specimens([tmp_path / "batch"], SETTINGS) == [tmp_path / "batch/cable"]
    assert len(listed) == 8


def test_an_undescribed_folder_of_too_many_photos_costs_no_other(specimen_folder, tmp_path):
    specimen_folder(name="batch/cable")
    forgotten = specimen_folder(name="batch/forgotten", photos=[f"images/{k}.png" for k in range(5)])
    (forgotten.path / "specimen.toml").unlink()
    assert find_undescribed([tmp_path / "batch"], IntakeSettings(photos_max=4)) == [forgotten.path]


def test_a_pipe_among_the_calibration_photos_is_not_opened(specimen_folder):
    folder = specimen_folder(toml=TOML.replace("scale_px_per_mm = 11.0", 'calibration = "board"\n' + BOARD))
    folder.write("board/a.png", b"\x89PNG")
    os.mkfifo(folder.path / "board/b.png")
    assert folder.message("photo/not-a-file").startswith("board/b.png: is no ordinary file")
    assert "board/a.png" in folder.read().hashes


@pytest.mark.parametrize("name", ["x" * 300, "a/" * 50_000 + "b.png"])
def test_a_photo_of_an_impossible_name_is_a_finding(name, specimen_folder):
    log = (specimen_folder().path / "force.csv").read_text().replace("step_1.png", name)
    findings = specimen_folder(log=log, name="other").read().findings
    assert [f.code for f in findings if f.code in ("photo/missing", "photo/outside")]
    assert max(len(finding.message) for finding in findings) < 500


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a.b.c = 1", None),
        ("x = [1.5, 2.5, 3.5, 4.5, 5.5]", None),
        ("x = \"[[[[[[a.b.c.d.e.f\"\ny = '''\n{{{{{{\n'''  # a.b.c.d.e.f", None),
        ('x = """a "quoted" \\""" still"""\n[a.b.c.d.e.f]', 2),
        ('x = """"two""""" \n"a"."b".c.d.e.f = 1', 2),
        ("x = 1\n\ny = [[[[[[1]]]]]]", 3),
        ("x = {a = {b = {c = {d = {e = 1}}}}}", 1),
        ('"' * 3 + "a.b.c.d.e.f", None),
    ],
)
def test_depth_of_a_text(text, line):
    assert too_deep(text, 4) == line


@pytest.mark.parametrize("what", ["bracket in a text", "long key"])
def test_complaints_take_time_in_proportion(what, tmp_path):
    """Four times the text: four times the time where it is linear, 16 or 64 where each place is tried with each."""

    def refuse(count):
        more = {"bracket in a text": f'notes = """\n[{" " * count}"""\n[foo]', "long key": f"{'e' * 100 * count} = 1"}
        (tmp_path / "specimen.toml").write_text(f"[specimen]\n{more[what]}\n")
        with pytest.raises(InputError):
            read_specimen_file(tmp_path, SETTINGS)

    assert spent(refuse, 2000) < 8.0 * spent(refuse, 500)

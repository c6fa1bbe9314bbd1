"""A photographed specimen through the command, in its own process and in a worker: the same, byte for byte."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

ROOT = Path(__file__).resolve().parents[1]
SPECIMEN = ROOT / "fixtures" / "specimens" / "three"
FILES = {"result.json", "characteristic.csv", "centerlines.csv", "report.html", "report.pdf", "entry.json"}


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Folder with the outputs of both ways, and what the command printed.

    ``own``: in the process of the command. ``worker``: later, from another folder, in another time zone, other hashes.
    """
    here = tmp_path_factory.mktemp("real")
    command = [sys.executable, "-m", "pipeline", "run", SPECIMEN, "-o", here / "own", "--json"]
    own = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert own.returncode == 0, own.stderr
    subprocess.run(
        [sys.executable, "-m", "pipeline", "run", ".", "-o", here / "worker", "--workers", "2", "--timeout", "600"],
        cwd=SPECIMEN,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "77", "TZ": "Asia/Tokyo", "LC_ALL": "C"},
        check=True,
    )
    return here, own


def test_everything_is_written(measured):
    here, done = measured
    assert {path.name for path in (here / "own/three").iterdir()} >= FILES
    assert {"index.html", "summary.csv", "result.schema.json"} <= {path.name for path in (here / "own").iterdir()}
    (row,) = json.loads(done.stdout)["specimens"]
    assert (row["id"], row["status"]) == ("three", "measured")
    assert "three" in (here / "own/summary.csv").read_text()


def test_result_keeps_its_published_schema(measured):
    here, _ = measured
    schema = json.loads((here / "own/result.schema.json").read_text())
    result = json.loads((here / "own/three/result.json").read_text())
    jsonschema.validate(result, schema)
    assert result["schema"] == "cablebend/result/1"
    assert [photo["status"] for photo in result["photos"]] == ["traced"] * 3


def unclocked(folder):
    """Every file a run left but its log, by name; without the time in the one place of two files that have it."""
    files = (path for path in folder.rglob("*") if path.is_file() and ".cablebend" not in path.parts)
    data = {path.relative_to(folder).as_posix(): path.read_bytes() for path in files if path.name != "cablebend.log"}
    for name in ("three/result.json", "three/report.html"):
        data[name], count = re.subn(rb"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00", b"", data[name])
        assert count == 1
    return data


def test_same_bytes_in_every_file_but_for_the_time(measured):
    here, _ = measured
    own, worker = unclocked(here / "own"), unclocked(here / "worker")
    assert own.keys() == worker.keys()
    assert {name for name in own if own[name] != worker[name]} == set()

"""A photographed specimen through the command, in its own process and in a worker: the same, byte for byte."""

import json
from pathlib import Path

import jsonschema
import pytest
from click.testing import CliRunner

from pipeline.cli import main

SPECIMEN = Path(__file__).resolve().parents[1] / "fixtures" / "specimens" / "three"
FILES = {"result.json", "characteristic.csv", "centerlines.csv", "report.html", "report.pdf", "entry.json"}


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Output folders of both ways, and what the command printed."""
    here = tmp_path_factory.mktemp("real")
    ways = {"own": (), "worker": ("--timeout", "600")}
    done = {}
    for way, options in ways.items():
        arguments = ["run", str(SPECIMEN), "-o", str(here / way), "--json", *options]
        done[way] = CliRunner().invoke(main, arguments)
        assert done[way].exit_code == 0, done[way].stderr
    return here, done


def test_everything_is_written(measured):
    here, done = measured
    assert {path.name for path in (here / "own/three").iterdir()} >= FILES
    assert {"index.html", "summary.csv", "result.schema.json"} <= {path.name for path in (here / "own").iterdir()}
    (row,) = json.loads(done["own"].stdout)["specimens"]
    assert (row["id"], row["status"]) == ("three", "measured")
    assert "three" in (here / "own/summary.csv").read_text()


def test_result_keeps_its_published_schema(measured):
    here, _ = measured
    schema = json.loads((here / "own/result.schema.json").read_text())
    result = json.loads((here / "own/three/result.json").read_text())
    jsonschema.validate(result, schema)
    assert result["schema"] == "cablebend/result/1"
    assert [photo["status"] for photo in result["photos"]] == ["traced"] * 3


def test_same_result_in_a_worker(measured):
    here, _ = measured
    own, worker = (json.loads((here / way / "three/result.json").read_text()) for way in ("own", "worker"))
    for result in (own, worker):
        del result["provenance"]["clock"]
        del result["provenance"]["command"]  # names the output folder
        del result["provenance"]["settings"]["batch"]  # the timeout
    assert own == worker
    for table in ("characteristic.csv", "centerlines.csv"):
        assert (here / "own/three" / table).read_bytes() == (here / "worker/three" / table).read_bytes()

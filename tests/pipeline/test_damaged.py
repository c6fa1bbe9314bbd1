"""A result.json that is cut off, another's, of wrong values or huge: one sentence for it, and the others are drawn."""

import json
import os
import time

import pandas as pd
import pytest
from click.testing import CliRunner

from pipeline.batch.store import write_entry
from pipeline.cli import main
from pipeline.report.tables import write_result
from pipeline.result.row import as_entry, index_row
from tests.pipeline.report.virtual_index import write_index
from tests.pipeline.report.virtual_result import measured_result


def changed(document, *path, value):
    """The document with another value at a place."""
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return json.dumps(document)


CURVE = ("inverse", "curve")
DAMAGE = {
    "cut off": lambda text, _: text[: len(text) // 2],
    "empty": lambda text, _: "",
    "not json": lambda text, _: "PK\x03\x04" * 99,
    "other schema": lambda _, d: changed(d, "schema", value="cablebend/result/9"),
    "another's": lambda _, d: '{"results": [1, 2, 3]}',
    "a list": lambda _, d: "[]",
    "deep": lambda _, d: "[" * 100_000,
    "wrong type": lambda _, d: changed(d, "steps", 1, "force_N", value=[2.3]),
    "nan": lambda _, d: changed(d, *CURVE, "tangent_Nm2", 3, value=float("nan")),
    "huge": lambda _, d: changed(d, *CURVE, "tangent_Nm2", 3, value=1e300),
    "short list": lambda _, d: changed(d, *CURVE, "tangent_Nm2", value=[0.02]),
    "no order": lambda _, d: changed(d, *CURVE, "kappa_per_m", 3, value=-5.0),
    "short photo": lambda _, d: changed(d, "photos", 2, "x_m", value=[0.0]),
    "50 MB": lambda text, _: '{"schema": "cablebend/result/1", "status": "' + 50_000_000 * "x" + '"}',
}


def stored(out, *names, photos=None):
    """Results as a run leaves them, with their entries; of ``photos`` only so many, where each is drawn."""
    result = measured_result()
    result = result.model_copy(update={"photos": result.photos[:photos]})
    for name in names:
        named = result.model_copy(update={"specimen": result.specimen.model_copy(update={"id": name})})
        write_result(named, out / name)
        write_entry({"status": "measured", "row": as_entry(index_row(named))}, out / name)
    return result


def call(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def text(tmp_path_factory):
    out = tmp_path_factory.mktemp("one")
    stored(out, "a")
    return (out / "a/result.json").read_text(encoding="utf-8")


@pytest.mark.parametrize("how", DAMAGE)
def test_one_sentence_for_it(how, text, tmp_path):
    stored(tmp_path, "b")
    bad = tmp_path / "a/result.json"
    bad.parent.mkdir()
    bad.write_text(DAMAGE[how](text, json.loads(text)), encoding="utf-8")
    for command in (("predict", bad, "--displacement-mm", "4"), ("compare", bad, tmp_path / "b")):
        done = call(*command)
        assert done.exit_code == 2
        assert done.exception is None or isinstance(done.exception, SystemExit)
        (line,) = done.stderr.splitlines()
        told = "is of version cablebend/result/9" if how == "other schema" else "is no readable result"
        assert f"a/result.json: {told}" in line and len(line) < 500
    _, summary = write_index(tmp_path, tmp_path)
    table = pd.read_csv(summary).set_index("id")
    assert dict(table.status) == {"a": "failed", "b": "measured"}
    assert "cannot be read" in table.reason["a"]


def test_report_draws_the_others(tmp_path):
    stored(tmp_path, "b", "c", photos=1)
    (tmp_path / "b/result.json").write_text("{")
    done = call("report", tmp_path)
    assert done.exit_code == 0
    assert "b: result.json cannot be read: it is no readable result" in done.stderr
    assert (tmp_path / "c/report.html").stat().st_size > 10_000
    table = pd.read_csv(tmp_path / "summary.csv").set_index("id")
    assert dict(table.status) == {"b": "failed", "c": "measured"}


def test_a_result_changed_after_its_entry_is_read_itself(tmp_path):
    result = stored(tmp_path, "a")
    partial = result.model_copy(update={"status": "partial"})
    path = write_result(partial, tmp_path / "a")
    for later, status in ((0.0, "measured"), (60.0, "partial")):
        os.utime(path, (time.time() + later, time.time() + later))
        assert list(pd.read_csv(write_index(tmp_path, tmp_path)[1]).status) == [status]


@pytest.mark.parametrize(
    "entry", ["", "[]", '{"row": 3}', '{"row": {"version": 1, "id": 7}}', '{"row": {"version": 99}}']
)
def test_an_entry_that_is_none_costs_nothing(entry, tmp_path):
    stored(tmp_path, "a")
    (tmp_path / "a/entry.json").write_text(entry)
    assert list(pd.read_csv(write_index(tmp_path, tmp_path)[1]).status) == ["measured"]


@pytest.mark.parametrize(
    "numbers",
    [
        ("--displacement-mm", "nan"),
        ("--displacement-mm", "inf"),
        ("--displacement-mm", "1e12"),
        ("--displacement-mm", "-1e12"),
        ("--displacement-mm", "4,1e300"),
        ("--displacement-mm", "4", "--length-mm", "nan"),
        ("--displacement-mm", "4", "--length-mm", "inf"),
        ("--displacement-mm", "1e-12", "--length-mm", "1e-9"),
        ("--displacement-mm", "4", "--length-mm", "1e15"),
    ],
)
def test_predict_refuses_absurd_numbers(numbers, tmp_path):
    stored(tmp_path, "a")
    done = call("predict", tmp_path / "a", *numbers)
    assert done.exit_code == 2
    assert done.stderr.splitlines()[-1].startswith("Error: ")

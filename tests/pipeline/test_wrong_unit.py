"""A batch of three repeat specimens, one of whose logs has its forces in mN under a header of N: it is in no mean."""

import json
import re

import pandas as pd
import pytest
from click.testing import CliRunner

from fixtures.make import SMALL, hidden_specimen
from pipeline.cli import main
from pipeline.simulate import Experiment, protocol

WRONG = "cable-2"


def in_millinewton(log: str) -> str:
    """The log with forces a thousand times as large; its header stays."""
    head, *rows = log.splitlines()
    column = head.split(",").index("force_N")
    cells = [row.split(",") for row in rows]
    for row in cells:
        row[column] = repr(1e3 * float(row[column]))
    return "\n".join([head, *map(",".join, cells)]) + "\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("three")
    for number in range(3):
        specimen = folder / "batch" / f"cable-{number}"
        usual = Experiment(id=specimen.name, seed=200 + number, displacements_m=protocol("three", 3, 0.0045))
        hidden_specimen(specimen, usual, photography=SMALL)
        toml = specimen / "specimen.toml"
        toml.write_text(toml.read_text().replace("[specimen]", '[specimen]\ntype = "HV 35"', 1))
    log = folder / "batch" / WRONG / "force.csv"
    log.write_text(in_millinewton(log.read_text()))
    options = ["--no-reports", "--set", "batch.in_process=true", "--json"]
    done = CliRunner().invoke(main, ["run", str(folder / "batch"), "-o", str(folder / "out"), *options])
    return folder / "out", done


def test_exit_code_and_output_say_so(run):
    _, done = run
    assert done.exit_code == 1
    document = json.loads(done.stdout)
    assert document["counts"] == {"total": 3, "measured": 3, "failed": 0, "kept": 0}
    assert document["unusable"] == 1
    assert [s["id"] for s in document["specimens"] if not s["usable"]] == [WRONG]


def test_result_and_summary_say_so(run):
    out, _ = run
    result = json.loads((out / WRONG / "result.json").read_text())
    answer = result["answer"]
    assert result["diagnosis"] is None  # nothing is concluded from numbers of no cable
    assert [finding["code"] for finding in result["findings"] if finding["level"] != "info"] == ["size/force"]
    assert answer["usable"] is False and "1000 times too large" in answer["reason"]
    table = pd.read_csv(out / "summary.csv").set_index("id")
    assert list(table[~table.usable].index) == [WRONG]
    assert (table.status[WRONG], table.verdict[WRONG]) == ("measured", "none")
    assert table.worst_finding[WRONG] == "size/force"
    assert set(table.answer_method) <= {"inverse", "balance", "extended"}


def test_no_mean_holds_it(run):
    out, _ = run
    table = pd.read_csv(out / "summary.csv").set_index("id")
    page = (out / "index.html").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    told = re.search(r"2 specimens, compared .*?>mean</th><td>([\d.]+) ± [\d.]+ (\S+) m²", page)
    mean = float(told[1]) * {"mN": 1e-3, "N": 1.0, "kN": 1e3}[told[2]]
    right = table[table.usable]
    assert right.f_EI_high_Nm2.min() < mean < right.f_EI_low_Nm2.max()
    assert "because their data are at fault: 1." in page

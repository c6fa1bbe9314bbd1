"""`cablebend run` ended from outside: SIGTERM is an interruption, in its own process and with workers."""

import os
import signal
import subprocess
import sys

import psutil
import pytest

from tests.pipeline.cheap_batch import PATIENCE_S, ROOT, wait_for, write_specimens

PROGRAM = """
from pipeline.batch import batch
from pipeline.cli import main
from tests.pipeline.cheap_batch import cheap_stages

if __name__ == "__main__":
    batch.PIPELINE = cheap_stages()
    main()
"""


@pytest.mark.parametrize("to_group", [False, True], ids=["process", "group"])
@pytest.mark.parametrize("ways", [("--set", "batch.in_process=true"), ("--workers", "2")], ids=["own", "workers"])
def test_sigterm_is_an_interruption(ways, to_group, tmp_path):
    write_specimens(tmp_path / "batch", ["a"])
    write_specimens(tmp_path / "batch", ["b"], notes="hang")
    command = [sys.executable, "-c", PROGRAM, "run", "batch", "-o", "out", *ways]
    process = subprocess.Popen(
        command, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    wait_for((tmp_path / "out/a/entry.json").exists, process)
    family = psutil.Process(process.pid).children(recursive=True)
    # of a service or under `timeout` all processes of the command get it
    (os.killpg if to_group else os.kill)(process.pid, signal.SIGTERM)
    table, told = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert told.splitlines()[-1] == "interrupted; the same command resumes"
    assert "Traceback" not in told
    assert table.startswith("a  measured")
    assert (tmp_path / "out/index.txt").read_text().count("\n") == 1
    _, left = psutil.wait_procs(family, timeout=PATIENCE_S)
    assert left == []

"""Killed or without power between any two operations on files, a run or a report loses no stored result."""

import subprocess
import sys

import pytest

from tests.pipeline.cheap_batch import PATIENCE_S, ROOT

LEAST = {"run": 40, "report": 60}  # two results, one of two files new and one replaced, or both replaced, and an index


@pytest.mark.parametrize("how", ["killed", "power", "reordered"])
@pytest.mark.parametrize("action", LEAST)
def test_nothing_is_lost_wherever_it_is_cut_off(action, how, tmp_path):
    command = [sys.executable, "-m", "tests.pipeline.cut_batches", action, how, str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) >= LEAST[action]
